//! Files of SMPL parameters against joints that Python finds (`scripts/make_poses.py`), and round
//! trips.
#![allow(clippy::unwrap_used)]

mod common;
mod pose_samples;

use std::sync::Arc;

use cromosim_body::BodyModel;
use cromosim_motion::{
    CameraPoses, MotionOptions, PoseAxes, PoseFormat, PoseView, ShapeChoice, ShapeOrigin,
    open_poses, read_motion, read_motion_for, read_people,
};
use nalgebra::Vector3;
use pose_samples::{body, expected, farthest, joints, report, sample, smplh};

#[test]
fn every_tools_file_gives_the_joints_that_python_finds() {
    let (smplh, smplx) = (smplh(), body("model_smplx.npz"));
    let cases = [
        ("amass.npz", PoseFormat::Amass, &smplh, 120.0, 1e-12),
        ("stageii.pkl", PoseFormat::Amass, &smplh, 60.0, 1e-12),
        // Its settings are OmegaConf's objects, which nothing here rebuilds.
        (
            "stageii_settings.pkl",
            PoseFormat::Amass,
            &smplh,
            60.0,
            1e-12,
        ),
        ("stageii_smplx.npz", PoseFormat::Amass, &smplx, 50.0, 1e-12),
        // Video tools write float32.
        ("wham.pkl", PoseFormat::Wham, &smplh, 30.0, 1e-6),
        ("gvhmr.pt", PoseFormat::Gvhmr, &smplx, 30.0, 1e-6),
        ("slahmr.npz", PoseFormat::Slahmr, &smplh, 30.0, 1e-6),
        ("tram/hps_track_0.npy", PoseFormat::Tram, &smplh, 30.0, 2e-6),
    ];
    for (name, format, body, rate_hz, within) in cases {
        let motion = read_motion_for(
            &sample(name),
            body,
            &MotionOptions {
                shape: ShapeChoice::File,
                ..Default::default()
            },
        )
        .unwrap();
        let report = report(&motion);
        assert_eq!(
            (report.format, motion.rate_hz, report.shape_origin),
            (format, rate_hz, ShapeOrigin::File),
            "{name}"
        );
        assert_eq!(
            (motion.shape_space, report.has_trajectory),
            (body.shape_space(), true),
            "{name}"
        );
        let raised = expected(name)
            .into_iter()
            .map(|frame| frame.map(|joint| joint + Vector3::z() * report.floor_shift_m));
        let far = farthest(&joints(&motion, body), &raised.collect::<Vec<_>>());
        println!("{name}: {far:.1e} m; {report}");
        assert!(far < within, "{name}: {far} m");
        assert_eq!(motion.confidence.is_some(), format.is_video());
        assert_eq!(
            report.floor_shift_m == 0.0,
            !format.is_video(),
            "{name}: {}",
            report.floor_shift_m
        );
    }
}

#[test]
fn poses_in_a_cameras_axes_stay_in_place() {
    let body = smplh();
    for (name, rows, bridged) in [
        ("vibe.joblib", [0, 1, 2, 4, 5, 6], 1),
        ("phalp.pkl", [0, 1, 2, 3, 4, 5], 0),
    ] {
        let motion = read_motion_for(&sample(name), &body, &MotionOptions::default()).unwrap();
        let found = joints(&motion, &body);
        let still: Vec<_> = rows
            .map(|row| found[row].map(|joint| joint - motion.frames[0].root_position))
            .to_vec();
        let far = farthest(&still, &expected(name));
        println!("{name}: {far:.1e} m; {}", report(&motion));
        assert!(far < 1e-6, "{name}: {far} m");
        assert!(
            !report(&motion).has_trajectory
                && motion
                    .frames
                    .iter()
                    .all(|frame| frame.root_position.xy().norm() == 0.0)
        );
        assert_eq!(report(&motion).bridged_frames, bridged);
    }
}

#[test]
fn gaps_are_bridged_without_confidence() {
    let motion = read_motion(&sample("vibe.joblib"), &MotionOptions::default()).unwrap();
    assert_eq!(
        motion.confidence.as_deref().unwrap(),
        [1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]
    );
    let [before, within, after] = [2, 3, 4].map(|frame| motion.frames[frame].local_rotations[5]);
    assert!(
        (before.angle_to(&within) - within.angle_to(&after)).abs() < 1e-9
            && before.angle_to(&after) > 0.05
    );
    let lost = read_motion(&sample("phalp.pkl"), &MotionOptions::default()).unwrap();
    assert_eq!(
        lost.confidence.unwrap(),
        [1.0, 1.0, 0.0, 1.0, 1.0, 1.0],
        "guessed while the person was lost"
    );
}

