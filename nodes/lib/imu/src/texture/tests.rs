#![allow(clippy::unwrap_used)]
use cromosim_spatial::{uniform_stamps, welch};

use super::*;
use crate::test_motions::{START, trajectory, wrist};
use crate::{Differentiation, simulate_kinematics};

const BANDWIDTH_HZ: f64 = 8.0;

fn low_passed() -> Vec<KinematicSample> {
    let trajectory = trajectory(wrist, 100.0, 120.0);
    let stamps = uniform_stamps(START, trajectory.end(), 100.0).unwrap();
    let by = Differentiation::Bandwidth(BANDWIDTH_HZ);
    simulate_kinematics(&trajectory, by, &stamps).unwrap()
}

fn drawn(seed: u64, name: &str) -> Vec<KinematicSample> {
    let mut motion = low_passed();
    add_texture(&mut motion, TextureSegment::Arm, (seed, name)).unwrap();
    motion
}

/// Along x in sensor axes: of specific force or angular velocity.
fn series(motion: &[KinematicSample], channel: usize) -> Vec<f64> {
    let read = |sample: &KinematicSample| {
        let reading = sample.imu();
        [reading.specific_force, reading.angular_velocity][channel].x
    };
    motion.iter().map(read).collect()
}

#[test]
fn what_is_drawn_has_the_models_spectrum_above_the_bandwidth_and_nothing_below() {
    let (plain, textured) = (low_passed(), drawn(3, "wrist"));
    for channel in 0..2 {
        let texture = &TextureSegment::Arm.channels()[channel];
        let added: Vec<f64> = series(&textured, channel)
            .iter()
            .zip(series(&plain, channel))
            .map(|(with, without)| with - without)
            .collect();
        let spectrum = welch(&added, 100.0, 256);
        let growth = growth(&plain, channel, texture, 100.0);
        let growth = growth.iter().sum::<f64>() / growth.len() as f64;
        for (low, high) in [(14.0, 18.0), (20.0, 25.0), (30.0, 40.0)] {
            let band = spectrum.band(low, high);
            let found = band.iter().sum::<f64>() / band.len() as f64;
            let expected = texture.density((low * high).sqrt()) * growth;
            assert!(
                (0.7..1.4).contains(&(found / expected)),
                "{channel}, {low} Hz: {found} {expected}"
            );
        }
        let below = spectrum.band(3.0, 0.5 * BANDWIDTH_HZ);
        let below = below.iter().sum::<f64>() / below.len() as f64;
        let model = texture.density(4.0) * growth;
        assert!(below < 0.05 * model, "{channel}: {below} {model}");
        // And is stated, twice: it is in the place of as much that is not known.
        let stated = |sample: &KinematicSample| {
            [
                sample.variance.acceleration,
                sample.variance.angular_velocity,
            ][channel]
        };
        let mean = |motion: &[KinematicSample]| motion.iter().map(stated).sum::<f64>();
        let stated = (mean(&textured) - mean(&plain)) / plain.len() as f64;
        let square = added.iter().map(|x| x * x).sum::<f64>() / added.len() as f64;
        assert!(
            (0.75..1.33).contains(&(stated / (2.0 * square))),
            "{channel}"
        );
    }
}

#[test]
fn a_seed_and_a_name_make_the_texture() {
    assert_eq!(drawn(3, "wrist"), drawn(3, "wrist"));
    assert_ne!(drawn(3, "wrist"), drawn(4, "wrist"));
    assert_ne!(drawn(3, "wrist"), drawn(3, "ankle"));
}

#[test]
fn at_rest_and_without_a_bandwidth_nothing_is_drawn() {
    let mut resting = low_passed();
    let first = resting[0];
    for sample in &mut resting {
        let stamp = sample.stamp;
        *sample = KinematicSample { stamp, ..first };
        sample.angular_velocity_in_world = Vector3::zeros();
    }
    let before = resting.clone();
    add_texture(&mut resting, TextureSegment::Foot, (1, "foot")).unwrap();
    for (before, after) in before.iter().zip(&resting) {
        let apart = after.imu().specific_force - before.imu().specific_force;
        assert!(apart.norm() < 1e-6, "{apart}");
    }
    let mut unknown = before;
    unknown
        .iter_mut()
        .for_each(|sample| sample.bandwidth = None);
    let kept = unknown.clone();
    assert_eq!(
        add_texture(&mut unknown, TextureSegment::Foot, (1, "foot")),
        None
    );
    assert_eq!(unknown, kept);
}
