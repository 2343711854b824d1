//! The shape of a body does not change while it moves: betas are averaged over time.

/// A step of a beta that is worth a new shape, standard deviations. 0.01 moves no surface point by more than about a millimetre.
const WORTHWHILE: f64 = 0.01;

/// The mean of all betas so far, and the betas in force.
#[derive(Default)]
pub struct ShapeAverage {
    mean: Vec<f64>,
    count: f64,
    in_force: Vec<f64>,
}

impl ShapeAverage {
    /// Takes one estimate of finite numbers in; true where the betas in force have changed. An empty estimate says nothing.
    pub fn add(&mut self, betas: &[f64]) -> bool {
        if betas.is_empty() {
            return false;
        }
        if betas.len() != self.mean.len() {
            *self = Self { mean: vec![0.0; betas.len()], count: 0.0, in_force: vec![f64::NAN; betas.len()] };
        }
        self.count += 1.0;
        for (mean, beta) in self.mean.iter_mut().zip(betas) {
            *mean += (beta - *mean) / self.count;
        }
        let near = self.mean.iter().zip(&self.in_force).all(|(mean, held)| (mean - held).abs() < WORTHWHILE);
        if !near {
            self.in_force.clone_from(&self.mean);
        }
        !near
    }

    /// The betas in force; empty before the first estimate.
    pub fn betas(&self) -> &[f64] {
        &self.in_force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_settles_and_small_steps_change_nothing() {
        let mut average = ShapeAverage::default();
        assert!(!average.add(&[]));
        assert!(average.add(&[1.0, 0.0]));
        assert!(average.add(&[0.0, 0.0]));
        assert_eq!(average.betas(), [0.5, 0.0]);
        assert!(!average.add(&[0.501, 0.001]));
        assert_eq!(average.betas(), [0.5, 0.0]);
    }
}
