//! Symmetric positive definite band matrices: factorisation, solution, determinant.

use crate::SpatialError;

/// Bands stored beside the diagonal: a quintic B-spline overlaps five neighbours on each side.
pub(crate) const BANDWIDTH: usize = 5;

/// A symmetric band matrix by rows: `rows[i][k]` is entry (i, i - k).
#[derive(Clone, Debug)]
pub(crate) struct Banded {
    pub(crate) rows: Vec<[f64; BANDWIDTH + 1]>,
}

impl Banded {
    pub(crate) fn zeros(size: usize) -> Self {
        Self { rows: vec![[0.0; BANDWIDTH + 1]; size] }
    }
}

/// L and D of `M = L D L^T`, L unit lower triangular: `rows[i][k]` is L's entry (i, i - k) for k > 0, `rows[i][0]` is 1 / D_i.
#[derive(Clone, Debug, Default)]
pub(crate) struct Factor {
    rows: Vec<[f64; BANDWIDTH + 1]>,
    log_determinant: f64,
}

impl Factor {
    /// Factors `left + weight * right` in O(N), reusing this factor's memory.
    pub(crate) fn factor_sum(&mut self, left: &Banded, weight: f64, right: &Banded) -> Result<(), SpatialError> {
        self.rows.clear();
        self.rows.reserve(left.rows.len());
        let (mut log_determinant, mut product) = (0.0, 1.0_f64);
        for (i, (a, b)) in left.rows.iter().zip(&right.rows).enumerate() {
            // `scaled[k]` is L(i, i - k) D(i - k): computed from the far column to the near one.
            let reach = BANDWIDTH.min(i);
            let mut scaled = [0.0; BANDWIDTH + 1];
            let mut row = [0.0; BANDWIDTH + 1];
            let mut diagonal = a[0] + weight * b[0];
            for k in (1..=reach).rev() {
                let other = &self.rows[i - k];
                let mut entry = a[k] + weight * b[k];
                for n in k + 1..=reach {
                    entry -= scaled[n] * other[n - k];
                }
                scaled[k] = entry;
                row[k] = entry * other[0];
                diagonal -= entry * row[k];
            }
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

    /// Natural logarithm of the determinant.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Solves `M x = right` in place, all channels at once.
    pub(crate) fn solve<const C: usize>(&self, right: &mut [[f64; C]]) {
        for i in 0..right.len() {
            let row = &self.rows[i];
            let mut x = right[i];
            for k in 1..=BANDWIDTH.min(i) {
                let other = &right[i - k];
                for c in 0..C {
                    x[c] -= row[k] * other[c];
                }
            }
            right[i] = x;
        }
        for i in (0..right.len()).rev() {
            let row = &self.rows[i];
            let x = right[i];
            // L^T: row i scatters into the rows above it once it is final; dividing by D first.
            let mut solved = x;
            for s in &mut solved {
                *s *= row[0];
            }
            for k in 1..=BANDWIDTH.min(right.len() - 1 - i) {
                let (l, below) = (self.rows[i + k][k], right[i + k]);
                for c in 0..C {
                    solved[c] -= l * below[c];
                }
            }
            right[i] = solved;
        }
    }
}

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
    fn matrices_that_are_not_positive_definite_are_named() {
        let mut left = Banded::zeros(3);
        left.rows[0][0] = 1.0;
        left.rows[1][0] = -1.0;
        let zero = Banded::zeros(3);
        assert_eq!(Factor::default().factor_sum(&left, 0.0, &zero), Err(SpatialError::Singular { index: 1 }));
    }
}
