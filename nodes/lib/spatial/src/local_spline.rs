//! Splines whose weights differ from interval to interval, of several series on the same times at
//! once.

use crate::SpatialError;
use crate::banded::{Factor, InverseBands, InverseBlock, Solved, quadratic_form};
use crate::basis::AT_KNOT;
use crate::equations::{IntervalWeights, LocalWeights, SplineEquations, add_residual, refinements};
use crate::wide::{Four, add_product, add_scaled, add_scaled_rows, divided, widest};

/// Series on the same times, a lane each: channel c belongs to lane c modulo L, and where a lane has
/// fewer channels than others, those that it lacks are zero.
#[derive(Clone, Debug)]
pub(crate) struct Series<const C: usize, const L: usize> {
    pub(crate) values: Vec<[f64; C]>,
    /// Number of each lane's channels.
    pub(crate) channels: [usize; L],
    /// The same as floating-point numbers.
    counts: [f64; L],
    /// The derivatives at the ends.
    targets: [[f64; C]; 4],
}

impl<const C: usize, const L: usize> Series<C, L> {
    pub(crate) fn new(
        equations: &SplineEquations,
        values: Vec<[f64; C]>,
        channels: [usize; L],
    ) -> Self {
        Self {
            targets: equations.ends.map(|end| end.target(&values)),
            values,
            channels,
            counts: channels.map(|count| count as f64),
        }
    }

    /// Row i of `B^T y` of the samples alone.
    #[inline(always)]
    fn projected_row(&self, s: impl Four, equations: &SplineEquations, i: usize) -> [f64; C] {
        let mut sum = [0.0; C];
        let first = i.saturating_sub(AT_KNOT - 1);
        let (rows, values) = (&equations.collocation[first..], &self.values[first..]);
        match (rows.first_chunk(), values.first_chunk()) {
            (Some([a, b, c, d, e]), Some(values)) if i >= AT_KNOT - 1 => {
                add_scaled_rows(s, &mut sum, &[a[4], b[3], c[2], d[1], e[0]], values);
            }
            _ => {
                let reaching = rows.iter().zip(values).enumerate();
                for (k, (row, value)) in reaching.take(i - first + 1) {
                    add_scaled(s, &mut sum, row[i - first - k], value);
                }
            }
        }
        sum
    }

    /// The numbers of a lane's channels.
    pub(crate) fn channels_of(&self, lane: usize) -> impl Iterator<Item = usize> + Clone {
        (lane..C).step_by(L).take(self.channels[lane])
    }
}

/// A mean square over the channels, and the share of it that the inverse states, of each lane.
pub(crate) type Stated<const L: usize> = [[f64; L]; 2];

/// What solutions say of the motion and its noise.
#[derive(Clone, Debug, Default)]
pub(crate) struct Statements<const L: usize> {
    /// Of each knot interval: the fifth derivative over it, times the root of its length.
    pub(crate) drives: Vec<Stated<L>>,
    /// Of each knot interval: the mean square over the channels of the second derivative in its
    /// middle, times its length; and one.
    pub(crate) accelerations: Vec<Stated<L>>,
    /// Of each sample: its distance from the spline.
    pub(crate) residuals: Vec<Stated<L>>,
    /// Memory that learning from them reuses: made anew in each step, its pages would be too.
    pub(crate) room: [Vec<Stated<L>>; 2],
}

/// A solution of the equations in each lane, and memory that solving reuses.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalSolution<const C: usize, const L: usize> {
    pub(crate) coefficients: Vec<[f64; C]>,
    factor: Factor<L>,
    correction: Vec<[f64; C]>,
}

impl<const C: usize, const L: usize> LocalSolution<C, L> {
    /// Solves, not refined, and fills in what the solution says: one way down the rows, and one up.
    pub(crate) fn solve_and_state(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &[IntervalWeights<L>],
        statements: &mut Statements<L>,
    ) -> Result<(), SpatialError> {
        widest!(s => {
            let weights = equations.local_weights(weights);
            self.solve_down(s, equations, series, &weights)?;
            self.invert_and_state(s, equations, series, Solved::Down, statements);
            Ok(())
        })
    }

