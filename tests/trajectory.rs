//! `cromosim trajectory`: a shot that the test makes, as files, becomes a motion that walks where the person walked.
#![allow(clippy::unwrap_used, dead_code)]

mod common;
#[path = "../nodes/lib/motion/tests/common/shot.rs"]
mod shot;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use common::{cromosim_in, succeed, text};
use cromosim_arrays::NpzWriter;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::camera::{DepthEncoding, standing_height, write_openpose, write_raw_depth};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk, read_motion, write_bvh};
use nalgebra::{UnitQuaternion, Vector3};
use shot::Shot;

/// The shot's files: poses.bvh, and in one folder keypoints, depth maps and cameras.
fn write_files(shot: &Shot, walk: &SmplMotion, folder: &Path) {
    fs::create_dir(folder.join("shot")).unwrap();
    for (frame, depth) in shot.depths.iter().enumerate() {
        let path = |name: String| folder.join("shot").join(name);
        if let Some(depth) = depth {
            fs::write(path(format!("frame_{frame:06}.raw")), write_raw_depth(depth, DepthEncoding::Disparity)).unwrap();
        }
        let camera = shot.clip.cameras[frame].unwrap();
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.floats("intrinsics", &[2], camera.focal_px.as_slice()).unwrap();
        npz.floats("extrinsics", &[4, 4], camera.world_from_camera.to_homogeneous().transpose().as_slice()).unwrap();
        fs::write(path(format!("frame_{frame:06}.npz")), npz.finish().unwrap().into_inner()).unwrap();
        let people: Vec<_> = shot.clip.keypoints[frame].into_iter().collect();
        fs::write(path(format!("clip_{frame:012}_keypoints.json")), write_openpose(&people)).unwrap();
    }
    let world_from_camera = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let mut frames = shot.clip.poses.clone();
    for pose in &mut frames {
        pose.local_rotations[0] = world_from_camera * pose.local_rotations[0];
        pose.root_position = Vector3::new(0.0, 0.0, 1.0);
    }
    let in_place = SmplMotion { frames, rate_hz: shot.clip.rate_hz, ..walk.clone() };
    let body = ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap();
    fs::write(folder.join("poses.bvh"), write_bvh(&in_place, &body)).unwrap();
}

#[test]
fn in_place_poses_walk_where_the_person_walked() {
    let walk = embedded_walk().slice(1.0, Some(5.0)).unwrap();
    let shot = shot::shoot(&walk, &shot::PUBLISHED, 0.6, 4);
    let folder = tempfile::tempdir().unwrap();
    write_files(&shot, &walk, folder.path());
    let height = standing_height(&ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap());
    let (image, map) = (shot.clip.keypoint_image_px, shot.clip.cameras[0].unwrap().image_px);
    let [image, map, height] = [format!("{}x{}", image.x, image.y), format!("{}x{}", map.x, map.y), height.to_string()];
    let files = ["--keypoints", "shot", "--depth", "shot", "--cameras", "shot", "--image", &image, "--camera-image", &map];
    let forms = ["--camera-axes", "opencv", "--depth-encoding", "disparity", "--up-axis", "y"];
    let run = |out: &str, more: &[&str]| succeed(folder.path(), &[&["trajectory", "poses.bvh", out], &files[..], &forms, more].concat());
    let said = run("world.bvh", &["--body-height", &height]);
    println!("{said}");
    run("lite.bvh", &["--trajectory", "none"]);
    let path = |motion: &SmplMotion| {
        let [first, last] = [&motion.frames[0], &motion.frames[motion.frames.len() - 1]].map(|pose| pose.root_position.xy());
        (last - first).norm()
    };
    let [world, lite] = ["world.bvh", "lite.bvh"].map(|name| read_motion(&folder.path().join(name), &MotionOptions::default()).unwrap());
    let truth = (shot.truth[shot.truth.len() - 1].root_position - shot.truth[0].root_position).xy().norm();
    println!("way of the pelvis: {truth:.3} m, found {:.3} m, in place {:.3} m", path(&world), path(&lite));
    assert_eq!(world.frames.len(), shot.truth.len());
    assert!((path(&world) / truth - 1.0).abs() < 0.1 && path(&lite) < 0.01);

    let refused = cromosim_in(folder.path(), &[&["trajectory", "poses.bvh", "x.bvh"], &files[..], &forms].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused).contains("--body-height, or --scale"), "{}", text(&refused));
}
