//! Files of SMPL parameters against joints that Python finds (`scripts/make_poses.py`), and round
//! trips.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::containers::{Arrays, Py, npz, parsed};
use common::own_file;
use cromosim_arrays::{Container, NpzWriter};
use cromosim_body::{BodyModel, BodyPose, Gender, Joint, ShapeSpace, ShapedBody};
use cromosim_motion::{
    CameraPoses, MotionOptions, PoseAxes, PoseFormat, PoseReport, PoseView, RateOrigin,
    ShapeChoice, ShapeOrigin, SmplMotion, embedded_walk, open_poses, read_motion, read_motion_for,
    read_people,
};
use nalgebra::{UnitQuaternion, Vector3};

fn sample(name: &str) -> PathBuf {
    own_file("poses").join(name)
}

fn body(name: &str) -> Arc<BodyModel> {
    BodyModel::read(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../body/tests/data")
            .join(name),
    )
    .unwrap()
}

fn smplh() -> Arc<BodyModel> {
    body("model_smplh_female.npz")
}

/// The joints in the world, m.
fn joints(motion: &SmplMotion, body: &Arc<BodyModel>) -> Vec<[Vector3<f64>; 24]> {
    let shaped = ShapedBody::new(body.clone(), &motion.betas).unwrap();
    motion
        .frames
        .iter()
        .map(|pose| {
            shaped
                .world_from_segments(pose)
                .map(|segment| segment.translation.vector)
        })
        .collect()
}

fn farthest(left: &[[Vector3<f64>; 24]], right: &[[Vector3<f64>; 24]]) -> f64 {
    assert_eq!(left.len(), right.len());
    left.iter()
        .flatten()
        .zip(right.iter().flatten())
        .map(|(left, right)| (left - right).norm())
        .fold(0.0, f64::max)
}

fn report(motion: &SmplMotion) -> &PoseReport {
    motion.poses.as_ref().unwrap()
}

/// What Python finds for a file: (N, 24, 3).
fn expected(name: &str) -> Vec<[Vector3<f64>; 24]> {
    let array = Container::open(&sample("expected.npz"))
        .unwrap()
        .at(name)
        .unwrap()
        .floats(&[None, Some(24), Some(3)], "(N, 24, 3)")
        .unwrap();
    let joint =
        |frame: &[f64], joint: usize| Vector3::from_column_slice(&frame[3 * joint..3 * joint + 3]);
    array
        .values
        .chunks_exact(72)
        .map(|frame| std::array::from_fn(|index| joint(frame, index)))
        .collect()
}

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

#[test]
fn betas_of_another_body_never_drive_this_one() {
    let embedded = BodyModel::embedded();
    let options = |shape, source: Option<&str>| MotionOptions {
        shape,
        source_body: source.map(|name| {
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../body/tests/data")
                .join(name)
        }),
        ..Default::default()
    };
    let read = |options: &MotionOptions| read_motion_for(&sample("amass.npz"), &embedded, options);
    let mean = read(&options(ShapeChoice::Detect, None)).unwrap();
    assert_eq!(
        (mean.betas.clone(), mean.shape_space),
        (vec![0.0; 10], ShapeSpace::Cromosim)
    );
    assert_eq!(
        (
            report(&mean).shape_origin,
            report(&mean).shape_space,
            report(&mean).gender
        ),
        (ShapeOrigin::Mean, ShapeSpace::Smpl, Some(Gender::Female))
    );
    assert!(
        report(&mean)
            .to_string()
            .contains("mean body instead of betas of SMPL female (set source_body"),
        "{}",
        report(&mean)
    );
    for shape in [ShapeChoice::File, ShapeChoice::Fit] {
        let message = read(&options(shape, None)).unwrap_err().to_string();
        assert!(
            message.contains("betas belong to SMPL")
                && message.contains("set source_body")
                && message.contains("shape to mean"),
            "{message}"
        );
    }
    let fitted = read(&options(ShapeChoice::Fit, Some("model_smplh_female.npz"))).unwrap();
    assert!(
        matches!(report(&fitted).shape_origin, ShapeOrigin::Fit { .. })
            && fitted.betas.iter().any(|&beta| beta != 0.0)
    );
    let foreign = read(&options(ShapeChoice::Fit, Some("model_smplx.npz")))
        .unwrap_err()
        .to_string();
    assert!(foreign.contains("betas belong to SMPL"), "{foreign}");
    let skeleton = read_motion_for(
        &own_file("a_ok.bvh"),
        &embedded,
        &options(ShapeChoice::File, None),
    );
    assert!(skeleton.is_err());
}