#[test]
fn people_are_listed_and_chosen() {
    let options = |person: &str| MotionOptions {
        person: Some(person.to_owned()),
        ..Default::default()
    };
    let longest = read_motion(&sample("vibe.joblib"), &MotionOptions::default()).unwrap();
    assert_eq!(report(&longest).person, "7");
    assert!(longest.poses.unwrap().to_string().contains(
        "person 7 of 1 (2 frames), 7 (6 frames), rate assumed (set rate_hz), up camera, in place"
    ));
    assert_eq!(
        read_motion(&sample("vibe.joblib"), &options("1"))
            .unwrap()
            .frames
            .len(),
        2
    );
    let message = read_motion(&sample("wham.pkl"), &options("7"))
        .unwrap_err()
        .to_string();
    assert!(message.ends_with("wham.pkl: person 7 is not in it; there are 0 (6 frames), 3 (2 frames); choose one by person"), "{message}");
    for (name, lengths) in [
        ("vibe.joblib", vec![2, 7]),
        ("wham.pkl", vec![6, 2]),
        ("phalp.pkl", vec![6, 3]),
        ("slahmr.npz", vec![6, 2]),
    ] {
        let everybody = read_people(
            &sample(name),
            &BodyModel::embedded(),
            &MotionOptions::default(),
        )
        .unwrap();
        assert_eq!(
            everybody
                .iter()
                .map(|person| person.motion.frames.len())
                .collect::<Vec<_>>(),
            lengths,
            "{name}"
        );
        assert_eq!(report(&everybody[0].motion).people.len(), 2);
        assert!(
            everybody
                .iter()
                .all(|person| person.name == report(&person.motion).person)
        );
    }
}

#[test]
fn people_of_one_file_are_in_step() {
    let read = |name: &str, options: MotionOptions| {
        read_people(&sample(name), &BodyModel::embedded(), &options)
    };
    let person = |names: &str| MotionOptions {
        person: Some(names.to_owned()),
        ..Default::default()
    };
    let labels = |people: &[cromosim_motion::Person]| {
        people
            .iter()
            .map(|person| person.label.clone())
            .collect::<Vec<_>>()
    };
    // VIBE's person 1 is in frames 0 and 1 of the video, 7 in 10 to 16; SLAHMR's second one in 4
    // and 5.
    let both = read("vibe.joblib", person("all")).unwrap();
    assert_eq!(
        (labels(&both), both[0].begins_s),
        (vec!["person_1".to_owned(), "person_7".to_owned()], 0.0)
    );
    assert!(
        (both[1].begins_s - 10.0 / 30.0).abs() < 1e-12,
        "{}",
        both[1].begins_s
    );
    assert!(
        (read("slahmr.npz", MotionOptions::default()).unwrap()[1].begins_s - 4.0 / 30.0).abs()
            < 1e-12
    );
    // The clock is that of those who are chosen, in the order asked for.
    assert_eq!(
        labels(&read("vibe.joblib", person("7, 1,7")).unwrap()),
        ["person_7", "person_1"]
    );
    assert_eq!(
        labels(&read("vibe.joblib", person("7,")).unwrap()),
        ["person_7"]
    );
    for wrong in [",", "7,8"] {
        assert!(
            read("vibe.joblib", person(wrong))
                .unwrap_err()
                .to_string()
                .contains("is not in it; there are 1 (2 frames), 7 (6 frames)")
        );
    }
    assert_eq!(read("vibe.joblib", person("7")).unwrap()[0].begins_s, 0.0);
    let window = |start_s, duration_s| {
        read(
            "vibe.joblib",
            MotionOptions {
                start_s,
                duration_s,
                ..Default::default()
            },
        )
    };
    let late = window(0.15, None).unwrap();
    assert_eq!(
        (labels(&late), late[0].motion.frames.len()),
        (vec!["person_7".to_owned()], 7),
        "one is gone by then"
    );
    assert!((late[0].begins_s - (10.0 / 30.0 - 0.15)).abs() < 1e-12);
    let within = window(0.35, Some(0.1)).unwrap();
    assert!(
        within.len() == 1
            && within[0].motion.frames.len() == 3
            && (within[0].begins_s - (11.0 / 30.0 - 0.35)).abs() < 1e-9
    );
    assert!(
        window(0.15, Some(0.05)).is_err() && window(5.0, None).is_err(),
        "nobody is there"
    );
    assert_eq!(
        labels(&read("amass.npz", person("all")).unwrap()),
        ["person_0"]
    );
}

/// Everybody of a sample in the camera's axes.
fn camera_poses(name: &str, body: &Arc<BodyModel>) -> Vec<CameraPoses> {
    let file = open_poses(&sample(name), PoseView::Camera)
        .unwrap()
        .unwrap();
    file.into_camera_poses(body, &MotionOptions::default())
        .unwrap()
}

#[test]
fn camera_poses_are_handed_over() {
    let body = smplh();
    for name in ["vibe.joblib", "wham.pkl", "phalp.pkl"] {
        let people = camera_poses(name, &body);
        let longest = people
            .iter()
            .max_by_key(|person| person.poses.len())
            .unwrap();
        assert_eq!(
            (longest.betas.len(), longest.pose_confidence.len()),
            (longest.poses.len(), longest.poses.len()),
            "{name}"
        );
        // y points down in a camera.
        assert!(
            (longest.poses[0].local_rotations[0] * Vector3::y() + Vector3::y()).norm() < 0.5,
            "{name}"
        );
        assert!(
            camera_poses(name, &BodyModel::embedded())[0]
                .betas
                .is_empty()
        );
    }
    assert_eq!(camera_poses("vibe.joblib", &body)[1].first_frame, 10);
    let gvhmr = camera_poses("gvhmr.pt", &body);
    assert_eq!(
        (gvhmr.len(), gvhmr[0].betas.len(), gvhmr[0].rate_hz),
        (1, 0, 30.0)
    );
    assert!(camera_poses("amass.npz", &body).is_empty());
    let without_camera = tempfile::tempdir().unwrap();
    let path = without_camera.path().join("track.npy");
    std::fs::copy(sample("tram/hps_track_0.npy"), &path).unwrap();
    assert_eq!(
        open_poses(&path, PoseView::World).unwrap().unwrap().tracks[0].axes,
        PoseAxes::Camera
    );
}
