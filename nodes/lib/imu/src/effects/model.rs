//! What a set of effects does to a recording.

use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Matrix3, Vector3};

use super::clock_drift::Clock;
use super::filter::SecondOrder;
use super::readout::Readout;
use super::tissue::{Tissue, Turning};
use super::warm_up::WarmUp;
use super::wave::SpectralLine;
use super::{
    DeclaredNoise, Effect, EffectKind, EffectSet, Reading, gravity_convention, lever_arm, low_pass,
    mount_rotation, mount_slip, reference_tilt,
};
use crate::{Channel, GRAVITY_IN_WORLD, PerChannel};

/// Both channels on a uniform grid of true time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridTrace {
    /// Time of the first entry.
    pub start: Stamp,
    /// Entries per second.
    pub rate_hz: f64,
    /// Specific force, m/s2.
    pub specific_force: Vec<Vector3<f64>>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec<Vector3<f64>>,
}

/// The deterministic part of an [`EffectSet`], ready to run: what each [`super::Stage`] of the
/// measurement model does to a recording. [`super::Stage::ORDER`] says in which order, and
/// [`SensorModel::measure`] and [`super::StagedReadings`] follow it.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {
    pub(super) epoch: Stamp,
    /// `c T g`, in the reported world.
    pub(super) gravity: Vector3<f64>,
    /// 1 over the factor on positions of the reference: of scale and units.
    pub(super) inverse_scale: f64,
    pub(super) lever_arm: Option<Vector3<f64>>,
    pub(super) tissue: Option<Tissue>,
    /// `M R_mount^T`.
    pub(super) sensor_from_segment: Option<Matrix3<f64>>,
    /// Seconds from the epoch, and `M (R_mount R_slip)^T`.
    pub(super) slip: Option<(f64, Matrix3<f64>)>,
    /// G.
    pub(super) coupling: Option<Matrix3<f64>>,
    pub(super) low_pass: PerChannel<Option<SecondOrder>>,
    pub(super) vibration: Option<SpectralLine>,
    pub(super) clock: Clock,
    /// Of the gyroscope against the accelerometer, s.
    pub(super) channel_delay: f64,
    pub(super) warm_up: Option<WarmUp>,
    pub(super) accelerometer: Readout,
    pub(super) gyroscope: Readout,
}

impl SensorModel {
    /// Parses effects once; what depends on time is anchored at the epoch.
    pub fn new(effects: &EffectSet, epoch: Stamp) -> Self {
        use EffectKind as Kind;
        let vector = |kind, index| effects.get(kind).map(|effect| effect.vector(index));
        let scalar = |kind| effects.get(kind).map(|effect| effect.scalar(0));
        let mount = vector(Kind::MountRotation, 0)
            .map(|rotvec| mount_rotation::sensor_from_segment(&rotvec));
        let axes = effects.get(Kind::AxisConvention).map(Effect::matrix);
        let sensor_from_segment = match (axes, mount) {
            (Some(axes), Some(mount)) => Some(axes * mount),
            (axes, mount) => axes.or(mount),
        };
        let slipped = |slip: &Effect| {
            // M (R_mount R_slip)^T = M R_slip^T R_mount^T
            let turned = mount_rotation::sensor_from_segment(&slip.vector(1))
                * mount.unwrap_or_else(Matrix3::identity);
            (
                mount_slip::since(epoch, slip.scalar(0)),
                axes.unwrap_or_else(Matrix3::identity) * turned,
            )
        };
        let mode = scalar(Kind::GravityConvention).unwrap_or(0.0);
        let gravity = vector(Kind::ReferenceTilt, 0)
            .map_or(GRAVITY_IN_WORLD, |rotvec| reference_tilt::gravity(&rotvec));
        Self {
            epoch,
            gravity: gravity * gravity_convention::gravity_factor(mode),
            inverse_scale: scalar(Kind::ReferenceScale).map_or(1.0, f64::recip)
                / effects.length_factor(),
            lever_arm: vector(Kind::LeverArm, 0),
            tissue: effects
                .get(Kind::SoftTissue)
                .and_then(|effect| filter(effect, effect.scalar(1)))
                .map(|filter| Tissue { filter }),
            sensor_from_segment,
            slip: effects.get(Kind::MountSlip).map(slipped),
            coupling: effects.get(Kind::GyroGSensitivity).map(Effect::matrix),
            low_pass: PerChannel::from_fn(|channel| {
                let own = match channel {
                    Channel::Accelerometer => Kind::AccelLowPass,
                    Channel::Gyroscope => Kind::GyroLowPass,
                };
                let effect = effects.get(own).or_else(|| effects.get(Kind::LowPass))?;
                filter(effect, low_pass::DAMPING_RATIO)
            }),
            vibration: effects.get(Kind::Vibration).and_then(Effect::spectral_line),
            clock: Clock::of(effects),
            channel_delay: scalar(Kind::ChannelDelay).unwrap_or(0.0),
            warm_up: WarmUp::new(effects),
            accelerometer: Readout::new(effects, Channel::Accelerometer),
            gyroscope: Readout::new(effects, Channel::Gyroscope),
        }
    }

