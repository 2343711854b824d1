//! The filter's noise by maximum likelihood.

use super::filter::{FilterNoise, Gate, Measurement, kalman_filter};

/// Largest factor, to both sides, by which the search leaves its start; densities of human motion lie well inside.
const BOUNDS: [(f64, f64); 3] = [(1e-2, 1e6), (0.02, 50.0), (0.02, 50.0)];
/// Density of a walking person's jerk, m2/s5: where the search starts.
const START: FilterNoise = FilterNoise { jerk_density: 300.0, pixel_factor: 1.0, depth_factor: 1.0 };
const ROUNDS: usize = 8;

/// The jerk's density and the factors on pixel and depth errors that make the measurements likeliest:
/// `log L = sum log N(innovation; 0, S)` over the frames within the gate, outliers even over a room. Coordinate search over the logarithms
/// with steps that halve from a factor of 8; a weak prior (each factor 1 within a factor of e^2) decides where the data say nothing, as
/// where the pixels' and depths' axes never turn apart.
pub fn learn_noise(measurements: &[Option<Measurement>], dt: f64) -> FilterNoise {
    let mut best = [START.jerk_density.ln(), 0.0, 0.0];
    let score = |logarithms: &[f64; 3]| {
        let likelihood = kalman_filter(measurements, dt, &noise(logarithms), Gate::Mahalanobis).log_likelihood;
        likelihood - logarithms[1..].iter().map(|value| value * value / 8.0).sum::<f64>()
    };
    let mut best_score = score(&best);
    let mut step = 8.0_f64.ln();
    for _ in 0..ROUNDS {
        // The search may walk on while a step of this size helps; a long valley ends after a few walks.
        for _ in 0..6 {
            let before = best_score;
            for parameter in 0..3 {
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
    noise(&best)
}

fn noise(logarithms: &[f64; 3]) -> FilterNoise {
    let [jerk_density, pixel_factor, depth_factor] = logarithms.map(f64::exp);
    FilterNoise { jerk_density, pixel_factor, depth_factor }
}
