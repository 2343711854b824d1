//! Effects on live samples.

use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::dropped_samples::Dropouts;
use super::filter::Streamed;
use super::{EffectKind, Reading, SensorModel, lever_arm};
use crate::{Device, ImuError, ImuSample, KinematicSample, NoiseSource};

/// A device's effects and white noise on samples as they come; the stages of [`SensorModel`],
/// sample by sample.
///
/// The epoch is the first sample's stamp. Filters take the input as straight between the samples,
/// so they need no look-ahead; where the samples carry no angular acceleration, the difference from
/// the sample before stands for it.
#[derive(Clone, Debug)]
pub struct StreamingEffects {
    device: Device,
    rate_hz: f64,
    /// None before the first sample.
    model: Option<SensorModel>,
    noise: Option<NoiseSource>,
    dropouts: Option<Dropouts>,
    tissue: Option<Streamed>,
    low_pass: Option<[Streamed; 2]>,
    /// Stamp and angular velocity (segment axes) of the sample before.
    previous: Option<(Stamp, Vector3<f64>)>,
}

impl StreamingEffects {
    /// The effects of one placement's device, for samples at a rate. Seed and name make the noise
    /// and the losses.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] for a rate that is not positive.
    pub fn new(
        device: &Device,
        rate_hz: f64,
        seed: u64,
        placement: &str,
    ) -> Result<Self, ImuError> {
        let model = SensorModel::new(device.effects(), Stamp::default());
        let beyond = model.noise_density();
        let densities = (
            device.accel_density().hypot(beyond.0),
            device.gyro_density().hypot(beyond.1),
        );
        Ok(Self {
            device: device.clone(),
            rate_hz,
            noise: Some(NoiseSource::white(
                densities,
                device.orientation_stddev(),
                rate_hz,
                seed,
                placement,
            )?),
            dropouts: Dropouts::new(
                device.effects().get(EffectKind::DroppedSamples),
                seed,
                placement,
            ),
            tissue: model.tissue.map(Streamed::new),
            low_pass: model
                .low_pass
                .map(|filter| [filter, filter].map(Streamed::new)),
            model: None,
            previous: None,
        })
    }

    /// Without the random part: no noise, no losses.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self {
            noise: None,
            dropouts: None,
            ..self
        }
    }

    /// Begins anew with the next sample, which is the new epoch: for sources that jump back in
    /// time. Noise and losses go on.
    pub fn reset(&mut self) {
        self.model = None;
        self.forget();
    }

    /// Filters begin anew.
    fn forget(&mut self) {
        self.previous = None;
        self.tissue
            .iter_mut()
            .chain(self.low_pass.iter_mut().flatten())
            .for_each(Streamed::reset);
    }

    /// The device's reading of a sample, by the device's own clock; none where it is lost. One call
    /// a sample, in order of time; after a pause of more than ten intervals the filters begin anew.
    pub fn step(&mut self, sample: &KinematicSample) -> Option<ImuSample> {
        let model = match self.model.take() {
            Some(model) => model,
            None => SensorModel::new(self.device.effects(), sample.stamp),
        };
        let reading = self.reading(&model, sample);
        let lost = self.dropouts.as_mut().is_some_and(Dropouts::next_is_lost);
        self.model = Some(model);
        (!lost).then_some(reading)
    }

    fn reading(&mut self, model: &SensorModel, sample: &KinematicSample) -> ImuSample {
        let seconds = sample.stamp - model.epoch;
        let interval = self.previous.map_or(0.0, |(stamp, _)| sample.stamp - stamp);
        if !(0.0..=10.0 / self.rate_hz).contains(&interval) {
            self.forget();
        }
        let mut segment = self.segment(model, sample);
        if let Some(filter) = &mut self.tissue {
            segment.specific_force = filter.push(segment.specific_force, interval);
        }
        let sensor_from_segment = model
            .slip
            .filter(|(at, _)| seconds >= *at)
            .map(|(_, after)| after)
            .or(model.sensor_from_segment);
        let mut reading = model.turned(sensor_from_segment.as_ref(), &segment);
        if let Some(line) = &model.vibration {
            let specific_force = line.at(seconds);
            reading.specific_force += specific_force;
            reading.angular_velocity += model
                .coupling
                .map_or_else(Vector3::zeros, |coupling| coupling * specific_force);
        }
        if let Some([specific_force, angular_velocity]) = &mut self.low_pass {
            reading = Reading {
                specific_force: specific_force.push(reading.specific_force, interval),
                angular_velocity: angular_velocity.push(reading.angular_velocity, interval),
            };
        }
        let mut world_from_sensor =
            sample.world_from_sensor.rotation * orientation(sensor_from_segment.as_ref());
        reading = Reading {
            specific_force: model.accelerometer.linear(&reading.specific_force, seconds),
            angular_velocity: model.gyroscope.linear(&reading.angular_velocity, seconds),
        };
        if let Some(noise) = &mut self.noise {
            let Reading {
                specific_force,
                angular_velocity,
            } = noise.draw();
            reading = Reading {
                specific_force: reading.specific_force + specific_force,
                angular_velocity: reading.angular_velocity + angular_velocity,
            };
            world_from_sensor *= noise.draw_turn();
        }
        ImuSample {
            stamp: model.epoch.plus_seconds(model.clock.stamp_seconds(seconds)),
            world_from_sensor,
            specific_force: model.accelerometer.digital(&reading.specific_force),
            angular_velocity: model.gyroscope.digital(&reading.angular_velocity),
        }
    }

    /// 1, in segment axes.
    fn segment(&mut self, model: &SensorModel, sample: &KinematicSample) -> Reading {
        let segment_from_world = sample.world_from_sensor.rotation.inverse();
        let angular_velocity = segment_from_world * sample.angular_velocity_in_world;
        let mut specific_force =
            segment_from_world * (sample.acceleration_in_world - model.gravity);
        if let Some(offset) = &model.lever_arm {
            let difference = |(stamp, before): (Stamp, Vector3<f64>)| {
                (angular_velocity - before) / (sample.stamp - stamp)
            };
            let given = sample
                .angular_acceleration_in_world
                .map(|alpha| segment_from_world * alpha);
            let angular_acceleration = given
                .or_else(|| self.previous.map(difference))
                .unwrap_or_default();
            specific_force +=
                lever_arm::acceleration(offset, &angular_velocity, &angular_acceleration);
        }
        self.previous = Some((sample.stamp, angular_velocity));
        Reading {
            specific_force,
            angular_velocity,
        }
    }
}

/// segment_from_sensor as a rotation; a mirrored axis convention, which is none, leaves the
/// orientation as it is.
fn orientation(sensor_from_segment: Option<&Matrix3<f64>>) -> UnitQuaternion<f64> {
    match sensor_from_segment {
        Some(turn) if turn.determinant() > 0.0 => UnitQuaternion::from_rotation_matrix(
            &Rotation3::from_matrix_unchecked(turn.transpose()),
        ),
        _ => UnitQuaternion::identity(),
    }
}

#[cfg(test)]
#[path = "streaming_tests.rs"]
mod tests;
