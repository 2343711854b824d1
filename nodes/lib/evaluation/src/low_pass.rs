//! A low-pass without delay.

use std::f64::consts::{PI, SQRT_2};

/// Values that an end is continued by: three times the filter's three coefficients, as scipy's
/// `filtfilt` does.
const MIRRORED: usize = 9;

/// A Butterworth filter of second order by the bilinear transform, run forward and back: power gain
/// `1 / (1 + (f / cutoff)^4)^2` well below half the rate, no delay. It needs evenly spaced values and
/// no state between calls, so it shares nothing with the effect `low_pass`, which runs sample by
/// sample.
pub(crate) struct ZeroPhaseLowPass {
    b: [f64; 3],
    a: [f64; 2],
    mirrored: usize,
}

impl ZeroPhaseLowPass {
    /// The cutoff, Hz, must lie below half the rate, Hz.
    pub fn new(cutoff_hz: f64, rate_hz: f64) -> Self {
        let k = (PI * cutoff_hz / rate_hz).tan();
        let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
        let b = k * k * scale;
        Self {
            b: [b, 2.0 * b, b],
            a: [
                2.0 * (k * k - 1.0) * scale,
                (1.0 - SQRT_2 * k + k * k) * scale,
            ],
            mirrored: MIRRORED,
        }
    }

    /// Continues each end by this many values instead.
    pub fn mirroring(self, mirrored: usize) -> Self {
        Self { mirrored, ..self }
    }

    /// Forward and back, so that nothing is delayed and the attenuation doubles. Before and behind,
    /// the values go on mirrored at their ends, so that slopes stay slopes there.
    pub fn both_ways(&self, values: &mut [f64]) {
        let [Some(first), Some(last)] = [values.first(), values.last()] else {
            return;
        };
        let beyond = self.mirrored.min(values.len() - 1);
        let before = values[1..=beyond]
            .iter()
            .rev()
            .map(|value| 2.0 * first - value);
        let behind = values[values.len() - 1 - beyond..values.len() - 1]
            .iter()
            .rev()
            .map(|value| 2.0 * last - value);
        let mut longer: Vec<f64> = before.chain(values.iter().copied()).chain(behind).collect();
        self.along(longer.iter_mut());
        self.along(longer.iter_mut().rev());
        values.copy_from_slice(&longer[beyond..beyond + values.len()]);
    }

    /// Begins as if the first value had stood there for ever.
    fn along<'a>(&self, mut values: impl Iterator<Item = &'a mut f64>) {
        let Some(first) = values.next() else { return };
        let mut known = [*first; 4];
        for value in std::iter::once(first).chain(values) {
            let [x1, x2, y1, y2] = known;
            let filtered = self.b[0] * *value + self.b[1] * x1 + self.b[2] * x2
                - self.a[0] * y1
                - self.a[1] * y2;
            known = [*value, x1, filtered, y1];
            *value = filtered;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cutoff_is_where_the_power_falls_to_a_quarter() {
        // Twice by 1 / sqrt 2 in amplitude.
        let filter = ZeroPhaseLowPass::new(10.0, 120.0).mirroring(40);
        let mut values: Vec<f64> = (0..1200)
            .map(|k| (2.0 * PI * 10.0 * f64::from(k) / 120.0).sin())
            .collect();
        filter.both_ways(&mut values);
        let power = values[300..900]
            .iter()
            .map(|value| value * value)
            .sum::<f64>()
            / 600.0;
        assert!((power / 0.5 - 0.25).abs() < 0.005, "{power}");
    }

    /// `b, a = butter(2, 10 / 50); filtfilt(b, a, x)` of scipy 1.17.1.
    #[test]
    fn it_is_what_scipy_calls_filtfilt() {
        let mut values = [
            0.0, 1.0, 0.5, -2.0, 3.0, 3.0, 3.0, 1.0, 0.0, -1.0, -1.0, 4.0, 2.0, 0.3, 0.1, 0.0, 5.0,
            5.0, 5.0, 2.0,
        ];
        ZeroPhaseLowPass::new(10.0, 100.0).both_ways(&mut values);
        for (index, expected) in [
            (0, -2.628_340_04e-4),
            (1, 3.041_978_40e-1),
            (7, 1.210_289_91),
            (18, 2.698_987_65),
            (19, 2.013_656_42),
        ] {
            assert!(
                (values[index] - expected).abs() < 1e-8,
                "{index}: {}",
                values[index]
            );
        }
    }
}
