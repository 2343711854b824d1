//! Rotations and vectors of several poses at once, one in each lane of a register.
//!
//! Every operation is nalgebra's for one pose, in its order, so that a pose has the same bytes whatever
//! stands beside it; no multiplication is fused with its addition.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use pulp::{Simd, bytemuck};

/// A vector of each lane.
pub(crate) type VectorLanes<S> = [<S as Simd>::f64s; 3];
/// A quaternion i, j, k, w of each lane.
pub(crate) type RotationLanes<S> = [<S as Simd>::f64s; 4];
/// Of each lane, rotation and translation.
pub(crate) type IsometryLanes<S> = (RotationLanes<S>, VectorLanes<S>);

/// One register, lane k from `value(k)`.
#[inline(always)]
pub(crate) fn gathered<S: Simd>(s: S, value: impl Fn(usize) -> f64) -> S::f64s {
    let mut lanes = s.splat_f64s(0.0);
    for (k, lane) in numbers_mut::<S>(&mut lanes).iter_mut().enumerate() {
        *lane = value(k);
    }
    lanes
}

#[inline(always)]
fn numbers_mut<S: Simd>(lanes: &mut S::f64s) -> &mut [f64] {
    bytemuck::cast_slice_mut(std::slice::from_mut(lanes))
}

#[inline(always)]
fn number<S: Simd>(lanes: &S::f64s, k: usize) -> f64 {
    bytemuck::cast_slice::<S::f64s, f64>(std::slice::from_ref(lanes))[k]
}

/// The vector of a lane.
#[inline(always)]
pub(crate) fn vector_of<S: Simd>([x, y, z]: &VectorLanes<S>, k: usize) -> Vector3<f64> {
    Vector3::new(number::<S>(x, k), number::<S>(y, k), number::<S>(z, k))
}

/// The isometry of a lane.
#[inline(always)]
pub(crate) fn isometry_of<S: Simd>(lanes: &IsometryLanes<S>, k: usize) -> Isometry3<f64> {
    let ([x, y, z, w], translation) = lanes;
    let [x, y, z, w] = [x, y, z, w].map(|lanes| number::<S>(lanes, k));
    Isometry3::from_parts(
        vector_of::<S>(translation, k).into(),
        UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
    )
}

/// The same vector in all lanes.
#[inline(always)]
pub(crate) fn splat<S: Simd>(s: S, vector: &Vector3<f64>) -> VectorLanes<S> {
    [
        s.splat_f64s(vector.x),
        s.splat_f64s(vector.y),
        s.splat_f64s(vector.z),
    ]
}

#[inline(always)]
pub(crate) fn sum<S: Simd>(s: S, a: &VectorLanes<S>, b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.add_f64s(a[0], b[0]),
        s.add_f64s(a[1], b[1]),
        s.add_f64s(a[2], b[2]),
    ]
}

#[inline(always)]
pub(crate) fn difference<S: Simd>(s: S, a: &VectorLanes<S>, b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.sub_f64s(a[0], b[0]),
        s.sub_f64s(a[1], b[1]),
        s.sub_f64s(a[2], b[2]),
    ]
}

#[inline(always)]
pub(crate) fn scaled<S: Simd>(s: S, a: &VectorLanes<S>, factor: S::f64s) -> VectorLanes<S> {
    [
        s.mul_f64s(a[0], factor),
        s.mul_f64s(a[1], factor),
        s.mul_f64s(a[2], factor),
    ]
}

#[inline(always)]
fn cross<S: Simd>(s: S, a: &[S::f64s], b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.sub_f64s(s.mul_f64s(a[1], b[2]), s.mul_f64s(a[2], b[1])),
        s.sub_f64s(s.mul_f64s(a[2], b[0]), s.mul_f64s(a[0], b[2])),
        s.sub_f64s(s.mul_f64s(a[0], b[1]), s.mul_f64s(a[1], b[0])),
    ]
}

/// A vector turned.
#[inline(always)]
pub(crate) fn rotated<S: Simd>(
    s: S,
    rotation: &RotationLanes<S>,
    vector: &VectorLanes<S>,
) -> VectorLanes<S> {
    let t = scaled(s, &cross(s, rotation, vector), s.splat_f64s(2.0));
    let across = cross(s, rotation, &t);
    sum(s, &sum(s, &scaled(s, &t, rotation[3]), &across), vector)
}

/// The product of two rotations.
#[inline(always)]
pub(crate) fn product<S: Simd>(
    s: S,
    a: &RotationLanes<S>,
    b: &RotationLanes<S>,
) -> RotationLanes<S> {
    let times = |i: usize, j: usize| s.mul_f64s(a[i], b[j]);
    let (plus, less) = (
        |x: S::f64s, y: S::f64s| s.add_f64s(x, y),
        |x: S::f64s, y: S::f64s| s.sub_f64s(x, y),
    );
    [
        less(
            plus(plus(times(3, 0), times(0, 3)), times(1, 2)),
            times(2, 1),
        ),
        plus(
            plus(less(times(3, 1), times(0, 2)), times(1, 3)),
            times(2, 0),
        ),
        plus(
            less(plus(times(3, 2), times(0, 1)), times(1, 0)),
            times(2, 3),
        ),
        less(
            less(less(times(3, 3), times(0, 0)), times(1, 1)),
            times(2, 2),
        ),
    ]
}

/// `R - 1` of a rotation's matrix, row by row.
#[inline(always)]
pub(crate) fn matrix_less_one<S: Simd>(s: S, [i, j, k, w]: &RotationLanes<S>) -> [S::f64s; 9] {
    let (one, two) = (s.splat_f64s(1.0), s.splat_f64s(2.0));
    let (plus, less) = (
        |x: S::f64s, y: S::f64s| s.add_f64s(x, y),
        |x: S::f64s, y: S::f64s| s.sub_f64s(x, y),
    );
    let twice = |x: S::f64s, y: S::f64s| s.mul_f64s(s.mul_f64s(x, y), two);
    let (ww, ii) = (s.mul_f64s(*w, *w), s.mul_f64s(*i, *i));
    let (jj, kk) = (s.mul_f64s(*j, *j), s.mul_f64s(*k, *k));
    let (ij, wk, wj) = (twice(*i, *j), twice(*w, *k), twice(*w, *j));
    let (ik, jk, wi) = (twice(*i, *k), twice(*j, *k), twice(*w, *i));
    [
        less(less(less(plus(ww, ii), jj), kk), one),
        less(ij, wk),
        plus(wj, ik),
        plus(wk, ij),
        less(less(plus(less(ww, ii), jj), kk), one),
        less(jk, wi),
        less(ik, wj),
        plus(wi, jk),
        less(plus(less(less(ww, ii), jj), kk), one),
    ]
}