/// A known motion, 50 frames, on a body of SMPL's.
fn known(body: &Arc<BodyModel>) -> (SmplMotion, ShapedBody) {
    let walk = embedded_walk();
    let betas: Vec<f64> = (0..10).map(|beta| 0.3 * f64::from(beta) - 1.2).collect();
    let shaped = ShapedBody::new(body.clone(), &betas).unwrap();
    (
        SmplMotion {
            betas,
            shape_space: ShapeSpace::Smpl,
            frames: walk.frames[300..350].to_vec(),
            ..walk
        },
        shaped,
    )
}

#[test]
fn a_known_motion_comes_back() {
    let body = smplh();
    let (motion, shaped) = known(&body);
    let truth = joints(&motion, &body);
    let angles = |pose: &BodyPose, count: usize| {
        pose.axis_angles()[..count]
            .iter()
            .flat_map(|v| [v.x, v.y, v.z])
            .collect::<Vec<_>>()
    };
    let poses: Vec<f64> = motion
        .frames
        .iter()
        .flat_map(|pose| [angles(pose, 22), vec![0.0; 90]].concat())
        .collect();
    let trans = |pose: &BodyPose| shaped.trans(pose.root_position);
    let in_row = |vectors: Vec<Vector3<f64>>| {
        vectors
            .iter()
            .flat_map(|v| [v.x, v.y, v.z])
            .collect::<Vec<_>>()
    };
    let arrays = Arrays::from([
        ("poses", (vec![50, 156], poses)),
        (
            "trans",
            (
                vec![50, 3],
                in_row(motion.frames.iter().map(trans).collect()),
            ),
        ),
        ("betas", (vec![10], motion.betas.clone())),
        ("mocap_framerate", (vec![], vec![100.0])),
    ]);
    let own = MotionOptions {
        shape: ShapeChoice::File,
        ..Default::default()
    };
    let again = parsed(npz(&arrays))
        .unwrap()
        .into_motion(&body, None, &own)
        .unwrap();
    let far = farthest(&joints(&again, &body), &truth);
    // WHAM's world has y up.
    let y_up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let turned = |pose: &BodyPose| {
        let mut pose = pose.clone();
        pose.root_position = y_up * pose.root_position;
        pose.local_rotations[0] = y_up * pose.local_rotations[0];
        pose
    };
    let in_y_up: Vec<_> = motion.frames.iter().map(turned).collect();
    let person = Py::named(&[
        (
            "pose_world",
            Py::rows(
                &in_y_up
                    .iter()
                    .flat_map(|pose| angles(pose, 24))
                    .collect::<Vec<_>>(),
                72,
            ),
        ),
        (
            "trans_world",
            Py::rows(&in_row(in_y_up.iter().map(trans).collect()), 3),
        ),
        ("betas", Py::rows(&motion.betas.repeat(50), 10)),
    ]);
    let wham = parsed(Py::Dict(vec![(Py::Int(5), person)]).pickle()).unwrap();
    let again = wham
        .into_motion(
            &body,
            None,
            &MotionOptions {
                rate_hz: Some(100.0),
                ..own
            },
        )
        .unwrap();
    let lowered: Vec<_> = joints(&again, &body)
        .iter()
        .map(|frame| frame.map(|j| j - Vector3::z() * report(&again).floor_shift_m))
        .collect();
    let far_wham = farthest(&lowered, &truth);
    println!("AMASS {far:.1e} m, WHAM {far_wham:.1e} m");
    assert!(far < 1e-9 && far_wham < 1e-9, "{far} {far_wham}");
    assert_eq!(
        (
            report(&again).rate_origin,
            report(&again).person.as_str(),
            again.rate_hz
        ),
        (RateOrigin::Option, "5", 100.0)
    );
}

