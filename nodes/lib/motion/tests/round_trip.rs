//! A known SMPL motion, written in another skeleton and read back: rotations come back, roll
//! included.
#![allow(clippy::unwrap_used)]

mod common;

use common::export::{Bone, Exporter};
use common::known::{about, joint_shift, known_motion, rest, y_up};
use common::quantile;
use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_motion::{
    BvhClip, BvhJoint, MotionOptions, RetargetReport, SkeletonDraft, SkeletonMap, SmplMotion,
    parse_bvh, retarget,
};
use nalgebra::{UnitQuaternion, Vector3};

const MIXAMO: &str = "Hips::pelvis LeftUpLeg:Hips:left_hip LeftLeg:LeftUpLeg:left_knee LeftFoot:LeftLeg:left_ankle
    LeftToeBase:LeftFoot:left_foot RightUpLeg:Hips:right_hip RightLeg:RightUpLeg:right_knee RightFoot:RightLeg:right_ankle
    RightToeBase:RightFoot:right_foot Spine:Hips:spine1 Spine1:Spine:spine2 Spine2:Spine1:spine3 Neck:Spine2:neck Head:Neck:head
    LeftShoulder:Spine2:left_collar LeftArm:LeftShoulder:left_shoulder LeftForeArm:LeftArm:left_elbow LeftHand:LeftForeArm:left_wrist
    RightShoulder:Spine2:right_collar RightArm:RightShoulder:right_shoulder RightForeArm:RightArm:right_elbow
    RightHand:RightForeArm:right_wrist";
const CMU: &str = "Hips::pelvis LHipJoint:Hips:pelvis LeftUpLeg:LHipJoint:left_hip LeftLeg:LeftUpLeg:left_knee LeftFoot:LeftLeg:left_ankle
    LeftToeBase:LeftFoot:left_foot RHipJoint:Hips:pelvis RightUpLeg:RHipJoint:right_hip RightLeg:RightUpLeg:right_knee
    RightFoot:RightLeg:right_ankle RightToeBase:RightFoot:right_foot LowerBack:Hips:spine1 Spine:LowerBack:spine2 Spine1:Spine:spine3
    Neck:Spine1:neck Neck1:Neck:neck Head:Neck1:head LeftShoulder:Spine1:left_collar LeftArm:LeftShoulder:left_shoulder
    LeftForeArm:LeftArm:left_elbow LeftHand:LeftForeArm:left_wrist RightShoulder:Spine1:right_collar
    RightArm:RightShoulder:right_shoulder RightForeArm:RightArm:right_elbow RightHand:RightForeArm:right_wrist";
const DAZ: &str = "hip::pelvis abdomen:hip:spine2 chest:abdomen:spine3 neck:chest:neck head:neck:head rCollar:chest:right_collar
    rShldr:rCollar:right_shoulder rForeArm:rShldr:right_elbow rHand:rForeArm:right_wrist lCollar:chest:left_collar
    lShldr:lCollar:left_shoulder lForeArm:lShldr:left_elbow lHand:lForeArm:left_wrist rButtock:hip:pelvis rThigh:rButtock:right_hip
    rShin:rThigh:right_knee rFoot:rShin:right_ankle lButtock:hip:pelvis lThigh:lButtock:left_hip lShin:lThigh:left_knee
    lFoot:lShin:left_ankle";
const XSENS: &str = "Hips::pelvis Chest:Hips:spine1 Chest2:Chest:spine2 Chest3:Chest2:spine2 Chest4:Chest3:spine3 Neck:Chest4:neck
    Head:Neck:head RightCollar:Chest4:right_collar RightShoulder:RightCollar:right_shoulder RightElbow:RightShoulder:right_elbow
    RightWrist:RightElbow:right_wrist LeftCollar:Chest4:left_collar LeftShoulder:LeftCollar:left_shoulder
    LeftElbow:LeftShoulder:left_elbow LeftWrist:LeftElbow:left_wrist RightHip:Hips:right_hip RightKnee:RightHip:right_knee
    RightAnkle:RightKnee:right_ankle RightToe:RightAnkle:right_foot LeftHip:Hips:left_hip LeftKnee:LeftHip:left_knee
    LeftAnkle:LeftKnee:left_ankle LeftToe:LeftAnkle:left_foot";

