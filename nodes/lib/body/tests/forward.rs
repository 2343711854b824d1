//! The embedded body against SMPL's reference implementation and against itself.
#![allow(clippy::unwrap_used, missing_docs)]

use std::path::{Path, PathBuf};

use cromosim_arrays::NpzReader;
use cromosim_body::{
    BodyModel, BodyPose, Joint, PosesInLanes, ShapedBody, VertexSubset, VisitPoses, lanes,
};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn points(values: &[f64]) -> Vec<Vector3<f64>> {
    values
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&point| Vector3::from(point))
        .collect()
}

/// From SMPL's parameters: axis-angles (24, 3) and trans.
fn body_pose(body: &ShapedBody, axis_angles: &[f64], trans: Vector3<f64>) -> BodyPose {
    let axis_angles = points(axis_angles);
    BodyPose::from_axis_angles(
        body.root_position(trans),
        &std::array::from_fn(|joint| axis_angles[joint]),
    )
}

fn largest_difference(found: &[Vector3<f64>], expected: &[Vector3<f64>]) -> f64 {
    assert_eq!(found.len(), expected.len());
    found
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

fn skinned(body: &ShapedBody, pose: &BodyPose) -> Vec<Vector3<f64>> {
    let mut vertices = Vec::new();
    body.skin(pose, &mut vertices);
    vertices
        .into_iter()
        .map(|vertex| Vector3::from(vertex.map(f64::from)))
        .collect()
}

fn joint_positions(body: &ShapedBody, pose: &BodyPose) -> Vec<Vector3<f64>> {
    body.world_from_segments(pose)
        .iter()
        .map(|world_from_segment| world_from_segment.translation.vector)
        .collect()
}

fn all_vertices(body: &ShapedBody) -> Vec<u32> {
    (0..body.model().vertex_count() as u32).collect()
}

/// A vigorous pose, the same at every call.
fn some_pose(seed: u64, amplitude: f64) -> BodyPose {
    let mut state = seed;
    let mut uniform = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    };
    let mut vector = || Vector3::from_fn(|_, _| uniform());
    let root_position = vector();
    BodyPose::from_axis_angles(
        root_position,
        &std::array::from_fn(|_| vector() * amplitude),
    )
}

#[test]
fn crosscheck_by_the_reference_implementation() {
    let mut npz = NpzReader::open(&data("crosscheck.npz")).unwrap();
    let mut floats = |key: &str, dimensions: usize| {
        npz.floats(key, &vec![None; dimensions], "")
            .unwrap()
            .unwrap()
            .values
    };
    let body = ShapedBody::new(BodyModel::embedded(), &floats("betas", 1)).unwrap();
    let pose = body_pose(&body, &floats("pose", 2), points(&floats("trans", 1))[0]);
    let (vertices, joints) = (points(&floats("verts", 2)), points(&floats("joints", 2)));

    let joint_error = largest_difference(&joint_positions(&body, &pose), &joints);
    let subset_error = largest_difference(
        &body.subset(&all_vertices(&body)).unwrap().positions(&pose),
        &vertices,
    );
    let skin_error = largest_difference(&skinned(&body, &pose), &vertices);
    println!(
        "crosscheck: joints {joint_error:.2e} m, f64 vertices {subset_error:.2e} m, f32 vertices {skin_error:.2e} m"
    );
    assert!(joint_error < 1e-8);
    assert!(subset_error < 1e-5);
    assert!(skin_error < 1e-5);
}

#[test]
fn fifty_poses_and_shapes_by_the_reference_implementation() {
    let mut npz = NpzReader::open(&data("smplx_golden.npz")).unwrap();
    let mut floats = |key: &str, dimensions: usize| {
        npz.floats(key, &vec![None; dimensions], "")
            .unwrap()
            .unwrap()
            .values
    };
    let (axis_angles, betas, trans) = (
        floats("pose", 3),
        floats("betas", 2),
        points(&floats("trans", 2)),
    );
    let (vertices, joints) = (points(&floats("vertices", 3)), points(&floats("joints", 3)));
    let ids: Vec<u32> = npz
        .integers("vertex_ids", &[None], "")
        .unwrap()
        .unwrap()
        .values
        .iter()
        .map(|&id| id as u32)
        .collect();
    assert_eq!((trans.len(), ids.len()), (50, 200));

    let (mut joint_error, mut subset_error, mut skin_error): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for frame in 0..trans.len() {
        let body =
            ShapedBody::new(BodyModel::embedded(), &betas[10 * frame..10 * frame + 10]).unwrap();
        let pose = body_pose(
            &body,
            &axis_angles[72 * frame..72 * frame + 72],
            trans[frame],
        );
        let skin = skinned(&body, &pose);
        let skin: Vec<_> = ids.iter().map(|&id| skin[id as usize]).collect();
        let (vertices, joints) = (
            &vertices[200 * frame..200 * frame + 200],
            &joints[24 * frame..24 * frame + 24],
        );
        joint_error = joint_error.max(largest_difference(&joint_positions(&body, &pose), joints));
        subset_error = subset_error.max(largest_difference(
            &body.subset(&ids).unwrap().positions(&pose),
            vertices,
        ));
        skin_error = skin_error.max(largest_difference(&skin, vertices));
    }
    println!(
        "golden: joints {joint_error:.2e} m, f64 vertices {subset_error:.2e} m, f32 vertices {skin_error:.2e} m"
    );
    // The reference adds 1e-8 to each rotation vector before it takes the angle: that is the
    // joints' nanometres.
    assert!(joint_error < 1e-7);
    assert!(subset_error < 1e-5);
    assert!(skin_error < 1e-5);
}

