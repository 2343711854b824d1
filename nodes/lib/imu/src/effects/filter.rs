//! Second-order filters, discretised exactly for inputs that are polynomials between the samples.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2, Vector3};

/// Samples whose polynomial stands for the input between the middle two of them: degree 5, error
/// O(h^6).
const TAPS: usize = 6;
/// The first of them, counted from the start of the interval.
const FIRST_TAP: i32 = -2;

/// The low-pass `wn^2 / (s^2 + 2 z wn s + wn^2)`.
///
/// State `x = (y, y'/wn)` of the low-pass output y: `x' = A x + B u`, `A = wn [[0, 1], [-1, -2
/// z]]`, `B = (0, wn)`; the output is `x_0`. A step of h: `x(h) = e^(A h) x(0)
/// + int_0^h e^(A (h - s)) B u(s) ds`, with u the polynomial through N samples around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SecondOrder {
    pub natural_hz: f64,
    pub damping_ratio: f64,
}

impl SecondOrder {
    /// Filters a series on a grid that began in the steady state of its first sample. N = 6, so 25
    /// Hz on a grid of 200 Hz is right to 0.1 %.
    pub(super) fn apply(&self, series: &mut [Vector3<f64>], rate_hz: f64) {
        let Some(&first) = series.first() else { return };
        let (turn, taps) = self.step_from::<TAPS>(1.0 / rate_hz, FIRST_TAP);
        let last = series.len() - 1;
        // The samples from k - 2 to k + 3, held at the ends; the series itself is overwritten
        // behind them.
        let mut around = [first; TAPS];
        for (ahead, tap) in around[3..].iter_mut().enumerate() {
            *tap = series[(ahead + 1).min(last)];
        }
        let (mut x, mut v) = (first, Vector3::zeros());
        for k in 0..=last {
            series[k] = x;
            let (mut x_next, mut v_next) =
                (x * turn.m11 + v * turn.m12, x * turn.m21 + v * turn.m22);
            for (tap, input) in taps.iter().zip(&around) {
                x_next += input * tap.x;
                v_next += input * tap.y;
            }
            (x, v) = (x_next, v_next);
            around.rotate_left(1);
            around[TAPS - 1] = series[(k + 4).min(last)];
        }
    }

    /// `A h`.
    fn generator(&self, h: f64) -> Matrix2<f64> {
        Matrix2::new(0.0, 1.0, -1.0, -2.0 * self.damping_ratio) * (TAU * self.natural_hz * h)
    }

    /// `e^(A h)` and the weights of N samples at distances of h, of which number 0 is at the start of
    /// the interval and `first` the first.
    pub(super) fn step_from<const N: usize>(
        &self,
        h: f64,
        first: i32,
    ) -> (Matrix2<f64>, [Vector2<f64>; N]) {
        let generator = self.generator(h);
        // int_0^1 e^(Ah (1 - s)) Ah s^m ds times (A h)^-1 B h, where (A h)^-1 B h = A^-1 B = (-1,
        // 0).
        let moments = moments::<N>(&generator).map(|moment| moment * Vector2::new(-1.0, 0.0));
        let mut taps = [Vector2::zeros(); N];
        for (j, tap) in taps.iter_mut().enumerate() {
            let polynomial = lagrange_coefficients::<N>(j, first);
            *tap = moments
                .iter()
                .zip(polynomial)
                .map(|(moment, coefficient)| moment * coefficient)
                .sum();
        }
        (exponential(&generator), taps)
    }

    /// Response after seconds without input to a state given by output and its derivative (of the
    /// low-pass).
    pub(super) fn homogeneous(
        &self,
        seconds: f64,
        value: &Vector3<f64>,
        derivative: &Vector3<f64>,
    ) -> Vector3<f64> {
        let turn = exponential(&self.generator(seconds));
        value * turn.m11 + derivative * (turn.m12 / (TAU * self.natural_hz))
    }
}

