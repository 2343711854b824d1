//! Symmetric positive definite band matrices: factorisation, solution, determinant.

use crate::SpatialError;

/// Bands stored beside the diagonal: a quintic B-spline overlaps five neighbours on each side.
pub(crate) const BANDWIDTH: usize = 5;

/// A symmetric band matrix by rows: `rows[i][k]` is entry (i, i - k).
#[derive(Clone, Debug, Default)]
pub(crate) struct Banded {
    pub(crate) rows: Vec<[f64; BANDWIDTH + 1]>,
}

impl Banded {
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            rows: vec![[0.0; BANDWIDTH + 1]; size],
        }
    }

    /// Adds `weight * row row^T`, the row's entries standing at `first` and after it.
    pub(crate) fn add_outer_product(
        &mut self,
        first: usize,
        row: &[f64; BANDWIDTH + 1],
        weight: f64,
    ) {
        let mut rows = self.rows[first..].iter_mut();
        for (i, own) in row.iter().enumerate() {
            let Some(entries) = rows.next() else { return };
            for j in 0..=i {
                entries[i - j] += weight * own * row[j];
            }
        }
    }

    /// `row^T M row`, the row's entries standing at `first` and after it.
    pub(crate) fn quadratic_form(&self, first: usize, row: &[f64; BANDWIDTH + 1]) -> f64 {
        let mut sum = 0.0;
        for i in 0..=BANDWIDTH {
            let entries = &self.rows[first + i];
            let beside: f64 = (0..i).map(|j| row[j] * entries[i - j]).sum();
            sum += row[i] * (row[i] * entries[0] + 2.0 * beside);
        }
        sum
    }
}

/// L and D of `M = L D L^T`, L unit lower triangular: `rows[i][k]` is L's entry (i, i - k) for k >
/// 0, `rows[i][0]` is 1 / D_i.
#[derive(Clone, Debug, Default)]
pub(crate) struct Factor {
    rows: Vec<[f64; BANDWIDTH + 1]>,
    log_determinant: f64,
}

impl Factor {
    /// Factors `left + weight * right` in O(N), reusing this factor's memory.
    pub(crate) fn factor_sum(
        &mut self,
        left: &Banded,
        weight: f64,
        right: &Banded,
    ) -> Result<(), SpatialError> {
        self.factor_rows(left.rows.len(), |i| {
            std::array::from_fn(|k| left.rows[i][k] + weight * right.rows[i][k])
        })
    }

    /// Factors a matrix in O(N), reusing this factor's memory.
    pub(crate) fn factor(&mut self, matrix: &Banded) -> Result<(), SpatialError> {
        self.factor_rows(matrix.rows.len(), |i| matrix.rows[i])
    }

