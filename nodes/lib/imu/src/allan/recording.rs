//! The noise of a device by its recording at rest.

use std::ops::Range;

use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::{AllanPoint, NoiseFit, NoiseModel, allan_curve};
use crate::{
    Channel, Device, Effect, EffectKind, EffectSet, ImuError, PerChannel, Reading, lattice_spacing,
};

/// Intervals between readings, in units of the usual one, from which on readings are missing.
const GAP: f64 = 1.5;
/// Fewest readings without a gap.
const FEWEST: usize = 1000;
/// How far means over a second may be from the first of them at rest, m/s2 and rad/s: slow drift of a
/// bias with the temperature is less, a device that is taken up more.
pub const MOST_MOTION: PerChannel<f64> = PerChannel {
    accelerometer: 0.5,
    gyroscope: 0.1,
};
/// Least white noise per sample, in steps of rounding, with which rounding is white noise too.
const DITHER: f64 = 0.5;

/// What a channel shows at rest.
#[derive(Clone, Debug)]
pub struct ChannelNoise {
    /// Curve and, where one can be fitted, model of each axis.
    pub axes: [(Vec<AllanPoint>, Option<NoiseFit>); 3],
    /// Mean of the axes' variances, with the degrees of freedom of all.
    pub curve: Vec<AllanPoint>,
    /// By the mean.
    pub fit: NoiseFit,
    /// Step of rounding, where all readings are multiples of one.
    pub lsb: Option<f64>,
}

/// The noise of a device at rest.
#[derive(Clone, Debug)]
pub struct StaticNoise {
    /// Readings per second.
    pub rate_hz: f64,
    /// Length of what was used, s.
    pub seconds: f64,
    /// Readings before and after a gap that were left out.
    pub left_out: usize,
    /// Of each channel.
    pub channels: PerChannel<ChannelNoise>,
}

impl StaticNoise {
    /// Of readings at rest: of the longest part in which none is missing.
    ///
    /// # Errors
    /// [`ImuError::NotStatic`] for fewer than 1000 readings, motion, and readings that stand still.
    pub fn of(stamps: &[Stamp], readings: &[Reading]) -> Result<Self, ImuError> {
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let usual = intervals.get(intervals.len() / 2).copied().unwrap_or(0.0);
        let used = longest_part(stamps, usual);
        if used.len() < FEWEST || usual <= 0.0 {
            return Err(not_static(format!(
                "{} readings without a gap; at least {FEWEST} are needed, and hours of them show bias instability",
                used.len()
            )));
        }
        let (stamps, own) = (&stamps[used.clone()], &readings[used.clone()]);
        let seconds = stamps[stamps.len() - 1] - stamps[0];
        let rate_hz = (stamps.len() - 1) as f64 / seconds;
        check_rest(stamps, own, rate_hz)?;
        Ok(Self {
            rate_hz,
            seconds,
            left_out: readings.len() - own.len(),
            channels: PerChannel {
                accelerometer: channel_noise(own, Channel::Accelerometer, rate_hz)?,
                gyroscope: channel_noise(own, Channel::Gyroscope, rate_hz)?,
            },
        })
    }

    /// A device with this noise: what is white as declared noise, the rest as effects. Biases are left
    /// out, as one run at rest does not tell how they differ from run to run.
    ///
    /// # Errors
    /// [`ImuError::NotStatic`] for noise beyond an effect's bounds.
    pub fn device(&self) -> Result<Device, ImuError> {
        let mut effects = EffectSet::new();
        for channel in Channel::ALL {
            let (own, [instability, walk, rounding]) = (&self.channels[channel], kinds(channel));
            let model = own.fit.model;
            let (deviation, time_constant) = model.instability;
            let listed = [
                (instability, vec![deviation, time_constant], deviation > 0.0),
                (walk, vec![model.walk], model.walk > 0.0),
                (
                    rounding,
                    vec![own.lsb.unwrap_or_default()],
                    own.lsb.is_some() && self.is_dithered(channel),
                ),
            ];
            for (kind, values, _) in listed.into_iter().filter(|(_, _, is_there)| *is_there) {
                let effect = Effect::new(kind, values.iter().map(|value| digits(*value)).collect());
                effects.insert(effect.map_err(|error| not_static(error.to_string()))?);
            }
        }
        let [accel, gyro] = Channel::ALL.map(|channel| digits(self.declared(channel)));
        Ok(Device::white(accel, gyro).with_effects(effects))
    }

