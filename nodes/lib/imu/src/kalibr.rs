//! Kalibr's imu.yaml: white noise and bias walk of both channels.

use cromosim_spatial::in_plain_words;
use serde_norway::{Mapping, Value};

use crate::effects::number;
use crate::{Device, Effect, EffectKind, EffectSet, ImuError};

/// What Kalibr knows of an IMU's noise (its wiki, "IMU Noise Model"): continuous-time densities of the
/// white noise and of the bias' random walk, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KalibrNoise {
    /// `accelerometer_noise_density`, (m/s2)/sqrt(Hz).
    pub accel_density: f64,
    /// `accelerometer_random_walk`, (m/s3)/sqrt(Hz).
    pub accel_walk: f64,
    /// `gyroscope_noise_density`, (rad/s)/sqrt(Hz).
    pub gyro_density: f64,
    /// `gyroscope_random_walk`, (rad/s2)/sqrt(Hz).
    pub gyro_walk: f64,
}

const KEYS: [&str; 4] = [
    "accelerometer_noise_density",
    "accelerometer_random_walk",
    "gyroscope_noise_density",
    "gyroscope_random_walk",
];
/// What a result of a calibration puts its IMU under.
const NESTED: &str = "imu0";

impl KalibrNoise {
    /// Parses a file's text, as it is given to Kalibr or as a calibration writes it (under `imu0`);
    /// `file` names it in errors. What it says beyond noise is not read.
    ///
    /// # Errors
    /// [`ImuError::Yaml`], and [`ImuError::Kalibr`] for what is missing or no number.
    pub fn parse(text: &str, file: &str) -> Result<Self, ImuError> {
        let content: Mapping = serde_norway::from_str(text).map_err(|error| ImuError::Yaml {
            file: file.to_owned(),
            problem: in_plain_words(error),
        })?;
        let nested = content.get(NESTED).and_then(Value::as_mapping);
        let (content, place) = nested.map_or((&content, ""), |own| (own, "imu0: "));
        let wrong = |key: &str, found: &str| ImuError::Kalibr {
            file: file.to_owned(),
            problem: format!(
                "{place}{key}: {found}; expected a density of at least zero, as 0.002"
            ),
        };
        let value = |key: &str| {
            let found = content.get(key).ok_or_else(|| wrong(key, "missing"))?;
            let number = found.as_f64().filter(|it| *it >= 0.0 && it.is_finite());
            number.ok_or_else(|| wrong(key, "no such number"))
        };
        let [accel_density, accel_walk, gyro_density, gyro_walk] = KEYS.map(value);
        Ok(Self {
            accel_density: accel_density?,
            accel_walk: accel_walk?,
            gyro_density: gyro_density?,
            gyro_walk: gyro_walk?,
        })
    }

    /// The noise of a device, and what of it Kalibr has no place for, by name. White noise is the
    /// declared with that of effects.
    pub fn of(device: &Device) -> (Self, Vec<&'static str>) {
        use EffectKind as Kind;
        let effects = device.effects();
        let scalar = |kind| effects.get(kind).map_or(0.0, |effect| effect.values()[0]);
        let kept = [
            Kind::AccelNoise,
            Kind::GyroNoise,
            Kind::AccelBiasWalk,
            Kind::GyroBiasWalk,
        ];
        let others = effects.iter().map(Effect::kind);
        let noise = Self {
            accel_density: device.accel_density().hypot(scalar(Kind::AccelNoise)),
            accel_walk: scalar(Kind::AccelBiasWalk),
            gyro_density: device.gyro_density().hypot(scalar(Kind::GyroNoise)),
            gyro_walk: scalar(Kind::GyroBiasWalk),
        };
        let others = others.filter(|kind| !kept.contains(kind));
        (noise, others.map(EffectKind::name).collect())
    }

    /// A device with this noise.
    ///
    /// # Errors
    /// [`ImuError::Kalibr`] for densities beyond an effect's bounds.
    pub fn device(&self) -> Result<Device, ImuError> {
        let mut effects = EffectSet::new();
        for (kind, density) in [
            (EffectKind::AccelBiasWalk, self.accel_walk),
            (EffectKind::GyroBiasWalk, self.gyro_walk),
        ] {
            if density > 0.0 {
                let effect = Effect::new(kind, vec![density]);
                effects.insert(effect.map_err(|error| ImuError::Kalibr {
                    file: "device".to_owned(),
                    problem: error.to_string(),
                })?);
            }
        }
        Ok(Device::white(self.accel_density, self.gyro_density).with_effects(effects))
    }

