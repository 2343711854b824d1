#![allow(clippy::unwrap_used)]
use cromosim_spatial::{so3, uniform_stamps};

use super::*;
use crate::STANDARD_GRAVITY;
use crate::test_motions::{START, errors, imu_errors, jittered, spin, trajectory, wrist};

/// Stamps of a trajectory's frames.
fn stamps(trajectory: &SensorTrajectory) -> Vec<Stamp> {
    trajectory
        .frames()
        .iter()
        .map(|frame| frame.stamp)
        .collect()
}

/// Errors on the hard wrist motion, 10 s without noise at `rate_hz`, at the frames' stamps, ends
/// included.
fn wrist_errors(scheme: Scheme, rate_hz: f64) -> (f64, f64) {
    let trajectory = trajectory(wrist, rate_hz, 10.0);
    imu_errors(
        &simulate(&trajectory, scheme, &stamps(&trajectory)).unwrap(),
        wrist,
    )
}

#[test]
fn exact_frames_give_what_was_asked_for() {
    let (force, turn) = wrist_errors(Scheme::Richardson, 100.0);
    println!("richardson: {force:.6} m/s2, {turn:.7} rad/s");
    assert!(force < 0.002 && turn < 0.0005);
    // The adaptive spline expects noise where poses show none, as those do that were low-passed.
    for (scheme, force_limit, turn_limit) in [
        (Scheme::Spline, 0.0005, 0.0001),
        (Scheme::AdaptiveSpline, 0.04, 0.002),
    ] {
        let (force, turn) = wrist_errors(scheme, 100.0);
        println!("{scheme}: {force:.6} m/s2, {turn:.7} rad/s");
        assert!(force < force_limit && turn < turn_limit, "{scheme}");
    }
    for scheme in [
        Scheme::Triangle,
        Scheme::SecondDifference,
        Scheme::NormalTracking,
    ] {
        let (force, turn) = wrist_errors(scheme, 100.0);
        println!("{scheme}: {force:.4} m/s2, {turn:.5} rad/s");
    }
}

#[test]
fn schemes_converge_at_their_orders() {
    // Inside, away from the one-sided stencils at the ends.
    let error = |scheme, rate_hz| {
        let trajectory = trajectory(wrist, rate_hz, 4.0);
        let output =
            uniform_stamps(START.plus_seconds(1.0), START.plus_seconds(3.0), rate_hz).unwrap();
        errors(
            &simulate_kinematics(&trajectory, scheme, &output).unwrap(),
            wrist,
        )
    };
    let orders = [
        (Scheme::Richardson, 4.0, 4.0),
        (Scheme::Triangle, 2.0, 2.0),
        (Scheme::Spline, 4.0, 5.0),
        (Scheme::SecondDifference, 2.0, 2.0),
    ];
    for (scheme, force_order, turn_order) in orders {
        let (coarse, fine) = (error(scheme, 50.0), error(scheme, 100.0));
        let (force, turn) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
        println!("{scheme}: orders {force:.2}, {turn:.2}");
        assert!(
            (force - force_order).abs() < 0.25 || force > force_order,
            "{scheme}: {force}"
        );
        assert!(
            (turn - turn_order).abs() < 0.25 || turn > turn_order,
            "{scheme}: {turn}"
        );
    }
}

#[test]
fn normal_tracking_converges_but_is_blind_about_the_normal() {
    let error = |rate_hz: f64| {
        let trajectory = trajectory(wrist, rate_hz, 4.0);
        let output =
            uniform_stamps(START.plus_seconds(1.0), START.plus_seconds(3.0), rate_hz).unwrap();
        let samples = simulate_kinematics(&trajectory, Scheme::NormalTracking, &output).unwrap();
        let mut square = 0.0;
        for sample in &samples {
            let known = wrist(sample.stamp - START);
            let normal = known.world_from_sensor * nalgebra::Vector3::z();
            assert!(
                sample.angular_velocity_in_world.dot(&normal).abs() < 1e-9,
                "nothing about the normal"
            );
            let across = known.angular_velocity_in_world
                - normal * normal.dot(&known.angular_velocity_in_world);
            square += (sample.angular_velocity_in_world - across).norm_squared();
        }
        (square / samples.len() as f64).sqrt()
    };
    let order = (error(50.0) / error(100.0)).log2();
    assert!((order - 2.0).abs() < 0.25, "{order}");
}

