//! The choice of a smoothing weight from the samples.

use std::ops::Range;

use crate::SpatialError;
use crate::banded::Factor;
use crate::derivative_risk::{Derivative, refine};
use crate::system::{PENALTY_ORDER, SplineSystem};

/// Decimal logarithm of the smallest weight: it passes 0.999 of everything up to the Nyquist
/// frequency, as good as an interpolation.
pub(crate) const LOWEST_LOG_WEIGHT: f64 = -8.0;
const HIGHEST_LOG_WEIGHT: f64 = 12.0;
/// First pass over the range, then halving steps around the best.
const COARSE_STEP: f64 = 2.0;
const FINE_STEPS: [f64; 2] = [1.0, 0.5];
/// With fewer samples than this there is too little to learn a weight from.
const FEWEST_SAMPLES: usize = 16;
/// At most this many samples are looked at, in this many runs spread evenly over the series: more
/// would cost time and change nothing.
const SEARCHED_SAMPLES: usize = 768;
const SEARCHED_RUNS: usize = 3;

/// The search for the best weight as a dialogue, so that live code can spread its evaluations over
/// time: [`WeightSearch::next_weight`] names a weight, [`WeightSearch::record`] takes its score,
/// and when no weight is left [`WeightSearch::best`] is the answer.
///
/// The score is minus twice the logarithm of the restricted likelihood (REML; Patterson and
/// Thompson 1971): samples are a spline with a flat prior on its polynomial part and a Gaussian one
/// of unknown size on its fifth derivative, plus white noise of unknown size. Exact samples of a
/// smooth motion come out with the smallest weight, jittered ones with nearly that of the least
/// error. No constant is set by hand.
#[derive(Clone, Debug, Default)]
pub struct WeightSearch {
    /// (log10 weight, score), in order of evaluation.
    scored: Vec<(f64, f64)>,
}

impl WeightSearch {
    /// A fresh search.
    pub fn new() -> Self {
        Self::default()
    }

    /// The next weight to score; `None` when the search is over.
    pub fn next_weight(&self) -> Option<f64> {
        self.next_log_weight().map(|log| 10f64.powf(log))
    }

    /// Takes the score of the weight that [`WeightSearch::next_weight`] named; NaN or infinite
    /// where it could not be computed.
    pub fn record(&mut self, score: f64) {
        if let Some(log) = self.next_log_weight() {
            self.scored
                .push((log, if score.is_nan() { f64::INFINITY } else { score }));
        }
    }

    /// The best weight among those scored, refined by a parabola through its neighbours; `None`
    /// before any was scored.
    pub fn best(&self) -> Option<f64> {
        let (log, score) = self.best_scored()?;
        let step = FINE_STEPS[FINE_STEPS.len() - 1];
        let beside = |at: f64| self.score_at(at).filter(|s| s.is_finite());
        let shift = match (beside(log - step), beside(log + step)) {
            (Some(left), Some(right)) if left + right > 2.0 * score => {
                0.5 * step * (left - right) / (left - 2.0 * score + right)
            }
            _ => 0.0,
        };
        Some(10f64.powf(log + shift.clamp(-step, step)))
    }

    fn next_log_weight(&self) -> Option<f64> {
        let coarse = LOWEST_LOG_WEIGHT + COARSE_STEP * self.scored.len() as f64;
        if coarse <= HIGHEST_LOG_WEIGHT {
            return Some(coarse);
        }
        let (centre, _) = self.best_scored()?;
        let candidates = FINE_STEPS
            .iter()
            .flat_map(|step| [centre - step, centre + step]);
        let in_range = LOWEST_LOG_WEIGHT..=HIGHEST_LOG_WEIGHT;
        candidates
            .into_iter()
            .find(|log| in_range.contains(log) && self.score_at(*log).is_none())
    }

