//! A skeleton as its file describes it.

use nalgebra::{UnitQuaternion, Vector3};

/// One number of a bone or of the root in a frame of an AMC file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AsfChannel {
    /// `TX`, `TY`, `TZ` of the root: position along axis 0, 1, 2, file units.
    Translation(usize),
    /// `RX`, `RY`, `RZ`: turn about axis 0, 1, 2 of the bone's axes.
    Rotation(usize),
}

/// One bone; it begins where its parent ends.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfBone {
    /// As in the file.
    pub name: String,
    /// Index of the parent, always smaller than the bone's own; `None` for bones that begin at the
    /// root.
    pub parent: Option<usize>,
    /// From the bone's beginning to its end at rest, skeleton axes, file units.
    pub rest_span: Vector3<f64>,
    /// C: skeleton_from_bone at rest.
    pub skeleton_from_bone: UnitQuaternion<f64>,
    /// The axes (0 x, 1 y, 2 z) that the bone turns about, in the order of an AMC line's numbers.
    pub freedoms: Vec<usize>,
    /// Smallest and largest angle of each freedom, rad, where the file has them all; they are not
    /// enforced.
    pub limits: Vec<[f64; 2]>,
}

/// A parsed ASF file.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfSkeleton {
    /// The name given to `parse_asf`.
    pub name: String,
    /// `length` of `:units`: CMU's files have 0.45, their unit is an inch divided by it.
    pub length_unit: f64,
    /// Whether angles of the skeleton are degrees (else radians).
    pub degrees: bool,
    /// What the root's numbers in an AMC file are.
    pub root_order: Vec<AsfChannel>,
    /// Root at rest, file units.
    pub root_position: Vector3<f64>,
    /// Root at rest: the axes that the root's turns are about.
    pub root_orientation: UnitQuaternion<f64>,
    /// Parents before children.
    pub bones: Vec<AsfBone>,
}

impl AsfSkeleton {
    /// The bone called `name` (as written, in any case).
    pub fn bone(&self, name: &str) -> Option<usize> {
        self.bones
            .iter()
            .position(|bone| bone.name.eq_ignore_ascii_case(name))
    }
}

/// The rotation of three angles (rad) about fixed axes, the first one first: R = R_last R_middle
/// R_first.
pub(crate) fn turned(angles: impl IntoIterator<Item = (usize, f64)>) -> UnitQuaternion<f64> {
    angles
        .into_iter()
        .fold(UnitQuaternion::identity(), |before, (axis, angle)| {
            UnitQuaternion::from_axis_angle(
                &[Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][axis.min(2)],
                angle,
            ) * before
        })
}
