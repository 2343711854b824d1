//! The motion beyond what a smoothing resolves, in the variances that are stated.
//!
//! Smoothing `1 / (1 + (f / fc)^10)` of samples h apart with noise of variance r leaves in the derivative of
//! order m, far from the ends, the variance
//!
//! ```text
//! V = 2 r h (2 pi)^2m fc^(2m + 1) (pi / 10) / sin(pi (2m + 1) / 10)
//! ```
//! of which the part (2m + 1) / 10 is motion that it takes off: the prior's, whose power falls with f^-10. Where
//! accelerations are held to those around too, the response is `H = 1 / (1 + (f / fc)^10 + (f / fv)^4)`, and the noise's part
//! `integral f^2m H^2 df / integral f^2m H df` is smaller ([`NOISE_PARTS`]). What bodies do beyond the cutoff is not the prior's: where
//! little moves it is next to nothing. An impact asks for a high cutoff fc with little acceleration around (fv at
//! most about 3 fc), and has far more there than the prior; a fast swing asks for it with much (fv higher), and has little more. So
//! the prior's part is taken out of what the spline states, and what such motions have beyond it is put in its place.

use std::f64::consts::{PI, TAU};

use crate::{LowPassed, end_noise};

/// The noise's part for fc / fv in steps of [`NOISE_PART_STEP`], of the first and of the second derivative.
const NOISE_PARTS: [[f64; 2]; 17] = [
    [0.7000, 0.5000],
    [0.7000, 0.5000],
    [0.6993, 0.4992],
    [0.6965, 0.4962],
    [0.6891, 0.4882],
    [0.6744, 0.4724],
    [0.6506, 0.4466],
    [0.6177, 0.4110],
    [0.5784, 0.3681],
    [0.5366, 0.3224],
    [0.4963, 0.2781],
    [0.4601, 0.2380],
    [0.4290, 0.2035],
    [0.4031, 0.1745],
    [0.3818, 0.1505],
    [0.3644, 0.1308],
    [0.3501, 0.1145],
];
const NOISE_PART_STEP: f64 = 0.125;

/// What a spline says of itself at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posterior {
    /// Of the derivative, unit^2, for white noise.
    pub variance: f64,
    /// Variance of the samples' noise, unit^2.
    pub noise: f64,
    /// Between samples, s.
    pub interval: f64,
    /// To the nearer end of the samples, s.
    pub to_end_s: f64,
    /// What a low-pass has made of the noise before.
    pub low_passed: Option<LowPassed>,
    /// What of noise comes through over what of white noise of this variance does.
    pub excess: f64,
}

impl Posterior {
    /// The variance that the noise learnt around leaves in the derivative of an order: white, or behind a low-pass.
    #[inline(always)]
    pub(crate) fn learnt(self, order: i32, cutoff_hz: f64) -> f64 {
        self.low_passed.map_or(self.variance, |noise| {
            self.variance * noise.passed(order, cutoff_hz)
        })
    }

    /// That which noise of its own spectrum leaves.
    #[inline(always)]
    pub(crate) fn of_noise(self, order: i32, cutoff_hz: f64) -> f64 {
        self.excess * self.learnt(order, cutoff_hz)
    }
}

/// What motion has beyond the cutoff over what the prior has there.
///
/// `z / (1 + z) (impact / (1 + (fv / (ratio fc))^16) + swing) / (1 + (rest / fv)^12)`, z = (fc / from)^12. The constants were
/// fitted by gamma likelihood (the variance's, given squared errors) and to means of one on the
/// motions of `tests/physics` with other paces and sways (1.12 and 0.9 times as fast), and on motions
/// of closed form of another seed, all with white errors at 30, 60 and 120 Hz; neither those of
/// `bags/truth` nor the seed of `evaluate fidelity` was among them. `rest` lies where these have means of one
/// for fv below 5 Hz and from there to 6 Hz (accelerations 0.5 to 1.0 without it). `swing` was chosen among about 1, 3
/// and 6 (velocity: 1, 2 and 4) on the real pairs of that command: motions of the physics have 1 to 6
/// at fv of 4 fc and more, closed forms 0.3.
#[derive(Clone, Copy, Debug)]
struct Excess {
    /// Of an impact, no unit.
    impact: f64,
    /// Hz.
    from_hz: f64,
    /// fv over fc from which on motion is a swing.
    ratio: f64,
    /// Of any fast motion, no unit.
    swing: f64,
    /// fv below which nothing moves, Hz.
    rest_hz: f64,
}

