//! Causes and verdict in the words of diagnosis.json.

use std::collections::BTreeMap;

use cromosim_imu::{EffectKind, Shape};
use serde_json::{Value, json};

use crate::diagnosis::{Cause, ClockJump, Interval, Metrics, UNKNOWN};
use crate::findings::Unknown;
use crate::policy::report::MUCH_LESS;
use crate::policy::unknown::{BAND_SHARE, INTERVAL_SHARE};

/// Values by the names of their parameters, in the form of diagnosis.json.
pub(crate) fn described(kind: EffectKind, values: &[f64]) -> BTreeMap<String, Value> {
    let mut named = BTreeMap::new();
    let mut first = 0;
    for parameter in kind.spec().parameters {
        let own = &values[first..first + parameter.shape.count()];
        first += parameter.shape.count();
        if parameter.is_optional && own == parameter.neutral {
            continue;
        }
        let value = match parameter.shape {
            Shape::Scalar | Shape::Time => json!(own[0]),
            Shape::Vector3 => json!(own),
            Shape::Matrix3 => json!(own.chunks(3).collect::<Vec<_>>()),
            Shape::Choice(words) => json!(words.get(own[0] as usize).copied().unwrap_or_default()),
        };
        named.insert(parameter.name.to_owned(), value);
    }
    named
}

/// Standard errors in the form of [`described`], with that of an instant where there is one. Empty where
/// nothing was fitted.
pub(crate) fn described_errors(
    kind: EffectKind,
    errors: &[f64],
    of_time: Option<f64>,
) -> BTreeMap<String, Value> {
    let parameters = kind.spec().parameters.iter();
    let times = parameters
        .filter(|parameter| parameter.shape == Shape::Time)
        .zip(of_time)
        .map(|(parameter, error)| (parameter.name.to_owned(), json!(error)));
    let mut named = if errors.iter().any(|error| *error > 0.0) {
        described(kind, errors)
    } else {
        BTreeMap::new()
    };
    named.extend(times);
    named
}

/// The cause that stands for structure outside the library.
pub(crate) fn unknown_cause(unknown: &Unknown, gap_share: f64, after: Metrics) -> Cause {
    let parameters = BTreeMap::from([
        ("channel".to_owned(), json!(unknown.channel)),
        ("axes".to_owned(), json!(unknown.axes)),
        (
            "band_hz".to_owned(),
            json!(band(&unknown.location.bands_hz)),
        ),
        (
            "intervals_s".to_owned(),
            json!(intervals(&unknown.location.intervals_s)),
        ),
        ("depends_on".to_owned(), json!(unknown.depends_on)),
    ]);
    Cause {
        effect: UNKNOWN.to_owned(),
        probability: unknown.probability,
        probability_by_margin: unknown.probability,
        parameters,
        standard_errors: BTreeMap::new(),
        gap_share,
        after,
    }
}

/// From the first band with a share worth naming to the last, Hz.
fn band(bands: &[Interval]) -> [f64; 2] {
    let mut bands = bands.iter().filter(|band| band.share > BAND_SHARE);
    match (bands.next(), bands.next_back()) {
        (Some(first), Some(last)) => [first.from, last.to],
        (Some(only), None) => [only.from, only.to],
        _ => [0.0, 0.0],
    }
}

/// The intervals with more than their due of an even spread, joined where they touch; all of the
/// time where there is none.
fn intervals(all: &[Interval]) -> Vec<[f64; 2]> {
    let even = 1.0 / all.len().max(1) as f64;
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for interval in all
        .iter()
        .filter(|interval| interval.share > INTERVAL_SHARE * even)
    {
        match joined.last_mut() {
            Some(last) if (last[1] - interval.from).abs() < 1e-9 => last[1] = interval.to,
            _ => joined.push([interval.from, interval.to]),
        }
    }
    if joined.is_empty() {
        let ends = all.first().zip(all.last());
        joined.extend(ends.map(|(first, last)| [first.from, last.to]));
    }
    joined
}

/// One sentence for people.
pub(crate) fn verdict(causes: &[Cause], before: &Metrics, after: &Metrics) -> String {
    let Some(first) = causes.first() else {
        return without_cause(before, after);
    };
    let percent = |share: f64| (100.0 * share).round();
    let share = |cause: &Cause| {
        if cause.gap_share < 0.005 {
            "below 1 %".to_owned()
        } else {
            format!("{} %", percent(cause.gap_share))
        }
    };
    let first_words = if first.effect == UNKNOWN {
        "Something outside the library (unknown)"
    } else {
        &first.effect
    };
    let mut text = format!("{first_words} explains {} of the gap", share(first));
    for cause in &causes[1..] {
        let words = if cause.effect == UNKNOWN {
            "something outside the library (unknown)"
        } else {
            &cause.effect
        };
        text += &format!(", {words} {}", share(cause));
    }
    let accel = course(before.accel_rmse, after.accel_rmse, 3);
    let gyro = course(before.gyro_rmse, after.gyro_rmse, 4);
    // Said once where both go the same way.
    let gyro_word = if gyro.0 == accel.0 {
        String::new()
    } else {
        format!(" {}", gyro.0)
    };
    format!(
        "{text}; the accelerometer's {} {} m/s2, the gyroscope's{gyro_word} {} rad/s.",
        accel.0, accel.1, gyro.1
    )
}

