//! Devices that nobody has seen: effects drawn at random, and what such a device measures of a
//! motion.

use cromosim_imu::{
    DeclaredNoise, Effect, EffectKind, EffectSet, KinematicSample, MeasurementInput, NoiseSource,
    Reading, SensorModel, normal_pair, track_in_sensor_axes,
};
use cromosim_spatial::Stamp;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

use crate::LearnedError;

/// What devices and their mounts differ by. A pair is the range of a uniform draw; a single number
/// the standard deviation of a normal one.
///
/// Defaults: noise, bias, gain and cross-axis errors are what data sheets of consumer MEMS allow
/// (BMI270, LSM6DSO, MPU-9250: zero-g offset 20 to 60 mg, zero-rate offset 0.5 to 5 deg/s,
/// sensitivity 1 to 3 %, cross-axis 0.5 to 2 %); soft tissue under straps rings at 5 to 20 Hz with
/// damping ratios of 0.2 to 0.6; wearables filter at 20 to 50 Hz; people mount within 10 degrees
/// and stamps are late by up to 20 ms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviceRanges {
    /// Probability of soft tissue under the sensor.
    pub tissue_probability: f64,
    /// Natural frequency of the tissue, Hz.
    pub tissue_hz: [f64; 2],
    /// Its damping ratio.
    pub tissue_damping: [f64; 2],
    /// Cutoff of the device's low-pass, Hz.
    pub low_pass_hz: [f64; 2],
    /// Lateness of the stamps, s.
    pub late: [f64; 2],
    /// Turn of the mount about each axis, standard deviation, rad.
    pub mount: f64,
    /// Offset of the sensor from the site, standard deviation of each axis, m.
    pub lever_arm: f64,
    /// Bias, standard deviation of each axis, m/s2.
    pub accel_bias: f64,
    /// Bias, standard deviation of each axis, rad/s.
    pub gyro_bias: f64,
    /// Gain less 1, standard deviation of each axis.
    pub scale: f64,
    /// Cross-axis coupling, standard deviation of each entry.
    pub misalignment: f64,
    /// White noise, (m/s2)/sqrt(Hz).
    pub accel_noise: [f64; 2],
    /// White noise, (rad/s)/sqrt(Hz).
    pub gyro_noise: [f64; 2],
}

impl Default for DeviceRanges {
    fn default() -> Self {
        Self {
            tissue_probability: 0.8,
            tissue_hz: [5.0, 20.0],
            tissue_damping: [0.2, 0.6],
            low_pass_hz: [20.0, 50.0],
            late: [0.0, 0.02],
            mount: 0.17,
            lever_arm: 0.005,
            accel_bias: 0.2,
            gyro_bias: 0.01,
            scale: 0.01,
            misalignment: 0.005,
            accel_noise: [0.001, 0.004],
            gyro_noise: [0.0001, 0.0003],
        }
    }
}

/// A device and how it is worn.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnDevice {
    effects: EffectSet,
    noise: DeclaredNoise,
    seed: u64,
}

impl DeviceRanges {
    /// The device of a seed.
    ///
    /// # Errors
    /// [`LearnedError::Effect`] for ranges beyond what an effect allows.
    pub fn draw(&self, seed: u64) -> Result<DrawnDevice, LearnedError> {
        use EffectKind as Kind;
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut drawn: Vec<(Kind, Vec<f64>)> = vec![
            (Kind::MountRotation, vector(&mut random, self.mount)),
            (Kind::LeverArm, vector(&mut random, self.lever_arm)),
            (Kind::TimeOffset, vec![uniform(&mut random, self.late)]),
            (Kind::AccelBias, vector(&mut random, self.accel_bias)),
            (Kind::GyroBias, vector(&mut random, self.gyro_bias)),
            (Kind::AccelScale, gains(&mut random, self.scale)),
            (Kind::GyroScale, gains(&mut random, self.scale)),
            (
                Kind::AccelMisalignment,
                vector(&mut random, self.misalignment),
            ),
            (
                Kind::GyroMisalignment,
                vector(&mut random, self.misalignment),
            ),
            (Kind::LowPass, vec![uniform(&mut random, self.low_pass_hz)]),
        ];
        // Drawn in any case, so that what follows does not hang on it.
        let tissue = vec![
            uniform(&mut random, self.tissue_hz),
            uniform(&mut random, self.tissue_damping),
        ];
        if random.random::<f64>() < self.tissue_probability {
            drawn.push((Kind::SoftTissue, tissue));
        }
        let noise = DeclaredNoise {
            accel_density: uniform(&mut random, self.accel_noise),
            gyro_density: uniform(&mut random, self.gyro_noise),
        };
        let mut effects = EffectSet::new();
        for (kind, values) in drawn {
            effects.insert(Effect::new(kind, values)?);
        }
        Ok(DrawnDevice {
            effects,
            noise,
            seed,
        })
    }
}