impl Excess {
    #[inline(always)]
    fn over_prior(self, cutoff_hz: f64, vigour_hz: f64) -> f64 {
        let z = (cutoff_hz / self.from_hz).powi(12);
        let swings = (vigour_hz / (self.ratio * cutoff_hz)).powi(16);
        let rests = (self.rest_hz / vigour_hz).powi(12);
        z / (1.0 + z) * (self.impact / (1.0 + swings) + self.swing) / (1.0 + rests)
    }
}

/// The same where noise was low-passed before: `hidden z / (1 + z) / (1 + (rest / fv)^12) + unseen y / (1 + y)`. The first, z =
/// (fc / from)^32, is of motion that noise hides. The second, y = (fc / (beyond fN))^8 with half the poses' rate fN, is of what asks for a
/// cutoff that this rate does not reach: a foot that chatters. All were fitted by gamma likelihood and to means of one, amid the
/// samples and at their ends, to the motions of `tests/physics` with other paces and sways (1.12 and 0.9 times as
/// fast) and to closed forms of other seeds, seen by marker fits at 60 and 120 Hz; the first one's power was
/// chosen among 8, 16 and 32.
#[derive(Clone, Copy, Debug)]
struct FilteredExcess {
    hidden: f64,
    /// Hz.
    from_hz: f64,
    unseen: f64,
    /// Part of half the poses' rate.
    beyond: f64,
    /// fv below which nothing moves, Hz.
    rest_hz: f64,
}

impl FilteredExcess {
    #[inline(always)]
    fn over_prior(self, cutoff_hz: f64, vigour_hz: f64, interval: f64) -> f64 {
        let up = |z: f64| z / (1.0 + z);
        // At twice the frequency the step is complete to all digits; a power beyond would be infinite.
        let hidden = (cutoff_hz / self.from_hz).min(2.0).powi(32);
        let unseen = (2.0 * interval * cutoff_hz / self.beyond).powi(8);
        let rests = (self.rest_hz / vigour_hz).powi(12);
        self.hidden * up(hidden) / (1.0 + rests) + self.unseen * up(unseen.min(1e9))
    }
}

/// What a derivative's stated variance is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beyond {
    /// Of the derivative.
    order: i32,
    /// `(pi / 10) / sin(pi (2m + 1) / 10)`.
    integral: f64,
    white: Excess,
    filtered: FilteredExcess,
}

/// At which frequencies the responses of a spline's two weights alone are one half, Hz.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutoffs {
    /// Of smoothness: fc.
    pub smooth_hz: f64,
    /// Of accelerations that are no larger than those around: fv.
    pub vigour_hz: f64,
}

impl Beyond {
    pub(crate) const ACCELERATION: Self = Self {
        order: 2,
        integral: 0.1 * PI,
        white: Excess {
            impact: 260.0,
            from_hz: 8.3,
            ratio: 3.2,
            swing: 6.0,
            rest_hz: 5.5,
        },
        filtered: FilteredExcess {
            hidden: 4.2,
            from_hz: 5.2,
            unseen: 304.0,
            beyond: 0.69,
            rest_hz: 7.3,
        },
    };
    pub(crate) const ANGULAR_VELOCITY: Self = Self {
        order: 1,
        integral: 0.388_322_207_745_093_3,
        white: Excess {
            impact: 31.0,
            from_hz: 7.0,
            ratio: 2.6,
            swing: 4.0,
            rest_hz: 5.0,
        },
        filtered: FilteredExcess {
            hidden: 3.6,
            from_hz: 5.2,
            unseen: 650.0,
            beyond: 0.98,
            rest_hz: 4.2,
        },
    };

