//! Splines whose weights differ from interval to interval, of several series on the same times at
//! once.

use crate::SpatialError;
use crate::banded::{Factor, InverseBlock, Row, quadratic_form};
use crate::basis::ORDER;
use crate::equations::{LocalWeights, SplineEquations, add_residual, refinements};

/// Series on the same times, a lane each: channel c belongs to lane c modulo L, and where a lane has
/// fewer channels than others, those that it lacks are zero.
#[derive(Clone, Debug)]
pub(crate) struct Series<const C: usize, const L: usize> {
    pub(crate) values: Vec<[f64; C]>,
    /// Number of each lane's channels.
    pub(crate) channels: [usize; L],
    /// `B^T y` of the samples alone.
    projected: Vec<[f64; C]>,
    /// The derivatives at the ends.
    targets: [[f64; C]; 4],
}

impl<const C: usize, const L: usize> Series<C, L> {
    pub(crate) fn new(
        equations: &SplineEquations,
        values: Vec<[f64; C]>,
        channels: [usize; L],
    ) -> Self {
        let last_interval = equations.interval_count() - 1;
        let mut projected = vec![[0.0; C]; equations.basis.count()];
        for (k, (value, row)) in values.iter().zip(&equations.collocation).enumerate() {
            add_multiples(row, value, &mut projected[k.min(last_interval)..]);
        }
        Self {
            targets: equations.ends.map(|end| end.target(&values)),
            values,
            channels,
            projected,
        }
    }

    /// The numbers of a lane's channels.
    pub(crate) fn channels_of(&self, lane: usize) -> impl Iterator<Item = usize> + Clone {
        (lane..C).step_by(L).take(self.channels[lane])
    }
}

/// A mean square over the channels, and the share of it that the inverse states, of each lane.
pub(crate) type Stated<const L: usize> = [[f64; L]; 2];

/// A solution of the equations in each lane, what it says, and memory that solving reuses.
#[derive(Clone, Debug)]
pub(crate) struct LocalSolution<const C: usize, const L: usize> {
    pub(crate) coefficients: Vec<[f64; C]>,
    /// Band of `(B^T B + P)^-1`, see [`Factor::invert`].
    pub(crate) inverse: Vec<Row<L>>,
    /// Of each knot interval: the fifth derivative over it, times the root of its length.
    pub(crate) drives: Vec<Stated<L>>,
    /// Of each sample: its distance from the spline.
    pub(crate) residuals: Vec<Stated<L>>,
    factor: Factor<L>,
    correction: Vec<[f64; C]>,
}

impl<const C: usize, const L: usize> Default for LocalSolution<C, L> {
    fn default() -> Self {
        Self {
            coefficients: Vec::new(),
            inverse: Vec::new(),
            drives: Vec::new(),
            residuals: Vec::new(),
            factor: Factor::default(),
            correction: Vec::new(),
        }
    }
}

impl<const C: usize, const L: usize> LocalSolution<C, L> {
    /// Solves, not refined, and fills what the solution says: one way down the rows, and one up.
    pub(crate) fn solve_and_state(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &[[f64; L]],
    ) -> Result<(), SpatialError> {
        let weights = equations.local_weights(weights);
        self.coefficients.clone_from(&series.projected);
        for ((end, weight), target) in equations
            .ends
            .iter()
            .zip(&weights.ends)
            .zip(&series.targets)
        {
            for (entry, b) in self.coefficients[end.first..].iter_mut().zip(&end.row) {
                (0..C).for_each(|c| entry[c] += b * weight[c % L] * target[c]);
            }
        }
        let row = |i: usize| equations.local_row(i, &weights);
        let size = equations.basis.count();
        self.factor
            .factor_and_solve_down(size, row, &mut self.coefficients)?;
        self.start_stating(equations);
        let Self {
            coefficients,
            inverse,
            drives,
            residuals,
            factor,
            ..
        } = self;
        factor.invert(inverse, |i, block| {
            factor.solve_up(i, coefficients);
            state(
                equations,
                series,
                (i, coefficients, block),
                (drives, residuals),
            );
        });
        Ok(())
    }

    /// Solves with all digits, see [`SplineEquations::solve`].
    pub(crate) fn solve(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &[[f64; L]],
    ) -> Result<(), SpatialError> {
        let weights = equations.local_weights(weights);
        let size = equations.basis.count();
        self.correction.clone_from(&series.projected);
        for ((end, weight), target) in equations
            .ends
            .iter()
            .zip(&weights.ends)
            .zip(&series.targets)
        {
            let mut weighted = *target;
            (0..C).for_each(|c| weighted[c] *= weight[c % L]);
            add_multiples(&end.row, &weighted, &mut self.correction[end.first..]);
        }
        let row = |i: usize| equations.local_row(i, &weights);
        self.factor
            .factor_and_solve_down(size, row, &mut self.correction)?;
        for i in (0..size).rev() {
            self.factor.solve_up(i, &mut self.correction);
        }
        self.coefficients.clear();
        self.coefficients.resize(size, [0.0; C]);
        self.add_correction([true; L]);
        let refined = weights.largest.map(refinements);
        for round in 1..=refined.into_iter().max().unwrap_or(0) {
            self.residual(equations, series, &weights);
            self.factor.solve(&mut self.correction);
            self.add_correction(refined.map(|rounds| round <= rounds));
        }
        Ok(())
    }

