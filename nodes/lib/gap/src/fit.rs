//! Joint fits of sets of effects on whitened residuals.

use cromosim_imu::{Effect, EffectKind, EffectSet, Reading, Shape};
use cromosim_spatial::KinematicTrack;
use nalgebra::DVector;

use crate::gram::{Gram, Linear, dot};
use crate::problem::{FOLDS, Prediction, Problem, axis_of, stage_of};
use crate::whiten::{NoiseBasis, NoiseModel, Whitener};

/// Factor on the standard errors of the normal equations: the predicted noise is stationary, that
/// of real motion is not. From withheld cases.
const WIDENING: f64 = 1.12;
/// Most steps of a fit.
const STEPS: usize = 12;

/// A problem with one kinematic track and one model of the noise.
#[derive(Clone, Debug)]
pub(crate) struct Context<'a> {
    pub problem: &'a Problem,
    pub track: KinematicTrack,
    pub basis: NoiseBasis,
    pub noise: NoiseModel,
    pub whitener: Whitener,
    pub folds: Vec<usize>,
    pub counts: Vec<[f64; 2]>,
}

/// A set of effects with fitted values.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub set: EffectSet,
    /// The fitted values: effect and place among its values.
    pub layout: Vec<(EffectKind, usize)>,
    pub prediction: Prediction,
    /// Whitened residual, flat.
    pub residual: Vec<f64>,
    /// Change of the whitened prediction per unit of each value.
    pub columns: Vec<Vec<f64>>,
    pub linear: Linear,
}

/// Standard deviation of the weak prior of an effect's value: as large as such things get.
pub(crate) fn prior_deviation(kind: EffectKind, index: usize) -> f64 {
    use EffectKind as K;
    match kind {
        K::ReferenceTilt | K::ReferenceScale | K::AccelScale | K::GyroScale | K::LeverArm => 0.3,
        K::MountRotation => 2.0,
        K::MountSlip => 0.7,
        K::SoftTissue => [20.0, 0.5][index.min(1)],
        K::TimeOffset => 1.0,
        K::ClockDrift => 3000.0,
        K::AccelBias => 2.0,
        K::GyroBias => 0.3,
        K::AccelMisalignment | K::GyroMisalignment => 0.2,
        K::AccelBiasDrift => 0.05,
        K::GyroBiasDrift => 0.005,
        K::LowPass => 50.0,
        K::GyroGSensitivity => 0.02,
        K::Vibration => [50.0, 5.0, 5.0, 5.0, 10.0][index.min(4)],
        _ => 100.0,
    }
}

/// Values of an effect that a fit moves.
pub(crate) fn free_values(kind: EffectKind) -> Vec<usize> {
    if !kind.spec().continuous {
        return Vec::new();
    }
    let mut index = 0;
    let mut free = Vec::new();
    for parameter in kind.spec().parameters {
        if !matches!(parameter.shape, Shape::Time | Shape::Choice(_)) {
            free.extend(index..index + parameter.shape.len());
        }
        index += parameter.shape.len();
    }
    free
}

/// Bounds and step of each value of an effect.
fn limits(kind: EffectKind) -> Vec<(f64, f64, f64)> {
    kind.spec()
        .parameters
        .iter()
        .flat_map(|p| std::iter::repeat_n((p.lower, p.upper, p.step), p.shape.len()))
        .collect()
}

/// A set with one value changed, kept within its bounds; none where the effect refuses it.
pub(crate) fn changed(
    set: &EffectSet,
    kind: EffectKind,
    changes: &[(usize, f64)],
) -> Option<EffectSet> {
    let effect = set.get(kind)?;
    let bounds = limits(kind);
    let mut values = effect.values().to_vec();
    for &(index, change) in changes {
        let (lower, upper, _) = bounds[index];
        values[index] = (values[index] + change).clamp(lower, upper);
    }
    let mut next = set.clone();
    next.insert(effect.with_values(values).ok()?);
    Some(next)
}

impl<'a> Context<'a> {
    pub fn new(
        problem: &'a Problem,
        track: KinematicTrack,
        basis: NoiseBasis,
        noise: NoiseModel,
    ) -> Self {
        let whitener = Whitener::new(problem, &noise);
        let folds: Vec<usize> = (0..problem.length)
            .map(|place| problem.fold(place))
            .collect();
        let mut counts = vec![[0.0; 2]; FOLDS];
        for axis in 0..6 {
            for (place, weight) in whitener.weight[axis].iter().enumerate() {
                counts[folds[place]][axis / 3] += weight * weight;
            }
        }
        Self {
            problem,
            track,
            basis,
            noise,
            whitener,
            folds,
            counts,
        }
    }

    /// Whitened measured less predicted.
    pub fn residual(&self, readings: &[Reading]) -> Vec<f64> {
        self.whitener.apply(&self.problem.residual(readings))
    }

    /// Columns of the free values of one effect of `set`, whose prediction is `base`.
    pub fn columns(&self, set: &EffectSet, base: &Prediction, kind: EffectKind) -> Vec<Vec<f64>> {
        free_values(kind)
            .into_iter()
            .map(|index| self.column(set, base, kind, index))
            .collect()
    }

