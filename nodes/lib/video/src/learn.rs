//! The filter's noise by maximum likelihood.

use nalgebra::Vector3;

use crate::filter::{FilterNoise, Gate, Measurement, kalman_filter};

/// A parameter of the search, as a logarithm.
struct Parameter {
    /// Where the search starts, and the prior's middle.
    usual: f64,
    /// Standard deviation of the prior's logarithm.
    spread: f64,
    /// What it cannot leave.
    bounds: (f64, f64),
    /// Its steps by the others'.
    pace: f64,
}

/// Densities of jerk across the vertical and along it (m2/s5; the exact positions of the embedded
/// walk give 9 and, without a bounce of its own, 100), the bounce (m, Hz; walking people rise by 4
/// cm, 1.6 to 2.2 times a second, runners up to 3), factors on the errors of pixels and depths.
const PARAMETERS: [Parameter; 6] = [
    Parameter {
        usual: 30.0,
        spread: 1.5,
        bounds: (1e-2, 1e6),
        pace: 1.0,
    },
    Parameter {
        usual: 30.0,
        spread: 1.5,
        bounds: (1e-2, 1e6),
        pace: 1.0,
    },
    Parameter {
        usual: 0.005,
        spread: 1.5,
        bounds: (1e-4, 0.2),
        pace: 1.0,
    },
    Parameter {
        usual: 1.8,
        spread: 0.4,
        bounds: (0.7, 4.0),
        pace: 0.02,
    },
    Parameter {
        usual: 1.0,
        spread: 2.0,
        bounds: (0.02, 50.0),
        pace: 1.0,
    },
    Parameter {
        usual: 1.0,
        spread: 2.0,
        bounds: (0.02, 50.0),
        pace: 1.0,
    },
];
const BOUNCE_STD: usize = 2;
const BOUNCE_HZ: usize = 3;
/// Frequencies that are tried for the bounce, Hz: closer than its line is wide.
const TRIED_HZ: [f64; 3] = [0.8, 3.5, 0.1];
/// A bounce of this size is tried, m.
const TRIED_STD: f64 = 0.015;
const HALVINGS: usize = 6;

/// What makes the measurements likeliest: the jerk's densities, size and frequency of the bounce,
/// and factors on pixel and depth errors. `log L = sum log N(innovation; 0, S)` over the frames
/// within the gate, outliers even over a room. Coordinate search over the logarithms with steps
/// that halve from a factor of 8, the bounce's frequency from a grid; weak priors decide where the
/// data say nothing, as in a clip of two seconds, or where the pixels' and depths' axes never turn
/// apart. `vertical` need not be exact; see [`FilterNoise`].
pub fn learn_noise(
    measurements: &[Option<Measurement>],
    dt: f64,
    vertical: &Vector3<f64>,
) -> FilterNoise {
    let vertical = vertical.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let score = |logarithms: &[f64; 6]| {
        let likelihood = kalman_filter(
            measurements,
            dt,
            &noise(logarithms, vertical),
            Gate::Mahalanobis,
        )
        .log_likelihood;
        let away = logarithms
            .iter()
            .zip(&PARAMETERS)
            .map(|(value, parameter)| ((value - parameter.usual.ln()) / parameter.spread).powi(2));
        likelihood - 0.5 * away.sum::<f64>()
    };
    let start = std::array::from_fn(|parameter| PARAMETERS[parameter].usual.ln());
    let mut best = search(&score, start, 8.0_f64.ln(), 3);
    let mut best_score = score(&best);
    let [low, high, step] = TRIED_HZ;
    for index in 0..=((high - low) / step).round() as usize {
        let mut tried = best;
        (tried[BOUNCE_STD], tried[BOUNCE_HZ]) = (TRIED_STD.ln(), (low + step * index as f64).ln());
        let tried_score = score(&tried);
        if tried_score > best_score {
            (best, best_score) = (tried, tried_score);
        }
    }
    noise(&search(&score, best, 2.0_f64.ln(), HALVINGS), vertical)
}

/// Coordinate search from a start.
fn search(
    score: &impl Fn(&[f64; 6]) -> f64,
    start: [f64; 6],
    first_step: f64,
    halvings: usize,
) -> [f64; 6] {
    let (mut best, mut best_score, mut step) = (start, score(&start), first_step);
    for _ in 0..halvings {
        // The search may walk on while a step of this size helps; a long valley ends after a few
        // walks.
        for _ in 0..5 {
            let before = best_score;
            for (index, parameter) in PARAMETERS.iter().enumerate() {
                for direction in [step, -step] {
                    let mut tried = best;
                    let (low, high) = parameter.bounds;
                    tried[index] =
                        (tried[index] + direction * parameter.pace).clamp(low.ln(), high.ln());
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
    best
}

fn noise(logarithms: &[f64; 6], vertical: Vector3<f64>) -> FilterNoise {
    let [
        horizontal_jerk,
        vertical_jerk,
        bounce_std,
        bounce_hz,
        pixel_factor,
        depth_factor,
    ] = logarithms.map(f64::exp);
    FilterNoise {
        vertical,
        horizontal_jerk,
        vertical_jerk,
        bounce_std,
        bounce_hz,
        pixel_factor,
        depth_factor,
    }
}