    /// [`super::Stage::Segment`]: specific force of the segment at the lever arm, with tilt, scale
    /// and units of the reference undone; segment axes: `f = a / s + alpha x l + w x (w x l) - c R^T T g`, c = 1, 0 (removed) or
    /// -1 (negated).
    pub(super) fn segment(&self, track: &KinematicTrack) -> GridTrace {
        let motion = track
            .acceleration_in_segment
            .iter()
            .zip(&track.world_from_segment);
        let mut specific_force: Vec<Vector3<f64>> = motion
            .map(|(acceleration, world_from_segment)| {
                acceleration * self.inverse_scale
                    - world_from_segment.inverse_transform_vector(&self.gravity)
            })
            .collect();
        if let Some(offset) = &self.lever_arm {
            for ((specific_force, angular_velocity), angular_acceleration) in specific_force
                .iter_mut()
                .zip(&track.angular_velocity_in_segment)
                .zip(&track.angular_acceleration_in_segment)
            {
                *specific_force +=
                    lever_arm::acceleration(offset, angular_velocity, angular_acceleration);
            }
        }
        GridTrace {
            start: track.start,
            rate_hz: track.rate_hz,
            specific_force,
            angular_velocity: track.angular_velocity_in_segment.clone(),
        }
    }

    /// [`super::Stage::Tissue`]: soft tissue under the sensor, on the specific force alone; `motion` is
    /// that of the trace.
    pub(super) fn tissue(&self, mut trace: GridTrace, motion: &KinematicTrack) -> GridTrace {
        if let Some(tissue) = &self.tissue {
            let turning = |k: usize| Turning {
                velocity: motion.angular_velocity_in_segment[k],
                acceleration: motion.angular_acceleration_in_segment[k],
            };
            tissue.apply(&mut trace.specific_force, turning, trace.rate_hz);
        }
        trace
    }

    /// [`super::Stage::Sensor`]: mount, axes, coupling and low-pass, without the vibration; sensor
    /// axes.
    ///
    /// Where the mount slips, the axes stay the segment's and [`SensorModel::sample`] turns and
    /// couples each reading: all of these are linear and constant but for the slip, so their order
    /// does not matter but for what the low-pass remembers across it.
    pub(super) fn sensor(&self, mut trace: GridTrace) -> GridTrace {
        if self.slip.is_none() && (self.sensor_from_segment.is_some() || self.coupling.is_some()) {
            for (specific_force, angular_velocity) in trace
                .specific_force
                .iter_mut()
                .zip(&mut trace.angular_velocity)
            {
                let turned = self.turned(
                    self.sensor_from_segment.as_ref(),
                    &Reading {
                        specific_force: *specific_force,
                        angular_velocity: *angular_velocity,
                    },
                );
                (*specific_force, *angular_velocity) =
                    (turned.specific_force, turned.angular_velocity);
            }
        }
        if let Some(filter) = &self.low_pass.accelerometer {
            filter.apply(&mut trace.specific_force, trace.rate_hz);
        }
        if let Some(filter) = &self.low_pass.gyroscope {
            filter.apply(&mut trace.angular_velocity, trace.rate_hz);
        }
        trace
    }