    /// Fills the band of the inverse.
    pub(crate) fn invert(&mut self) {
        self.factor.invert(&mut self.inverse, |_, _| {});
    }

    /// Fills the band of the inverse and what the solution says.
    pub(crate) fn invert_and_state(&mut self, equations: &SplineEquations, series: &Series<C, L>) {
        self.start_stating(equations);
        let Self {
            coefficients,
            inverse,
            drives,
            residuals,
            factor,
            ..
        } = self;
        factor.invert(inverse, |i, block| {
            state(
                equations,
                series,
                (i, coefficients, block),
                (drives, residuals),
            );
        });
    }

    fn start_stating(&mut self, equations: &SplineEquations) {
        let nothing = [[0.0; L]; 2];
        self.drives.resize(equations.interval_count(), nothing);
        self.residuals.resize(equations.sample_count, nothing);
    }

    fn add_correction(&mut self, lanes: [bool; L]) {
        for (coefficient, correction) in self.coefficients.iter_mut().zip(&self.correction) {
            for c in 0..C {
                if lanes[c % L] {
                    coefficient[c] += correction[c];
                }
            }
        }
    }

    /// `B^T (y - B c) - P c`, into the correction.
    fn residual(
        &mut self,
        equations: &SplineEquations,
        series: &Series<C, L>,
        weights: &LocalWeights<L>,
    ) {
        let (coefficients, correction) = (&self.coefficients, &mut self.correction);
        correction.fill([0.0; C]);
        let last_interval = equations.interval_count() - 1;
        let mut add = |first: usize, row: &[f64; ORDER], value: &[f64; C], weight: &[f64; L]| {
            let near = &mut correction[first..];
            add_residual(&coefficients[first..], row, value, weight, near);
        };
        for (k, (value, row)) in series.values.iter().zip(&equations.collocation).enumerate() {
            add(k.min(last_interval), row, value, &[1.0; L]);
        }
        for ((end, weight), target) in equations
            .ends
            .iter()
            .zip(&weights.ends)
            .zip(&series.targets)
        {
            add(end.first, &end.row, target, weight);
        }
        let rows = equations.penalty_rows.iter().zip(&weights.penalty);
        for (first, (row, weight)) in rows.enumerate() {
            add(first, row, &[0.0; C], weight);
        }
    }
}

/// What a solution says of the knot interval that begins with function i, and of the samples at its
/// ends.
#[inline(always)]
fn state<const C: usize, const L: usize>(
    equations: &SplineEquations,
    series: &Series<C, L>,
    (i, coefficients, block): (usize, &[[f64; C]], &InverseBlock<L>),
    (drives, residuals): (&mut [Stated<L>], &mut [Stated<L>]),
) {
    let interval_count = equations.interval_count();
    if i >= interval_count {
        return;
    }
    let ease = equations.eased[i];
    let mean = |values: &[f64; C]| mean_squares(values, &series.channels);
    let row = &equations.penalty_rows[i];
    let fifth = combined(&coefficients[i..], row);
    drives[i] = [mean(&fifth), quadratic_form(block, row)].map(|said| said.map(|s| s / ease));
    // The last interval's functions are those of two samples.
    let end = if i + 1 == interval_count {
        i + 2
    } else {
        i + 1
    };
    for sample in i..end {
        let row = &equations.collocation[sample];
        let mut residual = combined(&coefficients[i..], row);
        (0..C).for_each(|c| residual[c] = series.values[sample][c] - residual[c]);
        residuals[sample] = [mean(&residual), quadratic_form(block, row)];
    }
}

#[inline(always)]
fn add_multiples<const C: usize>(row: &[f64; ORDER], value: &[f64; C], entries: &mut [[f64; C]]) {
    for (entry, b) in entries[..ORDER].iter_mut().zip(row) {
        (0..C).for_each(|c| entry[c] += b * value[c]);
    }
}

#[inline(always)]
fn combined<const C: usize>(coefficients: &[[f64; C]], row: &[f64; ORDER]) -> [f64; C] {
    let mut sum = [0.0; C];
    for (coefficient, b) in coefficients[..ORDER].iter().zip(row) {
        (0..C).for_each(|c| sum[c] += b * coefficient[c]);
    }
    sum
}

#[inline(always)]
fn mean_squares<const C: usize, const L: usize>(
    values: &[f64; C],
    channels: &[usize; L],
) -> [f64; L] {
    let mut sum = [0.0; L];
    (0..C).for_each(|c| sum[c % L] += values[c] * values[c]);
    std::array::from_fn(|lane| sum[lane] / channels[lane] as f64)
}
