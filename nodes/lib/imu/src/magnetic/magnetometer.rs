//! A device's magnetometer.

use std::sync::Arc;

use cromosim_msgs::sensor_msgs::MagneticField;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Matrix3, Vector3};
use rand_chacha::ChaCha12Rng;
use serde::Deserialize;

use super::AmbientField;
use crate::effects::DelayLine;
use crate::effects::number;
use crate::random::{MAGNETOMETER_CHANNEL, normal_pair, stream};

/// What a magnetometer does to the field at its place.
///
/// ```text
/// m_S(t) = round(clip(S R_SW(t - delay) B_W(t - delay) + h + n))      T, sensor axes
/// ```
/// with the field B of the place in the world, the soft iron S (3x3: scale, misalignment and the iron that
/// turns with the device), the hard iron h (T: what is magnetic on the device) and white noise n. In a device
/// file, all of it may be left out:
/// ```yaml
/// magnetometer:
///   noise_density: 1.0e-8                       # T/sqrt(Hz)
///   hard_iron: [5.0e-6, -2.0e-6, 1.0e-6]        # T
///   hard_iron_deviation: [2.0e-6, 2.0e-6, 2.0e-6]   # T, drawn anew for each device and run
///   soft_iron: [[1.02, 0.01, 0], [0.01, 0.98, 0], [0, 0, 1]]
///   delay: 0.01                                 # s, behind the accelerometer under the same stamp
///   lsb: 1.5e-7                                 # T
///   limit: 4.9e-3                               # T, each axis
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Magnetometer {
    /// White noise, T/sqrt(Hz); per sample density sqrt(rate).
    pub noise_density: f64,
    /// T, sensor axes.
    pub hard_iron: Vector3<f64>,
    /// Standard deviation of what is drawn beside it for each device and run, T.
    pub hard_iron_deviation: Vector3<f64>,
    /// Rows x, y, z.
    pub soft_iron: Matrix3<f64>,
    /// How late it is against the accelerometer under the same stamp, s; negative where the accelerometer
    /// is the later one.
    pub delay: f64,
    /// Step of the readings, T; 0: none.
    pub lsb: f64,
    /// The largest value of an axis, T; none: no limit.
    pub limit: Option<f64>,
}

impl Default for Magnetometer {
    fn default() -> Self {
        Self {
            noise_density: 0.0,
            hard_iron: Vector3::zeros(),
            hard_iron_deviation: Vector3::zeros(),
            soft_iron: Matrix3::identity(),
            delay: 0.0,
            lsb: 0.0,
            limit: None,
        }
    }
}

/// As a device file has it.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct RawMagnetometer {
    noise_density: f64,
    hard_iron: [f64; 3],
    hard_iron_deviation: [f64; 3],
    soft_iron: Option<[[f64; 3]; 3]>,
    delay: f64,
    lsb: f64,
    limit: Option<f64>,
}

impl RawMagnetometer {
    /// `Err`: field, value and what was expected.
    pub fn parse(self) -> Result<Magnetometer, String> {
        let rows = self
            .soft_iron
            .unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let soft_iron = Matrix3::from_row_slice(&rows.concat());
        let is_sound = |value: f64, range: [f64; 2]| (range[0]..=range[1]).contains(&value);
        // As wide as devices that people wear come; beyond it another unit was meant.
        let (tesla, sizes) = ([-0.01, 0.01], [0.0, 0.01]);
        let mut checks = vec![
            ("noise_density", self.noise_density, sizes, "T/sqrt(Hz)"),
            ("delay", self.delay, [-0.2, 1.0], "s"),
            ("lsb", self.lsb, sizes, "T"),
            ("limit", self.limit.unwrap_or(1e-3), [1e-6, 1.0], "T"),
        ];
        checks.extend(self.hard_iron.map(|value| ("hard_iron", value, tesla, "T")));
        let drawn = self.hard_iron_deviation;
        checks.extend(drawn.map(|value| ("hard_iron_deviation", value, sizes, "T")));
        let entries = soft_iron.iter();
        checks.extend(entries.map(|value| ("soft_iron", *value, [-100.0, 100.0], "no unit")));
        if let Some((field, value, [from, to], unit)) = checks
            .into_iter()
            .find(|(_, value, range, _)| !is_sound(*value, *range))
        {
            return Err(format!(
                "magnetometer: {field}: {value} is out of range; expected {from} to {to} ({unit})"
            ));
        }
        if soft_iron.determinant().abs() < 1e-6 {
            return Err(
                "magnetometer: soft_iron: without an inverse; expected a matrix near the identity"
                    .to_owned(),
            );
        }
        Ok(Magnetometer {
            noise_density: self.noise_density,
            hard_iron: self.hard_iron.into(),
            hard_iron_deviation: self.hard_iron_deviation.into(),
            soft_iron,
            delay: self.delay,
            lsb: self.lsb,
            limit: self.limit,
        })
    }
}