    fn factor_rows(
        &mut self,
        size: usize,
        matrix_row: impl Fn(usize) -> [f64; BANDWIDTH + 1],
    ) -> Result<(), SpatialError> {
        self.rows.clear();
        self.rows.reserve(size);
        let (mut log_determinant, mut product) = (0.0, 1.0_f64);
        for i in 0..size {
            let given = matrix_row(i);
            let (mut row, diagonal) = match self.rows.last_chunk::<BANDWIDTH>() {
                Some(above) => eliminate(above, &given),
                None => eliminate(&self.rows, &given),
            };
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return Err(SpatialError::Singular { index: i });
            }
            row[0] = 1.0 / diagonal;
            self.rows.push(row);
            product *= diagonal;
            if !(1e-100..1e100).contains(&product) {
                log_determinant += product.ln();
                product = 1.0;
            }
        }
        self.log_determinant = log_determinant + product.ln();
        Ok(())
    }

    /// Visits the blocks of `M^-1` on its diagonal, the last first: where each begins, and its
    /// entries. O(N) (Takahashi, Fagan and Chin 1973): from `Z = D^-1 L^-1 + (1 - L^T) Z`.
    pub(crate) fn for_each_inverse_block(&self, mut visit: impl FnMut(usize, &Block)) {
        let size = self.rows.len();
        let mut block: Block = [[0.0; BANDWIDTH + 1]; BANDWIDTH + 1];
        for i in (0..size).rev() {
            let below: [f64; BANDWIDTH] =
                std::array::from_fn(|k| self.rows.get(i + k + 1).map_or(0.0, |row| row[k + 1]));
            let mut diagonal = self.rows[i][0];
            let mut column = [0.0; BANDWIDTH];
            for (k, l) in below.iter().enumerate() {
                for (entry, z) in column.iter_mut().zip(&block[k]) {
                    *entry -= l * z;
                }
            }
            for (l, entry) in below.iter().zip(&column) {
                diagonal -= l * entry;
            }
            for j in (0..BANDWIDTH).rev() {
                let above = block[j];
                block[j + 1][1..].copy_from_slice(&above[..BANDWIDTH]);
                block[j + 1][0] = column[j];
            }
            block[0][0] = diagonal;
            block[0][1..].copy_from_slice(&column);
            if i + BANDWIDTH < size {
                visit(i, &block);
            }
        }
    }

    /// The entries of `M^-1` within the band, see [`Factor::for_each_inverse_block`].
    pub(crate) fn inverse_band(&self) -> Banded {
        let mut inverse = Banded::zeros(self.rows.len());
        let last = self.rows.len().saturating_sub(BANDWIDTH + 1);
        self.for_each_inverse_block(|first, block| {
            if first == last {
                for (i, row) in inverse.rows[first..].iter_mut().enumerate() {
                    (0..=i).for_each(|k| row[k] = block[i][i - k]);
                }
            }
            let rows = inverse.rows[first..].iter_mut().enumerate();
            rows.zip(block)
                .for_each(|((k, row), entries)| row[k] = entries[0]);
        });
        inverse
    }

    /// Natural logarithm of the determinant.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Solves `M x = right` in place, all channels at once.
    pub(crate) fn solve<const C: usize>(&self, right: &mut [[f64; C]]) {
        for i in 0..right.len() {
            let row = &self.rows[i];
            let (above, here) = right.split_at_mut(i);
            let x = &mut here[0];
            for (l, other) in row[1..].iter().zip(above.iter().rev()) {
                for c in 0..C {
                    x[c] -= l * other[c];
                }
            }
        }
        for i in (0..right.len()).rev() {
            // L^T: row i scatters into the rows above it once it is final; dividing by D first.
            let (here, below) = right[i..].split_at_mut(1);
            let x = &mut here[0];
            for s in x.iter_mut() {
                *s *= self.rows[i][0];
            }
            let rows = self.rows[i + 1..].iter().enumerate();
            for ((k, row), other) in rows.zip(below.iter()).take(BANDWIDTH) {
                for c in 0..C {
                    x[c] -= row[k + 1] * other[c];
                }
            }
        }
    }

    /// The part that counts of `M^-1 right`, for a right side that is zero but for the rows from
    /// `first` on: rows and their first index. The solution falls off geometrically on both sides;
    /// it is followed to `SMALL` of its largest entry, so that this costs its width and not N.
    pub(crate) fn solve_near<const C: usize>(
        &self,
        first: usize,
        right: &[[f64; C]],
    ) -> (usize, Vec<[f64; C]>) {
        let mut forward: Vec<[f64; C]> = Vec::new();
        let mut most = [0.0_f64; C];
        for i in first..self.rows.len() {
            let mut x = right.get(i - first).copied().unwrap_or([0.0; C]);
            for k in 1..=BANDWIDTH.min(i - first) {
                let (l, other) = (self.rows[i][k], forward[i - k - first]);
                (0..C).for_each(|c| x[c] -= l * other[c]);
            }
            (0..C).for_each(|c| most[c] = most[c].max(x[c].abs()));
            forward.push(x);
            let fallen = |row: &[f64; C]| (0..C).all(|c| row[c].abs() <= SMALL * most[c]);
            if forward.len() > right.len() + BANDWIDTH
                && forward[forward.len() - BANDWIDTH..].iter().all(fallen)
            {
                break;
            }
        }
        let end = first + forward.len();
        // Newest first: row i stands at `end - 1 - i`.
        let mut solved: Vec<[f64; C]> = Vec::with_capacity(2 * forward.len());
        let mut most = [0.0_f64; C];
        for i in (0..end).rev() {
            let below = solved.len();
            let mut x = if i >= first {
                forward[i - first].map(|z| z * self.rows[i][0])
            } else {
                [0.0; C]
            };
            for k in 1..=BANDWIDTH.min(below) {
                let (l, other) = (self.rows[i + k][k], solved[below - k]);
                (0..C).for_each(|c| x[c] -= l * other[c]);
            }
            (0..C).for_each(|c| most[c] = most[c].max(x[c].abs()));
            solved.push(x);
            let fallen = |row: &[f64; C]| (0..C).all(|c| row[c].abs() <= SMALL * most[c]);
            if i < first
                && solved[solved.len() - BANDWIDTH.min(solved.len())..]
                    .iter()
                    .all(fallen)
            {
                break;
            }
        }
        solved.reverse();
        (end - solved.len(), solved)
    }
}

/// A block on the diagonal of a symmetric matrix, as wide as what the basis functions of one knot
/// interval share.
pub(crate) type Block = [[f64; BANDWIDTH + 1]; BANDWIDTH + 1];

/// `row^T block row`.
pub(crate) fn quadratic_form(block: &Block, row: &[f64; BANDWIDTH + 1]) -> f64 {
    let mut product = [0.0; BANDWIDTH + 1];
    for (entries, r) in block.iter().zip(row) {
        for (sum, entry) in product.iter_mut().zip(entries) {
            *sum += r * entry;
        }
    }
    product.iter().zip(row).map(|(sum, r)| sum * r).sum()
}

