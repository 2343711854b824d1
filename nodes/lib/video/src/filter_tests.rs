#![allow(clippy::unwrap_used)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::learn::learn_noise;

const DT: f64 = 1.0 / 30.0;
const NOISE: FilterNoise = FilterNoise {
    vertical: Vector3::new(1.0, 0.0, 0.0),
    horizontal_jerk: 1.0,
    vertical_jerk: 1.0,
    bounce_std: 1e-4,
    bounce_hz: 1.8,
    pixel_factor: 1.0,
    depth_factor: 1.0,
};

impl FilterNoise {
    fn with_jerk(self, density: f64) -> Self {
        Self {
            horizontal_jerk: density,
            vertical_jerk: density,
            ..self
        }
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Motion of the very model: white jerk, measured with noise.
fn simulated(
    jerk_density: f64,
    pixel_std: f64,
    depth_std: f64,
    count: usize,
) -> (Vec<Vector3<f64>>, Vec<Option<Measurement>>) {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let factor = process_noise(DT, &NOISE.with_jerk(jerk_density))
        .cholesky()
        .unwrap()
        .l();
    let mut state = State::zeros();
    let (mut truth, mut measurements) = (Vec::new(), Vec::new());
    for frame in 0..count {
        let noise = factor * State::from_fn(|_, _| normal(&mut random)); // the bounce stays at a tenth of a millimetre
        // A pull back to the origin keeps people in the room.
        state = transition(DT, &NOISE) * state + noise;
        for axis in 0..3 {
            state[6 + axis] -=
                DT * (2.0 * state[6 + axis] + 4.0 * state[3 + axis] + 2.0 * state[axis]);
        }
        let position: Vector3<f64> = state.fixed_rows::<3>(0).into_owned();
        truth.push(position);
        let error = Vector3::new(
            pixel_std * normal(&mut random),
            pixel_std * normal(&mut random),
            depth_std * normal(&mut random),
        );
        let measurement = Measurement {
            position: position + error,
            covariance_of_pixel: Matrix3::from_diagonal(&Vector3::new(
                0.02_f64.powi(2),
                0.02_f64.powi(2),
                0.0,
            )),
            covariance_of_depth: Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.02_f64.powi(2))),
        };
        measurements.push((frame % 17 != 3).then_some(measurement));
    }
    (truth, measurements)
}

#[test]
fn the_noise_is_learnt_and_the_covariance_is_honest() {
    let (truth, measurements) = simulated(200.0, 0.01, 0.06, 3000);
    let noise = learn_noise(&measurements, DT, &Vector3::x());
    println!("{noise:?}");
    assert!((noise.pixel_factor - 0.5).abs() < 0.05, "{noise:?}");
    assert!((noise.depth_factor - 3.0).abs() < 0.3, "{noise:?}");
    for jerk in [noise.horizontal_jerk, noise.vertical_jerk] {
        assert!((jerk / 200.0).ln().abs() < 0.5, "{noise:?}");
    }
    let run = kalman_filter(&measurements, DT, &noise, Gate::Mahalanobis);
    let consistency = |states: &[RootState]| {
        let of = |(state, truth): (&RootState, &Vector3<f64>)| {
            let error = state.position - truth;
            error.dot(&state.position_covariance.cholesky().unwrap().solve(&error))
        };
        states.iter().zip(&truth).map(of).sum::<f64>() / states.len() as f64 / 3.0
    };
    let (filtered, smoothed) = (run.filtered(), run.smoothed(DT));
    println!(
        "squared error by its covariance: filtered {:.3}, smoothed {:.3}",
        consistency(&filtered),
        consistency(&smoothed)
    );
    assert!(
        (0.8..1.25).contains(&consistency(&filtered))
            && (0.8..1.25).contains(&consistency(&smoothed))
    );
    let rms = |states: &[RootState]| {
        (states
            .iter()
            .zip(&truth)
            .map(|(state, truth)| (state.position - truth).norm_squared())
            .sum::<f64>()
            / truth.len() as f64)
            .sqrt()
    };
    assert!(
        rms(&smoothed) < 0.75 * rms(&filtered),
        "{} {}",
        rms(&smoothed),
        rms(&filtered)
    );
}

