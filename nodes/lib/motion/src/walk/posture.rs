//! The body over the feet: pelvis, trunk, head and arms.

use std::f64::consts::TAU;

use cromosim_body::{BodyPose, JOINT_COUNT, Joint};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::feet::{FootState, STEP_LENGTH, STEP_S};
use super::leg::LegBones;
use super::plan::{Plan, SIDES};
use super::smooth::{bump, mean_around, plateau, smooth_step};
use crate::motion::slerp;

type Joints = [Vector3<f64>; JOINT_COUNT];

/// Height of the pelvis joint over the floor when standing, m, and how far it sinks in the middle
/// of a walking step's double support.
const STANDING_HEIGHT: f64 = 0.980;
const WALKING_SINK: f64 = 0.010;
const STEP_SINK: f64 = 0.046;

/// Part of a leg's length that is used, so that no knee is ever stretched.
const LONGEST_LEG: f64 = 0.998;
/// When the walk begins and ends, s.
const WALKING_S: [f64; 2] = [0.60, 5.10];
/// When the right arm goes out and comes back, s.
const REACH_S: [f64; 2] = [6.15, 7.45];
const REACH_RISE_S: f64 = 1.0;

/// How the gait stands at one time.
struct Gait {
    /// Left foot ahead of the right one in step lengths, -1 to 1.
    stride: f64,
    /// Support on the left foot +1, on the right -1.
    support: f64,
    /// Double support of a walking step, 0 to 1.
    sink: f64,
    /// 0 standing, 1 walking.
    walking: f64,
    heading: f64,
    reach: f64,
}

/// The pose at a time.
pub(super) fn pose(plan: &Plan, joints: &Joints, time: f64) -> BodyPose {
    let gait = Gait::at(plan, time);
    let mut local = [UnitQuaternion::identity(); JOINT_COUNT];
    let pelvis = pelvis_frame(&gait);
    let root_position = root_position(plan, joints, time);
    local[Joint::Pelvis.index()] = pelvis;
    trunk(&gait, time, plan, &mut local, pelvis);
    arms(plan, &gait, time, &mut local);
    for (foot, side) in plan.feet.iter().zip(Side::BOTH) {
        leg(
            &side,
            &foot.at(time),
            joints,
            root_position,
            pelvis,
            gait.heading,
            &mut local,
        );
    }
    BodyPose {
        root_position,
        local_rotations: local,
    }
}

impl Gait {
    fn at(plan: &Plan, time: f64) -> Self {
        let stride = |time: f64| {
            mean_around::<16, _>(time, 0.24, |time| {
                let feet = [0, 1].map(|side| plan.feet[side].at(time));
                let between = feet[0].ankle - feet[1].ankle;
                let heading = (feet[0].heading + feet[1].heading) / 2.0;
                (between.x * heading.cos() + between.y * heading.sin()) / STEP_LENGTH
            })
        };
        let (mut support, mut sink) = (0.0, 0.0);
        for (side, step) in plan.steps() {
            support -= side
                * step.vigour.sqrt()
                * plateau(time, step.off_s() - 0.02, step.strike_s + 0.02, 0.26);
            if step.vigour > 0.5 {
                sink += step.vigour * bump((time - step.strike_s - 0.03) / 0.38);
            }
        }
        let rise = |at: f64| smooth_step((time - at) / REACH_RISE_S + 0.5);
        Self {
            stride: stride(time),
            support,
            sink,
            walking: plateau(time, WALKING_S[0], WALKING_S[1], 1.0),
            heading: heading(plan, time),
            reach: rise(REACH_S[0]) - rise(REACH_S[1]),
        }
    }
}

/// The mean heading of the feet, smoothed, rad.
fn heading(plan: &Plan, time: f64) -> f64 {
    mean_around::<16, _>(time, 0.6, |time| {
        (plan.feet[0].at(time).heading + plan.feet[1].at(time).heading) / 2.0
    })
}

fn pelvis_frame(gait: &Gait) -> UnitQuaternion<f64> {
    heading_frame(gait.heading)
        * turned(
            -4.0 * gait.stride,
            2.0 + 1.5 * gait.walking,
            3.5 * gait.support,
        )
}

