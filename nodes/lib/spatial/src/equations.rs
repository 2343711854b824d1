//! The equations of a smoothing spline: everything that depends on the times alone.

use crate::SpatialError;
use crate::banded::{Banded, Factor, Row};
use crate::basis::{AT_KNOT, Basis, BasisValues, DEGREE, ORDER};
use crate::difference::MAX_STENCIL;
use crate::end_derivatives::{EndDerivative, end_derivatives};
use crate::wide::{Four, Plain, add_scaled, divided, multiply, scaled, subtract_scaled};

/// Derivative that smoothing penalises. Five is the highest that a quintic has; the response to
/// noise, `1 / (1 + weight w^10)`, then falls the most sharply, and motion below the cutoff passes
/// with the least loss.
pub(crate) const PENALTY_ORDER: usize = 5;

/// Towards the ends the penalty falls linearly over so many intervals: with samples on one side
/// only, the same weight would let the fifth derivative's natural condition bend the curve
/// (measured: the error of a smoothed acceleration there falls by a third).
const EASED_INTERVALS: f64 = 40.0;

/// Up to this local weight a spline passes all that there is.
const NOTHING_TO_SMOOTH: f64 = 1e-6;

/// From these weights on a solution is refined once, and once more: at a weight of 10^k about k of
/// the sixteen digits of `B^T B` drown in the sum. The two weights have no source.
const REFINED_ONCE: f64 = 1e2;
const REFINED_TWICE: f64 = 1e8;

/// The equations of smoothing splines on one set of times: see [`crate::SplineSystem`].
#[derive(Clone, Debug)]
pub(crate) struct SplineEquations {
    pub(crate) basis: Basis,
    /// Median sample interval, s.
    pub(crate) interval: f64,
    /// Time of the first sample, s.
    pub(crate) origin: f64,
    pub(crate) sample_count: usize,
    /// Values of the basis functions at the samples: sample k lies under the functions from k on.
    pub(crate) collocation: Vec<[f64; AT_KNOT]>,
    pub(crate) ends: [EndDerivative; 4],
    /// Fifth derivative over each knot interval, times the root of the interval's length and of its
    /// ease: `|rows c|^2 = c^T P c` for a uniform weight of one.
    pub(crate) penalty_rows: Vec<[f64; ORDER]>,
    /// Second derivative in the middle of each knot interval, times the root of its length.
    pub(crate) second_rows: Vec<[f64; ORDER]>,
    /// What a uniform weight is multiplied with over each interval, see [`EASED_INTERVALS`]; local
    /// weights are divided by it.
    pub(crate) eased: Vec<f64>,
    /// `B^T B` of the samples alone, and with the derivatives at the ends.
    gram: Banded,
    gram_with_ends: Banded,
    penalty: Banded,
}

/// What the penalty of one interval weighs, for times counted in median sample intervals; no unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalWeight {
    /// The square of the fifth derivative: smoothness.
    pub fifth: f64,
    /// The square of the second derivative: that no acceleration is larger than those around.
    pub second: f64,
}

/// What the penalty weighs.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PenaltyWeights<'a> {
    /// The same everywhere, eased off at the ends.
    Uniform(f64),
    /// One for each knot interval.
    Local(&'a [LocalWeight]),
}

/// What the squares of the fifth and the second derivative over one knot interval weigh, of each lane.
pub(crate) type IntervalWeights<const L: usize> = [[f64; L]; 2];

/// The weights of all knot intervals, for as many series at once as there are lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalWeights<'a, const L: usize> {
    pub(crate) intervals: &'a [IntervalWeights<L>],
    /// What each derivative at the ends counts.
    pub(crate) ends: [[f64; L]; 4],
}

/// Memory that solving reuses.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch<const C: usize> {
    pub(crate) factor: Factor,
    pub(crate) coefficients: Vec<[f64; C]>,
    pub(crate) correction: Vec<[f64; C]>,
}