    /// Solves with all digits, see [`SplineEquations::solve`].
    pub(crate) fn solve(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &[IntervalWeights<L>],
    ) -> Result<(), SpatialError> {
        widest!(s => self.solve_refined(s, equations, series, weights))
    }

    #[inline(always)]
    fn solve_refined(
        &mut self,
        s: impl Four,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &[IntervalWeights<L>],
    ) -> Result<(), SpatialError> {
        let weights = equations.local_weights(weights);
        self.solve_down(s, equations, series, &weights)?;
        self.factor.solve_up(s, &mut self.coefficients);
        let mut largest = [0.0_f64; L];
        for [weight, _] in weights.intervals {
            (0..L).for_each(|lane| largest[lane] = largest[lane].max(weight[lane]));
        }
        let refined = largest.map(refinements);
        for round in 1..=refined.into_iter().max().unwrap_or(0) {
            self.residual(s, equations, series, &weights);
            self.factor.solve(s, &mut self.correction);
            for (coefficient, correction) in self.coefficients.iter_mut().zip(&self.correction) {
                let channels = coefficient.as_chunks_mut::<L>().0.iter_mut();
                for (own, correction) in channels.zip(correction.as_chunks::<L>().0) {
                    for lane in 0..L {
                        if round <= refined[lane] {
                            own[lane] += correction[lane];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// `B^T y`, the derivatives at the ends included, and the first half of the solution.
    #[inline(always)]
    fn solve_down(
        &mut self,
        s: impl Four,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &LocalWeights<L>,
    ) -> Result<(), SpatialError> {
        // Made anew each time: kept, they would be read from as far away as the values are.
        self.coefficients.resize(equations.basis.count(), [0.0; C]);
        for (i, row) in self.coefficients.iter_mut().enumerate() {
            *row = series.projected_row(s, equations, i);
        }
        for ((end, weight), target) in equations
            .ends
            .iter()
            .zip(&weights.ends)
            .zip(&series.targets)
        {
            let weighted = std::array::from_fn(|c| target[c] * weight[c % L]);
            add_multiples(s, &end.row, &weighted, &mut self.coefficients[end.first..]);
        }
        let size = equations.basis.count();
        self.factor.factor_and_solve_down(
            s,
            size,
            #[inline(always)]
            |i: usize| equations.local_row(s, i, weights),
            &mut self.coefficients,
        )
    }

    /// Inverts what was solved with, and fills in what the solution says.
    pub(crate) fn state(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        statements: &mut Statements<L>,
    ) {
        widest!(s => self.invert_and_state(s, equations, series, Solved::Whole, statements));
    }

    #[inline(always)]
    fn invert_and_state(
        &mut self,
        s: impl Four,
        equations: &SplineEquations,
        series: &Series<C, L>,
        solved: Solved,
        statements: &mut Statements<L>,
    ) {
        let Statements {
            drives,
            accelerations,
            residuals,
            ..
        } = statements;
        accelerations.resize(equations.interval_count(), [[1.0; L]; 2]);
        drives.resize(equations.interval_count(), [[0.0; L]; 2]);
        residuals.resize(equations.sample_count, [[0.0; L]; 2]);
        self.factor.invert(
            s,
            &mut self.coefficients,
            solved,
            #[inline(always)]
            |i, coefficients, block| {
                if i < drives.len() {
                    drives[i] = drive_over(s, i, equations, series, coefficients, block);
                    let second = combined(s, &coefficients[i..], &equations.second_rows[i]);
                    accelerations[i] = [mean_squares(s, &second, &series.counts), [1.0; L]];
                }
                if i < residuals.len() {
                    residuals[i] = residual_at(s, i, equations, series, coefficients, block);
                }
            },
        );
    }

    /// Inverts what was solved with, and no more.
    pub(crate) fn invert(&mut self) {
        let nothing: &mut [[f64; 0]] = &mut [];
        widest!(s => self.factor.invert(s, nothing, Solved::Whole, |_, _, _| {}));
    }

    /// The coefficients and, of what was inverted, `(B^T B + P)^-1`.
    pub(crate) fn finish(self) -> (Vec<[f64; C]>, InverseBands) {
        (self.coefficients, self.factor.into_inverse())
    }

    /// `B^T (y - B c) - P c`, into the correction.
    #[inline(always)]
    fn residual(
        &mut self,
        s: impl Four,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &LocalWeights<L>,
    ) {
        let (x, correction) = (&self.coefficients, &mut self.correction);
        correction.clear();
        correction.resize(x.len(), [0.0; C]);
        for (k, (value, row)) in series.values.iter().zip(&equations.collocation).enumerate() {
            add_residual(s, &x[k..], row, value, &[1.0; L], &mut correction[k..]);
        }
        for ((end, weight), target) in equations
            .ends
            .iter()
            .zip(&weights.ends)
            .zip(&series.targets)
        {
            let near = &mut correction[end.first..];
            add_residual(s, &x[end.first..], &end.row, target, weight, near);
        }
        let rows = equations.penalty_rows.iter().zip(weights.intervals);
        for (k, (row, weights)) in rows.enumerate() {
            let weight = &equations.eased_weight(s, k, weights);
            add_residual(s, &x[k..], row, &[0.0; C], weight, &mut correction[k..]);
        }
        let rows = equations.second_rows.iter().zip(weights.intervals);
        for (k, (row, [_, weight])) in rows.enumerate() {
            add_residual(s, &x[k..], row, &[0.0; C], weight, &mut correction[k..]);
        }
    }
}

#[inline(always)]
fn drive_over<const C: usize, const L: usize>(
    s: impl Four,
    interval: usize,
    equations: &SplineEquations,
    series: &Series<C, L>,
    coefficients: &[[f64; C]],
    block: &InverseBlock<L>,
) -> Stated<L> {
    let (row, ease) = (&equations.penalty_rows[interval], equations.eased[interval]);
    let fifth = combined(s, &coefficients[interval..], row);
    let mut stated = [
        mean_squares(s, &fifth, &series.counts),
        quadratic_form(s, block, row),
    ];
    // But for the ends there is nothing to divide by.
    if ease != 1.0 {
        for stated in &mut stated {
            *stated = divided(s, stated, &[ease; L]);
        }
    }
    stated
}

#[inline(always)]
fn residual_at<const C: usize, const L: usize>(
    s: impl Four,
    sample: usize,
    equations: &SplineEquations,
    series: &Series<C, L>,
    coefficients: &[[f64; C]],
    block: &InverseBlock<L>,
) -> Stated<L> {
    let (row, value) = (&equations.collocation[sample], &series.values[sample]);
    let mut residual = combined(s, &coefficients[sample..], row);
    (0..C).for_each(|c| residual[c] = value[c] - residual[c]);
    [
        mean_squares(s, &residual, &series.counts),
        quadratic_form(s, block, row),
    ]
}

#[inline(always)]
fn add_multiples<const C: usize, const W: usize>(
    s: impl Four,
    row: &[f64; W],
    value: &[f64; C],
    entries: &mut [[f64; C]],
) {
    for (entry, b) in entries[..W].iter_mut().zip(row) {
        add_scaled(s, entry, *b, value);
    }
}

#[inline(always)]
fn combined<const C: usize, const W: usize>(
    s: impl Four,
    coefficients: &[[f64; C]],
    row: &[f64; W],
) -> [f64; C] {
    let mut sum = [0.0; C];
    if let Some(coefficients) = coefficients.first_chunk() {
        add_scaled_rows(s, &mut sum, row, coefficients);
    }
    sum
}

#[inline(always)]
fn mean_squares<const C: usize, const L: usize>(
    s: impl Four,
    values: &[f64; C],
    counts: &[f64; L],
) -> [f64; L] {
    let mut sum = [0.0; L];
    for values in values.as_chunks::<L>().0 {
        add_product(s, &mut sum, values, values);
    }
    divided(s, &sum, counts)
}
