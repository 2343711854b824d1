//! Smoothing quintic splines.

use std::f64::consts::{LN_2, TAU};
use std::sync::Arc;

use crate::SpatialError;
use crate::adaptive::{ExpectedNoise, FEWEST_ADAPTIVE};
use crate::adaptive_fit::{AdaptiveFit, Uncertainty};
use crate::basis::{BasisValues, ORDER};
use crate::beyond::Posterior;
use crate::derivative::Derivative;
use crate::equations::{LocalWeight, PenaltyWeights, Scratch};
use crate::low_passed::LowPassed;
use crate::noise_colour::{NoiseColour, ResidualSpectra, stretches};
use crate::system::{LIGHT, LIGHTER, SplineSystem, centred};
use crate::weight_search::LOWEST_LOG_WEIGHT;

/// Samples from one to the next at which the cutoff is looked at for the colour of the noise: it changes more slowly.
const SAMPLES_A_CUTOFF: usize = 8;

/// How much a spline smooths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// As much as the samples themselves ask for (REML, see [`crate::WeightSearch`]): exact samples
    /// are interpolated, jittered ones smoothed.
    #[default]
    Automatic,
    /// The same, for the sake of a derivative: near the weight of the greatest likelihood that with
    /// the least error of this derivative, found by comparing the halves of the samples.
    AutomaticFor(Derivative),
    /// As much as the samples around each time ask for: much at rest, little in a burst.
    Adaptive {
        /// What is expected of the samples' noise.
        expected: ExpectedNoise,
    },
    /// Not at all: the spline passes through the samples (up to 1e-8 of the fifth derivative's
    /// penalty, which steadies gaps).
    Interpolate,
    /// A low-pass of zero phase whose response `1 / (1 + (f / cutoff)^10)` is one half at this
    /// frequency, Hz.
    CutoffHz(f64),
    /// The penalty's weight itself, for times counted in median sample intervals; no unit.
    Weight(f64),
    /// As smooth as can be within this root mean square distance per channel from the samples, in
    /// their unit (Reinsch 1967): for samples whose errors are known to be so large. IMUSim's
    /// splines choose so, with 1 mm.
    ResidualStd(f64),
}

/// The weight of a spline's penalty, for times counted in median sample intervals; no unit.
#[derive(Clone, Debug, PartialEq)]
pub enum SplineWeight {
    /// The same at all times.
    Uniform(f64),
    /// One for each interval between samples.
    Local(Vec<LocalWeight>),
}

impl SplineWeight {
    pub(crate) fn of_penalty(&self) -> PenaltyWeights<'_> {
        match self {
            Self::Uniform(weight) => PenaltyWeights::Uniform(*weight),
            Self::Local(weights) => PenaltyWeights::Local(weights),
        }
    }
}

impl Smoothing {
    /// The one weight for samples on these times; [`Smoothing::Adaptive`] has one only where there
    /// are too few of them to learn more.
    fn uniform_weight<const C: usize>(
        self,
        system: &SplineSystem,
        values: &[[f64; C]],
    ) -> Result<f64, SpatialError> {
        let lowest = 10f64.powf(LOWEST_LOG_WEIGHT);
        match self {
            Self::Automatic | Self::Adaptive { .. } => system.search(values, None),
            Self::AutomaticFor(derivative) => system.search(values, Some(derivative)),
            Self::Interpolate => Ok(lowest),
            Self::CutoffHz(rate_hz) if !(rate_hz > 0.0 && rate_hz.is_finite()) => {
                Err(SpatialError::BadRate { rate_hz })
            }
            Self::CutoffHz(cutoff_hz) => {
                Ok(system.equations.weight_of_cutoff(cutoff_hz).max(lowest))
            }
            Self::Weight(weight) if !(weight >= 0.0 && weight.is_finite()) => {
                Err(SpatialError::BadWeight { weight })
            }
            Self::Weight(weight) => Ok(weight.max(lowest)),
            Self::ResidualStd(std) if !(std >= 0.0 && std.is_finite()) => {
                Err(SpatialError::BadDistance { std })
            }
            Self::ResidualStd(std) => system.weight_of_residual(values, std),
        }
    }
}