/// What is kept without being a cause is told of where it changes much.
fn without_cause(before: &Metrics, after: &Metrics) -> String {
    let size = |of: &Metrics| format!("{:.3} m/s2, {:.4} rad/s", of.accel_rmse, of.gyro_rmse);
    let falls = |before: f64, after: f64| after < MUCH_LESS * before;
    let kept =
        if falls(before.accel_rmse, after.accel_rmse) || falls(before.gyro_rmse, after.gyro_rmse) {
            format!("; with what is kept all the same it is {}", size(after))
        } else {
            String::new()
        };
    format!(
        "No cause: the residual ({}) is what the sensor's noise and the reference's own error leave{kept}.",
        size(before)
    )
}

/// `("falls", "from 1.200 to 0.260")`: what people see at so many decimals.
fn course(before: f64, after: f64, decimals: usize) -> (&'static str, String) {
    let texts = [before, after].map(|value| format!("{value:.decimals$}"));
    if texts[0] == texts[1] {
        return ("stays", format!("at {}", texts[0]));
    }
    let word = if after < before { "falls" } else { "rises" };
    (word, format!("from {} to {}", texts[0], texts[1]))
}

/// `clock_jump: the IMU's clock jumps by 3600.0 s at 1700000025.0 s`, the first three.
pub(crate) fn jumps_in_words(jumps: &[ClockJump]) -> String {
    let one = |jump: &ClockJump| {
        let (whose, what) = if jump.clock == "imu" {
            ("IMU", "messages")
        } else {
            ("reference", "poses")
        };
        let left_out = if jump.diagnosed {
            String::new()
        } else {
            format!(" ({} {what} left out)", jump.messages)
        };
        format!(
            "the {whose}'s stamps jump by {:.3} s at {:.3} s{left_out}",
            jump.by, jump.at
        )
    };
    let mut list: Vec<String> = jumps.iter().take(3).map(one).collect();
    if jumps.len() > 3 {
        list.push(format!("and {} times more", jumps.len() - 3));
    }
    format!("clock_jump: {}", list.join(", "))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn metrics(accel_rmse: f64, gyro_rmse: f64) -> Metrics {
        Metrics {
            accel_rmse,
            gyro_rmse,
            ..Metrics::default()
        }
    }

    fn words(before: Metrics, after: Metrics) -> String {
        let lever_arm = Cause {
            effect: "lever_arm".to_owned(),
            probability: 0.9,
            probability_by_margin: 0.9,
            parameters: BTreeMap::new(),
            standard_errors: BTreeMap::new(),
            gap_share: 0.93,
            after,
        };
        let text = verdict(&[lever_arm], &before, &after);
        text.split_once("; ").unwrap().1.to_owned()
    }

    #[test]
    fn without_a_cause_the_verdict_tells_of_what_is_kept() {
        let before = metrics(1.036, 0.0423);
        let of = |after: Metrics| verdict(&[], &before, &after);
        assert!(of(metrics(1.02, 0.0420)).ends_with("the reference's own error leave."));
        assert!(
            of(metrics(0.278, 0.0423))
                .ends_with("leave; with what is kept all the same it is 0.278 m/s2, 0.0423 rad/s.")
        );
    }

    #[test]
    fn the_verdict_says_which_way_each_channel_goes() {
        let cases = [
            (
                metrics(0.2, 0.02),
                "the accelerometer's falls from 1.200 to 0.200 m/s2, the gyroscope's from 0.1000 to 0.0200 rad/s.",
            ),
            (
                metrics(0.2, 0.2),
                "the accelerometer's falls from 1.200 to 0.200 m/s2, the gyroscope's rises from 0.1000 to 0.2000 rad/s.",
            ),
            (
                metrics(0.2, 0.10001),
                "the accelerometer's falls from 1.200 to 0.200 m/s2, the gyroscope's stays at 0.1000 rad/s.",
            ),
        ];
        for (after, expected) in cases {
            assert_eq!(words(metrics(1.2, 0.1), after), expected);
        }
    }
}
