//! Rotations and vectors of several poses at once, one in each lane of a register.
//!
//! Every operation is nalgebra's for one pose, in its order, so that a pose has the same bytes whatever
//! stands beside it; no multiplication is fused with its addition.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use pulp::{Simd, bytemuck};

/// A vector of each lane.
pub type VectorLanes<S> = [<S as Simd>::f64s; 3];
/// A quaternion i, j, k, w of each lane.
pub type RotationLanes<S> = [<S as Simd>::f64s; 4];
/// Of each lane, rotation and translation.
pub type IsometryLanes<S> = (RotationLanes<S>, VectorLanes<S>);

/// One register, lane k from `value(k)`.
#[inline(always)]
pub fn gathered<S: Simd>(s: S, value: impl Fn(usize) -> f64) -> S::f64s {
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

/// The number of a lane.
#[inline(always)]
pub fn number<S: Simd>(lanes: &S::f64s, k: usize) -> f64 {
    bytemuck::cast_slice::<S::f64s, f64>(std::slice::from_ref(lanes))[k]
}

/// The vector of a lane.
#[inline(always)]
pub fn vector_of<S: Simd>([x, y, z]: &VectorLanes<S>, k: usize) -> Vector3<f64> {
    Vector3::new(number::<S>(x, k), number::<S>(y, k), number::<S>(z, k))
}

/// The isometry of a lane.
#[inline(always)]
pub fn isometry_of<S: Simd>(lanes: &IsometryLanes<S>, k: usize) -> Isometry3<f64> {
    let ([x, y, z, w], translation) = lanes;
    let [x, y, z, w] = [x, y, z, w].map(|lanes| number::<S>(lanes, k));
    Isometry3::from_parts(
        vector_of::<S>(translation, k).into(),
        UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
    )
}

/// The same vector in all lanes.
#[inline(always)]
pub fn splat<S: Simd>(s: S, vector: &Vector3<f64>) -> VectorLanes<S> {
    [
        s.splat_f64s(vector.x),
        s.splat_f64s(vector.y),
        s.splat_f64s(vector.z),
    ]
}

/// a + b.
#[inline(always)]
pub fn sum<S: Simd>(s: S, a: &VectorLanes<S>, b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.add_f64s(a[0], b[0]),
        s.add_f64s(a[1], b[1]),
        s.add_f64s(a[2], b[2]),
    ]
}

/// a - b.
#[inline(always)]
pub fn difference<S: Simd>(s: S, a: &VectorLanes<S>, b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.sub_f64s(a[0], b[0]),
        s.sub_f64s(a[1], b[1]),
        s.sub_f64s(a[2], b[2]),
    ]
}

/// A vector times a number.
#[inline(always)]
pub fn scaled<S: Simd>(s: S, a: &VectorLanes<S>, factor: S::f64s) -> VectorLanes<S> {
    [
        s.mul_f64s(a[0], factor),
        s.mul_f64s(a[1], factor),
        s.mul_f64s(a[2], factor),
    ]
}

/// A vector over a number.
#[inline(always)]
pub fn divided<S: Simd>(s: S, a: &VectorLanes<S>, divisor: S::f64s) -> VectorLanes<S> {
    a.map(|component| s.div_f64s(component, divisor))
}

/// a . b.
#[inline(always)]
pub fn dot<S: Simd>(s: S, a: &VectorLanes<S>, b: &VectorLanes<S>) -> S::f64s {
    let xy = s.add_f64s(s.mul_f64s(a[0], b[0]), s.mul_f64s(a[1], b[1]));
    s.add_f64s(xy, s.mul_f64s(a[2], b[2]))
}

/// |a|.
#[inline(always)]
pub fn norm<S: Simd>(s: S, a: &VectorLanes<S>) -> S::f64s {
    s.sqrt_f64s(dot(s, a, a))
}

/// a x b of the first three components of `a`.
#[inline(always)]
pub fn cross<S: Simd>(s: S, a: &[S::f64s], b: &VectorLanes<S>) -> VectorLanes<S> {
    [
        s.sub_f64s(s.mul_f64s(a[1], b[2]), s.mul_f64s(a[2], b[1])),
        s.sub_f64s(s.mul_f64s(a[2], b[0]), s.mul_f64s(a[0], b[2])),
        s.sub_f64s(s.mul_f64s(a[0], b[1]), s.mul_f64s(a[1], b[0])),
    ]
}

