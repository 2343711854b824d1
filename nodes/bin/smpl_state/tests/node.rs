//! The node as a function of poses, without DDS.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::std_msgs::Header;
use cromosim_smpl_state::{Config, SmplStateNode, pelvis_from_base_link};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

fn body() -> BodyPose {
    let turn = |joint: usize| {
        UnitQuaternion::from_scaled_axis(Vector3::new(0.03 * joint as f64, 0.2, -0.1))
    };
    BodyPose {
        root_position: Vector3::new(1.0, 2.0, 0.95),
        local_rotations: std::array::from_fn(turn),
    }
}

fn message(nanos: i64, betas: &[f64]) -> SmplPose {
    let mut message = SmplPose {
        header: Header::new(nanos, "camera"),
        betas: betas.to_vec(),
        shape_space: "cromosim".to_owned(),
        ..SmplPose::default()
    };
    message.set_root_and_rotations(body().root_position, &body().local_rotations);
    message
}

#[test]
fn frames_chain_to_the_segments_of_the_body() {
    let mut node = SmplStateNode::new(
        Config {
            prefix: "alice".to_owned(),
            ..Config::default()
        },
        BodyModel::embedded(),
        None,
    )
    .unwrap();
    let step = node.step(&message(1, &[1.0, -0.5])).unwrap();
    let mut world_from: BTreeMap<String, Isometry3<f64>> =
        BTreeMap::from([("world".to_owned(), Isometry3::identity())]);
    for edge in &step.frames.transforms {
        let parent_from_child: Isometry3<f64> = edge.transform.try_into().unwrap();
        world_from.insert(
            edge.child_frame_id.clone(),
            world_from[&edge.header.frame_id] * parent_from_child,
        );
    }
    let segments = ShapedBody::new(BodyModel::embedded(), &[1.0, -0.5])
        .unwrap()
        .world_from_segments(&body());
    for joint in Joint::ALL {
        let (found, expected) = (
            world_from[&format!("alice/{joint}")],
            segments[joint.index()],
        );
        assert!(
            (found.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12,
            "{joint}"
        );
    }
}

#[test]
fn the_source_is_put_into_the_world() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let config = Config {
        source_position: [0.0, 0.0, 1.0],
        source_rotvec: [quarter, 0.0, 0.0],
        ..Config::default()
    };
    let state = SmplStateNode::new(config, BodyModel::embedded(), None)
        .unwrap()
        .step(&message(1, &[]))
        .unwrap()
        .state;
    let (root, rotations) = state.root_and_rotations().unwrap();
    // y of the source is up: (1, 2, 0.95) -> (1, -0.95, 2) + (0, 0, 1).
    assert!(
        (root - Vector3::new(1.0, -0.95, 3.0)).norm() < 1e-12,
        "{root}"
    );
    let expected = UnitQuaternion::from_scaled_axis(Vector3::new(quarter, 0.0, 0.0))
        * body().local_rotations[0];
    assert!(rotations[0].angle_to(&expected) < 1e-9);
    assert_eq!(state.header.frame_id, "world");
}

#[test]
fn betas_are_averaged_and_nonsense_is_refused() {
    let mut node = SmplStateNode::new(Config::default(), BodyModel::embedded(), None).unwrap();
    assert_eq!(node.step(&message(1, &[1.0])).unwrap().state.betas, [1.0]);
    assert_eq!(node.step(&message(2, &[0.0])).unwrap().state.betas, [0.5]);
    assert!(
        node.step(&message(3, &[0.0; 300])).is_err(),
        "more betas than the body has"
    );
    assert!(node.step(&message(3, &[f64::NAN])).is_err());
    let mut broken = message(4, &[]);
    broken.world_from_pelvis.orientation.w = 7.0;
    assert!(node.step(&broken).is_err());
    assert!(node.step(&message(5, &[0.5])).is_ok());
    let report = node.diagnostics(Header::new(6, "").stamp, "/smpl_state");
    assert_eq!(
        report.status[0]
            .values
            .iter()
            .find(|value| value.key == "poses left out")
            .unwrap()
            .value,
        "3"
    );
}

#[test]
fn base_link_points_as_robots_do() {
    let pelvis_from_base_link = pelvis_from_base_link();
    // In the pelvis: x left, y up, z forward (SMPL); in base_link: x forward, y left, z up
    // (REP-103).
    for (in_base_link, in_pelvis) in [
        (Vector3::x(), Vector3::z()),
        (Vector3::y(), Vector3::x()),
        (Vector3::z(), Vector3::y()),
    ] {
        assert!((pelvis_from_base_link * in_base_link - in_pelvis).norm() < 1e-12);
    }
}

/// A look-alike of SMPL's male body, and a message with betas of it.
fn smpl_body() -> std::sync::Arc<BodyModel> {
    BodyModel::read(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../lib/body/tests/data/model_smpl_m_lbs.pkl"),
    )
    .unwrap()
}

