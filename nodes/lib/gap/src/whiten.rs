//! Residuals in units of the noise that they should have.
//!
//! Two real series go through each complex transform, as its real and imaginary part. A
//! real-to-complex transform (`realfft`) does the same work in other roundings, which would change
//! the last digits of every diagnosis; the packing here costs the ten lines in
//! [`Whitener::apply`].

use std::sync::Arc;

use cromosim_imu::{Channel, PerChannel};
use cromosim_spatial::{Complex64, FourierPair};

use crate::axes::{axes_of_channel, channel_of_axis};
use crate::fill::Filler;
use crate::noise_model::{NoiseModel, transform_length};
use crate::prepared::PreparedPlacement;

/// Whitens residuals: each comes out with unit variance where only predicted noise is in it.
#[derive(Clone, Debug)]
pub(crate) struct Whitener {
    transform: FourierPair,
    gain: PerChannel<Vec<f64>>,
    fillers: Vec<Arc<Filler>>,
    /// Square roots of the weights, by axis and entry of the sample grid: 0 where nothing is
    /// compared.
    pub weight: Vec<Vec<f64>>,
    /// Number of values compared.
    pub count: PerChannel<f64>,
    /// Mean of ln(predicted standard deviation) over the values.
    pub log_scale: PerChannel<f64>,
}

impl Whitener {
    pub fn new(prepared: &PreparedPlacement, noise: &NoiseModel) -> Self {
        let length = transform_length(prepared);
        let transform = FourierPair::new(length);
        let gain = PerChannel::from_fn(|channel| {
            noise.power[channel]
                .iter()
                .map(|value| value.max(1e-30).sqrt().recip())
                .collect::<Vec<f64>>()
        });
        let log_scale = PerChannel::from_fn(|channel| {
            let power = &noise.power[channel];
            0.5 * power.iter().map(|value| value.max(1e-30).ln()).sum::<f64>() / power.len() as f64
        });
        let fillers = (0..6).map(|_| Arc::new(Filler::default())).collect();
        let mut whitener = Self {
            transform,
            gain,
            fillers,
            weight: vec![vec![0.0; prepared.length]; 6],
            count: PerChannel::default(),
            log_scale,
        };
        whitener.set_weights(prepared, noise);
        whitener
    }

    /// Zero where nothing is compared; less next to filled entries, whose error the whitening
    /// spreads: `1 / (1 + sum h^2 v)`, with h the whitening's impulse response and v the expected
    /// squared error of what is filled in.
    fn set_weights(&mut self, prepared: &PreparedPlacement, noise: &NoiseModel) {
        for channel in Channel::ALL {
            let covariance = self.covariance(&noise.power[channel]);
            let response = self.squared_response(channel);
            let mut known: Option<Vec<bool>> = None;
            for axis in axes_of_channel(channel) {
                let mut there = vec![false; self.transform.length()];
                prepared
                    .grid_index
                    .iter()
                    .enumerate()
                    .for_each(|(k, &entry)| there[entry] = prepared.usable[k][axis]);
                if known.as_ref() == Some(&there) {
                    self.fillers[axis] = self.fillers[axis - 1].clone();
                    self.weight[axis] = self.weight[axis - 1].clone();
                } else {
                    let filler = Filler::new(&there, &covariance);
                    let error = self.whitened_variance(&filler.variance, &response);
                    for (k, weight) in self.weight[axis].iter_mut().enumerate() {
                        *weight = if there[k] {
                            (1.0 / (1.0 + error[k].re.max(0.0))).sqrt()
                        } else {
                            0.0
                        };
                    }
                    self.fillers[axis] = Arc::new(filler);
                    known = Some(there);
                }
                self.count[channel] += self.weight[axis]
                    .iter()
                    .map(|weight| weight * weight)
                    .sum::<f64>();
            }
        }
    }

    /// Transform of the squared impulse response of a channel's whitening.
    fn squared_response(&self, channel: Channel) -> Vec<Complex64> {
        let length = self.transform.length();
        let mut response: Vec<Complex64> = (0..length)
            .map(|k| Complex64::new(self.gain[channel][k.min(length - k)], 0.0))
            .collect();
        self.transform.inverse(&mut response);
        response
            .iter_mut()
            .for_each(|value| *value = Complex64::new(value.re * value.re, 0.0));
        self.transform.forward(&mut response);
        response
    }

    /// Variances of errors after the whitening, from their variances before it.
    fn whitened_variance(&self, variance: &[f64], response: &[Complex64]) -> Vec<Complex64> {
        let mut whitened: Vec<Complex64> = variance
            .iter()
            .map(|variance| Complex64::new(*variance, 0.0))
            .collect();
        self.transform.forward(&mut whitened);
        whitened
            .iter_mut()
            .zip(response)
            .for_each(|(value, factor)| *value *= *factor);
        self.transform.inverse(&mut whitened);
        whitened
    }

    /// Autocovariance of the predicted noise.
    fn covariance(&self, power: &[f64]) -> Vec<f64> {
        let length = self.transform.length();
        let mut values: Vec<Complex64> = (0..length)
            .map(|k| Complex64::new(power[k.min(length - k)], 0.0))
            .collect();
        self.transform.inverse(&mut values);
        values.iter().map(|value| value.re).collect()
    }

    /// Six series on the sample grid in units of the predicted noise, one behind the other, times the square
    /// root of their weights.
    pub fn apply(&self, series: &[Vec<f64>]) -> Vec<f64> {
        let count = series[0].len();
        let length = self.transform.length();
        let extended = |axis: usize| {
            let mut values = series[axis].clone();
            values.resize(length, 0.0);
            self.fillers[axis].fill(&mut values);
            values
        };
        let mut flat = vec![0.0; 6 * count];
        let mut buffer = vec![Complex64::default(); length];
        // Two axes of a channel at once; the last axes of both share one transform.
        for (first, second) in [(0, 1), (3, 4), (2, 5)] {
            // What changes no axis of both leaves nothing, as most regressions do of most pairs.
            if is_zero(&series[first]) && is_zero(&series[second]) {
                continue;
            }
            let (of_first, of_second) = (extended(first), extended(second));
            for (slot, (a, b)) in buffer.iter_mut().zip(of_first.iter().zip(&of_second)) {
                *slot = Complex64::new(*a, *b);
            }
            self.transform.forward(&mut buffer);
            let [of_first, of_second] = [first, second].map(channel_of_axis);
            let (gain_a, gain_b) = (&self.gain[of_first], &self.gain[of_second]);
            if of_first == of_second {
                for (k, value) in buffer.iter_mut().enumerate() {
                    *value *= gain_a[k.min(length - k)];
                }
            } else {
                for k in 0..=length / 2 {
                    let mirror = (length - k) % length;
                    let (here, there) = (buffer[k], buffer[mirror].conj());
                    let (even, odd) = ((here + there) * 0.5, (here - there) * 0.5);
                    let (even, odd) = (even * gain_a[k], odd * gain_b[k]);
                    buffer[k] = even + odd;
                    buffer[mirror] = (even - odd).conj();
                }
            }
            self.transform.inverse(&mut buffer);
            for k in 0..count {
                flat[first * count + k] = buffer[k].re * self.weight[first][k];
                flat[second * count + k] = buffer[k].im * self.weight[second][k];
            }
        }
        flat
    }
}

/// Whether a series has no value but 0.
pub(crate) fn is_zero(series: &[f64]) -> bool {
    series.iter().all(|value| *value == 0.0)
}
