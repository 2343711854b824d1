//! Measured readings and what was simulated for the same stamps.

use nalgebra::Vector3;

use super::ImuReading;

/// A hole of more periods than this is not interpolated over.
const LONGEST_HOLE: f64 = 3.0;
/// The fourth difference of white noise has this times its variance: 1 + 16 + 36 + 16 + 1.
const FOURTH_DIFFERENCE_GAIN: f64 = 70.0;
/// Median of the absolute value of a standard normal variable.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// Both channels of a reading: specific force, angular velocity.
pub(super) type Both = [Vector3<f64>; 2];

/// What was compared.
pub(super) struct Pairs {
    /// Since the first pair's stamp, s.
    pub seconds: Vec<f64>,
    pub measured: Vec<Both>,
    pub simulated: Vec<Both>,
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
        let period = median_period(measured)?;
        let longest = LONGEST_HOLE * median_period(simulated)?;
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
            pairs.measured.push(both(&reading.values));
            pairs.simulated.push(value);
        }
        pairs.noise_gain = (gain / pairs.len().max(1) as f64).sqrt();
        Some(pairs)
    }

    pub(super) fn len(&self) -> usize {
        self.seconds.len()
    }

    pub(super) fn residual(&self, index: usize) -> Both {
        std::array::from_fn(|channel| {
            self.measured[index][channel] - self.simulated[index][channel]
        })
    }

    /// Sum over all pairs, by channel.
    pub(super) fn squared_residuals(&self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for index in 0..self.len() {
            let residual = self.residual(index);
            sums = [
                sums[0] + residual[0].norm_squared(),
                sums[1] + residual[1].norm_squared(),
            ];
        }
        sums
    }

    /// Whether the pairs around an index stand without a hole.
    fn is_whole(&self, index: usize, around: usize) -> bool {
        index >= around
            && index + around < self.len()
            && self.seconds[index + around] - self.seconds[index - around]
                < (2 * around) as f64 * self.period * 1.5
    }

    /// Slope of the simulated readings, per second, by the least-squares line through five; zero
    /// next to holes and ends.
    pub(super) fn simulated_slope(&self, index: usize) -> Both {
        if !self.is_whole(index, 2) {
            return [Vector3::zeros(); 2];
        }
        let at = |step: usize, channel: usize| self.simulated[index + step - 2][channel];
        std::array::from_fn(|channel| {
            ((at(4, channel) - at(0, channel)) * 2.0 + at(3, channel) - at(1, channel))
                / (10.0 * self.period)
        })
    }
}

pub(super) fn both(values: &[f64; 6]) -> Both {
    [
        Vector3::new(values[0], values[1], values[2]),
        Vector3::new(values[3], values[4], values[5]),
    ]
}

/// The simulated readings at a time, and the sum of the squared weights; `after` is the first
/// reading not before it.
fn interpolated(
    times: &[f64],
    simulated: &[ImuReading],
    after: usize,
    time: f64,
    longest: f64,
) -> Option<(Both, f64)> {
    let at = |index: usize| both(&simulated[index].values);
    if times.get(after) == Some(&time) {
        return Some((at(after), 1.0));
    }
    let (from, to) = (times.get(after.checked_sub(1)?)?, times.get(after)?);
    let step = to - from;
    if step > longest {
        return None;
    }
    let x = (time - from) / step;
    let even = |one: usize, other: usize| ((times[other] - times[one]) - step).abs() < 0.2 * step;
    let mix = |first: usize, weights: &[f64]| {
        let mut sum = [Vector3::zeros(); 2];
        for (k, weight) in weights.iter().enumerate() {
            let value = at(first + k);
            sum = [sum[0] + value[0] * *weight, sum[1] + value[1] * *weight];
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

/// Median interval of a stream, s; none where there is no positive one.
pub(super) fn median_period(readings: &[ImuReading]) -> Option<f64> {
    let mut intervals: Vec<f64> = readings
        .windows(2)
        .map(|pair| pair[1].stamp - pair[0].stamp)
        .filter(|interval| *interval > 0.0)
        .collect();
    if intervals.is_empty() {
        return None;
    }
    let middle = intervals.len() / 2;
    Some(*intervals.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// White noise of a reading by channel, from fourth differences: these leave hardly anything of
/// motion, and their median little of impacts.
pub(super) fn noise_floors(readings: &[ImuReading]) -> [f64; 2] {
    let Some(period) = median_period(readings) else {
        return [0.0; 2];
    };
    let whole = |run: &&[ImuReading]| run[4].stamp - run[0].stamp < 4.5 * period;
    let variance = |axis: usize| {
        let difference = |run: &[ImuReading]| {
            let value = |k: usize| run[k].values[axis];
            (value(0) - 4.0 * value(1) + 6.0 * value(2) - 4.0 * value(3) + value(4)).abs()
        };
        let mut differences: Vec<f64> = readings.windows(5).filter(whole).map(difference).collect();
        if differences.is_empty() {
            return 0.0;
        }
        let middle = differences.len() / 2;
        let median = *differences.select_nth_unstable_by(middle, f64::total_cmp).1;
        (median / MEDIAN_OF_NORMAL).powi(2) / FOURTH_DIFFERENCE_GAIN
    };
    std::array::from_fn(|channel| {
        ((0..3).map(|axis| variance(3 * channel + axis)).sum::<f64>() / 3.0).sqrt()
    })
}
