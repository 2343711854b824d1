//! How much each sample counts in what a smoothing spline says at one time.

use std::sync::Arc;

use crate::SpatialError;
use crate::banded::Factor;
use crate::basis::ORDER;
use crate::spline::SplineWeight;
use crate::system::SplineSystem;

/// Weights of samples in what a spline says at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleWeights {
    /// Index of the sample that the first row belongs to; samples before it and after the last row
    /// have no weight.
    pub first: usize,
    /// One row a sample: its weight in the value, in the first (1/s) and the second derivative (1/s2).
    pub rows: Vec<[f64; 3]>,
}

/// A spline is linear in its samples: `f^(m)(t) = sum_k w_k^(m)(t) y_k`. These weights carry a
/// sample's error to the estimate, and so its noise: independent errors of variance `s_k^2` leave
/// `sum_k (w_k s_k)^2`.
///
/// With `M = B^T B + weight P` of [`SplineSystem`] and `b` the basis at t, `w = (B + E) M^-1 b`, E
/// the derivatives at the ends. `M^-1 b` falls off geometrically on both sides of t, and only that
/// part is computed (to 1e-7): one call costs the smoothing's width.
#[derive(Clone, Debug)]
pub struct Influence {
    system: Arc<SplineSystem>,
    weight: SplineWeight,
    factor: Factor,
}

impl Influence {
    /// For splines of this smoothing weight (as [`crate::SmoothingSpline::weight`] gives it).
    ///
    /// # Errors
    /// [`SpatialError::Singular`] where the equations cannot be solved.
    pub fn new(system: &Arc<SplineSystem>, weight: &SplineWeight) -> Result<Self, SpatialError> {
        Ok(Self {
            system: system.clone(),
            weight: weight.clone(),
            factor: system.equations.factor(weight.of_penalty())?,
        })
    }

    /// The weights at a time; times outside the samples are moved to the nearest end.
    pub fn at(&self, seconds: f64) -> SampleWeights {
        let (first, values) = self.system.equations.basis_at(seconds);
        let right: [[f64; 3]; ORDER] = std::array::from_fn(|j| values.map(|row| row[j]));
        let (start, solution) = self.factor.solve_near(first, &right);
        let (first, rows) =
            self.system
                .equations
                .transposed(self.weight.of_penalty(), start, &solution);
        SampleWeights { first, rows }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{Smoothing, SmoothingSpline};

    #[test]
    fn the_weights_are_what_a_sample_moves_the_estimate_by() {
        let seconds: Vec<f64> = (0..90)
            .map(|k| 0.01 * f64::from(k) + if k > 40 { 0.004 } else { 0.0 })
            .collect();
        let system = Arc::new(SplineSystem::new(&seconds).unwrap());
        for weight in [1e-8, 1.0, 1e4] {
            let influence = Influence::new(&system, &SplineWeight::Uniform(weight)).unwrap();
            for time in [0.0, 0.003, 0.21, 0.4449, 0.7, 0.893, 0.894] {
                let weights = influence.at(time);
                for moved in 0..seconds.len() {
                    let mut values = vec![[0.0]; seconds.len()];
                    values[moved] = [1.0];
                    let spline =
                        SmoothingSpline::fit_on(&system, &values, Smoothing::Weight(weight))
                            .unwrap();
                    let estimate = spline.evaluate(time).map(|[value]| value);
                    let found = moved
                        .checked_sub(weights.first)
                        .and_then(|row| weights.rows.get(row))
                        .copied()
                        .unwrap_or([0.0; 3]);
                    // Derivatives are per s and s2 of frames at 100 Hz.
                    for (m, scale) in [1.0, 1e2, 1e4].into_iter().enumerate() {
                        assert!(
                            (found[m] - estimate[m]).abs() < 1e-5 * scale,
                            "weight {weight}, {time} s, sample {moved}, order {m}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_cost_is_the_smoothings_width() {
        let seconds: Vec<f64> = (0..5000).map(|k| 0.01 * f64::from(k)).collect();
        let system = Arc::new(SplineSystem::new(&seconds).unwrap());
        let weights = Influence::new(&system, &SplineWeight::Uniform(10.0))
            .unwrap()
            .at(25.0);
        assert!(
            weights.rows.len() < 300,
            "{} of 5000 samples",
            weights.rows.len()
        );
        let sum: f64 = weights.rows.iter().map(|row| row[0]).sum();
        assert!(
            (sum - 1.0).abs() < 1e-4,
            "a constant stays a constant: {sum}"
        );
    }
}
