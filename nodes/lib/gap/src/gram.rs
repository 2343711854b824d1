//! Normal equations by channel and part of time: training and held-out residuals without another
//! pass over the series.

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, NullaryFnOnce};

use cromosim_imu::{Channel, PerChannel};

use crate::axes::{channel_of_axis, sum_over_channels};
use crate::prepared::FOLDS;
use crate::whiten::is_zero;

/// Times that the channels' weights are taken from the residual of the step before.
const REWEIGHTINGS: usize = 3;
/// Relative change of these weights below which they have settled.
const SETTLED: f64 = 0.01;

/// Inner products of columns (the last is the residual), by fold: of one series, or of several whose
/// columns share coefficients.
#[derive(Clone, Debug)]
pub(crate) struct Gram {
    blocks: Vec<Block>,
    /// 1 / prior variance of each coefficient.
    prior: Vec<f64>,
}

/// The inner products of one series.
#[derive(Clone, Debug, Default)]
struct Block {
    /// Which coefficient each column has.
    coefficients: Vec<usize>,
    /// Which axes each column changes, and the residual's: most change few.
    changes: Vec<[bool; 6]>,
    parts: Vec<PerChannel<DMatrix<f64>>>,
    /// Number of values, by fold.
    counts: Vec<PerChannel<f64>>,
}

/// Columns and a residual over the flat whitened sample grid.
pub(crate) struct Series<'a> {
    pub columns: &'a [&'a [f64]],
    pub residual: &'a [f64],
    /// Entries an axis.
    pub length: usize,
    /// Which part of time an entry of the sample grid belongs to.
    pub fold_of: &'a [usize],
    /// Number of values compared, by part of time.
    pub counts: &'a [PerChannel<f64>],
}

/// What a linear fit leaves.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    /// Coefficients.
    pub step: DVector<f64>,
    /// Log-likelihood of each part of time under the fit to the others, summed.
    pub held_out: f64,
    /// Held-out mean square of the whitened residual by channel.
    pub held_out_ratio: PerChannel<f64>,
    /// Coefficients of the fit to all parts of time but one, for each.
    pub fold_steps: Vec<DVector<f64>>,
    /// Inverse of the normal matrix: covariance of the coefficients.
    pub covariance: DMatrix<f64>,
}

/// What a linear fit leaves of several series.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    /// All coefficients.
    pub step: DVector<f64>,
    /// Log-likelihood of all series, less the prior's cost.
    pub trained: f64,
    /// Of each series, with its own coefficients and likelihoods.
    pub parts: Vec<Linear>,
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

/// What is known of a Gram matrix: a block, and where it has which of its columns.
struct Known<'a, F: Fn(usize) -> Option<usize>> {
    block: &'a Block,
    place: F,
}

impl<F: Fn(usize) -> Option<usize>> Known<'_, F> {
    fn has(&self, i: usize, j: usize) -> bool {
        (self.place)(i).is_some() && (self.place)(j).is_some()
    }

    /// Puts it in its place, and mirrors all.
    fn complete(&self, parts: &mut [PerChannel<DMatrix<f64>>]) {
        for (fold, part) in parts.iter_mut().enumerate() {
            for channel in Channel::ALL {
                let size = part[channel].nrows();
                for (i, j) in (0..size).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                    if let (Some(row), Some(column)) = ((self.place)(i), (self.place)(j)) {
                        part[channel][(i, j)] = self.block.parts[fold][channel][(row, column)];
                    }
                }
                part[channel].fill_upper_triangle_with_lower_triangle();
            }
        }
    }
}

impl Gram {
    pub fn new(series: &Series, prior: Vec<f64>) -> Self {
        let nothing = Block::default();
        let known = Known {
            block: &nothing,
            place: |_| None,
        };
        Self::beside(series, prior, &known)
    }

    /// [`Gram::new`] of the columns of this one (of one series) and more, without another pass over
    /// those that it has; nor over the residual, where that is its own too.
    pub fn extended(&self, series: &Series, prior: Vec<f64>, has_own_residual: bool) -> Self {
        let (own, residual) = (self.size(), series.columns.len());
        let place = |i: usize| match i {
            i if i < own => Some(i),
            i if i == residual && has_own_residual => Some(own),
            _ => None,
        };
        let known = Known {
            block: &self.blocks[0],
            place,
        };
        Self::beside(series, prior, &known)
    }

