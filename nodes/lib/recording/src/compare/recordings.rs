//! The IMUs of two recordings: rate, noise, rest, spectra, distributions; lag and difference where
//! they overlap in time.

use std::collections::BTreeMap;
use std::ops::Range;

use cromosim_bag::BagReader;
use cromosim_gap::monitor::{ImuReading, MonitorOptions, Pace, assess, noise_floors, pace};
use cromosim_imu::{Channel, PerChannel};
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::{Spectrum, Stamp, welch};
use serde_json::{Value, json};

use super::text::{line, only_in, significant};
use super::{Comparison, RecordingError};
use crate::topics::{TopicMap, check_imu_topic};

/// Length of a stretch that is looked at for rest, s.
const REST_S: f64 = 1.0;
/// At rest, both channels scatter by less than three times their noise, or than this, m/s2 and
/// rad/s.
const REST_SCATTER: PerChannel<f64> = PerChannel {
    accelerometer: 0.05,
    gyroscope: 0.01,
};
/// Window of a spectrum, s.
const SPECTRUM_S: f64 = 4.0;
/// Points at which spectra and distributions are compared.
const POINTS: usize = 1000;

/// What is said of one IMU of one recording.
struct Series {
    readings: Vec<ImuReading>,
    pace: Pace,
    floors: PerChannel<f64>,
    /// Mean of all readings in stretches of rest, and how many seconds of these there are.
    rest: Option<([f64; 6], f64)>,
}

/// What differs between the IMUs (`/imu/NAME/data_raw`, or as `named` says) of two recordings: rates, losses, noise,
/// readings at rest, spectra (dB), distributions (Wasserstein-1); where they overlap in time also the
/// lag of A behind B and what is left of their difference.
///
/// # Errors
/// Where they have no IMU in common, or a bag cannot be read.
pub fn compare_recordings(
    a: &BagReader,
    b: &BagReader,
    named: &TopicMap,
) -> Result<Comparison, RecordingError> {
    let mut text = String::new();
    let text = &mut text;
    check_named(a, b, named)?;
    let (topics_a, topics_b) = (topics(a, named), topics(b, named));
    let mut placements = serde_json::Map::new();
    for (name, topic) in &topics_a {
        let Some(other) = topics_b.get(name) else {
            continue;
        };
        line!(text, "\n{name}");
        let (one, other) = (Series::read(a, topic)?, Series::read(b, other)?);
        if one.readings.len() < 2 || other.readings.len() < 2 {
            line!(
                text,
                "  too few messages: A has {}, B has {}",
                one.readings.len(),
                other.readings.len()
            );
            continue;
        }
        placements.insert(name.clone(), compare_series(text, &one, &other));
    }
    let lacking =
        |one: &BTreeMap<String, String>, other: &BTreeMap<String, String>| -> Vec<String> {
            one.keys()
                .filter(|name| !other.contains_key(*name))
                .cloned()
                .collect()
        };
    let (only_a, only_b) = (lacking(&topics_a, &topics_b), lacking(&topics_b, &topics_a));
    if topics_a.keys().all(|name| !topics_b.contains_key(name)) {
        let names = |topics: &BTreeMap<String, String>| {
            if topics.is_empty() {
                "none".to_owned()
            } else {
                topics.keys().cloned().collect::<Vec<_>>().join(", ")
            }
        };
        return Err(RecordingError::NothingInCommon {
            what: "the recordings have no IMU (/imu/NAME/data_raw)",
            a: names(&topics_a),
            b: names(&topics_b),
        });
    }
    only_in(text, "A", &only_a);
    only_in(text, "B", &only_b);
    Ok(Comparison {
        text: std::mem::take(text),
        json: json!({"kind": "recordings", "placements": placements, "only_in_a": only_a, "only_in_b": only_b}),
    })
}

/// Topics of IMUs by placement: `.../NAME/data_raw`, below `/imu` before others of the same name.
fn topics(reader: &BagReader, named: &TopicMap) -> BTreeMap<String, String> {
    let mut found: BTreeMap<String, String> = BTreeMap::new();
    if !named.imus.is_empty() {
        for (name, topic) in &named.imus {
            let standard = format!("/imu/{name}/data_raw");
            let of_side = [topic.clone(), standard];
            let has = |topic: &String| check_imu_topic(reader, topic).is_ok();
            found.extend(
                of_side
                    .into_iter()
                    .find(has)
                    .map(|topic| (name.clone(), topic)),
            );
        }
        return found;
    }
    for counted in &reader.summary().topics {
        let topic = &counted.topic.name;
        let Some(name) = topic
            .strip_suffix("/data_raw")
            .and_then(|path| path.rsplit('/').next())
        else {
            continue;
        };
        if counted.topic.type_name == Imu::TYPE_NAME
            && (topic.starts_with("/imu/") || !found.contains_key(name))
        {
            found.insert(name.to_owned(), topic.clone());
        }
    }
    found
}

