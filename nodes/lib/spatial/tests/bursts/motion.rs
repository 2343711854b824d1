//! Motion that stands still and bursts, with exact derivatives, as a source reports it.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What one source saw of one motion.
pub struct Seen {
    pub rate_hz: f64,
    /// Standard deviation of the error before it was filtered, m.
    pub noise: f64,
    pub filtered: bool,
    pub seconds: Vec<f64>,
    pub samples: Vec<[f64; 3]>,
    /// Exact position [m], velocity [m/s], acceleration [m/s2].
    pub truth: Vec<[[f64; 3]; 3]>,
}

struct Sway {
    amplitude: f64,
    pulsation: f64,
    phase: f64,
}

struct Burst {
    centre: f64,
    width: f64,
    pulsation: f64,
    amplitudes: [f64; 3],
    phases: [f64; 3],
}

/// Sways of 0.2 to 0.8 Hz throughout, bursts of 1 to 9 Hz under Gaussian envelopes of 0.08 to 0.5 s,
/// one every 1.2 s on average.
struct Motion {
    sways: [Vec<Sway>; 3],
    bursts: Vec<Burst>,
}

impl Motion {
    fn draw(draws: &mut ChaCha8Rng, duration: f64) -> Self {
        let mut sway = || Sway {
            amplitude: draws.random_range(0.02..0.08),
            pulsation: TAU * draws.random_range(0.2..0.8),
            phase: draws.random_range(0.0..TAU),
        };
        let sways = std::array::from_fn(|_| (0..4).map(|_| sway()).collect());
        let (mut bursts, mut centre) = (Vec::new(), 0.0);
        loop {
            centre += -1.2 * draws.random_range(f64::MIN_POSITIVE..1.0).ln();
            if centre > duration {
                return Self { sways, bursts };
            }
            let pulsation = TAU * draws.random_range(1.0..9.0);
            let mut amplitude = || {
                let acceleration = draws.random_range(2.0..30.0);
                acceleration / (pulsation * pulsation) * normal(draws)
            };
            let amplitudes = [amplitude(), amplitude(), amplitude()];
            bursts.push(Burst {
                centre,
                width: draws.random_range(0.08..0.5),
                pulsation,
                amplitudes,
                phases: std::array::from_fn(|_| draws.random_range(0.0..TAU)),
            });
        }
    }

    /// Position, velocity, acceleration.
    fn at(&self, t: f64) -> [[f64; 3]; 3] {
        let mut sums = [[0.0; 3]; 3];
        for (c, sways) in self.sways.iter().enumerate() {
            for sway in sways {
                let w = sway.pulsation;
                let (sin, cos) = (w * t + sway.phase).sin_cos();
                for (sum, value) in sums.iter_mut().zip([sin, w * cos, -w * w * sin]) {
                    sum[c] += sway.amplitude * value;
                }
            }
            for burst in &self.bursts {
                let (u, w, v) = (t - burst.centre, burst.pulsation, burst.width.powi(2));
                let envelope = (-u * u / (2.0 * v)).exp();
                let slope = -u / v * envelope;
                let bend = (u * u / v - 1.0) / v * envelope;
                let (sin, cos) = (w * u + burst.phases[c]).sin_cos();
                let derivatives = [
                    envelope * sin,
                    slope * sin + envelope * w * cos,
                    bend * sin + 2.0 * slope * w * cos - envelope * w * w * sin,
                ];
                for (sum, value) in sums.iter_mut().zip(derivatives) {
                    sum[c] += burst.amplitudes[c] * value;
                }
            }
        }
        sums
    }
}

/// A standard normal number (Box and Muller).
fn normal(draws: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * draws.random_range(f64::MIN_POSITIVE..1.0).ln()).sqrt();
    radius * draws.random_range(0.0..TAU).cos()
}

/// Case `seed`: 60 or 120 Hz, 0.3, 1 or 3 mm of error, in a quarter of the cases low-passed.
pub fn seen(seed: u64, duration: f64) -> Seen {
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let rate_hz = [60.0, 120.0][seed as usize % 2];
    let noise = [0.3e-3, 1e-3, 3e-3][seed as usize / 2 % 3];
    let filtered = seed / 6 % 4 == 3;
    let motion = Motion::draw(&mut draws, duration);
    let count = (duration * rate_hz) as usize;
    let seconds: Vec<f64> = (0..count).map(|k| k as f64 / rate_hz).collect();
    let truth: Vec<_> = seconds.iter().map(|&t| motion.at(t)).collect();
    let mut samples: Vec<[f64; 3]> = truth.iter().map(|truth| truth[0]).collect();
    for c in 0..3 {
        let white: Vec<f64> = (0..count).map(|_| noise * normal(&mut draws)).collect();
        let errors = if filtered {
            butterworth(&white, (0.2 * rate_hz).min(10.0), rate_hz)
        } else {
            white
        };
        for (sample, error) in samples.iter_mut().zip(errors) {
            sample[c] += error;
        }
    }
    Seen {
        rate_hz,
        noise,
        filtered,
        seconds,
        samples,
        truth,
    }
}

/// What everybody does: a Butterworth low-pass of second order, forwards and backwards, the series
/// continued oddly.
pub fn butterworth(series: &[f64], cutoff_hz: f64, rate_hz: f64) -> Vec<f64> {
    let k = (PI * cutoff_hz / rate_hz).tan();
    let scale = 1.0 / (1.0 + k / FRAC_1_SQRT_2 + k * k);
    let (b, a1) = (k * k * scale, 2.0 * (k * k - 1.0) * scale);
    let a2 = (1.0 - k / FRAC_1_SQRT_2 + k * k) * scale;
    let last = series.len() - 1;
    let lead = ((3.0 * rate_hz / cutoff_hz) as usize).min(last);
    let before = (1..=lead).rev().map(|k| 2.0 * series[0] - series[k]);
    let after = (1..=lead).map(|k| 2.0 * series[last] - series[last - k]);
    let mut values: Vec<f64> = before.chain(series.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        let (mut x, mut y) = ([values[0]; 2], [values[0]; 2]);
        for value in &mut values {
            let filtered = b * (*value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
            (x, y) = ([*value, x[0]], [filtered, y[0]]);
            *value = filtered;
        }
        values.reverse();
    }
    values[lead..lead + series.len()].to_vec()
}

/// First and second derivatives by central differences of fourth order; the series is continued
/// oddly.
pub fn differences(series: &[f64], rate_hz: f64) -> [Vec<f64>; 2] {
    let last = series.len() as i64 - 1;
    let at = |k: i64| {
        let inside = |k: i64| series[k.clamp(0, last) as usize];
        match k {
            _ if k < 0 => 2.0 * series[0] - inside(-k),
            _ if k > last => 2.0 * inside(last) - inside(2 * last - k),
            _ => inside(k),
        }
    };
    let first = |k: i64| (at(k - 2) - 8.0 * at(k - 1) + 8.0 * at(k + 1) - at(k + 2)) / 12.0;
    let second = |k: i64| {
        (-at(k - 2) + 16.0 * at(k - 1) - 30.0 * at(k) + 16.0 * at(k + 1) - at(k + 2)) / 12.0
    };
    [
        (0..=last).map(|k| first(k) * rate_hz).collect(),
        (0..=last).map(|k| second(k) * rate_hz * rate_hz).collect(),
    ]
}