impl SplineEquations {
    /// `times`: at least two, increasing, in intervals since the origin.
    pub(crate) fn from_times(times: &[f64], interval: f64, origin: f64) -> Self {
        let basis = Basis::new(times);
        let collocation: Vec<_> = (0..times.len()).map(|k| basis.at_knot(k)).collect();
        let mut gram = Banded::zeros(basis.count());
        for (k, row) in collocation.iter().enumerate() {
            gram.add_outer_product(k, row, 1.0);
        }
        let ends = end_derivatives(&basis, times);
        let mut gram_with_ends = gram.clone();
        for end in &ends {
            gram_with_ends.add_outer_product(end.first, &end.row, end.weight);
        }
        let eased = eased(basis.interval_count());
        let penalty_rows = penalty_rows(&basis, &eased);
        let second_rows = second_rows(&basis);
        let mut penalty = Banded::zeros(basis.count());
        for (first, row) in penalty_rows.iter().enumerate() {
            penalty.add_outer_product(first, row, 1.0);
        }
        Self {
            basis,
            interval,
            origin,
            sample_count: times.len(),
            collocation,
            ends,
            second_rows,
            penalty_rows,
            eased,
            gram,
            gram_with_ends,
            penalty,
        }
    }

    /// Checks that `values` belong to these times and are finite.
    pub(crate) fn check<const C: usize>(&self, values: &[[f64; C]]) -> Result<(), SpatialError> {
        if values.len() != self.sample_count {
            return Err(SpatialError::LengthMismatch {
                what: "values",
                expected: self.sample_count,
                found: values.len(),
            });
        }
        match values
            .iter()
            .position(|value| value.iter().any(|v| !v.is_finite()))
        {
            Some(index) => Err(SpatialError::NotFinite {
                index,
                what: "value",
            }),
            None => Ok(()),
        }
    }

    /// Number of knot intervals.
    pub(crate) fn interval_count(&self) -> usize {
        self.penalty_rows.len()
    }

    fn end_weight(&self, end: &EndDerivative, weights: PenaltyWeights) -> f64 {
        match weights {
            PenaltyWeights::Uniform(_) => end.weight,
            PenaltyWeights::Local(weights) => local_end_weight(end, weights[end.first].fifth),
        }
    }