    /// Inner products, but for those that are known already.
    fn beside<F: Fn(usize) -> Option<usize>>(
        series: &Series,
        prior: Vec<f64>,
        known: &Known<F>,
    ) -> Self {
        let Series {
            columns,
            residual,
            length,
            fold_of,
            counts,
        } = *series;
        let size = columns.len() + 1;
        let all: Vec<&[f64]> = columns
            .iter()
            .copied()
            .chain(std::iter::once(residual))
            .collect();
        let changes_of = |(i, column): (usize, &&[f64])| match (known.place)(i) {
            Some(place) => known.block.changes[place],
            None => {
                std::array::from_fn(|axis| !is_zero(&column[axis * length..(axis + 1) * length]))
            }
        };
        let changes: Vec<[bool; 6]> = all.iter().enumerate().map(changes_of).collect();
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
                for i in (0..size).filter(|&i| changes[i][axis]) {
                    for j in (0..=i).filter(|&j| changes[j][axis] && !known.has(i, j)) {
                        let (a, b) = (&all[i][range.clone()], &all[j][range.clone()]);
                        part[(i, j)] += dot(a, b);
                    }
                }
            }
            from = to;
        }
        known.complete(&mut parts);
        let block = Block {
            coefficients: (0..columns.len()).collect(),
            changes,
            parts,
            counts: counts.to_vec(),
        };
        Self {
            blocks: vec![block],
            prior,
        }
    }

    /// Of several series, each with the coefficients of its columns; `prior` is that of all
    /// coefficients.
    pub fn together(series: Vec<(Self, Vec<usize>)>, prior: Vec<f64>) -> Self {
        let of = |(gram, coefficients): (Self, Vec<usize>)| {
            gram.blocks.into_iter().map(move |block| Block {
                coefficients: block
                    .coefficients
                    .iter()
                    .map(|&column| coefficients[column])
                    .collect(),
                ..block
            })
        };
        Self {
            blocks: series.into_iter().flat_map(of).collect(),
            prior,
        }
    }

    fn size(&self) -> usize {
        self.prior.len()
    }

    /// What a linear fit leaves without some of one series' columns, after their coefficients were
    /// moved by as much as `moves` says: no pass over the series is needed.
    pub fn solve_without(&self, columns: &[usize], moves: &[f64]) -> Linear {
        let kept: Vec<usize> = (0..self.size()).filter(|k| !columns.contains(k)).collect();
        let size = self.size() + 1;
        let mut selection = DMatrix::zeros(size, kept.len() + 1);
        for (new, &old) in kept.iter().enumerate() {
            selection[(old, new)] = 1.0;
        }
        selection[(size - 1, kept.len())] = 1.0;
        for (&column, change) in columns.iter().zip(moves) {
            // The residual is measured less predicted.
            selection[(column, kept.len())] = -change;
        }
        let blocks = self.blocks.iter().map(|block| Block {
            coefficients: (0..kept.len()).collect(),
            changes: Vec::new(),
            parts: block
                .parts
                .iter()
                .map(|part| {
                    PerChannel::from_fn(|channel| {
                        selection.transpose() * &part[channel] * &selection
                    })
                })
                .collect(),
            counts: block.counts.clone(),
        });
        let without = Self {
            blocks: blocks.collect(),
            prior: kept.iter().map(|&k| self.prior[k]).collect(),
        };
        without.solve()
    }

    /// [`Gram::solution`] of one series.
    pub fn solve(&self) -> Linear {
        self.solution().parts.swap_remove(0)
    }

    /// Solves with each channel of each series in units of its own residual, then scores each part
    /// of time under the fit to the others.
    pub fn solution(&self) -> Solution {
        let all = self.minimise(None);
        let of_folds: Vec<Minimum> = (0..FOLDS).map(|fold| self.minimise(Some(fold))).collect();
        let mut trained = 0.0;
        let parts = self.blocks.iter().enumerate().map(|(index, block)| {
            let count = block.count(None);
            let ratio = all.ratios[index];
            trained += sum_over_channels(|channel| {
                channel_likelihood(count[channel], ratio[channel] * count[channel])
            });
            let mut squares = PerChannel::<f64>::default();
            for (part, minimum) in block.parts.iter().zip(&of_folds) {
                let step = minimum.step.select_rows(&block.coefficients);
                for channel in Channel::ALL {
                    squares[channel] += left(&part[channel], &step).max(0.0);
                }
            }
            let of = |values: &DVector<f64>| values.select_rows(&block.coefficients);
            Linear {
                step: of(&all.step),
                held_out: sum_over_channels(|channel| {
                    channel_likelihood(count[channel], squares[channel])
                }),
                held_out_ratio: PerChannel::from_fn(|channel| {
                    squares[channel] / count[channel].max(1.0)
                }),
                fold_steps: of_folds.iter().map(|minimum| of(&minimum.step)).collect(),
                covariance: all
                    .covariance
                    .select_rows(&block.coefficients)
                    .select_columns(&block.coefficients),
            }
        });
        let parts = parts.collect();
        Solution {
            trained: trained - self.prior_cost(&all.step),
            step: all.step,
            parts,
        }
    }

    fn prior_cost(&self, step: &DVector<f64>) -> f64 {
        0.5 * step
            .iter()
            .zip(&self.prior)
            .map(|(value, weight)| value * value * weight)
            .sum::<f64>()
    }

    /// The coefficients that leave least, with all parts of time but one.
    fn minimise(&self, excluded: Option<usize>) -> Minimum {
        let size = self.size();
        let totals: Vec<_> = self
            .blocks
            .iter()
            .map(|block| block.sum(excluded))
            .collect();
        let counts: Vec<_> = self
            .blocks
            .iter()
            .map(|block| block.count(excluded))
            .collect();
        let ratios_after = |step: &DVector<f64>| -> Vec<PerChannel<f64>> {
            let blocks = self.blocks.iter().zip(totals.iter().zip(&counts));
            blocks
                .map(|(block, (total, count))| {
                    let step = step.select_rows(&block.coefficients);
                    PerChannel::from_fn(|channel| {
                        left(&total[channel], &step).max(0.0) / count[channel].max(1.0)
                    })
                })
                .collect()
        };
        let step = DVector::zeros(size);
        let mut minimum = Minimum {
            ratios: ratios_after(&step),
            step,
            covariance: DMatrix::zeros(size, size),
        };
        for _ in 0..REWEIGHTINGS {
            let (normal, right) = self.normal_equations(&totals, &minimum.ratios);
            let Some(factor) = normal.cholesky() else {
                break;
            };
            let step = factor.solve(&right);
            let ratios = ratios_after(&step);
            let pairs = ratios.iter().zip(&minimum.ratios);
            let settled = pairs.into_iter().all(|(next, ratio)| {
                Channel::ALL.into_iter().all(|channel| {
                    (next[channel].max(1.0) / ratio[channel].max(1.0) - 1.0).abs() < SETTLED
                })
            });
            minimum = Minimum {
                step,
                ratios,
                covariance: factor.inverse(),
            };
            if settled {
                break;
            }
        }
        minimum
    }

    /// Normal matrix and right-hand side, each channel in units of its residual.
    fn normal_equations(
        &self,
        totals: &[PerChannel<DMatrix<f64>>],
        ratios: &[PerChannel<f64>],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let size = self.size();
        let mut normal = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        for (block, (total, ratio)) in self.blocks.iter().zip(totals.iter().zip(ratios)) {
            let own = block.coefficients.len();
            for channel in Channel::ALL {
                let weight = ratio[channel].max(1.0).recip();
                for (i, &row) in block.coefficients.iter().enumerate() {
                    for (j, &column) in block.coefficients.iter().enumerate() {
                        normal[(row, column)] += total[channel][(i, j)] * weight;
                    }
                    right[row] += total[channel][(i, own)] * weight;
                }
            }
        }
        for k in 0..size {
            normal[(k, k)] += self.prior[k] + 1e-12 * normal[(k, k)];
        }
        (normal, right)
    }
}

