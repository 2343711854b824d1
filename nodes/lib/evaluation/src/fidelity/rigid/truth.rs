//! Motion whose exact readings are known, and that of a humanoid in a physics engine.

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Limits};
use cromosim_imu::Reading;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use crate::EvaluationError;

/// Made by `tests/physics/make.py`; bags/truth says what is in them.
const MOTIONS: [(&str, &[u8]); 6] = [
    (
        "walk",
        include_bytes!("../../../../../../bags/truth/walk.npz"),
    ),
    (
        "run",
        include_bytes!("../../../../../../bags/truth/run.npz"),
    ),
    (
        "jump",
        include_bytes!("../../../../../../bags/truth/jump.npz"),
    ),
    (
        "reach",
        include_bytes!("../../../../../../bags/truth/reach.npz"),
    ),
    (
        "fall",
        include_bytes!("../../../../../../bags/truth/fall.npz"),
    ),
    (
        "burst",
        include_bytes!("../../../../../../bags/truth/burst.npz"),
    ),
];
/// Where the humanoid wears IMUs.
pub(super) const POSITIONS: [&str; 6] = ["wrist", "upper_arm", "pelvis", "thigh", "foot", "head"];

/// Whether there is a motion with this name.
pub(super) fn is_motion(name: &str) -> bool {
    MOTIONS.iter().any(|(own, _)| *own == name)
}

/// A motion with as many IMUs as there are [`POSITIONS`], for which errors are drawn.
pub(super) struct KnownMotion {
    /// Its name.
    pub name: &'static str,
    /// Frames per second of poses and readings, Hz.
    pub rate_hz: f64,
    /// Of the humanoid, in the order of [`POSITIONS`].
    pub sites: Vec<KnownSite>,
}

/// An IMU on a rigid body; as many readings as poses, frame k at `k / rate_hz`.
pub(super) struct KnownSite {
    /// Where it is.
    pub position: &'static str,
    /// World from sensor, m.
    pub poses: Vec<Isometry3<f64>>,
    /// What it reads, sensor axes.
    pub readings: Vec<Reading>,
}

/// All motions.
///
/// # Errors
/// Arrays that are missing or of other shapes.
pub(super) fn known_motions() -> Result<Vec<KnownMotion>, EvaluationError> {
    MOTIONS
        .iter()
        .map(|(name, bytes)| read(name, bytes))
        .collect()
}

fn read(name: &'static str, bytes: &[u8]) -> Result<KnownMotion, EvaluationError> {
    let path = Path::new("bags/truth").join(format!("{name}.npz"));
    let mut file = Container::new(Cursor::new(bytes), &path, Limits::default())?;
    let rate_hz = file.at("rate_hz")?.float()?;
    let sites = POSITIONS
        .iter()
        .map(|position| read_site(&mut file, position))
        .collect::<Result<_, _>>()?;
    Ok(KnownMotion {
        name,
        rate_hz,
        sites,
    })
}

fn read_site(
    file: &mut Container<Cursor<&[u8]>>,
    position: &'static str,
) -> Result<KnownSite, EvaluationError> {
    let mut vectors = |quantity: &str| -> Result<Vec<Vector3<f64>>, EvaluationError> {
        let entry = file.at(&format!("{position}_{quantity}"))?;
        let values = entry.floats(&[None, Some(3)], "(N, 3)")?.values;
        Ok(values
            .as_chunks::<3>()
            .0
            .iter()
            .map(|value| Vector3::from(*value))
            .collect())
    };
    let (places, forces) = (vectors("position")?, vectors("specific_force")?);
    let rates = vectors("angular_velocity")?;
    let turns = file
        .at(&format!("{position}_quat_wxyz"))?
        .floats(&[None, Some(4)], "(N, 4)")?
        .values;
    let pose = |(place, [w, x, y, z]): (&Vector3<f64>, &[f64; 4])| {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(*w, *x, *y, *z));
        Isometry3::from_parts((*place).into(), turn)
    };
    let reading = |(specific_force, angular_velocity)| Reading {
        specific_force,
        angular_velocity,
    };
    Ok(KnownSite {
        position,
        poses: places
            .iter()
            .zip(turns.as_chunks::<4>().0)
            .map(pose)
            .collect(),
        readings: forces.into_iter().zip(rates).map(reading).collect(),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::GRAVITY_IN_WORLD;
    use cromosim_spatial::so3;

    use super::*;

    /// Differences of 240 Hz see what the truth's low-pass at 47 Hz left; hence the wide bounds, which a
    /// wrong axis, sign, unit or time would still break.
    #[test]
    fn readings_are_those_of_the_poses() {
        for motion in known_motions().unwrap() {
            for site in &motion.sites {
                assert_eq!(site.poses.len(), site.readings.len());
                let (mut errors, mut sizes, mut count) = ([0.0; 2], [0.0; 2], 0.0);
                for (k, reading) in site.readings.iter().enumerate().skip(2) {
                    let Some([before, own, after]) = site
                        .poses
                        .get(k - 2..=k + 2)
                        .map(|five| [five[0], five[2], five[4]])
                    else {
                        break;
                    };
                    let h = 2.0 / motion.rate_hz;
                    let second = (before.translation.vector + after.translation.vector
                        - 2.0 * own.translation.vector)
                        / (h * h);
                    let force = own.rotation.inverse() * (second - GRAVITY_IN_WORLD);
                    let rate = so3::log(&(before.rotation.inverse() * after.rotation)) / (2.0 * h);
                    errors[0] += (force - reading.specific_force).norm_squared();
                    errors[1] += (rate - reading.angular_velocity).norm_squared();
                    sizes[0] += (reading.specific_force.norm() - 9.80665).powi(2);
                    sizes[1] += reading.angular_velocity.norm_squared();
                    count += 1.0;
                }
                let part = [0, 1].map(|k| (errors[k] / sizes[k]).sqrt());
                let all = errors.map(|sum: f64| (sum / count).sqrt());
                assert!(
                    (part[0] < 0.5 || all[0] < 0.2) && (part[1] < 0.15 || all[1] < 0.01),
                    "{} {}: {part:?} {all:?}",
                    motion.name,
                    site.position
                );
            }
        }
    }
}