/// A vector turned.
#[inline(always)]
pub fn rotated<S: Simd>(
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
pub fn product<S: Simd>(s: S, a: &RotationLanes<S>, b: &RotationLanes<S>) -> RotationLanes<S> {
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

/// The same rotation in all lanes.
#[inline(always)]
pub fn splat_rotation<S: Simd>(s: S, rotation: &UnitQuaternion<f64>) -> RotationLanes<S> {
    std::array::from_fn(|component| s.splat_f64s(rotation.coords[component]))
}

/// The same isometry in all lanes.
#[inline(always)]
pub fn splat_isometry<S: Simd>(s: S, isometry: &Isometry3<f64>) -> IsometryLanes<S> {
    (
        splat_rotation(s, &isometry.rotation),
        splat(s, &isometry.translation.vector),
    )
}

/// The product of two isometries.
#[inline(always)]
pub fn isometry_product<S: Simd>(
    s: S,
    (rotation, translation): &IsometryLanes<S>,
    second: &IsometryLanes<S>,
) -> IsometryLanes<S> {
    let shift = rotated(s, rotation, &second.1);
    (product(s, rotation, &second.0), sum(s, translation, &shift))
}

/// The rotation of an orthonormal matrix with these columns: `UnitQuaternion::from_rotation_matrix`,
/// whose branches each lane chooses for itself.
#[inline(always)]
pub fn rotation_of_columns<S: Simd>(s: S, columns: &[VectorLanes<S>; 3]) -> RotationLanes<S> {
    let m = |row: usize, column: usize| columns[column][row];
    let (plus, less) = (
        |(i, j)| s.add_f64s(m(i, j), m(j, i)),
        |(i, j)| s.sub_f64s(m(i, j), m(j, i)),
    );
    let (zero, one) = (s.splat_f64s(0.0), s.splat_f64s(1.0));
    let trace = s.add_f64s(s.add_f64s(m(0, 0), m(1, 1)), m(2, 2));
    let one_and_less = |i: usize, j: usize, k: usize| {
        let one_and = s.add_f64s(one, m(i, i));
        s.sub_f64s(s.sub_f64s(one_and, m(j, j)), m(k, k))
    };
    let by_w = s.greater_than_f64s(trace, zero);
    let by_x = s.and_m64s(
        s.greater_than_f64s(m(0, 0), m(1, 1)),
        s.greater_than_f64s(m(0, 0), m(2, 2)),
    );
    let by_y = s.greater_than_f64s(m(1, 1), m(2, 2));
    let chosen = |[x, y, z, w]: [S::f64s; 4]| {
        let of_y_or_z = s.select_f64s(by_y, y, z);
        s.select_f64s(by_w, w, s.select_f64s(by_x, x, of_y_or_z))
    };
    let squares = [
        one_and_less(0, 1, 2),
        one_and_less(1, 0, 2),
        one_and_less(2, 0, 1),
        s.add_f64s(trace, one),
    ];
    let denominator = s.mul_f64s(s.sqrt_f64s(chosen(squares)), s.splat_f64s(2.0));
    let largest = s.mul_f64s(s.splat_f64s(0.25), denominator);
    let over = |numerator| s.div_f64s(numerator, denominator);
    let (xy, xz, yz) = (plus((0, 1)), plus((0, 2)), plus((1, 2)));
    let (wx, wy, wz) = (less((2, 1)), less((0, 2)), less((1, 0)));
    // Divided once chosen: the divisions are what costs. In their own place they are not taken.
    let quotients = [[zero, xy, xz, wx], [xy, zero, yz, wy], [xz, yz, zero, wz]]
        .map(|numerators| over(chosen(numerators)));
    let [x, y, z] = quotients;
    let w = over(chosen([wx, wy, wz, zero]));
    [
        chosen([largest, x, x, x]),
        chosen([y, largest, y, y]),
        chosen([z, z, largest, z]),
        chosen([w, w, w, largest]),
    ]
}

/// `R - 1` of a rotation's matrix, row by row.
#[inline(always)]
pub fn matrix_less_one<S: Simd>(s: S, [i, j, k, w]: &RotationLanes<S>) -> [S::f64s; 9] {
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
