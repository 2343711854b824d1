//! Motions of SMPL parameters on their own body and on others: whose betas drive it, known motions
//! there and back, and the fit to another body's bones.
#![allow(clippy::unwrap_used)]

mod common;
mod pose_samples;

use std::path::Path;
use std::sync::Arc;

use common::containers::{Arrays, Py, npz, parsed};
use common::own_file;
use cromosim_arrays::{Container, NpzWriter};
use cromosim_body::{BodyModel, BodyPose, Gender, Joint, ShapeSpace, ShapedBody};
use cromosim_motion::{
    MotionOptions, RateOrigin, ShapeChoice, ShapeOrigin, SmplMotion, embedded_walk, read_motion_for,
};
use nalgebra::{UnitQuaternion, Vector3};
use pose_samples::{farthest, joints, report, sample, smplh};

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
