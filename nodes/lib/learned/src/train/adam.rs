//! Adam (Kingma and Ba 2015, algorithm 1), its moments in plain vectors, so that a checkpoint holds
//! all of it.

/// First and second moments of every parameter, and how many steps were taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    pub first: Vec<f32>,
    pub second: Vec<f32>,
}

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f32 = 1e-8;

impl Adam {
    pub fn new(parameters: usize) -> Self {
        Self {
            first: vec![0.0; parameters],
            second: vec![0.0; parameters],
        }
    }

    /// m = b1 m + (1 - b1) g; v = b2 v + (1 - b2) g^2; p -= rate m / (1 - b1^t) / (sqrt(v / (1 -
    /// b2^t)) + epsilon); step: t, from 1 on.
    pub fn step(&mut self, parameters: &mut [f32], gradients: &[f32], rate: f64, step: u64) {
        let power = |beta: f64| 1.0 - beta.powf(step as f64);
        let (rate, second_scale) = (
            (rate / power(BETA_1)) as f32,
            (1.0 / power(BETA_2).sqrt()) as f32,
        );
        let (keep_1, take_1) = (BETA_1 as f32, (1.0 - BETA_1) as f32);
        let (keep_2, take_2) = (BETA_2 as f32, (1.0 - BETA_2) as f32);
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((parameter, gradient), (first, second)) in
            parameters.iter_mut().zip(gradients).zip(moments)
        {
            *first = keep_1 * *first + take_1 * gradient;
            *second = keep_2 * *second + take_2 * gradient * gradient;
            *parameter -= rate * *first / (second.sqrt() * second_scale + EPSILON);
        }
    }
}

/// The length of the gradient; held to `most` where it is longer. Returns the length before.
pub(crate) fn clip(gradients: &mut [f32], most: Option<f64>) -> f64 {
    let norm = gradients
        .iter()
        .map(|gradient| f64::from(*gradient) * f64::from(*gradient))
        .sum::<f64>()
        .sqrt();
    if let Some(most) = most
        && norm > most
    {
        let scale = (most / norm) as f32;
        gradients.iter_mut().for_each(|gradient| *gradient *= scale);
    }
    norm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_as_the_algorithm_does_in_f64() {
        let (mut parameters, mut adam) = ([1.0_f32, -2.0], Adam::new(2));
        let (mut expected, mut first, mut second) = ([1.0_f64, -2.0], [0.0_f64; 2], [0.0_f64; 2]);
        for step in 1..=20_u64 {
            let gradients: [f32; 2] =
                std::array::from_fn(|index| (step as f32 * 0.7 + index as f32).sin());
            adam.step(&mut parameters, &gradients, 0.01, step);
            for index in 0..2 {
                let gradient = f64::from(gradients[index]);
                first[index] = 0.9 * first[index] + 0.1 * gradient;
                second[index] = 0.999 * second[index] + 0.001 * gradient * gradient;
                let (m, v) = (
                    first[index] / (1.0 - 0.9_f64.powf(step as f64)),
                    second[index] / (1.0 - 0.999_f64.powf(step as f64)),
                );
                expected[index] -= 0.01 * m / (v.sqrt() + 1e-8);
            }
        }
        assert!(
            (0..2).all(|index| (f64::from(parameters[index]) - expected[index]).abs() < 1e-6),
            "{parameters:?} {expected:?}"
        );
    }

    #[test]
    fn clips_to_the_length_asked_for() {
        let mut gradients = [3.0, 4.0];
        assert_eq!(clip(&mut gradients, Some(10.0)), 5.0);
        assert_eq!(gradients, [3.0, 4.0]);
        assert_eq!(clip(&mut gradients, Some(1.0)), 5.0);
        assert!((clip(&mut gradients, None) - 1.0).abs() < 1e-6);
    }
}
