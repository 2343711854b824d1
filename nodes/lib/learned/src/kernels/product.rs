//! Products of matrices.
//!
//! The right factor is packed once into panels of `PANEL` columns and kept, as the weights of a
//! recurrent layer are used at every step. Each element of the product is a sum over blocks of
//! `BLOCK` terms, in order; within a block the terms are added one by one, fused. That order
//! holds for every vector width and every cut of the rows.

use pulp::{Arch, Simd, WithSimd};

/// Columns of a panel: two AVX-512 registers, four of AVX2.
const PANEL: usize = 32;
/// Terms that are summed in registers before they are added to the product.
const BLOCK: usize = 128;
/// Rows that share each load of a panel: with two registers a row, twelve sums hide the latency of
/// a multiply-add.
const ROWS: usize = 6;

/// A matrix as a view of a slice: element (i, j) is `values[i * row_stride + j * column_stride]`.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'a> View<'a> {
    /// Row after row, without gaps. Panics where the slice's length is not rows x columns.
    #[must_use]
    pub fn new(values: &'a [f32], rows: usize, columns: usize) -> Self {
        assert_eq!(
            values.len(),
            rows * columns,
            "a matrix of {rows} x {columns}"
        );
        Self {
            values,
            rows,
            columns,
            row_stride: columns,
            column_stride: 1,
        }
    }

    /// With strides of its own. Panics where the last element lies beyond the slice.
    #[must_use]
    pub fn strided(
        values: &'a [f32],
        rows: usize,
        columns: usize,
        row_stride: usize,
        column_stride: usize,
    ) -> Self {
        let beyond = if rows * columns == 0 {
            0
        } else {
            (rows - 1) * row_stride + (columns - 1) * column_stride + 1
        };
        assert!(
            beyond <= values.len(),
            "a matrix of {rows} x {columns} with strides {row_stride} and {column_stride}"
        );
        Self {
            values,
            rows,
            columns,
            row_stride,
            column_stride,
        }
    }

    /// Rows for columns.
    #[must_use]
    pub fn transposed(self) -> Self {
        Self {
            rows: self.columns,
            columns: self.rows,
            row_stride: self.column_stride,
            column_stride: self.row_stride,
            ..self
        }
    }
}

/// The right factor of products, in panels: (panels, rows, `PANEL`), the last panel filled up
/// with zeros.
#[derive(Debug, Clone, Default)]
pub struct PackedMatrix {
    rows: usize,
    columns: usize,
    panels: Vec<f32>,
}

impl PackedMatrix {
    /// Packs a matrix.
    #[must_use]
    pub fn new(matrix: View<'_>) -> Self {
        let mut packed = Self::default();
        packed.pack(matrix);
        packed
    }

    /// Packs another matrix into the same memory.
    pub fn pack(&mut self, matrix: View<'_>) {
        (self.rows, self.columns) = (matrix.rows, matrix.columns);
        let count = matrix.columns.div_ceil(PANEL) * matrix.rows * PANEL;
        self.panels.clear();
        self.panels.resize(count, 0.0);
        for (index, panel) in self
            .panels
            .chunks_exact_mut((matrix.rows * PANEL).max(1))
            .enumerate()
        {
            let first = index * PANEL;
            let width = PANEL.min(matrix.columns - first);
            for (row, into) in panel.chunks_exact_mut(PANEL).enumerate() {
                let from = &matrix.values[row * matrix.row_stride + first * matrix.column_stride..];
                if matrix.column_stride == 1 {
                    into[..width].copy_from_slice(&from[..width]);
                } else {
                    into[..width]
                        .iter_mut()
                        .zip(from.iter().step_by(matrix.column_stride))
                        .for_each(|(into, from)| *into = *from);
                }
            }
        }
    }

    /// Columns of the product.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }
}

/// sum += left right; left: (rows, terms), right: (terms, columns), sum: (rows, columns), without
/// gaps.
///
/// Panics where the shapes do not fit.
pub fn add_product(sum: &mut [f32], left: View<'_>, right: &PackedMatrix) {
    assert_eq!(left.columns, right.rows, "terms of left and right");
    assert_eq!(
        sum.len(),
        left.rows * right.columns,
        "elements of the product"
    );
    if !sum.is_empty() && left.columns > 0 {
        Arch::new().dispatch(Product { sum, left, right });
    }
}