/// The filter as samples come, each input a straight line from the one before.
#[derive(Clone, Debug)]
pub(super) struct Streamed {
    filter: SecondOrder,
    /// Interval, its matrix and its weights: made anew where the interval changes.
    prepared: (f64, Matrix2<f64>, [Vector2<f64>; 2]),
    state: Option<(Vector3<f64>, Vector3<f64>, Vector3<f64>)>,
}

impl Streamed {
    pub(super) fn new(filter: SecondOrder) -> Self {
        Self {
            filter,
            prepared: (0.0, Matrix2::identity(), [Vector2::zeros(); 2]),
            state: None,
        }
    }

    /// Output for an input that comes `interval` seconds after the one before; the first is a
    /// steady state.
    pub(super) fn push(&mut self, input: Vector3<f64>, interval: f64) -> Vector3<f64> {
        let (x, v) = match self.state {
            None => (input, Vector3::zeros()),
            Some((x, v, before)) => {
                if (interval - self.prepared.0).abs() > 1e-9 {
                    let (turn, taps) = self.filter.step_from(interval, 0);
                    self.prepared = (interval, turn, taps);
                }
                let (_, turn, [from, to]) = &self.prepared;
                (
                    x * turn.m11 + v * turn.m12 + before * from.x + input * to.x,
                    x * turn.m21 + v * turn.m22 + before * from.y + input * to.y,
                )
            }
        };
        self.state = Some((x, v, input));
        x
    }

    /// Begins anew with the next input.
    pub(super) fn reset(&mut self) {
        self.state = None;
    }
}

/// `e^Z`: Taylor's series of `Z / 2^k`, squared k times.
fn exponential(z: &Matrix2<f64>) -> Matrix2<f64> {
    let size = z.abs().max();
    let halvings = if size > 0.25 {
        (size / 0.25).log2().ceil() as i32
    } else {
        0
    };
    let small = z * 0.5f64.powi(halvings);
    let mut sum = Matrix2::identity();
    for k in (1..=14).rev() {
        sum = Matrix2::identity() + small * sum / f64::from(k);
    }
    (0..halvings).fold(sum, |square, _| square * square)
}

/// `I_m = Z int_0^1 e^(Z (1 - s)) s^m ds` for m < N. By parts: `I_0 = e^Z - 1`, `I_m = Z^-1 m
/// I_(m-1) - 1`, which loses digits for small Z; there the series `I_m = sum_k Z^(k+1) m! / (m + k
/// + 1)!`.
fn moments<const N: usize>(z: &Matrix2<f64>) -> [Matrix2<f64>; N] {
    let mut moments = [Matrix2::zeros(); N];
    let inverse = z.try_inverse().filter(|_| z.determinant() > 4.0);
    for m in 0..N {
        moments[m] = match (inverse, m) {
            (Some(_), 0) => exponential(z) - Matrix2::identity(),
            (Some(inverse), _) => inverse * moments[m - 1] * m as f64 - Matrix2::identity(),
            (None, _) => {
                // Horner's rule: Z/(m+1) (1 + Z/(m+2) (1 + ...)).
                let mut sum = Matrix2::identity();
                for k in (1..=60).rev() {
                    sum = Matrix2::identity() + z * sum / (m + k + 1) as f64;
                }
                z * sum / (m + 1) as f64
            }
        };
    }
    moments
}

/// Coefficients of 1, s, s^2, ... of the polynomial that is 1 at node j and 0 at the others; nodes
/// `first`, `first + 1` and so on.
fn lagrange_coefficients<const N: usize>(j: usize, first: i32) -> [f64; N] {
    let node = |k: usize| k as f64 + f64::from(first);
    let mut coefficients = [0.0; N];
    coefficients[0] = 1.0;
    for (degree, k) in (0..N).filter(|k| *k != j).enumerate() {
        let scale = (node(j) - node(k)).recip();
        for power in (0..=degree + 1).rev() {
            let lower = if power > 0 {
                coefficients[power - 1]
            } else {
                0.0
            };
            coefficients[power] = (lower - node(k) * coefficients[power]) * scale;
        }
    }
    coefficients
}

#[cfg(test)]
#[path = "filter_tests.rs"]
mod tests;
