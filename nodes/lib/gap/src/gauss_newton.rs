//! Gauss-Newton fits of sets of effects, of one recording or of several whose device is the same.

use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_imu::{EffectKind, EffectSet, Owner};
use nalgebra::DVector;

use crate::fit::{Evaluated, Fit, FitModel, free_values, layout_of, slices, stepped};
use crate::gram::Gram;
use crate::policy::search::{CONVERGED_NATS, FIT_STEPS, SAME_COLUMNS_NATS};

/// Part of a step below which a fit gives up halving it.
const LEAST_PART: f64 = 1e-3;
/// Factor on a step that did not help.
const SHORTER: f64 = 0.3;

impl FitModel<'_> {
    /// Steps with halving from the values in `set`.
    pub fn fit(&self, set: EffectSet) -> Fit {
        self.fit_from(self.evaluated(set))
    }

    /// As [`FitModel::fit`], from a set that has been evaluated.
    pub fn fit_from(&self, start: Evaluated) -> Fit {
        fit_together_from(&[self], vec![start], FIT_STEPS, |_| true).swap_remove(0)
    }

    /// As [`FitModel::fit`], with another limit on the steps: with 0 the values stay.
    pub fn fit_steps(&self, set: EffectSet, steps: usize) -> Fit {
        fit_together(&[self], vec![set], steps, |_| true).swap_remove(0)
    }
}

/// Fits one set for each model. Values of effects that belong to the device are the same in all of
/// them (and have to be so in `sets`), those of a session are each model's own; values of kinds that
/// are not free stay.
pub(crate) fn fit_together(
    models: &[&FitModel],
    sets: Vec<EffectSet>,
    steps: usize,
    is_free: impl Fn(EffectKind) -> bool,
) -> Vec<Fit> {
    fit_together_from(models, evaluated(models, sets), steps, is_free)
}

fn evaluated(models: &[&FitModel], sets: Vec<EffectSet>) -> Vec<Evaluated> {
    let pairs = models.iter().zip(sets);
    pairs.map(|(model, set)| model.evaluated(set)).collect()
}

fn fit_together_from(
    models: &[&FitModel],
    mut now: Vec<Evaluated>,
    steps: usize,
    is_free: impl Fn(EffectKind) -> bool,
) -> Vec<Fit> {
    let coefficients = Coefficients::new(&now, is_free);
    let mut steps_left = steps;
    let mut kept: Option<Linearised> = None;
    loop {
        let is_kept = kept.is_some();
        let Linearised { columns, grams } = match kept.take() {
            Some(before) => coefficients.around(models, &now, before),
            None => coefficients.linearised(models, &now),
        };
        let solution = coefficients.together(grams.clone()).solution();
        let cost = total_cost(&now);
        let gain = solution.trained + cost;
        let is_last = steps_left == 0 || coefficients.prior.is_empty() || gain < CONVERGED_NATS;
        let mut part = if is_last { 0.0 } else { 1.0 };
        let mut better = None;
        while part > LEAST_PART && better.is_none() {
            let next = evaluated(models, coefficients.stepped(&now, &solution.step, part));
            better = (total_cost(&next) < cost).then_some(next);
            part *= SHORTER;
        }
        if let Some(better) = better {
            now = better;
            steps_left -= 1;
            kept = (gain < SAME_COLUMNS_NATS).then_some(Linearised { columns, grams });
            continue;
        }
        if is_kept && !is_last {
            // Where these lead no further, others may.
            continue;
        }
        let parts = solution.parts.into_iter().zip(coefficients.layouts);
        return now
            .into_iter()
            .zip(columns.into_iter().zip(grams))
            .zip(parts)
            .map(|((now, (columns, gram)), (linear, layout))| Fit {
                set: now.set,
                layout,
                prediction: Arc::new(now.prediction),
                residual: Arc::new(now.residual),
                columns: Arc::new(columns),
                gram,
                linear,
            })
            .collect();
    }
}

