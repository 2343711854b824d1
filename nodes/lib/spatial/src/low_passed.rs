//! Noise that a low-pass has left of white noise, and how a spline smooths where it is in the samples.
//!
//! Poses that were fitted to markers were smoothed before they were handed out: their noise has the density
//!
//! ```text
//! N(f) = r (1 / (1 + x^4)^2 + floor)      x = f / corner
//! ```
//! that of white noise of variance r behind a Butterworth filter of second order, run both ways. Above the
//! corner hardly any is left, so that motion is to be passed which white noise of the same density would
//! hide: a foot that chatters at 33 Hz. The motion's density is s w^-10, and the best filter passes half of
//! what is as dense as the noise. For white noise that is a spline of the weight W = r / s; here its weight is
//! `W N(f) / r`, f its own cutoff:
//!
//! ```text
//! x^10 / (1 + x^4)^2 = v      v = W(corner) / W      N(f) / r = 1 / (1 + 3.80 v^(1/2) + 1.90 v + 9.10 v^2 + v^4)
//! ```
//! within 1.5 % of the root, for a floor of 0.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use crate::equations::SplineEquations;
use crate::wide::{Four, formula};

/// White noise that is left beside, as a part of r: 0.03 mm and 0.01 degrees of fitted poses at 100 Hz. No marker
/// fit with an IMU was at hand to measure it on. Chosen among 0 and 3e-5 to 1e-3 on the motions of `tests/physics`
/// with other paces, forces and sways, seen by fits with 0 to 0.3 mm of it: at 120 Hz, 0.3 mm costs 5 % more than the
/// practice's error in specific force, and 20 % with 3e-5; with 1e-3 a foot that chatters is lost.
const FLOOR: f64 = 1e-4;

/// `integral of (1 + x^4)^-2` over all x from 0 on: `3 pi / (8 sqrt 2)`.
const ALL: f64 = 0.375 * PI * FRAC_1_SQRT_2;

/// Noise behind a low-pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPassed {
    /// Frequency at which half of its amplitude is left, Hz.
    pub corner_hz: f64,
}

impl LowPassed {
    /// Standard deviation, at a rate, Hz, of white noise as dense at low frequencies as this noise is, whose
    /// own standard deviation is `std`.
    pub(crate) fn white_std(self, std: f64, rate_hz: f64) -> f64 {
        std * (0.5 * rate_hz / (ALL * self.corner_hz)).sqrt()
    }

    /// Among samples of these equations.
    pub(crate) fn among(self, equations: &SplineEquations) -> LowPassedSamples {
        LowPassedSamples {
            weight_of_corner: equations.weight_of_cutoff(self.corner_hz),
            corner: 2.0 * self.corner_hz * equations.interval,
        }
    }

    /// Density at a frequency, Hz, over that at low ones.
    pub(crate) fn density(self, hz: f64) -> f64 {
        let x = hz / self.corner_hz;
        (1.0 + x.powi(4)).powi(-2) + FLOOR
    }

    /// What this leaves in the derivative of order m, over what white noise of the same density at low
    /// frequencies does, behind a smoothing of this cutoff, Hz: with c cutoffs in corners
    /// `integral x^2m / (1 + x^4)^2 / (1 + (x / c)^10)^2` over that without the middle factor is 1 for a small c, and
    /// falls with c^-(2m + 1); 1 / (1 + z) between is within a third of it.
    pub(crate) fn passed(self, order: i32, cutoff_hz: f64) -> f64 {
        let x = cutoff_hz / self.corner_hz;
        let z = match order {
            0 => x / 0.910,
            1 => x.powi(3) / 1.022,
            _ => x.powi(5) / 1.768,
        };
        1.0 / (1.0 + z) + FLOOR
    }
}

/// The same among samples of a rate, for weights of their spline.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LowPassedSamples {
    /// Weight that cuts at the corner.
    pub weight_of_corner: f64,
    /// The corner over half of the rate.
    pub corner: f64,
}

/// Several of them in the lanes of a [`Four`].
#[derive(Clone, Copy)]
pub(crate) struct LowPassedLanes<const L: usize> {
    weight_of_corner: [f64; L],
    corner: [f64; L],
}

impl<const L: usize> LowPassedLanes<L> {
    /// Where a lane has none, what comes out for it means nothing.
    pub(crate) fn new(lanes: [Option<LowPassedSamples>; L]) -> Self {
        let lanes = lanes.map(Option::unwrap_or_default);
        Self {
            weight_of_corner: lanes.map(|own| own.weight_of_corner),
            corner: lanes.map(|own| own.corner),
        }
    }

    /// The noise's density at the cutoff where motion is as dense, over that at low frequencies, without the
    /// floor; `weight` is that for white noise.
    #[inline(always)]
    pub(crate) fn density(&self, s: impl Four, weight: &[f64; L]) -> [f64; L] {
        formula(
            s,
            [weight, &self.weight_of_corner],
            #[inline(always)]
            |[weight, of_corner]| behind_filter(s, of_corner, weight),
        )
    }

