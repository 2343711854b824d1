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

    /// The same behind a zero-phase filter of each channel, stated at the transform's frequencies.
    #[must_use]
    pub fn behind(&self, filter: &PerChannel<Vec<f64>>) -> Self {
        let mut filtered = self.clone();
        for channel in Channel::ALL {
            let gain = filtered.gain[channel].iter_mut();
            gain.zip(&filter[channel])
                .for_each(|(gain, own)| *gain *= own);
        }
        filtered
    }

    /// Six series on the sample grid in units of the predicted noise, one behind the other, times the square
    /// root of their weights. What is not compared may have any value; an empty series is one of zeros.
    pub fn apply(&self, series: &[Vec<f64>]) -> Vec<f64> {
        let count = self.weight[0].len();
        let length = self.transform.length();
        let mut flat = vec![0.0; 6 * count];
        let mut filled = [vec![0.0; length], vec![0.0; length]];
        let mut buffer = Vec::with_capacity(length);
        // Two axes of a channel at once; the last axes of both share one transform.
        for pair in [[0, 1], [3, 4], [2, 5]] {
            // What changes no axis of both leaves nothing, as most regressions do of most pairs.
            if pair.iter().all(|&axis| is_zero(&series[axis])) {
                continue;
            }
            for (values, axis) in filled.iter_mut().zip(pair) {
                let (own, rest) = values.split_at_mut(series[axis].len());
                own.copy_from_slice(&series[axis]);
                rest.fill(0.0);
                self.fillers[axis].fill(values);
            }
            let values = filled[0].iter().zip(&filled[1]);
            buffer.clear();
            buffer.extend(values.map(|(a, b)| Complex64::new(*a, *b)));
            self.transform.forward(&mut buffer);
            self.divide_by_noise(&mut buffer, pair.map(channel_of_axis));
            self.transform.inverse(&mut buffer);
            let parts: [fn(&Complex64) -> f64; 2] = [|value| value.re, |value| value.im];
            for (axis, part) in pair.into_iter().zip(parts) {
                let whitened = flat[axis * count..(axis + 1) * count].iter_mut();
                let weights = self.weight[axis].iter();
                for ((whitened, value), weight) in whitened.zip(&buffer).zip(weights) {
                    *whitened = part(value) * weight;
                }
            }
        }
        flat
    }

    /// Transforms of two series of some channels, as real and imaginary part, in units of the predicted
    /// noise.
    fn divide_by_noise(&self, transform: &mut [Complex64], channels: [Channel; 2]) {
        let length = transform.len();
        let [gain_a, gain_b] = channels.map(|channel| &self.gain[channel]);
        if channels[0] == channels[1] {
            let (positive, negative) = transform.split_at_mut(length / 2 + 1);
            for (value, gain) in positive.iter_mut().zip(gain_a) {
                *value *= *gain;
            }
            for (value, gain) in negative.iter_mut().rev().zip(&gain_a[1..]) {
                *value *= *gain;
            }
            return;
        }
        for k in 0..=length / 2 {
            let mirror = (length - k) % length;
            let (here, there) = (transform[k], transform[mirror].conj());
            let (even, odd) = ((here + there) * 0.5, (here - there) * 0.5);
            let (even, odd) = (even * gain_a[k], odd * gain_b[k]);
            transform[k] = even + odd;
            transform[mirror] = (even - odd).conj();
        }
    }
}

/// Whether a series has no value but 0.
pub(crate) fn is_zero(series: &[f64]) -> bool {
    series.iter().all(|value| *value == 0.0)
}