/// A row of L, its diagonal left out, and the row's entry of D, from the rows above it (the nearest
/// last) and the matrix' own row.
#[inline(always)]
fn eliminate(
    above: &[[f64; BANDWIDTH + 1]],
    given: &[f64; BANDWIDTH + 1],
) -> ([f64; BANDWIDTH + 1], f64) {
    let reach = above.len();
    // `scaled[k]` is L(i, i - k) D(i - k): computed from the far column to the near one.
    let mut scaled = [0.0; BANDWIDTH + 1];
    let mut row = [0.0; BANDWIDTH + 1];
    let mut diagonal = given[0];
    for k in (1..=reach).rev() {
        let other = &above[reach - k];
        let mut entry = given[k];
        for n in k + 1..=reach {
            entry -= scaled[n] * other[n - k];
        }
        scaled[k] = entry;
        row[k] = entry * other[0];
        diagonal -= entry * row[k];
    }
    (row, diagonal)
}

/// Where a solution is cut off, as a part of its largest entry.
const SMALL: f64 = 1e-7;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::DMatrix;

    use super::*;

    #[test]
    fn factor_solve_and_determinant_agree_with_dense_matrices() {
        let size = 23;
        let mut left = Banded::zeros(size);
        let mut right = Banded::zeros(size);
        let mut dense = DMatrix::zeros(size, size);
        for i in 0..size {
            for k in 0..=BANDWIDTH.min(i) {
                let value = ((i * 7 + k * 13) % 11) as f64 / 11.0 + if k == 0 { 9.0 } else { 0.0 };
                left.rows[i][k] = value;
                right.rows[i][k] = value * 0.5;
                dense[(i, i - k)] = value * 1.15;
                dense[(i - k, i)] = value * 1.15;
            }
        }
        let mut factor = Factor::default();
        factor.factor_sum(&left, 0.3, &right).unwrap();
        assert!((factor.log_determinant() - dense.determinant().ln()).abs() < 1e-10);
        let mut x: Vec<[f64; 2]> = (0..size).map(|i| [(i as f64).sin(), 1.0]).collect();
        let given = x.clone();
        factor.solve(&mut x);
        for c in 0..2 {
            let product = &dense * DMatrix::from_iterator(size, 1, x.iter().map(|v| v[c]));
            assert!((0..size).all(|i| (product[i] - given[i][c]).abs() < 1e-12));
        }
    }

    #[test]
    fn the_inverse_within_the_band_is_that_of_dense_matrices() {
        let size = 17;
        let (mut banded, mut dense) = (Banded::zeros(size), DMatrix::zeros(size, size));
        for i in 0..size {
            for k in 0..=BANDWIDTH.min(i) {
                let value = ((i * 5 + k * 3) % 7) as f64 / 7.0 + if k == 0 { 6.0 } else { 0.0 };
                banded.rows[i][k] = value;
                dense[(i, i - k)] = value;
                dense[(i - k, i)] = value;
            }
        }
        let mut factor = Factor::default();
        factor.factor(&banded).unwrap();
        let found = factor.inverse_band();
        let inverse = dense.try_inverse().unwrap();
        for i in 0..size {
            for k in 0..=BANDWIDTH.min(i) {
                assert!((found.rows[i][k] - inverse[(i, i - k)]).abs() < 1e-14);
            }
        }
        let row = [0.3, -1.0, 2.0, 0.5, -0.7, 1.1];
        let expected: f64 = (0..6)
            .flat_map(|i| (0..6).map(move |j| (i, j)))
            .map(|(i, j)| row[i] * row[j] * inverse[(4 + i, 4 + j)])
            .sum();
        assert!((found.quadratic_form(4, &row) - expected).abs() < 1e-14);
    }

    #[test]
    fn a_local_solution_is_the_whole_one_where_it_counts() {
        let size = 400;
        let (mut left, zero) = (Banded::zeros(size), Banded::zeros(size));
        for row in &mut left.rows {
            *row = [9.0, -2.0, 0.7, -0.5, 0.3, -0.2];
        }
        let mut factor = Factor::default();
        factor.factor_sum(&left, 0.0, &zero).unwrap();
        let right = [[1.0, 0.0], [-0.5, 2.0], [0.25, 1.0]];
        for first in [0, 3, 200, 397] {
            let mut whole = vec![[0.0; 2]; size];
            whole[first..first + 3].copy_from_slice(&right);
            factor.solve(&mut whole);
            let (start, near) = factor.solve_near(first, &right);
            assert!(near.len() < 200, "{} rows of {size}", near.len());
            for (i, row) in whole.iter().enumerate() {
                let found = i
                    .checked_sub(start)
                    .and_then(|i| near.get(i))
                    .copied()
                    .unwrap_or([0.0; 2]);
                assert!(
                    (0..2).all(|c| (found[c] - row[c]).abs() < 1e-6),
                    "row {i} from {first}: {found:?} {row:?}"
                );
            }
        }
    }

    #[test]
    fn matrices_that_are_not_positive_definite_are_named() {
        let mut left = Banded::zeros(3);
        left.rows[0][0] = 1.0;
        left.rows[1][0] = -1.0;
        let zero = Banded::zeros(3);
        assert_eq!(
            Factor::default().factor_sum(&left, 0.0, &zero),
            Err(SpatialError::Singular { index: 1 })
        );
    }
}
