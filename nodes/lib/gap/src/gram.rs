//! Normal equations by channel and part of time: training and held-out residuals without another
//! pass over the series.

use nalgebra::{DMatrix, DVector};

use cromosim_imu::{Channel, PerChannel};

use crate::axes::{channel_of_axis, sum_over_channels};
use crate::prepared::FOLDS;

/// Times that the channels' weights are taken from the residual of the step before.
const REWEIGHTINGS: usize = 3;
/// Relative change of these weights below which they have settled.
const SETTLED: f64 = 0.01;

/// Inner products of columns (the last is the residual), by fold.
#[derive(Clone, Debug)]
pub(crate) struct Gram {
    parts: Vec<PerChannel<DMatrix<f64>>>,
    /// Number of values, by fold.
    counts: Vec<PerChannel<f64>>,
    /// 1 / prior variance of each column's coefficient.
    prior: Vec<f64>,
}

/// What a linear fit leaves.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    /// Coefficients.
    pub step: DVector<f64>,
    /// Log-likelihood on the data it was fitted to.
    pub trained: f64,
    /// Log-likelihood of each part of time under the fit to the others, summed.
    pub held_out: f64,
    /// Held-out mean square of the whitened residual by channel.
    pub held_out_ratio: PerChannel<f64>,
    /// Coefficients of the fit to all parts of time but one, for each.
    pub fold_steps: Vec<DVector<f64>>,
    /// Inverse of the normal matrix: covariance of the coefficients.
    pub covariance: DMatrix<f64>,
}

/// Log-likelihood of a channel: unit variance, or a common factor q where the residual is larger
/// than noise. A channel whose noise is a factor too large everywhere tells little; it is never
/// believed to be quieter than predicted.
pub(crate) fn channel_likelihood(count: f64, squares: f64) -> f64 {
    if count <= 0.0 {
        return 0.0;
    }
    let ratio = squares / count;
    let q = ratio.max(1.0);
    -0.5 * count * (q.ln() + ratio / q)
}

impl Gram {
    /// Of columns over the flat whitened sample grid; `fold_of` a sample grid entry, `length` entries an
    /// axis. `counts` as in the whitener, by fold.
    pub fn new(
        columns: &[&[f64]],
        residual: &[f64],
        length: usize,
        fold_of: &[usize],
        counts: &[PerChannel<f64>],
        prior: Vec<f64>,
    ) -> Self {
        let size = columns.len() + 1;
        let all: Vec<&[f64]> = columns
            .iter()
            .copied()
            .chain(std::iter::once(residual))
            .collect();
        let nothing = PerChannel::from_fn(|_| DMatrix::zeros(size, size));
        let mut parts = vec![nothing; FOLDS];
        // Runs of one fold are contiguous: inner products over slices.
        let mut from = 0;
        while from < length {
            let fold = fold_of[from];
            let to = (from..length)
                .find(|&k| fold_of[k] != fold)
                .unwrap_or(length);
            for axis in 0..6 {
                let range = axis * length + from..axis * length + to;
                let part = &mut parts[fold][channel_of_axis(axis)];
                for i in 0..size {
                    for j in 0..=i {
                        let (a, b) = (&all[i][range.clone()], &all[j][range.clone()]);
                        part[(i, j)] += dot(a, b);
                    }
                }
            }
            from = to;
        }
        for part in &mut parts {
            for channel in Channel::ALL {
                part[channel].fill_upper_triangle_with_lower_triangle();
            }
        }
        Self {
            parts,
            counts: counts.to_vec(),
            prior,
        }
    }

    fn size(&self) -> usize {
        self.prior.len()
    }

