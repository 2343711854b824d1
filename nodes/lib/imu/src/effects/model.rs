//! What a set of effects does to a recording.

use std::f64::consts::TAU;

use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Matrix3, Vector3};

use super::clock_drift::Clock;
use super::filter::SecondOrder;
use super::vibration::SpectralLine;
use super::{
    Effect, EffectKind, EffectSet, Reading, gravity_convention, lever_arm, low_pass, misalignment,
    mount_rotation, mount_slip, quantization, reference_tilt, sampling, saturation,
};
use crate::GRAVITY_IN_WORLD;

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

/// The deterministic part of an [`EffectSet`], ready to run; the stages in the order of the
/// measurement model, see [`crate::effects`].
///
/// ```text
/// segment -> tissue -> sensor -> read -> linear -> (white noise) -> digital
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {
    pub(super) epoch: Stamp,
    /// `c T g`, in the reported world.
    pub(super) gravity: Vector3<f64>,
    pub(super) inverse_scale: f64,
    pub(super) lever_arm: Option<Vector3<f64>>,
    pub(super) tissue: Option<SecondOrder>,
    /// `M R_mount^T`.
    pub(super) sensor_from_segment: Option<Matrix3<f64>>,
    /// Seconds from the epoch, and `M (R_mount R_slip)^T`.
    pub(super) slip: Option<(f64, Matrix3<f64>)>,
    /// G.
    pub(super) coupling: Option<Matrix3<f64>>,
    pub(super) low_pass: Option<SecondOrder>,
    pub(super) vibration: Option<SpectralLine>,
    pub(super) clock: Clock,
    pub(super) accelerometer: Readout,
    pub(super) gyroscope: Readout,
}

/// The last two stages of one channel: linear errors, and those of its converter and driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Readout {
    /// `diag(scale) (I + upper)`.
    matrix: Option<Matrix3<f64>>,
    bias: Vector3<f64>,
    drift: Vector3<f64>,
    density: f64,
    limit: f64,
    lsb: f64,
    factor: f64,
}

impl Readout {
    fn new(
        effects: &EffectSet,
        [bias, scale, misaligned, noise, drift, limit, lsb, factor]: [EffectKind; 8],
    ) -> Self {
        let scalar = |kind: EffectKind| {
            effects
                .get(kind)
                .map_or(kind.spec().parameters[0].neutral[0], |effect| {
                    effect.scalar(0)
                })
        };
        let vector = |kind| effects.get(kind).map(|effect| effect.vector(0));
        let gains = vector(scale).map(|scale| Matrix3::from_diagonal(&scale));
        let cross = vector(misaligned).map(|upper| misalignment::matrix(&upper));
        let matrix = match (gains, cross) {
            (Some(gains), Some(cross)) => Some(gains * cross),
            (gains, cross) => gains.or(cross),
        };
        let [density, limit, lsb, factor] = [noise, limit, lsb, factor].map(scalar);
        Self {
            matrix,
            bias: vector(bias).unwrap_or_default(),
            drift: vector(drift).unwrap_or_default(),
            density,
            limit,
            lsb,
            factor,
        }
    }

    /// 7.
    #[inline]
    pub(super) fn linear(&self, value: &Vector3<f64>, seconds: f64) -> Vector3<f64> {
        self.matrix.map_or(*value, |matrix| matrix * value) + self.bias + self.drift * seconds
    }

    /// 8, after the noise.
    #[inline]
    pub(super) fn digital(&self, value: &Vector3<f64>) -> Vector3<f64> {
        value.map(|value| {
            quantization::round(saturation::clip(value, self.limit), self.lsb) * self.factor
        })
    }
}

