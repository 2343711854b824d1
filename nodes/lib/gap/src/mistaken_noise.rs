//! Whether a residual may be noise of the reference that its filters take for motion.
//!
//! With the motion S and the noise N the simulation holds `X = S + N`, in a band, and the residual is -N: a factor
//! `g = S / X` on the simulation lowers its power `(1 - g) X` to `g (1 - g) X`, and no factor lowers it further. Where nearly all is
//! motion the factor is one within its error, and says nothing; noise with a memory of the first order is at most f^-2 times as
//! dense there as in the lowest band that tells.

use cromosim_imu::Channel;

use crate::beside_response::{left_behind, of_reference, whitened_blocks, whitened_simulation};
use crate::fit::{Fit, FitModel};
use crate::location::Loudness;
use crate::policy::beside_response::MOST_LEFT_BY_NOISE;
use crate::response::{BANDS, Bands, Block, EDGES_HZ, WINDOW_S, factors};
use crate::trace::trace;

/// What is slower is motion, Hz.
const SLOWEST_HZ: f64 = 0.5;

/// One band, in units of the predicted noise.
#[derive(Clone, Copy, Debug)]
struct BandRest {
    /// On the simulation; one where noise does not go with it.
    factor: f64,
    /// Mean square of the simulation.
    simulated: f64,
    /// Mean square of the residual behind the factor.
    left: f64,
    /// The most that f^-2 makes of noise that is told elsewhere, as far as a channel feels it, in proportion.
    growth: f64,
}

/// Largest mean square of a channel's whitened residual in a band, less what such noise may leave; none where no window
/// is whole.
pub(crate) fn loudest_beside_noise(model: &FitModel, fit: &Fit, channel: Channel) -> Option<f64> {
    let bands = Bands::new(model.prepared.rate_hz, WINDOW_S, &EDGES_HZ);
    let simulated = whitened_simulation(model, fit);
    let blocks = whitened_blocks(model, &bands, channel, &simulated, &fit.residual);
    let largest = [1.0; BANDS];
    let may_be = of_reference(model, &bands, channel, (&blocks, &largest));
    let own = factors(&blocks, &largest, None);
    let of_band = |band: usize| {
        let sum = |of: fn(&Block) -> &[f64; BANDS]| -> f64 {
            blocks.iter().map(|block| of(block)[band]).sum()
        };
        let unit = sum(|block| &block.entries) * bands.power_of_one();
        let factor = if may_be[band] { own[band] } else { 1.0 };
        let range_hz = bands.range_hz(band);
        (unit > 0.0).then(|| BandRest {
            factor,
            simulated: sum(|block| &block.simulated) / unit,
            left: left_behind(&blocks, band, factor) / unit,
            growth: of_memory(channel, range_hz) / mean_predicted(model, channel, range_hz),
        })
    };
    let mut rests: Vec<BandRest> = (0..BANDS).filter_map(of_band).collect();
    if rests.is_empty() {
        return None;
    }
    // Slower and faster the simulation is not looked at.
    let prepared = model.prepared;
    let loudness = Loudness::new(&fit.residual, prepared, &model.whitener, channel);
    let bare = |[from_hz, to_hz]: [f64; 2]| BandRest {
        factor: 1.0,
        simulated: 0.0,
        left: loudness.between(from_hz, to_hz),
        growth: of_memory(channel, [from_hz, to_hz])
            / mean_predicted(model, channel, [from_hz, to_hz]),
    };
    rests.insert(0, bare([SLOWEST_HZ, EDGES_HZ[0]]));
    let fastest_hz = prepared.rate_hz / 2.0;
    if fastest_hz > EDGES_HZ[BANDS] {
        rests.push(bare([EDGES_HZ[BANDS], fastest_hz]));
    }
    trace(|| eprintln!("beside mistaken noise {channel:?} {rests:.3?}"));
    loudest(&rests)
}

/// Of bands from the lowest on.
fn loudest(rests: &[BandRest]) -> Option<f64> {
    let mut told = 0.0;
    let level = |rest: &BandRest| {
        let noise = (1.0 - rest.factor) * rest.simulated;
        let of_noise = if noise > 0.0 {
            told = noise / rest.growth;
            rest.factor * noise
        } else {
            told * rest.growth
        };
        rest.left - MOST_LEFT_BY_NOISE * of_noise
    };
    rests.iter().rev().map(level).reduce(f64::max)
}

/// Predicted noise between two frequencies: the variance of white noise as dense.
fn mean_predicted(model: &FitModel, channel: Channel, [from_hz, to_hz]: [f64; 2]) -> f64 {
    let power = &model.noise.power[channel];
    let place = |hz: f64| ((hz / model.noise.spacing_hz) as usize).min(power.len() - 1);
    let own = &power[place(from_hz)..=place(to_hz)];
    own.iter().sum::<f64>() / own.len() as f64
}

/// How noise of poses that falls as f^-2 grows with the frequency in what a channel feels of it: the position's second
/// derivative, the rotation's first.
fn of_memory(channel: Channel, [from_hz, to_hz]: [f64; 2]) -> f64 {
    match channel {
        Channel::Accelerometer => (0.5 * (from_hz + to_hz)).powi(2),
        Channel::Gyroscope => 1.0,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Motion that falls steeply over bands around 1.5 to 9 Hz, with noise of position that falls as f^-1.8 beneath, as an
    /// accelerometer feels both; the predicted noise is level.
    fn rests(noise: impl Fn(f64) -> f64) -> Vec<BandRest> {
        [1.5, 2.5, 3.5, 5.0, 7.0, 9.0]
            .into_iter()
            .map(|hz: f64| {
                let (motion, noise) = (4e6 * hz.powi(-5), noise(hz));
                // As it is told where it is more than a hundredth.
                let factor = motion / (motion + noise);
                let factor = if factor > 0.99 { 1.0 } else { factor };
                let more = factor - 1.0;
                BandRest {
                    factor,
                    simulated: motion + noise,
                    left: noise + 2.0 * more * noise + more * more * (motion + noise),
                    growth: hz * hz,
                }
            })
            .collect()
    }

    #[test]
    fn what_noise_leaves_is_none_of_what_is_left() {
        let of_noise = rests(|hz| 60.0 * hz.powf(2.2));
        let before = of_noise.iter().map(|rest| rest.left).fold(0.0, f64::max);
        let left = loudest(&of_noise).unwrap();
        assert!(before > 200.0 && left < 1.0, "{before} {left}");
        assert_eq!(loudest(&[]), None);
    }

    #[test]
    fn what_is_louder_or_goes_with_nothing_stays() {
        let mut louder = rests(|hz| 60.0 * hz.powf(2.2));
        louder[0].left *= 3.0;
        assert!(loudest(&louder).unwrap() > 200.0);
        // Such a residual beside a simulation that is all motion.
        let beside: Vec<BandRest> = rests(|_| 300.0)
            .into_iter()
            .map(|rest| BandRest {
                factor: 1.0,
                left: 300.0,
                ..rest
            })
            .collect();
        assert_eq!(loudest(&beside), Some(300.0));
    }
}
