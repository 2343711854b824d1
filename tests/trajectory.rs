//! `cromosim trajectory`: a shot that the test makes, as files, becomes a motion that walks where
//! the person walked.
#![allow(clippy::unwrap_used, dead_code)]

mod common;
#[path = "../nodes/lib/motion/tests/common/containers.rs"]
mod containers;
#[path = "../nodes/lib/video/tests/shot/mod.rs"]
mod shot;

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{cromosim_in, succeed, text};
use containers::Py;
use cromosim_arrays::NpzWriter;
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk, read_motion, write_bvh};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_ros::testing::{environment, in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RosArgs};
use cromosim_video::standing_height;
use nalgebra::{UnitQuaternion, Vector3};
use shot::Shot;

/// The shot's files: poses.bvh, poses.pkl as VIBE writes it, and in one folder keypoints, depth
/// maps and cameras.
fn write_files(shot: &Shot, walk: &SmplMotion, folder: &Path) {
    fs::create_dir(folder.join("shot")).unwrap();
    for (frame, depth) in shot.depths.iter().enumerate() {
        let path = |name: String| folder.join("shot").join(name);
        if let Some(depth) = depth {
            fs::write(
                path(format!("frame_{frame:06}.raw")),
                shot::disparity_file(depth),
            )
            .unwrap();
        }
        let camera = shot.clip.cameras[frame].unwrap();
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.floats("intrinsics", &[2], camera.focal_px.as_slice())
            .unwrap();
        npz.floats(
            "extrinsics",
            &[4, 4],
            camera
                .world_from_camera
                .to_homogeneous()
                .transpose()
                .as_slice(),
        )
        .unwrap();
        fs::write(
            path(format!("frame_{frame:06}.npz")),
            npz.finish().unwrap().into_inner(),
        )
        .unwrap();
        let people: Vec<_> = shot.clip.keypoints[frame].into_iter().collect();
        fs::write(
            path(format!("clip_{frame:012}_keypoints.json")),
            shot::keypoint_file(&people),
        )
        .unwrap();
    }
    let world_from_camera =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let mut frames = shot.clip.poses.clone();
    for pose in &mut frames {
        pose.local_rotations[0] = world_from_camera * pose.local_rotations[0];
        pose.root_position = Vector3::new(0.0, 0.0, 1.0);
    }
    let in_place = SmplMotion {
        frames,
        rate_hz: shot.clip.rate_hz,
        ..walk.clone()
    };
    let body = ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap();
    fs::write(folder.join("poses.bvh"), write_bvh(&in_place, &body)).unwrap();
    let angles: Vec<f64> = shot
        .clip
        .poses
        .iter()
        .flat_map(|pose| pose.axis_angles())
        .flat_map(|angle| [angle.x, angle.y, angle.z])
        .collect();
    let count = shot.clip.poses.len();
    let person = Py::named(&[
        ("pose", Py::rows(&angles, 72)),
        ("betas", Py::rows(&vec![0.0; 10 * count], 10)),
        (
            "frame_ids",
            Py::List((0..count as i64).map(Py::Int).collect()),
        ),
    ]);
    fs::write(
        folder.join("poses.pkl"),
        Py::Dict(vec![(Py::Int(1), person)]).pickle(),
    )
    .unwrap();
}

fn way(poses: &[BodyPose]) -> f64 {
    (poses[poses.len() - 1].root_position - poses[0].root_position)
        .xy()
        .norm()
}

/// What a command needs to read the shot: where its files are, and what is in them.
fn options(shot: &Shot, walk: &SmplMotion) -> Vec<String> {
    let height = standing_height(&ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap());
    let (image, map) = (
        shot.clip.keypoint_image_px,
        shot.clip.cameras[0].unwrap().image_px,
    );
    let size = |size: nalgebra::Vector2<f64>| format!("{}x{}", size.x, size.y);
    let known = [
        "--keypoints",
        "shot",
        "--depth",
        "shot",
        "--cameras",
        "shot",
        "--camera-axes",
        "opencv",
        "--depth-encoding",
        "disparity",
    ];
    let made = [
        "--image".to_owned(),
        size(image),
        "--camera-image".to_owned(),
        size(map),
        "--body-height".to_owned(),
        height.to_string(),
    ];
    known.map(str::to_owned).into_iter().chain(made).collect()
}

