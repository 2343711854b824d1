//! Distribution mapping by ranks (Conover and Iman 1981): a simulated value takes the measured
//! value of the same rank.
//!
//! Per channel `y = Q_measured(F_simulated(x))`, F and Q the empirical distribution functions with
//! the ranks' places (i - 1/2) / n, linear in between; equal simulated values share their mean
//! rank. Beyond the ends `y = x + (end_measured - end_simulated)`. The map rises, and takes the
//! simulated sample it was fitted on to the measured one's quantiles.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use cromosim_imu::{Reading, ReadingMapping};
use cromosim_spatial::in_plain_words;
use serde::Deserialize;

use crate::LearnedError;
use crate::tensors::write_whole;

const SCHEMA: &str = "cromosim/mapping/1";
/// More knots than this a channel are thinned to as many quantiles.
const MAX_KNOTS: usize = 512;
/// Fewer values say nothing of a distribution.
const LEAST: usize = 20;
/// Names of the channels, in order.
const CHANNELS: [&str; 6] = [
    "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z",
];

/// The map of one channel: knots that rise.
#[derive(Clone, Debug, PartialEq)]
pub struct RankMapping {
    simulated: Vec<f64>,
    measured: Vec<f64>,
}

impl RankMapping {
    /// Fits the map; the samples need neither be paired nor equally many. Values that are not
    /// finite are left out.
    ///
    /// # Errors
    /// [`LearnedError::TooFew`] for less than 20 values on a side.
    pub fn fit(simulated: &[f64], measured: &[f64], what: &str) -> Result<Self, LearnedError> {
        let (simulated, measured) = (sorted(simulated), sorted(measured));
        let found = simulated.len().min(measured.len());
        if found < LEAST {
            return Err(LearnedError::TooFew {
                what: format!("distribution mapping of {what}"),
                found,
                needed: LEAST,
            });
        }
        let mut knots: Vec<(f64, f64)> = Vec::new();
        let mut first = 0;
        while first < simulated.len() {
            let equal = simulated[first..]
                .iter()
                .take_while(|value| **value == simulated[first])
                .count();
            let mean_rank = (first as f64 + 0.5 * equal as f64) / simulated.len() as f64;
            knots.push((simulated[first], quantile(&measured, mean_rank)));
            first += equal;
        }
        Ok(Self::from_knots(thinned(knots)))
    }

    fn from_knots(knots: Vec<(f64, f64)>) -> Self {
        let (simulated, measured) = knots.into_iter().unzip();
        Self {
            simulated,
            measured,
        }
    }

