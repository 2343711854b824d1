//! Derivatives at the ends of a series, as observations of its spline.

use crate::basis::{Basis, ORDER};
use crate::difference::{MAX_STENCIL, derivative_weights};

/// A derivative at one end as an observation: `row . c[first ..] = sum_j stencil[j] y[start + j]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndDerivative {
    pub first: usize,
    pub row: [f64; ORDER],
    pub start: usize,
    pub stencil: [f64; MAX_STENCIL],
    /// 1 over the variance that white noise of variance one leaves in it.
    pub weight: f64,
}

impl EndDerivative {
    /// The observed derivative, per interval and channel.
    pub fn target<const C: usize>(&self, values: &[[f64; C]]) -> [f64; C] {
        let mut target = [0.0; C];
        for (value, w) in values[self.start..].iter().zip(self.stencil) {
            for c in 0..C {
                target[c] += w * value[c];
            }
        }
        target
    }
}

/// First and second derivative at both ends.
pub(crate) fn end_derivatives(basis: &Basis, times: &[f64]) -> [EndDerivative; 4] {
    let (count, last_interval) = (times.len(), basis.interval_count() - 1);
    let used = count.min(MAX_STENCIL);
    let at = |start: usize, first: usize, t: f64, order: usize| {
        let stencil = derivative_weights(&times[start..start + used], t)[order];
        let square: f64 = stencil.iter().map(|w| w * w).sum();
        let weight = if square > 0.0 { 1.0 / square } else { 1.0 };
        EndDerivative {
            first,
            row: basis.derivatives(first, t, order),
            start,
            stencil,
            weight,
        }
    };
    let (start, end) = (times[0], times[count - 1]);
    [
        at(0, 0, start, 1),
        at(0, 0, start, 2),
        at(count - used, last_interval, end, 1),
        at(count - used, last_interval, end, 2),
    ]
}
