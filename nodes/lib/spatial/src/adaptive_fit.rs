//! Series smoothed as much as they ask for around each time, several at once.

use crate::SpatialError;
use crate::adaptive::Adaptation;
use crate::banded::InverseBand;
use crate::equations::SplineEquations;
use crate::local_spline::{LocalSolution, Series, Statements};
use crate::system::centre;

/// Splines of [`Adaptation`]'s weights, a lane each, see [`Series`].
#[derive(Clone, Debug)]
pub(crate) struct AdaptiveFit<const C: usize, const L: usize> {
    /// What was taken off the values.
    pub(crate) constant: [f64; C],
    pub(crate) weights: Vec<[f64; L]>,
    /// Variance of each sample's noise, unit^2.
    pub(crate) noise: Vec<[f64; L]>,
    pub(crate) coefficients: Vec<[f64; C]>,
    /// Of `(B^T B + P)^-1`, of each lane.
    pub(crate) inverse: [InverseBand; L],
}

impl<const C: usize, const L: usize> AdaptiveFit<C, L> {
    /// Learns from whole series; `channels` and `expected_noise` are those of each lane.
    pub(crate) fn learn(
        equations: &SplineEquations,
        mut values: Vec<[f64; C]>,
        channels: [usize; L],
        expected_noise: [f64; L],
    ) -> Result<Self, SpatialError> {
        equations.check(&values)?;
        let constant = centre(&mut values);
        let series = Series::new(equations, values, channels);
        let mut solution = LocalSolution::default();
        let learnt = Adaptation::learn(equations, &series, expected_noise, &mut solution)?;
        let weights = learnt.weights();
        solution.solve(equations, &series, &weights)?;
        Ok(Self {
            constant,
            weights,
            noise: learnt.into_noise(),
            inverse: solution.inverse_bands(false),
            coefficients: solution.coefficients,
        })
    }

    /// As [`AdaptiveFit::learn`], for a window that has moved by `dropped` samples since
    /// `adaptation` was learnt; made where there is none.
    pub(crate) fn follow(
        equations: &SplineEquations,
        mut values: Vec<[f64; C]>,
        channels: [usize; L],
        expected_noise: [f64; L],
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
            None => Adaptation::learn(equations, &series, expected_noise, &mut solution)?,
        };
        let (weights, noise) = (learnt.weights(), learnt.clone().into_noise());
        solution.solve(equations, &series, &weights)?;
        let mut statements = Statements::default();
        solution.state(equations, &series, &mut statements);
        learnt.learn_from(equations, &weights, &mut statements);
        *adaptation = Some(learnt);
        Ok(Self {
            constant,
            weights,
            noise,
            inverse: solution.inverse_bands(true),
            coefficients: solution.coefficients,
        })
    }
}
