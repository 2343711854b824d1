//! How much of a reference's motion is there, by frequency.

/// Factors on what poses show of a motion, by frequency: below 1 where a part of it is an error, above 1 where the
/// poses are less than the motion was.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionResponse {
    /// Increasing, Hz; straight lines in between, the ends are held.
    pub hz: Vec<f64>,
    /// Of the position.
    pub position: Vec<f64>,
    /// Of the rotation.
    pub rotation: Vec<f64>,
    /// How dense the poses were from which the factors were learnt, where that is known: an error that is a part
    /// of a slow motion is a smaller one of a livelier motion.
    pub learnt_from: Option<PoseDensities>,
}

/// How dense poses are, at the frequencies of a [`MotionResponse`].
#[derive(Clone, Debug, PartialEq)]
pub struct PoseDensities {
    /// Of the position, per axis, m2/Hz.
    pub position: Vec<f64>,
    /// Of the rotation vector, per axis, rad2/Hz.
    pub rotation: Vec<f64>,
}

impl MotionResponse {
    /// Of the position at a frequency.
    pub fn of_position(&self, frequency_hz: f64) -> f64 {
        self.at(&self.position, frequency_hz)
    }

    /// Of the rotation at a frequency.
    pub fn of_rotation(&self, frequency_hz: f64) -> f64 {
        self.at(&self.rotation, frequency_hz)
    }

    /// The same of poses whose positions are in units of which so many are a metre.
    #[must_use]
    pub fn in_units_of_length(&self, per_metre: f64) -> Self {
        let learnt_from = self.learnt_from.as_ref().map(|learnt| PoseDensities {
            position: learnt
                .position
                .iter()
                .map(|density| density * per_metre * per_metre)
                .collect(),
            rotation: learnt.rotation.clone(),
        });
        Self {
            learnt_from,
            ..self.clone()
        }
    }

    /// The factors for poses that are so dense, and on which a smoothing is undone with so much gain (1 where none is).
    ///
    /// A factor `g < 1` that was learnt from poses of density S takes `(1 - g) S` for an error. Poses of density S'
    /// hold as much of it, so that theirs is `1 - (1 - g) S / S'`; never less than g, for what is slower than
    /// the learnt motion need not have less of the error. Down to `1 / gain` a factor may as well say that less was
    /// smoothed than is undone, which is so for any motion: that part of it is kept. Factors above 1 make up for what poses
    /// lack, and are kept.
    #[must_use]
    pub(crate) fn of_poses(&self, own: &PoseDensities, gain: &dyn Fn(f64) -> f64) -> Self {
        let Some(learnt) = &self.learnt_from else {
            return self.clone();
        };
        let anew = |factors: &[f64], learnt: &[f64], own: &[f64]| {
            let factor = |k: usize| {
                let kept = factors[k].max(gain(self.hz[k]).recip()).min(1.0);
                if factors[k] < kept && own[k] > learnt[k] {
                    kept - (kept - factors[k]) * learnt[k] / own[k]
                } else {
                    factors[k]
                }
            };
            (0..factors.len()).map(factor).collect()
        };
        Self {
            position: anew(&self.position, &learnt.position, &own.position),
            rotation: anew(&self.rotation, &learnt.rotation, &own.rotation),
            ..self.clone()
        }
    }

    fn at(&self, factors: &[f64], frequency_hz: f64) -> f64 {
        let next = self.hz.partition_point(|hz| *hz < frequency_hz);
        let (before, after) = (next.checked_sub(1), factors.get(next));
        match (before.map(|k| (self.hz[k], factors[k])), after) {
            (Some((hz, own)), Some(after)) => {
                let share = (frequency_hz - hz) / (self.hz[next] - hz);
                own * (1.0 - share) + after * share
            }
            (Some((_, only)), None) => only,
            (None, only) => only.copied().unwrap_or(1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MotionResponse, PoseDensities};

    #[test]
    fn factors_lie_on_straight_lines_and_the_ends_are_held() {
        let response = MotionResponse {
            hz: vec![1.0, 3.0, 7.0],
            position: vec![1.0, 0.8, 0.4],
            rotation: vec![1.0, 1.0, 1.2],
            learnt_from: None,
        };
        let position = [0.0, 1.0, 2.0, 3.0, 4.0, 7.0, 50.0].map(|hz| response.of_position(hz));
        for (found, expected) in position
            .into_iter()
            .zip([1.0, 1.0, 0.9, 0.8, 0.7, 0.4, 0.4])
        {
            assert!((found - expected).abs() < 1e-12, "{position:?}");
        }
        assert!((response.of_rotation(5.0) - 1.1).abs() < 1e-12);
    }

    #[test]
    fn an_error_is_a_smaller_part_of_a_livelier_motion() {
        let densities = |position: [f64; 3], rotation: [f64; 3]| PoseDensities {
            position: position.to_vec(),
            rotation: rotation.to_vec(),
        };
        let learnt = densities([1e-6, 1e-7, 1e-8], [1e-4, 1e-5, 1e-6]);
        let response = MotionResponse {
            hz: vec![1.0, 3.0, 7.0],
            position: vec![1.0, 0.8, 0.3],
            rotation: vec![0.9, 1.1, 0.2],
            learnt_from: Some(learnt.clone()),
        };
        assert_eq!(response.of_poses(&learnt, &|_| 1.0), response);
        let livelier = densities([1e-4, 1e-5, 1e-6], [1e-4, 1e-3, 0.8e-6]);
        let own = response.of_poses(&livelier, &|_| 1.0);
        for (found, expected) in own.position.iter().zip([1.0, 0.998, 0.993]) {
            assert!((found - expected).abs() < 1e-12, "{own:?}");
        }
        // As lively, more than there is, slower.
        assert_eq!(own.rotation, response.rotation);
        // A smoothing that was half as strong as what is undone.
        let own = response.of_poses(&livelier, &|_| 2.0);
        for (found, expected) in own.position.iter().zip([1.0, 0.8, 0.498]) {
            assert!((found - expected).abs() < 1e-12, "{own:?}");
        }
    }
}
