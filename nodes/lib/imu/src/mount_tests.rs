#![allow(clippy::unwrap_used)]
use std::sync::LazyLock;

use cromosim_body::{BodyModel, JOINT_COUNT};
use cromosim_spatial::so3;

use super::*;
use crate::PlacementSet;

static BODY: LazyLock<ShapedBody> =
    LazyLock::new(|| ShapedBody::new(BodyModel::embedded(), &[0.5, -0.3]).unwrap());

/// Parses one placement from its fields.
fn placement(fields: &str) -> Placement {
    let text = format!(
        "schema: cromosim/placements/1\nplacements: {{here: {{rate_hz: 100, {fields}}}}}\n"
    );
    PlacementSet::parse(&text, "test")
        .unwrap()
        .get("here")
        .unwrap()
        .clone()
}

fn mounted(fields: &str) -> MountedSensor {
    MountedSensor::new(&BODY, &placement(fields)).unwrap()
}

/// Turned joints everywhere, the pelvis too.
fn bent() -> BodyPose {
    bent_by(0.0)
}

/// As [`bent`], each time another way.
fn bent_by(phase: f64) -> BodyPose {
    let mut pose = BodyPose::rest(Vector3::new(1.0, 2.0, 0.9));
    for k in 0..JOINT_COUNT {
        let k_f = k as f64 + phase;
        pose.local_rotations[k] = so3::exp(
            &(Vector3::new((k_f * 1.7).sin(), (k_f * 2.3).cos(), (k_f * 0.9).sin()) * 0.4),
        );
    }
    pose
}

#[test]
fn at_rest_the_frame_stands_on_the_skin_along_the_bone() {
    let site = mounted("site: left_watch");
    let frame = site.pose(&BodyPose::rest(BODY.joints_in_model()[0]));
    let [x, y, z] =
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| frame.world_from_sensor * axis);
    // The body lies with its model axes along the world's: the left arm points to +x, its back of
    // the hand up (+y).
    assert!(z.dot(&Vector3::y()) > 0.95, "out of the skin: {z}");
    assert!(x.dot(&Vector3::x()) > 0.95, "towards the hand: {x}");
    assert!((y - z.cross(&x)).norm() < 1e-12);
    assert!((z - frame.normal_in_world).norm() < 1e-12);
    let on_skin = BODY.site_in_model(site.site()).unwrap();
    assert!((frame.world_from_sensor.translation.vector - on_skin).norm() < 1e-6);
    assert_eq!(site.joint(), Joint::LeftElbow);
}

#[test]
fn at_rest_skin_and_segment_agree_and_give_the_mount() {
    for set in [PlacementSet::demo(), PlacementSet::full17()] {
        let pose = BodyPose::rest(Vector3::new(0.3, -0.4, 1.0));
        for site in MountedSensors::new(&BODY, set.placements())
            .unwrap()
            .sensors()
        {
            let world_from_segment = BODY.world_from_segments(&pose)[site.joint().index()];
            let by_segment = world_from_segment * site.segment_from_sensor();
            let by_skin = site.pose(&pose).world_from_sensor;
            assert!(
                (by_segment.translation.vector - by_skin.translation.vector).norm() < 1e-6,
                "{}",
                site.name()
            );
            assert!(
                by_segment.rotation.angle_to(&by_skin.rotation) < 1e-4,
                "{}",
                site.name()
            );
        }
    }
}

#[test]
fn a_segments_follower_is_rigid_and_a_skins_follower_nearly() {
    let (rigid, soft) = (
        mounted("site: right_shank_front, follow: segment"),
        mounted("site: right_shank_front"),
    );
    let pose = bent();
    let world_from_segment = BODY.world_from_segments(&pose)[rigid.joint().index()];
    let expected = world_from_segment * rigid.segment_from_sensor();
    let (rigid, soft) = (rigid.pose(&pose), soft.pose(&pose));
    assert!(
        (rigid.world_from_sensor.translation.vector - expected.translation.vector).norm() < 1e-12
    );
    assert!(
        rigid
            .world_from_sensor
            .rotation
            .angle_to(&expected.rotation)
            < 1e-7
    );
    let (moved, turned) = (
        (soft.world_from_sensor.translation.vector - expected.translation.vector).norm(),
        soft.world_from_sensor.rotation.angle_to(&expected.rotation),
    );
    assert!(
        moved > 1e-6 && moved < 0.02 && turned > 1e-6 && turned < 0.2,
        "{moved} m, {turned} rad"
    );
}

#[test]
fn turning_the_whole_body_turns_the_frames() {
    let turn = Isometry3::from_parts(
        Vector3::new(0.0, -3.0, 0.5).into(),
        so3::exp(&Vector3::new(0.7, -1.0, 2.0)),
    );
    let pose = bent();
    let mut turned = pose.clone();
    turned.root_position = (turn * nalgebra::Point3::from(pose.root_position)).coords;
    turned.local_rotations[0] = turn.rotation * pose.local_rotations[0];
    for placement in PlacementSet::full17().placements() {
        let site = MountedSensor::new(&BODY, placement).unwrap();
        let (before, after) = (
            turn * site.pose(&pose).world_from_sensor,
            site.pose(&turned).world_from_sensor,
        );
        assert!(
            (before.translation.vector - after.translation.vector).norm() < 1e-9,
            "{}",
            site.name()
        );
        assert!(
            before.rotation.angle_to(&after.rotation) < 1e-7,
            "{}",
            site.name()
        );
    }
}