    /// With what these weights of the knot intervals make of the ends.
    #[inline(always)]
    pub(crate) fn local_weights<'a, const L: usize>(
        &self,
        intervals: &'a [IntervalWeights<L>],
    ) -> LocalWeights<'a, L> {
        let ends = self.ends.each_ref();
        LocalWeights {
            intervals,
            ends: ends
                .map(|end| intervals[end.first][0].map(|weight| local_end_weight(end, weight))),
        }
    }

    /// What the penalty row of an interval counts.
    #[inline(always)]
    pub(crate) fn eased_weight<const L: usize>(
        &self,
        s: impl Four,
        interval: usize,
        [fifth, _]: &IntervalWeights<L>,
    ) -> [f64; L] {
        let ease = self.eased[interval];
        if ease == 1.0 {
            *fifth
        } else {
            divided(s, fifth, &[ease; L])
        }
    }

    /// Row i of `B^T B + P` for local weights.
    #[inline(always)]
    pub(crate) fn local_row<const L: usize>(
        &self,
        s: impl Four,
        i: usize,
        weights: &LocalWeights<L>,
    ) -> Row<L> {
        let mut entries = [[0.0; L]; ORDER];
        for (entry, given) in entries.iter_mut().zip(&self.gram.rows[i]) {
            *entry = [*given; L];
        }
        if i < ORDER || i + ORDER >= self.basis.count() {
            for (end, weight) in self.ends.iter().zip(&weights.ends) {
                if (end.first..end.first + ORDER).contains(&i) {
                    add_products(s, &mut entries, i - end.first, &end.row, weight);
                }
            }
        }
        let first = i.saturating_sub(DEGREE);
        let intervals = first..self.interval_count().min(i + 1);
        let place = i - first;
        let own = &weights.intervals[intervals.clone()];
        // Eased are those near the ends: from either on, fewer and fewer.
        if self.eased[intervals.start] == 1.0 && self.eased[intervals.end - 1] == 1.0 {
            let rows = &self.penalty_rows[intervals.clone()];
            add_all_products::<L, 0>(s, &mut entries, place, rows, own);
        } else {
            for (k, interval) in intervals.clone().enumerate() {
                let weight = self.eased_weight(s, interval, &own[k]);
                let row = &self.penalty_rows[interval];
                add_products(s, &mut entries, place - k, row, &weight);
            }
        }
        add_all_products::<L, 1>(s, &mut entries, place, &self.second_rows[intervals], own);
        entries
    }

    /// Minimises `|y - B c|^2 + c^T P c`, P the penalty with one weight for all intervals; the coefficients come in
    /// `scratch`.
    ///
    /// A large weight drowns B in the sum `B^T B + P`: solutions are then refined with the
    /// residual of the least-squares problem itself, in which B and P are apart, to an error that
    /// grows with the root of the weight only.
    pub(crate) fn solve<const C: usize>(
        &self,
        values: &[[f64; C]],
        weight: f64,
        scratch: &mut Scratch<C>,
    ) -> Result<(), SpatialError> {
        scratch
            .factor
            .factor_sum(&self.gram_with_ends, weight, &self.penalty)?;
        scratch.coefficients.clear();
        scratch.coefficients.resize(self.basis.count(), [0.0; C]);
        for _ in 0..=refinements(weight) {
            self.residual(values, weight, scratch);
            scratch.factor.solve(Plain, &mut scratch.correction);
            for (coefficient, correction) in
                scratch.coefficients.iter_mut().zip(&scratch.correction)
            {
                for c in 0..C {
                    coefficient[c] += correction[c];
                }
            }
        }
        Ok(())
    }

    /// `B^T B + P`, factored.
    pub(crate) fn factor(&self, weights: PenaltyWeights) -> Result<Factor, SpatialError> {
        let mut factor = Factor::default();
        match weights {
            PenaltyWeights::Uniform(weight) => {
                factor.factor_sum(&self.gram_with_ends, weight, &self.penalty)?;
            }
            PenaltyWeights::Local(weights) => {
                let weights: Vec<IntervalWeights<1>> = weights
                    .iter()
                    .map(|weight| [[weight.fifth], [weight.second]])
                    .collect();
                let weights = self.local_weights(&weights);
                let row = |i: usize| self.local_row(Plain, i, &weights);
                factor.factor_rows(self.basis.count(), row)?;
            }
        }
        Ok(factor)
    }

    /// What the samples are multiplied with in `x^T B^T y`, the derivatives at the ends included,
    /// for coefficients x that are zero but from `start` on: one row a sample, and the first
    /// sample.
    pub(crate) fn transposed<const C: usize>(
        &self,
        weights: PenaltyWeights,
        start: usize,
        x: &[[f64; C]],
    ) -> (usize, Vec<[f64; C]>) {
        let dot = |first: usize, row: &[f64]| -> [f64; C] {
            let entry = |j: usize| {
                (first + j)
                    .checked_sub(start)
                    .and_then(|i| x.get(i))
                    .copied()
                    .unwrap_or([0.0; C])
            };
            row.iter().enumerate().fold([0.0; C], |sum, (j, b)| {
                std::array::from_fn(|c| sum[c] + b * entry(j)[c])
            })
        };
        let (mut low, mut high) = (
            start.saturating_sub(DEGREE),
            (start + x.len()).min(self.sample_count),
        );
        let reached = self
            .ends
            .iter()
            .filter(|end| end.first < start + x.len() && start < end.first + ORDER);
        let reached: Vec<&EndDerivative> = reached.collect();
        for end in &reached {
            low = low.min(end.start);
            high = high.max((end.start + MAX_STENCIL).min(self.sample_count));
        }
        low = low.min(high);
        let mut rows: Vec<[f64; C]> = (low..high).map(|k| dot(k, &self.collocation[k])).collect();
        for end in reached {
            let weight = self.end_weight(end, weights);
            let weighted = dot(end.first, &end.row).map(|d| d * weight);
            for (row, w) in rows[end.start - low..].iter_mut().zip(end.stencil) {
                (0..C).for_each(|c| row[c] += w * weighted[c]);
            }
        }
        (low, rows)
    }

    /// `B^T (y - B c) - P c` of the coefficients in `scratch`, into its correction; returns
    /// `|y - B c|^2 + c^T P c`, over all channels, summed from the residuals themselves.
    pub(crate) fn residual<const C: usize>(
        &self,
        values: &[[f64; C]],
        weight: f64,
        scratch: &mut Scratch<C>,
    ) -> f64 {
        let Scratch {
            coefficients,
            correction,
            ..
        } = scratch;
        correction.clear();
        correction.resize(self.basis.count(), [0.0; C]);
        let mut sum = 0.0;
        for (k, (value, row)) in values.iter().zip(&self.collocation).enumerate() {
            let near = &mut correction[k..];
            sum += add_residual(Plain, &coefficients[k..], row, value, &[1.0], near);
        }
        for end in &self.ends {
            let target = end.target(values);
            sum += add_residual(
                Plain,
                &coefficients[end.first..],
                &end.row,
                &target,
                &[end.weight],
                &mut correction[end.first..],
            );
        }
        for (first, row) in self.penalty_rows.iter().enumerate() {
            sum += add_residual(
                Plain,
                &coefficients[first..],
                row,
                &[0.0; C],
                &[weight],
                &mut correction[first..],
            );
        }
        sum
    }

    /// `|y - B c|^2` over the samples and channels alone.
    pub(crate) fn distance<const C: usize>(
        &self,
        values: &[[f64; C]],
        coefficients: &[[f64; C]],
    ) -> f64 {
        let square = |(k, (value, row)): (usize, (&[f64; C], &[f64; AT_KNOT]))| -> f64 {
            let near = &coefficients[k..];
            (0..C)
                .map(|c| {
                    (value[c]
                        - row
                            .iter()
                            .zip(near)
                            .map(|(w, near)| w * near[c])
                            .sum::<f64>())
                    .powi(2)
                })
                .sum()
        };
        values
            .iter()
            .zip(&self.collocation)
            .enumerate()
            .map(square)
            .sum()
    }

    /// First function and the basis' values and derivatives, per s and s^2, at a time moved into
    /// the range.
    pub(crate) fn basis_at(&self, seconds: f64) -> (usize, BasisValues) {
        let end = self.basis.interval(self.basis.interval_count() - 1).1;
        let t = ((seconds - self.origin) / self.interval).clamp(0.0, end);
        let first = self.basis.interval_of(t);
        let [value, slope, second] = self.basis.values(first, t);
        let per_second = 1.0 / self.interval;
        (
            first,
            [
                value,
                slope.map(|s| s * per_second),
                second.map(|s| s * per_second * per_second),
            ],
        )
    }

    /// Time from a stamp to the nearer end of the samples, s; 0 outside them.
    pub(crate) fn to_nearer_end(&self, seconds: f64) -> f64 {
        let (_, end) = self.basis.interval(self.basis.interval_count() - 1);
        let after = seconds - self.origin;
        after.min(end * self.interval - after).max(0.0)
    }

    /// Weight whose response `1 / (1 + weight w^10)` is one half at `cutoff_hz`.
    pub(crate) fn weight_of_cutoff(&self, cutoff_hz: f64) -> f64 {
        (std::f64::consts::TAU * cutoff_hz * self.interval).powi(-2 * PENALTY_ORDER as i32)
    }

    /// Weight of the second derivative whose response `1 / (1 + weight w^4)` is one half at
    /// `cutoff_hz`.
    pub(crate) fn second_weight_of_cutoff(&self, cutoff_hz: f64) -> f64 {
        (std::f64::consts::TAU * cutoff_hz * self.interval).powi(-4)
    }

    /// The inverse of [`SplineEquations::second_weight_of_cutoff`], Hz.
    #[inline]
    pub(crate) fn cutoff_of_second_weight(&self, weight: f64) -> f64 {
        (weight.sqrt().sqrt() * std::f64::consts::TAU * self.interval).recip()
    }

    /// Frequency at which a weight's response is one half, Hz.
    pub(crate) fn cutoff_of_weight(&self, weight: f64) -> f64 {
        weight.powf(-0.5 / PENALTY_ORDER as f64) / (std::f64::consts::TAU * self.interval)
    }

    /// Observations, the four derivatives at the ends among them, less the polynomial part.
    pub(crate) fn free_count(&self) -> usize {
        self.sample_count + 4 - PENALTY_ORDER
    }

    /// Score of a weight, see [`crate::SplineSystem::score`].
    pub(crate) fn score<const C: usize>(
        &self,
        values: &[[f64; C]],
        weight: f64,
        scratch: &mut Scratch<C>,
    ) -> Result<f64, SpatialError> {
        self.solve(values, weight, scratch)?;
        let square = self.residual(values, weight, scratch);
        let free = self.free_count() as f64;
        // A series at rest leaves nothing: any weight is right for it, and the logarithm must stay
        // finite.
        let mean_square = square / (C as f64 * free) + f64::MIN_POSITIVE;
        Ok(C as f64
            * (free * mean_square.ln() + scratch.factor.log_determinant() - free * weight.ln()))
    }
}

