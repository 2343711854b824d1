//! To and from nalgebra.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use thiserror::Error;

use crate::cromosim_msgs::{SmplPose, SmplState};
use crate::geometry_msgs::{Point, Pose, Quaternion, Transform, Vector3};

/// A body in a message whose numbers are no pose.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum NotABody {
    /// A joint's rotation is none.
    #[error("joint {joint} (SMPL's order): {source}")]
    Rotation {
        /// Number of the joint.
        joint: usize,
        /// What is wrong with it.
        source: NotARotation,
    },
    /// The root is nowhere.
    #[error("the root's position is ({}, {}, {}); finite metres are expected", .0.x, .0.y, .0.z)]
    Position(Point),
}

/// Pelvis joint in the world (m) and the 24 rotations: world_from_pelvis first, the others
/// parent_from_joint.
type RootAndRotations = (nalgebra::Vector3<f64>, [UnitQuaternion<f64>; 24]);

fn root_and_rotations(
    root: Pose,
    rotations: &[Quaternion; 24],
) -> Result<RootAndRotations, NotABody> {
    let position: nalgebra::Vector3<f64> = root.position.into();
    if !position.iter().all(|metres| metres.is_finite()) {
        return Err(NotABody::Position(root.position));
    }
    let mut checked = [UnitQuaternion::identity(); 24];
    for (joint, raw) in rotations.iter().enumerate() {
        // Element 0 only repeats the root's orientation.
        let raw = if joint == 0 { root.orientation } else { *raw };
        checked[joint] = raw
            .try_into()
            .map_err(|source| NotABody::Rotation { joint, source })?;
    }
    Ok((position, checked))
}

macro_rules! body_message {
    ($($name:ident),*) => { $(
        impl $name {
            /// Pelvis joint in the world (m) and the 24 rotations: world_from_pelvis first, the
            /// others parent_from_joint. Rotations are normalised.
            ///
            /// # Errors
            /// [`NotABody`] for what is no rotation, NaN included, and for a position that is not
            /// finite.
            pub fn root_and_rotations(&self) -> Result<(nalgebra::Vector3<f64>, [UnitQuaternion<f64>; 24]), NotABody> {
                root_and_rotations(self.world_from_pelvis, &self.local_rotations)
            }

            /// Sets the root and the rotations, as [`Self::root_and_rotations`] gives them.
            pub fn set_root_and_rotations(&mut self, root_position: nalgebra::Vector3<f64>, rotations: &[UnitQuaternion<f64>; 24]) {
                self.world_from_pelvis = Pose { position: root_position.into(), orientation: rotations[0].into() };
                self.local_rotations = rotations.map(Into::into);
            }
        }
    )* };
}
body_message!(SmplPose, SmplState);

/// A quaternion whose norm is not 1 within 1 %, or that holds NaN or infinity.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("not a rotation: quaternion (x {}, y {}, z {}, w {}) is not of norm 1 within 1 %", .0.x, .0.y, .0.z, .0.w)]
pub struct NotARotation(pub Quaternion);

impl From<nalgebra::Vector3<f64>> for Vector3 {
    fn from(v: nalgebra::Vector3<f64>) -> Self {
        Self {
            x: v.x,
            y: v.y,
            z: v.z,
        }
    }
}

