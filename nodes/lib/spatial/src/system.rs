//! Smoothing splines on one set of times, and the choice of their weight from the samples.

use std::ops::Range;
use std::sync::OnceLock;

use crate::SpatialError;
use crate::derivative::Derivative;
use crate::derivative_risk::{SplitRun, refine};
use crate::equations::{Scratch, SplineEquations};
use crate::grid::check_times;
use crate::weight_search::{HIGHEST_LOG_WEIGHT, LOWEST_LOG_WEIGHT, WeightSearch};

/// With fewer samples than this there is too little to learn a weight from. No source.
const FEWEST_SAMPLES: usize = 16;
/// Most samples that a search looks at: its time is then bounded, whatever the length of the series.
/// No source.
const SEARCHED_SAMPLES: usize = 768;
/// Runs of samples, spread evenly over the series, in which they lie. No source.
const SEARCHED_RUNS: usize = 3;
/// How near the weight that leaves a wanted residual is found, decimal logarithm: the cutoff within
/// 0.2 %.
const RESIDUAL_LOG_STEP: f64 = 0.01;

/// The equations of smoothing splines on one set of times, made once and shared by all series on
/// these times.
///
/// A spline `f = sum_j c_j B_j` minimises `sum_k |y_k - f(t_k)|^2 + weight * integral of |f^(5)|^2`
/// (eased off at the ends), that is `(B^T B + weight P) c = B^T y`, eleven bands wide, solved in
/// O(N). Times count in median sample intervals, so the weight has no unit.
///
/// Ends: a knot at every sample leaves four coefficients free. First and second derivative at each
/// end, by one-sided differences over eight samples, are added to the observations with the weights
/// that their noise deserves (1 over the sum of squared difference weights): between exact samples
/// they settle the ends to sixth order, among noisy ones they weigh next to nothing.
#[derive(Clone, Debug)]
pub struct SplineSystem {
    pub(crate) equations: SplineEquations,
    /// Of the samples, in median intervals since the first.
    times: Vec<f64>,
    /// See [`SplineSystem::runs`].
    runs: OnceLock<Vec<(Range<usize>, SplineEquations)>>,
    /// See [`SplineSystem::split_runs`].
    split_runs: [OnceLock<Vec<SplitRun>>; 2],
}

/// Part of the interval by which stamps may scatter where samples are taken to be at a constant rate. No source.
const UNEVEN: f64 = 0.3;

/// A weight between two that were tried can be too large for the digits there are, of a series at
/// rest: a lighter one is taken, down to where that is not the reason.
pub(crate) const LIGHTER: f64 = 0.1;
pub(crate) const LIGHT: f64 = 1.0;

/// Two stamps may each be rounded to a nanosecond.
const ROUNDING_S: f64 = 2.5e-9;

impl SplineSystem {
    /// The equations for samples at `seconds`.
    ///
    /// # Errors
    /// Fewer than two times, times that are not finite or do not increase.
    pub fn new(seconds: &[f64]) -> Result<Self, SpatialError> {
        if seconds.len() < 2 {
            return Err(SpatialError::TooFewSamples {
                got: seconds.len(),
                needed: 2,
            });
        }
        check_times(seconds)?;
        let interval = median_interval(seconds);
        let times: Vec<f64> = seconds
            .iter()
            .map(|t| (t - seconds[0]) / interval)
            .collect();
        Ok(Self {
            equations: SplineEquations::from_times(&times, interval, seconds[0]),
            times,
            runs: OnceLock::new(),
            split_runs: Default::default(),
        })
    }

    /// Whether these are the times of the samples, to the rounding of stamps.
    pub(crate) fn is_at(&self, seconds: &[f64]) -> bool {
        let interval = self.equations.interval;
        seconds.len() == self.times.len()
            && seconds
                .iter()
                .zip(&self.times)
                .all(|(s, t)| (s - seconds[0] - t * interval).abs() < ROUNDING_S)
    }

    /// Whether no two of these samples lie farther apart, or nearer, than the rest by more than [`UNEVEN`].
    pub(crate) fn is_even(&self, samples: Range<usize>) -> bool {
        let steps = self.times[samples].array_windows();
        steps.into_iter().all(|[a, b]| (b - a - 1.0).abs() < UNEVEN)
    }

    /// Median interval between the samples, s.
    pub fn interval(&self) -> f64 {
        self.equations.interval
    }

    /// The runs of samples that a search for a weight looks at, empty where it looks at all; made
    /// when first asked for. Their times count in this system's interval, so that a weight means
    /// the same in all of them.
    fn runs(&self) -> &[(Range<usize>, SplineEquations)] {
        self.runs.get_or_init(|| {
            let SplineEquations {
                interval, origin, ..
            } = self.equations;
            let run = |range: Range<usize>| {
                let times = &self.times[range.clone()];
                (range, SplineEquations::from_times(times, interval, origin))
            };
            searched_ranges(self.times.len())
                .into_iter()
                .map(run)
                .collect()
        })
    }

    /// The same runs, or the whole, split into halves for [`Derivative`]; made when first asked
    /// for.
    fn split_runs(&self, derivative: Derivative) -> &[SplitRun] {
        self.split_runs[derivative as usize].get_or_init(|| {
            let ranges = match searched_ranges(self.times.len()) {
                ranges if ranges.is_empty() => std::iter::once(0..self.times.len()).collect(),
                ranges => ranges,
            };
            ranges
                .into_iter()
                .map(|range| SplitRun::new(&self.times, range, derivative))
                .collect()
        })
    }

