//! Effects files: what a diagnosis found, for `cromosim simulate --effects`.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::Path;

use cromosim_spatial::{MotionResponse, Stamp, in_plain_words};
use nalgebra::Vector3;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};

use super::number::number;
use super::response_file::{RawResponse, write_response};
use super::spec::Shape;
use super::{Effect, EffectSet};
use crate::magnetic::RawMagnetometer;
use crate::{ImuError, Magnetometer, PerChannel};

const SCHEMA: &str = "cromosim/effects/1";

/// The effects of each placement.
///
/// ```yaml
/// schema: cromosim/effects/1
/// placements:
///   wrist:
///     epoch: 1700000000.500000000   # t0, s
///     declared_noise: {accel_density: 0.0014, gyro_density: 0.00012}
///     effects:
///       - {effect: lever_arm, offset: [0.05, 0.0, -0.06]}
///       - {effect: time_offset, seconds: 0.021}
///     unexplained: {accel_variance: 0.0021, gyro_variance: 1.2e-5}   # where something is, and
///     # {accel,gyro}_{reference_excess,late,late_per_second}, see [`UnexplainedErrors`]
///     reference_response: {hz: [0.5, 7.0], accel: [1.0, 0.9], gyro: [1.0, 1.05]}   # where it is not 1;
///     # {position,rotation}_density of the poses that it was learnt from, see [`MotionResponse`]
///     magnetometer: {hard_iron: [5.0e-6, -2.0e-6, 1.0e-6]}   # where one was diagnosed, as in a device file
///     field_in_world: [0.0, 1.9e-5, -4.5e-5]   # T, as that magnetometer measures it
///     other_sessions:   # where several recordings were diagnosed together
///       - epoch: 1690000000.0
///         effects:
///           - {effect: lever_arm, offset: [0.05, 0.0, -0.06]}
/// ```
/// Parameters stand in SI units, see [`super::EffectSpec::parameters`]; a matrix is a list of three
/// rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectsFile {
    /// By name.
    pub placements: BTreeMap<String, PlacementEffects>,
}

/// The effects of one placement.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementEffects {
    /// t0: what depends on time is anchored here, by the IMU's clock.
    pub epoch: Stamp,
    /// White noise that the device declares.
    pub declared_noise: DeclaredNoise,
    /// What acts beyond it.
    pub effects: EffectSet,
    /// How far readings are off beyond all that is known of. It goes into the covariances of
    /// messages, and is never drawn.
    pub unexplained: UnexplainedErrors,
    /// What the readings hold of the motion that the reference shows, by frequency; none where it is all of it.
    pub reference_response: Option<MotionResponse>,
    /// What acts in other sessions of the same device.
    pub other_sessions: Vec<OtherSession>,
    /// Its magnetometer, where one is known of.
    pub magnetometer: Option<Magnetometer>,
    /// The magnetic field of the place in the reference's world, T, where that is known.
    pub field_in_world: Option<Vector3<f64>>,
}

/// How far readings are off beyond the device's noise and the errors that a reference's noise leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnexplainedErrors {
    /// Variance, mean over the axes, whatever the reference: (m/s2)2 and (rad/s)2.
    pub variance: PerChannel<f64>,
    /// And as a part of the variance that the errors of a reference leave: for motion that they cover,
    /// which a better reference shows. Above -1; below zero where the errors turned out smaller.
    pub reference_excess: PerChannel<f64>,
    /// And what readings change by in the time that clocks are apart.
    pub late: PerChannel<Lateness>,
}

/// How late a channel still is against the reference, too little for an effect: at `t` seconds after a
/// recording's first message by `seconds + per_second t`. Clocks of references drift anew in each recording,
/// which is why it goes into the covariances and not into the readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// At the first message, s.
    pub seconds: f64,
    /// And more with each second.
    pub per_second: f64,
}

impl Lateness {
    /// Seconds at a time after the recording's first message.
    pub fn at(&self, seconds: f64) -> f64 {
        self.seconds + self.per_second * seconds
    }
}

/// Another session of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherSession {
    /// Its t0.
    pub epoch: Stamp,
    /// What acts in it.
    pub effects: EffectSet,
    /// What its readings hold of the motion that its reference shows.
    pub reference_response: Option<MotionResponse>,
}

