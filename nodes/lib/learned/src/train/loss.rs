//! How far the outputs are from the targets.

use serde::{Deserialize, Serialize};

/// The loss of one number; e = output - target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Loss {
    /// e^2
    SquaredError,
    /// e^2 / 2 up to |e| = delta, delta (|e| - delta / 2) beyond (Huber 1964): outliers pull no
    /// harder than delta.
    Huber {
        /// Where it turns, in the targets' unit.
        delta: f32,
    },
}

impl Loss {
    /// Value and slope.
    #[must_use]
    pub fn at(self, error: f32) -> (f32, f32) {
        match self {
            Self::SquaredError => (error * error, 2.0 * error),
            Self::Huber { delta } if error.abs() > delta => {
                (delta * (error.abs() - 0.5 * delta), delta.copysign(error))
            }
            Self::Huber { .. } => (0.5 * error * error, error),
        }
    }
}

/// Adds up weight x loss over rows and channels, and writes weight x slope x scale where a gradient
/// is wanted.
///
/// output, target: (rows, channels); weights: (rows); losses: one for all channels or one each.
#[must_use]
pub(crate) fn weighted_loss(
    losses: &[Loss],
    (output, target, weights): (&[f32], &[f32], &[f32]),
    mut gradient: Option<(&mut [f32], f64)>,
) -> f64 {
    let channels = output.len() / weights.len();
    let mut sum = 0.0;
    for (row, &weight) in weights
        .iter()
        .enumerate()
        .filter(|(_, weight)| **weight > 0.0)
    {
        for (channel, index) in (row * channels..(row + 1) * channels).enumerate() {
            let (value, slope) = losses[channel % losses.len()].at(output[index] - target[index]);
            sum += f64::from(weight) * f64::from(value);
            if let Some((gradient, scale)) = &mut gradient {
                gradient[index] = (f64::from(weight) * f64::from(slope) * *scale) as f32;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_the_values_differences() {
        for loss in [Loss::SquaredError, Loss::Huber { delta: 0.7 }] {
            for error in [-3.0_f32, -0.69, -0.1, 0.0, 0.2, 0.71, 5.0] {
                let difference = (loss.at(error + 1e-3).0 - loss.at(error - 1e-3).0) / 2e-3;
                assert!(
                    (difference - loss.at(error).1).abs() < 5e-3,
                    "{loss:?} at {error}"
                );
            }
        }
        assert_eq!(Loss::Huber { delta: 1.0 }.at(-3.0), (2.5, -1.0));
        assert!(Loss::Huber { delta: 1.0 }.at(f32::NAN).0.is_nan());
    }

    #[test]
    fn what_weighs_nothing_is_not_looked_at() {
        let (output, target) = ([1.0, 2.0, 3.0, 4.0], [0.0, 0.0, f32::NAN, f32::NAN]);
        let mut gradient = [9.0; 4];
        gradient[2..].fill(0.0);
        let losses = [Loss::SquaredError, Loss::Huber { delta: 1.0 }];
        let sum = weighted_loss(
            &losses,
            (&output, &target, &[2.0, 0.0]),
            Some((&mut gradient, 0.5)),
        );
        assert_eq!((sum, gradient), (2.0 * (1.0 + 1.5), [2.0, 1.0, 0.0, 0.0]));
    }
}