/// Where a spline is asked, and of which derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At<'a> {
    /// The knot interval.
    pub first: usize,
    /// The derivative's, of what [`crate::equations::SplineEquations::basis_at`] gave.
    pub row: &'a [f64; ORDER],
    pub order: i32,
    /// Of the smoothing there, Hz.
    pub cutoff_hz: f64,
    /// To the nearer end of the samples, s.
    pub to_end_s: f64,
}

/// A quintic spline through or near samples of C channels, which share one smoothing (so that
/// turning the axes turns the result).
#[derive(Clone, Debug)]
pub struct SmoothingSpline<const C: usize> {
    system: Arc<SplineSystem>,
    coefficients: Vec<[f64; C]>,
    weight: SplineWeight,
    /// And its lane.
    uncertainty: Option<(Arc<Uncertainty>, usize)>,
    /// Of the samples' noise, where it was looked for and is not white.
    colour: Option<Arc<NoiseColour>>,
}

impl<const C: usize> SmoothingSpline<C> {
    /// Fits samples (N, C) at `seconds` (N), uneven and with gaps as they may be. O(N).
    ///
    /// # Errors
    /// Times that do not increase, anything not finite, lengths that differ, fewer than two
    /// samples, a bad weight.
    pub fn fit(
        seconds: &[f64],
        values: &[[f64; C]],
        smoothing: Smoothing,
    ) -> Result<Self, SpatialError> {
        Self::fit_on(&Arc::new(SplineSystem::new(seconds)?), values, smoothing)
    }

    /// As [`SmoothingSpline::fit`], on times whose equations are made already.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`].
    pub fn fit_on(
        system: &Arc<SplineSystem>,
        values: &[[f64; C]],
        smoothing: Smoothing,
    ) -> Result<Self, SpatialError> {
        if let Smoothing::Adaptive { expected } = smoothing
            && values.len() >= FEWEST_ADAPTIVE
        {
            let fit = AdaptiveFit::learn(&system.equations, values.to_vec(), [C], [expected])?;
            return Ok(Self::of_lane(system, &fit, 0));
        }
        system.equations.check(values)?;
        let (first, centred) = centred(values);
        let mut weight = smoothing.uniform_weight(system, values)?;
        let is_found = matches!(
            smoothing,
            Smoothing::Automatic | Smoothing::AutomaticFor(_) | Smoothing::Adaptive { .. }
        );
        loop {
            match Self::solved(system, (first, &centred), weight) {
                Err(SpatialError::Singular { .. }) if is_found && weight > LIGHT => {
                    weight *= LIGHTER;
                }
                spline => return spline,
            }
        }
    }

    /// The spline of this weight. The basis functions sum to one, so that the constant that was taken
    /// off may go onto the coefficients.
    fn solved(
        system: &Arc<SplineSystem>,
        (constant, values): ([f64; C], &[[f64; C]]),
        weight: f64,
    ) -> Result<Self, SpatialError> {
        let mut scratch = Scratch::default();
        system.equations.solve(values, weight, &mut scratch)?;
        for coefficient in &mut scratch.coefficients {
            for c in 0..C {
                coefficient[c] += constant[c];
            }
        }
        Ok(Self {
            system: system.clone(),
            coefficients: scratch.coefficients,
            weight: SplineWeight::Uniform(weight),
            uncertainty: None,
            colour: None,
        })
    }

    /// The spline of one of the series that were fitted at once, the constant as in
    /// [`SmoothingSpline::solved`].
    pub(crate) fn of_lane<const W: usize, const L: usize>(
        system: &Arc<SplineSystem>,
        fit: &AdaptiveFit<W, L>,
        lane: usize,
    ) -> Self {
        let coefficient = |of_all: &[f64; W]| {
            std::array::from_fn(|c| of_all[L * c + lane] + fit.constant[L * c + lane])
        };
        let of_lane = |[fifth, second]: &[[f64; L]; 2]| LocalWeight {
            fifth: fifth[lane],
            second: second[lane],
        };
        Self {
            system: system.clone(),
            coefficients: fit.coefficients.iter().map(coefficient).collect(),
            weight: SplineWeight::Local(fit.weights.iter().map(of_lane).collect()),
            uncertainty: Some((fit.uncertainty.clone(), lane)),
            colour: None,
        }
    }