#[test]
fn the_splines_withstand_jitter_ten_times_better_than_richardson() {
    let frames = jittered(trajectory(wrist, 100.0, 60.0).frames());
    let trajectory = SensorTrajectory::new(frames).unwrap();
    let of = |scheme| {
        errors(
            &simulate_kinematics(&trajectory, scheme, &stamps(&trajectory)).unwrap(),
            wrist,
        )
    };
    let richardson = of(Scheme::Richardson);
    for scheme in [Scheme::Spline, Scheme::AdaptiveSpline] {
        let spline = of(scheme);
        println!("1 mm, 0.5 degrees: richardson {richardson:.4?}, {scheme} {spline:.4?}");
        assert!(
            spline.0 * 10.0 < richardson.0 && spline.1 * 10.0 < richardson.1,
            "{scheme}"
        );
    }
}

#[test]
fn at_rest_every_scheme_reads_gravity_upwards() {
    let tilted = so3::exp(&Vector3::new(0.4, -0.2, 0.9));
    let still = Isometry3::from_parts(Vector3::new(12.0, -7.0, 1.1).into(), tilted);
    let frames = (0..50)
        .map(|k| SensorFrame::new(START.plus_seconds(f64::from(k) * 0.01), still))
        .collect();
    let trajectory = SensorTrajectory::new(frames).unwrap();
    for scheme in Scheme::ALL {
        for sample in simulate(&trajectory, scheme, &stamps(&trajectory)).unwrap() {
            let up_in_sensor = tilted.inverse() * Vector3::z();
            assert!(
                (sample.specific_force - up_in_sensor * STANDARD_GRAVITY).norm() < 1e-8,
                "{scheme}"
            );
            assert!(sample.angular_velocity.norm() < 1e-9, "{scheme}");
        }
    }
}

#[test]
fn a_spin_with_a_lever_arm_reads_its_centripetal_force() {
    let trajectory = trajectory(spin, 200.0, 2.0);
    for (scheme, force_limit, turn_limit) in [
        (Scheme::Richardson, 1e-4, 1e-6),
        (Scheme::Spline, 1e-4, 1e-6),
        (Scheme::AdaptiveSpline, 1e-2, 1e-4),
        (Scheme::Triangle, 2e-2, 3e-3),
    ] {
        let output = uniform_stamps(START, START.plus_seconds(2.0), 147.0).unwrap();
        let (force, turn) = imu_errors(&simulate(&trajectory, scheme, &output).unwrap(), spin);
        assert!(
            force < force_limit && turn < turn_limit,
            "{scheme}: {force} {turn}"
        );
    }
}

#[test]
fn a_circle_reads_constant_force_towards_its_centre() {
    // x towards the direction of travel, z up: w^2 r to the left.
    let (rate, radius) = (2.0_f64, 1.5);
    let frame = |k: i32| {
        let angle = rate * f64::from(k) * 0.01;
        let position = Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
        let rotation = so3::exp(&(Vector3::z() * (angle + std::f64::consts::FRAC_PI_2)));
        SensorFrame::new(
            START.plus_seconds(f64::from(k) * 0.01),
            Isometry3::from_parts(position.into(), rotation),
        )
    };
    let trajectory = SensorTrajectory::new((0..400).map(frame).collect()).unwrap();
    for sample in simulate(&trajectory, Scheme::Spline, &stamps(&trajectory)).unwrap() {
        assert!(
            (sample.specific_force - Vector3::new(0.0, rate * rate * radius, STANDARD_GRAVITY))
                .norm()
                < 1e-4
        );
        assert!((sample.angular_velocity - Vector3::z() * rate).norm() < 1e-6);
    }
}

