//! The one way from a placement's motion to its messages.
//!
//! ```text
//! motion -> correction (networks) -> measurement (effects, noise, losses) -> mapping -> orientation, covariances -> messages
//! ```
//! Live and offline share all of it: [`VirtualImu::measure`] takes samples as they come,
//! [`measure_recording`] a whole motion at given stamps; both end in the same messages.

use std::sync::Arc;

use cromosim_msgs::sensor_msgs::{Imu, MagneticField, Temperature};
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::effects::Thermometer;
use crate::magnetic::MagneticSensor;
use crate::orientation::OrientationFilter;
use crate::stated_errors::{StatedErrors, with_clock_errors};
use crate::{
    AmbientField, Covariances, Device, DrawnBiases, Dropouts, EffectKind, ImuError, ImuSample,
    KinematicSample, MeasurementInput, NoiseSource, OrientationSource, PlacementEffects, Reading,
    SampleVariance, SensorModel, StreamingEffects,
};

/// Changes a motion before it is measured: the place of learned networks.
pub trait MotionCorrection {
    /// Why it cannot.
    type Error;

    /// Takes the samples that each placement's scheme released, in order, and leaves those that are
    /// corrected by now, these or earlier ones.
    ///
    /// # Errors
    /// What the correction cannot work with.
    fn correct(&mut self, motions: &mut [Vec<KinematicSample>]) -> Result<(), Self::Error>;
}

/// Changes readings after they are measured: the place of a distribution mapping.
pub trait ReadingMapping: Send + Sync {
    /// What stands in the messages instead of `reading`.
    fn map(&self, reading: &Reading) -> Reading;
}

/// How a placement's IMU runs, whatever its motion comes from.
pub struct ImuOptions {
    /// Samples per second, Hz; noise per sample and its covariance follow from it.
    pub rate_hz: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// The name that the random numbers depend on: the placement's, after the body's where there
    /// are several.
    pub name: String,
    /// The random part of the errors: white noise, drawn biases, lost samples. Without it biases and all other
    /// effects stay.
    pub noise: bool,
    /// `header.frame_id` of the messages.
    pub frame_id: String,
    /// Applied last to the readings.
    pub mapping: Option<Box<dyn ReadingMapping>>,
    /// The magnetic field that devices with a magnetometer read; none: they say nothing of it.
    pub field: Option<Arc<AmbientField>>,
    /// Where the orientation of `data` comes from.
    pub orientation: OrientationSource,
}

/// One sample in both forms of REP-145.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuMessages {
    /// For `imu/NAME/data_raw`: without orientation.
    pub data_raw: Imu,
    /// For `imu/NAME/data`: with orientation.
    pub data: Imu,
    /// For `imu/NAME/mag`, of devices that have a magnetometer, in a known field.
    pub mag: Option<MagneticField>,
    /// For `imu/NAME/temperature`, once a second, of devices that warm up.
    pub temperature: Option<Temperature>,
}

/// What a device says of one sample: the values of its messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// By the device's clock, with the orientation that it states.
    pub sample: ImuSample,
    /// As `data` states them.
    pub covariances: Covariances,
    /// In the sensor's axes, T; of devices that have a magnetometer, in a known field.
    pub magnetic_field: Option<Vector3<f64>>,
    /// Degrees Celsius, once a second, of devices that warm up.
    pub temperature: Option<f64>,
}

/// The last steps: from a reading to messages.
struct Output {
    mapping: Option<Box<dyn ReadingMapping>>,
    covariances: Covariances,
    frame_id: String,
}

/// One placement's IMU: samples of its motion go in, in order of time, messages come out.
pub struct VirtualImu {
    effects: StreamingEffects,
    stated: StatedErrors,
    magnetic: Option<MagneticSensor>,
    thermometer: Option<Thermometer>,
    orientation: OrientationSource,
    /// None where the orientation is no filter's.
    filter: Option<OrientationFilter>,
    output: Output,
}

impl VirtualImu {
    /// The IMU of a device. Its effects are anchored at the first sample.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] for a rate that is not positive.
    pub fn new(device: &Device, options: ImuOptions) -> Result<Self, ImuError> {
        let effects = StreamingEffects::new(device, options.rate_hz, options.seed, &options.name)?;
        let noise = options
            .noise
            .then_some((options.seed, options.name.as_str()));
        let magnetic = device
            .magnetometer()
            .zip(options.field)
            .map(|(model, field)| MagneticSensor::new(model, field, options.rate_hz, noise));
        Ok(Self {
            magnetic,
            thermometer: Thermometer::new(device.effects()),
            orientation: options.orientation,
            filter: OrientationFilter::new(options.orientation, options.rate_hz),
            effects: if options.noise {
                effects
            } else {
                effects.without_noise()
            },
            stated: StatedErrors::of_device(device, options.rate_hz),
            output: Output {
                covariances: Covariances::for_device(device, options.rate_hz),
                mapping: options.mapping,
                frame_id: options.frame_id,
            },
        })
    }