impl PlacementEffects {
    /// With the effects of the session that a recording belongs to, which begins at `start`: the
    /// last that had begun by then, else the first; no other sessions are left.
    #[must_use]
    pub fn in_session_of(&self, start: Stamp) -> Self {
        let own = (self.epoch, &self.effects, &self.reference_response);
        let others = self.other_sessions.iter();
        let sessions = || {
            let of = session_of;
            others.clone().map(of).chain(std::iter::once(own))
        };
        let (epoch, effects, response) = sessions()
            .filter(|(epoch, ..)| *epoch <= start)
            .max_by_key(|(epoch, ..)| *epoch)
            .or_else(|| sessions().min_by_key(|(epoch, ..)| *epoch))
            .unwrap_or(own);
        Self {
            epoch,
            declared_noise: self.declared_noise,
            effects: effects.clone(),
            unexplained: self.unexplained,
            reference_response: response.clone(),
            other_sessions: Vec::new(),
            magnetometer: self.magnetometer.clone(),
            field_in_world: self.field_in_world,
        }
    }
}

/// When it began, and what is its own.
fn session_of(other: &OtherSession) -> (Stamp, &EffectSet, &Option<MotionResponse>) {
    (other.epoch, &other.effects, &other.reference_response)
}

/// White noise densities, one-sided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeclaredNoise {
    /// (m/s2)/sqrt(Hz).
    pub accel_density: f64,
    /// (rad/s)/sqrt(Hz).
    pub gyro_density: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    schema: String,
    placements: BTreeMap<String, RawPlacement>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlacement {
    epoch: Seconds,
    declared_noise: DeclaredNoise,
    effects: EffectSet,
    #[serde(default)]
    unexplained: RawUnexplained,
    reference_response: Option<RawResponse>,
    #[serde(default)]
    other_sessions: Vec<RawSession>,
    magnetometer: Option<RawMagnetometer>,
    field_in_world: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSession {
    epoch: Seconds,
    effects: EffectSet,
    reference_response: Option<RawResponse>,
}

impl RawSession {
    fn parsed(self, file: &str, placement: &str) -> Result<OtherSession, ImuError> {
        Ok(OtherSession {
            epoch: self.epoch.0,
            effects: self.effects,
            reference_response: RawResponse::parsed(self.reference_response, file, placement)?,
        })
    }
}

/// [`UnexplainedErrors`] as files have them.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RawUnexplained {
    accel_variance: f64,
    gyro_variance: f64,
    accel_reference_excess: f64,
    gyro_reference_excess: f64,
    accel_late: f64,
    gyro_late: f64,
    accel_late_per_second: f64,
    gyro_late_per_second: f64,
}

impl RawUnexplained {
    /// Names and sizes, for checks: none may be below zero.
    pub(crate) fn fields(&self) -> [(&'static str, f64); 8] {
        // What an excess of -1 leaves is no variance.
        let of_excess = |excess: f64| if excess > -1.0 { excess.abs() } else { excess };
        [
            ("accel_variance", self.accel_variance),
            ("gyro_variance", self.gyro_variance),
            (
                "accel_reference_excess",
                of_excess(self.accel_reference_excess),
            ),
            (
                "gyro_reference_excess",
                of_excess(self.gyro_reference_excess),
            ),
            ("accel_late", self.accel_late.abs()),
            ("gyro_late", self.gyro_late.abs()),
            ("accel_late_per_second", self.accel_late_per_second.abs()),
            ("gyro_late_per_second", self.gyro_late_per_second.abs()),
        ]
    }

    /// The name of a value that is of a recording's clock and its reference's, and of no device.
    pub(crate) fn of_clocks(&self) -> Option<&'static str> {
        let [.., a, b, c, d] = self.fields();
        let given = [a, b, c, d].into_iter().find(|(_, size)| *size > 0.0);
        given.map(|(name, _)| name)
    }
}

impl From<RawUnexplained> for UnexplainedErrors {
    fn from(raw: RawUnexplained) -> Self {
        Self {
            variance: PerChannel {
                accelerometer: raw.accel_variance,
                gyroscope: raw.gyro_variance,
            },
            reference_excess: PerChannel {
                accelerometer: raw.accel_reference_excess,
                gyroscope: raw.gyro_reference_excess,
            },
            late: PerChannel {
                accelerometer: Lateness {
                    seconds: raw.accel_late,
                    per_second: raw.accel_late_per_second,
                },
                gyroscope: Lateness {
                    seconds: raw.gyro_late,
                    per_second: raw.gyro_late_per_second,
                },
            },
        }
    }
}

