//! The embedded motion: a walk with arm swing, a reach and a turn, made by formulas.
//!
//! Footprints and foot roll are planned ([`plan`], [`feet`]); the pelvis follows the feet, trunk
//! and arms follow the stride ([`posture`]), and each leg is solved between hip and ankle
//! ([`leg`]). Every angle is a function of time with continuous accelerations.

mod feet;
mod leg;
mod plan;
mod posture;
mod smooth;

use std::sync::OnceLock;

use cromosim_body::{BodyModel, Gender, Joint};
use nalgebra::{Vector2, Vector3};

use crate::SmplMotion;
use crate::motion::continuous;
use feet::FootSize;
use plan::Plan;

/// Frames per second of the embedded motion, Hz.
const RATE_HZ: f64 = 100.0;
/// Frames of the embedded motion: 10 s from the first to the last.
const FRAMES: usize = 1001;

/// Ten seconds of the embedded body at 100 Hz: it stands, walks 5 m along the world's x axis (0.65
/// m a step, 1.8 steps a second), stops, reaches out with the right arm, turns a quarter to the
/// left and stands. The floor is z = 0. The same every time.
pub fn embedded_walk() -> SmplMotion {
    static WALK: OnceLock<SmplMotion> = OnceLock::new();
    WALK.get_or_init(make).clone()
}

fn make() -> SmplMotion {
    let body = BodyModel::embedded();
    let (joints, _) = body.joint_shape_directions();
    let lowest = body
        .template()
        .iter()
        .map(|vertex| vertex.y)
        .fold(f64::MAX, f64::min);
    let size = |ankle: Joint, ball: Joint, side: f64| {
        let (ankle, ball) = (joints[ankle.index()], joints[ball.index()]);
        let heel = body
            .template()
            .iter()
            .filter(|vertex| vertex.x * side > 0.0 && vertex.y < lowest + 0.006)
            .map(|vertex| vertex.z);
        let heel = Vector3::new(0.0, lowest, heel.fold(f64::MAX, f64::min));
        let sagittal = |vector: Vector3<f64>| Vector2::new(vector.z, vector.y);
        FootSize {
            ankle_height: ankle.y - lowest,
            ankle_from_ball: sagittal(ankle - ball),
            ankle_from_heel: sagittal(ankle - heel),
        }
    };
    let plan = Plan::new([
        size(Joint::LeftAnkle, Joint::LeftFoot, 1.0),
        size(Joint::RightAnkle, Joint::RightFoot, -1.0),
    ]);
    let frames = (0..FRAMES)
        .map(|frame| posture::pose(&plan, &joints, frame as f64 / RATE_HZ))
        .collect();
    SmplMotion {
        name: "embedded walk".to_owned(),
        rate_hz: RATE_HZ,
        gender: body.gender().unwrap_or(Gender::Neutral),
        betas: vec![0.0; body.beta_count()],
        shape_space: body.shape_space(),
        frames: continuous(frames),
        confidence: None,
        report: None,
        markers: None,
        poses: None,
    }
}
