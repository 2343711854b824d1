//! The kinds of bodies that files hold, and how each becomes a body of SMPL's 24 joints.

use std::fmt;
use std::path::Path;

use crate::model::{Gender, PoseBlock, RawModel, Rows};
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint};

/// Joints that SMPL, SMPL-H and SMPL-X share; the others are fingers, jaw and eyes, or SMPL's
/// hands.
const SHARED_JOINTS: usize = 22;
const LEFT_WRIST: usize = Joint::LeftWrist as usize;
const RIGHT_WRIST: usize = Joint::RightWrist as usize;

/// Whose shapes the betas of a body tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShapeSpace {
    /// The embedded body's: stature, mass and so on.
    Cromosim,
    /// SMPL's and SMPL-H's.
    Smpl,
    /// SMPL-X'.
    SmplX,
}

impl ShapeSpace {
    const ALL: [Self; 3] = [Self::Cromosim, Self::Smpl, Self::SmplX];

    /// The word in messages and files (AMASS' `surface_model_type`): `cromosim`, `smpl`, `smplx`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cromosim => "cromosim",
            Self::Smpl => "smpl",
            Self::SmplX => "smplx",
        }
    }

    /// The space of a word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|space| space.name() == name)
    }
}

impl fmt::Display for ShapeSpace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Cromosim => "the embedded body",
            Self::Smpl => "SMPL",
            Self::SmplX => "SMPL-X",
        })
    }
}

impl BodyModel {
    /// Whether betas of `space` and `gender` mean on this body what they were made for; no betas,
    /// or zeros, always do.
    ///
    /// SMPL's betas are coefficients of directions that its file holds: on another mesh the same
    /// numbers are another person. Where the people's bone lengths are known,
    /// [`Self::fit_bone_lengths`] finds this body's own betas instead.
    ///
    /// # Errors
    /// [`BodyError::ForeignBetas`] for those of another kind of body, or of another gender's file
    /// where both are known.
    pub fn check_betas(
        &self,
        space: ShapeSpace,
        gender: Option<Gender>,
        betas: &[f64],
    ) -> Result<(), BodyError> {
        let both = self.gender.zip(gender);
        let genders_differ =
            space != ShapeSpace::Cromosim && both.is_some_and(|(own, given)| own != given);
        if betas.iter().all(|&beta| beta == 0.0) || (space == self.space && !genders_differ) {
            return Ok(());
        }
        let named = |space: ShapeSpace, gender: Option<Gender>| match gender
            .filter(|_| genders_differ && space != ShapeSpace::Cromosim)
        {
            Some(gender) => format!("{space} {gender}"),
            None => space.to_string(),
        };
        let (body_of, betas_of) = (named(self.space, self.gender), named(space, gender));
        Err(BodyError::ForeignBetas {
            body: self.id.clone(),
            body_of,
            betas_of,
        })
    }
}

impl BodyModel {
    /// As [`Self::check_betas`], of the words that a message carries. Betas other than 0 need the
    /// word: nobody can tell from the numbers.
    ///
    /// # Errors
    /// [`BodyError::ForeignBetas`], and [`BodyError::UnknownShapeSpace`] for betas other than 0
    /// whose space is missing or unknown.
    pub fn check_named_betas(
        &self,
        shape_space: &str,
        gender: &str,
        betas: &[f64],
    ) -> Result<(), BodyError> {
        match ShapeSpace::from_name(shape_space) {
            Some(space) => self.check_betas(space, Gender::from_name(gender), betas),
            None if betas.iter().all(|&beta| beta == 0.0) => Ok(()),
            None => Err(BodyError::UnknownShapeSpace {
                given: shape_space.to_owned(),
            }),
        }
    }
}

/// The kind of body a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Smpl,
    SmplH,
    SmplX,
}

impl Kind {
    pub fn of_joint_count(joints: usize, path: &Path) -> Result<Self, BodyError> {
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

/// Of posedirs (V, 3, 9 (J - 1)), each vertex' blocks (3, 9) of SMPL's joints that are not zero.
pub(crate) fn pose_blocks(directions: &[f64], joint_count: usize) -> Rows<PoseBlock> {
    let features = 9 * (joint_count - 1);
    Rows::new(
        directions
            .chunks_exact(3 * features)
            .map(|directions| vertex_pose_blocks(directions, joint_count)),
    )
}

/// As [`pose_blocks`], of one vertex.
pub(crate) fn vertex_pose_blocks(directions: &[f64], joint_count: usize) -> Vec<PoseBlock> {
    let features = 9 * (joint_count - 1);
    let joints = if joint_count == JOINT_COUNT {
        JOINT_COUNT
    } else {
        SHARED_JOINTS
    };
    let block = |joint: usize| PoseBlock {
        joint: joint as u8,
        coefficients: std::array::from_fn(|i| {
            directions[(i / 9) * features + 9 * (joint - 1) + i % 9] as f32
        }),
    };
    (1..joints)
        .map(block)
        .filter(|block| block.coefficients.iter().any(|&c| c != 0.0))
        .collect()
}