/// A decimal number of seconds, read to the nanosecond.
struct Seconds(Stamp);

impl EffectsFile {
    /// Parses a file's text; `file` names it in errors.
    ///
    /// # Errors
    /// [`ImuError::Yaml`] naming placement, effect and field, [`ImuError::Schema`],
    /// [`ImuError::DeviceNumber`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ImuError> {
        let raw: RawFile = serde_norway::from_str(text).map_err(|error| ImuError::Yaml {
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
        let mut placements = BTreeMap::new();
        for (name, placement) in raw.placements {
            let (noise, rest) = (placement.declared_noise, placement.unexplained);
            let densities = [
                ("accel_density", noise.accel_density),
                ("gyro_density", noise.gyro_density),
            ];
            for (field, value) in densities.into_iter().chain(rest.fields()) {
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(ImuError::DeviceNumber {
                        file: format!("{file}: placement `{name}`"),
                        field,
                        value,
                    });
                }
            }
            let magnetometer = placement.magnetometer.map(RawMagnetometer::parse);
            let magnetometer = magnetometer.transpose();
            let magnetometer = magnetometer.map_err(|problem| ImuError::Magnetometer {
                file: format!("{file}: placement `{name}`"),
                problem,
            })?;
            let response = RawResponse::parsed(placement.reference_response, file, &name)?;
            let others = placement.other_sessions.into_iter();
            let others = others.map(|session| session.parsed(file, &name));
            let other_sessions = others.collect::<Result<_, _>>()?;
            placements.insert(
                name,
                PlacementEffects {
                    reference_response: response,
                    magnetometer,
                    field_in_world: placement.field_in_world.map(Vector3::from),
                    epoch: placement.epoch.0,
                    declared_noise: noise,
                    effects: placement.effects,
                    unexplained: rest.into(),
                    other_sessions,
                },
            );
        }
        Ok(Self { placements })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`EffectsFile::parse`], and [`ImuError::Unreadable`].
    pub fn read(path: &Path) -> Result<Self, ImuError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| ImuError::Unreadable {
            file: path.to_owned(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// The file's text; parsed again it is the same to the last digit (times to the nanosecond).
    pub fn to_yaml(&self) -> String {
        let mut text = format!(
            "schema: {SCHEMA}\nplacements:{}\n",
            if self.placements.is_empty() {
                " {}"
            } else {
                ""
            }
        );
        for (name, placement) in &self.placements {
            let DeclaredNoise {
                accel_density,
                gyro_density,
            } = placement.declared_noise;
            let (accel, gyro) = (number(accel_density), number(gyro_density));
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "  {}:\n    epoch: {}\n    declared_noise: {{accel_density: {accel}, gyro_density: {gyro}}}\n    effects:{}\n",
                key(name),
                decimal(placement.epoch),
                if placement.effects.is_empty() {
                    " []"
                } else {
                    ""
                }
            );
            write_effects(&mut text, "      ", &placement.effects);
            write_unexplained(&mut text, "    ", &placement.unexplained);
            write_response(&mut text, "    ", placement.reference_response.as_ref());
            write_magnetic(&mut text, placement);
            write_sessions(&mut text, &placement.other_sessions);
        }
        text
    }
}

/// Nothing where all is explained; of the kinds those that are there.
pub(crate) fn write_unexplained(text: &mut String, indent: &str, rest: &UnexplainedErrors) {
    let late = |of: fn(&Lateness) -> f64| PerChannel::from_fn(|channel| of(&rest.late[channel]));
    let kinds = [
        ("variance", rest.variance),
        ("reference_excess", rest.reference_excess),
        ("late", late(|late| late.seconds)),
        ("late_per_second", late(|late| late.per_second)),
    ];
    let there = kinds
        .iter()
        .filter(|(_, values)| *values != PerChannel::default());
    let fields: Vec<String> = there
        .map(|(name, values)| {
            let (accel, gyro) = (number(values.accelerometer), number(values.gyroscope));
            format!("accel_{name}: {accel}, gyro_{name}: {gyro}")
        })
        .collect();
    if !fields.is_empty() {
        let _ = writeln!(text, "{indent}unexplained: {{{}}}", fields.join(", "));
    }
}

/// Nothing of a placement without a magnetometer.
fn write_magnetic(text: &mut String, placement: &PlacementEffects) {
    let magnetometer = placement.magnetometer.as_ref().map(Magnetometer::to_yaml);
    for line in magnetometer.iter().flat_map(|text| text.lines()) {
        let _ = writeln!(text, "    {line}");
    }
    if let Some(field) = placement.field_in_world {
        let [x, y, z] = [field.x, field.y, field.z].map(number);
        let _ = writeln!(text, "    field_in_world: [{x}, {y}, {z}]");
    }
}

fn write_sessions(text: &mut String, sessions: &[OtherSession]) {
    if !sessions.is_empty() {
        text.push_str("    other_sessions:\n");
    }
    for session in sessions {
        let empty = if session.effects.is_empty() {
            " []"
        } else {
            ""
        };
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "      - epoch: {}\n        effects:{empty}\n",
            decimal(session.epoch)
        );
        write_effects(text, "          ", &session.effects);
        write_response(text, "        ", session.reference_response.as_ref());
    }
}