    /// The variance with that of the motion beyond the cutoff, unit^2. Written out where it is asked for, as the order
    /// is known there.
    #[inline(always)]
    pub(crate) fn stated(self, posterior: Posterior, cutoffs: Cutoffs) -> f64 {
        let Cutoffs {
            smooth_hz,
            vigour_hz,
        } = cutoffs;
        let prior = 0.1 * f64::from(2 * self.order + 1);
        let ratio = smooth_hz / vigour_hz;
        let (noise, over_prior) = match posterior.low_passed {
            Some(_) => {
                let beyond = self
                    .filtered
                    .over_prior(smooth_hz, vigour_hz, posterior.interval);
                (1.0 - prior, beyond)
            }
            None => (
                self.noise_part(ratio),
                self.white.over_prior(smooth_hz, vigour_hz),
            ),
        };
        let noise = noise * end_noise::over_amid(self.order, ratio, smooth_hz * posterior.to_end_s);
        noise * posterior.of_noise(self.order, smooth_hz)
            + prior * over_prior * self.amid(posterior, smooth_hz)
    }

    /// Of what the spline states, for fc / fv; straight between the table's entries.
    #[inline(always)]
    fn noise_part(self, ratio: f64) -> f64 {
        let place = (ratio / NOISE_PART_STEP).min((NOISE_PARTS.len() - 1) as f64);
        let first = (place as usize).min(NOISE_PARTS.len() - 2);
        let (share, column) = (place - first as f64, self.order as usize - 1);
        NOISE_PARTS[first][column] * (1.0 - share) + NOISE_PARTS[first + 1][column] * share
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
                    to_end_s: f64::INFINITY,
                    low_passed: None,
                    excess: 1.0,
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
    fn the_parts_of_noise_are_those_of_the_response() {
        for (k, own) in NOISE_PARTS.iter().enumerate() {
            let ratio = NOISE_PART_STEP * k as f64;
            for (m, part) in [1, 2].into_iter().zip(own) {
                let (mut whole, mut noise) = (0.0, 0.0);
                for n in 1..12_000 {
                    let x = 1e-3 * f64::from(n);
                    let response = 1.0 / (1.0 + x.powi(10) + (ratio * x).powi(4));
                    whole += x.powi(2 * m) * response;
                    noise += x.powi(2 * m) * response * response;
                }
                assert!((noise / whole - part).abs() < 2e-4, "{ratio} {m}: {part}");
            }
        }
    }

    #[test]
    fn rest_and_swings_have_little_beyond_their_cutoff_and_impacts_much() {
        let kind = Beyond::ACCELERATION;
        let at = |smooth_hz: f64, vigour_hz: f64| {
            let bare = Posterior {
                variance: 0.0,
                noise: 1e-6,
                interval: 0.01,
                to_end_s: f64::INFINITY,
                low_passed: None,
                excess: 1.0,
            };
            let variance = kind.amid(bare, smooth_hz);
            let cutoffs = Cutoffs {
                smooth_hz,
                vigour_hz,
            };
            kind.stated(Posterior { variance, ..bare }, cutoffs) / variance
        };
        let (rest, swing, impact) = (at(4.5, 4.5), at(12.0, 72.0), at(12.0, 24.0));
        assert!(rest > 0.35 && rest < 0.5, "{rest}");
        // A cutoff that noise has put a little higher is still rest.
        assert!(at(5.2, 4.5) < 0.5);
        assert!(swing > 3.0 && swing < 4.0, "{swing}");
        assert!(impact > 100.0, "{impact}");
    }
}
