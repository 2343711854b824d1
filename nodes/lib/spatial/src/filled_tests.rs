#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use crate::{ErrorPath, PoseEstimate, SampleVariance, Stamp, so3};

const HZ: f64 = 100.0;
const SECONDS: f64 = 120.0;

/// A sum of a hundred lines from 0.2 to 3 Hz: value and second derivative.
struct Swaying(Vec<(f64, Vector3<f64>)>);

impl Swaying {
    fn new(random: &mut ChaCha12Rng) -> Self {
        let line = |k: i32| {
            let phase = Vector3::from_fn(|_, _| random.random_range(0.0..TAU));
            (0.2 + 0.028 * f64::from(k), phase)
        };
        Self((0..100).map(line).collect())
    }

    fn at(&self, t: f64) -> [Vector3<f64>; 2] {
        let mut sums = [Vector3::zeros(); 2];
        for (hz, phase) in &self.0 {
            // 0.1 m/s2 each.
            let acceleration = phase.map(|phase| -0.1 * (TAU * hz * t + phase).sin());
            sums[0] -= acceleration / (TAU * hz).powi(2);
            sums[1] += acceleration;
        }
        sums
    }
}

fn is_lost(t: f64) -> bool {
    t > 5.0 && t % 10.0 < 0.6
}

#[test]
fn what_is_filled_in_errs_as_stated() {
    let mut random = ChaCha12Rng::seed_from_u64(3);
    let motion = Swaying::new(&mut random);
    let mut noise = |sigma: f64| {
        // Of twelve uniform numbers.
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        Vector3::from_fn(|_, _| sigma * normal())
    };
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    let at = |t: f64| Stamp::default().plus_seconds(t);
    for k in 0..(SECONDS * HZ) as usize {
        let t = k as f64 / HZ;
        let (dp, dr) = (noise(2e-4), noise(1e-3));
        if !is_lost(t) {
            stamps.push(at(t));
            positions.push(motion.at(t)[0] + dp);
            rotations.push(UnitQuaternion::identity() * so3::exp(&dr));
        }
    }
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let track = estimate.track(HZ);
    let path = ErrorPath {
        units_per_metre: 1.0,
        lever_arm_m: 0.0,
        passed: &|_| [1.0; 2],
    };
    // In the middle of gaps, beside them, and far from them.
    let mut sums = [[0.0; 2]; 3];
    for k in 100..track.len() - 100 {
        let t = k as f64 / HZ;
        let within = t % 10.0;
        let place = match within {
            _ if t < 9.0 => continue,
            0.15..0.45 => 0,
            0.7..0.75 | 9.85..9.9 => 1,
            2.0..8.0 => 2,
            _ => continue,
        };
        let acceleration = track.world_from_segment[k] * track.acceleration_in_segment[k];
        let [own] = estimate.variances(&[at(t)], &path)[..] else {
            unreachable!("one for each stamp")
        };
        let SampleVariance {
            acceleration: stated,
            ..
        } = own;
        sums[place][0] += (acceleration - motion.at(t)[1]).norm_squared() / 3.0;
        sums[place][1] += stated;
    }
    let [inside, beside, far] = sums.map(|[found, stated]| found / stated);
    // Eleven gaps; a filter spreads what is filled in further than is stated.
    assert!((0.4..2.5).contains(&inside), "{inside}");
    assert!((0.1..4.0).contains(&beside), "{beside}");
    assert!((0.7..1.4).contains(&far), "{far}");
}
