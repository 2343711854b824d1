//! Lengths that a smoothing of quaternions' components left them, which normalising has taken away.

use std::f64::consts::PI;

use rustfft::num_complex::Complex64;

use crate::FourierPair;
use crate::segments::continued;

/// Passes in which a length is looked for at most, and the largest change at which it is found. No source.
const PASSES: usize = 6;
const FOUND: f64 = 1e-5;
/// Beyond both ends the series are continued oddly for so long, s, and faded to a line. No source.
const PADDING_S: f64 = 2.0;

/// Quaternions `s = u r` before they were normalised to the `r` of the series: `s = h * q` for unit quaternions q, so that
/// `u = |h * q|`, `q = g * (u r)`, where g undoes h as far as noise lets it. In turn from `u = 1` on: what is normalised away is
/// of the second order in the turns, and so is what it feeds back.
///
/// `passed` is h over the frequency, `undone` g.
pub(crate) fn with_lengths(
    quaternions: &[Vec<f64>],
    rate_hz: f64,
    passed: &dyn Fn(f64) -> f64,
    undone: &dyn Fn(f64) -> f64,
) -> Vec<Vec<f64>> {
    let count = quaternions[0].len();
    let filtering = Filtering::new(count, rate_hz);
    let [passed, undone] = [passed, undone].map(|weight| filtering.weights(weight));
    let mut reported = quaternions.to_vec();
    normalise(&mut reported);
    let mut lengthened = reported.clone();
    let mut lengths = vec![1.0; count];
    for _ in 0..PASSES {
        let mut original = filtering.filtered(&lengthened, &undone);
        normalise(&mut original);
        let smoothed = filtering.filtered(&original, &passed);
        let mut change: f64 = 0.0;
        for (k, length) in lengths.iter_mut().enumerate() {
            let found = norm(&smoothed, k);
            change = change.max((found - *length).abs());
            *length = found;
        }
        for (values, reported) in lengthened.iter_mut().zip(&reported) {
            for (k, value) in values.iter_mut().enumerate() {
                *value = lengths[k] * reported[k];
            }
        }
        if change < FOUND {
            break;
        }
    }
    lengthened
}

fn norm(quaternions: &[Vec<f64>], k: usize) -> f64 {
    let squares = quaternions.iter().map(|values| values[k].powi(2));
    squares.sum::<f64>().sqrt()
}

fn normalise(quaternions: &mut [Vec<f64>]) {
    for k in 0..quaternions[0].len() {
        let length = norm(quaternions, k).max(f64::MIN_POSITIVE);
        quaternions
            .iter_mut()
            .for_each(|values| values[k] /= length);
    }
}

/// Zero-phase filters of whole series.
struct Filtering {
    transform: FourierPair,
    rate_hz: f64,
    count: usize,
    padding: usize,
}

impl Filtering {
    fn new(count: usize, rate_hz: f64) -> Self {
        let padding = ((PADDING_S * rate_hz) as usize).min(count - 1);
        Self {
            transform: FourierPair::new(FourierPair::good_length(count + 2 * padding)),
            rate_hz,
            count,
            padding,
        }
    }

    /// A filter's weights at the transform's frequencies, negative ones included.
    fn weights(&self, weight: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let length = self.transform.length();
        let hz = |k: usize| k.min(length - k) as f64 * self.rate_hz / length as f64;
        (0..length).map(|k| weight(hz(k))).collect()
    }

    fn filtered(&self, series: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
        // Two real series are one complex one: the weights are real and even.
        let pairs = series.chunks(2).flat_map(|pair| {
            let (first, second) = (&pair[0], pair.get(1));
            let zero = vec![0.0; self.count];
            let second = second.unwrap_or(&zero);
            let mut values = vec![Complex64::default(); self.transform.length()];
            let lines = [first, second].map(|values| Line::of(values));
            for at in 0..self.count + 2 * self.padding {
                let [re, im] = [first, second].map(|values| continued(values, self.place(at)));
                let [line_re, line_im] =
                    lines.each_ref().map(|line| line.at(self.place(at) as f64));
                let faded = self.fade(at);
                values[at] = Complex64::new((re - line_re) * faded, (im - line_im) * faded);
            }
            self.transform.forward(&mut values);
            for (value, weight) in values.iter_mut().zip(weights) {
                *value *= *weight;
            }
            self.transform.inverse(&mut values);
            let own = &values[self.padding..self.padding + self.count];
            let back = |line: &Line, part: &dyn Fn(&Complex64) -> f64| -> Vec<f64> {
                let values = own.iter().enumerate();
                values
                    .map(|(k, value)| part(value) + line.at(k as f64))
                    .collect()
            };
            [
                back(&lines[0], &|value| value.re),
                back(&lines[1], &|value| value.im),
            ]
        });
        pairs.take(series.len()).collect()
    }

    /// Place in the series of an entry of the padded one.
    fn place(&self, at: usize) -> i64 {
        at as i64 - self.padding as i64
    }

    /// 1 on the series, and down to 0 over the padding.
    fn fade(&self, at: usize) -> f64 {
        let beyond = (-self.place(at)).max(self.place(at) - (self.count - 1) as i64);
        if beyond <= 0 {
            1.0
        } else {
            0.5 + 0.5 * (PI * beyond as f64 / self.padding as f64).cos()
        }
    }
}

/// The straight line between the ends of a series, which filters that keep what is constant let pass.
struct Line {
    first: f64,
    slope: f64,
}

impl Line {
    fn of(series: &[f64]) -> Self {
        let last = series.len() - 1;
        Self {
            first: series[0],
            slope: (series[last] - series[0]) / last.max(1) as f64,
        }
    }

    fn at(&self, place: f64) -> f64 {
        self.first + self.slope * place
    }
}

#[cfg(test)]
#[path = "quaternion_length_tests.rs"]
mod tests;