/// A topic that neither side has is a slip.
fn check_named(a: &BagReader, b: &BagReader, named: &TopicMap) -> Result<(), RecordingError> {
    let sides = |topic: &String| check_imu_topic(b, topic).or_else(|_| check_imu_topic(a, topic));
    named.imus.values().try_for_each(sides)
}

impl Series {
    fn read(reader: &BagReader, topic: &str) -> Result<Self, RecordingError> {
        let reading = |(_, imu): (Stamp, Imu)| {
            let (f, w) = (imu.linear_acceleration, imu.angular_velocity);
            ImuReading {
                stamp: Stamp::from_nanos(imu.header.stamp.nanos()),
                values: [f.x, f.y, f.z, w.x, w.y, w.z],
            }
        };
        let mut readings: Vec<ImuReading> = reader
            .read::<Imu>(topic)?
            .into_iter()
            .map(reading)
            .collect();
        readings.retain(|reading| reading.values.iter().all(|value| value.is_finite()));
        readings.sort_by_key(|reading| reading.stamp);
        readings.dedup_by_key(|reading| reading.stamp);
        let (pace, floors) = (pace(&readings), noise_floors(&readings));
        let rest = rest(&readings, pace.rate_hz, floors);
        Ok(Self {
            readings,
            pace,
            floors,
            rest,
        })
    }

    fn axis(&self, axis: usize) -> Vec<f64> {
        self.readings
            .iter()
            .map(|reading| reading.values[axis])
            .collect()
    }
}

/// Mean of the readings in stretches of a second in which nothing moves.
fn rest(readings: &[ImuReading], rate_hz: f64, floors: PerChannel<f64>) -> Option<([f64; 6], f64)> {
    let length = ((REST_S * rate_hz) as usize).max(5);
    let (mut sum, mut count) = ([0.0; 6], 0usize);
    for stretch in readings.chunks_exact(length) {
        let mean: [f64; 6] = std::array::from_fn(|axis| {
            stretch
                .iter()
                .map(|reading| reading.values[axis])
                .sum::<f64>()
                / length as f64
        });
        let scatter = |axis: usize| {
            (stretch
                .iter()
                .map(|reading| (reading.values[axis] - mean[axis]).powi(2))
                .sum::<f64>()
                / length as f64)
                .sqrt()
        };
        let limit = |axis: usize| {
            let channel = Channel::ALL[axis / 3];
            (3.0 * floors[channel]).max(REST_SCATTER[channel])
        };
        if (0..6).all(|axis| scatter(axis) < limit(axis)) {
            (0..6).for_each(|axis| sum[axis] += mean[axis] * length as f64);
            count += length;
        }
    }
    (count > 0).then(|| (sum.map(|sum| sum / count as f64), count as f64 / rate_hz))
}

fn compare_series(text: &mut String, a: &Series, b: &Series) -> Value {
    describe_pace_and_noise(text, a, b);
    describe_rest(text, a, b);
    let channels = compare_channels(text, a, b);
    json!({"a": described(a), "b": described(b), "channels": channels, "overlap": overlap(text, a, b)})
}

fn describe_pace_and_noise(text: &mut String, a: &Series, b: &Series) {
    line!(
        text,
        "  {:26}{:>14}{:>14}{:>16}",
        "",
        "A",
        "B",
        "difference"
    );
    row(
        text,
        "messages",
        a.readings.len().to_string(),
        b.readings.len().to_string(),
        String::new(),
    );
    let (rate_a, rate_b) = (a.pace.rate_hz, b.pace.rate_hz);
    row(
        text,
        "rate, Hz",
        format!("{rate_a:.2}"),
        format!("{rate_b:.2}"),
        format!("{:+.2}", rate_b - rate_a),
    );
    row(
        text,
        "dropped",
        a.pace.dropped.to_string(),
        b.pace.dropped.to_string(),
        String::new(),
    );
    for channel in Channel::ALL {
        let (name, unit) = (channel.prefix(), channel.unit());
        let (one, other) = (a.floors[channel], b.floors[channel]);
        row(
            text,
            &format!("{name} noise, {unit}"),
            significant(one, 3),
            significant(other, 3),
            format!("x {}", significant(other / one, 3)),
        );
    }
}