    fn column(
        &self,
        set: &EffectSet,
        base: &Prediction,
        kind: EffectKind,
        index: usize,
    ) -> Vec<f64> {
        let (lower, upper, size) = limits(kind)[index];
        let value = set.get(kind).map_or(0.0, |effect| effect.values()[index]);
        // Away from a bound; a value of the order of its size moves by a fraction of itself.
        let size = if (lower..=upper).contains(&(value + size)) {
            size
        } else {
            -size
        };
        let Some(moved) = changed(set, kind, &[(index, size)]) else {
            return vec![0.0; 6 * self.problem.length];
        };
        let readings = self
            .problem
            .predict_from(&self.track, base, &moved, stage_of(kind));
        let difference = self.problem.raster(|k, axis| {
            (axis_of(&readings[k], axis) - axis_of(&base.readings[k], axis)) / size
        });
        self.whitener.apply(&difference)
    }

    pub fn gram(&self, columns: &[&[f64]], residual: &[f64], prior: Vec<f64>) -> Gram {
        Gram::new(
            columns,
            residual,
            self.problem.length,
            &self.folds,
            &self.counts,
            prior,
        )
    }

    fn squares(&self, residual: &[f64]) -> [f64; 2] {
        let half = 3 * self.problem.length;
        [
            dot(&residual[..half], &residual[..half]),
            dot(&residual[half..], &residual[half..]),
        ]
    }

    fn cost(&self, residual: &[f64]) -> f64 {
        let squares = self.squares(residual);
        -(0..2)
            .map(|c| crate::gram::channel_likelihood(self.whitener.count[c], squares[c]))
            .sum::<f64>()
    }

    /// Gauss-Newton steps with halving from the values in `set`.
    pub fn fit(&self, set: EffectSet) -> Fit {
        self.fit_steps(set, STEPS)
    }

    /// As [`Context::fit`], with another limit on the steps.
    pub fn fit_steps(&self, mut set: EffectSet, steps: usize) -> Fit {
        let layout: Vec<(EffectKind, usize)> = set
            .iter()
            .flat_map(|effect| {
                free_values(effect.kind())
                    .into_iter()
                    .map(|index| (effect.kind(), index))
            })
            .collect();
        let mut prediction = self.problem.predict(&self.track, &set);
        let mut residual = self.residual(&prediction.readings);
        let mut cost = self.cost(&residual);
        loop_steps(steps, |last| {
            let columns: Vec<Vec<f64>> = layout
                .iter()
                .map(|&(kind, index)| self.column(&set, &prediction, kind, index))
                .collect();
            let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let prior = layout
                .iter()
                .map(|&(kind, index)| prior_deviation(kind, index).powi(-2))
                .collect();
            let linear = self.gram(&slices, &residual, prior).solve();
            let finished = |set: &EffectSet, prediction: &Prediction, residual: &[f64]| Fit {
                set: set.clone(),
                layout: layout.clone(),
                prediction: prediction.clone(),
                residual: residual.to_vec(),
                columns: columns.clone(),
                linear: linear.clone(),
            };
            let promised = cost + linear.trained;
            if last || layout.is_empty() || promised < 0.1 {
                return Some(finished(&set, &prediction, &residual));
            }
            let mut share = 1.0;
            while share > 1e-3 {
                let next = moved(&set, &layout, &linear.step, share);
                let next_prediction = self.problem.predict(&self.track, &next);
                let next_residual = self.residual(&next_prediction.readings);
                let next_cost = self.cost(&next_residual);
                if next_cost < cost {
                    (set, prediction, residual, cost) =
                        (next, next_prediction, next_residual, next_cost);
                    return None;
                }
                share *= 0.3;
            }
            Some(finished(&set, &prediction, &residual))
        })
    }

    /// How well columns beside those of a fit would do, in one linear step.
    pub fn extended(
        &self,
        fit: &Fit,
        residual: &[f64],
        extra: &[Vec<f64>],
        extra_prior: &[f64],
    ) -> Linear {
        let slices: Vec<&[f64]> = fit.columns.iter().chain(extra).map(Vec::as_slice).collect();
        let prior = fit
            .layout
            .iter()
            .map(|&(kind, index)| prior_deviation(kind, index).powi(-2))
            .chain(extra_prior.iter().copied())
            .collect();
        self.gram(&slices, residual, prior).solve()
    }
}

/// Calls `step` until it has a result; it is told when it is the last time.
fn loop_steps<T>(steps: usize, mut step: impl FnMut(bool) -> Option<T>) -> T {
    let mut count = 0;
    loop {
        if let Some(result) = step(count >= steps) {
            return result;
        }
        count += 1;
    }
}

fn moved(
    set: &EffectSet,
    layout: &[(EffectKind, usize)],
    step: &DVector<f64>,
    share: f64,
) -> EffectSet {
    let mut next = set.clone();
    for (position, &(kind, index)) in layout.iter().enumerate() {
        if let Some(changed) = changed(&next, kind, &[(index, share * step[position])]) {
            next = changed;
        }
    }
    next
}

impl Fit {
    /// Mean square of the whitened residual by channel, on data that each part of the fit did not
    /// see.
    pub fn held_out_ratio(&self) -> [f64; 2] {
        self.linear.held_out_ratio
    }

    /// The set as it would be fitted without one part of time.
    pub fn without_fold(&self, fold: usize) -> EffectSet {
        moved(&self.set, &self.layout, &self.linear.fold_steps[fold], 1.0)
    }

    /// Standard errors of an effect's values; 0 for those that are not fitted.
    pub fn standard_errors(&self, effect: &Effect) -> Vec<f64> {
        let mut errors = vec![0.0; effect.values().len()];
        for (position, &(kind, index)) in self.layout.iter().enumerate() {
            if kind == effect.kind() {
                errors[index] =
                    WIDENING * self.linear.covariance[(position, position)].max(0.0).sqrt();
            }
        }
        errors
    }
}
