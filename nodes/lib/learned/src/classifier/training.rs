//! The training of a classifier: one after the other inside, so that many run beside each other.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::network::{Dropout, Layers, random};
use super::{Classifier, ClassifierShape, Examples, cross_entropy};
use crate::LearnedError;
use crate::train::Schedule;
use crate::train::adam::{Adam, clip};

/// How a classifier is trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassifierOptions {
    /// Steps of one batch each.
    pub steps: u64,
    /// Windows in a batch.
    pub batch: usize,
    /// Of Adam.
    pub learning_rate: f64,
    /// How it goes.
    pub schedule: Schedule,
    /// The most that the gradient's length may be; longer ones are shortened.
    pub clip: Option<f64>,
    /// Share of the last hidden state that is left out while training.
    pub dropout: f32,
}

impl ClassifierOptions {
    fn check(&self, pools: usize) -> Result<(), LearnedError> {
        let wrong =
            |field: &'static str, reason: String| Err(LearnedError::Options { field, reason });
        if self.steps == 0 {
            return wrong("steps", "0; it has to be at least 1".to_owned());
        }
        if self.batch < pools.max(1) {
            return wrong(
                "batch",
                format!("{}; every one of {pools} pools needs a window", self.batch),
            );
        }
        if !(self.learning_rate.is_finite() && self.learning_rate > 0.0) {
            return wrong(
                "learning_rate",
                format!("{}; it has to be above 0", self.learning_rate),
            );
        }
        if !(0.0..1.0).contains(&self.dropout) {
            return wrong(
                "dropout",
                format!("{}; it may be 0 to below 1", self.dropout),
            );
        }
        if let Schedule::Cosine { floor } = self.schedule
            && !(0.0..=1.0).contains(&floor)
        {
            return wrong("schedule", format!("floor is {floor}; it may be 0 to 1"));
        }
        if let Some(clip) = self.clip.filter(|clip| !(clip.is_finite() && *clip > 0.0)) {
            return wrong("clip", format!("{clip}; it has to be above 0"));
        }
        Ok(())
    }
}

/// A pool's windows in an order that is drawn anew once all have come.
struct Deck {
    order: Vec<u32>,
    next: usize,
}

impl Deck {
    fn new(count: usize) -> Self {
        Self {
            order: (0..count as u32).collect(),
            next: count,
        }
    }

    fn draw(&mut self, random: &mut ChaCha8Rng) -> usize {
        if self.next >= self.order.len() {
            // Fisher and Yates, as Durstenfeld has it (1964).
            for last in (1..self.order.len()).rev() {
                self.order.swap(last, random.random_range(0..=last));
            }
            self.next = 0;
        }
        self.next += 1;
        self.order[self.next - 1] as usize
    }
}

/// Trains a classifier on pools of windows; every batch takes as many of each, the first pools one
/// more where they do not divide it. Within a pool all classes count alike ([`Examples::balance`]);
/// the loss is the weighted mean of the cross-entropy. `interrupted` is asked before each step;
/// none where it said yes.
///
/// On the calling thread alone; the same seed gives the same bits.
///
/// # Errors
/// Where shape, options or windows are not sound, a pool is empty, or the training diverges.
pub fn train_classifier(
    shape: &ClassifierShape,
    options: &ClassifierOptions,
    pools: &[&Examples],
    seed: u64,
    interrupted: &dyn Fn() -> bool,
) -> Result<Option<Classifier>, LearnedError> {
    options.check(pools.len())?;
    let mut classifier = Classifier::new(shape.clone(), seed)?;
    let steps = pools.first().map_or(0, |pool| pool.steps);
    classifier.check_steps(steps)?;
    check_pools(pools, steps, shape)?;
    let balance = |pool: &&Examples| pool.balance(shape.classes);
    let balances: Vec<Vec<f32>> = pools.iter().map(balance).collect();
    let mut decks: Vec<Deck> = pools.iter().map(|pool| Deck::new(pool.len())).collect();
    let (mut order, mut dropped) = (random(seed, 1), random(seed, 2));
    let mut adam = Adam::new(classifier.parameters.len());
    let mut gradients = vec![0.0; classifier.parameters.len()];
    let (mut windows, mut labels, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..options.steps {
        if interrupted() {
            return Ok(None);
        }
        windows.clear();
        labels.clear();
        weights.clear();
        for place in 0..options.batch {
            let pool = place % pools.len();
            let index = decks[pool].draw(&mut order);
            windows.extend_from_slice(pools[pool].window(index));
            labels.push(pools[pool].labels[index]);
            weights.push(balances[pool][usize::from(pools[pool].labels[index])]);
        }
        let dropout = Dropout {
            probability: options.dropout,
            random: &mut dropped,
        };
        let loss = gradients_of(
            &classifier,
            (&windows, &labels, &weights),
            steps,
            dropout,
            &mut gradients,
        );
        let gradient_norm = clip(&mut gradients, options.clip);
        if !loss.is_finite() || !gradient_norm.is_finite() {
            return Err(LearnedError::Diverged {
                step,
                loss,
                gradient_norm,
            });
        }
        let rate = options
            .schedule
            .rate(options.learning_rate, step, options.steps);
        adam.step(&mut classifier.parameters, &gradients, rate, step + 1);
    }
    Ok(Some(classifier))
}

/// Pools that fit the shape, none of them empty, with windows of so many steps.
fn check_pools(
    pools: &[&Examples],
    steps: usize,
    shape: &ClassifierShape,
) -> Result<(), LearnedError> {
    for pool in pools {
        pool.check(shape.inputs, shape.classes)?;
        if pool.is_empty() || pool.steps != steps {
            return Err(LearnedError::TooFew {
                what: "windows of a pool".to_owned(),
                found: pool.len(),
                needed: 1,
            });
        }
    }
    Ok(())
}

/// The loss of a batch and its gradient.
pub(super) fn gradients_of(
    classifier: &Classifier,
    (windows, labels, weights): (&[f32], &[u8], &[f32]),
    steps: usize,
    dropout: Dropout<'_>,
    gradients: &mut [f32],
) -> f64 {
    let layers = Layers::new(classifier.shape(), &classifier.parameters);
    let (mut logits, tape) = layers.forward(windows, steps, Some(dropout));
    let scale = 1.0 / weights.iter().map(|weight| f64::from(*weight)).sum::<f64>();
    let loss = cross_entropy(&mut logits, labels, weights, scale) * scale;
    gradients.fill(0.0);
    let _ = layers.backward(&classifier.parameters, &tape, &logits, gradients);
    loss
}

#[cfg(test)]
#[path = "training_tests.rs"]
mod tests;
