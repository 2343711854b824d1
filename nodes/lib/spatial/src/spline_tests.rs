#![allow(clippy::unwrap_used)]
use std::f64::consts::TAU;

use super::*;

fn seconds(count: usize, interval: f64) -> Vec<f64> {
    (0..count).map(|k| 3.0 + k as f64 * interval).collect()
}

/// Value and derivatives of a tone of 1.7 Hz.
fn tone(t: f64) -> [f64; 3] {
    let w = TAU * 1.7;
    [(w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin()]
}

fn samples(seconds: &[f64]) -> Vec<[f64; 1]> {
    seconds.iter().map(|t| [tone(*t)[0]]).collect()
}

/// Numbers like normal ones, the same on every run (sum of twelve from a linear congruence).
fn noise(count: usize, sigma: f64) -> Vec<f64> {
    let mut state = 88_172_645_463_325_252_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count)
        .map(|_| sigma * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0))
        .collect()
}

/// Largest error of a derivative between the samples, ends included.
fn worst(spline: &SmoothingSpline<1>, seconds: &[f64], derivative: usize) -> f64 {
    let (start, end) = (seconds[0], seconds[seconds.len() - 1]);
    let at = |k: usize| start + (end - start) * k as f64 / 1000.0;
    (0..=1000)
        .map(|k| (spline.evaluate(at(k))[derivative][0] - tone(at(k))[derivative]).abs())
        .fold(0.0, f64::max)
}

#[test]
fn quintics_are_reproduced_to_the_ends() {
    let seconds: Vec<f64> = (0..12)
        .map(|k| 0.2 * f64::from(k) + 0.03 * (1.3 * f64::from(k)).sin())
        .collect();
    let values: Vec<[f64; 2]> = seconds
        .iter()
        .map(|t| [t.powi(5) - t.powi(2), 7.0])
        .collect();
    let spline = SmoothingSpline::fit(&seconds, &values, Smoothing::Interpolate).unwrap();
    for t in [0.0, 0.1, 1.15, 1.9, 2.2_f64] {
        let [value, slope, second] = spline.evaluate(t);
        assert!((value[0] - (t.powi(5) - t.powi(2))).abs() < 1e-5 && (value[1] - 7.0).abs() < 1e-9);
        assert!((slope[0] - (5.0 * t.powi(4) - 2.0 * t)).abs() < 1e-3 && slope[1].abs() < 1e-8);
        assert!((second[0] - (20.0 * t.powi(3) - 2.0)).abs() < 2e-2 && second[1].abs() < 1e-7);
    }
}

#[test]
fn interpolation_converges_at_its_orders_ends_included() {
    // Sixth order in the value, fifth in the slope, fourth in the second derivative.
    for (derivative, order) in [(0, 6.0), (1, 5.0), (2, 4.0)] {
        let error = |interval: f64| {
            let seconds = seconds((2.0 / interval) as usize + 1, interval);
            worst(
                &SmoothingSpline::fit(&seconds, &samples(&seconds), Smoothing::Automatic).unwrap(),
                &seconds,
                derivative,
            )
        };
        let measured = (error(0.04) / error(0.02)).log2();
        assert!(
            measured > order - 0.4,
            "derivative {derivative}: order {measured}"
        );
    }
}

#[test]
fn exact_samples_are_interpolated_and_jittered_ones_smoothed() {
    let seconds = seconds(1000, 0.01);
    let exact = samples(&seconds);
    let spline = SmoothingSpline::fit(&seconds, &exact, Smoothing::Automatic).unwrap();
    let SplineWeight::Uniform(weight) = *spline.weight() else {
        panic!("one weight");
    };
    assert!(weight < 1e-6, "{weight}");
    let jittered: Vec<[f64; 1]> = exact
        .iter()
        .zip(noise(1000, 0.01))
        .map(|(x, n)| [x[0] + n])
        .collect();
    let smooth = SmoothingSpline::fit(
        &seconds,
        &jittered,
        Smoothing::AutomaticFor(Derivative::Second),
    )
    .unwrap();
    assert!(
        (2.0..8.0).contains(&smooth.cutoff_hz(0.0)),
        "{} Hz",
        smooth.cutoff_hz(0.0)
    );
    let rms = |spline: &SmoothingSpline<1>| {
        let square: f64 = seconds[50..950]
            .iter()
            .map(|t| (spline.evaluate(*t)[2][0] - tone(*t)[2]).powi(2))
            .sum();
        (square / 900.0).sqrt()
    };
    // Away from the ends the automatic weight is within a tenth of the best that any weight can do.
    let best = (-8..24).map(|e| {
        rms(&SmoothingSpline::fit(
            &seconds,
            &jittered,
            Smoothing::Weight(10f64.powf(f64::from(e) * 0.5)),
        )
        .unwrap())
    });
    let best = best.fold(f64::INFINITY, f64::min);
    assert!(rms(&smooth) < 1.1 * best, "{} against {best}", rms(&smooth));
}

