//! Writes a motion as BVH in SMPL's own skeleton.

use std::fmt::Write;

use cromosim_body::{Joint, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

use crate::SmplMotion;

const UNITS_PER_METRE: f64 = 100.0;
/// Order of the rotation channels: about z, then x, then y.
const ORDER: [usize; 3] = [2, 0, 1];
/// A middle angle whose sine is larger is a right angle: its cosine, 4e-7, is all that the others would
/// be told by.
const RIGHT_ANGLE: f64 = 1.0 - 1e-13;
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
            let [z, x, y] = zxy_degrees(&if *joint == Joint::Pelvis {
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

/// Angles whose rotations about the axes of [`ORDER`], in that order, multiply to the rotation. Where the
/// middle one is a right angle, the others turn about the same axis, and the first does it all.
pub(crate) fn zxy_degrees(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let ([i, j, k], r) = (ORDER, rotation.to_rotation_matrix());
    let middle = r[(i, k)].clamp(-1.0, 1.0).asin();
    let outer = if r[(i, k)].abs() < RIGHT_ANGLE {
        // z, x, y follow each other cyclically, so that the signs are those of x, y, z.
        [(-r[(j, k)]).atan2(r[(k, k)]), (-r[(i, j)]).atan2(r[(i, i)])]
    } else {
        [r[(k, j)].atan2(r[(j, j)]), 0.0]
    };
    [outer[0], middle, outer[1]].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn angles_give_the_rotation_again() {
        let axes = ORDER.map(|axis| Vector3::ith(axis, 1.0));
        let turned = |angles: [f64; 3]| {
            let turns = angles.iter().zip(axes);
            turns
                .map(|(angle, axis)| UnitQuaternion::from_scaled_axis(axis * *angle))
                .fold(UnitQuaternion::identity(), |product, turn| product * turn)
        };
        for angles in [
            [0.3, -0.9, 2.0],
            [-3.0, 1.2, 0.1],
            [0.0, 0.0, 0.0],
            [0.4, FRAC_PI_2, 0.7],
            [1.0, -FRAC_PI_2, 0.2],
            [0.4, FRAC_PI_2 - 1e-6, 0.7],
            [2.4, 1e-7 - FRAC_PI_2, -0.7],
        ] {
            let rotation = turned(angles);
            let again = turned(zxy_degrees(&rotation).map(f64::to_radians));
            let off = again.angle_to(&rotation);
            assert!(off < 1e-6, "{angles:?}: {off}");
        }
    }
}