    /// The mapped value.
    pub fn apply(&self, value: f64) -> f64 {
        let last = self.simulated.len() - 1;
        let after = self.simulated.partition_point(|knot| *knot < value);
        if after > last {
            return value + (self.measured[last] - self.simulated[last]);
        }
        // A knot itself without rounding.
        if self.simulated[after] == value {
            return self.measured[after];
        }
        if after == 0 {
            return value + (self.measured[0] - self.simulated[0]);
        }
        let (from, to) = (self.simulated[after - 1], self.simulated[after]);
        let part = (value - from) / (to - from);
        self.measured[after - 1] + part * (self.measured[after] - self.measured[after - 1])
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = values
        .iter()
        .copied()
        .filter(|value| value.is_finite())
        .collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The value at a place between 0 and 1: order statistic i stands at (i - 1/2) / n.
fn quantile(sorted: &[f64], place: f64) -> f64 {
    // Rounding of the place must not blur a value that is met exactly.
    let position = (place * sorted.len() as f64 - 0.5).clamp(0.0, (sorted.len() - 1) as f64);
    let nearest = position.round();
    if (position - nearest).abs() < 1e-9 {
        return sorted[nearest as usize];
    }
    let before = position.floor() as usize;
    let part = position - before as f64;
    sorted[before] + part * (sorted[before + 1] - sorted[before])
}

/// At most [`MAX_KNOTS`], both ends among them.
fn thinned(knots: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if knots.len() <= MAX_KNOTS {
        return knots;
    }
    let last = knots.len() - 1;
    (0..MAX_KNOTS)
        .map(|k| knots[(k * last + (MAX_KNOTS - 1) / 2) / (MAX_KNOTS - 1)])
        .collect()
}

/// The maps of one placement: specific force x, y, z (m/s2), angular velocity x, y, z (rad/s),
/// sensor axes.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementMapping([RankMapping; 6]);

impl PlacementMapping {
    /// Fits all six channels.
    ///
    /// # Errors
    /// As [`RankMapping::fit`].
    pub fn fit(
        simulated: &[Reading],
        measured: &[Reading],
        placement: &str,
    ) -> Result<Self, LearnedError> {
        let fit = |channel: usize| {
            let of = |readings: &[Reading]| {
                readings
                    .iter()
                    .map(|reading| values(reading)[channel])
                    .collect::<Vec<_>>()
            };
            RankMapping::fit(
                &of(simulated),
                &of(measured),
                &format!("{placement}, {}", CHANNELS[channel]),
            )
        };
        Ok(Self([fit(0)?, fit(1)?, fit(2)?, fit(3)?, fit(4)?, fit(5)?]))
    }

    /// The mapped reading.
    pub fn apply(&self, reading: &Reading) -> Reading {
        let values = values(reading);
        let mapped: [f64; 6] =
            std::array::from_fn(|channel| self.0[channel].apply(values[channel]));
        Reading {
            specific_force: [mapped[0], mapped[1], mapped[2]].into(),
            angular_velocity: [mapped[3], mapped[4], mapped[5]].into(),
        }
    }
}

impl ReadingMapping for PlacementMapping {
    fn map(&self, reading: &Reading) -> Reading {
        self.apply(reading)
    }
}

fn values(reading: &Reading) -> [f64; 6] {
    [
        reading.specific_force.x,
        reading.specific_force.y,
        reading.specific_force.z,
        reading.angular_velocity.x,
        reading.angular_velocity.y,
        reading.angular_velocity.z,
    ]
}

/// The maps of several placements.
///
/// ```yaml
/// schema: cromosim/mapping/1
/// placements:
///   left_wrist:
///     accel_x: {simulated: [-9.1, 0.2, 8.7], measured: [-9.4, 0.1, 9.9]}   # m/s2; both rise
///     # accel_y, accel_z, gyro_x, gyro_y, gyro_z (rad/s) likewise
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MappingFile {
    /// By name.
    pub placements: BTreeMap<String, PlacementMapping>,
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
    accel_x: RawChannel,
    accel_y: RawChannel,
    accel_z: RawChannel,
    gyro_x: RawChannel,
    gyro_y: RawChannel,
    gyro_z: RawChannel,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawChannel {
    simulated: Vec<f64>,
    measured: Vec<f64>,
}

impl MappingFile {
    /// Parses a file's text; `file` names it in errors.
    ///
    /// # Errors
    /// [`LearnedError::Yaml`], [`LearnedError::Schema`], [`LearnedError::Knots`].
    pub fn parse(text: &str, file: &str) -> Result<Self, LearnedError> {
        let raw: RawFile = serde_norway::from_str(text).map_err(|error| LearnedError::Yaml {
            file: file.to_owned(),
            problem: in_plain_words(error),
        })?;
        if raw.schema != SCHEMA {
            return Err(LearnedError::Schema {
                file: file.to_owned(),
                expected: SCHEMA,
                found: raw.schema,
            });
        }
        let mut placements = BTreeMap::new();
        for (name, raw) in raw.placements {
            let check = |channel: &'static str, raw: RawChannel| {
                checked(raw).map_err(|problem| LearnedError::Knots {
                    file: file.to_owned(),
                    placement: name.clone(),
                    channel,
                    problem,
                })
            };
            let [ax, ay, az, gx, gy, gz] = CHANNELS;
            let mapping = PlacementMapping([
                check(ax, raw.accel_x)?,
                check(ay, raw.accel_y)?,
                check(az, raw.accel_z)?,
                check(gx, raw.gyro_x)?,
                check(gy, raw.gyro_y)?,
                check(gz, raw.gyro_z)?,
            ]);
            placements.insert(name, mapping);
        }
        Ok(Self { placements })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`MappingFile::parse`], and [`LearnedError::Read`].
    pub fn read(path: &Path) -> Result<Self, LearnedError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| LearnedError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// [`LearnedError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), LearnedError> {
        write_whole(path, self.to_yaml().as_bytes())
    }

    /// The file's text; parsed again it is the same to the last digit.
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
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "  \"{}\":",
                name.replace('\\', "\\\\").replace('"', "\\\"")
            );
            for (channel, mapping) in CHANNELS.iter().zip(&placement.0) {
                let list = |values: &[f64]| {
                    values
                        .iter()
                        .map(|value| format!("{value:?}"))
                        .collect::<Vec<_>>()
                        .join(", ")
                };
                let _ = writeln!(
                    text,
                    "    {channel}: {{simulated: [{}], measured: [{}]}}",
                    list(&mapping.simulated),
                    list(&mapping.measured)
                );
            }
        }
        text
    }
}

