//! Diagnosis of 60 s of one placement at 100 Hz with a reference at 120 Hz, on one core: `cargo
//! bench -p cromosim_gap`. Goal: 5 s.
//!
//! Measured on one core of a small shared machine: 0.42 s without effect, 0.48 s lever arm, 0.73 s
//! two effects, 1.38 s smoothing, which is looked for in more shapes since the counts below (3.6 to 12
//! times within the goal). What such an analysis cannot do without are Fourier transforms (18 us each of
//! 6000 values) and forward simulations (0.33 ms); counted when the four took 0.44 to 0.97 s:
//!
//! | case | transforms (million values) | Welch windows beside them | forward simulations | transforms and simulations take |
//! |---|---|---|---|---|
//! | no effect | 5000 (25) | 4300 | 138 | 0.11 s |
//! | lever_arm | 6000 (31) | 5200 | 254 | 0.16 s |
//! | time_offset + accel_bias | 7300 (39) | 5900 | 387 | 0.23 s |
//! | reference_smoothing | 20200 (58) | 8500 | 283 | 0.25 s |
//!
//! So 3 to 4 times off that limit; the reference's estimate takes 0.06 s of the rest, a track of it
//! 13 ms for each smoothing that is tried.
#![allow(missing_docs)]

#[path = "../tests/support/mod.rs"]
mod support;

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_gap::{DiagnoseOptions, diagnose};
use cromosim_imu::{EffectKind as K, SensorModel};
use cromosim_spatial::{Complex64, FourierPair, PoseEstimate};
use support::Scene;

fn scenes() -> [(&'static str, Scene); 4] {
    [
        ("no effect", Scene::new(1)),
        (
            "lever_arm",
            Scene::new(1).with(K::LeverArm, &[0.05, 0.02, -0.06]),
        ),
        (
            "time_offset + accel_bias",
            Scene::new(1)
                .with(K::TimeOffset, &[0.021])
                .with(K::AccelBias, &[0.2, -0.15, 0.1]),
        ),
        (
            "reference_smoothing",
            Scene::new(1).with(K::ReferenceSmoothing, &[6.0, 0.0]),
        ),
    ]
}

fn diagnoses(criterion: &mut Criterion) {
    let one_core = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut group = criterion.benchmark_group("diagnose");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5));
    for (name, scene) in scenes() {
        let record = scene.record();
        let diagnose = || diagnose(&record, &DiagnoseOptions::default()).expect("a diagnosis");
        group.bench_function(name, |bencher| bencher.iter(|| one_core.install(diagnose)));
    }
}

/// What a diagnosis is made of.
fn parts(criterion: &mut Criterion) {
    let scene = Scene::new(1).with(K::LeverArm, &[0.05, 0.02, -0.06]);
    let record = scene.record();
    let reference = &record.reference;
    let fit = || {
        PoseEstimate::fit(
            &reference.stamps,
            &reference.positions,
            &reference.rotations,
        )
        .expect("poses")
    };
    let (estimate, model) = (fit(), SensorModel::new(&scene.effects, scene.epoch));
    let track = estimate.track(200.0);
    let transform = FourierPair::new(FourierPair::good_length(record.imu.stamps.len()));
    let mut series = vec![Complex64::default(); transform.length()];
    let mut group = criterion.benchmark_group("parts");
    group.bench_function("estimate of the reference", |bencher| bencher.iter(fit));
    group.bench_function("track", |bencher| bencher.iter(|| estimate.track(200.0)));
    group.bench_function("forward simulation", |bencher| {
        bencher.iter(|| model.run(&track, &record.imu.stamps))
    });
    group.bench_function("Fourier transform of a channel", |bencher| {
        bencher.iter(|| transform.forward(&mut series))
    });
}

criterion_group!(benches, diagnoses, parts);
criterion_main!(benches);
