//! Writes an SMPL motion as ASF and AMC in a skeleton with the names, the axes and the habits of
//! the CMU database.

use std::fmt::Write;

use cromosim_body::{BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

use super::known::{Rotations, about};

/// Bone, parent, SMPL segment that it moves with, where it ends (a joint of SMPL), degrees of
/// freedom, axis angles in degrees (about X, Y, Z in this order).
pub type Bone = (
    &'static str,
    &'static str,
    Joint,
    End,
    &'static str,
    [f64; 3],
);

/// Where a bone ends.
#[derive(Clone, Copy)]
pub enum End {
    At(Joint),
    /// From its beginning, in body axes at rest, m.
    By([f64; 3]),
}

type Side = (
    &'static str,
    f64,
    (Joint, Joint, Joint, Joint, Joint, Joint, Joint, Joint),
);

const LEFT: Side = (
    "lhipjoint lfemur ltibia lfoot ltoes lclavicle lhumerus lradius lwrist lhand lfingers lthumb",
    1.0,
    (
        Joint::LeftHip,
        Joint::LeftKnee,
        Joint::LeftAnkle,
        Joint::LeftFoot,
        Joint::LeftCollar,
        Joint::LeftShoulder,
        Joint::LeftElbow,
        Joint::LeftWrist,
    ),
);
const RIGHT: Side = (
    "rhipjoint rfemur rtibia rfoot rtoes rclavicle rhumerus rradius rwrist rhand rfingers rthumb",
    -1.0,
    (
        Joint::RightHip,
        Joint::RightKnee,
        Joint::RightAnkle,
        Joint::RightFoot,
        Joint::RightCollar,
        Joint::RightShoulder,
        Joint::RightElbow,
        Joint::RightWrist,
    ),
);

/// 30 bones.
pub fn cmu_bones() -> Vec<Bone> {
    let mut bones = vec![
        (
            "lowerback",
            "root",
            Joint::Spine1,
            End::At(Joint::Spine2),
            "rx ry rz",
            [0.0; 3],
        ),
        (
            "upperback",
            "lowerback",
            Joint::Spine2,
            End::At(Joint::Spine3),
            "rx ry rz",
            [0.0; 3],
        ),
        (
            "thorax",
            "upperback",
            Joint::Spine3,
            End::At(Joint::Neck),
            "rx ry rz",
            [0.0; 3],
        ),
        (
            "lowerneck",
            "thorax",
            Joint::Neck,
            End::By([0.0, 0.05, 0.0]),
            "rx ry rz",
            [0.0; 3],
        ),
        (
            "upperneck",
            "lowerneck",
            Joint::Neck,
            End::At(Joint::Head),
            "",
            [0.0; 3],
        ),
        (
            "head",
            "upperneck",
            Joint::Head,
            End::By([0.0, 0.1, 0.0]),
            "rz ry rx",
            [0.0; 3],
        ),
    ];
    use Joint::Pelvis;
    for (names, side, (hip, knee, ankle, foot, collar, shoulder, elbow, wrist)) in [LEFT, RIGHT] {
        let n: Vec<&'static str> = names.split(' ').collect();
        let legs = [0.0, 0.0, 20.0 * side];
        bones.extend([
            (n[0], "root", Pelvis, End::At(hip), "", [0.0; 3]),
            (n[1], n[0], hip, End::At(knee), "rx ry rz", legs),
            (n[2], n[1], knee, End::At(ankle), "rx ry rz", legs),
            (
                n[3],
                n[2],
                ankle,
                End::At(foot),
                "rx ry rz",
                [-90.0, 10.0, 20.0 * side],
            ),
            (
                n[4],
                n[3],
                foot,
                End::By([0.0, 0.0, 0.06]),
                "rx ry rz",
                [-90.0, 0.0, 20.0 * side],
            ),
            (
                n[5],
                "thorax",
                collar,
                End::At(shoulder),
                "rx ry rz",
                [0.0; 3],
            ),
            (
                n[6],
                n[5],
                shoulder,
                End::At(elbow),
                "rx ry rz",
                [180.0, 30.0, 90.0 * side],
            ),
            (
                n[7],
                n[6],
                elbow,
                End::By([0.17 * side, 0.0, 0.0]),
                "rx ry rz",
                [180.0, 30.0, 90.0 * side],
            ),
            (
                n[8],
                n[7],
                elbow,
                End::At(wrist),
                "",
                [180.0, 30.0, 90.0 * side],
            ),
            (
                n[9],
                n[8],
                wrist,
                End::By([0.07 * side, 0.0, 0.0]),
                "rz rx ry",
                [-90.0, 0.0, 90.0 * side],
            ),
            (
                n[10],
                n[9],
                wrist,
                End::By([0.05 * side, 0.0, 0.0]),
                "",
                [-90.0, 0.0, 90.0 * side],
            ),
            (
                n[11],
                n[8],
                wrist,
                End::By([0.04 * side, 0.0, 0.05]),
                "",
                [-90.0, 0.0, 90.0 * side],
            ),
        ]);
    }
    bones
}

/// The skeleton and how it is written.
pub struct Acclaim<'a> {
    pub bones: Vec<Bone>,
    pub body: &'a ShapedBody,
    pub joint_shift: [Vector3<f64>; JOINT_COUNT],
    pub rest: Rotations,
    pub unit_m: f64,
    pub degrees: bool,
}

