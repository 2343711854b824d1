//! The motion beyond what a smoothing resolves, in the variances that are stated.
//!
//! Smoothing `1 / (1 + (f / fc)^10)` of samples h apart with noise of variance r leaves in the derivative of
//! order m, far from the ends, the variance
//!
//! ```text
//! V = 2 r h (2 pi)^2m fc^(2m + 1) (pi / 10) / sin(pi (2m + 1) / 10)
//! ```
//! of which the part (2m + 1) / 10 is motion that it takes off: the prior's, whose power falls with f^-10.
//! Bodies' does not. Where little moves, next to nothing is beyond the cutoff; what asks for a high cutoff
//! was struck, and has far more there than the prior. So that part is taken out of what the spline states,
//! and what motions of so high a cutoff have beyond it is put in its place.

use std::f64::consts::{PI, TAU};

use crate::LowPassed;

/// What a spline says of itself at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posterior {
    /// Of the derivative, unit^2, for white noise.
    pub variance: f64,
    /// Variance of the samples' noise, unit^2.
    pub noise: f64,
    /// Between samples, s.
    pub interval: f64,
    /// What a low-pass has made of the noise before.
    pub low_passed: Option<LowPassed>,
}

impl Posterior {
    /// The variance that noise of its own spectrum leaves in the derivative of an order.
    #[inline(always)]
    pub(crate) fn learnt(self, order: i32, cutoff_hz: f64) -> f64 {
        self.low_passed.map_or(self.variance, |noise| {
            self.variance * noise.passed(order, cutoff_hz)
        })
    }
}

/// What motion has beyond the cutoff over what the prior has there: `most z / (1 + z)`, z = (fc /
/// from)^8. It was fitted by gamma likelihood (the variance's, given squared errors) on the motions of
/// `tests/physics` with other paces, forces and sways, and on motions of closed form of another
/// seed, both with white errors at 30, 60 and 120 Hz; neither those of `bags/truth` nor the seed of
/// `evaluate fidelity` was among them. A power of 7 and 9 fitted best.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beyond {
    /// Of the derivative.
    order: i32,
    /// `(pi / 10) / sin(pi (2m + 1) / 10)`.
    integral: f64,
    /// No unit.
    most: f64,
    /// Hz.
    from_hz: f64,
}

impl Beyond {
    pub(crate) const ACCELERATION: Self = Self {
        order: 2,
        integral: 0.1 * PI,
        most: 36.0,
        from_hz: 8.4,
    };
    pub(crate) const ANGULAR_VELOCITY: Self = Self {
        order: 1,
        integral: 0.388_322_207_745_093_3,
        most: 7.0,
        from_hz: 6.4,
    };

    /// The variance with that of the motion beyond the cutoff, unit^2. Written out where it is asked for, as the order
    /// is known there.
    #[inline(always)]
    pub(crate) fn stated(self, posterior: Posterior, cutoff_hz: f64) -> f64 {
        let part = 0.1 * f64::from(2 * self.order + 1);
        let z = (cutoff_hz / self.from_hz).powi(8);
        let heavier = self.most * z / (1.0 + z);
        (1.0 - part) * posterior.learnt(self.order, cutoff_hz)
            + part * heavier * self.amid(posterior, cutoff_hz)
    }

    /// V above, for white noise as dense as that at the cutoff.
    #[inline(always)]
    fn amid(
        self,
        Posterior {
            noise,
            interval,
            low_passed,
            ..
        }: Posterior,
        cutoff_hz: f64,
    ) -> f64 {
        let noise = low_passed.map_or(noise, |own| noise * own.density(cutoff_hz));
        let slope = (TAU * cutoff_hz).powi(2 * self.order);
        2.0 * noise * interval * cutoff_hz * slope * self.integral
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{Influence, SplineSystem, SplineWeight};
    use std::sync::Arc;

    /// The noise that a spline lets through is the part of V that is not taken for motion.
    #[test]
    fn the_formula_is_that_of_a_spline_amid_its_samples() {
        let seconds: Vec<f64> = (0..600).map(|k| 0.01 * f64::from(k)).collect();
        let system = Arc::new(SplineSystem::new(&seconds).unwrap());
        for cutoff_hz in [4.0, 8.0, 14.0] {
            let weight = SplineWeight::Uniform(system.equations.weight_of_cutoff(cutoff_hz));
            let weights = Influence::new(&system, &weight).unwrap().at(3.0);
            for (kind, m) in [(Beyond::ANGULAR_VELOCITY, 1), (Beyond::ACCELERATION, 2)] {
                let through: f64 = weights.rows.iter().map(|row| row[m] * row[m]).sum();
                let posterior = Posterior {
                    variance: 0.0,
                    noise: 1.0,
                    interval: 0.01,
                    low_passed: None,
                };
                let part = 1.0 - 0.1 * (2.0 * m as f64 + 1.0);
                let expected = part * kind.amid(posterior, cutoff_hz);
                assert!(
                    (through / expected - 1.0).abs() < 0.05,
                    "{cutoff_hz} Hz, order {m}: {through} {expected}"
                );
            }
        }
    }

    #[test]
    fn slow_motion_has_nothing_beyond_its_cutoff_and_struck_motion_much() {
        let kind = Beyond::ACCELERATION;
        let at = |cutoff_hz: f64| {
            let bare = Posterior {
                variance: 0.0,
                noise: 1e-6,
                interval: 0.01,
                low_passed: None,
            };
            let variance = kind.amid(bare, cutoff_hz);
            kind.stated(Posterior { variance, ..bare }, cutoff_hz) / variance
        };
        assert!((at(3.0) - 0.5).abs() < 0.01 && (at(20.0) - 18.5).abs() < 0.1);
    }
}
