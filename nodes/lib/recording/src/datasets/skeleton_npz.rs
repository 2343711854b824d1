//! Skeleton clips as npz with a label for every frame: `fps`, `joints`, `parents`, `offsets` (J, 3)
//! m, `local_quat_wxyz` (N, J, 4) and `pos` (N, J, 3) m, as the project's own conversion of CMU
//! clips has them; `label` (N) and `label_names` where it is labelled, `suspect` (N) where joints
//! flip.
//!
//! Offsets and local rotations are a BVH file's (y up), positions have z up; so the clip comes out
//! as that BVH file had it, in metres.

use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Limits, NpzReader};
use cromosim_motion::{BvhClip, BvhJoint, Channel, MAX_JOINTS};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::rigid::RigidError;
use crate::rigid::table::unit_quaternion;

/// An hour at 120 Hz with 21 joints.
const LIMITS: Limits = Limits {
    decoded_bytes: 256 << 20,
    opcodes: 10_000,
    depth: 10,
};

/// A skeleton's motion with what its frames show.
#[derive(Clone, Debug)]
pub struct LabelledClip {
    /// The motion, y up, m.
    pub clip: BvhClip,
    /// Whose motion it is; empty where the file does not say.
    pub subject: String,
    /// One per frame: the label's name, or none where the frame shows nothing of them. Empty where
    /// the file has no labels.
    pub labels: Vec<Option<String>>,
    /// One per frame: whether a joint flips there or moves like none. Empty where the file does not
    /// say.
    pub suspect: Vec<bool>,
    /// Why a clip is unlike everyday motion; empty where it is not.
    pub atypical: String,
}

/// Reads a clip.
///
/// # Errors
/// [`RigidError::Arrays`], [`RigidError::Content`]; both name the array.
pub fn parse_skeleton_npz<R: Read + Seek>(
    reader: R,
    name: &str,
) -> Result<LabelledClip, RigidError> {
    let content = |place: &str, problem: String| RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem,
    };
    let mut npz = NpzReader::with_limits(reader, Path::new(name), LIMITS)?;
    let rate_hz = npz.at("fps")?.float()?;
    if !(1.0..1e4).contains(&rate_hz) {
        return Err(content(
            "fps",
            format!("expected frames per second, found {rate_hz}"),
        ));
    }
    let skeleton = Skeleton::read(&mut npz, &content)?;
    let frames = skeleton.frames;
    let joints = skeleton.joints(&content)?;
    let values = skeleton.values(&content)?;
    let clip = BvhClip::from_parts(name, joints, rate_hz.recip(), values);
    let subject = npz.text("subject")?.unwrap_or_default();
    let atypical = npz.text("atypical")?.unwrap_or_default();
    let suspect = npz
        .integers("suspect", &[Some(frames)], "(N)")?
        .map_or_else(Vec::new, |flags| flags.values);
    let suspect = suspect.iter().map(|flag| *flag != 0).collect();
    Ok(LabelledClip {
        clip,
        subject,
        labels: labels(&mut npz, frames, &content)?,
        suspect,
        atypical,
    })
}

/// The arrays of the skeleton and its motion.
struct Skeleton {
    names: Vec<String>,
    /// Index of each joint's parent; negative for the root.
    parents: Vec<i64>,
    /// (J, 3), m.
    offsets: Vec<f64>,
    /// (N, J, 4), w first.
    rotations: Vec<f64>,
    /// (N, J, 3), m, z up.
    positions: Vec<f64>,
    frames: usize,
}

impl Skeleton {
    fn read<R: Read + Seek>(
        npz: &mut NpzReader<R>,
        content: &impl Fn(&str, String) -> RigidError,
    ) -> Result<Self, RigidError> {
        let names = npz.at("joints")?.texts()?;
        let count = names.len();
        if !(1..=MAX_JOINTS).contains(&count) {
            return Err(content(
                "joints",
                format!("{count} joints, expected 1 to {MAX_JOINTS}"),
            ));
        }
        let parents = npz.at("parents")?.integers(&[Some(count)], "(J)")?.values;
        let offsets = npz
            .at("offsets")?
            .floats(&[Some(count), Some(3)], "(J, 3)")?
            .values;
        let rotations = npz
            .at("local_quat_wxyz")?
            .floats(&[None, Some(count), Some(4)], "(N, J, 4)")?
            .values;
        let positions = npz
            .at("pos")?
            .floats(&[None, Some(count), Some(3)], "(N, J, 3)")?
            .values;
        let frames = rotations.len() / (4 * count);
        if frames == 0 || positions.len() != frames * count * 3 {
            let found = positions.len() / (3 * count);
            let problem = format!("{found} frames, local_quat_wxyz has {frames}");
            return Err(content("pos", problem));
        }
        Ok(Self {
            names,
            parents,
            offsets,
            rotations,
            positions,
            frames,
        })
    }

