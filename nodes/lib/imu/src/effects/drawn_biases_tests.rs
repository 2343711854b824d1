#![allow(clippy::unwrap_used)]
use super::*;
use crate::Device;

const DEVICE: &str = "schema: cromosim/device/1
declared_noise: {accel_density: 0.0, gyro_density: 0.0}
effects:
- {effect: gyro_turn_on_bias, deviation: [0.01, 0.02, 0.0]}
- {effect: accel_bias_instability, deviation: 0.03, time_constant: 5.0}
- {effect: gyro_bias_walk, density: 0.004}
";

/// The biases of a run at irregular seconds, as lost messages leave them.
fn run(seed: u64, seconds: &[f64]) -> Vec<Reading> {
    let device = Device::parse(DEVICE, "d.yaml").unwrap();
    let mut biases = DrawnBiases::new(device.effects(), seed, "wrist").unwrap();
    let at = |seconds: &f64| {
        let mut reading = Reading::default();
        biases.add_to(
            &mut reading,
            Stamp::from_seconds(1e9).plus_seconds(*seconds),
        );
        reading
    };
    seconds.iter().map(at).collect()
}

/// Mean of `of` over many runs is `expected` within five standard errors.
fn mean_is(runs: &[Vec<Reading>], expected: f64, of: impl Fn(&[Reading]) -> f64) {
    let values: Vec<f64> = runs.iter().map(|run| of(run)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread = values.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / n;
    let error = (spread / n).sqrt();
    assert!(
        (mean - expected).abs() <= 5.0 * error,
        "{mean} +- {error} against {expected}"
    );
}

#[test]
fn drawn_biases_have_their_variances_at_any_spacing() {
    let seconds = [0.0, 0.01, 0.02, 3.0, 3.01, 7.0];
    let runs: Vec<_> = (0..4000).map(|seed| run(seed, &seconds)).collect();
    let force = |axis: usize| move |run: &[Reading], k: usize| run[k].specific_force[axis];
    for axis in 0..3 {
        let x = force(axis);
        // Stationary from the first reading on, with the correlation exp(-t / T).
        mean_is(&runs, 0.0, |run| x(run, 5));
        mean_is(&runs, 9e-4, |run| x(run, 0).powi(2));
        mean_is(&runs, 9e-4, |run| x(run, 5).powi(2));
        mean_is(&runs, 9e-4 * (-7.0_f64 / 5.0).exp(), |run| {
            x(run, 0) * x(run, 5)
        });
        mean_is(&runs, 9e-4 * (-0.01_f64 / 5.0).exp(), |run| {
            x(run, 3) * x(run, 4)
        });
    }
    let rate = |run: &[Reading], k: usize| run[k].angular_velocity;
    for (axis, deviation) in [0.01_f64, 0.02, 0.0].into_iter().enumerate() {
        mean_is(&runs, deviation.powi(2), |run| rate(run, 0)[axis].powi(2));
        let walked = |run: &[Reading]| (rate(run, 5) - rate(run, 0))[axis].powi(2);
        mean_is(&runs, 1.6e-5 * 7.0, walked);
    }
    mean_is(&runs, 0.0, |run| rate(run, 0).x * rate(run, 0).y);
}

#[test]
fn a_seed_and_a_name_give_the_same_draw_and_others_another() {
    let seconds = [0.0, 0.5, 1.0];
    assert_eq!(run(7, &seconds), run(7, &seconds));
    assert_ne!(run(7, &seconds), run(8, &seconds));
    let none = Device::white(0.1, 0.1);
    assert!(DrawnBiases::new(none.effects(), 1, "wrist").is_none());
}