#[test]
fn mount_and_distance_act_in_the_sites_frame() {
    let pose = bent();
    let plain = mounted("site: sternum").pose(&pose);
    let turned = mounted("site: sternum, skin_distance: 0.03, mount: {rotvec: [0.2, -0.5, 1.0]}")
        .pose(&pose);
    let expected = plain.world_from_sensor.rotation * so3::exp(&Vector3::new(0.2, -0.5, 1.0));
    assert!(turned.world_from_sensor.rotation.angle_to(&expected) < 1e-7);
    let step =
        turned.world_from_sensor.translation.vector - plain.world_from_sensor.translation.vector;
    assert!((step - plain.normal_in_world * 0.03).norm() < 1e-12);
    assert!((turned.normal_in_world - plain.normal_in_world).norm() < 1e-12);
}

#[test]
fn sites_are_chosen_by_triangle_and_by_point_too() {
    let named = mounted("site: left_shank_front");
    let Site {
        triangle,
        barycentrics: [a, b, c],
        ..
    } = *named.site();
    let same = mounted(&format!(
        "triangle: {triangle}, barycentrics: [{a}, {b}, {c}]"
    ));
    let pose = bent();
    assert!(
        (named.pose(&pose).world_from_sensor.translation.vector
            - same.pose(&pose).world_from_sensor.translation.vector)
            .norm()
            < 1e-9
    );
    let near = mounted("point: [0.092, -0.8736, 0.06]");
    assert_eq!(near.joint(), named.joint());
    assert!(
        (BODY.site_in_model(near.site()).unwrap() - BODY.site_in_model(named.site()).unwrap())
            .norm()
            < 0.02
    );
}

#[test]
fn sites_that_the_body_lacks_are_refused_by_name() {
    let refusal = |fields: &str| {
        MountedSensor::new(&BODY, &placement(fields))
            .unwrap_err()
            .to_string()
    };
    let unknown = refusal("site: left_wach");
    assert!(
        unknown.starts_with("placement `here`: ") && unknown.contains("left_watch"),
        "{unknown}"
    );
    assert!(
        refusal("triangle: 99999999, barycentrics: [1, 0, 0]").starts_with("placement `here`: ")
    );
    assert!(refusal("triangle: 3, barycentrics: [1, 1, 0]").starts_with("placement `here`: "));
}

#[test]
fn evaluated_together_or_alone_frames_are_the_same() {
    let set = PlacementSet::full17();
    let together = MountedSensors::new(&BODY, set.placements()).unwrap();
    let pose = bent();
    for (site, frame) in together.sensors().iter().zip(together.poses(&pose)) {
        assert_eq!(site.pose(&pose), frame, "{}", site.name());
    }
    let stamps = [0.0, 0.1, 0.2].map(Stamp::from_seconds);
    let trajectories = together
        .trajectories(&stamps, &[pose.clone(), pose.clone(), pose])
        .unwrap();
    assert_eq!(
        (trajectories.len(), trajectories[0].frames().len()),
        (17, 3)
    );
}

#[test]
fn beside_other_poses_frames_have_the_bytes_that_they_have_alone() {
    let mut placements = PlacementSet::full17().placements().to_vec();
    placements.push(placement("site: sternum, follow: segment"));
    placements.push(placement("site: left_watch, skin_distance: 0.02"));
    let together = MountedSensors::new(&BODY, &placements).unwrap();
    let bytes = |frame: &SensorFrame| {
        let SensorFrame {
            world_from_sensor: it,
            normal_in_world: normal,
            ..
        } = frame;
        let (turn, place) = (it.rotation.coords, it.translation.vector);
        let numbers = turn.iter().chain(&place).chain(normal);
        numbers.map(|number| number.to_bits()).collect::<Vec<_>>()
    };
    for count in [2, 7, 8, 9, 37] {
        let poses: Vec<_> = (0..count).map(|k| bent_by(0.7 * f64::from(k))).collect();
        let stamps = (0..count).map(|k| Stamp::from_seconds(0.1 * f64::from(k)));
        let stamps: Vec<_> = stamps.collect();
        let trajectories = together.trajectories(&stamps, &poses).unwrap();
        for (sensor, trajectory) in together.sensors().iter().zip(trajectories) {
            assert_eq!(trajectory.frames().len(), poses.len());
            for ((frame, pose), stamp) in trajectory.frames().iter().zip(&poses).zip(&stamps) {
                assert_eq!(frame.stamp, *stamp);
                let alone = sensor.pose(pose).at(*stamp);
                assert_eq!(bytes(frame), bytes(&alone), "{}", sensor.name());
            }
        }
    }
}
