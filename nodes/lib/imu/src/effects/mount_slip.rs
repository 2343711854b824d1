//! `mount_slip`: the mount turns once.

use std::f64::consts::PI;

use cromosim_spatial::Stamp;

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::MountSlip,
    name: "mount_slip",
    stage: Stage::Sensor,
    owner: Owner::Session,
    summary: "The sensor turned on its segment once: from that time on both channels read the simulated vectors in other axes.",
    remedy: "Fasten the sensor (wider strap, rigid plate), and calibrate the mount anew after the slip.",
    parameters: &[
        ParameterSpec {
            name: "at",
            unit: "s",
            shape: Shape::Time,
            neutral: &[0.0],
            is_optional: false,
            lower: -1e10,
            upper: 1e10,
            fit: None,
        },
        ParameterSpec {
            name: "rotvec",
            unit: "rad",
            shape: Shape::Vector3,
            neutral: &[0.0; 3],
            is_optional: false,
            lower: -PI,
            upper: PI,
            fit: Some(ParameterFit {
                step: 1e-5,
                prior_deviation: 0.7,
            }),
        },
    ],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::ChangeOf(EffectKind::MountRotation),
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::Change(5e-3)),
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[Dependence::MountOverTime],
        identifiability: Some(Identifiability {
            relevant_size: 0.05,
            values: 4,
            would_tell: "motion before and after the slip",
        }),
    }),
};

/// Seconds from the epoch to the slip.
pub(super) fn since(epoch: Stamp, at: f64) -> f64 {
    // Whole seconds first: a difference of today's seconds would lose what the digits of `at` still
    // hold.
    let whole = epoch.nanos.div_euclid(1_000_000_000);
    (at - whole as f64) - epoch.nanos.rem_euclid(1_000_000_000) as f64 * 1e-9
}