struct Product<'a> {
    sum: &'a mut [f32],
    left: View<'a>,
    right: &'a PackedMatrix,
}

/// Where a tile of the product lies.
#[derive(Clone, Copy)]
struct Place {
    column: usize,
    width: usize,
    stride: usize,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { sum, left, right } = self;
        let mut packed = [0.0; ROWS * BLOCK];
        for first_term in (0..left.columns).step_by(BLOCK) {
            let terms = BLOCK.min(left.columns - first_term);
            for (index, sum) in sum.chunks_mut(ROWS * right.columns).enumerate() {
                let rows = sum.len() / right.columns;
                let left = &left.values
                    [index * ROWS * left.row_stride + first_term * left.column_stride..];
                pack_rows(&mut packed, left, self.left, rows, terms);
                let left = &packed[..terms * rows];
                match rows {
                    6 => row_block::<S, 6>(simd, sum, left, right, first_term),
                    5 => row_block::<S, 5>(simd, sum, left, right, first_term),
                    4 => row_block::<S, 4>(simd, sum, left, right, first_term),
                    3 => row_block::<S, 3>(simd, sum, left, right, first_term),
                    2 => row_block::<S, 2>(simd, sum, left, right, first_term),
                    _ => row_block::<S, 1>(simd, sum, left, right, first_term),
                }
            }
        }
    }
}

/// The rows' elements of one term beside each other.
#[inline(always)]
fn pack_rows(packed: &mut [f32], left: &[f32], strides: View<'_>, rows: usize, terms: usize) {
    if strides.row_stride == 1 {
        for (term, into) in packed.chunks_exact_mut(rows).take(terms).enumerate() {
            into.copy_from_slice(&left[term * strides.column_stride..][..rows]);
        }
    } else {
        for row in 0..rows {
            let from = left[row * strides.row_stride..]
                .iter()
                .step_by(strides.column_stride);
            packed[row..]
                .iter_mut()
                .step_by(rows)
                .zip(from)
                .take(terms)
                .for_each(|(into, from)| *into = *from);
        }
    }
}

#[inline(always)]
fn row_block<S: Simd, const N: usize>(
    simd: S,
    sum: &mut [f32],
    left: &[f32],
    right: &PackedMatrix,
    first_term: usize,
) {
    let terms = left.len() / N;
    for (index, panel) in right.panels.chunks_exact(right.rows * PANEL).enumerate() {
        let panel = &panel[first_term * PANEL..][..terms * PANEL];
        for start in (0..PANEL).step_by(2 * S::F32_LANES) {
            let column = index * PANEL + start;
            if column < right.columns {
                let width = (2 * S::F32_LANES).min(right.columns - column);
                tile::<S, N>(
                    simd,
                    sum,
                    left,
                    panel,
                    Place {
                        column,
                        width,
                        stride: right.columns,
                    },
                );
            }
        }
    }
}

/// N rows by two registers: the sums stay in registers over all terms of the block.
#[inline(always)]
fn tile<S: Simd, const N: usize>(
    simd: S,
    sum: &mut [f32],
    left: &[f32],
    panel: &[f32],
    place: Place,
) {
    let register = place.column % PANEL / S::F32_LANES;
    let (left, _) = left.as_chunks::<N>();
    let (panel, _) = S::as_simd_f32s(panel);
    let mut sums = [[simd.splat_f32s(0.0); 2]; N];
    for (left, right) in left.iter().zip(panel.chunks_exact(PANEL / S::F32_LANES)) {
        let (first, second) = (right[register], right[register + 1]);
        for (sums, &left) in sums.iter_mut().zip(left) {
            let left = simd.splat_f32s(left);
            sums[0] = simd.mul_add_f32s(left, first, sums[0]);
            sums[1] = simd.mul_add_f32s(left, second, sums[1]);
        }
    }
    for (row, sums) in sum.chunks_exact_mut(place.stride).zip(sums) {
        let row = &mut row[place.column..][..place.width];
        if let ([first, second], []) = S::as_mut_simd_f32s(row) {
            *first = simd.add_f32s(*first, sums[0]);
            *second = simd.add_f32s(*second, sums[1]);
        } else {
            let added: &[f32] = pulp::bytemuck::cast_slice(&sums);
            row.iter_mut()
                .zip(added)
                .for_each(|(sum, added)| *sum += added);
        }
    }
}

