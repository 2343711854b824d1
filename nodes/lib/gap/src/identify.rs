//! What this motion cannot tell.

use cromosim_imu::{Effect, EffectKind};

use crate::Unidentifiable;
use crate::diagnose::Findings;
use crate::fit::{free_values, prior_deviation};

/// An effect, a size of it that would matter, and the motion that would show it.
const TELLING: [(EffectKind, f64, &str); 14] = [
    (
        EffectKind::ReferenceTilt,
        0.035,
        "turns of 60 degrees or more about two axes, so that tilt and mount differ",
    ),
    (
        EffectKind::ReferenceScale,
        0.03,
        "motion with accelerations of 2 m/s2 or more",
    ),
    (
        EffectKind::MountRotation,
        0.035,
        "turns of 30 degrees or more about two axes",
    ),
    (
        EffectKind::LeverArm,
        0.02,
        "rotation about two axes with 2 rad/s or more",
    ),
    (
        EffectKind::TimeOffset,
        0.01,
        "motion with changing angular velocity, 1 rad/s or more",
    ),
    (
        EffectKind::ClockDrift,
        200.0,
        "a recording of a minute or more with motion throughout",
    ),
    (
        EffectKind::AccelBias,
        0.1,
        "turns of 60 degrees or more, or rest in several orientations",
    ),
    (EffectKind::GyroBias, 0.01, "any recording of some seconds"),
    (
        EffectKind::AccelScale,
        0.03,
        "motion with 2 m/s2 or more on all axes, or rest with each axis up and down",
    ),
    (
        EffectKind::GyroScale,
        0.03,
        "rotation with 1 rad/s or more about all axes",
    ),
    (
        EffectKind::AccelMisalignment,
        0.03,
        "motion with 2 m/s2 or more on all axes, or rest in several orientations",
    ),
    (
        EffectKind::GyroMisalignment,
        0.03,
        "rotation with 1 rad/s or more about all axes",
    ),
    (
        EffectKind::GyroGSensitivity,
        0.002,
        "strong acceleration without rotation, on all axes",
    ),
    (
        EffectKind::MountSlip,
        0.05,
        "motion before and after the slip",
    ),
];

/// Effects of a size that would matter which stay within two standard errors here, or which cannot
/// be told from what was named.
pub(crate) fn unidentifiable(findings: &Findings) -> Vec<Unidentifiable> {
    let (context, fit) = (&findings.context, &findings.state.fit);
    let mut list = Vec::new();
    for (kind, size, would_tell) in TELLING {
        let worst = if fit.set.contains(kind) {
            let errors = fit
                .set
                .get(kind)
                .map(|effect| fit.standard_errors(effect))
                .unwrap_or_default();
            errors.into_iter().fold(0.0, f64::max)
        } else if kind == EffectKind::MountSlip {
            continue;
        } else {
            let mut set = fit.set.clone();
            set.insert(Effect::neutral(kind));
            let columns = context.columns(&set, &fit.prediction, kind);
            let prior: Vec<f64> = free_values(kind)
                .into_iter()
                .map(|index| prior_deviation(kind, index).powi(-2))
                .collect();
            let linear = context.extended(fit, &fit.residual, &columns, &prior);
            let own = fit.layout.len()..fit.layout.len() + columns.len();
            // The tilt about the vertical is none of its parameters: gravity does not see it.
            let own = if kind == EffectKind::ReferenceTilt {
                own.start..own.start + 2
            } else {
                own
            };
            own.map(|k| linear.covariance[(k, k)].max(0.0).sqrt())
                .fold(0.0, f64::max)
        };
        if 2.0 * worst > size {
            list.push(Unidentifiable {
                effect: kind.name().to_owned(),
                would_tell: would_tell.to_owned(),
            });
        }
    }
    list
}