/// Over the middle of the feet, smoothed over one step: at an even speed in the steady walk. As
/// high as posture and legs allow.
fn root_position(plan: &Plan, joints: &Joints, time: f64) -> Vector3<f64> {
    let mut position = level_root_position(plan, &Gait::at(plan, time), time);
    position.z = mean_around::<6, _>(time, 0.1, |time| root_height(plan, joints, time));
    position
}

fn level_root_position(plan: &Plan, gait: &Gait, time: f64) -> Vector3<f64> {
    let middle = mean_around::<16, _>(time, STEP_S, |time| {
        (plan.feet[0].at(time).ankle + plan.feet[1].at(time).ankle) / 2.0
    });
    let forward = 0.012 + 0.042 * gait.walking + 0.02 * gait.reach;
    let left = 0.022 * gait.support + 0.004 * (0.9 * time).sin() * (1.0 - gait.walking);
    let (sine, cosine) = gait.heading.sin_cos();
    Vector3::new(
        middle.x + cosine * forward - sine * left,
        middle.y + sine * forward + cosine * left,
        0.0,
    )
}

/// The smooth minimum of the posture's height and of the heights up to which each leg reaches its
/// ankle.
fn root_height(plan: &Plan, joints: &Joints, time: f64) -> f64 {
    let gait = Gait::at(plan, time);
    let softness = 0.005 + 0.011 * gait.walking;
    let level = level_root_position(plan, &gait, time);
    let pelvis = pelvis_frame(&gait);
    let wanted = STANDING_HEIGHT - WALKING_SINK * gait.walking - STEP_SINK * gait.sink;
    let mut sum = 1.0;
    for (foot, side) in plan.feet.iter().zip(Side::BOTH) {
        let hip = pelvis * (joints[side.hip.index()] - joints[Joint::Pelvis.index()]);
        let to_ankle = foot.at(time).ankle - level - hip;
        let bone = |from: Joint, to: Joint| (joints[to.index()] - joints[from.index()]).norm();
        let length = (bone(side.hip, side.knee) + bone(side.knee, side.ankle)) * LONGEST_LEG;
        let reachable = to_ankle.z
            + (length * length - to_ankle.xy().norm_squared())
                .max(0.0)
                .sqrt();
        sum += ((wanted - reachable) / softness).exp();
    }
    wanted - softness * sum.ln()
}

/// Spine, neck and head: the chest turns against the pelvis and stays level, the head looks ahead.
fn trunk(
    gait: &Gait,
    time: f64,
    plan: &Plan,
    local: &mut [UnitQuaternion<f64>; JOINT_COUNT],
    pelvis: UnitQuaternion<f64>,
) {
    let breath = 0.5 * (TAU * 0.27 * time).sin();
    let yaw = 9.0 * gait.stride + 11.0 * gait.reach;
    let lean = 1.0 + 8.0 * gait.reach + breath;
    let part = turned(yaw / 3.0, lean / 3.0, -3.0 * gait.support / 3.0);
    for joint in [Joint::Spine1, Joint::Spine2, Joint::Spine3] {
        local[joint.index()] = part;
    }
    let chest = pelvis * part * part * part;
    // The eyes lead into a turn, and follow the hand when it reaches.
    let head = heading_frame(heading(plan, time + 0.25))
        * turned(
            -4.0 * gait.reach,
            4.0 + 5.0 * gait.reach - 0.6 * breath,
            0.0,
        );
    let neck = slerp(&chest, &head, 0.5);
    local[Joint::Neck.index()] = chest.inverse() * neck;
    local[Joint::Head.index()] = neck.inverse() * head;
}

