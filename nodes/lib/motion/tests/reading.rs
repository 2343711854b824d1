//! From files to motions: what is found out, what is asked for, and what goes wrong.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use common::own_file;
use cromosim_body::BodyModel;
use cromosim_motion::{
    MotionError, MotionOptions, RestChoice, SkeletonDraft, SkeletonMap, UpAxis, embedded_walk,
    parse_bvh, read_motion, retarget,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A T-pose in Xsens names, 1.7 m in centimetres, y up, two frames that move apart.
fn xsens() -> String {
    let mut text =
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation\n".to_owned();
    let mut chain = |bones: &[(&str, [f64; 3])]| {
        for (name, [x, y, z]) in bones {
            text += &format!(
                "JOINT {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS 3 Yrotation Xrotation Zrotation\n"
            );
        }
        text += "End Site\n{\nOFFSET 0 0 10\n}\n";
        text += &"}\n".repeat(bones.len());
    };
    for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
        let name = |part: &str| format!("{side}{part}");
        let (hip, knee, ankle, toe) = (name("Hip"), name("Knee"), name("Ankle"), name("Toe"));
        chain(&[
            (&hip, [9.0 * sign, -7.0, 0.0]),
            (&knee, [0.0, -42.0, 0.0]),
            (&ankle, [0.0, -42.0, 0.0]),
            (&toe, [0.0, -5.0, 12.0]),
        ]);
    }
    for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
        let name = |part: &str| format!("{side}{part}");
        let (collar, shoulder, elbow, wrist) = (
            name("Collar"),
            name("Shoulder"),
            name("Elbow"),
            name("Wrist"),
        );
        let spine = [("Chest", [0.0, 10.0, 0.0]), ("Chest4", [0.0, 28.0, 0.0])];
        let spine: &[(&str, [f64; 3])] = if sign > 0.0 {
            &spine
        } else {
            &[("Chest4b", [0.0, 38.0, 0.0])]
        };
        let arm = [
            (collar.as_str(), [5.0 * sign, 8.0, 0.0]),
            (shoulder.as_str(), [13.0 * sign, 0.0, 0.0]),
            (elbow.as_str(), [28.0 * sign, 0.0, 0.0]),
            (wrist.as_str(), [26.0 * sign, 0.0, 0.0]),
        ];
        chain(&[spine, &arm[..]].concat());
    }
    chain(&[("Neck", [0.0, 53.0, 0.0]), ("Head", [0.0, 9.0, 0.0])]);
    let zeros = " 0".repeat(3 * (8 + 6 + 5 + 2));
    text + &format!(
        "}}\nMOTION\nFrames: 2\nFrame Time: 0.01\n1 95 0 0 0 0{zeros}\n3 95 0 40 0 0{zeros}\n"
    )
}

