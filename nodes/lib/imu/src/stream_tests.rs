#![allow(clippy::unwrap_used)]
use cromosim_spatial::uniform_stamps;

use super::*;
use crate::test_motions::{START, errors, frames, jittered, wrist};
use crate::{SensorTrajectory, simulate_kinematics};

/// All samples of a stream, each with the stamp of the frame that released it.
fn run(
    scheme: Scheme,
    options: StreamOptions,
    frames: &[SensorFrame],
) -> Vec<(KinematicSample, Stamp)> {
    let mut stream = StreamingImu::new(scheme, options).unwrap();
    let mut all = Vec::new();
    for frame in frames {
        all.extend(
            stream
                .push_kinematics(*frame)
                .unwrap()
                .into_iter()
                .map(|sample| (sample, frame.stamp)),
        );
    }
    let end = frames[frames.len() - 1].stamp;
    all.extend(
        stream
            .finish_kinematics()
            .unwrap()
            .into_iter()
            .map(|sample| (sample, end)),
    );
    all
}

#[test]
fn samples_are_those_of_the_grid_and_come_after_the_stated_delay() {
    let frames = frames(wrist, 120.0, 3.0);
    for scheme in Scheme::ALL {
        for options in [
            StreamOptions::resampled(120.0, 100.0),
            StreamOptions::resampled(120.0, 120.0),
        ] {
            let released = run(scheme, options, &frames);
            let expected =
                uniform_stamps(START, frames[360].stamp, options.output_rate_hz).unwrap();
            assert_eq!(
                released
                    .iter()
                    .map(|(sample, _)| sample.stamp)
                    .collect::<Vec<_>>(),
                expected,
                "{scheme}"
            );
            let delay = StreamingImu::new(scheme, options).unwrap().delay_seconds();
            let inside = released
                .iter()
                .filter(|(sample, _)| frames[360].stamp - sample.stamp > delay + 0.01);
            for (sample, by) in inside {
                let waited = *by - sample.stamp;
                // On a frame's stamp exactly the delay; between frames up to the next frame.
                assert!(
                    waited > delay - 0.1 / 120.0 - 1e-9 && waited < delay + 1.0 / 120.0,
                    "{scheme}: {waited} against {delay}"
                );
            }
        }
    }
}

#[test]
fn stencils_read_live_what_they_read_offline() {
    let frames = frames(wrist, 100.0, 3.0);
    let trajectory = SensorTrajectory::new(frames.clone()).unwrap();
    for scheme in [
        Scheme::Richardson,
        Scheme::NormalTracking,
        Scheme::Triangle,
        Scheme::SecondDifference,
    ] {
        for options in [
            StreamOptions::resampled(100.0, 100.0),
            StreamOptions::resampled(100.0, 77.0),
        ] {
            let live = run(scheme, options, &frames);
            let stamps: Vec<Stamp> = live.iter().map(|(sample, _)| sample.stamp).collect();
            let offline = simulate_kinematics(&trajectory, scheme, &stamps).unwrap();
            for ((live, _), offline) in live.iter().zip(&offline).skip(4) {
                assert!(
                    (live.acceleration_in_world - offline.acceleration_in_world).norm() < 1e-9,
                    "{scheme}"
                );
                assert!(
                    (live.angular_velocity_in_world - offline.angular_velocity_in_world).norm()
                        < 1e-9,
                    "{scheme}"
                );
                assert!(
                    live.world_from_sensor
                        .rotation
                        .angle_to(&offline.world_from_sensor.rotation)
                        < 1e-7,
                    "{scheme}"
                );
            }
        }
    }
}

#[test]
fn the_live_spline_comes_close_to_the_offline_one() {
    let exact = frames(wrist, 100.0, 20.0);
    // Jitter is seen from one side mainly: ten frames of future are less than the offline spline
    // averages over.
    for (frames, name, force_limit, turn_limit) in [
        (exact.clone(), "exact", 1.3, 1.3),
        (jittered(&exact), "jittered", 5.0, 1.5),
    ] {
        let live: Vec<_> = run(
            Scheme::Spline,
            StreamOptions::resampled(100.0, 100.0),
            &frames,
        )
        .into_iter()
        .map(|(sample, _)| sample)
        .collect();
        let trajectory = SensorTrajectory::new(frames.clone()).unwrap();
        // After the first searches for weights, and before the end.
        let settled = &live[400..1950];
        let stamps: Vec<Stamp> = settled.iter().map(|sample| sample.stamp).collect();
        let offline = errors(
            &simulate_kinematics(&trajectory, Scheme::Spline, &stamps).unwrap(),
            wrist,
        );
        let richardson = errors(
            &simulate_kinematics(&trajectory, Scheme::Richardson, &stamps).unwrap(),
            wrist,
        );
        let live = errors(settled, wrist);
        println!("{name}: live {live:.6?}, offline {offline:.6?}, richardson {richardson:.4?}");
        assert!(name == "exact" || (live.0 * 50.0 < richardson.0 && live.1 * 8.0 < richardson.1));
        assert!(
            live.0 < force_limit * offline.0 && live.1 < turn_limit * offline.1,
            "{name}"
        );
    }
}

