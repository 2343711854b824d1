//! Smoothing quintic splines.

use std::sync::Arc;

use crate::SpatialError;
use crate::basis::BasisValues;
use crate::derivative::Derivative;
use crate::equations::Scratch;
use crate::system::{SplineSystem, centred};
use crate::weight_search::LOWEST_LOG_WEIGHT;

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

impl Smoothing {
    /// The weight for samples on these times.
    ///
    /// # Errors
    /// [`SpatialError::BadRate`], [`SpatialError::BadWeight`] or [`SpatialError::BadDistance`] for
    /// numbers that are negative or not finite, zero cutoffs too.
    pub fn weight<const C: usize>(
        self,
        system: &SplineSystem,
        values: &[[f64; C]],
    ) -> Result<f64, SpatialError> {
        let lowest = 10f64.powf(LOWEST_LOG_WEIGHT);
        match self {
            Self::Automatic => system.search(values, None),
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

/// A quintic spline through or near samples of C channels, which share one smoothing weight (so
/// that turning the axes turns the result).
#[derive(Clone, Debug)]
pub struct SmoothingSpline<const C: usize> {
    system: Arc<SplineSystem>,
    coefficients: Vec<[f64; C]>,
    weight: f64,
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
        system.equations.check(values)?;
        let weight = smoothing.weight(system, values)?;
        let mut scratch = Scratch::default();
        let (first, centred) = centred(values);
        system.equations.solve(&centred, weight, &mut scratch)?;
        // The basis functions sum to one, so a constant may go onto the coefficients.
        for coefficient in &mut scratch.coefficients {
            for c in 0..C {
                coefficient[c] += first[c];
            }
        }
        Ok(Self {
            system: system.clone(),
            coefficients: scratch.coefficients,
            weight,
        })
    }

    /// Value, first and second derivative (per s, per s^2) at a time; times outside the samples are
    /// moved to the nearest end.
    pub fn evaluate(&self, seconds: f64) -> [[f64; C]; 3] {
        let (first, values) = self.system.equations.basis_at(seconds);
        self.combine(first, &values)
    }

    /// As [`SmoothingSpline::evaluate`], from what [`crate::equations::SplineEquations::basis_at`] gave.
    pub(crate) fn combine(&self, first: usize, values: &BasisValues) -> [[f64; C]; 3] {
        let mut result = [[0.0; C]; 3];
        for (j, coefficient) in self.coefficients[first..first + values[0].len()]
            .iter()
            .enumerate()
        {
            for (derivative, row) in result.iter_mut().zip(values) {
                for c in 0..C {
                    derivative[c] += row[j] * coefficient[c];
                }
            }
        }
        result
    }

    /// The penalty's weight, for times counted in median sample intervals.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Frequency at which the smoothing's response is one half, Hz.
    pub fn cutoff_hz(&self) -> f64 {
        self.system.equations.cutoff_of_weight(self.weight)
    }
}

#[cfg(test)]
#[path = "spline_tests.rs"]
mod tests;
