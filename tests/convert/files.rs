//! What several tests convert.

use std::fs;
use std::path::Path;

use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{embedded_walk, write_bvh};
use cromosim_recording::rigid::PoseTrajectory;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

/// The embedded walk as walk.bvh.
pub fn walk(folder: &Path, seconds: f64) {
    let motion = embedded_walk().slice(2.0, Some(seconds)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    fs::write(folder.join("walk.bvh"), write_bvh(&motion, &body)).unwrap();
}

/// A body that swings and turns, at 200 Hz.
pub fn swing(seconds: f64) -> PoseTrajectory {
    let mut trajectory = PoseTrajectory::default();
    for index in 0..(200.0 * seconds) as i64 {
        let time = index as f64 / 200.0;
        trajectory.stamps.push(Stamp::from_nanos(
            1_700_000_000_000_000_000 + index * 5_000_000,
        ));
        trajectory.positions.push(Vector3::new(
            0.3 * (2.1 * time).sin(),
            0.2 * (3.3 * time).cos(),
            1.0 + 0.1 * (1.3 * time).sin(),
        ));
        let axis = Vector3::new(
            (0.7 * time).sin(),
            (1.9 * time).cos(),
            0.5 * (1.1 * time).sin(),
        );
        trajectory
            .rotations
            .push(UnitQuaternion::from_scaled_axis(axis));
    }
    trajectory
}

pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Rows without comments, in which formats differ.
pub fn rows(path: &Path) -> Vec<String> {
    fs::read_to_string(path)
        .unwrap()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(str::to_owned)
        .collect()
}