    /// Value, first and second derivative (per s, per s^2) at a time; times outside the samples are
    /// moved to the nearest end.
    pub fn evaluate(&self, seconds: f64) -> [[f64; C]; 3] {
        let (first, values) = self.system.equations.basis_at(seconds);
        self.combine(first, &values)
    }

    /// As [`SmoothingSpline::evaluate`], from what [`crate::equations::SplineEquations::basis_at`] gave.
    #[inline]
    pub(crate) fn combine(&self, first: usize, values: &BasisValues) -> [[f64; C]; 3] {
        let mut result = [[0.0; C]; 3];
        let coefficients = &self.coefficients[first..first + ORDER];
        for j in 0..ORDER {
            let coefficient = &coefficients[j];
            for (derivative, row) in result.iter_mut().zip(values) {
                for c in 0..C {
                    derivative[c] += row[j] * coefficient[c];
                }
            }
        }
        result
    }

    /// Variance, mean over the channels, of value, first and second derivative (per s, per s^2) at a
    /// time: `r b^T (B^T B + P)^-1 b`, r the variance of the samples' noise, taken to be white, b the basis there. None
    /// but for [`Smoothing::Adaptive`]: the others do not tell noise from motion.
    pub fn variance(&self, seconds: f64) -> Option<[f64; 3]> {
        let (first, values) = self.system.equations.basis_at(seconds);
        let [value, slope, second] = values.each_ref().map(|row| self.variance_of(first, row));
        Some([value?, slope?, second?])
    }

    /// The variance of one of what [`crate::equations::SplineEquations::basis_at`] gave.
    #[inline]
    pub(crate) fn variance_of(&self, first: usize, row: &[f64; ORDER]) -> Option<f64> {
        let (uncertainty, lane) = self.uncertainty.as_ref()?;
        Some(uncertainty.variance(*lane, first, row))
    }

    /// Variance of the samples' noise over a knot interval, unit^2; none but for
    /// [`Smoothing::Adaptive`].
    #[inline]
    pub(crate) fn noise_over(&self, interval: usize) -> Option<f64> {
        let (uncertainty, lane) = self.uncertainty.as_ref()?;
        Some(uncertainty.noise_over(*lane, interval))
    }

    /// What a low-pass has made of the samples' noise before.
    #[inline]
    fn low_passed(&self) -> Option<LowPassed> {
        let (uncertainty, lane) = self.uncertainty.as_ref()?;
        uncertainty.low_passed(*lane)
    }

    /// Learns what the noise of the samples is like over the frequency. `value` gives a sample by its number and what
    /// the spline says there.
    pub(crate) fn learn_colour(&mut self, value: impl Fn(usize, &[f64; C]) -> [f64; C]) {
        let equations = &self.system.equations;
        let Some((starts, length)) = stretches(equations.sample_count, equations.interval) else {
            return;
        };
        let half_rate_hz = 0.5 / equations.interval;
        let (mut spectra, mut residuals) = (ResidualSpectra::default(), Vec::new());
        for start in starts {
            let samples = start..start + length;
            if !self.system.is_even(samples.clone()) {
                continue;
            }
            residuals.clear();
            residuals.extend(samples.clone().map(|sample| {
                let spline = self.at_sample(sample);
                let value = value(sample, &spline);
                std::array::from_fn::<f64, C, _>(|c| value[c] - spline[c])
            }));
            let cutoffs: Vec<f64> = samples
                .step_by(SAMPLES_A_CUTOFF)
                .map(|sample| self.cutoff_over(sample) / half_rate_hz)
                .collect();
            spectra.add(&residuals, &cutoffs);
        }
        self.colour = spectra.colour().map(Arc::new);
    }

    /// The value at a sample.
    fn at_sample(&self, sample: usize) -> [f64; C] {
        let mut value = [0.0; C];
        let row = &self.system.equations.collocation[sample];
        for (coefficient, b) in self.coefficients[sample..].iter().zip(row) {
            for c in 0..C {
                value[c] += b * coefficient[c];
            }
        }
        value
    }

    /// What it says of itself there; none but for [`Smoothing::Adaptive`].
    #[inline]
    pub(crate) fn posterior(&self, at: &At) -> Option<Posterior> {
        Some(Posterior {
            variance: self.variance_of(at.first, at.row)?,
            noise: self.noise_over(at.first)?,
            interval: self.system.equations.interval,
            to_end_s: at.to_end_s,
            low_passed: self.low_passed(),
            excess: self.excess(at.first, at.order, at.cutoff_hz),
        })
    }