/// How far spectra and distributions lie apart.
fn compare_channels(text: &mut String, a: &Series, b: &Series) -> serde_json::Map<String, Value> {
    let mut channels = serde_json::Map::new();
    line!(
        text,
        "  {:26}{:>14}{:>30}",
        "",
        "spectra, dB",
        "distributions (Wasserstein-1)"
    );
    for channel in Channel::ALL {
        let (name, unit) = (channel.prefix(), channel.unit());
        let (spectra_db, wasserstein) =
            (spectral_distance(a, b, channel), wasserstein(a, b, channel));
        line!(
            text,
            "  {:26}{:>14}{:>30}",
            format!("{name}, apart by"),
            significant(spectra_db, 3),
            format!("{} {unit}", significant(wasserstein, 3))
        );
        channels.insert(
            name.to_owned(),
            json!({"log_spectral_distance_db": spectra_db, "wasserstein": wasserstein}),
        );
    }
    channels
}

fn described(series: &Series) -> Value {
    let rest = series.rest.map(|(mean, seconds)| json!({"seconds": seconds, "accel_mean": mean[..3], "gyro_mean": mean[3..]}));
    json!({
        "messages": series.readings.len(), "rate_hz": series.pace.rate_hz, "dropped": series.pace.dropped,
        "accel_noise": series.floors.accelerometer, "gyro_noise": series.floors.gyroscope, "rest": rest,
    })
}

fn row(text: &mut String, what: &str, one: String, other: String, difference: String) {
    line!(text, "  {what:26}{one:>14}{other:>14}{difference:>16}");
}

fn describe_rest(text: &mut String, a: &Series, b: &Series) {
    let seconds = |series: &Series| {
        series.rest.map_or_else(
            || "none".to_owned(),
            |(_, seconds)| format!("{seconds:.0} s"),
        )
    };
    line!(
        text,
        "  {:26}{:>14}{:>14}",
        "at rest for",
        seconds(a),
        seconds(b)
    );
    let (Some((one, _)), Some((other, _))) = (a.rest, b.rest) else {
        return;
    };
    let norm = |mean: [f64; 6]| {
        mean[..3]
            .iter()
            .map(|value| value * value)
            .sum::<f64>()
            .sqrt()
    };
    let mut numbers = |what: &str, one: f64, other: f64| {
        line!(
            text,
            "  {what:26}{one:>14.5}{other:>14.5}{:>+16.5}",
            other - one
        )
    };
    numbers("  accel, norm, m/s2", norm(one), norm(other));
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        numbers(
            &format!("  gyro {name}, rad/s"),
            one[axis + 3],
            other[axis + 3],
        );
    }
}

/// Numbers of a channel's axes among the six values of a reading.
fn axes(channel: Channel) -> Range<usize> {
    let first = 3 * channel.index();
    first..first + 3
}

/// Root mean square over frequency, up to the lower Nyquist frequency, and over axes, of the
/// difference of Welch spectra, dB.
fn spectral_distance(a: &Series, b: &Series, channel: Channel) -> f64 {
    let highest = 0.45 * a.pace.rate_hz.min(b.pace.rate_hz);
    let spectrum = |series: &Series, axis: usize| -> Spectrum {
        welch(
            &series.axis(axis),
            series.pace.rate_hz,
            (SPECTRUM_S * series.pace.rate_hz) as usize,
        )
    };
    let mut sum = 0.0;
    for axis in axes(channel) {
        let (one, other) = (spectrum(a, axis), spectrum(b, axis));
        let lowest = one.spacing_hz.max(other.spacing_hz);
        for k in 0..POINTS {
            let hz = lowest + (highest - lowest) * k as f64 / POINTS as f64;
            let decibels = |spectrum: &Spectrum| 10.0 * spectrum.at(hz).max(1e-30).log10();
            sum += (decibels(&one) - decibels(&other)).powi(2);
        }
    }
    (sum / (3 * POINTS) as f64).sqrt()
}

/// Mean over axes of the area between the two distributions, by their quantiles.
fn wasserstein(a: &Series, b: &Series, channel: Channel) -> f64 {
    let quantiles = |series: &Series, axis: usize| -> Vec<f64> {
        let mut values = series.axis(axis);
        values.sort_unstable_by(f64::total_cmp);
        let at = |k: usize| {
            let place = (k as f64 + 0.5) / POINTS as f64 * values.len() as f64 - 0.5;
            let (index, share) = (place.floor().max(0.0) as usize, place.max(0.0).fract());
            values[index.min(values.len() - 1)] * (1.0 - share)
                + values[(index + 1).min(values.len() - 1)] * share
        };
        (0..POINTS).map(at).collect()
    };
    let distance = |axis: usize| {
        let (one, other) = (quantiles(a, axis), quantiles(b, axis));
        one.iter()
            .zip(&other)
            .map(|(one, other)| (one - other).abs())
            .sum::<f64>()
            / POINTS as f64
    };
    axes(channel).map(distance).sum::<f64>() / 3.0
}