/// How often a solution is refined.
pub(crate) fn refinements(largest_weight: f64) -> usize {
    usize::from(largest_weight >= REFINED_ONCE) + usize::from(largest_weight > REFINED_TWICE)
}

/// What the derivative at an end counts. They are made of the samples that count already, which does
/// no harm where there is nothing to smooth; where weights are local, and stand for what is known,
/// they count no more than there.
fn local_end_weight(end: &EndDerivative, weight: f64) -> f64 {
    end.weight / (1.0 + weight / NOTHING_TO_SMOOTH)
}

/// Adds the products of all rows that reach a row of a band matrix, which is entry `place` of the first
/// of them, one less of the next, and so on.
#[inline(always)]
fn add_all_products<const L: usize, const KIND: usize>(
    s: impl Four,
    entries: &mut Row<L>,
    place: usize,
    rows: &[[f64; ORDER]],
    weights: &[IntervalWeights<L>],
) {
    match (rows.first_chunk::<ORDER>(), weights.first_chunk::<ORDER>()) {
        (Some(rows), Some(weights)) => {
            add_products(s, entries, 5, &rows[0], &weights[0][KIND]);
            add_products(s, entries, 4, &rows[1], &weights[1][KIND]);
            add_products(s, entries, 3, &rows[2], &weights[2][KIND]);
            add_products(s, entries, 2, &rows[3], &weights[3][KIND]);
            add_products(s, entries, 1, &rows[4], &weights[4][KIND]);
            add_products(s, entries, 0, &rows[5], &weights[5][KIND]);
        }
        _ => {
            for (k, (row, weight)) in rows.iter().zip(weights).enumerate() {
                add_products(s, entries, place - k, row, &weight[KIND]);
            }
        }
    }
}

