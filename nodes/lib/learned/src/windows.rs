//! Windows with overlap.

/// Samples of a window: 2 s.
pub const WINDOW: usize = 200;
/// Samples from one window to the next: 80 % overlap.
pub const HOP: usize = 40;

/// Where windows start, so that every sample of a series lies in one; the last window ends with the
/// series. A series shorter than a window is one window of its own length.
pub fn window_starts(samples: usize) -> Vec<usize> {
    if samples == 0 {
        return Vec::new();
    }
    let last = samples.saturating_sub(WINDOW);
    let mut starts: Vec<usize> = (0..=last).step_by(HOP).collect();
    if starts.last() != Some(&last) {
        starts.push(last);
    }
    starts
}

/// Overlapping windows added up: `y = sum_w h w / sum_w h` with the weights h of a triangle that is
/// largest in a window's middle, where a bidirectional network knows most of what was before and
/// after.
#[derive(Clone, Debug)]
pub struct Blend {
    sums: Vec<[f64; 3]>,
    weights: Vec<f64>,
}

impl Blend {
    /// Nothing added yet.
    pub fn new(samples: usize) -> Self {
        Self {
            sums: vec![[0.0; 3]; samples],
            weights: vec![0.0; samples],
        }
    }

    /// Adds a window's output, (steps, 3); what stands beyond the series' end is left out.
    pub fn add(&mut self, start: usize, output: &[f32]) {
        let steps = output.len() / 3;
        let places = self.sums.iter_mut().zip(&mut self.weights).skip(start);
        for (step, (values, (sums, weights))) in output.chunks_exact(3).zip(places).enumerate() {
            let weight = (step + 1).min(steps - step) as f64;
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * f64::from(*value);
            }
            *weights += weight;
        }
    }

    /// The series; zero where no window was added.
    pub fn finish(self) -> Vec<[f64; 3]> {
        let divide = |(sums, weight): ([f64; 3], f64)| {
            if weight > 0.0 {
                sums.map(|sum| sum / weight)
            } else {
                [0.0; 3]
            }
        };
        self.sums
            .into_iter()
            .zip(self.weights)
            .map(divide)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_every_sample_and_none_reaches_beyond() {
        for samples in [1, 150, 200, 201, 239, 240, 241, 777] {
            let starts = window_starts(samples);
            let length = samples.min(WINDOW);
            for sample in 0..samples {
                assert!(
                    starts
                        .iter()
                        .any(|start| (*start..start + length).contains(&sample)),
                    "{sample} of {samples}"
                );
            }
            assert!(starts.iter().all(|start| start + length <= samples));
        }
        assert!(window_starts(0).is_empty());
    }

    #[test]
    fn equal_windows_blend_to_themselves() {
        let series: Vec<[f64; 3]> = (0..431)
            .map(|k| [f64::from(k), -2.0 * f64::from(k), 0.5])
            .collect();
        let mut blend = Blend::new(series.len());
        for start in window_starts(series.len()) {
            let window: Vec<f32> = series[start..start + WINDOW]
                .iter()
                .flatten()
                .map(|value| *value as f32)
                .collect();
            blend.add(start, &window);
        }
        for (blended, own) in blend.finish().iter().zip(&series) {
            assert!(blended.iter().zip(own).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