impl SensorModel {
    /// Parses effects once; what depends on time is anchored at the epoch.
    pub fn new(effects: &EffectSet, epoch: Stamp) -> Self {
        use EffectKind as Kind;
        let vector = |kind, index| effects.get(kind).map(|effect| effect.vector(index));
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
        let mode = effects
            .get(Kind::GravityConvention)
            .map_or(0.0, |effect| effect.scalar(0));
        let gravity = vector(Kind::ReferenceTilt, 0)
            .map_or(GRAVITY_IN_WORLD, |rotvec| reference_tilt::gravity(&rotvec));
        Self {
            epoch,
            gravity: gravity * gravity_convention::gravity_factor(mode),
            inverse_scale: effects
                .get(Kind::ReferenceScale)
                .map_or(1.0, |effect| effect.scalar(0).recip()),
            lever_arm: vector(Kind::LeverArm, 0),
            tissue: effects
                .get(Kind::SoftTissue)
                .and_then(|effect| filter(effect, effect.scalar(1), true)),
            sensor_from_segment,
            slip: effects.get(Kind::MountSlip).map(slipped),
            coupling: effects.get(Kind::GyroGSensitivity).map(Effect::matrix),
            low_pass: effects
                .get(Kind::LowPass)
                .and_then(|effect| filter(effect, low_pass::DAMPING_RATIO, false)),
            vibration: effects.get(Kind::Vibration).and_then(Effect::spectral_line),
            clock: Clock {
                offset: effects
                    .get(Kind::TimeOffset)
                    .map_or(0.0, |effect| effect.scalar(0)),
                ppm: effects
                    .get(Kind::ClockDrift)
                    .map_or(0.0, |effect| effect.scalar(0)),
            },
            accelerometer: Readout::new(
                effects,
                [
                    Kind::AccelBias,
                    Kind::AccelScale,
                    Kind::AccelMisalignment,
                    Kind::AccelNoise,
                    Kind::AccelBiasDrift,
                    Kind::AccelSaturation,
                    Kind::AccelQuantization,
                    Kind::AccelUnits,
                ],
            ),
            gyroscope: Readout::new(
                effects,
                [
                    Kind::GyroBias,
                    Kind::GyroScale,
                    Kind::GyroMisalignment,
                    Kind::GyroNoise,
                    Kind::GyroBiasDrift,
                    Kind::GyroSaturation,
                    Kind::GyroQuantization,
                    Kind::GyroUnits,
                ],
            ),
        }
    }

