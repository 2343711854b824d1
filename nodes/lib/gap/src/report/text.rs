//! Effects and their parameters for people.

use std::collections::BTreeMap;
use std::fmt::Write;

use cromosim_charts::text::{decimals, escape, significant, trimmed};
use cromosim_imu::{EffectKind, EffectSpec};
use serde_json::Value;

use crate::diagnosis::UNKNOWN;

/// What the library knows of an effect; nothing of `unknown`.
pub(super) fn spec(effect: &str) -> Option<&'static EffectSpec> {
    EffectKind::from_name(effect).map(EffectKind::spec)
}

/// What an effect is, in a sentence.
pub(super) fn summary(effect: &str) -> &'static str {
    match effect {
        UNKNOWN => "Structure in the residual that no named effect explains.",
        name => spec(name).map_or("", |spec| spec.summary),
    }
}

/// The unit of a parameter; empty for none.
fn unit(effect: &str, parameter: &str) -> &'static str {
    let own = spec(effect)
        .and_then(|spec| spec.parameters.iter().find(|own| own.name == parameter))
        .map(|own| own.unit);
    match (own, parameter) {
        (Some(unit), _) => unit,
        (None, "band_hz") => "Hz",
        (None, "intervals_s" | "delay") => "s",
        (None, "hard_iron") => "T",
        (None, _) => "",
    }
}

/// Each parameter of an effect as markup.
pub(super) fn parameters(
    effect: &str,
    values: &BTreeMap<String, Value>,
    standard_errors: &BTreeMap<String, Value>,
) -> impl Iterator<Item = String> {
    values
        .iter()
        .map(|(name, value)| parameter(effect, name, value, standard_errors.get(name)))
}

/// A parameter as markup: name, numbers with their standard errors, unit; also in degrees or
/// milliseconds where people think in these.
fn parameter(effect: &str, name: &str, value: &Value, error: Option<&Value>) -> String {
    let unit = unit(effect, name);
    let mut text = format!("<span class=\"name\">{}</span> ", escape(name));
    write_value(&mut text, value, error);
    if !unit.is_empty() {
        let _ = write!(text, " <span class=\"unit\">{}</span>", escape(unit));
    }
    if let Some(aside) = aside(unit, value) {
        let _ = write!(text, " <span class=\"aside\">({aside})</span>");
    }
    text
}

fn write_value(text: &mut String, value: &Value, error: Option<&Value>) {
    match value {
        Value::Array(items) if items.iter().any(Value::is_array) => {
            for (index, row) in items.iter().enumerate() {
                text.push_str(if items.len() > 1 { "<br>" } else { "" });
                write_value(text, row, error.and_then(|error| error.get(index)));
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                text.push_str(if index > 0 { ", " } else { "" });
                write_value(text, item, error.and_then(|error| error.get(index)));
            }
        }
        Value::Number(number) => text.push_str(&with_error(
            number.as_f64().unwrap_or(f64::NAN),
            error.and_then(Value::as_f64),
        )),
        Value::String(word) => text.push_str(&escape(word)),
        Value::Object(fields) => {
            let mut first = true;
            for (key, field) in fields {
                text.push_str(if first { "" } else { ", " });
                first = false;
                let _ = write!(text, "{} ", escape(key));
                write_value(text, field, None);
            }
        }
        other => text.push_str(&escape(&other.to_string())),
    }
}

/// `0.0500 ± 0.0010`: decimals to the second digit of the error. Values within two errors of
/// nothing are dimmed.
fn with_error(value: f64, error: Option<f64>) -> String {
    let Some(error) = error.filter(|error| error.is_finite() && *error > 0.0) else {
        // Absolute times keep their milliseconds.
        return if value.abs() > 1e7 {
            decimals(value, 3)
        } else {
            format!("<span class=\"number\">{}</span>", trimmed(value, 4))
        };
    };
    let places = 1 - error.log10().floor() as i32;
    let class = if value.abs() < 2.0 * error {
        "number dim"
    } else {
        "number"
    };
    let (value, error) = match places {
        0..=7 => (
            decimals(value, places as usize),
            decimals(error, places as usize),
        ),
        _ => (significant(value, 4), significant(error, 2)),
    };
    format!("<span class=\"{class}\">{value} ± {error}</span>")
}

fn aside(unit: &str, value: &Value) -> Option<String> {
    let numbers: Vec<f64> = match value {
        Value::Number(number) => vec![number.as_f64()?],
        Value::Array(items) if items.len() == 3 => {
            items.iter().map(Value::as_f64).collect::<Option<_>>()?
        }
        _ => return None,
    };
    let norm = numbers
        .iter()
        .map(|number| number * number)
        .sum::<f64>()
        .sqrt();
    match unit {
        "rad" => Some(format!("{}°", significant(norm.to_degrees(), 3))),
        "rad/s" => Some(format!("{} °/s", significant(norm.to_degrees(), 3))),
        "m" if norm < 1.0 => Some(format!("{} cm", significant(100.0 * norm, 3))),
        "s" if norm < 1.0 => Some(format!("{} ms", significant(1e3 * norm, 3))),
        _ => None,
    }
}

/// `accel_x` as `accelerometer x`.
pub(super) fn axis_name(axis: &str) -> String {
    match axis.split_once('_') {
        Some(("accel", axis)) => format!("accelerometer {axis}"),
        Some(("gyro", axis)) => format!("gyroscope {axis}"),
        _ => match axis {
            "accel" => "accelerometer".to_owned(),
            "gyro" => "gyroscope".to_owned(),
            other => other.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_their_errors_allow() {
        let plain = |value, error| {
            let text = with_error(value, error);
            text.replace("<span class=\"number\">", "")
                .replace("<span class=\"number dim\">", "~")
                .replace("</span>", "")
        };
        assert_eq!(plain(0.05, Some(0.001)), "0.0500 ± 0.0010");
        assert_eq!(plain(0.0004, Some(0.001)), "~0.0004 ± 0.0010");
        assert_eq!(plain(-123.456, Some(2.5)), "−123.5 ± 2.5");
        assert_eq!(plain(-0.021_34, None), "−0.02134");
        assert_eq!(
            (
                plain(4.0, None).as_str(),
                plain(0.25, None).as_str(),
                plain(1200.0, None).as_str()
            ),
            ("4", "0.25", "1200")
        );
        assert_eq!(plain(1.7e-7, None), "1.700e-7".replace('-', "−"));
        assert_eq!(plain(f64::NAN, None), "–");
    }

    #[test]
    fn markup_cannot_come_in() {
        let text = parameter(
            "unknown",
            "<b>",
            &serde_json::json!(["<i>", {"<u>": "<s>"}]),
            None,
        );
        assert!(
            !text.contains("<b>")
                && !text.contains("<i>")
                && !text.contains("<u>")
                && !text.contains("<s>"),
            "{text}"
        );
    }

    #[test]
    fn parameters_say_their_unit_and_what_people_think_in() {
        let text = parameter(
            "time_offset",
            "seconds",
            &serde_json::json!(0.021),
            Some(&serde_json::json!(0.0004)),
        );
        assert!(
            text.contains("0.02100 ± 0.00040")
                && text.contains(">s<")
                && text.contains("(21.0 ms)"),
            "{text}"
        );
        let text = parameter(
            "mount_rotation",
            "rotvec",
            &serde_json::json!([0.1, 0.0, 0.0]),
            None,
        );
        assert!(text.contains("(5.73°)"), "{text}");
    }
}