/// Lag of A behind B by the correlation of |w|, and what is left of the difference once it is taken
/// out; null without common stamps.
fn overlap(text: &mut String, a: &Series, b: &Series) -> Value {
    let options = MonitorOptions {
        largest_lag_s: 1.0,
        ..MonitorOptions::default()
    };
    let Some(plain) = assess(&a.readings, &b.readings, &options) else {
        line!(
            text,
            "  they have no stamps in common: no lag, no difference sample by sample"
        );
        return Value::Null;
    };
    let lag = plain.lag_s.unwrap_or(0.0);
    let moved: Vec<ImuReading> = b
        .readings
        .iter()
        .map(|reading| ImuReading {
            stamp: reading.stamp.plus_seconds(lag),
            ..*reading
        })
        .collect();
    let left = assess(&a.readings, &moved, &options).unwrap_or_else(|| plain.clone());
    let rmse = |accel: f64, gyro: f64| {
        format!(
            "{} m/s2, {} rad/s",
            significant(accel, 3),
            significant(gyro, 3)
        )
    };
    line!(
        text,
        "  common stamps: {} of A; RMSE of the difference {}",
        plain.compared,
        rmse(plain.accel_rmse, plain.gyro_rmse)
    );
    match plain.lag_s {
        Some(lag) => line!(
            text,
            "  A is {:.1} ms {} B by the correlation of |w|; RMSE after that {}",
            1e3 * lag.abs(),
            if lag >= 0.0 { "behind" } else { "ahead of" },
            rmse(left.accel_rmse, left.gyro_rmse)
        ),
        None => line!(text, "  too little rotation to tell a lag"),
    }
    json!({
        "compared": plain.compared, "accel_rmse": plain.accel_rmse, "gyro_rmse": plain.gyro_rmse, "lag_s": plain.lag_s,
        "accel_rmse_after_lag": left.accel_rmse, "gyro_rmse_after_lag": left.gyro_rmse,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn series(rate_hz: f64, late: f64, gain: f64, start: f64) -> Series {
        let reading = |k: usize| {
            let t = k as f64 / rate_hz;
            // Still for three seconds.
            let u = (start + t - late - 3.0).max(0.0);
            let moving = |frequency: f64| gain * (frequency * u).sin();
            let values = [
                moving(3.0),
                moving(5.0),
                9.8 + moving(4.0),
                0.3 * moving(2.0),
                0.2 * moving(3.3),
                0.3 * moving(5.1),
            ];
            ImuReading {
                stamp: Stamp::from_seconds(100.0 + start + t),
                values,
            }
        };
        let readings: Vec<ImuReading> = (0..(20.0 * rate_hz) as usize).map(reading).collect();
        let (pace, floors) = (pace(&readings), noise_floors(&readings));
        let rest = rest(&readings, pace.rate_hz, floors);
        Series {
            readings,
            pace,
            floors,
            rest,
        }
    }

    #[test]
    fn the_same_motion_late_is_a_lag_and_no_difference() {
        let (a, b) = (series(100.0, 0.05, 2.0, 0.0), series(125.0, 0.0, 2.0, 0.0));
        let found = compare_series(&mut String::new(), &a, &b);
        assert!(
            (found["overlap"]["lag_s"].as_f64().unwrap() - 0.05).abs() < 1e-3,
            "{found}"
        );
        assert!(found["overlap"]["accel_rmse"].as_f64().unwrap() > 0.2);
        assert!(
            found["overlap"]["accel_rmse_after_lag"].as_f64().unwrap() < 0.02,
            "{found}"
        );
        assert!(
            (2.0..=4.0).contains(&found["a"]["rest"]["seconds"].as_f64().unwrap()),
            "{found}"
        );
        assert!((found["b"]["rate_hz"].as_f64().unwrap() - 125.0).abs() < 0.01);
    }

    #[test]
    fn twice_the_motion_is_6_db_and_a_wider_distribution() {
        let found = compare_series(
            &mut String::new(),
            &series(100.0, 0.0, 2.0, 3.0),
            &series(100.0, 0.0, 4.0, 3.0),
        );
        let gyro = &found["channels"]["gyro"];
        assert!(
            (gyro["log_spectral_distance_db"].as_f64().unwrap() - 6.02).abs() < 0.1,
            "{found}"
        );
        assert!(gyro["wasserstein"].as_f64().unwrap() > 0.2);
        let same = series(100.0, 0.0, 2.0, 3.0);
        assert_eq!(wasserstein(&same, &same, Channel::Accelerometer), 0.0);
    }

    #[test]
    fn recordings_of_other_times_are_still_compared() {
        let found = compare_series(
            &mut String::new(),
            &series(100.0, 0.0, 2.0, 0.0),
            &series(100.0, 0.0, 2.0, 1000.0),
        );
        assert!(found["overlap"].is_null());
    }
}