/// Columns of each model, and their normal equations.
struct Linearised {
    columns: Vec<Vec<Vec<f64>>>,
    grams: Vec<Gram>,
}

fn total_cost(all: &[Evaluated]) -> f64 {
    all.iter().map(|one| one.cost).sum()
}

/// Columns of the values of a layout, which lists all values of an effect one after the other.
fn columns_of(model: &FitModel, now: &Evaluated, layout: &[(EffectKind, usize)]) -> Vec<Vec<f64>> {
    layout
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|values| model.columns_to_fit(&now.set, &now.prediction, values[0].0))
        .collect()
}

/// The values that a fit moves, by model and all together.
struct Coefficients {
    /// Of each model: effect and index among its values.
    layouts: Vec<Vec<(EffectKind, usize)>>,
    /// Of each model: which coefficient each value of the layout is.
    of_layouts: Vec<Vec<usize>>,
    /// 1 / variance of the weak prior of each coefficient.
    prior: Vec<f64>,
}

impl Coefficients {
    fn new(start: &[Evaluated], is_free: impl Fn(EffectKind) -> bool) -> Self {
        let mut known = BTreeMap::new();
        let (mut layouts, mut of_layouts, mut prior) = (Vec::new(), Vec::new(), Vec::new());
        for (model, Evaluated { set, .. }) in start.iter().enumerate() {
            let (mut layout, mut own) = (Vec::new(), Vec::new());
            for kind in set.iter().map(|effect| effect.kind()) {
                let owner = match kind.spec().owner {
                    Owner::Device => None,
                    Owner::Session => Some(model),
                };
                let values = free_values(kind);
                for (place, value) in layout_of(kind).zip(&values).filter(|_| is_free(kind)) {
                    let coefficient = *known.entry((owner, place)).or_insert_with(|| {
                        prior.push(value.prior_weight());
                        prior.len() - 1
                    });
                    layout.push(place);
                    own.push(coefficient);
                }
            }
            layouts.push(layout);
            of_layouts.push(own);
        }
        Self {
            layouts,
            of_layouts,
            prior,
        }
    }

    /// Around what the sets predict.
    fn linearised(&self, models: &[&FitModel], now: &[Evaluated]) -> Linearised {
        let columns: Vec<Vec<Vec<f64>>> = models
            .iter()
            .zip(now)
            .zip(&self.layouts)
            .map(|((model, now), layout)| columns_of(model, now, layout))
            .collect();
        let of_model = |index: usize| {
            let prior = self.prior_of(index);
            models[index].gram(&slices(&columns[index]), &now[index].residual, prior)
        };
        let grams = (0..models.len()).map(of_model).collect();
        Linearised { columns, grams }
    }

    /// With the columns of a point nearby.
    fn around(&self, models: &[&FitModel], now: &[Evaluated], nearby: Linearised) -> Linearised {
        let Linearised { columns, grams } = nearby;
        let of_model = |(index, gram): (usize, Gram)| {
            let columns = slices(&columns[index]);
            models[index].gram_of_residual(
                &gram,
                &columns,
                &now[index].residual,
                self.prior_of(index),
            )
        };
        let grams = grams.into_iter().enumerate().map(of_model).collect();
        Linearised { columns, grams }
    }

    /// Of the coefficients of one model.
    fn prior_of(&self, model: usize) -> Vec<f64> {
        let own = self.of_layouts[model].iter();
        own.map(|&k| self.prior[k]).collect()
    }

    fn together(&self, grams: Vec<Gram>) -> Gram {
        let series = grams.into_iter().zip(self.of_layouts.iter().cloned());
        Gram::together(series.collect(), self.prior.clone())
    }

    /// The sets with a part of a step.
    fn stepped(&self, now: &[Evaluated], step: &DVector<f64>, part: f64) -> Vec<EffectSet> {
        now.iter()
            .zip(self.layouts.iter().zip(&self.of_layouts))
            .map(|(now, (layout, own))| {
                let step = step.select_rows(own);
                stepped(&now.set, layout, &step, part)
            })
            .collect()
    }
}