#[test]
fn the_live_adaptive_spline_is_the_offline_one_within_what_it_states() {
    let frames = jittered(&frames(wrist, 100.0, 20.0));
    let options = StreamOptions::resampled(100.0, 100.0);
    let live: Vec<_> = run(Scheme::AdaptiveSpline, options, &frames)
        .into_iter()
        .map(|(sample, _)| sample)
        .collect();
    let trajectory = SensorTrajectory::new(frames).unwrap();
    let stamps: Vec<Stamp> = live.iter().map(|sample| sample.stamp).collect();
    let offline = simulate_kinematics(&trajectory, Scheme::AdaptiveSpline, &stamps).unwrap();
    let mean = |of: &dyn Fn(&KinematicSample, &KinematicSample) -> f64| {
        let pairs = live.iter().zip(&offline);
        pairs.map(|(live, offline)| of(live, offline)).sum::<f64>() / live.len() as f64
    };
    let acceleration = mean(&|live, offline| {
        let step = live.acceleration_in_world - offline.acceleration_in_world;
        step.norm_squared() / 3.0 / live.variance.acceleration
    });
    let turning = mean(&|live, offline| {
        let step = live.angular_velocity_in_world - offline.angular_velocity_in_world;
        step.norm_squared() / 3.0 / live.variance.angular_velocity
    });
    println!("squared difference over the stated variance: {acceleration:.2}, {turning:.2}");
    assert!(
        acceleration < 1.0 && turning < 1.0,
        "{acceleration} {turning}"
    );
}

#[test]
fn the_same_frames_give_the_same_samples() {
    let frames = jittered(&frames(wrist, 100.0, 4.0));
    let options = StreamOptions::resampled(100.0, 60.0);
    assert_eq!(
        run(Scheme::Spline, options, &frames),
        run(Scheme::Spline, options, &frames)
    );
}

#[test]
fn a_pause_begins_a_new_series_on_the_same_grid() {
    let all = frames(wrist, 100.0, 6.0);
    let with_pause: Vec<SensorFrame> = all
        .iter()
        .copied()
        .filter(|frame| !(2.0..3.503).contains(&(frame.stamp - START)))
        .collect();
    for scheme in Scheme::ALL {
        let samples = run(scheme, StreamOptions::resampled(100.0, 40.0), &with_pause);
        let seconds: Vec<f64> = samples
            .iter()
            .map(|(sample, _)| sample.stamp - START)
            .collect();
        assert!(seconds.iter().all(|t| *t < 2.0 || *t >= 3.5), "{scheme}");
        assert!(
            seconds
                .iter()
                .all(|t| ((t * 40.0).round() - t * 40.0).abs() < 1e-6),
            "{scheme}"
        );
        assert_eq!(seconds.len(), 80 + 100, "{scheme}");
    }
}

#[test]
fn frames_out_of_order_or_broken_are_refused_and_left_out() {
    let frames = frames(wrist, 100.0, 1.0);
    let mut stream =
        StreamingImu::new(Scheme::Spline, StreamOptions::resampled(100.0, 100.0)).unwrap();
    stream.push(frames[5]).unwrap();
    assert!(matches!(
        stream.push(frames[5]),
        Err(ImuError::FrameNotIncreasing { .. })
    ));
    assert!(
        stream
            .push(frames[4])
            .unwrap_err()
            .to_string()
            .contains("does not come after")
    );
    let mut broken = frames[6];
    broken.world_from_sensor.translation.vector.x = f64::INFINITY;
    assert!(matches!(
        stream.push(broken),
        Err(ImuError::FrameNotFinite { .. })
    ));
    stream.push(frames[6]).unwrap();
    stream.reset();
    stream.push(frames[0]).unwrap();
    assert!(StreamingImu::new(Scheme::Spline, StreamOptions::resampled(100.0, -1.0)).is_err());
}