#[test]
fn a_videos_own_estimates_become_a_bag_with_their_confidence_that_replay_plays() {
    in_private_network(
        "a_videos_own_estimates_become_a_bag_with_their_confidence_that_replay_plays",
        || {
            let walk = embedded_walk().slice(1.0, Some(3.0)).unwrap();
            let shot = shot::shoot(&walk, &shot::PUBLISHED, 0.6, 4);
            let folder = tempfile::tempdir().unwrap();
            write_files(&shot, &walk, folder.path());
            let options = options(&shot, &walk);
            let run = |out: &str| {
                let fixed = ["trajectory", "poses.pkl", out].into_iter();
                succeed(
                    folder.path(),
                    &fixed
                        .chain(options.iter().map(String::as_str))
                        .collect::<Vec<_>>(),
                )
            };
            println!("{}", run("world.mcap"));
            run("world.npz");
            let bag = BagReader::open(&folder.path().join("world.mcap")).unwrap();
            let written: Vec<SmplPose> = bag
                .read::<SmplPose>("/smpl/pose")
                .unwrap()
                .into_iter()
                .map(|(_, pose)| pose)
                .collect();
            let motion =
                read_motion(&folder.path().join("world.npz"), &MotionOptions::default()).unwrap();
            assert_eq!(
                (written.len(), motion.frames.len()),
                (shot.truth.len(), shot.truth.len())
            );
            for (pose, frame) in written.iter().zip(&motion.frames) {
                let (position, rotations) = pose.root_and_rotations().unwrap();
                assert!(
                    (position - frame.root_position).norm() < 1e-6
                        && rotations[5].angle_to(&frame.local_rotations[5]) < 1e-6
                );
            }
            let (truth, found) = (way(&shot.truth), way(&motion.frames));
            println!("way of the pelvis: {truth:.3} m, found {found:.3} m");
            assert!((found / truth - 1.0).abs() < 0.15);
            // How well the place is known differs from frame to frame; an npz cannot say so.
            let (least, most) = written
                .iter()
                .fold((1.0_f64, 0.0_f64), |(low, high), pose| {
                    (low.min(pose.confidence), high.max(pose.confidence))
                });
            println!("confidence {least:.3} to {most:.3}");
            assert!(least > 0.0 && most < 1.0 && most - least > 0.01);
            assert!(motion.confidence.is_none());

            // The bag as a motion again, and as replay publishes it.
            succeed(folder.path(), &["convert", "world.mcap", "again.npz"]);
            let again =
                read_motion(&folder.path().join("again.npz"), &MotionOptions::default()).unwrap();
            assert!(
                (again.rate_hz - motion.rate_hz).abs() < 1e-5
                    && again.frames.len() == motion.frames.len()
            );
            let args = RosArgs::parse(Vec::<String>::new()).unwrap();
            let observer = Node::start(
                NodeOptions::new("observer", &args, &Parameters::new())
                    .unwrap()
                    .network(network()),
            )
            .unwrap();
            let poses = observer
                .subscription::<SmplPose>("/smpl/pose", Qos::recorder().depth(5000))
                .unwrap();
            let mut replay = Command::new(common::CROMOSIM);
            replay.args([
                "node",
                "replay",
                "--ros-args",
                "-p",
                "bag:=world.mcap",
                "-p",
                "rate:=3.0",
                "-p",
                "ready_subscriptions:=1",
            ]);
            let mut replay = replay
                .current_dir(folder.path())
                .envs(environment())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            let mut received = Vec::new();
            while received.len() < written.len() {
                let Some(message) = poses.recv_timeout(Duration::from_secs(30)).unwrap() else {
                    break;
                };
                received.push(message.message);
            }
            let _ = replay.kill();
            let _ = replay.wait();
            assert!(
                received == written,
                "{} of {} poses",
                received.len(),
                written.len()
            );
        },
    );
}

#[test]
fn in_place_poses_walk_where_the_person_walked() {
    let walk = embedded_walk().slice(1.0, Some(5.0)).unwrap();
    let shot = shot::shoot(&walk, &shot::PUBLISHED, 0.6, 4);
    let folder = tempfile::tempdir().unwrap();
    write_files(&shot, &walk, folder.path());
    let height = standing_height(&ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap());
    let (image, map) = (
        shot.clip.keypoint_image_px,
        shot.clip.cameras[0].unwrap().image_px,
    );
    let [image, map, height] = [
        format!("{}x{}", image.x, image.y),
        format!("{}x{}", map.x, map.y),
        height.to_string(),
    ];
    let files = [
        "--keypoints",
        "shot",
        "--depth",
        "shot",
        "--cameras",
        "shot",
        "--image",
        &image,
        "--camera-image",
        &map,
    ];
    let forms = [
        "--camera-axes",
        "opencv",
        "--depth-encoding",
        "disparity",
        "--up-axis",
        "y",
    ];
    let run = |out: &str, more: &[&str]| {
        succeed(
            folder.path(),
            &[&["trajectory", "poses.bvh", out], &files[..], &forms, more].concat(),
        )
    };
    let said = run("world.bvh", &["--body-height", &height]);
    println!("{said}");
    run("lite.bvh", &["--trajectory", "none"]);
    let path = |motion: &SmplMotion| {
        let [first, last] = [&motion.frames[0], &motion.frames[motion.frames.len() - 1]]
            .map(|pose| pose.root_position.xy());
        (last - first).norm()
    };
    let [world, lite] = ["world.bvh", "lite.bvh"]
        .map(|name| read_motion(&folder.path().join(name), &MotionOptions::default()).unwrap());
    let truth = (shot.truth[shot.truth.len() - 1].root_position - shot.truth[0].root_position)
        .xy()
        .norm();
    println!(
        "way of the pelvis: {truth:.3} m, found {:.3} m, in place {:.3} m",
        path(&world),
        path(&lite)
    );
    assert_eq!(world.frames.len(), shot.truth.len());
    assert!((path(&world) / truth - 1.0).abs() < 0.1 && path(&lite) < 0.01);

    let refused = cromosim_in(
        folder.path(),
        &[&["trajectory", "poses.bvh", "x.bvh"], &files[..], &forms].concat(),
    );
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused).contains("--body-height, or --scale"),
        "{}",
        text(&refused)
    );
}