#[test]
fn skin_and_subset_agree_on_the_whole_mesh() {
    let body = ShapedBody::new(BodyModel::embedded(), &[1.0, -2.0, 0.5]).unwrap();
    let subset = body.subset(&all_vertices(&body)).unwrap();
    for seed in 0..10 {
        let pose = some_pose(seed, 0.8);
        let difference = largest_difference(&skinned(&body, &pose), &subset.positions(&pose));
        println!("f32 against f64: {difference:.2e} m");
        assert!(difference < 2e-6, "{difference} m");
    }
}

#[test]
fn segments_that_are_not_asked_for_change_no_vertex() {
    let body = ShapedBody::new(BodyModel::embedded(), &[0.5]).unwrap();
    let vertices = [0, 1234, 5678];
    let all = body.subset(&vertices).unwrap();
    let few = all.clone().with_segments_of([Joint::LeftFoot]);
    let (mut expected, mut found) = (Vec::new(), Vec::new());
    for seed in 0..10 {
        let pose = some_pose(seed, 0.8);
        let segments = all.positions_and_segments_into(&pose, &mut expected);
        let of_few = few.positions_and_segments_into(&pose, &mut found);
        assert_eq!(expected, found);
        let foot = Joint::LeftFoot.index();
        assert_eq!(segments[foot], of_few[foot]);
        assert_eq!(segments, body.world_from_segments(&pose));
        // Else nothing was saved.
        assert!(of_few.contains(&Isometry3::identity()));
    }
}

#[test]
fn poses_beside_each_other_are_what_each_is_alone() {
    let body = ShapedBody::new(BodyModel::embedded(), &[0.5]).unwrap();
    let vertices: Vec<u32> = (0..40).map(|k| 170 * k).collect();
    let asked = [Joint::LeftFoot, Joint::Head];
    let subset = body.subset(&vertices).unwrap().with_segments_of(asked);
    for count in [0, 1, 3, 8, 19] {
        let poses: Vec<_> = (0..count).map(|seed| some_pose(seed, 0.8)).collect();
        let mut visited = 0;
        subset.visit_poses(
            &poses,
            AsEachAlone {
                subset: &subset,
                poses: &poses,
                asked,
                visited: &mut visited,
            },
        );
        assert_eq!(visited, poses.len());
    }
}

struct AsEachAlone<'a> {
    subset: &'a VertexSubset,
    poses: &'a [BodyPose],
    asked: [Joint; 2],
    visited: &'a mut usize,
}

impl VisitPoses for AsEachAlone<'_> {
    fn visit<S: pulp::Simd>(&mut self, _: S, first: usize, found: &PosesInLanes<S>) {
        assert_eq!(first, *self.visited);
        let mut expected = Vec::new();
        for lane in 0..found.count() {
            let pose = &self.poses[first + lane];
            let segments = self.subset.positions_and_segments_into(pose, &mut expected);
            let positions = found.positions().iter();
            let positions = positions.map(|it| lanes::vector_of::<S>(it, lane));
            assert_eq!(positions.collect::<Vec<_>>(), expected);
            for joint in self.asked {
                let segment = lanes::isometry_of::<S>(found.world_from_segment(joint), lane);
                assert_eq!(segment, segments[joint.index()]);
            }
        }
        *self.visited += found.count();
    }
}

#[test]
fn far_from_the_origin_only_the_last_rounding_grows() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let mut pose = some_pose(5, 0.8);
    pose.root_position = Vector3::new(50.0, -40.0, 60.0);
    let expected = body.subset(&all_vertices(&body)).unwrap().positions(&pose);
    let difference = largest_difference(&skinned(&body, &pose), &expected);
    // Half a unit in the last place of f32 is 1.9e-6 m from 32 to 64 m, on three axes, and the
    // rounding near the origin.
    assert!(difference < 4.3e-6, "{difference} m");
}

#[test]
fn a_batch_is_its_single_frames() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let poses: Vec<_> = (0..19).map(|seed| some_pose(seed, 0.5)).collect();
    let (mut batch, mut single) = (vec![[f32::NAN; 3]; 7], Vec::new());
    body.skin_batch(&poses, &mut batch);
    let count = body.model().vertex_count();
    assert_eq!(batch.len(), 19 * count);
    for (pose, of_batch) in poses.iter().zip(batch.chunks_exact(count)) {
        body.skin(pose, &mut single);
        assert_eq!(single, of_batch);
    }
}

