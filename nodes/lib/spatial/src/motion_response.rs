//! How much of a reference's motion is there, by frequency.

/// Factors on what poses show of a motion, by frequency: below 1 where a part of it is an error that goes with
/// the motion, above 1 where the poses are less than the motion was.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionResponse {
    /// Increasing, Hz; straight lines in between, the ends are held.
    pub hz: Vec<f64>,
    /// Of the position.
    pub position: Vec<f64>,
    /// Of the rotation.
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
    use super::MotionResponse;

    #[test]
    fn factors_lie_on_straight_lines_and_the_ends_are_held() {
        let response = MotionResponse {
            hz: vec![1.0, 3.0, 7.0],
            position: vec![1.0, 0.8, 0.4],
            rotation: vec![1.0, 1.0, 1.2],
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
}
