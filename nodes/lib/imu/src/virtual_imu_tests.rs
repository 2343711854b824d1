#![allow(clippy::unwrap_used)]

use cromosim_spatial::KinematicTrack;

use super::*;
use crate::{Effect, EffectSet};

/// Spins up by 2 rad/s2 about one axis, at 100 Hz.
fn spinning_up() -> KinematicTrack {
    let count = 200;
    KinematicTrack {
        start: Stamp::from_nanos(1_700_000_000_000_000_000),
        rate_hz: 100.0,
        world_from_segment: vec![UnitQuaternion::identity(); count],
        acceleration_in_segment: vec![Vector3::zeros(); count],
        angular_velocity_in_segment: (0..count)
            .map(|k| Vector3::new(0.02 * k as f64, 0.0, 0.0))
            .collect(),
        angular_acceleration_in_segment: vec![Vector3::new(2.0, 0.0, 0.0); count],
    }
}

fn stated(effects: EffectSet, before_s: f64) -> Imu {
    let track = spinning_up();
    let stamps: Vec<Stamp> = (50..150)
        .map(|k| track.start.plus_seconds(k as f64 / 100.0))
        .collect();
    let motion = RecordedMotion {
        track: &track,
        stamps: &stamps,
        variances: &[],
        stamps_are_recorded: true,
    };
    let effects = PlacementEffects {
        epoch: stamps[50].plus_seconds(-before_s),
        declared_noise: DeclaredNoise {
            accel_density: 1e-3,
            gyro_density: 1e-4,
        },
        effects,
        unexplained: UnexplainedErrors::default(),
        other_sessions: Vec::new(),
    };
    let options = ImuOptions {
        rate_hz: 100.0,
        seed: 1,
        name: "wrist".to_owned(),
        noise: false,
        frame_id: "wrist_imu".to_owned(),
        mapping: None,
    };
    measure_recording(motion, &effects, options).unwrap()[50].clone()
}

#[test]
fn a_drifting_clock_is_less_sure_the_longer_it_runs() {
    // 17 ppm of 1000 s are 17 ms, in which 2 rad/s2 become 35 mrad/s about one of three axes.
    let drifts = || EffectSet::new().with(Effect::new(EffectKind::ClockDrift, vec![0.0]).unwrap());
    let variance = |imu: &Imu| imu.angular_velocity_covariance[0];
    let own = variance(&stated(EffectSet::new(), 1000.0));
    assert!((own - 1e-6).abs() < 1e-12, "{own}");
    assert_eq!(variance(&stated(drifts(), 0.0)), own);
    let later = variance(&stated(drifts(), 1000.0)) - own;
    let expected = (30e-6 / 3.0_f64.sqrt() * 1000.0 * 2.0).powi(2) / 3.0;
    assert!(
        (later / expected - 1.0).abs() < 1e-6,
        "{later} rather than {expected}"
    );
}