#[test]
fn rest_pose_is_the_rest_mesh() {
    let body = ShapedBody::new(BodyModel::embedded(), &[0.3; 10]).unwrap();
    let pose = BodyPose::rest(body.root_position(Vector3::new(4.0, 5.0, 6.0)));
    let moved: Vec<_> = body
        .rest_vertices()
        .iter()
        .map(|vertex| vertex + Vector3::new(4.0, 5.0, 6.0))
        .collect();
    // The file's float32 weights sum to 1 within 1e-7.
    assert!(
        largest_difference(
            &body.subset(&all_vertices(&body)).unwrap().positions(&pose),
            &moved
        ) < 2e-7
    );
    assert!((body.trans(pose.root_position) - Vector3::new(4.0, 5.0, 6.0)).norm() < 1e-14);
    let joints = joint_positions(&body, &pose);
    for (joint, rest) in joints.iter().zip(body.joints_in_model()) {
        assert!((joint - rest - Vector3::new(4.0, 5.0, 6.0)).norm() < 1e-12);
    }
}

#[test]
fn turning_the_root_turns_everything_about_the_pelvis() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let (pose, turn) = (
        some_pose(3, 0.4),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.2, 2.0)),
    );
    let mut turned = pose.clone();
    turned.local_rotations[0] = turn * pose.local_rotations[0];
    let subset = body.subset(&all_vertices(&body)).unwrap();
    let expected: Vec<_> = subset
        .positions(&pose)
        .iter()
        .map(|vertex| pose.root_position + turn * (vertex - pose.root_position))
        .collect();
    assert!(largest_difference(&subset.positions(&turned), &expected) < 1e-12);
    let world_rotations = turned.world_rotations();
    for (world_from_segment, rotation) in body
        .world_from_segments(&turned)
        .iter()
        .zip(world_rotations)
    {
        assert!(world_from_segment.rotation.angle_to(&rotation) < 1e-12);
    }
}

#[test]
fn the_mirrored_pose_is_the_mirrored_mesh() {
    let model = BodyModel::embedded();
    let body = ShapedBody::new(model.clone(), &[0.5, 1.0, 0.0, -1.0]).unwrap();
    let mirrored = |point: &Vector3<f64>| Vector3::new(-point.x, point.y, point.z);
    // S R S with S = diag(-1, 1, 1) keeps the quaternion's x and turns y and z round.
    let mirrored_rotation = |q: UnitQuaternion<f64>| {
        UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.i, -q.j, -q.k))
    };
    let partner: Vec<u32> = model
        .template()
        .iter()
        .map(|vertex| {
            model
                .template()
                .iter()
                .position(|other| (mirrored(vertex) - other).norm() < 1e-9)
                .unwrap() as u32
        })
        .collect();
    let pose = some_pose(11, 0.6);
    let mirrored_pose = BodyPose {
        root_position: mirrored(&pose.root_position),
        local_rotations: Joint::ALL
            .map(|joint| mirrored_rotation(pose.local_rotations[joint.mirrored().index()])),
    };
    let positions = body.subset(&all_vertices(&body)).unwrap().positions(&pose);
    let of_partners = body.subset(&partner).unwrap().positions(&mirrored_pose);
    let expected: Vec<_> = positions.iter().map(mirrored).collect();
    let error = largest_difference(&of_partners, &expected);
    println!("mirror: {error:.2e} m");
    assert!(error < 1e-6, "{error} m");
}

#[test]
fn betas_are_counted_and_finite() {
    let error = ShapedBody::new(BodyModel::embedded(), &[0.0; 11])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("11 betas") && error.contains("has 10"),
        "{error}"
    );
    let error = ShapedBody::new(BodyModel::embedded(), &[0.0, f64::NAN])
        .unwrap_err()
        .to_string();
    assert!(error.contains("beta 1 is NaN"), "{error}");
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    assert!(
        body.subset(&[6954])
            .unwrap_err()
            .to_string()
            .contains("vertex 6954")
    );
}

#[test]
fn joints_are_linear_in_betas() {
    let model = BodyModel::embedded();
    let betas = [1.0, -0.5, 2.0, 0.3, -1.0, 0.7, 0.1, -0.2, 1.5, 0.4];
    let (mean, directions) = model.joint_shape_directions();
    let body = ShapedBody::new(model, &betas).unwrap();
    for joint in Joint::ALL {
        let shift: Vector3<f64> = directions
            .iter()
            .zip(betas)
            .map(|(direction, beta)| direction[joint.index()] * beta)
            .sum();
        assert!(
            (mean[joint.index()] + shift - body.joints_in_model()[joint.index()]).norm() < 1e-12
        );
    }
}
