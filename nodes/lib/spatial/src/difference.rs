//! Finite differences on any times.

/// Largest stencil that [`derivative_weights`] takes.
pub const MAX_STENCIL: usize = 8;

/// Weights of the derivatives of orders 0, 1 and 2 at time `at` of the polynomial through samples
/// at `times` (distinct, at most [`MAX_STENCIL`]): `f^(m)(at) ~ sum_j weights[m][j] f(times[j])`,
/// entries beyond the stencil are zero.
///
/// With five equally spaced times and `at` in the middle these are the fourth-order formulas of
/// Richardson extrapolation, `f'' = (-f[-2] + 16 f[-1] - 30 f[0] + 16 f[1] - f[2]) / (12 h^2)`.
/// Recursion: Fornberg, "Generation of finite difference formulas on arbitrarily spaced grids",
/// Mathematics of Computation 51 (1988).
pub fn derivative_weights(times: &[f64], at: f64) -> [[f64; MAX_STENCIL]; 3] {
    let mut weights = [[0.0; MAX_STENCIL]; 3];
    let count = times.len().min(MAX_STENCIL);
    if count == 0 {
        return weights;
    }
    weights[0][0] = 1.0;
    let mut product = 1.0;
    for i in 1..count {
        let mut new_product = 1.0;
        let (here, before) = (times[i] - at, times[i - 1] - at);
        for j in 0..i {
            let gap = times[i] - times[j];
            new_product *= gap;
            if j == i - 1 {
                for m in (0..3).rev() {
                    let lower = if m > 0 {
                        m as f64 * weights[m - 1][j]
                    } else {
                        0.0
                    };
                    weights[m][i] = product * (lower - before * weights[m][j]) / new_product;
                }
            }
            for m in (0..3).rev() {
                let lower = if m > 0 {
                    m as f64 * weights[m - 1][j]
                } else {
                    0.0
                };
                weights[m][j] = (here * weights[m][j] - lower) / gap;
            }
        }
        product = new_product;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_even_times_give_richardsons_formulas() {
        let weights = derivative_weights(&[-2.0, -1.0, 0.0, 1.0, 2.0], 0.0);
        let expected = [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [1.0, -8.0, 0.0, 8.0, -1.0],
            [-1.0, 16.0, -30.0, 16.0, -1.0],
        ];
        for (m, row) in expected.iter().enumerate() {
            let scale = if m == 0 { 1.0 } else { 12.0 };
            for (j, e) in row.iter().enumerate() {
                assert!(
                    (weights[m][j] * scale - e).abs() < 1e-12,
                    "derivative {m}, weight {j}"
                );
            }
        }
    }

    #[test]
    fn uneven_times_are_exact_for_polynomials() {
        let times = [0.0, 0.7, 1.0, 2.2, 2.5, 4.0];
        let (f, f1, f2) = (
            |t: f64| t.powi(5) - 2.0 * t,
            |t: f64| 5.0 * t.powi(4) - 2.0,
            |t: f64| 20.0 * t.powi(3),
        );
        let weights = derivative_weights(&times, 1.3);
        let sum = |m: usize| {
            times
                .iter()
                .zip(weights[m])
                .map(|(t, w)| w * f(*t))
                .sum::<f64>()
        };
        assert!(
            (sum(0) - f(1.3)).abs() < 1e-11
                && (sum(1) - f1(1.3)).abs() < 1e-11
                && (sum(2) - f2(1.3)).abs() < 1e-10
        );
    }
}
