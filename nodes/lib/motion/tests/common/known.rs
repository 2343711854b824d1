//! A known motion, and skeletons that it is written in.

use cromosim_body::{JOINT_COUNT, Joint};
use cromosim_motion::{SmplMotion, embedded_walk};
use nalgebra::{UnitQuaternion, Vector3};

pub type Rotations = [UnitQuaternion<f64>; JOINT_COUNT];

pub fn about(axis: Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * degrees.to_radians())
}

pub fn side(joint: Joint) -> f64 {
    if joint.name().starts_with("left") {
        1.0
    } else {
        -1.0
    }
}

/// A rest pose: arms lowered, elbows turned forward, legs splayed, ankles turned back (all
/// degrees).
pub fn rest(arms_down: f64, elbows: f64, splay: f64, ankles: f64) -> Rotations {
    let mut rotations = [UnitQuaternion::identity(); JOINT_COUNT];
    for joint in Joint::ALL {
        rotations[joint.index()] = match joint
            .name()
            .trim_start_matches("left_")
            .trim_start_matches("right_")
        {
            "shoulder" => about(Vector3::z(), -side(joint) * arms_down),
            "elbow" => about(Vector3::y(), -side(joint) * elbows),
            "hip" => about(Vector3::z(), side(joint) * splay),
            "ankle" => about(Vector3::z(), -side(joint) * ankles),
            _ => UnitQuaternion::identity(),
        };
    }
    rotations
}

/// The embedded walk with every joint that `keeps_toes` allows moved and twisted further: smooth
/// turns about changing axes, up to 20 degrees and 1.3 Hz. The spine's joints move together, as
/// skeletons with a shorter spine can tell.
pub fn known_motion(keeps_toes: bool) -> SmplMotion {
    let mut motion = embedded_walk();
    let rate_hz = motion.rate_hz;
    for (index, pose) in motion.frames.iter_mut().enumerate() {
        let time = index as f64 / rate_hz;
        for joint in Joint::ALL {
            let toes = matches!(joint, Joint::LeftFoot | Joint::RightFoot);
            if toes && !keeps_toes {
                pose.local_rotations[joint.index()] = UnitQuaternion::identity();
            }
            if toes || matches!(joint, Joint::LeftHand | Joint::RightHand) {
                continue;
            }
            let (number, size) = if joint.name().starts_with("spine") {
                (3.0, 0.06)
            } else {
                (
                    joint.index() as f64,
                    if joint == Joint::Pelvis { 0.1 } else { 0.2 },
                )
            };
            let wave = |axis: f64| {
                ((1.5 + 0.3 * number + 1.1 * axis).min(8.0) * time + number + 2.0 * axis).sin()
            };
            let extra = UnitQuaternion::from_scaled_axis(
                Vector3::new(wave(0.0), wave(1.0), wave(2.0)) * size,
            );
            pose.local_rotations[joint.index()] *= extra;
        }
    }
    motion
}

/// Shifts of 2 mm each way that make the skeleton nobody's body, the same on both sides of it.
pub fn joint_shift() -> [Vector3<f64>; JOINT_COUNT] {
    std::array::from_fn(|index| {
        let joint = Joint::ALL[index];
        let number = index.min(joint.mirrored().index()) as f64;
        let middle = joint == joint.mirrored();
        let mirror = if middle {
            0.0
        } else if index < joint.mirrored().index() {
            1.0
        } else {
            -1.0
        };
        Vector3::new(
            mirror * (3.0 * number).sin(),
            (5.0 * number).sin(),
            (7.0 * number).sin(),
        ) * 0.002
    })
}

pub fn y_up() -> UnitQuaternion<f64> {
    about(Vector3::x(), -90.0)
}