    fn best_scored(&self) -> Option<(f64, f64)> {
        self.scored
            .iter()
            .copied()
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn score_at(&self, log: f64) -> Option<f64> {
        self.scored
            .iter()
            .find(|scored| (scored.0 - log).abs() < 0.01)
            .map(|scored| scored.1)
    }
}

/// Memory that scoring reuses.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch<const C: usize> {
    pub(crate) factor: Factor,
    pub(crate) coefficients: Vec<[f64; C]>,
    pub(crate) correction: Vec<[f64; C]>,
}

impl SplineSystem {
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
        self.check(values)?;
        self.score_into(values, weight, &mut Scratch::default())
    }

    fn score_into<const C: usize>(
        &self,
        values: &[[f64; C]],
        weight: f64,
        scratch: &mut Scratch<C>,
    ) -> Result<f64, SpatialError> {
        self.solve(values, weight, scratch)?;
        let square = self.residual(values, weight, scratch);
        let free = (self.sample_count() + 4 - PENALTY_ORDER) as f64;
        // A series at rest leaves nothing: any weight is right for it, and the logarithm must stay
        // finite.
        let mean_square = square / (C as f64 * free) + f64::MIN_POSITIVE;
        Ok(C as f64
            * (free * mean_square.ln() + scratch.factor.log_determinant() - free * weight.ln()))
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
            self.solve(&centred, 10f64.powf(log), &mut scratch)?;
            Ok((self.distance(&centred, &scratch.coefficients) / (C * values.len()) as f64).sqrt())
        };
        let (mut low, mut high) = (LOWEST_LOG_WEIGHT, HIGHEST_LOG_WEIGHT);
        if leaves(high)? <= std {
            return Ok(10f64.powf(high));
        }
        while high - low > 0.01 {
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
        if self.sample_count() < FEWEST_SAMPLES {
            return Ok(lowest);
        }
        let (_, centred) = centred(values);
        let mut scratch = Scratch::default();
        let mut search = WeightSearch::new();
        while let Some(weight) = search.next_weight() {
            search.record(
                self.over_runs(|range, system| {
                    system.score_into(&centred[range], weight, &mut scratch)
                })
                .unwrap_or(f64::INFINITY),
            );
        }
        let likelihood = search.best().unwrap_or(lowest);
        let Some(derivative) = derivative else {
            return Ok(likelihood);
        };
        let mut free = 0.0;
        let square = self.over_runs(|range, system| {
            system.solve(&centred[range.clone()], likelihood, &mut scratch)?;
            free += (C * (system.sample_count() + 4 - PENALTY_ORDER)) as f64;
            Ok(system.residual(&centred[range], likelihood, &mut scratch))
        })?;
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
        mut of: impl FnMut(Range<usize>, &Self) -> Result<f64, SpatialError>,
    ) -> Result<f64, SpatialError> {
        match self.runs() {
            [] => of(0..self.sample_count(), self),
            runs => runs
                .iter()
                .map(|(range, system)| of(range.clone(), system))
                .sum(),
        }
    }
}

/// Ranges of samples that a search looks at; empty where it looks at all.
pub(crate) fn searched_ranges(sample_count: usize) -> Vec<Range<usize>> {
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
    let first = values.first().copied().unwrap_or([0.0; C]);
    (
        first,
        values
            .iter()
            .map(|value| std::array::from_fn(|c| value[c] - first[c]))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dialogue_finds_the_minimum_of_a_parabola() {
        for minimum in [-7.9, -3.3, 0.4, 6.62, 11.0] {
            let mut search = WeightSearch::new();
            let mut asked = 0;
            while let Some(weight) = search.next_weight() {
                search.record((weight.log10() - minimum).powi(2));
                asked += 1;
            }
            let found = search.best().map_or(f64::NAN, f64::log10);
            assert!(
                (found - minimum).abs() < 0.11 && asked <= 18,
                "{minimum}: {found} after {asked}"
            );
        }
    }

    #[test]
    fn weights_that_cannot_be_scored_are_passed_over() {
        let mut search = WeightSearch::new();
        while let Some(weight) = search.next_weight() {
            search.record(if weight < 1.0 {
                f64::NAN
            } else {
                weight.log10()
            });
        }
        assert_eq!(search.best(), Some(1.0));
    }

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
