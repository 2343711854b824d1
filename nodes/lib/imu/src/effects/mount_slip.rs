//! `mount_slip`: the mount turns once.

use std::f64::consts::PI;

use cromosim_spatial::{Stamp, so3};
use nalgebra::Matrix3;

use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use super::{EffectKind, mount_rotation};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::MountSlip,
    name: "mount_slip",
    stage: Stage::Sensor,
    summary: "The sensor turned on its segment once: from that time on both channels read the simulated vectors in other axes.",
    remedy: "Fasten the sensor (wider strap, rigid plate), and calibrate the mount anew after the slip.",
    parameters: &[
        ParameterSpec {
            name: "at",
            unit: "s",
            shape: Shape::Time,
            neutral: &[0.0],
            lower: -1e10,
            upper: 1e10,
            step: 1e-3,
        },
        ParameterSpec {
            name: "rotvec",
            unit: "rad",
            shape: Shape::Vector3,
            neutral: &[0.0; 3],
            lower: -PI,
            upper: PI,
            step: 1e-5,
        },
    ],
    random: false,
    continuous: true,
    starts,
};

/// Candidate times of a slip.
const CANDIDATES: usize = 400;

/// The time that leaves the least residual when the readings after it are turned, with that turn.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    let products: Vec<Matrix3<f64>> = view.outer_products().collect();
    let step = (products.len() / CANDIDATES).max(1);
    let mut after = Matrix3::zeros();
    let mut best = (
        f64::NEG_INFINITY,
        vec![view.epoch.as_seconds(), 0.0, 0.0, 0.0],
    );
    for (index, product) in products.iter().enumerate().rev() {
        after += product;
        if index % step != 0 || index * 20 < products.len() || index * 20 > products.len() * 19 {
            continue;
        }
        let turn = mount_rotation::best_rotation(&after);
        let gain = (turn.to_rotation_matrix().into_inner() * after).trace() - after.trace();
        if gain > best.0 {
            let rotvec = so3::log(&turn);
            best = (
                gain,
                vec![
                    view.stamps[index].as_seconds(),
                    rotvec.x,
                    rotvec.y,
                    rotvec.z,
                ],
            );
        }
    }
    vec![best.1]
}

/// Seconds from the epoch to the slip.
pub(super) fn since(epoch: Stamp, at: f64) -> f64 {
    // Whole seconds first: a difference of today's seconds would lose what the digits of `at` still
    // hold.
    let whole = epoch.nanos.div_euclid(1_000_000_000);
    (at - whole as f64) - epoch.nanos.rem_euclid(1_000_000_000) as f64 * 1e-9
}
