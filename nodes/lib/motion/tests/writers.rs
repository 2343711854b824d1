//! What is written can be read back: BVH, TRC, AMASS' keys.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::Cursor;
use std::path::Path;

use common::known::known_motion;
use common::quantile;
use cromosim_arrays::NpzReader;
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_motion::{
    MarkerSet, MotionOptions, embedded_walk, parse_bvh, parse_trc, place_markers, retarget,
    write_amass, write_bvh, write_trc,
};
use nalgebra::Vector3;

#[test]
fn a_motion_comes_back_from_its_own_skeleton() {
    let known = known_motion(true);
    let body = ShapedBody::new(BodyModel::embedded(), &known.betas).unwrap();
    let text = write_bvh(&known, &body);
    let read = retarget(
        &parse_bvh(&text, "written.bvh").unwrap(),
        body.model(),
        &MotionOptions::default(),
    )
    .unwrap();
    let report = read.report.clone().unwrap();
    assert_eq!(
        (
            report.map.as_str(),
            report.up_axis.as_str(),
            report.rest.as_str()
        ),
        ("smpl", "+y", "zero pose")
    );
    assert!(
        (report.unit_scale_m - 0.01).abs() < 1e-9 && (read.rate_hz - known.rate_hz).abs() < 1e-9
    );
    assert_eq!(read.frames.len(), known.frames.len());
    let mut angles = Vec::new();
    let mut root: f64 = 0.0;
    for (a, b) in read.frames.iter().zip(&known.frames) {
        let (a_world, b_world) = (a.world_rotations(), b.world_rotations());
        angles.extend(Joint::ALL.map(|joint| {
            a_world[joint.index()]
                .angle_to(&b_world[joint.index()])
                .to_degrees()
        }));
        let moved = (a.root_position - read.frames[0].root_position)
            - (b.root_position - known.frames[0].root_position);
        root = root.max(moved.norm());
    }
    let (median, high) = (quantile(&angles, 0.5), quantile(&angles, 0.95));
    println!(
        "SMPL BVH: segments median {median:.3} deg, 95 % {high:.3} deg, root {root:.4} m; {report}"
    );
    assert!(median < 0.01 && high < 0.1 && root < 1e-3);
}

#[test]
fn markers_come_back_from_trc() {
    let walk = embedded_walk().slice(1.0, Some(0.2)).unwrap();
    let set = MotionOptions::default().markers_set().unwrap();
    let mut clip = place_markers(&walk, &BodyModel::embedded(), &set).unwrap();
    clip.frames[1][3] = None;
    let read = parse_trc(&write_trc(&clip), "written.trc").unwrap();
    assert_eq!((&read.labels, read.rate_hz), (&clip.labels, clip.rate_hz));
    for (a, b) in read
        .frames
        .iter()
        .flatten()
        .zip(clip.frames.iter().flatten())
    {
        assert_eq!(a.is_some(), b.is_some());
        assert!(a.zip(*b).is_none_or(|(a, b)| (a - b).norm() < 1e-9));
    }
    assert_eq!(read.frames.len(), clip.frames.len());
    assert!(
        MarkerSet::embedded()
            .unwrap()
            .iter()
            .any(|known| known.name() == set.name())
    );
}

#[test]
fn amass_keys_hold_the_motion_and_name_the_body() {
    let walk = embedded_walk().slice(1.0, Some(0.5)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &walk.betas).unwrap();
    let bytes = write_amass(&walk, &body, Cursor::new(Vec::new()))
        .unwrap()
        .into_inner();
    assert_eq!(
        bytes,
        write_amass(&walk, &body, Cursor::new(Vec::new()))
            .unwrap()
            .into_inner()
    );
    let mut npz = NpzReader::new(Cursor::new(&bytes[..]), Path::new("walk.npz")).unwrap();
    let poses = npz
        .floats("poses", &[Some(walk.frames.len()), Some(72)], "(N, 72)")
        .unwrap()
        .unwrap()
        .values;
    let trans = npz
        .floats("trans", &[Some(walk.frames.len()), Some(3)], "(N, 3)")
        .unwrap()
        .unwrap()
        .values;
    for (frame, pose) in walk.frames.iter().enumerate() {
        let position =
            body.root_position(Vector3::from_row_slice(&trans[3 * frame..3 * frame + 3]));
        assert!((position - pose.root_position).norm() < 1e-12);
        let angles = |joint: usize| {
            Vector3::from_row_slice(&poses[72 * frame + 3 * joint..72 * frame + 3 * joint + 3])
        };
        let read =
            cromosim_body::BodyPose::from_axis_angles(position, &std::array::from_fn(angles));
        assert!(Joint::ALL.iter().all(|joint| {
            read.local_rotations[joint.index()].angle_to(&pose.local_rotations[joint.index()])
                < 1e-7
        }));
    }
    assert_eq!(
        npz.at("mocap_framerate").unwrap().float().unwrap(),
        walk.rate_hz
    );
    assert_eq!(
        npz.text("surface_model_type").unwrap().as_deref(),
        Some("cromosim")
    );
    assert_eq!(
        npz.text("body").unwrap().as_deref(),
        Some(body.model().id())
    );
}