impl Magnetometer {
    /// The lines of a device file, parsed again the same.
    pub(crate) fn to_yaml(&self) -> String {
        let neutral = Self::default();
        let vector = |of: &[f64]| {
            let values: Vec<String> = of.iter().map(|value| number(*value)).collect();
            format!("[{}]", values.join(", "))
        };
        let mut lines = Vec::new();
        let mut line = |is_there: bool, text: String| lines.extend(is_there.then_some(text));
        line(
            self.noise_density != neutral.noise_density,
            format!("noise_density: {}", number(self.noise_density)),
        );
        line(
            self.hard_iron != neutral.hard_iron,
            format!("hard_iron: {}", vector(self.hard_iron.as_slice())),
        );
        line(
            self.hard_iron_deviation != neutral.hard_iron_deviation,
            format!(
                "hard_iron_deviation: {}",
                vector(self.hard_iron_deviation.as_slice())
            ),
        );
        let rows = self.soft_iron.transpose();
        let rows: Vec<String> = rows.as_slice().chunks(3).map(vector).collect();
        line(
            self.soft_iron != neutral.soft_iron,
            format!("soft_iron: [{}]", rows.join(", ")),
        );
        line(self.delay != 0.0, format!("delay: {}", number(self.delay)));
        line(self.lsb != 0.0, format!("lsb: {}", number(self.lsb)));
        let limit = self.limit.unwrap_or_default();
        line(self.limit.is_some(), format!("limit: {}", number(limit)));
        if lines.is_empty() {
            return "magnetometer: {}\n".to_owned();
        }
        format!("magnetometer:\n  {}\n", lines.join("\n  "))
    }

    /// Variance per sample and axis of readings at a rate, T2: noise, rounding (step^2 / 12) and the spread
    /// of the hard iron, mean over the axes.
    pub fn variance(&self, rate_hz: f64) -> f64 {
        self.noise_density.powi(2) * rate_hz
            + self.lsb.powi(2) / 12.0
            + self.hard_iron_deviation.norm_squared() / 3.0
    }

    /// Of the field at the sensor, in its axes, without noise.
    fn linear(&self, field_in_sensor: &Vector3<f64>) -> Vector3<f64> {
        self.soft_iron * field_in_sensor + self.hard_iron
    }

    /// Clipped and rounded.
    fn digital(&self, reading: Vector3<f64>) -> Vector3<f64> {
        let clipped = match self.limit {
            Some(limit) => reading.map(|value| value.clamp(-limit, limit)),
            None => reading,
        };
        if self.lsb > 0.0 {
            clipped.map(|value| (value / self.lsb).round() * self.lsb)
        } else {
            clipped
        }
    }
}

/// One device's magnetometer in one field: poses of the sensor go in, in order of time, readings come out.
#[derive(Clone, Debug)]
pub(crate) struct MagneticSensor {
    model: Magnetometer,
    field: Arc<AmbientField>,
    delay: Option<DelayLine>,
    /// None: without the random part.
    noise: Option<ChaCha12Rng>,
    sigma: f64,
    /// Beside the model's.
    drawn_hard_iron: Vector3<f64>,
    variance: f64,
    epoch: Option<Stamp>,
}

impl MagneticSensor {
    /// `name` and seed are what the random numbers depend on.
    pub fn new(
        model: &Magnetometer,
        field: Arc<AmbientField>,
        rate_hz: f64,
        noise: Option<(u64, &str)>,
    ) -> Self {
        let random =
            |number| noise.map(|(seed, name)| stream(seed, name, MAGNETOMETER_CHANNEL + number));
        let drawn = random(1).map(|mut random| normal(&mut random));
        Self {
            field,
            delay: (model.delay != 0.0).then(|| DelayLine::new(model.delay)),
            noise: random(0),
            sigma: model.noise_density * rate_hz.sqrt(),
            drawn_hard_iron: drawn
                .unwrap_or_default()
                .component_mul(&model.hard_iron_deviation),
            variance: model.variance(rate_hz),
            epoch: None,
            model: model.clone(),
        }
    }

    /// Begins anew with the next pose; noise goes on.
    pub fn reset(&mut self) {
        self.epoch = None;
        self.delay.iter_mut().for_each(DelayLine::reset);
    }

    /// The reading of a pose of the sensor, T in sensor axes. `stamp` is the pose's.
    pub fn read(&mut self, world_from_sensor: &Isometry3<f64>, stamp: Stamp) -> Vector3<f64> {
        let field = self.field.at(&world_from_sensor.translation.vector);
        self.read_field(world_from_sensor.rotation.inverse() * field, stamp)
    }

    /// The field that it is in, at a point of the world (m), T in world axes.
    pub fn field_at(&self, position_in_world: &Vector3<f64>) -> Vector3<f64> {
        self.field.at(position_in_world)
    }

    /// The reading of a field in the sensor's axes, T.
    pub fn read_field(&mut self, mut field: Vector3<f64>, stamp: Stamp) -> Vector3<f64> {
        if let Some(delay) = &mut self.delay {
            let epoch = *self.epoch.get_or_insert(stamp);
            field = delay.push(stamp - epoch, field);
        }
        let noise = self.noise.as_mut().map(normal).unwrap_or_default() * self.sigma;
        self.model
            .digital(self.model.linear(&field) + self.drawn_hard_iron + noise)
    }

    /// The message of a reading.
    pub fn message(&self, reading: Vector3<f64>, stamp: Stamp, frame_id: &str) -> MagneticField {
        let mut covariance = [0.0; 9];
        for axis in 0..3 {
            covariance[4 * axis] = self.variance;
        }
        MagneticField {
            header: Header::new(stamp.nanos, frame_id),
            magnetic_field: reading.into(),
            magnetic_field_covariance: covariance,
        }
    }
}

/// Three independent standard normal numbers.
fn normal(random: &mut ChaCha12Rng) -> Vector3<f64> {
    let [x, y] = normal_pair(random);
    let [z, _] = normal_pair(random);
    Vector3::new(x, y, z)
}

#[cfg(test)]
#[path = "magnetometer_tests.rs"]
mod tests;