/// Every row becomes `row`.
pub fn fill_rows(rows: &mut [f32], row: &[f32]) {
    rows.chunks_exact_mut(row.len())
        .for_each(|into| into.copy_from_slice(row));
}

/// sum += all rows, in blocks of `BLOCK` as products sum.
pub fn add_rows(sum: &mut [f32], rows: &[f32]) {
    let mut partial = vec![0.0; sum.len()];
    for block in rows.chunks(BLOCK * sum.len()) {
        partial.fill(0.0);
        for row in block.chunks_exact(sum.len()) {
            partial
                .iter_mut()
                .zip(row)
                .for_each(|(partial, value)| *partial += value);
        }
        sum.iter_mut()
            .zip(&partial)
            .for_each(|(sum, partial)| *sum += partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::values;

    fn product_in_f64(
        left: &[f32],
        right: &[f32],
        (rows, terms, columns): (usize, usize, usize),
    ) -> Vec<f64> {
        let element = |row: usize, column: usize| {
            (0..terms)
                .map(|term| {
                    f64::from(left[row * terms + term]) * f64::from(right[term * columns + column])
                })
                .sum()
        };
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| element(row, column)))
            .collect()
    }

    #[test]
    fn agrees_with_f64_at_all_edges() {
        for shape @ (rows, terms, columns) in [
            (1, 1, 1),
            (6, 128, 32),
            (7, 129, 33),
            (17, 64, 256),
            (5, 300, 3),
            (13, 27, 40),
            (64, 5, 16),
        ] {
            let (left, right) = (values(rows * terms, 1), values(terms * columns, 2));
            let mut sum = vec![1.0; rows * columns];
            add_product(
                &mut sum,
                View::new(&left, rows, terms),
                &PackedMatrix::new(View::new(&right, terms, columns)),
            );
            for (found, expected) in sum.iter().zip(product_in_f64(&left, &right, shape)) {
                assert!(
                    (f64::from(*found) - 1.0 - expected).abs() < 2e-6 * terms as f64,
                    "{shape:?}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn transposed_views_give_the_same_bits() {
        let (rows, terms, columns) = (19, 150, 37);
        let (left, right) = (values(rows * terms, 3), values(terms * columns, 4));
        let turned = |values: &[f32], rows, columns| {
            crate::kernels::swap_leading_axes(values, rows, columns, 1)
        };
        let (left_turned, right_turned) =
            (turned(&left, rows, terms), turned(&right, terms, columns));
        let mut straight = vec![0.0; rows * columns];
        add_product(
            &mut straight,
            View::new(&left, rows, terms),
            &PackedMatrix::new(View::new(&right, terms, columns)),
        );
        let mut crosswise = vec![0.0; rows * columns];
        let right = PackedMatrix::new(View::new(&right_turned, columns, terms).transposed());
        add_product(
            &mut crosswise,
            View::new(&left_turned, terms, rows).transposed(),
            &right,
        );
        assert_eq!(straight, crosswise);
    }

    #[test]
    fn bits_depend_neither_on_the_vector_width_nor_on_the_cut_of_rows() {
        let (rows, terms, columns) = (23, 200, 45);
        let (left, right) = (values(rows * terms, 5), values(terms * columns, 6));
        let right = PackedMatrix::new(View::new(&right, terms, columns));
        let mut widest = vec![0.0; rows * columns];
        add_product(&mut widest, View::new(&left, rows, terms), &right);
        let mut scalar = vec![0.0; rows * columns];
        Product {
            sum: &mut scalar,
            left: View::new(&left, rows, terms),
            right: &right,
        }
        .with_simd(pulp::Scalar);
        assert_eq!(widest, scalar);
        let mut cut = vec![0.0; rows * columns];
        for (sum, left) in cut.chunks_mut(4 * columns).zip(left.chunks(4 * terms)) {
            add_product(sum, View::new(left, left.len() / terms, terms), &right);
        }
        assert_eq!(widest, cut);
    }
}
