//! References whose noise has a memory, or hides what would tell.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{PlacementRecord, PoseSeries};
use cromosim_imu::{EffectKind as K, normal_pair};
use cromosim_spatial::so3;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use support::judge::{answer, names};
use support::motion::Motion;
use support::{REFERENCE_HZ, SIGMA, Scene};

/// Noise of first order beside that of the record: m, rad, and its memory, s.
fn with_memory(mut record: PlacementRecord, sizes: [f64; 2], memory_s: f64) -> PlacementRecord {
    let mut random = ChaCha12Rng::seed_from_u64(7);
    let pole = (-1.0 / (memory_s * REFERENCE_HZ)).exp();
    let mut noise = [Vector3::zeros(); 2];
    let series = &mut record.reference;
    for (position, rotation) in series.positions.iter_mut().zip(&mut series.rotations) {
        for (value, size) in noise.iter_mut().zip(sizes) {
            let ([x, y], [z, _]) = (normal_pair(&mut random), normal_pair(&mut random));
            *value = *value * pole + Vector3::new(x, y, z) * size * (1.0 - pole * pole).sqrt();
        }
        *position += noise[0];
        *rotation *= so3::exp(&noise[1]);
    }
    record
}

/// At 30 Hz.
fn every_fourth(poses: &PoseSeries) -> PoseSeries {
    PoseSeries {
        stamps: poses.stamps.iter().step_by(4).copied().collect(),
        positions: poses.positions.iter().step_by(4).copied().collect(),
        rotations: poses.rotations.iter().step_by(4).copied().collect(),
    }
}

#[test]
fn noise_with_a_memory_is_nothing_unknown() {
    for (seed, memory_s) in [(31, 0.005), (32, 0.009), (33, 0.012)] {
        let record = with_memory(Scene::new(seed).record(), [2.5e-4, 8e-4], memory_s);
        let diagnosis = answer(&record).diagnosis;
        assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.verdict);
    }
}

#[test]
fn at_rest_noise_tells_millimetres() {
    let scene = Scene {
        motion: Motion::rest(),
        ..Scene::new(34)
    };
    let record = scene.with(K::ReferenceUnits, &[1000.0]).record();
    assert_eq!(names(&answer(&record).diagnosis), ["reference_units"]);
}

#[test]
fn degrees_are_told_where_noise_hides_all_axes_but_one() {
    let scene = Scene {
        motion: Motion::turning_about_one_axis(),
        ..Scene::new(35)
    };
    let record = scene.with(K::GyroUnits, &[57.295_779_513_082_32]).record();
    let record = with_memory(record, [1e-4, 1.4e-3], 1e-3);
    assert_eq!(names(&answer(&record).diagnosis), ["gyro_units"]);
}

#[test]
fn a_gain_that_outweighs_a_noisy_reference_is_a_cause() {
    let scene = Scene::new(36)
        .with(K::ReferenceNoise, &[1e-4, 0.0147])
        .with(K::AccelScale, &[1.012, 1.014, 1.015]);
    assert_eq!(
        names(&answer(&scene.record()).diagnosis),
        ["accel_scale", "reference_noise"]
    );
}

#[test]
fn a_smoothing_of_poses_without_noise_is_no_tissue() {
    for (seed, cutoff_hz) in [(37, 3.7), (38, 3.0), (40, 2.2)] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(2.0),
            ..Scene::new(seed)
        };
        let scene = scene
            .with(K::ReferenceNoise, &[1e-9, 1e-9])
            .with(K::ReferenceSmoothing, &[cutoff_hz, 0.0]);
        let named = names(&answer(&scene.record()).diagnosis).join(" ");
        assert_eq!(named, "reference_smoothing", "{cutoff_hz} Hz");
    }
}