fn message(result: Result<cromosim_motion::SmplMotion, MotionError>) -> String {
    let message = result.unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

fn retargeted(
    text: &str,
    options: &MotionOptions,
) -> Result<cromosim_motion::SmplMotion, MotionError> {
    retarget(
        &parse_bvh(text, "walk.bvh").unwrap(),
        &BodyModel::embedded(),
        options,
    )
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let missing = read_motion(Path::new("nowhere.bvh"), &MotionOptions::default());
    assert!(message(missing).starts_with("nowhere.bvh: cannot read: "));
    assert!(
        message(read_motion(
            &std::env::temp_dir(),
            &MotionOptions::default()
        ))
        .contains("cannot read")
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.bvh");
    std::fs::write(&path, b"# a table").unwrap();
    let found = message(read_motion(&path, &MotionOptions::default()));
    assert!(
        found.contains("motion.bvh: not a motion file: expected BVH (first word HIERARCHY), AMC, MVNX, C3D, TRC or SMPL parameters"),
        "{found}"
    );
    assert!(found.ends_with("found \"# a table\""), "{found}");
    std::fs::write(&path, b"PK\x03\x04 an archive").unwrap();
    assert!(message(read_motion(&path, &MotionOptions::default())).contains("motion.bvh: "));
    std::fs::write(&path, b"").unwrap();
    assert!(
        message(read_motion(&path, &MotionOptions::default())).ends_with("found an empty file")
    );
}

#[test]
fn the_format_is_told_by_the_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.c3d");
    std::fs::write(&path, format!("\n {}", xsens())).unwrap();
    let motion = read_motion(&path, &MotionOptions::default()).unwrap();
    assert_eq!(
        (motion.frames.len(), motion.rate_hz, motion.betas.len()),
        (2, 100.0, 10)
    );
}

#[test]
fn unknown_skeletons_are_described() {
    let found = message(read_motion(
        &own_file("a_ok.bvh"),
        &MotionOptions::default(),
    ));
    assert!(
        found.contains("no skeleton map fits: nearest is")
            && found.contains("not found: ")
            && found.contains("cromosim inspect FILE --skeleton-map-draft map.yaml")
            && found.contains("skeleton_map"),
        "{found}"
    );
    let daz = MotionOptions {
        skeleton_map: Some("daz".to_owned()),
        ..Default::default()
    };
    let found = message(read_motion(&own_file("a_ok.bvh"), &daz));
    assert!(
        found.contains("skeleton map daz does not fit, not found: hip, lThigh"),
        "{found}"
    );
    let unknown = MotionOptions {
        skeleton_map: Some("kinect".to_owned()),
        ..Default::default()
    };
    let found = message(read_motion(&own_file("a_ok.bvh"), &unknown));
    assert_eq!(
        found,
        "skeleton map kinect is neither a file nor one of cmu, cmu_asf, daz, lafan1, mixamo, mvn, smpl, xsens"
    );
}

#[test]
fn embedded_maps_are_sound_and_own_maps_are_checked() {
    let maps = SkeletonMap::embedded().unwrap();
    assert_eq!(
        maps.iter().map(SkeletonMap::name).collect::<Vec<_>>(),
        [
            "cmu", "cmu_asf", "daz", "lafan1", "mixamo", "mvn", "smpl", "xsens"
        ]
    );
    assert!(maps.iter().all(|map| !map.description().is_empty()));
    let clip = parse_bvh(&xsens(), "walk.bvh").unwrap();
    assert_eq!(maps[7].missing_in(&clip), ["Chest2"]);
    let yaml = include_str!("../maps/xsens.yaml");
    let error = |yaml: &str| {
        SkeletonMap::from_yaml(yaml, "own.yaml")
            .unwrap_err()
            .to_string()
    };
    assert!(
        error(&yaml.replace("pelvis: Hips", "pelvic: Hips"))
            .starts_with("own.yaml: key joints.pelvic: SMPL has no such joint")
    );
    assert!(
        error(&yaml.replace("  left_knee: LeftKnee\n", ""))
            .starts_with("own.yaml: key joints.left_knee: missing, and indispensable")
    );
    assert!(error(&format!("{yaml}colour: red\n")).contains("unknown field `colour`"));
    assert!(
        error(&format!("{yaml}unit_scale_m: -1\n")).contains("key unit_scale_m: expected metres")
    );
    let crooked = format!("{yaml}rest_axes:\n  Hips: {{x: [1, 0, 0], y: [0.5, 0.5, 0]}}\n");
    assert!(error(&crooked).contains("key rest_axes.Hips: x and y are not"));
}

#[test]
fn own_maps_come_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.yaml");
    std::fs::write(
        &path,
        include_str!("../maps/xsens.yaml")
            .replace("name: xsens", "name: mine")
            .replace("Hips", "Pelvis"),
    )
    .unwrap();
    let options = MotionOptions {
        skeleton_map: Some(path.display().to_string()),
        ..Default::default()
    };
    let motion = retargeted(&xsens().replace("Hips", "Pelvis"), &options).unwrap();
    assert_eq!(motion.report.unwrap().map, "mine");
}

