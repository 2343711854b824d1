//! How often a classifier is right.

use serde::Serialize;

use crate::bootstrap::intervals;

/// Counts of windows by true class (rows) and predicted class (columns).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct ConfusionMatrix(pub Vec<Vec<u32>>);

impl ConfusionMatrix {
    /// Counts of true and predicted classes, one each a window.
    pub fn new(truth: &[u8], predicted: &[u8], classes: usize) -> Self {
        let mut counts = vec![vec![0; classes]; classes];
        truth.iter().zip(predicted).for_each(|(truth, predicted)| {
            counts[usize::from(*truth)][usize::from(*predicted)] += 1
        });
        Self(counts)
    }

    /// Adds the counts of other windows.
    pub fn add(&mut self, other: &Self) {
        if self.0.is_empty() {
            self.0.clone_from(&other.0);
            return;
        }
        self.0.iter_mut().zip(&other.0).for_each(|(own, other)| {
            own.iter_mut()
                .zip(other)
                .for_each(|(own, other)| *own += other)
        });
    }

    /// F1 = 2 TP / (2 TP + FP + FN) of a class; none where neither the truth has it nor anything
    /// was predicted as it.
    pub fn f1(&self, class: usize) -> Option<f64> {
        let hits = f64::from(self.0[class][class]);
        let truth: u32 = self.0[class].iter().sum();
        let predicted: u32 = self.0.iter().map(|row| row[class]).sum();
        (truth + predicted > 0).then(|| 2.0 * hits / f64::from(truth + predicted))
    }

    /// Mean F1 of the classes that the truth has.
    pub fn macro_f1(&self) -> f64 {
        let is_true = |class: &usize| self.0[*class].iter().sum::<u32>() > 0;
        let scores: Vec<f64> = (0..self.0.len())
            .filter(is_true)
            .filter_map(|class| self.f1(class))
            .collect();
        mean(&scores)
    }
}

/// The mean; 0 of no values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// 95 % interval of the mean over values (subjects).
pub fn interval(values: &[f64], seed: u64) -> [f64; 2] {
    let mean = |indices: &[usize]| {
        [indices.iter().map(|index| values[*index]).sum::<f64>() / values.len() as f64]
    };
    intervals(values.len(), seed, mean)[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f1_is_its_definition() {
        let confusion = ConfusionMatrix::new(&[0, 0, 0, 1, 1, 1], &[0, 0, 1, 1, 1, 2], 4);
        assert_eq!(
            confusion.0,
            [vec![2, 1, 0, 0], vec![0, 2, 1, 0], vec![0; 4], vec![0; 4]]
        );
        // Class 0: precision 1, recall 2/3. Class 1: both 2/3. Class 2 is predicted but not there, class
        // 3 is neither.
        assert!((confusion.f1(0).unwrap_or_default() - 0.8).abs() < 1e-12);
        assert_eq!((confusion.f1(2), confusion.f1(3)), (Some(0.0), None));
        assert!((confusion.macro_f1() - (0.8 + 2.0 / 3.0) / 2.0).abs() < 1e-12);
        let mut both = ConfusionMatrix::default();
        both.add(&confusion);
        both.add(&confusion);
        assert_eq!(both.0[0], [4, 2, 0, 0]);
    }
}