/// Such noise is in the simulation and not in the readings; a filter of the sensor would attenuate it too.
#[test]
fn noise_with_a_memory_is_no_filter_of_the_sensor() {
    for (seed, slow) in [(43, 1.25), (44, 1.5), (47, 2.25)] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(slow),
            ..Scene::new(seed)
        };
        let record = scene.with(K::TimeOffset, &[0.045]).record();
        let record = with_memory(record, [2.5e-4, 1.2e-3], 0.012);
        assert_eq!(names(&answer(&record).diagnosis), ["time_offset"]);
    }
}

/// Nor is it where motion is slow, and most of the noise with it.
#[test]
fn slow_noise_with_a_memory_is_no_filter_of_the_sensor() {
    for (seed, slow) in [(49, 6.0), (51, 5.0), (53, 4.0)] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(slow),
            ..Scene::new(seed)
        };
        for (kind, value, named) in [
            (K::TimeOffset, 0.11, "time_offset"),
            (K::LowPass, 1.3, "low_pass"),
        ] {
            let record = scene.clone().with(kind, &[value]).record();
            let record = with_memory(record, [2.5e-4, 1.2e-3], 0.012);
            assert_eq!(names(&answer(&record).diagnosis), [named], "{seed}");
        }
    }
}

/// Nor is it a smoothing of slow frames, whose filters would keep it out.
#[test]
fn noise_with_a_memory_is_no_smoothing_of_slow_frames() {
    for seed in [54, 55, 56] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(3.0),
            ..Scene::new(seed)
        };
        let turned = [0.045, -0.016, -0.056];
        let mut record = scene.with(K::AccelMisalignment, &turned).record();
        record.reference = every_fourth(&record.reference);
        let record = with_memory(record, [3e-4, 1.5e-3], 0.025);
        assert_eq!(
            names(&answer(&record).diagnosis),
            ["accel_misalignment"],
            "{seed}"
        );
    }
}

/// Lines that no vibration describes, below what the reference's noise is as a rate.
#[test]
fn motion_that_drowns_in_noise_is_nothing_unknown() {
    for seed in [57, 58] {
        let scene = Scene {
            motion: Motion::random(seed).trembling(0.01, 12.5..14.5, seed),
            ..Scene::new(seed)
        };
        let diagnosis = answer(&scene.record()).diagnosis;
        assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.verdict);
    }
}

/// Most of the motion is above the cutoff and lost in noise: the simulation comes hardly closer.
#[test]
fn a_smoothing_that_took_most_of_the_motion_is_told_by_its_cutoff() {
    for (seed, cutoff_hz) in [(43, 3.8), (44, 3.0)] {
        let motion = Motion::random(seed).humming(8.0, 8.0..20.0, seed);
        let scene = Scene {
            motion: motion.trembling(0.96, 8.0..20.0, seed + 5),
            ..Scene::new(seed)
        };
        let record = scene.with(K::ReferenceSmoothing, &[cutoff_hz, 0.0]);
        let diagnosis = answer(&record.record()).diagnosis;
        assert_eq!(names(&diagnosis), ["reference_smoothing"], "{seed}");
    }
}

/// Hardly any motion reaches the cutoff: undoing it gains too little for what is left to tell, but the readings' turning does.
#[test]
fn a_smoothing_that_took_little_of_a_slow_motion_shows_in_the_readings() {
    for seed in [83, 84, 85, 86] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(2.5),
            ..Scene::new(seed)
        };
        let record = scene.with(K::ReferenceSmoothing, &[4.0, 0.0]).record();
        let diagnosis = answer(&record).diagnosis;
        assert_eq!(names(&diagnosis), ["reference_smoothing"], "{seed}");
    }
}

#[test]
fn a_filter_is_told_beside_a_smoothing_of_the_reference() {
    for seed in [60, 61, 63] {
        let scene = Scene::new(seed)
            .with(K::ReferenceSmoothing, &[3.2, 0.0])
            .with(K::LowPass, &[6.4])
            .with(K::AccelBias, &[-0.21, 0.41, 0.31]);
        let record = Scene {
            seconds: 20.0,
            ..scene
        };
        assert_eq!(
            names(&answer(&record.record()).diagnosis),
            ["accel_bias", "low_pass", "reference_smoothing"]
        );
    }
}

