//! From the grid of true time to the stamps of an IMU.

use nalgebra::Vector3;

/// Nodes of the interpolation: Lagrange's polynomial of degree 5, error O(h^6).
const NODES: usize = 6;

/// A position between the entries of a grid: the first node and the weights of the six from there on.
pub(super) struct GridPosition {
    first: usize,
    weights: [f64; NODES],
}

impl GridPosition {
    /// `position` entries after the first, held at the ends; `None` where the grid has fewer than
    /// six entries.
    #[inline]
    pub(super) fn at(position: f64, length: usize) -> Option<Self> {
        if length < NODES {
            return None;
        }
        let position = position.clamp(0.0, (length - 1) as f64);
        let first = (position as usize).saturating_sub(2).min(length - NODES);
        let s = position - first as f64;
        let away: [f64; NODES] = std::array::from_fn(|j| s - j as f64);
        // Products of the others' distances over prod (j - k): -120, 24, -12, 12, -24, 120.
        let (left2, left3) = (away[0] * away[1], away[0] * away[1] * away[2]);
        let (right2, right3) = (away[5] * away[4], away[5] * away[4] * away[3]);
        let weights = [
            away[1] * away[2] * right3 / -120.0,
            away[0] * away[2] * right3 / 24.0,
            left2 * right3 / -12.0,
            left3 * right2 / 12.0,
            left3 * away[3] * away[5] / -24.0,
            left3 * away[3] * away[4] / 120.0,
        ];
        Some(Self { first, weights })
    }

    /// The value of a series on the grid at this position.
    #[inline]
    pub(super) fn interpolate(&self, series: &[Vector3<f64>]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (value, weight) in series[self.first..self.first + NODES]
            .iter()
            .zip(&self.weights)
        {
            sum += value * *weight;
        }
        sum
    }
}

/// The value at a position; the nearest entry where there are too few, zero where there is none.
#[inline]
pub(super) fn interpolate(series: &[Vector3<f64>], position: f64) -> Vector3<f64> {
    match GridPosition::at(position, series.len()) {
        Some(nodes) => nodes.interpolate(series),
        None => {
            let last = series.len().saturating_sub(1);
            series
                .get((position.max(0.0).round() as usize).min(last))
                .copied()
                .unwrap_or_default()
        }
    }
}

/// Derivative per entry at a position, from the interpolation's values half an entry to both sides and
/// a whole one: error O(h^4).
pub(super) fn derivative(series: &[Vector3<f64>], position: f64) -> Vector3<f64> {
    let at = |away: f64| interpolate(series, position + away);
    ((at(0.5) - at(-0.5)) * 8.0 - (at(1.0) - at(-1.0))) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_five_come_out_exactly_and_ends_are_held() {
        let polynomial = |t: f64| Vector3::new(1.0 - t + 0.3 * t.powi(5), t * t, -0.2 * t.powi(3));
        let series: Vec<_> = (0..12).map(|k| polynomial(0.3 * f64::from(k))).collect();
        for position in [0.0, 0.4, 1.7, 5.0, 5.25, 8.99, 10.2, 11.0] {
            assert!(
                (interpolate(&series, position) - polynomial(0.3 * position)).norm()
                    < 1e-11 * 200.0,
                "{position}"
            );
        }
        assert_eq!(
            (interpolate(&series, -3.0), interpolate(&series, 40.0)),
            (series[0], series[11])
        );
        let slope = derivative(&series, 5.3) / 0.3;
        let t: f64 = 0.3 * 5.3;
        assert!(
            (slope - Vector3::new(-1.0 + 1.5 * t.powi(4), 2.0 * t, -0.6 * t * t)).norm() < 1e-2,
            "{slope}"
        );
        assert_eq!(interpolate(&[], 0.0), Vector3::zeros());
        assert_eq!(interpolate(&series[..2], 0.8), series[1]);
    }
}
