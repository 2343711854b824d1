//! Effects on live samples.

use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::channel_delay::DelayLine;
use super::drawn_biases::DrawnBiases;
use super::dropped_samples::Dropouts;
use super::filter::Streamed;
use super::tissue::{StreamedTissue, Turning};
use super::{EffectKind, Reading, SensorModel, lever_arm};
use crate::{Channel, Device, ImuError, ImuSample, KinematicSample, NoiseSource, PerChannel};

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
    /// None before the first sample; every step takes it and puts it back.
    model: Option<Box<SensorModel>>,
    noise: Option<NoiseSource>,
    biases: Option<DrawnBiases>,
    dropouts: Option<Dropouts>,
    tissue: Option<StreamedTissue>,
    low_pass: PerChannel<Option<Streamed>>,
    /// Of the gyroscope.
    delay: Option<DelayLine>,
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
        let noise = model.total_noise(&device.declared_noise());
        Ok(Self {
            device: device.clone(),
            rate_hz,
            noise: Some(NoiseSource::white(
                &noise,
                device.orientation_stddev(),
                rate_hz,
                seed,
                placement,
            )?),
            biases: DrawnBiases::new(device.effects(), seed, placement),
            dropouts: Dropouts::new(
                device.effects().get(EffectKind::DroppedSamples),
                seed,
                placement,
            ),
            tissue: model.tissue.map(StreamedTissue::new),
            low_pass: PerChannel::from_fn(|channel| model.low_pass[channel].map(Streamed::new)),
            delay: (model.channel_delay != 0.0).then(|| DelayLine::new(model.channel_delay)),
            model: None,
            previous: None,
        })
    }

    /// Without the random part: no noise, no drawn biases, no losses.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self {
            noise: None,
            biases: None,
            dropouts: None,
            ..self
        }
    }

    /// For how long biases have walked by now, s; 0 where nothing is drawn.
    pub(crate) fn walked_seconds(&self) -> f64 {
        self.biases.as_ref().map_or(0.0, DrawnBiases::seconds)
    }

    /// Begins anew with the next sample, which is the new epoch: for sources that jump back in
    /// time. Noise, drawn biases and losses go on.
    pub fn reset(&mut self) {
        self.model = None;
        self.forget();
    }

    /// Filters begin anew.
    fn forget(&mut self) {
        self.previous = None;
        self.tissue.iter_mut().for_each(StreamedTissue::reset);
        self.delay.iter_mut().for_each(DelayLine::reset);
        for channel in Channel::ALL {
            self.low_pass[channel].iter_mut().for_each(Streamed::reset);
        }
    }

    /// The device's reading of a sample, by the device's own clock; none where it is lost. One call
    /// a sample, in order of time; after a pause of more than ten intervals the filters begin anew.
    #[inline]
    pub fn step(&mut self, sample: &KinematicSample) -> Option<ImuSample> {
        let read = self.step_reading(sample);
        let mut world_from_sensor = self.world_from_sensor(sample);
        if let Some(noise) = &mut self.noise {
            world_from_sensor *= noise.draw_turn();
        }
        read.map(|(stamp, reading)| ImuSample {
            stamp,
            world_from_sensor,
            specific_force: reading.specific_force,
            angular_velocity: reading.angular_velocity,
        })
    }

    /// As [`StreamingEffects::step`], without an orientation: for a device that says none of any sample.
    #[inline]
    pub fn step_reading(&mut self, sample: &KinematicSample) -> Option<(Stamp, Reading)> {
        let model = match self.model.take() {
            Some(model) => model,
            None => Box::new(SensorModel::new(self.device.effects(), sample.stamp)),
        };
        let reading = self.reading(&model, sample);
        let lost = self.dropouts.as_mut().is_some_and(Dropouts::next_is_lost);
        self.model = Some(model);
        (!lost).then_some(reading)
    }

    /// world_from_sensor of a sample that [`StreamingEffects::step`] has taken, as it is.
    pub(crate) fn world_from_sensor(&self, sample: &KinematicSample) -> UnitQuaternion<f64> {
        let turn = self
            .model
            .as_ref()
            .and_then(|model| sensor_from_segment(model, sample.stamp - model.epoch));
        sample.world_from_sensor.rotation * orientation(turn)
    }

    // What goes by reference to a stage that most devices lack goes as a copy, or all of it would go through memory in
    // pieces and come back whole, which waits for each.
    #[inline]
    fn reading(&mut self, model: &SensorModel, sample: &KinematicSample) -> (Stamp, Reading) {
        let seconds = sample.stamp - model.epoch;
        let interval = self.previous.map_or(0.0, |(stamp, _)| sample.stamp - stamp);
        if !(0.0..=10.0 / self.rate_hz).contains(&interval) {
            self.forget();
        }
        // The stages in the order of Stage::ORDER, one after the other: a loop over them has the compiler compute what
        // none of them changes ahead, on the values of effects that are not there.
        let turning = self.turning(sample);
        let mut reading = self.segment(model, sample, &turning);
        if let Some(tissue) = &mut self.tissue {
            let copy = turning;
            reading.specific_force = tissue.push(reading.specific_force, &copy, interval);
        }
        reading = model.turned(sensor_from_segment(model, seconds), &reading);
        if let Some(line) = &model.vibration {
            let mut shaken = reading;
            model.shake(line, &mut shaken, seconds);
            reading = shaken;
        }
        let Reading {
            mut specific_force,
            mut angular_velocity,
        } = reading;
        if let Some(filter) = &mut self.low_pass.accelerometer {
            specific_force = filter.push(specific_force, interval);
        }
        if let Some(filter) = &mut self.low_pass.gyroscope {
            angular_velocity = filter.push(angular_velocity, interval);
        }
        if let Some(delay) = &mut self.delay {
            angular_velocity = delay.push(seconds, angular_velocity);
        }
        reading = Reading {
            specific_force,
            angular_velocity,
        };
        let stamp = model.epoch.plus_seconds(model.clock.stamp_seconds(seconds));
        reading = model.linear_reading(&reading, seconds);
        if let Some(biases) = &mut self.biases {
            let mut biased = reading;
            biases.add_to(&mut biased, stamp);
            reading = biased;
        }
        if let Some(noise) = &mut self.noise {
            let mut noisy = reading;
            noise.add_to(std::slice::from_mut(&mut noisy));
            reading = noisy;
        }
        (stamp, model.digital_reading(&reading))
    }

    /// How the segment turns; where the sample does not tell the angular acceleration, the difference
    /// from the sample before does.
    #[inline]
    fn turning(&mut self, sample: &KinematicSample) -> Turning {
        let segment_from_world = sample.world_from_sensor.rotation.inverse();
        let velocity = segment_from_world * sample.angular_velocity_in_world;
        let difference =
            |(stamp, before): (Stamp, Vector3<f64>)| (velocity - before) / (sample.stamp - stamp);
        let acceleration = sample
            .angular_acceleration_in_world
            .map(|alpha| segment_from_world * alpha)
            .or_else(|| self.previous.map(difference))
            .unwrap_or_default();
        self.previous = Some((sample.stamp, velocity));
        Turning {
            velocity,
            acceleration,
        }
    }

    /// [`super::Stage::Segment`]; in segment axes.
    #[inline]
    fn segment(&self, model: &SensorModel, sample: &KinematicSample, turning: &Turning) -> Reading {
        let acceleration = sample.acceleration_in_world * model.inverse_scale;
        let mut specific_force =
            sample.world_from_sensor.rotation.inverse() * (acceleration - model.gravity);
        if let Some(offset) = &model.lever_arm {
            specific_force +=
                lever_arm::acceleration(offset, &turning.velocity, &turning.acceleration);
        }
        Reading {
            specific_force,
            angular_velocity: turning.velocity,
        }
    }
}

/// So many seconds after the epoch.
#[inline]
fn sensor_from_segment(model: &SensorModel, seconds: f64) -> Option<&Matrix3<f64>> {
    let slip = model.slip.as_ref();
    slip.filter(|(at, _)| seconds >= *at)
        .map(|(_, after)| after)
        .or(model.sensor_from_segment.as_ref())
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