    /// Score of a weight for samples on these times, smaller is better: with n observations, n
    /// functions, m = 5 and C channels that share weight and noise, `C ((n - m) ln(Q / C (n - m)) +
    /// ln |B^T B + weight P| - (n - m) ln weight)`, Q the penalised residual square.
    ///
    /// # Errors
    /// Samples of the wrong number or not finite, or a singular system.
    pub fn score<const C: usize>(
        &self,
        values: &[[f64; C]],
        weight: f64,
    ) -> Result<f64, SpatialError> {
        self.equations.check(values)?;
        self.equations
            .score(values, weight, &mut Scratch::default())
    }

    /// The largest weight that leaves at most `std` per channel, root mean square: what it leaves
    /// grows with the weight, so halving finds it.
    pub(crate) fn weight_of_residual<const C: usize>(
        &self,
        values: &[[f64; C]],
        std: f64,
    ) -> Result<f64, SpatialError> {
        let (_, centred) = centred(values);
        let mut scratch = Scratch::default();
        let mut leaves = |log: f64| -> Result<f64, SpatialError> {
            self.equations
                .solve(&centred, 10f64.powf(log), &mut scratch)?;
            let distance = self.equations.distance(&centred, &scratch.coefficients);
            Ok((distance / (C * values.len()) as f64).sqrt())
        };
        let (mut low, mut high) = (LOWEST_LOG_WEIGHT, HIGHEST_LOG_WEIGHT);
        if leaves(high)? <= std {
            return Ok(10f64.powf(high));
        }
        while high - low > RESIDUAL_LOG_STEP {
            let middle = 0.5 * (low + high);
            if leaves(middle)? <= std {
                low = middle
            } else {
                high = middle
            }
        }
        Ok(10f64.powf(low))
    }

    /// The weight that suits these samples best: of the greatest likelihood, or near it that of the
    /// least error of a derivative.
    pub(crate) fn search<const C: usize>(
        &self,
        values: &[[f64; C]],
        derivative: Option<Derivative>,
    ) -> Result<f64, SpatialError> {
        let lowest = 10f64.powf(LOWEST_LOG_WEIGHT);
        if self.times.len() < FEWEST_SAMPLES {
            return Ok(lowest);
        }
        let (_, centred) = centred(values);
        let mut scratch = Scratch::default();
        let mut search = WeightSearch::new();
        while let Some(weight) = search.next_weight() {
            let score = self.over_runs(|range, equations| {
                equations.score(&centred[range], weight, &mut scratch)
            });
            search.record(score.unwrap_or(f64::INFINITY));
        }
        let mut likelihood = search.best().unwrap_or(lowest);
        let Some(derivative) = derivative else {
            return Ok(likelihood);
        };
        let (square, free) = loop {
            let mut free = 0.0;
            let square = self.over_runs(|range, equations| {
                equations.solve(&centred[range.clone()], likelihood, &mut scratch)?;
                free += (C * equations.free_count()) as f64;
                Ok(equations.residual(&centred[range], likelihood, &mut scratch))
            });
            match square {
                Err(SpatialError::Singular { .. }) if likelihood > LIGHT => likelihood *= LIGHTER,
                square => break (square?, free),
            }
        };
        Ok(refine(
            self.split_runs(derivative),
            &centred,
            likelihood,
            square / free,
            derivative,
        ))
    }

    /// Sum over the runs that a search looks at, or over the whole.
    fn over_runs(
        &self,
        mut term: impl FnMut(Range<usize>, &SplineEquations) -> Result<f64, SpatialError>,
    ) -> Result<f64, SpatialError> {
        match self.runs() {
            [] => term(0..self.times.len(), &self.equations),
            runs => runs
                .iter()
                .map(|(range, equations)| term(range.clone(), equations))
                .sum(),
        }
    }
}

pub(crate) fn median_interval(seconds: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = seconds.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = intervals.len() / 2;
    *intervals.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Ranges of samples that a search looks at; empty where it looks at all.
fn searched_ranges(sample_count: usize) -> Vec<Range<usize>> {
    if sample_count <= SEARCHED_SAMPLES {
        return Vec::new();
    }
    let length = SEARCHED_SAMPLES / SEARCHED_RUNS;
    let spare = sample_count - SEARCHED_SAMPLES;
    let start = |run: usize| run * length + (2 * run + 1) * spare / (2 * SEARCHED_RUNS);
    (0..SEARCHED_RUNS)
        .map(|run| start(run)..start(run) + length)
        .collect()
}

/// The first value, and all values less the first: differences do not change, and rounding does not
/// grow with the distance from zero.
pub(crate) fn centred<const C: usize>(values: &[[f64; C]]) -> ([f64; C], Vec<[f64; C]>) {
    let mut values = values.to_vec();
    (centre(&mut values), values)
}

/// As [`centred`], in place.
pub(crate) fn centre<const C: usize>(values: &mut [[f64; C]]) -> [f64; C] {
    let first = values.first().copied().unwrap_or([0.0; C]);
    for value in values {
        (0..C).for_each(|c| value[c] -= first[c]);
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searched_ranges_are_spread_over_the_series() {
        assert!(searched_ranges(SEARCHED_SAMPLES).is_empty());
        let ranges = searched_ranges(6000);
        assert_eq!(
            ranges.iter().map(Range::len).sum::<usize>(),
            SEARCHED_SAMPLES
        );
        assert!(
            ranges[0].start > 500
                && ranges[2].end < 5500
                && ranges.windows(2).all(|w| w[0].end < w[1].start)
        );
        assert!(
            searched_ranges(SEARCHED_SAMPLES + 1)
                .windows(2)
                .all(|w| w[0].end <= w[1].start)
        );
    }
}