fn checked(raw: RawChannel) -> Result<RankMapping, &'static str> {
    if raw.simulated.is_empty() || raw.simulated.len() != raw.measured.len() {
        return Err("expected as many measured as simulated values, at least one");
    }
    if !raw
        .simulated
        .iter()
        .chain(&raw.measured)
        .all(|value| value.is_finite())
    {
        return Err("a value is not finite");
    }
    if !raw.simulated.is_sorted_by(|a, b| a < b) || !raw.measured.is_sorted() {
        return Err("simulated values must rise, measured ones must not fall");
    }
    Ok(RankMapping {
        simulated: raw.simulated,
        measured: raw.measured,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    use super::*;

    fn draw(count: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| cromosim_imu::normal_pair(&mut random)[0])
            .collect()
    }

    #[test]
    fn the_simulated_sample_becomes_the_measured_one() {
        let (simulated, measured) = (
            draw(400, 1),
            draw(400, 2)
                .iter()
                .map(|x| 3.0 * x.powi(3) + 1.0)
                .collect::<Vec<_>>(),
        );
        let mapping = RankMapping::fit(&simulated, &measured, "test").unwrap();
        let mapped: Vec<f64> = sorted(&simulated)
            .into_iter()
            .map(|value| mapping.apply(value))
            .collect();
        assert_eq!(mapped, sorted(&measured));
    }

    #[test]
    fn its_own_data_stay_as_they_are() {
        let own = draw(300, 3);
        let mapping = RankMapping::fit(&own, &own, "test").unwrap();
        assert!(own.iter().all(|value| mapping.apply(*value) == *value));
    }

    #[test]
    fn the_map_rises_and_is_defined_everywhere() {
        let mut random = ChaCha12Rng::seed_from_u64(4);
        // Many equal values, as from a coarse converter, and more of them than knots.
        let coarse: Vec<f64> = draw(5000, 5)
            .iter()
            .map(|x| (x * 8.0).round() / 8.0)
            .collect();
        let mapping = RankMapping::fit(&coarse, &draw(777, 6), "test").unwrap();
        let mut values: Vec<f64> = (0..2000)
            .map(|_| random.random_range(-40.0..40.0))
            .collect();
        values.sort_by(f64::total_cmp);
        let mapped: Vec<f64> = values.iter().map(|value| mapping.apply(*value)).collect();
        assert!(mapped.is_sorted() && mapped.iter().all(|value| value.is_finite()));
        // Beyond the ends values keep their distances.
        assert!((mapping.apply(31.0) - mapping.apply(30.0) - 1.0).abs() < 1e-12);
        assert!((mapping.apply(-30.0) - mapping.apply(-31.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn thinned_knots_stay_close() {
        let (simulated, measured) = (
            draw(20_000, 7),
            draw(20_000, 8).iter().map(|x| 2.0 * x).collect::<Vec<_>>(),
        );
        let mapping = RankMapping::fit(&simulated, &measured, "test").unwrap();
        assert_eq!(mapping.simulated.len(), MAX_KNOTS);
        for value in [-1.5, -0.4, 0.0, 0.9, 1.7] {
            assert!(
                (mapping.apply(value) - 2.0 * value).abs() < 0.1,
                "{value}: {}",
                mapping.apply(value)
            );
        }
    }

    #[test]
    fn files_keep_every_digit_and_bad_ones_are_named() {
        let reading = |x: f64| Reading {
            specific_force: Vector3::new(x, 2.0 * x, 9.8 + x),
            angular_velocity: Vector3::new(-x, 0.1 * x, x * x),
        };
        let of = |seed| draw(64, seed).into_iter().map(reading).collect::<Vec<_>>();
        let mapping = PlacementMapping::fit(&of(1), &of(2), "wrist").unwrap();
        let file = MappingFile {
            placements: BTreeMap::from([("wrist".to_owned(), mapping)]),
        };
        let text = file.to_yaml();
        assert_eq!(MappingFile::parse(&text, "m.yaml").unwrap(), file);
        let falls = text
            .replacen("measured: [", "measured: [1e9, ", 1)
            .replacen("simulated: [", "simulated: [-1e9, ", 1);
        let error = MappingFile::parse(&falls, "m.yaml")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("m.yaml: placement `wrist`, accel_x"),
            "{error}"
        );
        let few = RankMapping::fit(&[1.0; 3], &[2.0; 100], "wrist, accel_x")
            .unwrap_err()
            .to_string();
        assert!(
            few.contains("wrist, accel_x: 3 samples, at least 20"),
            "{few}"
        );
    }
}