/// Four poses in a row are missing nearly every second: a third of a second on either side of each would leave nothing.
#[test]
fn short_gaps_all_over_leave_enough() {
    let scene = Scene {
        seconds: 20.0,
        ..Scene::new(53)
    };
    let mut record = scene.with(K::GyroScale, &[1.05, 0.96, 1.03]).record();
    let series = &mut record.reference;
    let is_seen = |k: &usize| k % 110 >= 4;
    let kept: Vec<usize> = (0..series.stamps.len()).filter(is_seen).collect();
    series.stamps = kept.iter().map(|&k| series.stamps[k]).collect();
    series.positions = kept.iter().map(|&k| series.positions[k]).collect();
    series.rotations = kept.iter().map(|&k| series.rotations[k]).collect();
    assert_eq!(names(&answer(&record).diagnosis), ["gyro_scale"]);
}

/// Beside a scale the first cutoffs are tried without it, and the best of them makes up for some of it: left there, the
/// filter that it belongs to loses against others.
#[test]
fn the_shape_of_a_smoothing_is_told_beside_a_scale() {
    let scene = Scene {
        motion: Motion::random(70).slowed(1.7),
        ..Scene::new(70)
    };
    let scene = scene
        .with(K::ReferenceSmoothing, &[2.0, 1.0])
        .with(K::AccelScale, &[1.03, 1.026, 1.033]);
    let diagnosis = answer(&scene.record()).diagnosis;
    assert_eq!(names(&diagnosis), ["accel_scale", "reference_smoothing"]);
    let (before, after) = (&diagnosis.gap.before, &diagnosis.gap.after);
    assert!(after.accel_rmse < 0.15 * before.accel_rmse, "{after:?}");
    assert!(after.gyro_rmse < 0.15 * before.gyro_rmse, "{after:?}");
}

/// A scale of 1.5 % without which several times as much is left is none of the smoothing's shape.
#[test]
fn a_small_scale_is_told_beside_a_smoothing() {
    let scene = Scene::new(75)
        .with(K::ReferenceSmoothing, &[5.0, 0.0])
        .with(K::GyroScale, &[1.015, 0.985, 1.015]);
    let diagnosis = answer(&scene.record()).diagnosis;
    assert_eq!(names(&diagnosis), ["gyro_scale", "reference_smoothing"]);
}

/// What a smoothed reference lacks of the motion would be in the readings, and their spectrum not level.
#[test]
fn noise_of_a_sensor_is_told_beside_a_smoothing() {
    for seed in [71, 73] {
        let scene = Scene {
            motion: Motion::random(seed).slowed(1.7),
            ..Scene::new(seed)
        };
        let declared = SIGMA[1];
        let density = 3.0 * declared / scene.imu_hz.sqrt();
        let scene = scene
            .with(K::ReferenceSmoothing, &[2.5, 0.0])
            .with(K::GyroNoise, &[density]);
        let diagnosis = answer(&scene.record()).diagnosis;
        assert_eq!(
            names(&diagnosis),
            ["gyro_noise", "reference_smoothing"],
            "{seed}"
        );
    }
}

/// Errors of the rotation tilt gravity, and a lever arm of g / (2 pi f)^2 along it would take those around f away.
#[test]
fn what_a_rotation_is_off_makes_no_lever_arm() {
    for seed in [57, 58] {
        let scene = Scene {
            motion: Motion::sway(1.0),
            ..Scene::new(seed)
        };
        let record = with_memory(scene.record(), [3e-4, 4e-3], 0.0166);
        let named = names(&answer(&record).diagnosis).join(" ");
        assert!(!named.contains("lever_arm"), "{seed}: {named}");
    }
}