    /// The joints, parents before children.
    fn joints(
        &self,
        content: &impl Fn(&str, String) -> RigidError,
    ) -> Result<Vec<BvhJoint>, RigidError> {
        let mut joints = Vec::with_capacity(self.names.len());
        for (index, (joint, parent)) in self.names.iter().zip(&self.parents).enumerate() {
            let before = usize::try_from(*parent)
                .ok()
                .filter(|parent| *parent < index);
            if before.is_none() && index > 0 {
                let problem = format!(
                    "joint {index} has parent {parent}, expected one of the joints before it"
                );
                return Err(content("parents", problem));
            }
            let offset = &self.offsets[3 * index..3 * index + 3];
            joints.push(joint_of(joint, before, offset));
        }
        Ok(joints)
    }

    /// The channels of all frames: the root's position, then each joint's angles.
    fn values(
        &self,
        content: &impl Fn(&str, String) -> RigidError,
    ) -> Result<Vec<f64>, RigidError> {
        let count = self.names.len();
        let mut values = Vec::with_capacity(self.frames * 3 * (count + 1));
        for (frame, quaternions) in self.rotations.chunks_exact(4 * count).enumerate() {
            let root = &self.positions[frame * count * 3..];
            // Rx(-90 degrees): z up to y up.
            values.extend([root[0], root[2], -root[1]]);
            for (joint, [w, x, y, z]) in quaternions.as_chunks::<4>().0.iter().enumerate() {
                let wrong = |length| {
                    content(
                        "local_quat_wxyz",
                        format!("frame {frame}, joint {joint} has length {length}, expected 1"),
                    )
                };
                values.extend(zxy_degrees(
                    &unit_quaternion(Quaternion::new(*w, *x, *y, *z)).map_err(wrong)?,
                ));
            }
        }
        Ok(values)
    }
}

/// One label a frame, or none at all where the file has no labels.
fn labels<R: Read + Seek>(
    npz: &mut NpzReader<R>,
    frames: usize,
    content: &dyn Fn(&str, String) -> RigidError,
) -> Result<Vec<Option<String>>, RigidError> {
    let Some(labels) = npz.integers("label", &[Some(frames)], "(N)")? else {
        return Ok(Vec::new());
    };
    let names = npz.at("label_names")?.texts()?;
    let name = |(frame, label): (usize, &i64)| match usize::try_from(*label) {
        Err(_) => Ok(None),
        Ok(index) => match names.get(index) {
            Some(name) => Ok(Some(name.clone())),
            None => Err(content(
                "label",
                format!(
                    "frame {frame} has label {label}, but there are {} label_names",
                    names.len()
                ),
            )),
        },
    };
    labels.values.iter().enumerate().map(name).collect()
}

fn joint_of(name: &str, parent: Option<usize>, offset: &[f64]) -> BvhJoint {
    // Z, X, Y: the middle angle is the one that a standing human's joints rarely bring to 90
    // degrees.
    let turns = [2, 0, 1].map(Channel::Rotation);
    let moves = if parent.is_none() {
        [0, 1, 2].map(Channel::Position).to_vec()
    } else {
        Vec::new()
    };
    BvhJoint {
        name: name.to_owned(),
        parent,
        rest_in_parent: Vector3::new(offset[0], offset[1], offset[2]),
        channels: moves.into_iter().chain(turns).collect(),
        tip: None,
    }
}

/// Angles of `R = Rz Rx Ry`, degrees, in that order.
fn zxy_degrees(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let matrix = rotation.to_rotation_matrix();
    let x = matrix[(2, 1)].clamp(-1.0, 1.0).asin();
    let (z, y) = if matrix[(2, 1)].abs() < 1.0 - 1e-9 {
        (
            (-matrix[(0, 1)]).atan2(matrix[(1, 1)]),
            (-matrix[(2, 0)]).atan2(matrix[(2, 2)]),
        )
    } else {
        // Both turn about the same axis: one does it all.
        (matrix[(1, 0)].atan2(matrix[(0, 0)]), 0.0)
    };
    [z, x, y].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_give_the_rotation_again() {
        let axes = [Vector3::z(), Vector3::x(), Vector3::y()];
        for (a, b, c) in [
            (0.3, -0.9, 2.0),
            (-3.0, 1.2, 0.1),
            (0.0, 0.0, 0.0),
            (0.4, std::f64::consts::FRAC_PI_2, 0.7),
            (1.0, -std::f64::consts::FRAC_PI_2, 0.2),
        ] {
            let rotation = UnitQuaternion::from_scaled_axis(axes[0] * a)
                * UnitQuaternion::from_scaled_axis(axes[1] * b)
                * UnitQuaternion::from_scaled_axis(axes[2] * c);
            let again = zxy_degrees(&rotation)
                .iter()
                .zip(axes)
                .map(|(angle, axis)| UnitQuaternion::from_scaled_axis(axis * angle.to_radians()))
                .fold(UnitQuaternion::identity(), |product, turn| product * turn);
            assert!(
                again.angle_to(&rotation) < 1e-4,
                "{a} {b} {c}: {}",
                again.angle_to(&rotation)
            );
        }
    }
}
