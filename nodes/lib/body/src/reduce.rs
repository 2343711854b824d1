//! The kinds of bodies that files hold, and how each becomes a body of SMPL's 24 joints.

use std::path::Path;

use crate::joint::SHARED_JOINTS;
use crate::raw::RawModel;
use crate::{BodyError, JOINT_COUNT, Joint, ShapeSpace};

const LEFT_WRIST: usize = Joint::LeftWrist as usize;
const RIGHT_WRIST: usize = Joint::RightWrist as usize;

/// The kind of body a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Smpl,
    SmplH,
    SmplX,
}

impl Kind {
    pub fn from_joint_count(joints: usize, path: &Path) -> Result<Self, BodyError> {
        match joints {
            24 => Ok(Self::Smpl),
            52 => Ok(Self::SmplH),
            55 => Ok(Self::SmplX),
            _ => Err(BodyError::BodyType {
                path: path.to_owned(),
                joints,
            }),
        }
    }

    pub fn space(self) -> ShapeSpace {
        if self == Self::SmplX {
            ShapeSpace::SmplX
        } else {
            ShapeSpace::Smpl
        }
    }

    /// How many columns of shapedirs are shapes. SMPL-X appends expressions: 100 to 300 shapes, or
    /// 10 to 10 in its small files.
    pub fn beta_count(self, columns: usize) -> usize {
        match (self, columns) {
            (Self::SmplX, 20) => 10,
            (Self::SmplX, _) => columns.min(300),
            _ => columns,
        }
    }
}

/// The arrays of a body file with J joints, shapes checked and values not yet; the pose blocks are
/// those of SMPL's joints only.
pub(crate) struct FileModel {
    pub raw: RawModel,
    /// Row 0 of kintree_table, (J).
    pub parents: Vec<i64>,
}

impl FileModel {
    /// The same body with SMPL's 24 joints, exactly while the joints that SMPL lacks keep their
    /// rest rotation: a joint that does not turn against its parent moves its vertices as the
    /// parent does, so that its weights may be the parent's, and its pose corrections P vec(R - I)
    /// are zero. Jaw and eyes go to the head. Fingers go to SMPL's hand, which stands at the root
    /// of the middle finger: at rest it is one with the wrist, and a state that turns it turns all
    /// fingers about that point, without corrections.
    pub fn reduced(self) -> Result<RawModel, BodyError> {
        let Self { mut raw, parents } = self;
        let owners = owners(&raw.path, &parents)?;
        let joint_count = parents.len();
        if joint_count == JOINT_COUNT {
            return Ok(raw);
        }
        let vertex_count = raw.template.len() / 3;
        let mut weights = vec![0.0; vertex_count * JOINT_COUNT];
        for (to, from) in weights
            .chunks_exact_mut(JOINT_COUNT)
            .zip(raw.weights.chunks_exact(joint_count))
        {
            owners
                .iter()
                .zip(from)
                .for_each(|(&owner, weight)| to[owner] += weight);
        }
        let left = hand_root(&raw.path, &parents, LEFT_WRIST)?;
        let right = hand_root(&raw.path, &parents, RIGHT_WRIST)?;
        let row = |joint: usize| &raw.regressor[joint * vertex_count..][..vertex_count];
        let rows: Vec<&[f64]> = (0..SHARED_JOINTS).chain([left, right]).map(row).collect();
        raw.regressor = rows.concat();
        raw.weights = weights;
        Ok(raw)
    }
}

/// Of each joint, SMPL's joint that moves it.
fn owners(path: &Path, parents: &[i64]) -> Result<Vec<usize>, BodyError> {
    let mut owners: Vec<usize> = Vec::with_capacity(parents.len());
    let shared = if parents.len() == JOINT_COUNT {
        JOINT_COUNT
    } else {
        SHARED_JOINTS
    };
    for (joint, &found) in parents.iter().enumerate() {
        let wrong = |expected| {
            Err(BodyError::Skeleton {
                path: path.to_owned(),
                joint,
                found,
                expected,
            })
        };
        if let Some(smpl) = Joint::ALL.get(joint).filter(|_| joint < shared) {
            let (suits, expected) = match smpl.parent() {
                Some(parent) => (found == parent.index() as i64, parent.index() as i64),
                None => (
                    found == -1 || found == i64::from(u32::MAX) || found == i64::MAX,
                    -1,
                ),
            };
            if !suits {
                return wrong(expected);
            }
            owners.push(joint);
        } else {
            let Some(&owner) = usize::try_from(found)
                .ok()
                .and_then(|parent| owners.get(parent))
            else {
                return wrong(joint as i64 - 1);
            };
            owners.push(match owner {
                LEFT_WRIST => Joint::LeftHand.index(),
                RIGHT_WRIST => Joint::RightHand.index(),
                other => other,
            });
        }
    }
    Ok(owners)
}

/// The root of the middle finger: the wrist's second child (index, middle, pinky, ring, thumb).
fn hand_root(path: &Path, parents: &[i64], wrist: usize) -> Result<usize, BodyError> {
    let mut fingers =
        (SHARED_JOINTS..parents.len()).filter(|&joint| parents[joint] == wrist as i64);
    let missing = || BodyError::Skeleton {
        path: path.to_owned(),
        joint: SHARED_JOINTS,
        found: parents[SHARED_JOINTS],
        expected: wrist as i64,
    };
    fingers.nth(1).ok_or_else(missing)
}
