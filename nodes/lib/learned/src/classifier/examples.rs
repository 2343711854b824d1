//! Windows with labels, and how wrong a classifier is on them.

use crate::LearnedError;

/// Windows of one length with a label each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Examples {
    /// Steps of a window.
    pub steps: usize,
    /// Numbers a step.
    pub channels: usize,
    /// (windows, steps, channels)
    pub values: Vec<f32>,
    /// One class a window.
    pub labels: Vec<u8>,
}

impl Examples {
    /// None yet, of so many steps and channels.
    #[must_use]
    pub fn new(steps: usize, channels: usize) -> Self {
        Self {
            steps,
            channels,
            ..Self::default()
        }
    }

    /// Windows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// A window's numbers, (steps, channels).
    #[must_use]
    pub fn window(&self, index: usize) -> &[f32] {
        let length = self.steps * self.channels;
        &self.values[index * length..(index + 1) * length]
    }

    /// Adds a window, (steps, channels); the caller vouches for its length.
    pub fn push(&mut self, window: &[f32], label: u8) {
        self.values.extend_from_slice(window);
        self.labels.push(label);
    }

    /// Windows of each class.
    #[must_use]
    pub fn counts(&self, classes: usize) -> Vec<usize> {
        (0..classes)
            .map(|class| {
                self.labels
                    .iter()
                    .filter(|label| usize::from(**label) == class)
                    .count()
            })
            .collect()
    }

    /// Weights with which all classes that are there count alike: windows / (classes there x
    /// windows of the class); 0 for others.
    #[must_use]
    pub fn balance(&self, classes: usize) -> Vec<f32> {
        let counts = self.counts(classes);
        let there = counts.iter().filter(|count| **count > 0).count();
        let weight = |count: &usize| {
            if *count == 0 {
                0.0
            } else {
                self.len() as f32 / (there * count) as f32
            }
        };
        counts.iter().map(weight).collect()
    }

    /// Lengths that fit, finite numbers, and labels below `classes`.
    ///
    /// # Errors
    /// [`LearnedError::Input`], [`LearnedError::Batch`] naming the window.
    pub fn check(&self, channels: usize, classes: usize) -> Result<(), LearnedError> {
        crate::network::check_input(&self.values, self.len(), self.steps, channels)?;
        let bad = |number: usize, reason: String| LearnedError::Batch {
            number: number as u64,
            reason,
        };
        if let Some(index) = self
            .labels
            .iter()
            .position(|label| usize::from(*label) >= classes)
        {
            return Err(bad(
                index,
                format!(
                    "a window of class {}, there are {classes}",
                    self.labels[index]
                ),
            ));
        }
        if let Some(index) = self.values.iter().position(|value| !value.is_finite()) {
            return Err(bad(
                index / (self.steps * channels).max(1),
                format!("{} in a window", self.values[index]),
            ));
        }
        Ok(())
    }
}

/// Weighted sum of -ln softmax(logits)_label over rows, and its gradient times `scale` over the
/// logits; logits: (rows, classes), weights: one a row. As PyTorch's CrossEntropyLoss with scale =
/// 1 / sum of weights.
pub fn cross_entropy(logits: &mut [f32], labels: &[u8], weights: &[f32], scale: f64) -> f64 {
    let classes = logits.len() / labels.len().max(1);
    let mut sum = 0.0;
    for ((row, label), weight) in logits
        .chunks_exact_mut(classes.max(1))
        .zip(labels)
        .zip(weights)
    {
        // Less the largest, so that nothing overflows.
        let largest = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let powers: Vec<f64> = row
            .iter()
            .map(|logit| f64::from(logit - largest).exp())
            .collect();
        let total: f64 = powers.iter().sum();
        let own = usize::from(*label);
        sum += f64::from(*weight) * (total.ln() - f64::from(row[own] - largest));
        for (class, (logit, power)) in row.iter_mut().zip(&powers).enumerate() {
            let target = f64::from(u8::from(class == own));
            *logit = (f64::from(*weight) * scale * (power / total - target)) as f32;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::{check_gradient, values};

    #[test]
    fn the_loss_is_its_definition_and_the_gradient_its_slope() {
        let (logits, labels, weights) = (values(12, 3), [2, 0, 3], [1.0, 0.5, 2.0]);
        let loss = |logits: &[f32]| cross_entropy(&mut logits.to_vec(), &labels, &weights, 1.0);
        let expected: f64 = logits
            .chunks(4)
            .zip(labels)
            .zip(weights)
            .map(|((row, label), weight)| {
                let total: f64 = row.iter().map(|logit| f64::from(*logit).exp()).sum();
                -f64::from(weight) * (f64::from(row[usize::from(label)]).exp() / total).ln()
            })
            .sum();
        assert!((loss(&logits) - expected).abs() < 1e-6);
        let mut gradient = logits.clone();
        cross_entropy(&mut gradient, &labels, &weights, 1.0);
        check_gradient("logits", &logits, &gradient, loss);
        // Logits beyond f32's exponentials.
        let mut large = [200.0, -200.0, 0.0, 300.0];
        assert!(
            (cross_entropy(&mut large, &[0], &[1.0], 1.0) - 100.0).abs() < 1e-6
                && large.iter().all(|value| value.is_finite())
        );
    }

    #[test]
    fn classes_count_alike() {
        let mut examples = Examples::new(1, 1);
        for label in [0, 0, 0, 2] {
            examples.push(&[0.5], label);
        }
        assert_eq!(
            (examples.counts(3), examples.balance(3)),
            (vec![3, 0, 1], vec![4.0 / 6.0, 0.0, 2.0])
        );
        assert!(
            examples
                .check(1, 2)
                .unwrap_err()
                .to_string()
                .contains("class 2")
        );
        examples.values[3] = f32::NAN;
        assert!(
            examples
                .check(1, 3)
                .unwrap_err()
                .to_string()
                .contains("batch 3: NaN")
        );
    }
}
