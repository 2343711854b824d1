//! Writes a motion as BVH in SMPL's own skeleton.

use std::fmt::Write;

use cromosim_body::{Joint, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

use crate::SmplMotion;

const UNITS_PER_METRE: f64 = 100.0;
/// Order of the rotation channels: about z, then x, then y.
const ORDER: [usize; 3] = [2, 0, 1];
/// From a joint without children to the end of its bone, m.
const TIP_M: f64 = 0.08;

/// The motion as BVH: SMPL's 24 joints by their names, T-pose at rest with every joint parallel to
/// the file's axes, centimetres, y up (file = Rx(-90 degrees) world), Euler angles in degrees about
/// z, x, y. `shaped` is the body of the motion's betas: its bones. Angles have six decimals,
/// lengths micrometres.
pub fn write_bvh(motion: &SmplMotion, shaped: &ShapedBody) -> String {
    let mut text = "HIERARCHY\n".to_owned();
    let mut order = Vec::new();
    write_joint(&mut text, Joint::Pelvis, 0, shaped, &mut order);
    let _ = writeln!(
        text,
        "MOTION\nFrames: {}\nFrame Time: {}",
        motion.frames.len(),
        motion.rate_hz.recip()
    );
    let file_from_world =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    for pose in &motion.frames {
        let root = file_from_world * pose.root_position * UNITS_PER_METRE;
        let _ = write!(text, "{:.4} {:.4} {:.4}", root.x, root.y, root.z);
        for joint in &order {
            let local = pose.local_rotations[joint.index()];
            let [z, x, y] = euler_degrees(&if *joint == Joint::Pelvis {
                file_from_world * local
            } else {
                local
            });
            let _ = write!(text, " {z:.6} {x:.6} {y:.6}");
        }
        text.push('\n');
    }
    text
}

/// A joint and those beyond it; SMPL's tree is nine levels deep.
fn write_joint(
    text: &mut String,
    joint: Joint,
    depth: usize,
    shaped: &ShapedBody,
    order: &mut Vec<Joint>,
) {
    order.push(joint);
    let (joints, indent) = (shaped.joints_in_model(), "  ".repeat(depth));
    let parent = joint.parent();
    let offset = parent.map_or_else(Vector3::zeros, |parent| {
        joints[joint.index()] - joints[parent.index()]
    }) * UNITS_PER_METRE;
    let (keyword, channels) = if parent.is_some() {
        ("JOINT", "3")
    } else {
        ("ROOT", "6 Xposition Yposition Zposition")
    };
    let _ = writeln!(
        text,
        "{indent}{keyword} {joint}\n{indent}{{\n{indent}  OFFSET {:.4} {:.4} {:.4}",
        offset.x, offset.y, offset.z
    );
    let _ = writeln!(
        text,
        "{indent}  CHANNELS {channels} Zrotation Xrotation Yrotation"
    );
    for child in joint.children() {
        write_joint(text, child, depth + 1, shaped, order);
    }
    if joint.children().next().is_none() {
        let arrival =
            offset.try_normalize(1e-9).unwrap_or_else(Vector3::y) * (TIP_M * UNITS_PER_METRE);
        let _ = writeln!(
            text,
            "{indent}  End Site\n{indent}  {{\n{indent}    OFFSET {:.4} {:.4} {:.4}",
            arrival.x, arrival.y, arrival.z
        );
        let _ = writeln!(text, "{indent}  }}");
    }
    let _ = writeln!(text, "{indent}}}");
}

/// Angles whose rotations about the axes of [`ORDER`], in that order, multiply to the rotation.
fn euler_degrees(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let ([i, j, k], r) = (ORDER, rotation.to_rotation_matrix());
    // z, x, y follow each other cyclically, so that the signs are those of x, y, z.
    [
        (-r[(j, k)]).atan2(r[(k, k)]),
        r[(i, k)].clamp(-1.0, 1.0).asin(),
        (-r[(i, j)]).atan2(r[(i, i)]),
    ]
    .map(f64::to_degrees)
}
