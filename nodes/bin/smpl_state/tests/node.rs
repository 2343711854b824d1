//! The node as a function of poses, without DDS.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::std_msgs::Header;
use cromosim_smpl_state::{Config, SmplStateNode, pelvis_from_base_link};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

fn body() -> BodyPose {
    let turn = |joint: usize| UnitQuaternion::from_scaled_axis(Vector3::new(0.03 * joint as f64, 0.2, -0.1));
    BodyPose { root_position: Vector3::new(1.0, 2.0, 0.95), local_rotations: std::array::from_fn(turn) }
}

fn message(nanos: i64, betas: &[f64]) -> SmplPose {
    let mut message = SmplPose { header: Header::new(nanos, "camera"), betas: betas.to_vec(), ..SmplPose::default() };
    message.set_root_and_rotations(body().root_position, &body().local_rotations);
    message
}

#[test]
fn frames_chain_to_the_segments_of_the_body() {
    let mut node = SmplStateNode::new(Config { prefix: "alice".to_owned(), ..Config::default() }, BodyModel::embedded()).unwrap();
    let step = node.step(&message(1, &[1.0, -0.5])).unwrap();
    let mut world_from: BTreeMap<String, Isometry3<f64>> = BTreeMap::from([("world".to_owned(), Isometry3::identity())]);
    for edge in &step.frames.transforms {
        let parent_from_child: Isometry3<f64> = edge.transform.try_into().unwrap();
        world_from.insert(edge.child_frame_id.clone(), world_from[&edge.header.frame_id] * parent_from_child);
    }
    let segments = ShapedBody::new(BodyModel::embedded(), &[1.0, -0.5]).unwrap().world_from_segments(&body());
    for joint in Joint::ALL {
        let (found, expected) = (world_from[&format!("alice/{joint}")], segments[joint.index()]);
        assert!((found.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12, "{joint}");
    }
}

#[test]
fn the_source_is_put_into_the_world() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let config = Config { source_position: [0.0, 0.0, 1.0], source_rotvec: [quarter, 0.0, 0.0], ..Config::default() };
    let state = SmplStateNode::new(config, BodyModel::embedded()).unwrap().step(&message(1, &[])).unwrap().state;
    let (root, rotations) = state.root_and_rotations().unwrap();
    // y of the source is up: (1, 2, 0.95) -> (1, -0.95, 2) + (0, 0, 1).
    assert!((root - Vector3::new(1.0, -0.95, 3.0)).norm() < 1e-12, "{root}");
    let expected = UnitQuaternion::from_scaled_axis(Vector3::new(quarter, 0.0, 0.0)) * body().local_rotations[0];
    assert!(rotations[0].angle_to(&expected) < 1e-9);
    assert_eq!(state.header.frame_id, "world");
}

#[test]
fn betas_are_averaged_and_nonsense_is_refused() {
    let mut node = SmplStateNode::new(Config::default(), BodyModel::embedded()).unwrap();
    assert_eq!(node.step(&message(1, &[1.0])).unwrap().state.betas, [1.0]);
    assert_eq!(node.step(&message(2, &[0.0])).unwrap().state.betas, [0.5]);
    assert!(node.step(&message(3, &[0.0; 300])).is_err(), "more betas than the body has");
    assert!(node.step(&message(3, &[f64::NAN])).is_err());
    let mut broken = message(4, &[]);
    broken.world_from_pelvis.orientation.w = 7.0;
    assert!(node.step(&broken).is_err());
    assert!(node.step(&message(5, &[0.5])).is_ok());
    let report = node.diagnostics(Header::new(6, "").stamp, "/smpl_state");
    assert_eq!(report.status[0].values.iter().find(|value| value.key == "poses left out").unwrap().value, "3");
}

#[test]
fn base_link_points_as_robots_do() {
    let pelvis_from_base_link = pelvis_from_base_link();
    // In the pelvis: x left, y up, z forward (SMPL); in base_link: x forward, y left, z up (REP-103).
    for (in_base_link, in_pelvis) in [(Vector3::x(), Vector3::z()), (Vector3::y(), Vector3::x()), (Vector3::z(), Vector3::y())] {
        assert!((pelvis_from_base_link * in_base_link - in_pelvis).norm() < 1e-12);
    }
}