#[test]
fn a_turn_of_the_source_is_a_turn_of_the_body() {
    let motion = retargeted(
        &xsens(),
        &MotionOptions {
            keep_lead_in: true,
            ..Default::default()
        },
    )
    .unwrap();
    let report = motion.report.clone().unwrap();
    assert_eq!(
        (
            report.map.as_str(),
            report.up_axis.as_str(),
            report.unit_scale_m,
            report.rest.as_str()
        ),
        ("xsens", "+y", 0.01, "zero pose")
    );
    let [first, second] = [0, 1].map(|frame| motion.frames[frame].local_rotations[0]);
    assert!(
        (first * Vector3::y() - Vector3::z()).norm() < 0.05
            && (first * Vector3::z() + Vector3::y()).norm() < 0.05,
        "y up became z up"
    );
    assert!(
        ((second * first.inverse()).scaled_axis() - Vector3::z() * 40_f64.to_radians()).norm()
            < 1e-9
    );
    let way = motion.frames[1].root_position - motion.frames[0].root_position;
    assert!((way.x - 0.02 * report.leg_ratio).abs() < 2e-3, "{way}");
    let soles = motion.frames[0].root_position.z;
    assert!(
        (0.85..1.1).contains(&soles),
        "the pelvis stands {soles} m over the floor"
    );
}

#[test]
fn settings_override_what_is_found() {
    let options = |change: &dyn Fn(&mut MotionOptions)| {
        let mut options = MotionOptions {
            keep_lead_in: true,
            ..Default::default()
        };
        change(&mut options);
        options
    };
    let report = |options: MotionOptions| {
        retargeted(&xsens(), &options).map(|motion| motion.report.unwrap())
    };
    assert_eq!(
        report(options(&|o| o.unit_scale_m = Some(0.011)))
            .unwrap()
            .unit_scale_m,
        0.011
    );
    assert_eq!(
        report(options(&|o| o.up_axis = UpAxis::Z)).unwrap().up_axis,
        "+z"
    );
    assert_eq!(
        report(options(&|o| o.rest = RestChoice::Frame(1)))
            .unwrap()
            .rest,
        "frame 1"
    );
    let error = |options: MotionOptions| report(options).unwrap_err().to_string();
    assert!(error(options(&|o| o.unit_scale_m = Some(f64::NAN))).contains("unit_scale_m is NaN"));
    assert!(
        error(options(&|o| o.rest = RestChoice::Frame(2)))
            .contains("frame 2 asked for, but the last one is 1")
    );
    assert!(error(options(&|o| o.rest = RestChoice::Map)).contains("map xsens has no rest_axes"));
    let giant = retargeted(
        &xsens().replace(" -42 ", " -4200 "),
        &MotionOptions::default(),
    );
    assert!(message(giant).contains("set unit_scale_m"));
    let crouching = retargeted(
        &xsens().replace("OFFSET 0 -42 0", "OFFSET 0 -20 37"),
        &MotionOptions::default(),
    );
    assert!(message(crouching).contains("no rest pose found: the zero pose is no standing human"));
    let yaml = "rest: !frame 3\nup_axis: z\nunit_scale_m: 0.01\n";
    let read: MotionOptions = serde_norway::from_str(yaml).unwrap();
    assert_eq!((read.rest, read.up_axis), (RestChoice::Frame(3), UpAxis::Z));
    assert!(
        serde_norway::from_str::<MotionOptions>("upaxis: z")
            .unwrap_err()
            .to_string()
            .contains("unknown field")
    );
}

#[test]
fn slices_keep_the_frames_they_name() {
    let walk = embedded_walk();
    let part = walk.slice(2.0, Some(1.5)).unwrap();
    assert_eq!((part.frames.len(), part.duration_s()), (151, 1.5));
    assert_eq!(
        (&part.frames[0], &part.frames[150]),
        (&walk.frames[200], &walk.frames[350])
    );
    assert_eq!(walk.slice(9.5, None).unwrap().frames.len(), 51);
    assert_eq!(walk.slice(9.5, Some(100.0)).unwrap().frames.len(), 51);
    assert_eq!(
        message(walk.slice(11.0, None)),
        "embedded walk: start_s is 11, expected 0 to 10.000 s (the motion's end)"
    );
    for (start_s, duration_s) in [
        (-0.1, None),
        (f64::NAN, None),
        (0.0, Some(0.0)),
        (0.0, Some(f64::NAN)),
    ] {
        assert!(walk.slice(start_s, duration_s).is_err());
    }
}