#[test]
fn uneven_times_and_gaps_are_bridged() {
    let wobble = noise(400, 0.0015);
    let mut seconds: Vec<f64> = seconds(400, 0.01)
        .iter()
        .zip(wobble)
        .map(|(t, n)| t + n.clamp(-0.004, 0.004))
        .collect();
    seconds.drain(200..212);
    let spline = SmoothingSpline::fit(&seconds, &samples(&seconds), Smoothing::Automatic).unwrap();
    assert!(
        worst(&spline, &seconds, 0) < 1e-3
            && worst(&spline, &seconds, 2) < 0.05 * tone(0.0)[1].powi(2)
    );
    let mut long_gap = seconds.clone();
    long_gap.iter_mut().skip(100).for_each(|t| *t += 30.0);
    let spline = SmoothingSpline::fit(&long_gap, &samples(&seconds), Smoothing::Automatic).unwrap();
    assert!(
        long_gap
            .iter()
            .zip(&seconds)
            .all(|(t, s)| (spline.evaluate(*t)[0][0] - tone(*s)[0]).abs() < 0.02)
    );
    assert!((0..100).all(|k| {
        spline
            .evaluate(long_gap[0] + 0.3 * f64::from(k))
            .iter()
            .all(|d| d[0].is_finite())
    }));
}

#[test]
fn a_cutoff_is_the_frequency_of_half_response() {
    let seconds = seconds(2000, 0.01);
    let spline =
        SmoothingSpline::fit(&seconds, &samples(&seconds), Smoothing::CutoffHz(1.7)).unwrap();
    let middle = 13.0 + 0.25 / 1.7 * (1.0 - (13.0 * 1.7_f64).fract() * 4.0);
    assert!((spline.evaluate(middle)[0][0] / tone(middle)[0] - 0.5).abs() < 0.01);
    assert!((spline.cutoff_hz(0.5) - 1.7).abs() < 1e-9);
}

#[test]
fn few_samples_a_series_at_rest_and_large_coordinates_work() {
    for count in 2..20 {
        let seconds = seconds(count, 0.1);
        let line: Vec<[f64; 1]> = seconds.iter().map(|t| [4.0 - 2.0 * t]).collect();
        let [value, slope, second] = SmoothingSpline::fit(&seconds, &line, Smoothing::Automatic)
            .unwrap()
            .evaluate(3.05);
        assert!(
            (value[0] + 2.1).abs() < 1e-9
                && (slope[0] + 2.0).abs() < 1e-8
                && second[0].abs() < 1e-6,
            "{count}"
        );
    }
    let seconds = seconds(300, 0.01);
    let rest = SmoothingSpline::fit(&seconds, &vec![[1000.1]; 300], Smoothing::Automatic).unwrap();
    assert!(rest.evaluate(4.005)[2][0].abs() < 1e-4);
}

#[test]
fn bad_input_is_refused_with_its_index() {
    let fit = |seconds: &[f64], values: &[[f64; 1]], smoothing| {
        SmoothingSpline::fit(seconds, values, smoothing).unwrap_err()
    };
    assert_eq!(
        fit(&[0.0], &[[1.0]], Smoothing::Automatic),
        SpatialError::TooFewSamples { got: 1, needed: 2 }
    );
    let duplicate = fit(&[0.0, 1.0, 1.0], &[[1.0]; 3], Smoothing::Automatic);
    assert_eq!(
        duplicate,
        SpatialError::TimeNotIncreasing {
            index: 2,
            previous: 1.0,
            next: 1.0
        }
    );
    let nan = fit(
        &[0.0, 1.0, 2.0],
        &[[1.0], [f64::NAN], [1.0]],
        Smoothing::Automatic,
    );
    assert_eq!(
        nan,
        SpatialError::NotFinite {
            index: 1,
            what: "value"
        }
    );
    assert!(matches!(
        fit(&[0.0, 1.0], &[[1.0]], Smoothing::Automatic),
        SpatialError::LengthMismatch {
            expected: 2,
            found: 1,
            ..
        }
    ));
    assert_eq!(
        fit(&[0.0, 1.0], &[[1.0]; 2], Smoothing::CutoffHz(0.0)),
        SpatialError::BadRate { rate_hz: 0.0 }
    );
    assert_eq!(
        fit(&[0.0, 1.0], &[[1.0]; 2], Smoothing::Weight(-1.0)),
        SpatialError::BadWeight { weight: -1.0 }
    );
}

#[test]
fn the_residual_asked_for_is_left() {
    let seconds = seconds(600, 0.01);
    let errors = noise(600, 0.02);
    let noisy: Vec<[f64; 1]> = samples(&seconds)
        .iter()
        .zip(&errors)
        .map(|(value, error)| [value[0] + error])
        .collect();
    let left = |std: f64| {
        let spline = SmoothingSpline::fit(&seconds, &noisy, Smoothing::ResidualStd(std)).unwrap();
        let square: f64 = seconds
            .iter()
            .zip(&noisy)
            .map(|(t, value)| (spline.evaluate(*t)[0][0] - value[0]).powi(2))
            .sum();
        (square / 600.0).sqrt()
    };
    for std in [0.005, 0.02, 0.05] {
        assert!(
            left(std) <= std && left(std) > 0.98 * std,
            "{} of {std}",
            left(std)
        );
    }
    // No straight enough line: the series lies within a great distance of a polynomial.
    assert!(left(10.0) < 1.0);
    assert!(SmoothingSpline::fit(&seconds, &noisy, Smoothing::ResidualStd(f64::NAN)).is_err());
}
