//! `mount_rotation`: the sensor is turned on its segment.

use std::f64::consts::PI;

use cromosim_spatial::so3;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::MountRotation,
    name: "mount_rotation",
    stage: Stage::Sensor,
    summary: "The sensor's axes are turned against the reference frame's: both channels are the simulated vectors in other axes.",
    remedy: "Calibrate the sensor-to-segment rotation and enter it as the placement's mount.",
    parameters: &[ParameterSpec {
        name: "rotvec",
        unit: "rad",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -PI,
        upper: PI,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

/// No rotation, and the best one of both channels' vectors.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    let best = so3::log(&best_rotation(&view.outer_products().sum()));
    vec![vec![0.0; 3], best.as_slice().to_vec()]
}

/// R that makes `sum |m - R^T s|^2` least, from `C = sum m s^T` (Kabsch 1976): `trace(R C)` is
/// greatest.
pub(super) fn best_rotation(sum: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let svd = sum.transpose().svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return UnitQuaternion::identity();
    };
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    so3::rotation_from_matrix(&rotation, 1e-6).unwrap_or_else(|_| UnitQuaternion::identity())
}

/// `R_mount^T`, which turns segment axes into sensor axes; R_mount is segment_from_sensor.
pub(super) fn sensor_from_segment(rotvec: &Vector3<f64>) -> Matrix3<f64> {
    so3::exp(rotvec)
        .to_rotation_matrix()
        .into_inner()
        .transpose()
}