/// Bones of a skeleton given as words NAME:PARENT:SEGMENT, all frames parallel to the body's axes.
fn bones(words: &'static str) -> Vec<Bone> {
    let bone = |word: &'static str| {
        let mut parts = word.split(':');
        let (name, parent, segment) = (
            parts.next().unwrap(),
            parts.next().unwrap(),
            parts.next().unwrap(),
        );
        Bone {
            name,
            parent,
            segment: Joint::from_name(segment).unwrap(),
            body_from_joint: UnitQuaternion::identity(),
        }
    };
    words.split_whitespace().map(bone).collect()
}

struct Errors {
    median_deg: f64,
    high_deg: f64,
    wrist_rate: f64,
    worst: (Joint, f64),
    report: RetargetReport,
    root_m: f64,
}

/// Writes the known motion by the exporter, reads it back and compares.
fn errors(exporter: &Exporter<'_>, known: &SmplMotion) -> Errors {
    let clip = parse_bvh(&exporter.write(&known.frames), "round trip").unwrap();
    let read = retarget(&clip, exporter.body.model(), &MotionOptions::default()).unwrap();
    let report = read.report.clone().unwrap();
    assert_eq!(read.frames.len(), known.frames.len(), "{report}");
    let mut all = Vec::new();
    let mut worst = (Joint::Pelvis, 0.0);
    for joint in Joint::ALL {
        let angle = |(a, b): (&BodyPose, &BodyPose)| {
            a.local_rotations[joint.index()]
                .angle_to(&b.local_rotations[joint.index()])
                .to_degrees()
        };
        let of_joint: Vec<f64> = read.frames.iter().zip(&known.frames).map(angle).collect();
        let high = quantile(&of_joint, 0.95);
        if high > worst.1 {
            worst = (joint, high);
        }
        all.extend(of_joint);
    }
    let shift = |(a, b): (&BodyPose, &BodyPose)| {
        let way = (a.root_position - read.frames[0].root_position)
            - (b.root_position - known.frames[0].root_position);
        way.norm()
    };
    Errors {
        median_deg: quantile(&all, 0.5),
        high_deg: quantile(&all, 0.95),
        wrist_rate: [Joint::LeftWrist, Joint::RightWrist]
            .map(|wrist| rate_error(&read, known, wrist))
            .into_iter()
            .fold(0.0, f64::max),
        worst,
        report,
        root_m: read
            .frames
            .iter()
            .zip(&known.frames)
            .map(shift)
            .fold(0.0, f64::max),
    }
}

