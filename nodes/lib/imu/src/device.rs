//! Devices: what a real sensor adds to the ideal reading.

use std::path::Path;

use cromosim_spatial::in_plain_words;
use serde::Deserialize;

use crate::effects::{RawUnexplained, number, write_effects, write_unexplained};
use crate::magnetic::RawMagnetometer;
use crate::{
    DeclaredNoise, Effect, EffectKind, EffectSet, ImuError, Magnetometer, PerChannel,
    PlacementEffects, Stage, UnexplainedErrors,
};

const SCHEMA: &str = "cromosim/device/1";

/// The embedded devices by name.
pub const EMBEDDED_DEVICES: [(&str, &str); 12] = [
    (
        "ideal",
        include_str!("../../../../config/devices/ideal.yaml"),
    ),
    (
        "consumer_mems",
        include_str!("../../../../config/devices/consumer_mems.yaml"),
    ),
    (
        "precision_mems",
        include_str!("../../../../config/devices/precision_mems.yaml"),
    ),
    (
        "bmi270",
        include_str!("../../../../config/devices/bmi270.yaml"),
    ),
    (
        "icm20948",
        include_str!("../../../../config/devices/icm20948.yaml"),
    ),
    (
        "icm42688p",
        include_str!("../../../../config/devices/icm42688p.yaml"),
    ),
    (
        "lsm6dsox",
        include_str!("../../../../config/devices/lsm6dsox.yaml"),
    ),
    (
        "mpu6050",
        include_str!("../../../../config/devices/mpu6050.yaml"),
    ),
    (
        "adis16470",
        include_str!("../../../../config/devices/adis16470.yaml"),
    ),
    (
        "mti630",
        include_str!("../../../../config/devices/mti630.yaml"),
    ),
    (
        "mtw_awinda",
        include_str!("../../../../config/devices/mtw_awinda.yaml"),
    ),
    (
        "movella_dot",
        include_str!("../../../../config/devices/movella_dot.yaml"),
    ),
];