/// Adds `weight * row row^T` to a row of a band matrix, of which it is entry m.
#[inline(always)]
fn add_products<const L: usize>(
    s: impl Four,
    entries: &mut Row<L>,
    m: usize,
    row: &[f64; ORDER],
    weight: &[f64; L],
) {
    let weighted = scaled(s, weight, row[m]);
    for j in 0..=m {
        add_scaled(s, &mut entries[m - j], row[j], &weighted);
    }
}

/// Residual of one row: its weighted square is returned, its weighted product with the row added to
/// `correction`; the weight of channel c is that of lane c modulo L.
#[inline(always)]
pub(crate) fn add_residual<const C: usize, const W: usize, const L: usize>(
    s: impl Four,
    coefficients: &[[f64; C]],
    row: &[f64; W],
    value: &[f64; C],
    weight: &[f64; L],
    correction: &mut [[f64; C]],
) -> f64 {
    let mut residual = *value;
    for (coefficient, b) in coefficients[..W].iter().zip(row) {
        subtract_scaled(s, &mut residual, *b, coefficient);
    }
    let mut weighted = residual;
    for weighted in weighted.as_chunks_mut::<L>().0 {
        multiply(s, weighted, weight);
    }
    for (entry, b) in correction[..W].iter_mut().zip(row) {
        add_scaled(s, entry, *b, &weighted);
    }
    (0..C).map(|c| residual[c] * weighted[c]).sum()
}

/// The fifth derivatives are constant between knots.
fn penalty_rows(basis: &Basis, eased: &[f64]) -> Vec<[f64; ORDER]> {
    let row = |first: usize| {
        let (start, end) = basis.interval(first);
        basis
            .derivatives(first, 0.5 * (start + end), PENALTY_ORDER)
            .map(|d| d * ((end - start) * eased[first]).sqrt())
    };
    (0..basis.interval_count()).map(row).collect()
}

fn second_rows(basis: &Basis) -> Vec<[f64; ORDER]> {
    let row = |first: usize| {
        let (start, end) = basis.interval(first);
        let second = basis.derivatives(first, 0.5 * (start + end), 2);
        second.map(|d| d * (end - start).sqrt())
    };
    (0..basis.interval_count()).map(row).collect()
}

fn eased(interval_count: usize) -> Vec<f64> {
    let share = |first: usize| {
        let from_end = first.min(interval_count - 1 - first) as f64 + 0.5;
        (from_end / EASED_INTERVALS).min(1.0)
    };
    (0..interval_count).map(share).collect()
}
