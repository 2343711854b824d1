//! Series smoothed as much as they ask for around each time, several at once.

use std::sync::Arc;

use crate::SpatialError;
use crate::adaptive::{Adaptation, ExpectedNoise, Weighing};
use crate::banded::InverseBands;
use crate::basis::ORDER;
use crate::equations::{IntervalWeights, SplineEquations};
use crate::local_spline::{LocalSolution, Series, Statements};
use crate::low_passed::LowPassed;
use crate::system::centre;

/// Splines of [`Adaptation`]'s weights, a lane each, see [`Series`].
#[derive(Clone, Debug)]
pub(crate) struct AdaptiveFit<const C: usize, const L: usize> {
    /// What was taken off the values.
    pub(crate) constant: [f64; C],
    pub(crate) weights: Vec<IntervalWeights<L>>,
    pub(crate) coefficients: Vec<[f64; C]>,
    pub(crate) uncertainty: Arc<Uncertainty>,
}

/// How far the estimates of splines may be off, a lane each.
#[derive(Debug)]
pub(crate) struct Uncertainty {
    /// `(B^T B + P)^-1`.
    inverse: InverseBands,
    /// Variance of each sample's noise, unit^2, lane by lane.
    noise: Vec<f64>,
    /// What a low-pass has made of each lane's noise.
    low_passed: Vec<Option<LowPassed>>,
}

impl Uncertainty {
    /// Of a lane, `r b^T (B^T B + P)^-1 b` for basis functions b from `first` on.
    pub(crate) fn variance(&self, lane: usize, first: usize, b: &[f64; ORDER]) -> f64 {
        self.noise_over(lane, first) * self.inverse.quadratic_form(lane, first, b)
    }

    /// Variance of a lane's noise over a knot interval, unit^2.
    pub(crate) fn noise_over(&self, lane: usize, interval: usize) -> f64 {
        (self.noise_at(lane, interval) * self.noise_at(lane, interval + 1)).sqrt()
    }

    /// Variance of a lane's noise in a sample, unit^2.
    pub(crate) fn noise_at(&self, lane: usize, sample: usize) -> f64 {
        self.noise[sample * self.low_passed.len() + lane]
    }

    /// What a low-pass has made of a lane's noise before.
    pub(crate) fn low_passed(&self, lane: usize) -> Option<LowPassed> {
        self.low_passed[lane]
    }
}

impl<const C: usize, const L: usize> AdaptiveFit<C, L> {
    /// Learns from whole series; `channels` and `expected` are those of each lane.
    pub(crate) fn learn(
        equations: &SplineEquations,
        mut values: Vec<[f64; C]>,
        channels: [usize; L],
        expected: [ExpectedNoise; L],
    ) -> Result<Self, SpatialError> {
        equations.check(&values)?;
        let constant = centre(&mut values);
        let series = Series::new(equations, values, channels);
        let mut solution = LocalSolution::default();
        let (learnt, weights) = Adaptation::learn(equations, &series, expected, &mut solution)?;
        solution.solve(equations, &series, &weights)?;
        solution.invert();
        let noise = learnt.into_noise();
        let finished = solution.finish();
        Ok(Self::of(constant, weights, (noise, expected), finished))
    }

    /// As [`AdaptiveFit::learn`], for a window that has moved by `dropped` samples since
    /// `adaptation` was learnt; made where there is none.
    pub(crate) fn follow(
        equations: &SplineEquations,
        mut values: Vec<[f64; C]>,
        channels: [usize; L],
        expected: [ExpectedNoise; L],
        (adaptation, dropped): (&mut Option<Adaptation<L>>, usize),
    ) -> Result<Self, SpatialError> {
        equations.check(&values)?;
        let constant = centre(&mut values);
        let series = Series::new(equations, values, channels);
        let mut solution = LocalSolution::default();
        let moved = adaptation.take().and_then(|mut learnt| {
            let goes_on = learnt.move_on(series.values.len(), dropped);
            goes_on.then_some(learnt)
        });
        let mut learnt = match moved {
            Some(learnt) => learnt,
            None => Adaptation::learn(equations, &series, expected, &mut solution)?.0,
        };
        let mut weighing = Weighing::default();
        learnt.weigh(&mut weighing);
        let noise = learnt.clone().into_noise();
        solution.solve(equations, &series, &weighing.weights)?;
        let mut statements = Statements::default();
        solution.state(equations, &series, &mut statements);
        learnt.learn_from(equations, &weighing, &mut statements);
        *adaptation = Some(learnt);
        let finished = solution.finish();
        Ok(Self::of(
            constant,
            weighing.weights,
            (noise, expected),
            finished,
        ))
    }

    fn of(
        constant: [f64; C],
        weights: Vec<IntervalWeights<L>>,
        (noise, expected): (Vec<[f64; L]>, [ExpectedNoise; L]),
        (coefficients, inverse): (Vec<[f64; C]>, InverseBands),
    ) -> Self {
        Self {
            constant,
            weights,
            coefficients,
            uncertainty: Arc::new(Uncertainty {
                inverse,
                noise: noise.into_flattened(),
                low_passed: expected.map(|expected| expected.low_passed).to_vec(),
            }),
        }
    }
}
