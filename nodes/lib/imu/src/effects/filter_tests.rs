use super::*;

const LOW_PASS: SecondOrder = SecondOrder {
    natural_hz: 12.0,
    damping_ratio: std::f64::consts::FRAC_1_SQRT_2,
};
const RINGING: SecondOrder = SecondOrder {
    natural_hz: 9.0,
    damping_ratio: 0.2,
};

/// Gain of sine and cosine of the analytic response at a frequency: real and imaginary part.
fn analytic(filter: &SecondOrder, hz: f64) -> (f64, f64) {
    let r = hz / filter.natural_hz;
    let (real, imaginary) = (1.0 - r * r, 2.0 * filter.damping_ratio * r);
    let square = real * real + imaginary * imaginary;
    (real / square, -imaginary / square)
}

#[test]
fn the_response_is_the_analytic_one() {
    let fast = SecondOrder {
        natural_hz: 500.0,
        ..LOW_PASS
    };
    for filter in [LOW_PASS, RINGING, fast] {
        for hz in [0.5, 3.0, 9.0, 12.0, 25.0] {
            let sine = |t: f64| (TAU * hz * t).sin();
            let mut series: Vec<Vector3<f64>> = (0..4000)
                .map(|k| Vector3::x() * sine(f64::from(k) / 200.0))
                .collect();
            filter.apply(&mut series, 200.0);
            let (real, imaginary) = analytic(&filter, hz);
            let gain = real.hypot(imaginary);
            for (k, value) in series.iter().enumerate().take(3990).skip(2000) {
                let phase = TAU * hz * k as f64 / 200.0;
                let expected = real * phase.sin() + imaginary * phase.cos();
                assert!(
                    (value.x - expected).abs() < 0.003 * gain,
                    "{filter:?} at {hz} Hz: {} against {expected}",
                    value.x
                );
            }
        }
    }
}

#[test]
fn a_constant_stays_and_a_fast_filter_changes_nothing() {
    for natural_hz in [0.2, 1.0, 31.0, 64.0, 500.0, 1e4] {
        for damping_ratio in [0.001, 0.7, 1.0, 2.0] {
            let filter = SecondOrder {
                natural_hz,
                damping_ratio,
            };
            let mut series = vec![Vector3::new(1.0, -2.0, 9.80665); 300];
            filter.apply(&mut series, 200.0);
            assert!(
                series
                    .iter()
                    .all(|value| (value - Vector3::new(1.0, -2.0, 9.80665)).norm() < 1e-8),
                "{filter:?} {:?}",
                series[299]
            );
        }
    }
    let tone: Vec<Vector3<f64>> = (0..300)
        .map(|k| Vector3::y() * (0.1 * f64::from(k)).sin())
        .collect();
    let mut filtered = tone.clone();
    SecondOrder {
        natural_hz: 9e3,
        ..LOW_PASS
    }
    .apply(&mut filtered, 200.0);
    assert!(
        tone.iter()
            .zip(&filtered)
            .all(|(a, b)| (a - b).norm() < 1e-3)
    );
}

#[test]
fn steps_add_up_and_states_decay_as_stated() {
    // Two steps of h are one of 2 h for an input that stays.
    for filter in [LOW_PASS, RINGING] {
        let (half, taps) = filter.step_from::<2>(0.004, 0);
        let (whole, wide) = filter.step_from::<2>(0.008, 0);
        assert!((half * half - whole).norm() < 1e-13);
        let (sum, total) = (taps[0] + taps[1], wide[0] + wide[1]);
        assert!((half * sum + sum - total).norm() < 1e-13);
    }
    // A step from 1 to 0 in the middle of a series.
    let mut series: Vec<Vector3<f64>> = (0..100_000)
        .map(|k| Vector3::z() * if k < 50_000 { 1.0 } else { 0.0 })
        .collect();
    LOW_PASS.apply(&mut series, 1e5);
    let decayed = LOW_PASS.homogeneous(0.02, &Vector3::z(), &Vector3::zeros());
    assert!(
        (series[52_000] - decayed).norm() < 2e-3,
        "{} against {}",
        series[52_000],
        decayed
    );
}

#[test]
fn streamed_is_the_first_order_hold() {
    let mut streamed = Streamed::new(LOW_PASS);
    let mut offline: Vec<Vector3<f64>> = (0..2000)
        .map(|k| Vector3::x() * (TAU * 3.0 * f64::from(k) / 200.0).sin())
        .collect();
    let online: Vec<Vector3<f64>> = offline
        .iter()
        .map(|input| streamed.push(*input, 1.0 / 200.0))
        .collect();
    LOW_PASS.apply(&mut offline, 200.0);
    let largest = online
        .iter()
        .zip(&offline)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max);
    assert!(largest < 2e-3, "{largest}");
    streamed.reset();
    assert_eq!(streamed.push(Vector3::y(), 0.1), Vector3::y());
}