    /// White noise less what rounding adds to it.
    fn declared(&self, channel: Channel) -> f64 {
        let own = &self.channels[channel];
        let white = own.fit.model.white;
        let rounding = match own.lsb.filter(|_| self.is_dithered(channel)) {
            Some(lsb) => lsb * lsb / 12.0 / self.rate_hz,
            None => 0.0,
        };
        (white * white - rounding).max(0.0).sqrt()
    }

    /// Whether the noise reaches over the steps of rounding, so that both can be told apart.
    fn is_dithered(&self, channel: Channel) -> bool {
        let own = &self.channels[channel];
        let per_sample = own.fit.model.white * self.rate_hz.sqrt();
        own.lsb.is_none_or(|lsb| per_sample > DITHER * lsb)
    }
}

/// Four digits: more than any recording gives.
fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn kinds(channel: Channel) -> [EffectKind; 3] {
    use EffectKind as Kind;
    match channel {
        Channel::Accelerometer => [
            Kind::AccelBiasInstability,
            Kind::AccelBiasWalk,
            Kind::AccelQuantization,
        ],
        Channel::Gyroscope => [
            Kind::GyroBiasInstability,
            Kind::GyroBiasWalk,
            Kind::GyroQuantization,
        ],
    }
}

fn not_static(problem: String) -> ImuError {
    ImuError::NotStatic { problem }
}

fn longest_part(stamps: &[Stamp], usual: f64) -> Range<usize> {
    let ends = (1..stamps.len()).filter(|k| stamps[*k] - stamps[k - 1] > GAP * usual);
    let (mut longest, mut start) = (0..0, 0);
    for end in ends.chain([stamps.len()]) {
        if end - start > longest.len() {
            longest = start..end;
        }
        start = end;
    }
    longest
}

/// Refuses readings of a device that is moved.
fn check_rest(stamps: &[Stamp], readings: &[Reading], rate_hz: f64) -> Result<(), ImuError> {
    let second = (rate_hz.round() as usize).clamp(1, readings.len());
    let mean = |part: &[Reading], channel| {
        let sum: Vector3<f64> = part.iter().map(|reading: &Reading| reading[channel]).sum();
        sum / part.len() as f64
    };
    for channel in Channel::ALL {
        let first = mean(&readings[..second], channel);
        for (k, part) in readings.chunks_exact(second).enumerate() {
            let moved = (mean(part, channel) - first).norm();
            if moved > MOST_MOTION[channel] {
                return Err(not_static(format!(
                    "not at rest: after {:.1} s the {} reads {moved:.2} {} off its start; cut the motion off",
                    stamps[k * second] - stamps[0],
                    channel.name(),
                    channel.unit()
                )));
            }
        }
    }
    Ok(())
}

fn channel_noise(
    readings: &[Reading],
    channel: Channel,
    rate_hz: f64,
) -> Result<ChannelNoise, ImuError> {
    let mut all = Vec::with_capacity(3 * readings.len());
    let axes = [0, 1, 2].map(|axis| {
        let values: Vec<f64> = readings.iter().map(|it| it[channel][axis]).collect();
        let curve = allan_curve(&values, rate_hz);
        all.extend(values);
        let fit = NoiseModel::fit(&curve);
        (curve, fit)
    });
    let pooled = |k: usize| {
        let own = [0, 1, 2].map(|axis| axes[axis].0[k]);
        let degrees: f64 = own.iter().map(|point| point.degrees_of_freedom).sum();
        let variance = own.iter().map(|point| point.deviation.powi(2)).sum::<f64>() / 3.0;
        AllanPoint::new(own[0].tau_s, variance, degrees)
    };
    let curve: Vec<AllanPoint> = (0..axes[0].0.len()).map(pooled).collect();
    let fit = NoiseModel::fit(&curve).ok_or_else(|| {
        not_static(format!(
            "the {} stands still at one value: nothing of its noise is recorded",
            channel.name()
        ))
    })?;
    let lsb = lattice_spacing(&mut all);
    Ok(ChannelNoise {
        axes,
        curve,
        fit,
        lsb,
    })
}