/// Coefficients, mean squares of the residuals that they leave by series, and their covariance.
struct Minimum {
    step: DVector<f64>,
    ratios: Vec<PerChannel<f64>>,
    covariance: DMatrix<f64>,
}

impl Block {
    /// Over all folds but one.
    fn sum(&self, excluded: Option<usize>) -> PerChannel<DMatrix<f64>> {
        let size = self.coefficients.len() + 1;
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

/// Sums that an inner product adds up side by side: an addition waits for the one before it, and sixteen fill four vectors of
/// four.
const LANES: usize = 16;

/// Inner product in [`LANES`] sums, by the widest instructions that the processor has; no multiplication is fused with its
/// addition, so that every processor gives the same bytes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    Arch::new().dispatch(Product { a, b })
}

struct Product<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl NullaryFnOnce for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let mut lanes = [0.0; LANES];
        let (left, rest) = self.a.as_chunks::<LANES>();
        let (right, others) = self.b.as_chunks::<LANES>();
        for (x, y) in left.iter().zip(right) {
            for lane in 0..LANES {
                lanes[lane] += x[lane] * y[lane];
            }
        }
        let rest: f64 = rest.iter().zip(others).map(|(x, y)| x * y).sum();
        rest + lanes.iter().sum::<f64>()
    }
}