/// Arms hang, swing against the legs with bent elbows, and the right one reaches forward to
/// shoulder height.
fn arms(plan: &Plan, gait: &Gait, time: f64, local: &mut [UnitQuaternion<f64>; JOINT_COUNT]) {
    let delayed = Gait::at(plan, time - 0.03);
    for side in Side::BOTH {
        let swing = -side.sign * delayed.stride;
        let forward = 4.0 + 21.0 * swing + 3.0 * swing * swing * gait.walking;
        let bend = 17.0 + 6.0 * gait.walking + 9.0 * swing;
        let hanging = about(Vector3::x(), -forward)
            * about(Vector3::z(), -side.sign * 73.0)
            * about(Vector3::x(), 12.0);
        let reach = if side.sign < 0.0 { gait.reach } else { 0.0 };
        let reaching = about(Vector3::x(), -6.0)
            * about(Vector3::y(), -side.sign * 72.0)
            * about(Vector3::x(), -20.0);
        local[side.shoulder.index()] = slerp(&hanging, &reaching, reach);
        local[side.collar.index()] = about(Vector3::z(), -side.sign * (6.0 - 9.0 * reach))
            * about(Vector3::y(), -side.sign * 10.0 * reach);
        let elbow = bend + 4.0 * reach + 150.0 * reach * reach * (1.0 - reach) * (1.0 - reach);
        local[side.elbow.index()] =
            about(Vector3::y(), -side.sign * elbow) * about(Vector3::x(), 8.0 + 4.0 * swing);
        local[side.wrist.index()] = about(Vector3::z(), -side.sign * (4.0 * swing - 12.0 * reach));
    }
}

fn leg(
    side: &Side,
    foot: &FootState,
    joints: &Joints,
    root_position: Vector3<f64>,
    pelvis: UnitQuaternion<f64>,
    heading: f64,
    local: &mut [UnitQuaternion<f64>; JOINT_COUNT],
) {
    let bone = |from: Joint, to: Joint| joints[to.index()] - joints[from.index()];
    let bones = LegBones {
        thigh: bone(side.hip, side.knee),
        shin: bone(side.knee, side.ankle),
    };
    let hip = root_position + pelvis * bone(Joint::Pelvis, side.hip);
    let hinge = heading_frame(0.6 * heading + 0.4 * foot.heading) * Vector3::x();
    let [thigh, shin] = bones.reach(foot.ankle - hip, hinge);
    let sole = heading_frame(foot.heading)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -foot.pitch);
    local[side.hip.index()] = pelvis.inverse() * thigh;
    local[side.knee.index()] = thigh.inverse() * shin;
    local[side.ankle.index()] = shin.inverse() * sole;
    local[side.foot.index()] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), foot.toes);
}

/// The joints of one side of the body.
struct Side {
    /// +1 left, -1 right.
    sign: f64,
    collar: Joint,
    shoulder: Joint,
    elbow: Joint,
    wrist: Joint,
    hip: Joint,
    knee: Joint,
    ankle: Joint,
    foot: Joint,
}

impl Side {
    const BOTH: [Self; 2] = [
        Self {
            sign: SIDES[0],
            collar: Joint::LeftCollar,
            shoulder: Joint::LeftShoulder,
            elbow: Joint::LeftElbow,
            wrist: Joint::LeftWrist,
            hip: Joint::LeftHip,
            knee: Joint::LeftKnee,
            ankle: Joint::LeftAnkle,
            foot: Joint::LeftFoot,
        },
        Self {
            sign: SIDES[1],
            collar: Joint::RightCollar,
            shoulder: Joint::RightShoulder,
            elbow: Joint::RightElbow,
            wrist: Joint::RightWrist,
            hip: Joint::RightHip,
            knee: Joint::RightKnee,
            ankle: Joint::RightAnkle,
            foot: Joint::RightFoot,
        },
    ];
}

/// world_from_segment of an upright segment with a heading (rad, from x): x left, y up, z forward.
fn heading_frame(heading: f64) -> UnitQuaternion<f64> {
    let upright = Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()]);
    let world_from_upright =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(upright));
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * world_from_upright
}

/// Yaw to the left, then lean forward, then raising the left side; degrees.
fn turned(yaw: f64, lean: f64, roll: f64) -> UnitQuaternion<f64> {
    about(Vector3::y(), yaw) * about(Vector3::x(), lean) * about(Vector3::z(), roll)
}

/// Degrees about an axis of length 1.
fn about(axis: Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * degrees.to_radians())
}