    /// The same with the floor.
    #[inline(always)]
    pub(crate) fn with_floor(&self, s: impl Four, density: &[f64; L]) -> [f64; L] {
        formula(
            s,
            [density],
            #[inline(always)]
            |[density]| s.add(density, s.splat(FLOOR)),
        )
    }

    /// What of the noise a spline leaves in a sample's distance from it, over what white noise of all
    /// frequencies has: that beyond the cutoff. `density` is that at the cutoff, without the floor, `free` what
    /// of white noise is left.
    #[inline(always)]
    pub(crate) fn left_over(&self, s: impl Four, density: &[f64; L], free: &[f64; L]) -> [f64; L] {
        formula(
            s,
            [density, free, &self.corner],
            #[inline(always)]
            |[density, free, corner]| {
                let one = s.splat(1.0);
                let square = s.subtract(s.divide(one, s.square_root(density)), one);
                let x = s.square_root(s.square_root(square));
                // The integral from x on, within 2 %.
                let beyond = s.divide(s.splat(ALL), falls_by(s, x));
                let of_floor = s.multiply(s.splat(FLOOR), free);
                s.add(s.multiply(corner, beyond), of_floor)
            },
        )
    }
}

/// Density behind the filter at the cutoff, without the floor.
#[inline(always)]
fn behind_filter<S: Four>(s: S, of_corner: S::Numbers, weight: S::Numbers) -> S::Numbers {
    let v = s.divide(of_corner, weight);
    let square = s.multiply(v, v);
    let mut sum = s.splat(1.0);
    sum = s.add(sum, s.multiply(s.splat(3.80), s.square_root(v)));
    sum = s.add(sum, s.multiply(s.splat(1.90), v));
    sum = s.add(sum, s.multiply(s.splat(9.10), square));
    sum = s.add(sum, s.multiply(square, square));
    s.divide(s.splat(1.0), sum)
}

/// `1 + x / ALL + 0.117 x^2 + 6.13 x^3 + 7 ALL x^7`.
#[inline(always)]
fn falls_by<S: Four>(s: S, x: S::Numbers) -> S::Numbers {
    let square = s.multiply(x, x);
    let cube = s.multiply(square, x);
    let seventh = s.multiply(s.multiply(square, square), cube);
    let mut sum = s.add(s.splat(1.0), s.divide(x, s.splat(ALL)));
    sum = s.add(sum, s.multiply(s.splat(0.117), square));
    sum = s.add(sum, s.multiply(s.splat(6.13), cube));
    s.add(sum, s.multiply(s.splat(7.0 * ALL), seventh))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::Plain;

    const FITTED: LowPassed = LowPassed { corner_hz: 8.0 };
    const CORNER: f64 = 0.1;
    const AT_CORNER_1: LowPassedLanes<1> = LowPassedLanes {
        weight_of_corner: [1.0],
        corner: [CORNER],
    };

    fn density(x: f64) -> f64 {
        (1.0 + x.powi(4)).powi(-2)
    }

    fn sum(from: f64, of: impl Fn(f64) -> f64) -> f64 {
        let steps = 200_000;
        let width = (200.0 - from) / f64::from(steps);
        let middle = |k: i32| from + width * (f64::from(k) + 0.5);
        (0..steps).map(|k| width * of(middle(k))).sum()
    }

    #[test]
    fn at_its_cutoff_motion_is_as_dense_as_the_noise() {
        for x in [0.2_f64, 0.5, 0.8, 1.0, 1.5, 2.5, 4.0] {
            let for_white = 1.0 / (x.powi(10) * density(x));
            let found = AT_CORNER_1.density(Plain, &[for_white])[0];
            assert!(
                (found / density(x) - 1.0).abs() < 0.016,
                "{x}: {found} {}",
                density(x)
            );
            let left = AT_CORNER_1.left_over(Plain, &[found], &[0.0])[0] / CORNER;
            let beyond = sum(x, density);
            assert!((left / beyond - 1.0).abs() < 0.1, "{x}: {left} {beyond}");
        }
    }

    #[test]
    fn noise_passes_as_its_spectrum_says() {
        for (order, within) in [(1, 0.16), (2, 0.4)] {
            for cutoff in [0.3, 0.8, 1.0, 1.5, 3.0] {
                let response = |x: f64| (1.0 + (x / cutoff).powi(10)).powi(-2);
                let weighed = |x: f64| x.powi(2 * order) * response(x);
                let exact = sum(0.0, |x| density(x) * weighed(x)) / sum(0.0, weighed);
                let found = FITTED.passed(order, cutoff * FITTED.corner_hz);
                assert!(
                    (found / (exact + FLOOR) - 1.0).abs() < within,
                    "order {order}, {cutoff} corners: {found} {exact}"
                );
            }
        }
        assert!((ALL / sum(0.0, density) - 1.0).abs() < 1e-3);
        // A millimetre within 8 Hz is as dense as 2.7 mm up to 50 Hz.
        assert!((FITTED.white_std(1.0, 100.0) - 2.74).abs() < 0.01);
    }
}