/// Three independent normal numbers, cut off at three standard deviations.
fn vector(random: &mut ChaCha12Rng, sigma: f64) -> Vec<f64> {
    let [x, y] = normal_pair(random);
    let [z, _] = normal_pair(random);
    [x, y, z]
        .map(|value| (value * sigma).clamp(-3.0 * sigma, 3.0 * sigma))
        .to_vec()
}

/// Three such numbers around 1.
fn gains(random: &mut ChaCha12Rng, sigma: f64) -> Vec<f64> {
    let deviations = vector(random, sigma);
    deviations.iter().map(|deviation| 1.0 + deviation).collect()
}

fn uniform(random: &mut ChaCha12Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

impl DrawnDevice {
    /// What is wrong with it.
    pub fn effects(&self) -> &EffectSet {
        &self.effects
    }

    /// Its white noise.
    pub fn noise(&self) -> &DeclaredNoise {
        &self.noise
    }

    /// Its readings at `stamps` of a sensor that moves along `kinematics` (world axes, on a uniform
    /// grid of `rate_hz`).
    ///
    /// # Errors
    /// [`LearnedError::Imu`] for stamps without a rate.
    pub fn measure(
        &self,
        kinematics: &[KinematicSample],
        rate_hz: f64,
        stamps: &[Stamp],
    ) -> Result<Vec<Reading>, LearnedError> {
        let track = track_in_sensor_axes(kinematics, rate_hz);
        let epoch = stamps.first().copied().unwrap_or_default();
        let model = SensorModel::new(&self.effects, epoch);
        let seconds = stamps.last().map_or(0.0, |last| *last - epoch);
        let imu_rate_hz = stamps.len().saturating_sub(1) as f64 / seconds;
        let densities = model.total_noise(&self.noise);
        let mut noise = NoiseSource::white(&densities, 0.0, imu_rate_hz, self.seed, "drawn")?;
        Ok(
            model.measure(MeasurementInput::Motion(&track), stamps, |readings| {
                noise.add_to(readings);
            }),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory, simulate_kinematics};
    use cromosim_spatial::uniform_stamps;
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn kinematics(rate_hz: f64) -> Vec<KinematicSample> {
        let frame = |k: u32| {
            let t = f64::from(k) / 120.0;
            let at = Isometry3::new(
                Vector3::new(0.1 * (9.0 * t).sin(), 0.0, 0.05 * (7.0 * t).cos()),
                Vector3::new(0.0, (4.0 * t).sin(), 0.2),
            );
            SensorFrame::new(Stamp::from_seconds(t), at)
        };
        let trajectory = SensorTrajectory::new((0..600).map(frame).collect()).unwrap();
        let grid = uniform_stamps(trajectory.start(), trajectory.end(), rate_hz).unwrap();
        simulate_kinematics(&trajectory, Scheme::Spline, &grid).unwrap()
    }

    #[test]
    fn a_device_without_errors_reads_the_ideal() {
        let none = DeviceRanges {
            tissue_probability: 0.0,
            low_pass_hz: [1e4, 1e4],
            late: [0.0, 0.0],
            mount: 0.0,
            lever_arm: 0.0,
            accel_bias: 0.0,
            gyro_bias: 0.0,
            scale: 0.0,
            misalignment: 0.0,
            accel_noise: [0.0, 0.0],
            gyro_noise: [0.0, 0.0],
            ..DeviceRanges::default()
        };
        let kinematics = kinematics(400.0);
        let stamps: Vec<Stamp> = kinematics
            .iter()
            .step_by(4)
            .map(|sample| sample.stamp)
            .collect();
        let readings = none
            .draw(5)
            .unwrap()
            .measure(&kinematics, 400.0, &stamps)
            .unwrap();
        for (reading, sample) in readings.iter().zip(kinematics.iter().step_by(4)) {
            let ideal = sample.imu();
            assert!((reading.specific_force - ideal.specific_force).norm() < 1e-9);
            assert!((reading.angular_velocity - ideal.angular_velocity).norm() < 1e-9);
        }
    }

    #[test]
    fn a_seed_is_a_device_and_another_seed_another() {
        let (ranges, kinematics) = (DeviceRanges::default(), kinematics(400.0));
        let stamps: Vec<Stamp> = kinematics
            .iter()
            .step_by(4)
            .map(|sample| sample.stamp)
            .collect();
        let read = |seed| {
            ranges
                .draw(seed)
                .unwrap()
                .measure(&kinematics, 400.0, &stamps)
                .unwrap()
        };
        assert_eq!(read(1), read(1));
        assert_ne!(read(1), read(2));
        let with_tissue = (0..200)
            .filter(|seed| {
                ranges
                    .draw(*seed)
                    .unwrap()
                    .effects()
                    .get(EffectKind::SoftTissue)
                    .is_some()
            })
            .count();
        assert!((140..180).contains(&with_tissue), "{with_tissue} of 200");
    }
}
