#![allow(clippy::unwrap_used)]
use cromosim_body::lanes::splat_rotation;
use cromosim_spatial::so3;
use pulp::{Scalar, Scalar128b, Scalar256b, Scalar512b, WithSimd};

use super::*;

const REST: [Vector3<f64>; 3] = [
    Vector3::new(0.0, 0.0, 0.0),
    Vector3::new(1.0, 0.0, 0.0),
    Vector3::new(0.2, 0.8, 0.0),
];

#[test]
fn the_frame_of_a_stretched_triangle_turns_as_a_whole() {
    let (triangle, _) = RestTriangle::new(&REST).unwrap();
    // A symmetric stretch has no rotation, though it turns every edge.
    let stretch = Matrix3::new(1.3, 0.2, 0.0, 0.2, 0.9, 0.0, 0.0, 0.0, 1.0);
    assert!(
        triangle
            .frame(&REST.map(|corner| stretch * corner))
            .unwrap()
            .angle()
            < 1e-7
    );
    let turn = so3::exp(&Vector3::new(0.3, 0.9, -2.0));
    assert!(
        triangle
            .frame(&REST.map(|corner| turn * corner))
            .unwrap()
            .angle_to(&turn)
            < 1e-7
    );
}

/// Turned every way and stretched; flat ones, and one that is nowhere, among them.
fn moved_triangles() -> Vec<[Vector3<f64>; 3]> {
    let stretch = Matrix3::new(1.1, 0.2, 0.0, 0.1, 0.9, 0.1, 0.0, 0.0, 1.0);
    let mut triangles: Vec<_> = (0..203)
        .map(|k| {
            let k = f64::from(k);
            let axis = Vector3::new((1.7 * k).sin(), (2.3 * k).cos(), (0.9 * k).sin());
            let turn = so3::exp(&(axis.normalize() * (3.1 * (0.37 * k).sin())));
            REST.map(|corner| turn * (stretch * corner) * 0.02 + axis)
        })
        .collect();
    let half_turns = [Vector3::x(), Vector3::y(), Vector3::z()];
    triangles.extend(half_turns.map(|axis| REST.map(|it| so3::exp(&(axis * 3.0)) * it)));
    triangles.push(REST);
    triangles.insert(3, [Vector3::x(); 3]);
    triangles.insert(21, [REST[0], REST[0], REST[2]]);
    triangles.insert(30, [REST[0], REST[1], REST[1] * 2.0]);
    triangles.insert(31, [REST[0], REST[1], REST[1] * f64::NAN]);
    triangles
}

/// Whether lanes hold the bytes that each triangle has alone.
struct AsEachAlone;

impl WithSimd for AsEachAlone {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, s: S) {
        let (triangle, _) = RestTriangle::new(&REST).unwrap();
        let otherwise = so3::exp(&Vector3::new(0.3, -0.2, 0.5));
        let weights = [0.2, 0.3, 0.5];
        for triangles in moved_triangles().chunks(S::F64_LANES) {
            let of_lane = |k: usize| &triangles[k.min(triangles.len() - 1)];
            let corners: [VectorLanes<S>; 3] = std::array::from_fn(|corner| {
                std::array::from_fn(|axis| gathered(s, |k| of_lane(k)[corner][axis]))
            });
            let frames = triangle.frames(s, &corners, &splat_rotation(s, &otherwise));
            let points = points_of(s, &corners, &weights);
            for (k, corners) in triangles.iter().enumerate() {
                let frame = triangle.frame(corners).unwrap_or(otherwise);
                let point = point_of(corners, &weights);
                let found = frames.iter().chain(&points).map(|it| number::<S>(it, k));
                for (found, alone) in found.zip(frame.coords.iter().chain(&point)) {
                    let same = found.to_bits() == alone.to_bits();
                    assert!(same || found.is_nan() && alone.is_nan(), "{found} {alone}");
                }
            }
        }
    }
}

#[test]
fn lanes_have_the_bytes_that_each_triangle_has_alone() {
    AsEachAlone.with_simd(Scalar::new());
    AsEachAlone.with_simd(Scalar128b);
    AsEachAlone.with_simd(Scalar256b);
    AsEachAlone.with_simd(Scalar512b);
    pulp::Arch::new().dispatch(AsEachAlone);
}

#[test]
fn every_way_to_a_quaternion_is_among_the_triangles() {
    let (triangle, _) = RestTriangle::new(&REST).unwrap();
    let mut largest = [0; 4];
    let mut flat = 0;
    for corners in moved_triangles() {
        match triangle.frame(&corners) {
            Some(frame) => largest[frame.coords.iamax()] += 1,
            None => flat += 1,
        }
    }
    assert!(largest.iter().all(|count| *count > 5), "{largest:?}");
    assert_eq!(flat, 3);
}