    /// The messages of a sample; `None` where the device loses it.
    pub fn measure(&mut self, motion: &KinematicSample) -> Option<ImuMessages> {
        let measured = self.read(motion)?;
        Some(self.messages(&measured))
    }

    /// Stamp and reading of these messages alone, of whose samples no other method is asked.
    pub fn read_channels(&mut self, motion: &KinematicSample) -> Option<(Stamp, Reading)> {
        let (stamp, reading) = self.effects.step_reading(motion)?;
        Some((stamp, self.output.mapped(reading)))
    }

    /// The values of these messages.
    pub fn read(&mut self, motion: &KinematicSample) -> Option<Measured> {
        let sample = self.effects.step(motion);
        let magnetic_field = self.read_field(motion);
        let sample = self.output.mapped_sample(sample?);
        let variance = self
            .stated
            .of_motion(motion.variance, self.effects.walked_seconds());
        let covariances = self.output.covariances.with_motion(&variance, &sample);
        let thermometer = self.thermometer.as_mut();
        let mut measured = Some(Measured {
            sample,
            covariances,
            magnetic_field,
            temperature: thermometer.and_then(|it| it.read(sample.stamp)),
        });
        // Where it lies: a copy of all costs more than this.
        if let Some(it) = &mut measured {
            self.orient(&mut it.sample, magnetic_field.as_ref(), &mut it.covariances);
        }
        measured
    }

    /// Of every sample: a magnetometer that is late needs those that are lost.
    fn read_field(&mut self, motion: &KinematicSample) -> Option<Vector3<f64>> {
        let magnetic = self.magnetic.as_mut()?;
        let world_from_sensor = Isometry3::from_parts(
            motion.world_from_sensor.translation,
            self.effects.world_from_sensor(motion),
        );
        Some(magnetic.read(&world_from_sensor, motion.stamp))
    }

    /// Puts the orientation that is asked for in the place of the true one.
    fn orient(
        &mut self,
        sample: &mut ImuSample,
        field: Option<&Vector3<f64>>,
        covariances: &mut Covariances,
    ) {
        if let Some(filter) = &mut self.filter {
            let reading = self.stated.in_si(&sample.reading());
            sample.world_from_sensor = filter.update(&reading, field, sample.stamp);
            covariances.orientation = filter.covariance(field.is_some());
        } else if self.orientation == OrientationSource::None {
            sample.world_from_sensor = UnitQuaternion::identity();
            *covariances = covariances.without_orientation();
        }
    }

    /// The messages that say it.
    pub fn messages(&self, measured: &Measured) -> ImuMessages {
        let Measured {
            sample,
            covariances,
            ..
        } = measured;
        let frame_id = &self.output.frame_id;
        let mag = |(sensor, field): (&MagneticSensor, Vector3<f64>)| {
            sensor.message(field, sample.stamp, frame_id)
        };
        let temperature = |temperature| Temperature {
            header: Header::new(sample.stamp.nanos, frame_id),
            temperature,
            variance: 0.0,
        };
        ImuMessages {
            data_raw: self.output.data_raw(sample, covariances),
            data: self.output.message(sample, covariances),
            mag: self.magnetic.as_ref().zip(measured.magnetic_field).map(mag),
            temperature: measured.temperature.map(temperature),
        }
    }

    /// Begins anew with the next sample, see [`StreamingEffects::reset`].
    pub fn reset(&mut self) {
        self.effects.reset();
        self.magnetic.iter_mut().for_each(MagneticSensor::reset);
        self.filter.iter_mut().for_each(OrientationFilter::reset);
        self.thermometer.iter_mut().for_each(Thermometer::reset);
    }
}

/// The messages that the samples of several placements lead to, each with its placement's number:
/// first the correction, where there is one, then every sample through its placement's IMU.
///
/// # Errors
/// Those of the correction.
pub fn measure_all<C: MotionCorrection + ?Sized>(
    imus: &mut [VirtualImu],
    mut motions: Vec<Vec<KinematicSample>>,
    correction: Option<&mut C>,
) -> Result<Vec<(usize, ImuMessages)>, C::Error> {
    if let Some(correction) = correction {
        correction.correct(&mut motions)?;
    }
    let mut messages = Vec::new();
    for (placement, (imu, motions)) in imus.iter_mut().zip(&motions).enumerate() {
        let measured = motions.iter().filter_map(|motion| imu.measure(motion));
        messages.extend(measured.map(|own| (placement, own)));
    }
    Ok(messages)
}

/// What [`measure_recording`] measures.
#[derive(Clone, Copy, Debug)]
pub struct RecordedMotion<'a> {
    /// The motion of the reference frame.
    pub track: &'a KinematicTrack,
    /// When the IMU reads, by its own clock.
    pub stamps: &'a [Stamp],
    /// What errors of the poses leave at each stamp; empty where that is not known.
    pub variances: &'a [SampleVariance],
    /// Whether the stamps are those of a recording, which has its losses in them already.
    pub stamps_are_recorded: bool,
}

