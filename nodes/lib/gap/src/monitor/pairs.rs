//! Measured readings and what was simulated for the same stamps.

use cromosim_imu::{Channel, PerChannel, Reading};
use nalgebra::Vector3;

use super::reading::{ImuReading, period};

/// A gap of more periods than this is not interpolated over.
const LONGEST_GAP_PERIODS: f64 = 3.0;

/// What was compared.
pub(super) struct Pairs {
    /// Since the first pair's stamp, s.
    pub seconds: Vec<f64>,
    pub measured: Vec<Reading>,
    pub simulated: Vec<Reading>,
    /// Median interval, s.
    pub period: f64,
    /// Root mean square of the interpolation's weights: what is left of white noise.
    pub noise_gain: f64,
}

impl Pairs {
    /// Pairs each measured reading with the simulated one of `lag` seconds before its stamp; none
    /// where either stream is too short.
    pub(super) fn at_lag(
        measured: &[ImuReading],
        simulated: &[ImuReading],
        lag: f64,
    ) -> Option<Self> {
        let longest = LONGEST_GAP_PERIODS * period(simulated)?;
        let period = period(measured)?;
        let start = measured.first()?.stamp;
        // Once, so that the search below runs over plain numbers.
        let times: Vec<f64> = simulated
            .iter()
            .map(|reading| reading.stamp - start)
            .collect();
        let mut pairs = Self {
            seconds: Vec::new(),
            measured: Vec::new(),
            simulated: Vec::new(),
            period,
            noise_gain: 1.0,
        };
        let (mut after, mut gain) = (0, 0.0);
        for reading in measured {
            let seconds = reading.stamp - start;
            let wanted = seconds - lag;
            while after < times.len() && times[after] < wanted {
                after += 1;
            }
            let Some((value, weight)) = interpolated(&times, simulated, after, wanted, longest)
            else {
                continue;
            };
            gain += weight;
            pairs.seconds.push(seconds);
            pairs.measured.push(reading.by_channel());
            pairs.simulated.push(value);
        }
        pairs.noise_gain = (gain / pairs.len().max(1) as f64).sqrt();
        Some(pairs)
    }

    pub(super) fn len(&self) -> usize {
        self.seconds.len()
    }

    pub(super) fn residual(&self, index: usize) -> PerChannel<Vector3<f64>> {
        PerChannel::from_fn(|channel| {
            self.measured[index][channel] - self.simulated[index][channel]
        })
    }

    /// Sum over all pairs, by channel.
    pub(super) fn squared_residuals(&self) -> PerChannel<f64> {
        PerChannel::from_fn(|channel| {
            let both = self.measured.iter().zip(&self.simulated);
            both.map(|(m, s)| (m[channel] - s[channel]).norm_squared())
                .sum()
        })
    }

    /// Whether the pairs around an index stand without a gap.
    fn is_whole(&self, index: usize, around: usize) -> bool {
        index >= around
            && index + around < self.len()
            && self.seconds[index + around] - self.seconds[index - around]
                < (2 * around) as f64 * self.period * 1.5
    }

    /// Slope of the simulated readings, per second, by the least-squares line through five; zero
    /// next to gaps and ends.
    pub(super) fn simulated_slope(&self, index: usize) -> PerChannel<Vector3<f64>> {
        if !self.is_whole(index, 2) {
            return PerChannel::default();
        }
        PerChannel::from_fn(|channel| {
            let at = |step: usize| self.simulated[index + step - 2][channel];
            ((at(4) - at(0)) * 2.0 + at(3) - at(1)) / (10.0 * self.period)
        })
    }
}

/// The simulated readings at a time, and the sum of the squared weights; `after` is the first
/// reading not before it.
fn interpolated(
    times: &[f64],
    simulated: &[ImuReading],
    after: usize,
    time: f64,
    longest: f64,
) -> Option<(Reading, f64)> {
    if times.get(after) == Some(&time) {
        return Some((simulated[after].by_channel(), 1.0));
    }
    let (from, to) = (times.get(after.checked_sub(1)?)?, times.get(after)?);
    let step = to - from;
    if step > longest {
        return None;
    }
    let x = (time - from) / step;
    let even = |one: usize, other: usize| ((times[other] - times[one]) - step).abs() < 0.2 * step;
    let mix = |first: usize, weights: &[f64]| {
        let mut sum = Reading::default();
        for (k, weight) in weights.iter().enumerate() {
            let value = simulated[first + k].by_channel();
            for channel in Channel::ALL {
                sum[channel] += value[channel] * *weight;
            }
        }
        Some((sum, weights.iter().map(|weight| weight * weight).sum()))
    };
    if after >= 2 && after + 1 < times.len() && even(after - 2, after - 1) && even(after, after + 1)
    {
        // Lagrange's cubic through the readings at -1, 0, 1, 2.
        let weights = [
            -x * (x - 1.0) * (x - 2.0) / 6.0,
            (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
            -(x + 1.0) * x * (x - 2.0) / 2.0,
            (x + 1.0) * x * (x - 1.0) / 6.0,
        ];
        return mix(after - 2, &weights);
    }
    mix(after - 1, &[1.0 - x, x])
}