    /// Solves with each channel in units of its own residual, then scores each part of time under
    /// the fit to the others.
    pub fn solve(&self) -> Linear {
        let total = self.sum(None);
        let count = self.count(None);
        let (step, ratio, covariance) = self.minimise(&total, &count);
        let trained = sum_over_channels(|channel| {
            channel_likelihood(count[channel], ratio[channel] * count[channel])
        }) - self.prior_cost(&step);
        let mut squares = PerChannel::<f64>::default();
        let mut fold_steps = Vec::with_capacity(FOLDS);
        for (fold, part) in self.parts.iter().enumerate() {
            let (step, _, _) = self.minimise(&self.sum(Some(fold)), &self.count(Some(fold)));
            for channel in Channel::ALL {
                squares[channel] += left(&part[channel], &step).max(0.0);
            }
            fold_steps.push(step);
        }
        let held_out_ratio =
            PerChannel::from_fn(|channel| squares[channel] / count[channel].max(1.0));
        let held_out =
            sum_over_channels(|channel| channel_likelihood(count[channel], squares[channel]));
        Linear {
            step,
            trained,
            held_out,
            held_out_ratio,
            fold_steps,
            covariance,
        }
    }

    fn prior_cost(&self, step: &DVector<f64>) -> f64 {
        0.5 * step
            .iter()
            .zip(&self.prior)
            .map(|(value, weight)| value * value * weight)
            .sum::<f64>()
    }

    /// Over all folds but one.
    fn sum(&self, excluded: Option<usize>) -> PerChannel<DMatrix<f64>> {
        let size = self.size() + 1;
        let mut total = PerChannel::from_fn(|_| DMatrix::zeros(size, size));
        for (_, part) in self
            .parts
            .iter()
            .enumerate()
            .filter(|(fold, _)| Some(*fold) != excluded)
        {
            for channel in Channel::ALL {
                total[channel] += &part[channel];
            }
        }
        total
    }

    /// Number of values of all folds but one.
    fn count(&self, excluded: Option<usize>) -> PerChannel<f64> {
        let kept = self
            .counts
            .iter()
            .enumerate()
            .filter(|(fold, _)| Some(*fold) != excluded);
        kept.fold(PerChannel::default(), |sum, (_, count)| {
            PerChannel::from_fn(|channel| sum[channel] + count[channel])
        })
    }

    /// Coefficients, mean squares of the residual that they leave, and their covariance.
    fn minimise(
        &self,
        total: &PerChannel<DMatrix<f64>>,
        count: &PerChannel<f64>,
    ) -> (DVector<f64>, PerChannel<f64>, DMatrix<f64>) {
        let size = self.size();
        let ratio_after = |step: &DVector<f64>| {
            PerChannel::from_fn(|channel| {
                left(&total[channel], step).max(0.0) / count[channel].max(1.0)
            })
        };
        let mut step = DVector::zeros(size);
        let mut ratio = ratio_after(&step);
        let mut covariance = DMatrix::zeros(size, size);
        for _ in 0..REWEIGHTINGS {
            let mut normal = DMatrix::zeros(size, size);
            let mut right = DVector::zeros(size);
            for channel in Channel::ALL {
                let weight = ratio[channel].max(1.0).recip();
                normal += total[channel].view((0, 0), (size, size)) * weight;
                right += total[channel].view((0, size), (size, 1)) * weight;
            }
            for k in 0..size {
                normal[(k, k)] += self.prior[k] + 1e-12 * normal[(k, k)];
            }
            let Some(factor) = normal.cholesky() else {
                break;
            };
            step = factor.solve(&right);
            covariance = factor.inverse();
            let next = ratio_after(&step);
            let settled = Channel::ALL.into_iter().all(|channel| {
                (next[channel].max(1.0) / ratio[channel].max(1.0) - 1.0).abs() < SETTLED
            });
            ratio = next;
            if settled {
                break;
            }
        }
        (step, ratio, covariance)
    }
}

/// Squared residual after a step: `e.e - 2 b.step + step.A.step`.
fn left(gram: &DMatrix<f64>, step: &DVector<f64>) -> f64 {
    let size = step.len();
    let mut squares = gram[(size, size)];
    for i in 0..size {
        squares -= 2.0 * step[i] * gram[(i, size)];
        for j in 0..size {
            squares += step[i] * step[j] * gram[(i, j)];
        }
    }
    squares
}

/// Inner product in eight lanes, so that it vectorises.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (left, right) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = left
        .remainder()
        .iter()
        .zip(right.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in left.zip(right) {
        for lane in 0..8 {
            lanes[lane] += x[lane] * y[lane];
        }
    }
    rest + lanes.iter().sum::<f64>()
}
