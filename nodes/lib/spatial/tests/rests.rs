//! A rest beside a burst stays one.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_spatial::{PoseEstimate, Stamp};
use nalgebra::{UnitQuaternion, Vector3};
use support::noise;

const RATE_HZ: f64 = 240.0;

/// Turns of 0.5 rad at 3 Hz, for two seconds in every seven, eased over 0.2 s; else at rest.
fn angle(t: f64) -> f64 {
    let within = t % 7.0 - 3.0;
    let eased = |x: f64| 1.0 / (1.0 + (-x / 0.05).exp());
    0.5 * eased(within) * eased(2.0 - within) * (6.0 * std::f64::consts::PI * t).sin()
}

#[test]
fn a_burst_does_not_ring_in_the_rests_beside_it() {
    let mut state = 3;
    let mut draw = |sigma: f64| Vector3::from_fn(|_, _| sigma * noise(&mut state));
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(60.0 * RATE_HZ) as i64 {
        let t = k as f64 / RATE_HZ;
        stamps.push(Stamp::from_nanos(0).plus_seconds(t));
        positions.push(draw(2e-4));
        rotations.push(UnitQuaternion::new(
            Vector3::new(angle(t), 0.0, 0.0) + draw(1e-3),
        ));
    }
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(RATE_HZ);
    let at_rest = |t: f64| (0.5..2.5).contains(&(t % 7.0)) || t % 7.0 > 5.5;
    let squares: Vec<f64> = (0..track.len())
        .filter(|k| {
            let t = *k as f64 / track.rate_hz;
            at_rest(t) && (2.0..56.0).contains(&t)
        })
        .map(|k| track.angular_velocity_in_segment[k].norm_squared())
        .collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // The bursts reach 9 rad/s; the noise alone, below 4 Hz, leaves 0.007 rad/s.
    assert!(rms < 0.02, "{rms} rad/s at rest");
}
