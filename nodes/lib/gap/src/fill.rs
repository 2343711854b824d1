//! What stands in for readings that are missing or not compared, before a residual is whitened.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// Neighbours on each side that say something of a missing value.
const REACH: usize = 24;
/// How far from its edge a long gap is filled; beyond, nothing is known but the mean, zero.
const EDGE: usize = 48;

/// Fills gaps of a circular series by the values to be expected given their neighbours: `C_mn
/// C_nn^-1 x_n`, with C the predicted covariance.
///
/// A linear map of the series, so that a fit sees its own columns through the same gaps. Anything
/// simpler (a straight line) carries one noisy neighbour over the gap, which after whitening is a
/// jump.
#[derive(Clone, Debug, Default)]
pub(crate) struct Filler {
    runs: Vec<Run>,
    /// Expected squared error of each filled entry; zero where a value is.
    pub variance: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Run {
    missing: Range<usize>,
    neighbours: Vec<usize>,
    weights: DMatrix<f64>,
}

impl Filler {
    /// For a series of which `there` says what is there; `covariance` by distance, circular.
    pub fn new(there: &[bool], covariance: &[f64]) -> Self {
        let length = there.len();
        let mut filler = Self {
            runs: Vec::new(),
            variance: vec![0.0; length],
        };
        let mut next = 0;
        while next < length {
            if there[next] {
                next += 1;
                continue;
            }
            let end = (next..length).find(|&k| there[k]).unwrap_or(length);
            filler.variance[next..end].fill(covariance[0]);
            let gap = next..end;
            if gap.len() <= 2 * EDGE {
                filler.add(gap.clone(), neighbours(there, &gap, true, true), covariance);
            } else {
                let (left, right) = (gap.start..gap.start + EDGE, gap.end - EDGE..gap.end);
                filler.add(
                    left.clone(),
                    neighbours(there, &left, true, false),
                    covariance,
                );
                filler.add(
                    right.clone(),
                    neighbours(there, &right, false, true),
                    covariance,
                );
            }
            next = end;
        }
        filler
    }

    fn add(&mut self, missing: Range<usize>, neighbours: Vec<usize>, covariance: &[f64]) {
        let length = self.variance.len();
        let between = |a: usize, b: usize| covariance[a.abs_diff(b).min(length - a.abs_diff(b))];
        let nugget = 1e-9 * covariance[0];
        let own = DMatrix::from_fn(neighbours.len(), neighbours.len(), |i, j| {
            between(neighbours[i], neighbours[j]) + if i == j { nugget } else { 0.0 }
        });
        let Some(factor) = own.cholesky() else { return };
        let across = DMatrix::from_fn(neighbours.len(), missing.len(), |i, m| {
            between(neighbours[i], missing.start + m)
        });
        let weights = factor.solve(&across);
        for (m, entry) in missing.clone().enumerate() {
            self.variance[entry] =
                (covariance[0] - weights.column(m).dot(&across.column(m))).max(0.0);
        }
        self.runs.push(Run {
            missing,
            neighbours,
            weights: weights.transpose(),
        });
    }

    /// Overwrites what is missing.
    pub fn fill(&self, series: &mut [f64]) {
        // What no run covers is far from any value.
        for (value, variance) in series.iter_mut().zip(&self.variance) {
            if *variance > 0.0 {
                *value = 0.0;
            }
        }
        let filled: Vec<DVector<f64>> = self
            .runs
            .iter()
            .map(|run| {
                &run.weights
                    * DVector::from_iterator(
                        run.neighbours.len(),
                        run.neighbours.iter().map(|&k| series[k]),
                    )
            })
            .collect();
        for (run, values) in self.runs.iter().zip(filled) {
            for (entry, value) in run.missing.clone().zip(values.iter()) {
                series[entry] = *value;
            }
        }
    }
}

/// The nearest entries that are there, on the sides asked for, circularly.
fn neighbours(there: &[bool], gap: &Range<usize>, left: bool, right: bool) -> Vec<usize> {
    let length = there.len();
    let mut found = Vec::new();
    // Not further than a few reaches: beyond, the series is another one.
    let far = (4 * REACH).min(length - gap.len());
    if left {
        found.extend(
            (1..=far)
                .map(|step| (gap.start + length - step) % length)
                .filter(|&k| there[k])
                .take(REACH),
        );
    }
    if right {
        found.extend(
            (0..far)
                .map(|step| (gap.end + step) % length)
                .filter(|&k| there[k])
                .take(REACH),
        );
    }
    found.sort_unstable();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_in_a_slow_series_is_bridged_and_a_long_one_forgets() {
        let length = 1000;
        // Correlated over fifty entries.
        let covariance: Vec<f64> = (0..length)
            .map(|k: usize| {
                (-0.5 * (k.min(length - k) as f64 / 20.0).powi(2)).exp()
                    + if k == 0 { 1e-3 } else { 0.0 }
            })
            .collect();
        let mut there = vec![true; length];
        there[300..304].fill(false);
        there[600..800].fill(false);
        let filler = Filler::new(&there, &covariance);
        let truth: Vec<f64> = (0..length)
            .map(|k| (k as f64 * std::f64::consts::TAU / 200.0).sin())
            .collect();
        let mut series = truth.clone();
        there
            .iter()
            .enumerate()
            .filter(|(_, there)| !**there)
            .for_each(|(k, _)| series[k] = 1e9);
        filler.fill(&mut series);
        for k in 300..304 {
            assert!(
                (series[k] - truth[k]).abs() < 0.02,
                "{} {}",
                series[k],
                truth[k]
            );
        }
        assert_eq!(series[700], 0.0);
        assert!(
            filler.variance[302] < 0.01 && filler.variance[700] > 0.9 && filler.variance[10] == 0.0
        );
    }
}