#[test]
fn outliers_are_gated_and_gaps_bridged_with_growing_doubt() {
    let (truth, mut measurements) = simulated(200.0, 0.02, 0.02, 600);
    for frame in (50..600).step_by(40) {
        if let Some(measurement) = &mut measurements[frame] {
            measurement.position += Vector3::new(0.0, 1.5, -0.8);
        }
    }
    for missing in &mut measurements[300..320] {
        *missing = None;
    }
    let run = kalman_filter(
        &measurements,
        DT,
        &learn_noise(&measurements, DT, &Vector3::x()),
        Gate::Mahalanobis,
    );
    let outliers: Vec<usize> = (0..600)
        .filter(|&frame| measurements[frame].is_some() && !run.accepted[frame])
        .collect();
    let planted: Vec<usize> = (50..600)
        .step_by(40)
        .filter(|&frame| measurements[frame].is_some())
        .collect();
    println!("gated {outliers:?}");
    assert!(planted.iter().all(|frame| outliers.contains(frame)));
    assert!(
        outliers.len() <= planted.len() + 6,
        "few good ones are lost"
    );
    let smoothed = run.smoothed(DT);
    let doubt = |frame: usize| smoothed[frame].position_covariance.trace().sqrt();
    assert!(doubt(310) > 3.0 * doubt(290) && doubt(310) > doubt(302));
    assert!((smoothed[310].position - truth[310]).norm() < 4.0 * doubt(310));
}

#[test]
fn nothing_measured_is_nothing_known() {
    let run = kalman_filter(&[None, None], DT, &NOISE, Gate::Mahalanobis);
    assert_eq!(run.accepted, [false, false]);
    assert!(run.smoothed(DT)[1].position_covariance.trace() > 100.0);
    assert!(
        kalman_filter(&[], DT, &NOISE, Gate::Mahalanobis)
            .smoothed(DT)
            .is_empty()
    );
}

#[test]
fn a_bounce_is_found_in_noise_as_large_as_itself() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let bounce = |frame: usize| {
        Vector3::new(
            0.022 * (std::f64::consts::TAU * 1.83 * frame as f64 * DT).sin(),
            0.0,
            0.0,
        )
    };
    let truth: Vec<Vector3<f64>> = (0..300)
        .map(|frame| Vector3::new(1.0, 1.1 * frame as f64 * DT, 4.0) + bounce(frame))
        .collect();
    let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 4e-4));
    let measured = |truth: &Vector3<f64>, random: &mut ChaCha8Rng| {
        let position = truth + Vector3::from_fn(|_, _| 0.02 * normal(random));
        Some(Measurement {
            position,
            covariance_of_pixel: covariance,
            covariance_of_depth: Matrix3::zeros(),
        })
    };
    let measurements: Vec<_> = truth
        .iter()
        .map(|truth| measured(truth, &mut random))
        .collect();
    let noise = learn_noise(&measurements, DT, &Vector3::x());
    println!("{noise:?}");
    assert!(
        (noise.bounce_hz - 1.83).abs() < 0.05 && (0.005..0.05).contains(&noise.bounce_std),
        "{noise:?}"
    );
    let states = kalman_filter(&measurements, DT, &noise, Gate::Mahalanobis).smoothed(DT);
    let turn = std::f64::consts::TAU * 1.83;
    let rms = |of: &dyn Fn(usize) -> f64| {
        ((0..300).map(|frame| of(frame).powi(2)).sum::<f64>() / 300.0).sqrt()
    };
    let error = rms(&|frame| states[frame].acceleration.x + turn * turn * bounce(frame).x);
    let whole = rms(&|frame| turn * turn * bounce(frame).x);
    println!("vertical acceleration {whole:.2} m/s2, found within {error:.2} m/s2");
    assert!(error < 0.4 * whole);
}
