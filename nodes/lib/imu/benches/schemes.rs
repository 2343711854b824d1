//! 60 s of five placements at 100 Hz: each scheme offline, the way from poses to frames, and the
//! spline live at 17 placements.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_body::{BodyModel, BodyPose, JOINT_COUNT, ShapedBody};
use cromosim_imu::{
    MountedSensors, PlacementSet, Scheme, SensorTrajectory, StreamOptions, StreamingImu,
    simulate_kinematics_on,
};
use cromosim_spatial::{PoseTimes, Stamp, so3, uniform_stamps};
use nalgebra::Vector3;

const RATE_HZ: f64 = 100.0;
const SECONDS: f64 = 60.0;

/// Every joint swings at its own rate.
fn motion(stamps: &[Stamp]) -> Vec<BodyPose> {
    let pose = |stamp: &Stamp| {
        let t = stamp.as_seconds();
        let mut pose = BodyPose::rest(Vector3::new(t, 0.1 * (2.0 * t).sin(), 0.95));
        for joint in 0..JOINT_COUNT {
            let phase = joint as f64;
            pose.local_rotations[joint] = so3::exp(
                &(Vector3::new(phase.sin(), phase.cos(), 0.5) * 0.4 * (6.0 * t + phase).sin()),
            );
        }
        pose
    };
    stamps.iter().map(pose).collect()
}

fn trajectories(
    placements: &PlacementSet,
) -> (
    Vec<Stamp>,
    Vec<BodyPose>,
    MountedSensors,
    Vec<SensorTrajectory>,
) {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).expect("the embedded body is sound");
    let stamps = uniform_stamps(
        Stamp::from_nanos(0),
        Stamp::from_seconds(SECONDS - 0.5 / RATE_HZ),
        RATE_HZ,
    )
    .expect("a positive rate");
    let poses = motion(&stamps);
    let sites = MountedSensors::new(&body, placements.placements())
        .expect("shipped placements fit the embedded body");
    let trajectories = sites
        .trajectories(&stamps, &poses)
        .expect("stamps increase");
    (stamps, poses, sites, trajectories)
}

fn offline(criterion: &mut Criterion) {
    let (stamps, poses, sites, trajectories) = trajectories(&PlacementSet::demo());
    criterion.bench_function("frames of 5 placements, 60 s at 100 Hz", |bencher| {
        bencher.iter(|| {
            sites
                .trajectories(black_box(&stamps), black_box(&poses))
                .map(|all| all.len())
        });
    });
    for scheme in Scheme::ALL {
        criterion.bench_function(
            &format!("{scheme}, 5 placements, 60 s at 100 Hz"),
            |bencher| {
                bencher.iter(|| {
                    let times = PoseTimes::new(&stamps).expect("stamps increase");
                    let samples = |trajectory| {
                        simulate_kinematics_on(&times, trajectory, scheme, &stamps)
                            .expect("exact frames")
                    };
                    trajectories
                        .iter()
                        .map(|trajectory| samples(black_box(trajectory)).len())
                        .sum::<usize>()
                });
            },
        );
    }
}

fn live(criterion: &mut Criterion) {
    let (_, _, _, trajectories) = trajectories(&PlacementSet::full17());
    for scheme in [Scheme::Spline, Scheme::AdaptiveSpline] {
        live_scheme(criterion, scheme, &trajectories);
    }
}

fn live_scheme(criterion: &mut Criterion, scheme: Scheme, trajectories: &[SensorTrajectory]) {
    // One second: a time of 100 ms is a tenth of a core.
    let name = format!("live {scheme}, 17 placements, 1 s at 100 Hz");
    criterion.bench_function(&name, |bencher| {
        let stream = StreamingImu::new(scheme, StreamOptions::resampled(RATE_HZ, RATE_HZ))
            .expect("positive rates");
        let mut warm: Vec<_> = trajectories
            .iter()
            .map(|trajectory| (stream.clone(), trajectory))
            .collect();
        for (stream, trajectory) in &mut warm {
            for frame in &trajectory.frames()[..1000] {
                stream.push(*frame).expect("frames increase");
            }
        }
        bencher.iter_batched(
            || warm.clone(),
            |mut streams| {
                for (stream, trajectory) in &mut streams {
                    for frame in &trajectory.frames()[1000..1100] {
                        black_box(stream.push(*frame).expect("frames increase"));
                    }
                }
            },
            criterion::BatchSize::LargeInput,
        );
    });
}

criterion_group!(benches, offline, live);
criterion_main!(benches);