    /// The file's text.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] for a rate that is not positive, [`ImuError::Kalibr`] for a topic of
    /// more than one line.
    pub fn to_yaml(&self, topic: &str, rate_hz: f64) -> Result<String, ImuError> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(cromosim_spatial::SpatialError::BadRate { rate_hz }.into());
        }
        if topic.chars().any(|c| c.is_control() || c == '\'') {
            return Err(ImuError::Kalibr {
                file: topic.escape_default().to_string(),
                problem: "no name of a topic".to_owned(),
            });
        }
        let values = [
            self.accel_density,
            self.accel_walk,
            self.gyro_density,
            self.gyro_walk,
        ];
        let lines = KEYS.iter().zip(values);
        let lines = lines.map(|(key, value)| format!("{key}: {}\n", number(value)));
        let rate = number(rate_hz);
        Ok(lines.collect::<String>() + &format!("rostopic: '{topic}'\nupdate_rate: {rate}\n"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const PLAIN: &str = "#Accelerometers
accelerometer_noise_density: 1.86e-03   #Noise density (continuous-time)
accelerometer_random_walk:   4.33e-04   #Bias random walk
gyroscope_noise_density:     1.87e-04
gyroscope_random_walk:       2.66e-05
rostopic:                    /imu0      #the IMU ROS topic
update_rate:                 200.0      #Hz (for discretization of the values above)
";

    #[test]
    fn kalibrs_file_becomes_a_device_and_comes_back() {
        let noise = KalibrNoise::parse(PLAIN, "imu.yaml").unwrap();
        assert_eq!((noise.accel_density, noise.gyro_walk), (1.86e-3, 2.66e-5));
        let device = noise.device().unwrap();
        let walk = device.effects().get(EffectKind::AccelBiasWalk).unwrap();
        assert_eq!(
            (device.gyro_density(), walk.values()),
            (1.87e-4, [4.33e-4].as_slice())
        );
        assert_eq!(KalibrNoise::of(&device), (noise, Vec::new()));
        let text = noise.to_yaml("/imu0", 200.0).unwrap();
        assert_eq!(KalibrNoise::parse(&text, "again").unwrap(), noise);
        assert!(
            text.ends_with("rostopic: '/imu0'\nupdate_rate: 200.0\n"),
            "{text}"
        );
        let nested: String = PLAIN.lines().map(|line| format!("  {line}\n")).collect();
        let nested =
            format!("imu0:\n  T_i_b:\n  - [1.0, 0.0, 0.0, 0.0]\n{nested}  time_offset: 0.0\n");
        assert_eq!(KalibrNoise::parse(&nested, "result.yaml").unwrap(), noise);
        let of_bias = KalibrNoise::of(&Device::embedded("consumer_mems").unwrap());
        assert_eq!(of_bias.1, ["accel_bias", "gyro_bias"]);
    }

    #[test]
    fn what_is_missing_or_no_number_is_said() {
        let refusal = |text: &str| {
            KalibrNoise::parse(text, "imu.yaml")
                .unwrap_err()
                .to_string()
        };
        let missing = refusal(&PLAIN.replace("gyroscope_random_walk", "gyroscope_walk"));
        assert_eq!(
            missing,
            "imu.yaml: gyroscope_random_walk: missing; expected a density of at least zero, as 0.002"
        );
        assert!(
            refusal(&PLAIN.replace("1.86e-03", "-1.0")).contains("noise_density: no such number")
        );
        assert!(
            refusal("imu0: {accelerometer_random_walk: 1}").contains("imu0: accelerometer_noise")
        );
        assert!(refusal("- 1\n").starts_with("imu.yaml: "));
        let noise = KalibrNoise::default();
        assert!(noise.to_yaml("/imu", 0.0).is_err() && noise.to_yaml("a\nb: 1", 1.0).is_err());
    }
}
