//! All stages of the sensor model over 60 s at a grid of 200 Hz and 6000 readings: `cargo bench -p
//! cromosim_imu --bench effects`. Goal: 3 ms.
#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_imu::{Effect, EffectKind, EffectSet, SensorModel, StagedReadings};
use cromosim_spatial::{KinematicTrack, Stamp, so3};
use nalgebra::Vector3;

fn track() -> KinematicTrack {
    let mut track = KinematicTrack {
        rate_hz: 200.0,
        ..KinematicTrack::default()
    };
    for k in 0..12_001 {
        let t = f64::from(k) / 200.0;
        track
            .world_from_segment
            .push(so3::exp(&Vector3::new((2.0 * t).sin(), 0.3, 0.5 * t.cos())));
        track
            .acceleration_in_segment
            .push(Vector3::new((9.0 * t).sin(), t.cos(), (3.0 * t).sin()) * 5.0);
        track
            .angular_velocity_in_segment
            .push(Vector3::new((5.0 * t).cos(), t.sin(), 0.1));
        track.angular_acceleration_in_segment.push(Vector3::new(
            -5.0 * (5.0 * t).sin(),
            t.cos(),
            0.0,
        ));
    }
    track
}

fn effects(criterion: &mut Criterion) {
    let track = track();
    let stamps: Vec<Stamp> = (0..6000)
        .map(|k| Stamp::from_seconds(0.003 + 0.01 * f64::from(k)))
        .collect();
    let one = |kind, values: &[f64]| Effect::new(kind, values.to_vec()).expect("valid values");
    let all = EffectSet::try_from(vec![
        one(EffectKind::LeverArm, &[0.05, 0.0, -0.06]),
        one(EffectKind::MountRotation, &[0.1, 0.2, 0.3]),
        one(EffectKind::MountSlip, &[31.0, 0.1, 0.0, 0.0]),
        one(EffectKind::SoftTissue, &[9.0, 0.2]),
        one(EffectKind::TimeOffset, &[0.021]),
        one(EffectKind::ClockDrift, &[80.0]),
        one(EffectKind::AccelBias, &[0.1, 0.2, 0.3]),
        one(EffectKind::AccelScale, &[1.01, 0.99, 1.0]),
        one(EffectKind::GyroBiasDrift, &[1e-5, 0.0, 0.0]),
        one(EffectKind::AccelSaturation, &[39.0]),
        one(EffectKind::AccelQuantization, &[0.0048]),
        one(EffectKind::LowPass, &[20.0]),
        one(EffectKind::GyroGSensitivity, &[1e-3; 9]),
        one(
            EffectKind::Vibration,
            &[
                31.0, 0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 0.01, 0.0, 0.02, 0.3, 0.0, 1.0,
            ],
        ),
    ])
    .expect("one of each");
    let nominal = SensorModel::new(&EffectSet::new(), Stamp::default());
    let model = SensorModel::new(&all, Stamp::default());
    criterion.bench_function("nominal", |bencher| {
        bencher.iter(|| nominal.run(&track, &stamps))
    });
    criterion.bench_function("fourteen effects", |bencher| {
        bencher.iter(|| model.run(&track, &stamps))
    });
    criterion.bench_function("fourteen effects: every stage kept", |bencher| {
        bencher.iter(|| StagedReadings::new(&model, &track, &stamps))
    });
    let staged = StagedReadings::new(&model, &track, &stamps);
    criterion.bench_function("fourteen effects: again from the timing on", |bencher| {
        bencher.iter(|| staged.with_other(EffectKind::TimeOffset, &model, &track, &stamps))
    });
}

criterion_group!(benches, effects);
criterion_main!(benches);
