//! The filter's noise by maximum likelihood.

use nalgebra::Vector3;

use super::filter::{FilterNoise, Gate, Measurement, kalman_filter};

/// Bounds of the search: densities of human motion and errors of cameras lie well inside.
const BOUNDS: [(f64, f64); 4] = [(1e-2, 1e6), (1e-2, 1e6), (0.02, 50.0), (0.02, 50.0)];
/// Density of a walking person's jerk, m2/s5, and the standard deviation of its logarithm: the exact positions of the embedded walk give 8 across
/// the vertical and 103 along it.
const USUAL_JERK: f64 = 30.0;
const JERK_SPREAD: f64 = 1.5;
/// Standard deviation of the factors' logarithms.
const FACTOR_SPREAD: f64 = 2.0;
const HALVINGS: usize = 7;

/// The jerk's densities and the factors on pixel and depth errors that make the measurements likeliest:
/// `log L = sum log N(innovation; 0, S)` over the frames within the gate, outliers even over a room. Coordinate search over the logarithms
/// with steps that halve from a factor of 8; weak priors (densities 30 m2/s5 within a factor of 4.5, factors 1 within one of 7.4) decide where the
/// data say nothing, as in a clip of two seconds, or where the pixels' and depths' axes never turn apart. `vertical` need not be exact; see [`FilterNoise`].
pub fn learn_noise(measurements: &[Option<Measurement>], dt: f64, vertical: &Vector3<f64>) -> FilterNoise {
    let vertical = vertical.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let usual = [USUAL_JERK.ln(), USUAL_JERK.ln(), 0.0, 0.0];
    let spreads = [JERK_SPREAD, JERK_SPREAD, FACTOR_SPREAD, FACTOR_SPREAD];
    let mut best = usual;
    let score = |logarithms: &[f64; 4]| {
        let likelihood = kalman_filter(measurements, dt, &noise(logarithms, vertical), Gate::Mahalanobis).log_likelihood;
        let away = logarithms.iter().zip(usual).zip(spreads).map(|((value, usual), spread)| ((value - usual) / spread).powi(2));
        likelihood - 0.5 * away.sum::<f64>()
    };
    let mut best_score = score(&best);
    let mut step = 8.0_f64.ln();
    for _ in 0..HALVINGS {
        // The search may walk on while a step of this size helps; a long valley ends after a few walks.
        for _ in 0..6 {
            let before = best_score;
            for parameter in 0..best.len() {
                for direction in [step, -step] {
                    let mut tried = best;
                    let (low, high) = BOUNDS[parameter];
                    tried[parameter] = (tried[parameter] + direction).clamp(low.ln(), high.ln());
                    let tried_score = score(&tried);
                    if tried_score > best_score {
                        (best, best_score) = (tried, tried_score);
                        break;
                    }
                }
            }
            if best_score <= before {
                break;
            }
        }
        step /= 2.0;
    }
    noise(&best, vertical)
}

fn noise(logarithms: &[f64; 4], vertical: Vector3<f64>) -> FilterNoise {
    let [horizontal_jerk, vertical_jerk, pixel_factor, depth_factor] = logarithms.map(f64::exp);
    FilterNoise { vertical, horizontal_jerk, vertical_jerk, pixel_factor, depth_factor }
}
