//! What the kernels' tests share.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Numbers in [-1, 1).
pub(crate) fn values(count: usize, seed: u64) -> Vec<f32> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-1.0..1.0)).collect()
}

/// Compares an analytic gradient with central differences of a loss, element by element; the loss
/// sums in f64.
pub(crate) fn check_gradient(
    what: &str,
    values: &[f32],
    gradient: &[f32],
    loss: impl Fn(&[f32]) -> f64,
) {
    assert_eq!(values.len(), gradient.len(), "{what}");
    let step = 4e-3_f32;
    let scale = gradient
        .iter()
        .fold(0.1_f32, |scale, value| scale.max(value.abs()));
    for index in 0..values.len() {
        let at = |value: f32| {
            let mut moved = values.to_vec();
            moved[index] = value;
            loss(&moved)
        };
        let (upper, lower) = (values[index] + step, values[index] - step);
        let slope = (at(upper) - at(lower)) / f64::from(upper - lower);
        let difference = (slope - f64::from(gradient[index])).abs();
        assert!(
            difference < 1e-3 * f64::from(scale),
            "{what}, element {index}: {} by hand, {slope} by differences",
            gradient[index]
        );
    }
}

/// The scalar that gradients are taken of: a weighted sum, weights in f64.
pub(crate) fn weighted_sum(values: &[f32], weights: &[f32]) -> f64 {
    values
        .iter()
        .zip(weights)
        .map(|(value, weight)| f64::from(*value) * f64::from(*weight))
        .sum()
}