#[test]
fn a_pendulum_feels_no_force_along_its_path() {
    // theta'' = -(g / l) sin(theta): gravity does all the work, so a sensor at the bob reads force
    // along the string alone.
    let (length, step) = (0.9, 1e-4);
    let (mut theta, mut speed) = (0.8_f64, 0.0_f64);
    let mut frames = Vec::new();
    for k in 0..=30_000 {
        if k % 100 == 0 {
            let rotation = so3::exp(&(Vector3::y() * -theta));
            let bob = rotation * Vector3::new(0.0, 0.0, -length);
            frames.push(SensorFrame::new(
                START.plus_seconds(f64::from(k) * step),
                Isometry3::from_parts(bob.into(), rotation),
            ));
        }
        // Leapfrog: second order, its error at this step is far below what is asserted.
        let pull = |theta: f64| -STANDARD_GRAVITY / length * theta.sin();
        let half = speed + 0.5 * step * pull(theta);
        theta += step * half;
        speed = half + 0.5 * step * pull(theta);
    }
    let trajectory = SensorTrajectory::new(frames).unwrap();
    for sample in simulate(&trajectory, Scheme::Spline, &stamps(&trajectory)).unwrap() {
        assert!(
            sample.specific_force.xy().norm() < 1e-3,
            "{}",
            sample.specific_force
        );
        assert!(sample.specific_force.z > 0.0);
    }
}

#[test]
fn outside_the_trajectory_the_ends_are_held() {
    let trajectory = trajectory(wrist, 100.0, 2.0);
    for scheme in Scheme::ALL {
        let output = [
            trajectory.start().plus_seconds(-1.0),
            trajectory.start(),
            trajectory.end(),
            trajectory.end().plus_seconds(0.3),
        ];
        let samples = simulate(&trajectory, scheme, &output).unwrap();
        assert_eq!(
            samples[0].specific_force, samples[1].specific_force,
            "{scheme}"
        );
        assert_eq!(
            samples[3].angular_velocity, samples[2].angular_velocity,
            "{scheme}"
        );
        assert_eq!(samples.iter().map(|s| s.stamp).collect::<Vec<_>>(), output);
    }
}

#[test]
fn stencils_are_interpolated_between_frames_and_kept_at_them() {
    let trajectory = trajectory(wrist, 100.0, 4.0);
    let output = uniform_stamps(START.plus_seconds(0.5), START.plus_seconds(3.5), 173.0).unwrap();
    let (force, turn) = errors(
        &simulate_kinematics(&trajectory, Scheme::Richardson, &output).unwrap(),
        wrist,
    );
    assert!(force < 0.004 && turn < 0.001, "{force} {turn}");
    let at_frames = simulate(&trajectory, Scheme::Richardson, &stamps(&trajectory)).unwrap();
    let again = simulate(
        &trajectory,
        Scheme::Richardson,
        &[trajectory.frames()[77].stamp],
    )
    .unwrap();
    assert_eq!(again[0], at_frames[77]);
}

#[test]
fn uneven_frames_with_a_gap_stay_accurate() {
    let mut frames = Vec::new();
    for k in 0..800 {
        let t = 0.01 * f64::from(k) + 0.002 * (1.9 * f64::from(k)).sin();
        if !(400..406).contains(&k) {
            let sample = wrist(t);
            frames.push(SensorFrame::new(sample.stamp, sample.world_from_sensor));
        }
    }
    let trajectory = SensorTrajectory::new(frames).unwrap();
    let output = uniform_stamps(START.plus_seconds(0.1), START.plus_seconds(7.8), 100.0).unwrap();
    let (force, turn) = errors(
        &simulate_kinematics(&trajectory, Scheme::Spline, &output).unwrap(),
        wrist,
    );
    assert!(force < 0.1 && turn < 0.02, "{force} {turn}");
}