/// Root mean square of the difference of angular velocities in segment axes, rad/s.
fn rate_error(read: &SmplMotion, known: &SmplMotion, joint: Joint) -> f64 {
    let rates = |motion: &SmplMotion| -> Vec<Vector3<f64>> {
        let rotations: Vec<_> = motion
            .frames
            .iter()
            .map(|pose| pose.world_rotations()[joint.index()])
            .collect();
        rotations
            .windows(2)
            .map(|pair| (pair[0].inverse() * pair[1]).scaled_axis() * motion.rate_hz)
            .collect()
    };
    let squares: Vec<f64> = rates(read)
        .iter()
        .zip(rates(known))
        .map(|(a, b)| (a - b).norm_squared())
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Checks the limits and prints what was measured.
fn check(name: &str, exporter: &Exporter<'_>, keeps_toes: bool, rest_from: &str) {
    let errors = errors(exporter, &known_motion(keeps_toes));
    println!(
        "{name}: median {:.3} deg, 95 % {:.3} deg (worst joint {} {:.2}), wrist {:.4} rad/s, root {:.4} m; {}",
        errors.median_deg,
        errors.high_deg,
        errors.worst.0,
        errors.worst.1,
        errors.wrist_rate,
        errors.root_m,
        errors.report
    );
    assert_eq!(errors.report.rest, rest_from, "{name}");
    assert_eq!(
        errors.report.frames_left_out, exporter.leading_rest_frames,
        "{name}"
    );
    assert!(
        (errors.report.unit_scale_m / exporter.unit_m - 1.0).abs() < 1e-9,
        "{name}: {}",
        errors.report
    );
    assert!(
        errors.median_deg < 2.0 && errors.high_deg < 5.0,
        "{name}: {} {}",
        errors.median_deg,
        errors.high_deg
    );
    assert!(
        errors.wrist_rate < 0.1,
        "{name}: {} rad/s",
        errors.wrist_rate
    );
    assert!(
        errors.report.bone_direction_median_deg < 1.0,
        "{name}: {}",
        errors.report
    );
    assert!(
        errors.root_m < 0.1,
        "{name}: root off by {} m",
        errors.root_m
    );
}

fn body() -> ShapedBody {
    ShapedBody::new(BodyModel::embedded(), &[0.9, -0.4, 0.6, 0.5, -0.7, 0.8]).unwrap()
}

fn exporter<'a>(body: &'a ShapedBody, words: &'static str) -> Exporter<'a> {
    Exporter {
        bones: bones(words),
        prefix: "",
        rest: rest(0.0, 0.0, 0.0, 0.0),
        body,
        joint_shift: joint_shift(),
        unit_m: 0.01,
        file_from_world: y_up(),
        order: [2, 0, 1],
        leading_rest_frames: 0,
        rate_hz: 100.0,
    }
}

#[test]
fn cmu_with_splayed_legs_and_a_leading_t_pose() {
    let body = body();
    let unit_m = 0.0254 / 0.45;
    let exporter = Exporter {
        rest: rest(0.0, 0.0, 20.0, 0.0),
        unit_m,
        order: [2, 1, 0],
        leading_rest_frames: 1,
        ..exporter(&body, CMU)
    };
    check("cmu", &exporter, true, "zero pose");
}

#[test]
fn daz_with_forearms_forward() {
    let body = body();
    let exporter = Exporter {
        rest: rest(3.0, 17.0, 0.0, 0.0),
        leading_rest_frames: 1,
        ..exporter(&body, DAZ)
    };
    check("daz", &exporter, false, "zero pose");
}

/// Every bone along x, as in the data set: the legs' z axis to the right, the arms' z axis up on
/// the left and down on the right.
#[test]
fn lafan1_with_bones_along_x() {
    let body = body();
    let mut exporter = Exporter {
        order: [2, 1, 0],
        ..exporter(&body, MIXAMO)
    };
    for bone in &mut exporter.bones {
        bone.name = match bone.name {
            "LeftToeBase" => "LeftToe",
            "RightToeBase" => "RightToe",
            other => other,
        };
        // Turned by hand from the body's axes: x about z to up or down, then about the bone.
        let (up, down) = (about(Vector3::z(), 90.0), about(Vector3::z(), -90.0));
        bone.body_from_joint = match bone.segment.name() {
            "left_hip" | "right_hip" | "left_knee" | "right_knee" => {
                down * about(Vector3::x(), 90.0)
            }
            "left_ankle" | "right_ankle" => about(Vector3::x(), 21.45) * about(Vector3::y(), -90.0),
            "left_foot" | "right_foot" => about(Vector3::y(), -90.0),
            "left_collar" | "left_shoulder" | "left_elbow" | "left_wrist" => {
                about(Vector3::x(), -90.0)
            }
            "right_collar" | "right_shoulder" | "right_elbow" | "right_wrist" => {
                about(Vector3::z(), 180.0) * about(Vector3::x(), -90.0)
            }
            _ => up * about(Vector3::x(), 90.0),
        };
    }
    check("lafan1", &exporter, true, "map");
}

#[test]
fn mixamo_in_an_a_pose() {
    let body = body();
    let exporter = Exporter {
        prefix: "mixamorig:",
        rest: rest(45.0, 5.0, 8.0, 8.0),
        ..exporter(&body, MIXAMO)
    };
    check("mixamo, A-pose", &exporter, true, "zero pose");
}

/// Frames with y along the bone and rolled at will: the zero pose is a heap, the first frame shows
/// the T-pose.
#[test]
fn mixamo_with_rolled_frames_and_a_t_pose_frame() {
    let body = body();
    let mut exporter = Exporter {
        prefix: "mixamorig:",
        leading_rest_frames: 3,
        unit_m: 1.0,
        ..exporter(&body, MIXAMO)
    };
    for (index, bone) in exporter.bones.iter_mut().enumerate() {
        let child = bone.segment.children().next().unwrap_or(bone.segment);
        let along =
            body.joints_in_model()[child.index()] - body.joints_in_model()[bone.segment.index()];
        let to_bone = UnitQuaternion::rotation_between(&Vector3::y(), &along)
            .unwrap_or_else(|| about(Vector3::x(), 180.0));
        bone.body_from_joint = to_bone * about(Vector3::y(), 40.0 * index as f64);
    }
    check("mixamo, rolled", &exporter, true, "frame 0");
}

/// The zero pose looks like a T-pose, but the limbs' frames are rolled about their bones; only the
/// T-pose frame tells.
#[test]
fn mixamo_rolled_about_its_bones() {
    let body = body();
    let mut exporter = Exporter {
        leading_rest_frames: 1,
        ..exporter(&body, MIXAMO)
    };
    for bone in &mut exporter.bones {
        if bone.name.ends_with("Arm") || bone.name.ends_with("Hand") {
            bone.body_from_joint = about(Vector3::x(), 90.0);
        }
    }
    check("mixamo, rolled about its bones", &exporter, true, "frame 0");
}

#[test]
fn xsens_with_z_up() {
    let body = body();
    let mut exporter = Exporter {
        file_from_world: UnitQuaternion::identity(),
        order: [1, 0, 2],
        unit_m: 0.01,
        leading_rest_frames: 2,
        ..exporter(&body, XSENS)
    };
    for bone in &mut exporter.bones {
        // The zero pose stands in the file's axes, z up and facing -y.
        bone.body_from_joint = about(Vector3::x(), -90.0);
    }
    check("xsens, z up", &exporter, true, "zero pose");
}

/// A draft finds by the tree alone, and by the names, which joint is which.
#[test]
fn drafts_find_the_joints_of_known_skeletons() {
    let body = body();
    for (name, words, map) in [
        ("cmu", CMU, include_str!("../maps/cmu.yaml")),
        ("daz", DAZ, include_str!("../maps/daz.yaml")),
        ("mixamo", MIXAMO, include_str!("../maps/mixamo.yaml")),
    ] {
        let text = exporter(&body, words).write(&known_motion(true).frames);
        let clip = parse_bvh(&text, name).unwrap();
        for anonymous in [false, true] {
            let own = |index: usize, known: &str| {
                if anonymous {
                    format!("bone{index}")
                } else {
                    known.to_owned()
                }
            };
            let joints = clip.joints().iter().enumerate();
            let joints = joints.map(|(index, joint)| BvhJoint {
                name: own(index, &joint.name),
                ..joint.clone()
            });
            let values = (0..clip.frame_count()).flat_map(|index| clip.frame(index).to_vec());
            let time = clip.frame_time_s();
            let renamed = BvhClip::from_parts(name, joints.collect(), time, values.collect());
            let draft = SkeletonDraft::of(&renamed, "draft").unwrap();
            assert!(draft.missing.is_empty(), "{name}: {}", draft.yaml);
            assert!(SkeletonMap::from_yaml(&draft.yaml, "draft.yaml").is_ok());
            let mut wrong = Vec::new();
            for joint in Joint::ALL {
                let line = |known: &&str| known.starts_with(&format!("  {joint}: "));
                let Some(line) = map.lines().find(line) else {
                    continue;
                };
                let known = line.split(": ").nth(1).unwrap();
                let place = |it: &BvhJoint| it.name == known;
                let Some(index) = clip.joints().iter().position(place) else {
                    continue;
                };
                if !draft
                    .yaml
                    .contains(&format!("  {joint}: {}\n", own(index, known)))
                {
                    wrong.push(joint);
                }
            }
            // How many joints of a neck or a spine there are, a tree does not tell.
            let expected = [Joint::Spine1, Joint::Spine2, Joint::Neck, Joint::Head];
            assert!(
                wrong.iter().all(|joint| expected.contains(joint)) && wrong.len() <= 1,
                "{name}, anonymous {anonymous}: {wrong:?}\n{}",
                draft.yaml
            );
        }
    }
}
