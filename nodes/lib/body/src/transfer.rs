//! Named sites carried from one body to another.

use nalgebra::{UnitQuaternion, Vector3};

use crate::site::{NamedSite, point_at};
use crate::site_lookup::nearest;
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint};

/// The sites of `from` on a body `to` with other triangles: each is placed by landmarks that do not
/// depend on how a skeleton divides the spine (hips, shoulders, limbs' joints, the head's extent) and
/// put onto the nearest skin: centimetres off, no more exact than a person's hand.
///
/// # Errors
/// [`BodyError::SiteTransfer`] where no point of the skin is nearest.
pub(crate) fn transferred_sites(
    from: &BodyModel,
    to: &BodyModel,
) -> Result<Vec<NamedSite>, BodyError> {
    let (from_landmarks, to_landmarks) = (Landmarks::from_body(from), Landmarks::from_body(to));
    let owners = to.triangle_owners();
    let transferred = |named: &NamedSite| {
        let joint = named.site.joint;
        let point = point_at(
            &from.faces[named.site.triangle as usize],
            &named.site.barycentrics,
            &from.template,
        );
        let wanted = carried(&from_landmarks, &to_landmarks, joint, point);
        let region = Region::from_joint(joint);
        let site = nearest(to, &to.template, wanted, |triangle| {
            touches(region, Region::from_joint(owners[triangle]))
        })
        .or_else(|| nearest(to, &to.template, wanted, |_| true))
        // Of coordinates near the largest that floats hold, nothing finite follows.
        .filter(|site| site.barycentrics.iter().all(|weight| weight.is_finite()));
        site.map(|site| NamedSite {
            name: named.name.clone(),
            site,
        })
        .ok_or_else(|| BodyError::SiteTransfer {
            body: to.id.clone(),
            site: named.name.clone(),
        })
    };
    from.sites.iter().map(transferred).collect()
}

/// Parts of the body; sides are kept apart, so that no site of one thigh lands on the other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Region {
    Trunk,
    Head,
    LeftArm,
    RightArm,
    LeftLeg,
    RightLeg,
}

impl Region {
    fn from_joint(joint: Joint) -> Self {
        match joint {
            Joint::Pelvis
            | Joint::Spine1
            | Joint::Spine2
            | Joint::Spine3
            | Joint::Neck
            | Joint::LeftCollar
            | Joint::RightCollar => Self::Trunk,
            Joint::Head => Self::Head,
            Joint::LeftShoulder | Joint::LeftElbow | Joint::LeftWrist | Joint::LeftHand => {
                Self::LeftArm
            }
            Joint::RightShoulder | Joint::RightElbow | Joint::RightWrist | Joint::RightHand => {
                Self::RightArm
            }
            Joint::LeftHip | Joint::LeftKnee | Joint::LeftAnkle | Joint::LeftFoot => Self::LeftLeg,
            Joint::RightHip | Joint::RightKnee | Joint::RightAnkle | Joint::RightFoot => {
                Self::RightLeg
            }
        }
    }
}

/// Skin weights put a region's border anywhere near the joint, so that neighbours count too.
fn touches(region: Region, other: Region) -> bool {
    region == other || region == Region::Trunk || other == Region::Trunk
}

/// Points by which a place on one body is found on another; model frame, mean shape, m.
struct Landmarks {
    joints: [Vector3<f64>; JOINT_COUNT],
    hips: Vector3<f64>,
    shoulders: Vector3<f64>,
    /// Centre and half extents of the head's upper part.
    head: (Vector3<f64>, Vector3<f64>),
}

impl Landmarks {
    fn from_body(body: &BodyModel) -> Self {
        let (joints, _) = body.joint_shape_directions();
        let middle = |a: Joint, b: Joint| (joints[a.index()] + joints[b.index()]) / 2.0;
        let (hips, shoulders) = (
            middle(Joint::LeftHip, Joint::RightHip),
            middle(Joint::LeftShoulder, Joint::RightShoulder),
        );
        let crown = body
            .template
            .iter()
            .map(|vertex| vertex.y)
            .fold(f64::NEG_INFINITY, f64::max);
        // Above the chin, and in T-pose above everything else.
        let lowest = (shoulders.y + crown) / 2.0;
        let (mut low, mut high) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        for vertex in body.template.iter().filter(|vertex| vertex.y >= lowest) {
            (low, high) = (low.inf(vertex), high.sup(vertex));
        }
        Self {
            joints,
            hips,
            shoulders,
            head: ((low + high) / 2.0, (high - low) / 2.0),
        }
    }

    fn joint(&self, joint: Joint) -> Vector3<f64> {
        self.joints[joint.index()]
    }

    fn length(&self, joints: &[Joint]) -> f64 {
        joints
            .windows(2)
            .map(|pair| (self.joint(pair[1]) - self.joint(pair[0])).norm())
            .sum()
    }
}

/// Where a `point` that `joint` moves on one body is on another.
fn carried(from: &Landmarks, to: &Landmarks, joint: Joint, point: Vector3<f64>) -> Vector3<f64> {
    let limb = |bones: [Joint; 3]| {
        let whole = ratio(to.length(&bones), from.length(&bones));
        // Hands and feet turn with nothing at rest, and skeletons end them at different places: the
        // limb's size is theirs.
        let Some(bone) = bones.windows(2).find(|bone| bone[0] == joint) else {
            return to.joint(bones[2]) + (point - from.joint(bones[2])) * whole;
        };
        let (from_bone, to_bone) = (
            from.joint(bone[1]) - from.joint(bone[0]),
            to.joint(bone[1]) - to.joint(bone[0]),
        );
        let turn = UnitQuaternion::rotation_between(&from_bone, &to_bone).unwrap_or_default();
        to.joint(bone[0])
            + turn * ((point - from.joint(bone[0])) * ratio(to_bone.norm(), from_bone.norm()))
    };
    match Region::from_joint(joint) {
        Region::Trunk => {
            let (from_spine, to_spine) = (from.shoulders - from.hips, to.shoulders - to.hips);
            let height = ratio(point.y - from.hips.y, from_spine.y);
            to.hips
                + to_spine * height
                + (point - from.hips - from_spine * height)
                    * ratio(to_spine.norm(), from_spine.norm())
        }
        Region::Head => {
            let scale = to.head.1.zip_map(&from.head.1, ratio);
            to.head.0 + (point - from.head.0).component_mul(&scale)
        }
        Region::LeftArm => limb([Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist]),
        Region::RightArm => limb([Joint::RightShoulder, Joint::RightElbow, Joint::RightWrist]),
        Region::LeftLeg => limb([Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle]),
        Region::RightLeg => limb([Joint::RightHip, Joint::RightKnee, Joint::RightAnkle]),
    }
}

/// 1 where a body has no such length.
fn ratio(to: f64, from: f64) -> f64 {
    let ratio = to / from;
    if ratio.is_finite() { ratio } else { 1.0 }
}
