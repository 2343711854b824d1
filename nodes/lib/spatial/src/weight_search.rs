//! The search for a smoothing weight.

/// Decimal logarithm of the smallest weight: it passes 0.999 of everything up to the Nyquist
/// frequency, as good as an interpolation.
pub(crate) const LOWEST_LOG_WEIGHT: f64 = -8.0;
/// Decimal logarithm of the largest weight: half of a frequency of one period in 100 samples passes.
pub(crate) const HIGHEST_LOG_WEIGHT: f64 = 12.0;
/// Decimal logarithms: first pass over the range, then halving steps around the best.
const COARSE_STEP: f64 = 2.0;
const FINE_STEPS: [f64; 2] = [1.0, 0.5];

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
    /// A search that has scored no weight yet.
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
}