/// The embedded body `scale` times as large, told apart from it by the order of its triangles: a
/// body of SMPL's shape space.
fn foreign_body(scale: f64) -> Arc<BodyModel> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("SMPL.npz");
    BodyModel::embedded().write_npz(&path).unwrap();
    let mut file = Container::open(&path).unwrap();
    let mut writer = NpzWriter::new(std::io::Cursor::new(Vec::new()));
    for (key, rank) in [
        ("v_template", 2),
        ("shapedirs", 3),
        ("posedirs", 3),
        ("J_regressor", 2),
        ("weights", 2),
    ] {
        let mut array = file
            .at(key)
            .unwrap()
            .floats(&vec![None; rank], "any")
            .unwrap();
        if key.ends_with("template") || key.ends_with("dirs") {
            array.values.iter_mut().for_each(|value| *value *= scale);
        }
        writer.floats(key, &array.shape, &array.values).unwrap();
    }
    for key in ["kintree_table", "f"] {
        let mut array = file
            .at(key)
            .unwrap()
            .integers(&[None, None], "any")
            .unwrap();
        if key == "f" {
            array.values.rotate_left(3);
        }
        writer
            .integers(
                key,
                &array.shape,
                &array
                    .values
                    .iter()
                    .map(|&value| value as u32)
                    .collect::<Vec<_>>(),
            )
            .unwrap();
    }
    let bytes = writer.finish().unwrap().into_inner();
    BodyModel::from_reader(std::io::Cursor::new(bytes), Path::new("SMPL.npz")).unwrap()
}

#[test]
fn a_person_of_another_body_is_fitted_to_this_one() {
    for scale in [1.0, 1.4] {
        let source = foreign_body(scale);
        assert_eq!(source.shape_space(), ShapeSpace::Smpl);
        let (motion, shaped) = known(&source);
        let axis_angles = motion
            .frames
            .iter()
            .flat_map(|pose| pose.axis_angles().into_iter().flat_map(|v| [v.x, v.y, v.z]));
        let arrays = Arrays::from([
            ("poses", (vec![50, 72], axis_angles.collect())),
            (
                "trans",
                (
                    vec![50, 3],
                    motion
                        .frames
                        .iter()
                        .flat_map(|pose| shaped.trans(pose.root_position).data.0[0])
                        .collect(),
                ),
            ),
            ("betas", (vec![10], motion.betas.clone())),
        ]);
        let options = MotionOptions {
            rate_hz: Some(100.0),
            ..Default::default()
        };
        let embedded = BodyModel::embedded();
        let fitted = parsed(npz(&arrays))
            .unwrap()
            .into_motion(&embedded, Some(&source), &options)
            .unwrap();
        let own = ShapedBody::new(embedded.clone(), &fitted.betas).unwrap();
        let leg = |body: &ShapedBody| {
            let at = |joint: Joint| body.joints_in_model()[joint.index()];
            (at(Joint::LeftHip) - at(Joint::LeftKnee)).norm()
                + (at(Joint::LeftKnee) - at(Joint::LeftAnkle)).norm()
        };
        let way = |frames: &[BodyPose]| {
            (frames[49].root_position - frames[0].root_position)
                .xy()
                .norm()
        };
        let (legs, ways) = (
            leg(&own) / leg(&shaped),
            way(&fitted.frames) / way(&motion.frames),
        );
        println!("legs {legs:.4}, way {ways:.4}; {}", report(&fitted));
        assert!(
            (ways / legs - 1.0).abs() < 0.01,
            "the way is scaled by the legs: {ways}, {legs}"
        );
        if scale == 1.0 {
            let lengths = |body: &ShapedBody| {
                (1..24)
                    .map(|j| (body.joints_in_model()[j] - body.joints_in_model()[0]).norm())
                    .collect::<Vec<_>>()
            };
            let far = lengths(&own)
                .iter()
                .zip(lengths(&shaped))
                .map(|(own, theirs)| (own - theirs).abs())
                .fold(0.0, f64::max);
            println!(
                "joints are within {:.1} mm as far from the pelvis as the person's",
                1e3 * far
            );
            assert!(far < 0.02, "{far}");
        } else {
            assert!(
                legs < 0.9,
                "the largest shape of the embedded body is smaller: {legs}"
            );
        }
    }
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