    /// What noise leaves in the derivative of an order over a knot interval, over what white noise of the variance learnt there
    /// does: 1 but where noise was found not to be white.
    #[inline]
    fn excess(&self, interval: usize, order: i32, cutoff_hz: f64) -> f64 {
        let (Some(colour), Some(noise)) = (&self.colour, self.noise_over(interval)) else {
            return 1.0;
        };
        let level = colour.level(order, 2.0 * cutoff_hz * self.system.equations.interval);
        (level / noise).max(1.0)
    }

    /// Variance of a sample's noise as it is learnt around it, and of white noise that leaves as much as its own spectrum does in
    /// the derivative of an order behind a smoothing of this cutoff, unit^2; none but for [`Smoothing::Adaptive`].
    pub(crate) fn noise_behind(
        &self,
        sample: usize,
        order: i32,
        cutoff_hz: f64,
    ) -> Option<[f64; 2]> {
        let (uncertainty, lane) = self.uncertainty.as_ref()?;
        let around = uncertainty.noise_at(*lane, sample);
        let cutoff = 2.0 * cutoff_hz * self.system.equations.interval;
        let colour = self.colour.as_ref();
        let own = colour.map_or(around, |it| it.level(order, cutoff).max(around));
        Some([around, own])
    }

    /// Mean square over the channels of what the Gaussian kernel that the samples were smoothed with took off a derivative at a time:
    /// `f - (f(t - s) + f(t + s)) / 2`, s its standard deviation, which is `1 - cos(2 pi s f)` of the motion at a frequency f, where
    /// the kernel takes `1 - exp(-(2 pi s f)^2 / 2)`. 0 where none was found.
    pub(crate) fn smoothed_off(&self, derivative: Derivative, seconds: f64) -> f64 {
        let Some(step) = self.kernel_s() else {
            return 0.0;
        };
        let at = |seconds: f64| self.evaluate(seconds)[derivative.order()];
        let [before, here, after] = [seconds - step, seconds, seconds + step].map(at);
        let off = |c: usize| here[c] - 0.5 * (before[c] + after[c]);
        (0..C).map(|c| off(c).powi(2)).sum::<f64>() / C as f64
    }

    /// Frequency at which a Gaussian kernel that the samples were smoothed with has left half, Hz; infinite where none was found.
    #[inline]
    pub(crate) fn shown_hz(&self) -> f64 {
        self.kernel_s()
            .map_or(f64::INFINITY, |s| (2.0 * LN_2).sqrt() / (TAU * s))
    }

    /// Standard deviation of that kernel, s.
    #[inline]
    fn kernel_s(&self) -> Option<f64> {
        Some(self.colour.as_ref()?.kernel? * self.system.equations.interval)
    }

    /// The penalty's weight.
    pub fn weight(&self) -> &SplineWeight {
        &self.weight
    }

    /// Frequency at which the smoothing's response is one half at a time, Hz.
    pub fn cutoff_hz(&self, seconds: f64) -> f64 {
        self.cutoff_over(self.system.equations.basis_at(seconds).0)
    }

    /// The same over a knot interval.
    #[inline]
    pub(crate) fn cutoff_over(&self, interval: usize) -> f64 {
        let weight = match &self.weight {
            SplineWeight::Uniform(weight) => *weight,
            SplineWeight::Local(weights) => weights[interval.min(weights.len() - 1)].fifth,
        };
        self.system.equations.cutoff_of_weight(weight)
    }

    /// Frequency at which the response of the second derivative's weight alone is one half over a knot
    /// interval, Hz; infinite where it has none.
    #[inline]
    pub(crate) fn vigour_cutoff_over(&self, interval: usize) -> f64 {
        match &self.weight {
            SplineWeight::Uniform(_) => f64::INFINITY,
            SplineWeight::Local(weights) => {
                let weight = weights[interval.min(weights.len() - 1)].second;
                self.system.equations.cutoff_of_second_weight(weight)
            }
        }
    }
}

#[cfg(test)]
#[path = "spline_tests.rs"]
mod tests;