    /// Specific force of the segment at the lever arm, with tilt and scale of the reference undone
    /// (1); segment axes: `f = a / s + alpha x l + w x (w x l) - c R^T T g`, c = 1, 0 (removed) or
    /// -1 (negated).
    pub fn segment(&self, track: &KinematicTrack) -> GridTrace {
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

    /// Soft tissue under the sensor (2): on the specific force alone.
    pub fn tissue(&self, mut trace: GridTrace) -> GridTrace {
        if let Some(filter) = &self.tissue {
            filter.apply(&mut trace.specific_force, trace.rate_hz);
        }
        trace
    }

    /// Mount and axes (3), coupling (5) and low-pass (6), without the vibration; sensor axes.
    ///
    /// Where the mount slips, the axes stay the segment's and [`SensorModel::read`] turns and
    /// couples each reading: all of these are linear and constant but for the slip, so their order
    /// does not matter but for what the low-pass remembers across it.
    pub fn sensor(&self, mut trace: GridTrace) -> GridTrace {
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
        if let Some(filter) = &self.low_pass {
            filter.apply(&mut trace.specific_force, trace.rate_hz);
            filter.apply(&mut trace.angular_velocity, trace.rate_hz);
        }
        trace
    }

    /// 3 and 5.
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

    /// Readings at the true times of the stamps (9), with the vibration (4) in closed form; `trace`
    /// is that of [`SensorModel::sensor`]. Before and after the grid its ends are held.
    pub fn read(&self, trace: &GridTrace, stamps: &[Stamp]) -> Vec<Reading> {
        let start = trace.start - self.epoch;
        let vibration = self.vibration.map(|line| match &self.low_pass {
            Some(filter) => line.filtered(low_pass::response(filter.natural_hz, line.hz)),
            None => line,
        });
        let slip = self
            .slip
            .map(|(at, after)| Slip::new(self, trace, start, at, after));
        let read = |stamp: &Stamp| {
            let seconds = self.clock.true_seconds(*stamp - self.epoch);
            let position = (seconds - start) * trace.rate_hz;
            let mut reading = match sampling::GridPosition::at(
                position,
                trace.specific_force.len().min(trace.angular_velocity.len()),
            ) {
                Some(nodes) => Reading {
                    specific_force: nodes.interpolate(&trace.specific_force),
                    angular_velocity: nodes.interpolate(&trace.angular_velocity),
                },
                None => Reading {
                    specific_force: sampling::interpolate(&trace.specific_force, position),
                    angular_velocity: sampling::interpolate(&trace.angular_velocity, position),
                },
            };
            if let Some(slip) = &slip {
                reading = slip.turn(self, &reading, seconds);
            }
            if let Some(line) = &vibration {
                let specific_force = line.at(seconds);
                reading.specific_force += specific_force;
                if let Some(coupling) = &self.coupling {
                    reading.angular_velocity += coupling * specific_force;
                }
            }
            reading
        };
        stamps.iter().map(read).collect()
    }

    /// Scale, misalignment, bias and drift (7).
    pub fn linear(&self, readings: &mut [Reading], stamps: &[Stamp]) {
        for (reading, stamp) in readings.iter_mut().zip(stamps) {
            let seconds = self.clock.true_seconds(*stamp - self.epoch);
            reading.specific_force = self.accelerometer.linear(&reading.specific_force, seconds);
            reading.angular_velocity = self.gyroscope.linear(&reading.angular_velocity, seconds);
        }
    }

    /// White noise beyond the declared, (m/s2)/sqrt(Hz) and (rad/s)/sqrt(Hz); variances add.
    pub fn noise_density(&self) -> (f64, f64) {
        (self.accelerometer.density, self.gyroscope.density)
    }

    /// Saturation, quantisation and units (8, after the noise).
    pub fn digital(&self, readings: &mut [Reading]) {
        for reading in readings {
            reading.specific_force = self.accelerometer.digital(&reading.specific_force);
            reading.angular_velocity = self.gyroscope.digital(&reading.angular_velocity);
        }
    }

    /// All stages without noise.
    pub fn run(&self, track: &KinematicTrack, stamps: &[Stamp]) -> Vec<Reading> {
        let trace = self.sensor(self.tissue(self.segment(track)));
        let mut readings = self.read(&trace, stamps);
        self.linear(&mut readings, stamps);
        self.digital(&mut readings);
        readings
    }
}

/// A filter, but for cutoffs so high that it changes nothing.
fn filter(effect: &Effect, damping_ratio: f64, base: bool) -> Option<SecondOrder> {
    let natural_hz = effect.scalar(0);
    let neutral = effect.kind().spec().parameters[0].neutral[0];
    (natural_hz < neutral).then_some(SecondOrder {
        natural_hz,
        damping_ratio,
        base,
    })
}

/// A slip while sampling. The low-pass y of `u_1` before and `u_2` after the slip is that of `u_2`
/// plus the decay of `y_1 - y_2`, both of which are the low-passed segment's in other axes.
struct Slip {
    at: f64,
    before: Matrix3<f64>,
    after: Matrix3<f64>,
    /// Low-passed reading at the slip in segment axes, and its derivative per second.
    memory: Option<(SecondOrder, Reading, Reading)>,
}

impl Slip {
    fn new(
        model: &SensorModel,
        trace: &GridTrace,
        start: f64,
        at: f64,
        after: Matrix3<f64>,
    ) -> Self {
        let position = ((at - start) * trace.rate_hz)
            .clamp(0.0, trace.specific_force.len().saturating_sub(1) as f64);
        let of = |sample: fn(&[Vector3<f64>], f64) -> Vector3<f64>, factor: f64| Reading {
            specific_force: sample(&trace.specific_force, position) * factor,
            angular_velocity: sample(&trace.angular_velocity, position) * factor,
        };
        let memory = model.low_pass.map(|filter| {
            (
                filter,
                of(sampling::interpolate, 1.0),
                of(sampling::derivative, trace.rate_hz),
            )
        });
        Self {
            at,
            before: model.sensor_from_segment.unwrap_or_else(Matrix3::identity),
            after,
            memory,
        }
    }

    fn turn(&self, model: &SensorModel, reading: &Reading, seconds: f64) -> Reading {
        if seconds < self.at {
            return model.turned(Some(&self.before), reading);
        }
        let mut turned = model.turned(Some(&self.after), reading);
        if let Some((filter, value, derivative)) = &self.memory {
            let since = seconds - self.at;
            // Ten time constants later nothing is left.
            if since * TAU * filter.natural_hz < 60.0 {
                let decay = Reading {
                    specific_force: filter.homogeneous(
                        since,
                        &value.specific_force,
                        &derivative.specific_force,
                    ),
                    angular_velocity: filter.homogeneous(
                        since,
                        &value.angular_velocity,
                        &derivative.angular_velocity,
                    ),
                };
                let (old, new) = (
                    model.turned(Some(&self.before), &decay),
                    model.turned(Some(&self.after), &decay),
                );
                turned.specific_force += old.specific_force - new.specific_force;
                turned.angular_velocity += old.angular_velocity - new.angular_velocity;
            }
        }
        turned
    }
}
