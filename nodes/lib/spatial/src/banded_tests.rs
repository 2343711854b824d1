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
    factor.solve(Plain, &mut x);
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
    let row = |i: usize| banded.rows[i].map(|entry| [entry]);
    factor.factor_rows(size, row).unwrap();
    factor.invert::<0>(Plain, &mut [], Solved::Whole, |_, _, _| {});
    let found = factor.into_inverse();
    let inverse = dense.try_inverse().unwrap();
    for i in 0..size {
        for k in 0..=BANDWIDTH.min(i) {
            assert!(
                (found.entries[(BANDWIDTH + i - k) * (BANDWIDTH + 1) + k] - inverse[(i, i - k)])
                    .abs()
                    < 1e-14
            );
        }
    }
    let row = [0.3, -1.0, 2.0, 0.5, -0.7, 1.1];
    let expected: f64 = (0..6)
        .flat_map(|i| (0..6).map(move |j| (i, j)))
        .map(|(i, j)| row[i] * row[j] * inverse[(4 + i, 4 + j)])
        .sum();
    assert!((found.quadratic_form(0, 4, &row) - expected).abs() < 1e-14);
}

/// Diagonally dominant, and different for each `seed`.
fn row(i: usize, seed: usize) -> Row<1> {
    std::array::from_fn(|k| {
        let value = ((i * 5 + k * 3 + seed) % 7) as f64 / 7.0;
        let inside = if k <= i { value } else { 0.0 };
        [inside + if k == 0 { 6.0 } else { 0.0 }]
    })
}

#[test]
fn lanes_do_what_each_does_alone_to_the_bit() {
    let size = 19;
    let channel = |i: usize, seed: usize| ((i * 11 + seed * 5) % 13) as f64 - 6.1;
    let mut right: Vec<[f64; 2]> = (0..size).map(|i| [channel(i, 1), channel(i, 2)]).collect();
    let mut both = Factor::<2>::default();
    let rows = |i: usize| std::array::from_fn(|k| [row(i, 1)[k][0], row(i, 2)[k][0]]);
    both.factor_and_solve_down(Plain, size, rows, &mut right)
        .unwrap();
    both.invert(Plain, &mut right, Solved::Down, |_, _, _| {});
    let inverses = both.into_inverse();
    for (lane, seed) in [1, 2].into_iter().enumerate() {
        let mut alone = Factor::default();
        alone.factor_rows(size, |i| row(i, seed)).unwrap();
        let mut x: Vec<[f64; 1]> = (0..size).map(|i| [channel(i, seed)]).collect();
        alone.solve(Plain, &mut x);
        assert!((0..size).all(|i| right[i][lane].to_bits() == x[i][0].to_bits()));
        alone.invert(Plain, &mut x, Solved::Whole, |_, _, _| {});
        let of_lane = inverses.entries.chunks_exact(2).map(|lanes| lanes[lane]);
        let inverse = alone.into_inverse().entries;
        // Before them stands what the inversion left of the factor's first rows.
        let of_inverse = BANDWIDTH * (BANDWIDTH + 1);
        assert!(
            of_lane
                .zip(&inverse)
                .skip(of_inverse)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
    }
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
        factor.solve(Plain, &mut whole);
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