/// Half the frames left out and made again: the smooth way is far nearer to the truth than the
/// straight one.
#[test]
fn poses_between_frames_are_smooth() {
    let walk = embedded_walk();
    let half = cromosim_motion::SmplMotion {
        rate_hz: 50.0,
        frames: walk.frames.iter().step_by(2).cloned().collect(),
        ..walk.clone()
    };
    let (mut straight, mut smooth): (f64, f64) = (0.0, 0.0);
    for (index, truth) in walk
        .frames
        .iter()
        .enumerate()
        .skip(3)
        .step_by(2)
        .take(900 / 2)
    {
        let time_s = index as f64 / 100.0;
        let far = |pose: &cromosim_body::BodyPose| {
            let angles = pose
                .local_rotations
                .iter()
                .zip(&truth.local_rotations)
                .map(|(a, b)| a.angle_to(b));
            angles.fold(0.0, f64::max) + (pose.root_position - truth.root_position).norm()
        };
        straight = straight.max(far(&half.pose_at(time_s).unwrap()));
        smooth = smooth.max(far(&half.smooth_pose_at(time_s).unwrap()));
    }
    println!("largest error at 50 Hz: {straight:.5} straight, {smooth:.5} smooth");
    assert!(smooth * 4.0 < straight);
    assert_eq!(walk.pose_at(-5.0).unwrap(), walk.frames[0]);
    assert!(
        walk.pose_at(0.37).unwrap().local_rotations[4]
            .angle_to(&walk.frames[37].local_rotations[4])
            < 1e-9
    );
    let again = walk.resampled(120.0).unwrap();
    assert_eq!((again.frames.len(), again.duration_s()), (1201, 10.0));
    assert!(walk.resampled(0.0).is_err());
}

/// Absurd bones and angles: an error or a finite motion, never a panic.
#[test]
fn absurd_skeletons_never_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let text = xsens();
    let words: Vec<&str> = text.split_inclusive(char::is_whitespace).collect();
    let numbers: Vec<usize> = (0..words.len())
        .filter(|&word| words[word].trim().parse::<f64>().is_ok())
        .collect();
    let absurd = ["0 ", "1e8 ", "-1e8 ", "1e-300 ", "-90 ", "179.999 ", "42 "];
    let (mut read, mut refused) = (0, 0);
    for _ in 0..1000 {
        let mut damaged: Vec<&str> = words.clone();
        for _ in 0..rng.random_range(1..12) {
            damaged[numbers[rng.random_range(0..numbers.len())]] =
                absurd[rng.random_range(0..absurd.len())];
        }
        let Ok(clip) = parse_bvh(&damaged.concat().replace("  ", " "), "damaged.bvh") else {
            continue;
        };
        assert!(SkeletonDraft::of(&clip, "damaged").is_ok());
        let unit_scale_m = rng.random_bool(0.5).then_some(0.01);
        match retarget(
            &clip,
            &BodyModel::embedded(),
            &MotionOptions {
                unit_scale_m,
                ..Default::default()
            },
        ) {
            Ok(motion) => {
                read += 1;
                let finite = |pose: &cromosim_body::BodyPose| {
                    pose.local_rotations
                        .iter()
                        .all(|q| (q.norm() - 1.0).abs() < 1e-9)
                };
                assert!(
                    motion
                        .frames
                        .iter()
                        .all(|pose| finite(pose) && pose.root_position.norm().is_finite())
                );
            }
            Err(_) => refused += 1,
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > 0 && refused > 0);
}