pub(crate) fn write_effects(text: &mut String, indent: &str, effects: &EffectSet) {
    for effect in effects {
        let _ = writeln!(text, "{indent}- {}", flow(effect));
    }
}

/// `{effect: lever_arm, offset: [0.05, 0.0, -0.06]}`.
fn flow(effect: &Effect) -> String {
    let mut text = format!("{{effect: {}", effect.kind().name());
    let list = |values: &[f64]| {
        format!(
            "[{}]",
            values
                .iter()
                .map(|value| number(*value))
                .collect::<Vec<_>>()
                .join(", ")
        )
    };
    for (parameter, values) in effect.written_parameters() {
        let value = match parameter.shape {
            Shape::Scalar => values
                .first()
                .map(|value| number(*value))
                .unwrap_or_default(),
            Shape::Time => values
                .first()
                .map(|value| format!("{value:.9}"))
                .unwrap_or_default(),
            Shape::Vector3 => list(values),
            Shape::Matrix3 => format!(
                "[{}]",
                values.chunks(3).map(list).collect::<Vec<_>>().join(", ")
            ),
            Shape::Choice(words) => values
                .first()
                .and_then(|value| words.get(*value as usize))
                .copied()
                .unwrap_or_default()
                .to_owned(),
        };
        let _ = write!(text, ", {}: {value}", parameter.name);
    }
    text + "}"
}

/// Seconds with nine decimals, exactly.
fn decimal(stamp: Stamp) -> String {
    let sign = if stamp.nanos < 0 { "-" } else { "" };
    let nanos = stamp.nanos.unsigned_abs();
    format!(
        "{sign}{}.{:09}",
        nanos / 1_000_000_000,
        nanos % 1_000_000_000
    )
}

/// A name as a key: in quotes where YAML would read something else than a string.
fn key(name: &str) -> String {
    const WORDS: [&str; 10] = [
        "true", "false", "null", "yes", "no", "on", "off", "y", "n", "nan",
    ];
    let plain = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !WORDS.contains(&name.to_ascii_lowercase().as_str());
    if plain {
        name.to_owned()
    } else {
        format!("'{}'", name.replace('\'', "''"))
    }
}

impl<'de> Deserialize<'de> for Seconds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Digits;
        impl Visitor<'_> for Digits {
            type Value = Seconds;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("seconds, such as 1700000000.500000000")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Seconds, E> {
                nanoseconds(text)
                    .map(|nanos| Seconds(Stamp::from_nanos(nanos)))
                    .ok_or_else(|| {
                        E::custom(format!(
                            "epoch: `{text}` is no number of seconds, such as 1700000000.500000000"
                        ))
                    })
            }
        }
        // As text: as a number it would be rounded to the quarter of a microsecond.
        deserializer.deserialize_str(Digits)
    }
}

/// Nanoseconds of a decimal number of seconds, digits beyond the ninth decimal rounded.
fn nanoseconds(text: &str) -> Option<i64> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if !all_digits(whole) || !all_digits(fraction) || whole.is_empty() {
        let seconds: f64 = text.parse().ok()?;
        return (seconds.abs() < 9e9).then(|| Stamp::from_seconds(seconds).nanos);
    }
    let nine: i64 = format!("{:0<9.9}", fraction).parse().ok()?;
    let up = i64::from(
        fraction
            .as_bytes()
            .get(9)
            .is_some_and(|digit| *digit >= b'5'),
    );
    let nanos = whole
        .parse::<i64>()
        .ok()?
        .checked_mul(1_000_000_000)?
        .checked_add(nine + up)?;
    Some(if negative { -nanos } else { nanos })
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