impl From<Vector3> for nalgebra::Vector3<f64> {
    fn from(v: Vector3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<nalgebra::Vector3<f64>> for Point {
    fn from(v: nalgebra::Vector3<f64>) -> Self {
        Self {
            x: v.x,
            y: v.y,
            z: v.z,
        }
    }
}

impl From<Point> for nalgebra::Vector3<f64> {
    fn from(v: Point) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<UnitQuaternion<f64>> for Quaternion {
    fn from(q: UnitQuaternion<f64>) -> Self {
        Self {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        }
    }
}

impl TryFrom<Quaternion> for UnitQuaternion<f64> {
    type Error = NotARotation;

    /// Normalises; refuses what is more than 1 % off a unit quaternion, and NaN.
    fn try_from(q: Quaternion) -> Result<Self, NotARotation> {
        let raw = nalgebra::Quaternion::new(q.w, q.x, q.y, q.z);
        let norm = raw.norm();
        if norm.is_finite() && (norm - 1.0).abs() <= 0.01 {
            Ok(Self::new_normalize(raw))
        } else {
            Err(NotARotation(q))
        }
    }
}

impl From<Isometry3<f64>> for Pose {
    fn from(world_from_body: Isometry3<f64>) -> Self {
        Self {
            position: world_from_body.translation.vector.into(),
            orientation: world_from_body.rotation.into(),
        }
    }
}

impl TryFrom<Pose> for Isometry3<f64> {
    type Error = NotARotation;

    /// As for the quaternion.
    fn try_from(message: Pose) -> Result<Self, NotARotation> {
        let position: nalgebra::Vector3<f64> = message.position.into();
        Ok(Self::from_parts(
            Translation3::from(position),
            message.orientation.try_into()?,
        ))
    }
}

impl From<Isometry3<f64>> for Transform {
    fn from(parent_from_child: Isometry3<f64>) -> Self {
        Self {
            translation: parent_from_child.translation.vector.into(),
            rotation: parent_from_child.rotation.into(),
        }
    }
}

impl TryFrom<Transform> for Isometry3<f64> {
    type Error = NotARotation;

    /// As for the quaternion.
    fn try_from(message: Transform) -> Result<Self, NotARotation> {
        let translation: nalgebra::Vector3<f64> = message.translation.into();
        Ok(Self::from_parts(
            Translation3::from(translation),
            message.rotation.try_into()?,
        ))
    }
}

impl From<SmplPose> for SmplState {
    /// Takes the fields over as they are.
    fn from(source: SmplPose) -> Self {
        let SmplPose {
            header,
            body_id,
            gender,
            betas,
            shape_space,
            world_from_pelvis,
            local_rotations,
            confidence,
        } = source;
        Self {
            header,
            body_id,
            gender,
            betas,
            shape_space,
            world_from_pelvis,
            local_rotations,
            confidence,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn an_isometry_survives_the_way_there_and_back() {
        let there = Isometry3::new(
            nalgebra::Vector3::new(1.0, -2.0, 3.0),
            nalgebra::Vector3::new(0.3, 0.2, -0.9),
        );
        let pose: Isometry3<f64> = Pose::from(there).try_into().unwrap();
        let edge: Isometry3<f64> = Transform::from(there).try_into().unwrap();
        assert!((pose.to_homogeneous() - there.to_homogeneous()).norm() < 1e-15);
        assert!((edge.to_homogeneous() - there.to_homogeneous()).norm() < 1e-15);
    }

    #[test]
    fn a_body_survives_the_way_there_and_back_and_nonsense_is_refused() {
        let rotations = std::array::from_fn(|joint| {
            UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(0.1 * joint as f64, 0.2, -0.3))
        });
        let mut state = SmplState::default();
        state.set_root_and_rotations(nalgebra::Vector3::new(1.0, 2.0, 3.0), &rotations);
        let (root, back) = state.root_and_rotations().unwrap();
        assert_eq!(root, nalgebra::Vector3::new(1.0, 2.0, 3.0));
        assert!(
            back.iter()
                .zip(&rotations)
                .all(|(one, other)| one.angle_to(other) < 1e-7)
        );
        state.local_rotations[5].w = f64::NAN;
        assert!(
            state
                .root_and_rotations()
                .unwrap_err()
                .to_string()
                .starts_with("joint 5")
        );
        state.world_from_pelvis.position.z = f64::INFINITY;
        assert!(matches!(
            state.root_and_rotations(),
            Err(NotABody::Position(_))
        ));
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        for w in [0.0, 0.98, 1.02, f64::NAN, f64::INFINITY] {
            assert!(
                UnitQuaternion::try_from(Quaternion {
                    w,
                    ..Quaternion::default()
                })
                .is_err(),
                "{w}"
            );
        }
        assert!(
            UnitQuaternion::try_from(Quaternion {
                w: 1.001,
                ..Quaternion::default()
            })
            .is_ok()
        );
    }
}
