//! Smoothing of poses without phase, and the gain that undoes it.

use std::f64::consts::{LN_2, PI};

/// Part of the rate at which the bilinear transform's frequency is held, short of one half, where its
/// tangent has no bound.
const HELD_FROM: f64 = 0.499;

/// Shape of a zero-phase smoothing over the frequency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmoothingKernel {
    /// Butterworth's filter of an order, forwards and backwards: half of the amplitude is left at the
    /// cutoff. A smoothing spline of degree 2 n - 1 is one of order n.
    Butterworth {
        /// Order of the filter that is run in each direction.
        order: u8,
    },
    /// A Gaussian: half of the power is left at the cutoff.
    Gaussian,
}

impl SmoothingKernel {
    /// Butterworth's filter of the second order.
    pub const SECOND_ORDER: Self = Self::Butterworth { order: 2 };
}

/// A zero-phase smoothing of poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroPhaseSmoothing {
    /// Cutoff, Hz.
    pub cutoff_hz: f64,
    /// Shape.
    pub kernel: SmoothingKernel,
}

impl ZeroPhaseSmoothing {
    /// Gain that undoes it in poses at `rate_hz`: `1 + (f / fc)^(2 n)` for Butterworth's filter of order n, with
    /// the frequencies as the bilinear transform bends them, `2^((f / fc)^2 / 2)` for the Gaussian.
    pub fn undoing_gain(&self, frequency_hz: f64, rate_hz: f64) -> f64 {
        match self.kernel {
            SmoothingKernel::Butterworth { order } => {
                let bent = |hz: f64| (PI * (hz / rate_hz).min(HELD_FROM)).tan();
                1.0 + (bent(frequency_hz) / bent(self.cutoff_hz)).powi(2 * i32::from(order))
            }
            SmoothingKernel::Gaussian => {
                (0.5 * LN_2 * (frequency_hz / self.cutoff_hz).powi(2)).exp()
            }
        }
    }
}

/// The gain that undoes a smoothing; 1 where none is undone.
pub(crate) fn undoing_gain(
    frequency_hz: f64,
    undone: Option<ZeroPhaseSmoothing>,
    rate_hz: f64,
) -> f64 {
    undone.map_or(1.0, |smoothing| {
        smoothing.undoing_gain(frequency_hz, rate_hz)
    })
}