    /// A reading in sensor axes, with the coupling.
    #[inline]
    pub(super) fn turned(
        &self,
        sensor_from_segment: Option<&Matrix3<f64>>,
        reading: &Reading,
    ) -> Reading {
        let Reading {
            mut specific_force,
            mut angular_velocity,
        } = *reading;
        if let Some(turn) = sensor_from_segment {
            (specific_force, angular_velocity) = (turn * specific_force, turn * angular_velocity);
        }
        if let Some(coupling) = &self.coupling {
            angular_velocity += coupling * specific_force;
        }
        Reading {
            specific_force,
            angular_velocity,
        }
    }

    /// Adds a vibration, with what the gyroscope feels of it.
    #[inline]
    pub(super) fn shake(&self, line: &SpectralLine, reading: &mut Reading, seconds: f64) {
        let shaken = line.at(seconds);
        reading.specific_force += shaken.specific_force;
        reading.angular_velocity += shaken.angular_velocity;
        if let Some(coupling) = &self.coupling {
            reading.angular_velocity += coupling * shaken.specific_force;
        }
    }

    /// [`super::Stage::Linear`]: scale, misalignment, bias, drift and temperature.
    pub(super) fn linear(&self, readings: &mut [Reading], stamps: &[Stamp]) {
        for (reading, stamp) in readings.iter_mut().zip(stamps) {
            let seconds = self.clock.true_seconds(*stamp - self.epoch);
            *reading = self.linear_reading(reading, seconds);
        }
    }

    /// The same of one channel.
    pub(super) fn linear_one(&self, channel: Channel, readings: &mut [Reading], stamps: &[Stamp]) {
        for (reading, stamp) in readings.iter_mut().zip(stamps) {
            let seconds = self.clock.true_seconds(*stamp - self.epoch);
            reading[channel] = self.linear_value(channel, reading, seconds);
        }
    }

    /// The same for one reading, true seconds since the epoch.
    #[inline]
    pub(super) fn linear_reading(&self, reading: &Reading, seconds: f64) -> Reading {
        Reading {
            specific_force: self.linear_value(Channel::Accelerometer, reading, seconds),
            angular_velocity: self.linear_value(Channel::Gyroscope, reading, seconds),
        }
    }

    #[inline]
    fn linear_value(&self, channel: Channel, reading: &Reading, seconds: f64) -> Vector3<f64> {
        let readout = match channel {
            Channel::Accelerometer => &self.accelerometer,
            Channel::Gyroscope => &self.gyroscope,
        };
        let value = readout.linear(&reading[channel], seconds);
        match &self.warm_up {
            Some(warm_up) => value + warm_up.bias(seconds)[channel],
            None => value,
        }
    }

    /// White noise of the readings: the declared and what effects add to it; variances add.
    pub fn total_noise(&self, declared: &DeclaredNoise) -> DeclaredNoise {
        DeclaredNoise {
            accel_density: declared.accel_density.hypot(self.accelerometer.density),
            gyro_density: declared.gyro_density.hypot(self.gyroscope.density),
        }
    }

    /// [`super::Stage::Digital`]: saturation, quantisation and units, after the noise.
    pub(super) fn digital(&self, readings: &mut [Reading]) {
        for reading in readings {
            *reading = self.digital_reading(reading);
        }
    }

    /// The same of one reading.
    #[inline]
    pub(super) fn digital_reading(&self, reading: &Reading) -> Reading {
        Reading {
            specific_force: self.accelerometer.digital(&reading.specific_force),
            angular_velocity: self.gyroscope.digital(&reading.angular_velocity),
        }
    }
}

/// A filter, but for cutoffs so high that it changes nothing.
fn filter(effect: &Effect, damping_ratio: f64) -> Option<SecondOrder> {
    let natural_hz = effect.scalar(0);
    let neutral = effect.kind().spec().parameters[0].neutral[0];
    (natural_hz < neutral).then_some(SecondOrder {
        natural_hz,
        damping_ratio,
    })
}