impl Acclaim<'_> {
    fn angle(&self, degrees: f64) -> f64 {
        if self.degrees {
            degrees
        } else {
            degrees.to_radians()
        }
    }

    fn rest_positions(&self) -> [Vector3<f64>; JOINT_COUNT] {
        let rotations = BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: self.rest,
        }
        .world_rotations();
        let joints: [Vector3<f64>; JOINT_COUNT] = std::array::from_fn(|joint| {
            self.body.joints_in_model()[joint] + self.joint_shift[joint]
        });
        let mut positions = joints;
        for joint in Joint::ALL {
            if let Some(parent) = joint.parent() {
                let (joint, parent) = (joint.index(), parent.index());
                positions[joint] =
                    positions[parent] + rotations[parent] * (joints[joint] - joints[parent]);
            }
        }
        positions
    }

    pub fn asf(&self) -> String {
        let positions = self.rest_positions();
        let rotations = BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: self.rest,
        }
        .world_rotations();
        let mut text = format!(
            "# look-alike\n:version 1.10\n:name TEST\n:units\n  mass 1.0\n  length 0.45\n  angle {}\n:documentation\n   two\n   lines\n\
             :root\n   order TX TY TZ RX RY RZ\n   axis XYZ\n   position 0 0 0\n   orientation 0 0 0\n:bonedata\n",
            if self.degrees { "deg" } else { "rad" }
        );
        let mut ends: Vec<(&str, Vector3<f64>)> = vec![("root", positions[0])];
        for (id, (name, parent, segment, end, freedoms, axis)) in self.bones.iter().enumerate() {
            let start = ends.iter().find(|(name, _)| name == parent).unwrap().1;
            let end = match end {
                End::At(joint) => positions[joint.index()],
                End::By(span) => start + rotations[segment.index()] * Vector3::from(*span),
            };
            ends.push((name, end));
            let span = (end - start) / self.unit_m;
            let direction = span.normalize();
            let axis = axis.map(|angle| self.angle(angle));
            writeln!(text, "  begin\n     id {}\n     name {name}", id + 1).unwrap();
            writeln!(
                text,
                "     direction {:.9} {:.9} {:.9}\n     length {:.9}",
                direction.x,
                direction.y,
                direction.z,
                span.norm()
            )
            .unwrap();
            writeln!(
                text,
                "     axis {:.9} {:.9} {:.9}  XYZ",
                axis[0], axis[1], axis[2]
            )
            .unwrap();
            if !freedoms.is_empty() {
                writeln!(text, "    dof {freedoms}\n    limits (-160.0 20.0)\n           (-70.0 inf)\n           (-60.0 70.0)").unwrap();
            }
            text += "  end\n";
        }
        text += ":hierarchy\n  begin\n";
        for (parent, _) in &ends {
            let children: Vec<&str> = self
                .bones
                .iter()
                .filter(|bone| bone.1 == *parent)
                .map(|bone| bone.0)
                .collect();
            if !children.is_empty() {
                writeln!(text, "    {parent} {}", children.join(" ")).unwrap();
            }
        }
        text + "  end\n"
    }

    pub fn amc(&self, frames: &[BodyPose], file_from_world: UnitQuaternion<f64>) -> String {
        let mut text = format!(
            "#!OML:ASF test.ASF\n:FULLY-SPECIFIED\n:{}\n",
            if self.degrees { "DEGREES" } else { "RADIANS" }
        );
        let rest = BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: self.rest,
        }
        .world_rotations();
        for (index, pose) in frames.iter().enumerate() {
            let world = pose.world_rotations();
            let own = |segment: Joint| {
                file_from_world * world[segment.index()] * rest[segment.index()].inverse()
            };
            let root = file_from_world * pose.root_position / self.unit_m;
            let turn = fixed_angles(&own(Joint::Pelvis), [0, 1, 2]).map(|angle| self.angle(angle));
            writeln!(
                text,
                "{}\nroot {:.7} {:.7} {:.7} {:.7} {:.7} {:.7}",
                index + 1,
                root.x,
                root.y,
                root.z,
                turn[0],
                turn[1],
                turn[2]
            )
            .unwrap();
            for (name, parent, segment, _, freedoms, axis) in
                self.bones.iter().filter(|bone| !bone.4.is_empty())
            {
                let parent = self
                    .bones
                    .iter()
                    .find(|bone| bone.0 == *parent)
                    .map_or(Joint::Pelvis, |bone| bone.2);
                let c = about(Vector3::z(), axis[2])
                    * about(Vector3::y(), axis[1])
                    * about(Vector3::x(), axis[0]);
                let turn = c.inverse() * own(parent).inverse() * own(*segment) * c;
                let order: Vec<usize> = freedoms
                    .split(' ')
                    .map(|word| "xyz".find(&word[1..]).unwrap())
                    .collect();
                let angles = fixed_angles(&turn, [order[0], order[1], order[2]])
                    .map(|angle| format!("{:.7}", self.angle(angle)));
                writeln!(text, "{name} {}", angles.join(" ")).unwrap();
            }
        }
        text
    }
}

/// Degrees about fixed axes, the first first: R = R_k R_j R_i.
fn fixed_angles(rotation: &UnitQuaternion<f64>, [i, j, k]: [usize; 3]) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let sign = if (j + 3 - i) % 3 == 1 { 1.0 } else { -1.0 };
    let middle = (-sign * r[(k, i)]).clamp(-1.0, 1.0).asin();
    [
        (sign * r[(k, j)]).atan2(r[(k, k)]),
        middle,
        (sign * r[(j, i)]).atan2(r[(i, i)]),
    ]
    .map(f64::to_degrees)
}