/// White noise and further effects of a device, with values as a data sheet has them.
///
/// ```yaml
/// schema: cromosim/device/1
/// declared_noise: {accel_density: 0.00157, gyro_density: 0.000122}
/// effects:
///   - {effect: accel_bias, bias: [0.05, -0.03, 0.08]}
///   - {effect: gyro_bias, bias: [0.004, -0.006, 0.003]}
/// unexplained: {accel_variance: 0.0021, gyro_variance: 1.2e-5}   # may be left out
/// magnetometer: {noise_density: 1.0e-8}   # of devices that have one, see [`Magnetometer`]
/// ```
/// Densities are one-sided, (m/s2)/sqrt(Hz) and (rad/s)/sqrt(Hz); the list and what is unexplained are
/// those of an [`crate::EffectsFile`], without the effects of a reference. What depends on time is anchored at
/// the first sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    accel_density: f64,
    gyro_density: f64,
    orientation_stddev: f64,
    effects: EffectSet,
    unexplained: UnexplainedErrors,
    magnetometer: Option<Magnetometer>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDevice {
    schema: String,
    declared_noise: RawNoise,
    #[serde(default)]
    effects: EffectSet,
    #[serde(default)]
    unexplained: RawUnexplained,
    magnetometer: Option<RawMagnetometer>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNoise {
    accel_density: f64,
    gyro_density: f64,
    #[serde(default)]
    orientation_stddev: f64,
}

impl Device {
    /// A device without error, with a magnetometer.
    pub fn ideal() -> Self {
        Self {
            accel_density: 0.0,
            gyro_density: 0.0,
            orientation_stddev: 0.0,
            effects: EffectSet::new(),
            unexplained: UnexplainedErrors::default(),
            magnetometer: Some(Magnetometer::default()),
        }
    }

    /// A device with white noise alone: densities in (m/s2)/sqrt(Hz) and (rad/s)/sqrt(Hz), at least
    /// 0.
    pub fn white(accel_density: f64, gyro_density: f64) -> Self {
        Self {
            accel_density,
            gyro_density,
            magnetometer: None,
            ..Self::ideal()
        }
    }

    /// The device with these effects in the place of its own; those of a reference are left out.
    #[must_use]
    pub fn with_effects(self, effects: EffectSet) -> Self {
        Self {
            effects: effects.filtered(|effect| effect.kind().spec().stage != Stage::Reference),
            ..self
        }
    }

    /// Parses a file's text; `file` names it in errors.
    ///
    /// # Errors
    /// [`ImuError::Yaml`], [`ImuError::Schema`], [`ImuError::DeviceNumber`],
    /// [`ImuError::ReferenceEffect`], [`ImuError::Magnetometer`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ImuError> {
        let raw: RawDevice = serde_norway::from_str(text).map_err(|error| ImuError::Yaml {
            file: file.to_owned(),
            problem: in_plain_words(error),
        })?;
        if raw.schema != SCHEMA {
            return Err(ImuError::Schema {
                file: file.to_owned(),
                expected: SCHEMA,
                found: raw.schema,
            });
        }
        let RawNoise {
            accel_density,
            gyro_density,
            orientation_stddev,
        } = raw.declared_noise;
        let fields = [
            ("accel_density", accel_density),
            ("gyro_density", gyro_density),
            ("orientation_stddev", orientation_stddev),
        ];
        if let Some((field, value)) = fields
            .into_iter()
            .chain(raw.unexplained.fields())
            .find(|(_, value)| !(*value >= 0.0 && value.is_finite()))
        {
            return Err(ImuError::DeviceNumber {
                file: file.to_owned(),
                field,
                value,
            });
        }
        let of_reference = |effect: &&Effect| effect.kind().spec().stage == Stage::Reference;
        let effect = raw.effects.iter().find(of_reference);
        let effect = effect.map(|effect| effect.kind().name());
        if let Some(effect) = effect.or_else(|| raw.unexplained.of_clocks()) {
            return Err(ImuError::ReferenceEffect {
                file: file.to_owned(),
                effect,
            });
        }
        let magnetometer = raw.magnetometer.map(RawMagnetometer::parse).transpose();
        let magnetometer = magnetometer.map_err(|problem| ImuError::Magnetometer {
            file: file.to_owned(),
            problem,
        })?;
        Ok(Self {
            magnetometer,
            accel_density,
            gyro_density,
            orientation_stddev,
            effects: raw.effects,
            unexplained: raw.unexplained.into(),
        })
    }

    /// The device of a diagnosed placement: what a device file can hold of it. The others, which are the
    /// reference's or happened at one time, come by their names.
    pub fn of_placement(placement: &PlacementEffects) -> (Self, Vec<&'static str>) {
        let is_of_recording = |effect: &Effect| {
            effect.kind().spec().stage == Stage::Reference || effect.kind() == EffectKind::MountSlip
        };
        let left_out = placement.effects.iter().filter(|it| is_of_recording(it));
        let left_out = left_out.map(|effect| effect.kind().name()).collect();
        let noise = placement.declared_noise;
        let device = Self {
            effects: placement
                .effects
                .filtered(|effect| !is_of_recording(effect)),
            unexplained: UnexplainedErrors {
                late: PerChannel::default(),
                ..placement.unexplained
            },
            magnetometer: placement.magnetometer.clone(),
            ..Self::white(noise.accel_density, noise.gyro_density)
        };
        (device, left_out)
    }

    /// The file's text; parsed again it is the same device. `about` becomes comments at its top.
    pub fn to_yaml(&self, about: &str) -> String {
        let mut text: String = about.lines().map(|line| format!("# {line}\n")).collect();
        let (accel, gyro) = (number(self.accel_density), number(self.gyro_density));
        let orientation = match self.orientation_stddev {
            0.0 => String::new(),
            stddev => format!(", orientation_stddev: {}", number(stddev)),
        };
        text += &format!(
            "schema: {SCHEMA}\ndeclared_noise: {{accel_density: {accel}, gyro_density: {gyro}{orientation}}}   # (m/s2)/sqrt(Hz), (rad/s)/sqrt(Hz)\n"
        );
        if !self.effects.is_empty() {
            text += "effects:\n";
            write_effects(&mut text, "  ", &self.effects);
        }
        write_unexplained(&mut text, "", &self.unexplained);
        text += &self
            .magnetometer
            .as_ref()
            .map(Magnetometer::to_yaml)
            .unwrap_or_default();
        text
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`Device::parse`], and [`ImuError::Unreadable`].
    pub fn read(path: &Path) -> Result<Self, ImuError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| ImuError::Unreadable {
            file: path.to_owned(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// The embedded device of a name.
    ///
    /// # Errors
    /// [`ImuError::UnknownDevice`] with the names there are.
    pub fn embedded(name: &str) -> Result<Self, ImuError> {
        match EMBEDDED_DEVICES.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::parse(text, &format!("{name}.yaml")),
            None => {
                let known = EMBEDDED_DEVICES.map(|(known, _)| known).join(", ");
                Err(ImuError::UnknownDevice {
                    name: name.to_owned(),
                    known,
                })
            }
        }
    }

    /// What a placement's `device` means: a name that ends in .yaml or .yml is a file, relative to
    /// `folder`; any other an embedded device; `None` a device without error.
    ///
    /// # Errors
    /// As [`Device::read`] and [`Device::embedded`].
    pub fn resolve(name: Option<&str>, folder: &Path) -> Result<Self, ImuError> {
        match name {
            None => Ok(Self::ideal()),
            Some(file) if file.ends_with(".yaml") || file.ends_with(".yml") => {
                Self::read(&folder.join(file))
            }
            Some(name) => Self::embedded(name),
        }
    }

    /// Its magnetometer, where it has one.
    pub fn magnetometer(&self) -> Option<&Magnetometer> {
        self.magnetometer.as_ref()
    }

    /// White noise of the accelerometer, (m/s2)/sqrt(Hz).
    pub fn accel_density(&self) -> f64 {
        self.accel_density
    }

    /// White noise of the gyroscope, (rad/s)/sqrt(Hz).
    pub fn gyro_density(&self) -> f64 {
        self.gyro_density
    }

    /// Both densities.
    pub fn declared_noise(&self) -> DeclaredNoise {
        DeclaredNoise {
            accel_density: self.accel_density,
            gyro_density: self.gyro_density,
        }
    }

    /// Standard deviation of the reported orientation about each axis, rad; 0 where it is exact and
    /// its covariance unknown.
    pub fn orientation_stddev(&self) -> f64 {
        self.orientation_stddev
    }

    /// How far its readings are off beyond all that is known of.
    pub fn unexplained(&self) -> UnexplainedErrors {
        self.unexplained
    }

    /// What the device does to readings beyond its declared noise.
    pub fn effects(&self) -> &EffectSet {
        &self.effects
    }
}
