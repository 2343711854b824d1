//! The sample files of SMPL parameters, the body that they are for, and the joints that Python finds.
#![allow(dead_code, clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::common::own_file;
use cromosim_arrays::Container;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{PoseReport, SmplMotion};
use nalgebra::Vector3;

pub fn sample(name: &str) -> PathBuf {
    own_file("poses").join(name)
}

pub fn body(name: &str) -> Arc<BodyModel> {
    BodyModel::read(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../body/tests/data")
            .join(name),
    )
    .unwrap()
}

pub fn smplh() -> Arc<BodyModel> {
    body("model_smplh_female.npz")
}

/// The joints in the world, m.
pub fn joints(motion: &SmplMotion, body: &Arc<BodyModel>) -> Vec<[Vector3<f64>; 24]> {
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

pub fn farthest(left: &[[Vector3<f64>; 24]], right: &[[Vector3<f64>; 24]]) -> f64 {
    assert_eq!(left.len(), right.len());
    left.iter()
        .flatten()
        .zip(right.iter().flatten())
        .map(|(left, right)| (left - right).norm())
        .fold(0.0, f64::max)
}

pub fn report(motion: &SmplMotion) -> &PoseReport {
    motion.poses.as_ref().unwrap()
}

/// What Python finds for a file: (N, 24, 3).
pub fn expected(name: &str) -> Vec<[Vector3<f64>; 24]> {
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