/// The messages (`data_raw`) of a whole motion at given stamps, with effects as a diagnosis states
/// them. Unlike [`VirtualImu`] it filters on the motion's own grid and knows what comes after a
/// sample. Without noise it is what the device reads in the mean: of rounding what is left of it then.
///
/// # Errors
/// [`ImuError::Trajectory`] for a rate that is not positive.
pub fn measure_recording(
    motion: RecordedMotion<'_>,
    effects: &PlacementEffects,
    options: ImuOptions,
) -> Result<Vec<Imu>, ImuError> {
    let (readings, walks) = noisy_readings(motion, effects, &options)?;
    let ImuOptions {
        rate_hz,
        seed,
        name,
        noise,
        frame_id,
        mapping,
        ..
    } = options;
    let declared = effects.declared_noise;
    let losses = effects.effects.get(EffectKind::DroppedSamples);
    let mut dropouts = (noise && !motion.stamps_are_recorded)
        .then(|| Dropouts::new(losses, seed, &name))
        .flatten();
    let stated = StatedErrors::new(&effects.effects, &declared, effects.unexplained, rate_hz);
    let output = Output {
        mapping,
        covariances: Covariances::white(stated.own_unrounded()),
        frame_id,
    };
    let none = SampleVariance::default();
    let message = |(k, variance): (usize, &SampleVariance)| {
        let (stamp, reading) = (&motion.stamps[k], &readings[k]);
        let late_squared = stated.late_squared(*stamp - motion.stamps[0]);
        let walked = if walks {
            *stamp - motion.stamps[0]
        } else {
            0.0
        };
        let variance = stated.of_motion(*variance, walked);
        let variance = with_clock_errors(variance, late_squared, k, motion.stamps, &readings);
        let (variance, reading) = if noise {
            (stated.with_rounding(variance, reading), *reading)
        } else {
            stated.expected_rounding(variance, reading)
        };
        let lost = dropouts.as_mut().is_some_and(Dropouts::next_is_lost);
        let sample = ImuSample {
            stamp: *stamp,
            world_from_sensor: UnitQuaternion::identity(),
            specific_force: reading.specific_force,
            angular_velocity: reading.angular_velocity,
        };
        (!lost).then(|| {
            let sample = output.mapped_sample(sample);
            output.data_raw(&sample, &output.covariances.with_motion(&variance, &sample))
        })
    };
    let variances = motion.variances.iter().chain(std::iter::repeat(&none));
    Ok((0..readings.len())
        .zip(variances)
        .filter_map(message)
        .collect())
}

/// What the device reads, without noise before it is rounded; and whether biases walk in it.
fn noisy_readings(
    motion: RecordedMotion<'_>,
    effects: &PlacementEffects,
    options: &ImuOptions,
) -> Result<(Vec<Reading>, bool), ImuError> {
    let (seed, name) = (options.seed, options.name.as_str());
    let set = if options.noise {
        effects.effects.clone()
    } else {
        effects.effects.unrounded()
    };
    let model = SensorModel::new(&set, effects.epoch);
    let white = model.total_noise(&effects.declared_noise);
    let mut source = NoiseSource::white(&white, 0.0, options.rate_hz, seed, name)?;
    let biases = DrawnBiases::new(&effects.effects, seed, name);
    let mut biases = biases.filter(|_| options.noise);
    let walks = biases.is_some();
    let input = MeasurementInput::Motion(motion.track);
    let readings = model.measure(input, motion.stamps, |readings| {
        if options.noise {
            source.add_to(readings);
        }
        if let Some(biases) = &mut biases {
            for (reading, stamp) in readings.iter_mut().zip(motion.stamps) {
                biases.add_to(reading, *stamp);
            }
        }
    });
    Ok((readings, walks))
}

impl Output {
    fn mapped(&self, reading: Reading) -> Reading {
        match &self.mapping {
            Some(mapping) => mapping.map(&reading),
            None => reading,
        }
    }

    fn mapped_sample(&self, sample: ImuSample) -> ImuSample {
        let mapped = self.mapped(sample.reading());
        ImuSample {
            specific_force: mapped.specific_force,
            angular_velocity: mapped.angular_velocity,
            ..sample
        }
    }

    /// Without orientation.
    fn data_raw(&self, sample: &ImuSample, covariances: &Covariances) -> Imu {
        let sample = ImuSample {
            world_from_sensor: UnitQuaternion::identity(),
            ..*sample
        };
        self.message(&sample, &covariances.without_orientation())
    }

    fn message(&self, sample: &ImuSample, covariances: &Covariances) -> Imu {
        Imu {
            header: Header::new(sample.stamp.nanos, &self.frame_id),
            orientation: sample.world_from_sensor.into(),
            orientation_covariance: covariances.orientation,
            angular_velocity: sample.angular_velocity.into(),
            angular_velocity_covariance: covariances.angular_velocity,
            linear_acceleration: sample.specific_force.into(),
            linear_acceleration_covariance: covariances.linear_acceleration,
        }
    }
}

#[cfg(test)]
#[path = "virtual_imu_tests.rs"]
mod tests;
