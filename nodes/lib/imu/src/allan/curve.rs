//! The overlapping Allan deviation.

use super::chi_squared;

/// Of the values at least so many times the longest averaging time are needed.
const LEAST_SPANS: usize = 5;
/// Probability of an interval, its ends' probabilities and standard normal quantile.
const ENDS: ([f64; 2], f64) = ([0.025, 0.975], 1.959_963_984_540_054);

/// The Allan deviation at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllanPoint {
    /// Averaging time, s.
    pub tau_s: f64,
    /// In the values' unit.
    pub deviation: f64,
    /// 95 % interval: of `degrees_of_freedom` times the estimate over the true variance, which is
    /// chi-squared.
    pub interval: (f64, f64),
    /// Equivalent ones, of the noise that the curve's slope there shows.
    pub degrees_of_freedom: f64,
}

impl AllanPoint {
    /// An estimate of the variance with its interval.
    pub(super) fn new(tau_s: f64, variance: f64, degrees_of_freedom: f64) -> Self {
        let ([low, high], z) = ENDS;
        let end = |p, z| {
            let quantile = chi_squared::quantile(degrees_of_freedom, p, z);
            (variance * degrees_of_freedom / quantile).sqrt()
        };
        Self {
            tau_s,
            deviation: variance.sqrt(),
            interval: (end(high, z), end(low, -z)),
            degrees_of_freedom,
        }
    }
}

/// The overlapping Allan deviation of values at a rate, two averaging times to the octave, up to a
/// fifth of the whole; none of fewer than ten values.
///
/// Degrees of freedom by Riley, Handbook of Frequency Stability Analysis (NIST SP 1065, 2008), table
/// 5: of white noise, flicker or a random walk, as the slope at each averaging time says.
pub fn allan_curve(values: &[f64], rate_hz: f64) -> Vec<AllanPoint> {
    let longest = values.len() / LEAST_SPANS;
    let mut factors: Vec<usize> = (0..)
        .map(|half| 2f64.powf(0.5 * f64::from(half)).round() as usize)
        .take_while(|factor| *factor <= longest)
        .collect();
    factors.dedup();
    if values.len() < 2 * LEAST_SPANS {
        return Vec::new();
    }
    // Sums of the values less their mean, whose differences keep their digits.
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in values {
        sum += value - mean;
        sums.push(sum);
    }
    let variances: Vec<f64> = factors
        .iter()
        .map(|factor| variance(&sums, *factor))
        .collect();
    let point = |k: usize| {
        let slope = slope(&factors, &variances, k);
        let degrees = degrees_of_freedom(sums.len(), factors[k], slope);
        AllanPoint::new(factors[k] as f64 / rate_hz, variances[k], degrees)
    };
    (0..factors.len()).map(point).collect()
}

/// `<(s_(k+2m) - 2 s_(k+m) + s_k)^2> / (2 m^2)` of the sums s.
fn variance(sums: &[f64], factor: usize) -> f64 {
    let count = sums.len() - 2 * factor;
    let second = |k: usize| sums[k + 2 * factor] - 2.0 * sums[k + factor] + sums[k];
    let squares: f64 = (0..count).map(|k| second(k).powi(2)).sum();
    squares / (2.0 * count as f64 * (factor as f64).powi(2))
}

/// Logarithmic slope of the variance, from the points an octave around.
fn slope(factors: &[usize], variances: &[f64], k: usize) -> f64 {
    let (from, to) = (k.saturating_sub(2), (k + 2).min(factors.len() - 1));
    if from == to || variances[from] <= 0.0 || variances[to] <= 0.0 {
        return -1.0;
    }
    (variances[to] / variances[from]).ln() / (factors[to] as f64 / factors[from] as f64).ln()
}

/// Of `points` sums, whose second differences are those of a clock's phase.
fn degrees_of_freedom(points: usize, factor: usize, slope: f64) -> f64 {
    let (n, m) = (points as f64, factor as f64);
    let degrees = if slope < -0.5 {
        (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0)
    } else if slope < 0.5 {
        if factor == 1 {
            2.0 * (n - 2.0).powi(2) / (2.3 * n - 4.9)
        } else {
            5.0 * n * n / (4.0 * m * (n + 3.0 * m))
        }
    } else {
        let square = (n - 1.0).powi(2) - 3.0 * m * (n - 1.0) + 4.0 * m * m;
        (n - 2.0) / m * square / (n - 3.0).powi(2)
    };
    degrees.max(1.0)
}
