#![allow(clippy::unwrap_used)]
use super::*;

fn spin(t: f64) -> UnitQuaternion<f64> {
    exp(&Vector3::new(0.3, -0.2, 0.9)) * exp(&Vector3::new(0.4 * t, 1.1 * t * t, (2.0 * t).sin()))
}

#[test]
fn exp_and_log_are_inverse_from_tiny_to_nearly_half_a_turn() {
    for scale in [0.0, 1e-12, 1e-9, 1e-5, 1e-4, 2e-4, 0.1, 1.0, 3.1] {
        let rotvec = Vector3::new(0.36, -0.48, 0.8) * scale;
        assert!(
            (log(&exp(&rotvec)) - rotvec).norm() <= 4e-16 + 2e-15 * scale,
            "{scale}"
        );
        let doubly_covered = UnitQuaternion::new_unchecked(-exp(&rotvec).into_inner());
        assert!(
            (log(&doubly_covered) - rotvec).norm() <= 4e-16 + 2e-15 * scale,
            "{scale}"
        );
    }
}

#[test]
fn exp_and_log_are_those_of_nalgebra_to_the_last_digits() {
    for scale in [1e-15, 1e-9, 1e-6, 1e-5, 1e-4, 2e-4, 0.1, 1.0, 3.0, 3.13] {
        let rotvec = Vector3::new(0.36, -0.48, 0.8) * scale;
        let (own, theirs) = (exp(&rotvec), UnitQuaternion::from_scaled_axis(rotvec));
        assert!((own.coords - theirs.coords).norm() <= 3e-16, "{scale}");
        assert!(
            (log(&own) - own.scaled_axis()).norm() <= 6e-16 * scale,
            "{scale}"
        );
    }
}

#[test]
fn exp_agrees_with_rodrigues() {
    let rotvec = Vector3::new(0.5, -1.0, 0.7);
    let (angle, k): (f64, Matrix3<f64>) = (rotvec.norm(), rotvec.normalize().cross_matrix());
    let rodrigues = Matrix3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos());
    assert!((exp(&rotvec).to_rotation_matrix().matrix() - rodrigues).norm() < 1e-14);
    assert_eq!(vee(&rotvec.cross_matrix()), rotvec);
}

#[test]
fn angular_velocity_and_acceleration_follow_from_quaternion_derivatives_of_any_length() {
    let h = 1e-4;
    let length = |t: f64| 1.0 + 0.3 * t;
    let s = |t: f64| spin(t).into_inner() * length(t);
    let (before, now, after) = (s(0.4 - h), s(0.4), s(0.4 + h));
    let s_dot = (after - before) / (2.0 * h);
    let s_ddot = (after - now * 2.0 + before) / (h * h);
    let omega = |t: f64| log(&(spin(t + h) * spin(t - h).inverse())) / (2.0 * h);
    let alpha = (omega(0.4 + h) - omega(0.4 - h)) / (2.0 * h);
    assert!((angular_velocity_in_world(&now, &s_dot) - omega(0.4)).norm() < 1e-6);
    assert!((spin(0.4) * angular_velocity_in_body(&now, &s_dot) - omega(0.4)).norm() < 1e-6);
    assert!((angular_acceleration_in_world(&now, &s_dot, &s_ddot) - alpha).norm() < 1e-5);
}

#[test]
fn sign_continuous_series_do_not_jump() {
    let rotations: Vec<_> = (0..300)
        .map(|k| exp(&(Vector3::new(0.0, 0.6, 0.8) * (0.05 * f64::from(k)))))
        .map(canonical)
        .collect();
    let series = sign_continuous(&rotations);
    assert!(
        rotations
            .windows(2)
            .any(|w| w[0].coords.dot(&w[1].coords) < 0.0),
        "the input jumps"
    );
    assert!(
        series
            .windows(2)
            .all(|w| (w[1].coords - w[0].coords).norm() < 0.03)
    );
    assert!(
        series
            .iter()
            .zip(&rotations)
            .all(|(q, r)| UnitQuaternion::new_unchecked(*q).angle_to(r) < 1e-7)
    );
}

fn canonical(q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if q.w < 0.0 {
        UnitQuaternion::new_unchecked(-q.into_inner())
    } else {
        q
    }
}

#[test]
fn matrices_that_do_not_rotate_are_refused() {
    let good = spin(0.3).to_rotation_matrix().into_inner();
    assert!(
        rotation_from_matrix(&good, 1e-6)
            .unwrap()
            .angle_to(&spin(0.3))
            < 1e-7
    );
    for bad in [
        Matrix3::identity() * 1.1,
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)),
        Matrix3::repeat(f64::NAN),
    ] {
        assert!(matches!(
            rotation_from_matrix(&bad, 1e-3),
            Err(SpatialError::NotARotation { .. })
        ));
    }
}

#[test]
fn minimal_rotation_turns_one_direction_into_another() {
    let from = Vector3::new(0.1, 0.9, -0.3).normalize();
    for to in [Vector3::x(), -Vector3::y(), from, -from] {
        let turn = minimal_rotation(&from, &to);
        assert!((turn * from - to).norm() < 1e-7);
        assert!((turn.angle() - from.angle(&to)).abs() < 1e-7);
    }
}