fn of_smpl(nanos: i64, gender: &str, betas: &[f64]) -> SmplPose {
    SmplPose {
        shape_space: "smpl".to_owned(),
        gender: gender.to_owned(),
        ..message(nanos, betas)
    }
}

#[test]
fn betas_of_another_body_are_refused_and_the_way_out_is_said() {
    let mut node = SmplStateNode::new(Config::default(), BodyModel::embedded(), None).unwrap();
    let refusal = node
        .step(&of_smpl(1, "male", &[0.5, -1.0]))
        .err()
        .unwrap()
        .to_string();
    assert!(
        [
            "belong to SMPL",
            "the embedded body",
            "bone lengths",
            "`source_body`"
        ]
        .iter()
        .all(|part| refusal.contains(part)),
        "{refusal}"
    );
    let unnamed = SmplPose {
        shape_space: String::new(),
        ..message(2, &[0.5])
    };
    assert!(
        node.step(&unnamed)
            .err()
            .unwrap()
            .to_string()
            .contains("say whose they are")
    );
    // The mean of any body is said by zeros, and no betas say nothing.
    assert!(
        node.step(&of_smpl(3, "male", &[0.0; 10])).is_ok()
            && node.step(&of_smpl(4, "", &[])).is_ok()
    );
    let mut own = SmplStateNode::new(Config::default(), smpl_body(), None).unwrap();
    let state = own.step(&of_smpl(1, "male", &[0.5, -1.0])).unwrap().state;
    assert_eq!(
        (state.betas, state.shape_space),
        (vec![0.5, -1.0], "smpl".to_owned())
    );
    assert!(
        own.step(&message(2, &[0.5])).is_err(),
        "nor do the embedded body's drive SMPL's"
    );
    let gender = own
        .step(&of_smpl(3, "female", &[0.5]))
        .err()
        .unwrap()
        .to_string();
    assert!(
        gender.contains("SMPL female") && gender.contains("SMPL male"),
        "{gender}"
    );
}

#[test]
fn betas_of_the_source_body_are_fitted() {
    let (embedded, source) = (BodyModel::embedded(), smpl_body());
    let mut node =
        SmplStateNode::new(Config::default(), embedded.clone(), Some(source.clone())).unwrap();
    let state = node.step(&of_smpl(1, "male", &[0.5, -1.0])).unwrap().state;
    let person = ShapedBody::new(source, &[0.5, -1.0]).unwrap();
    let fit = embedded.fit_bone_lengths(|joint| Some(person.joints_in_model()[joint.index()]), 1.0);
    assert_eq!(
        (&state.betas, state.shape_space.as_str()),
        (&fit.betas, "cromosim")
    );
    assert!(
        fit.betas.iter().any(|beta| beta.abs() > 0.1),
        "the person differs from the mean: {:?}",
        fit.betas
    );
    // Feet stay where they stand: positions shrink or grow as the legs do.
    let fitted = ShapedBody::new(embedded, &fit.betas).unwrap();
    let thigh_and_shank = |body: &ShapedBody| {
        let at = |joint: Joint| body.joints_in_model()[joint.index()];
        let leg = |[hip, knee, ankle]: [Joint; 3]| {
            (at(knee) - at(hip)).norm() + (at(ankle) - at(knee)).norm()
        };
        leg([Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle])
            + leg([Joint::RightHip, Joint::RightKnee, Joint::RightAnkle])
    };
    let (root, _) = state.root_and_rotations().unwrap();
    let expected = body().root_position * (thigh_and_shank(&fitted) / thigh_and_shank(&person));
    assert!((root - expected).norm() < 1e-12, "{root} {expected}");
    // Its own betas still pass as they are, and at their own size.
    let own = node.step(&message(2, &[1.0])).unwrap().state;
    assert_eq!(
        (own.betas.as_slice(), own.root_and_rotations().unwrap().0),
        (&[1.0][..], body().root_position)
    );
    assert!(
        node.step(&of_smpl(3, "female", &[0.5])).is_err(),
        "another gender's betas are not the source body's"
    );
}

#[test]
fn confidence_passes_and_nonsense_is_refused() {
    let mut node = SmplStateNode::new(Config::default(), BodyModel::embedded(), None).unwrap();
    let mut step = |nanos, confidence| {
        node.step(&SmplPose {
            confidence,
            ..message(nanos, &[])
        })
    };
    assert_eq!(step(1, 0.25).unwrap().state.confidence, 0.25);
    assert!(step(2, f64::NAN).unwrap().state.confidence.is_nan());
    for wrong in [-0.1, 1.5, f64::INFINITY] {
        assert!(
            step(3, wrong)
                .err()
                .unwrap()
                .to_string()
                .contains("expected 0 to 1")
        );
    }
}
