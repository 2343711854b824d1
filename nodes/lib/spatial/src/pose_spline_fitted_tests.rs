#![allow(clippy::unwrap_used)]
use std::f64::consts::TAU;

use super::*;

const RATE_HZ: f64 = 120.0;
/// A foot strikes the floor, within 0.05 s, and chatters by 1 mm for a third of a second.
const CHATTER_HZ: f64 = 33.0;

/// Second derivative along x at the frames, what the poses show of it, and their noise below 8 Hz: some
/// millimetres of sines.
fn seen() -> (Vec<Stamp>, Vec<Isometry3<f64>>, Vec<f64>) {
    let (w, q) = (TAU * CHATTER_HZ, 1.0 / 0.1_f64.powi(2));
    let noise = |t: f64| -> f64 {
        let sine = |k: i32| {
            let hz = 0.31 * f64::from(k);
            (TAU * hz * t + f64::from(k * k)).sin() / (1.0 + (hz / 8.0).powi(4))
        };
        0.95e-3 * (2.0_f64 / 21.0).sqrt() * (1..60).map(sine).sum::<f64>()
    };
    let (mut stamps, mut poses, mut exact) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..600 {
        let t = f64::from(k) / RATE_HZ;
        let s = t - 2.5;
        let stroke = 2500.0;
        let strike = 0.02 * (-0.5 * stroke * s * s).exp();
        let envelope = 1e-3 * (-0.5 * q * s * s).exp();
        let (sine, cosine) = (w * s).sin_cos();
        let bend = (q * q * s * s - q - w * w) * cosine + 2.0 * q * s * w * sine;
        stamps.push(Stamp::from_seconds(t));
        poses.push(Isometry3::translation(
            strike + envelope * cosine + noise(t),
            noise(t + 17.0),
            noise(t + 39.0),
        ));
        exact.push(strike * stroke * (stroke * s * s - 1.0) + envelope * bend);
    }
    (stamps, poses, exact)
}

/// Root mean square errors along x: within 0.15 s of the middle of the chatter, and a second and more from it.
fn errors(source: PoseSource) -> [f64; 2] {
    let (stamps, poses, exact) = seen();
    let spline = PoseSpline::fit(&stamps, &poses, PoseSmoothing::adaptive(source)).unwrap();
    let mut sums = [[0.0; 2]; 2];
    for (stamp, exact) in stamps.iter().zip(&exact) {
        let away = (*stamp - Stamp::from_seconds(2.5)).abs();
        let error = spline.evaluate(*stamp).acceleration.x - exact;
        let place = match away {
            ..0.15 => 0,
            1.0..2.2 => 1,
            _ => continue,
        };
        sums[place][0] += error * error;
        sums[place][1] += 1.0;
    }
    sums.map(|[sum, count]| (sum / count).sqrt())
}

/// White noise of the density that a fit's has below its corner would hide the chatter, of 43 m/s2.
#[test]
fn what_no_fit_leaves_of_noise_is_motion() {
    let [[fitted, fitted_rest], [_, tracked_rest]] =
        [errors(PoseSource::Fitted), errors(PoseSource::Tracked)];
    println!("{fitted} {fitted_rest} {tracked_rest}");
    assert!(fitted < 5.0, "{fitted}");
    assert!(
        fitted_rest < 0.5 && fitted_rest < 0.5 * tracked_rest,
        "{fitted_rest} {tracked_rest}"
    );
}

/// Live and offline share what is learnt: a window that has not moved says what a fit of it says.
#[test]
fn a_window_follows_noise_behind_a_low_pass() {
    let (stamps, poses, _) = seen();
    let times = PoseTimes::new(&stamps).unwrap();
    let mut learnt = PoseAdaptation::default();
    let followed =
        PoseSpline::fit_following(&times, &poses, PoseSource::Fitted, (&mut learnt, 0)).unwrap();
    let alone =
        PoseSpline::fit_on(&times, &poses, PoseSmoothing::adaptive(PoseSource::Fitted)).unwrap();
    for stamp in &stamps {
        assert_eq!(followed.estimate(*stamp), alone.estimate(*stamp));
    }
}
