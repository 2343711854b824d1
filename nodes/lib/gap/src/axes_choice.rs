//! A turned mount that is a choice of axes.

use cromosim_imu::{Effect, EffectKind, EffectSet, nearest_signed_permutation};
use cromosim_spatial::so3;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::fit::FitModel;
use crate::library::Library;
use crate::reportable::{is_ordinary, ordinary_factor};
use crate::search::{ScoredEffectSet, score};
use crate::trace::{names, trace};

/// Rotation beside a choice of axes up to which a mount is one that is turned a little, and not turned otherwise; no source.
/// On BROAD 15 it is 0.005 rad.
const NEAR_RAD: f64 = 0.01;

/// The same set with a choice of axes in the place of a turned mount that is one to within what every
/// mount is turned by. The search takes the turn where something else is still to be found, whose part
/// its three values take up.
pub(crate) fn with_chosen_axes(
    model: &FitModel,
    scored: ScoredEffectSet,
    library: &Library,
) -> ScoredEffectSet {
    let set = &scored.fit.set;
    if !library.allows(EffectKind::AxisConvention) || set.contains(EffectKind::AxisConvention) {
        return scored;
    }
    let factor = ordinary_factor(model, EffectKind::MountRotation);
    let Some((chosen, rest)) = chosen_axes(set, factor) else {
        return scored;
    };
    // What is left of the turn is a mount's where it is seen: no cause, but kept.
    let [alone, beside] = [chosen.clone(), chosen.with(rest)].map(|set| score(model, set));
    let other = if alone.score >= beside.score {
        alone
    } else {
        beside
    };
    trace(|| {
        let names = names(&other.fit.set);
        eprintln!(
            "  axes as {names:?}: {:.1} for {:.1}",
            other.score, scored.score
        );
    });
    if !other.score.is_finite() {
        return scored;
    }
    let margin = |kind| {
        let old = scored.margins.iter().find(|(other, _)| *other == kind);
        old.map(|(_, margin)| (EffectKind::AxisConvention, *margin))
    };
    let kept = scored.margins.iter().copied();
    let margins = kept
        .filter(|(kind, _)| *kind != EffectKind::MountRotation)
        .chain(margin(EffectKind::MountRotation))
        .collect();
    ScoredEffectSet { margins, ..other }
}

/// A set with the choice of axes that its mount's rotation is, and what is left of the rotation; none where it is none.
fn chosen_axes(set: &EffectSet, factor: f64) -> Option<(EffectSet, Effect)> {
    let mount = set.get(EffectKind::MountRotation)?;
    let segment_from_sensor = turn(&Vector3::from_column_slice(mount.values()));
    let axes = nearest_signed_permutation(&segment_from_sensor.transpose());
    if axes == Matrix3::identity() || axes.determinant() < 0.0 {
        return None;
    }
    let rest = UnitQuaternion::from_matrix(&(segment_from_sensor * axes));
    let rest = Effect::mount_rotation(&so3::log(&rest)).ok()?;
    let is_near = Vector3::from_column_slice(rest.values()).norm() < NEAR_RAD;
    if !is_near && !is_ordinary(&rest, factor) {
        return None;
    }
    let mut chosen = set.without(EffectKind::MountRotation);
    chosen.insert(Effect::axis_convention(&axes).ok()?);
    // A slip turned the sensor in its own axes, and turns the mount in the segment's now.
    if let Some(slip) = set.get(EffectKind::MountSlip) {
        let mut values = slip.values().to_vec();
        let turned = axes.transpose() * Vector3::from_column_slice(&values[1..]);
        values[1..].copy_from_slice(turned.as_slice());
        chosen.insert(slip.with_values(values).ok()?);
    }
    Some((chosen, rest))
}

fn turn(rotvec: &Vector3<f64>) -> Matrix3<f64> {
    so3::exp(rotvec).to_rotation_matrix().into_inner()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn set(mount: &Vector3<f64>, slip: &Vector3<f64>) -> EffectSet {
        let values = [1.7e9, slip.x, slip.y, slip.z].to_vec();
        EffectSet::new()
            .with(Effect::mount_rotation(mount).unwrap())
            .with(Effect::new(EffectKind::MountSlip, values).unwrap())
    }

    /// What the sensor reads of a vector in the segment's axes, after the slip.
    fn read(set: &EffectSet) -> Matrix3<f64> {
        let values = |kind| set.get(kind).map(|effect| effect.values().to_vec());
        let mount = values(EffectKind::MountRotation).unwrap_or(vec![0.0; 3]);
        let slip = values(EffectKind::MountSlip).unwrap();
        let axes = values(EffectKind::AxisConvention)
            .map_or_else(Matrix3::identity, |rows| Matrix3::from_row_slice(&rows));
        let turned = turn(&Vector3::from_column_slice(&mount));
        axes * (turned * turn(&Vector3::from_column_slice(&slip[1..]))).transpose()
    }

    #[test]
    fn a_turn_that_exchanges_axes_is_their_choice_and_the_slip_turns_along() {
        let half = std::f64::consts::FRAC_1_SQRT_2 * std::f64::consts::PI;
        let turned = set(
            &Vector3::new(half, half, 0.0),
            &Vector3::new(-0.03, -0.04, 0.11),
        );
        let (chosen, rest) = chosen_axes(&turned, 1.0).unwrap();
        assert!(!chosen.contains(EffectKind::MountRotation));
        assert!(chosen.contains(EffectKind::AxisConvention));
        assert!((read(&turned) - read(&chosen)).norm() < 1e-9);
        assert!(rest.values().iter().all(|value| value.abs() < 1e-9));
    }

    #[test]
    fn what_is_left_of_the_turn_is_a_mounts() {
        let half = std::f64::consts::FRAC_1_SQRT_2 * std::f64::consts::PI;
        let turned = set(
            &Vector3::new(half + 0.02, half, -0.01),
            &Vector3::new(-0.03, -0.04, 0.11),
        );
        assert!(chosen_axes(&turned, 1.0).is_none());
        // Beside a poor reference every mount is turned by as much.
        let (chosen, rest) = chosen_axes(&turned, 10.0).unwrap();
        assert!((read(&turned) - read(&chosen.with(rest))).norm() < 1e-9);
        let turned = set(&Vector3::new(half + 0.006, half, -0.003), &Vector3::zeros());
        assert!(chosen_axes(&turned, 1.0).is_some());
    }

    #[test]
    fn other_turns_are_none() {
        for mount in [[0.001, 0.0, 0.0], [0.2, -0.1, 0.3], [1.56, 0.01, 0.0]] {
            let turned = set(&mount.into(), &Vector3::zeros());
            assert!(chosen_axes(&turned, 1.0).is_none());
        }
    }
}
