//! Two diagnoses: which causes went, came, changed, and how far the gap has moved.

use cromosim_gap::{Cause, Diagnosis, Metrics, PlacementDiagnosis};
use serde_json::{Value, json};

use super::text::{line, only_in, significant};
use super::{Comparison, RecordingError};

/// A parameter that moved by more standard errors than these has changed.
const CHANGED: f64 = 3.0;

/// What differs between two diagnoses: for each placement the gaps, and which causes went, came or
/// changed by more than three standard errors.
///
/// # Errors
/// [`RecordingError::NothingInCommon`] where no placement is in both.
pub fn compare_diagnoses(a: &Diagnosis, b: &Diagnosis) -> Result<Comparison, RecordingError> {
    let mut text = String::new();
    let text = &mut text;
    let mut placements = serde_json::Map::new();
    for (name, one) in &a.placements {
        let Some(other) = b.placements.get(name) else {
            continue;
        };
        line!(text, "\n{name}");
        describe_gap(text, one, other);
        placements.insert(
            name.clone(),
            json!({"gap": gap(one, other), "causes": causes(text, one, other)}),
        );
    }
    if placements.is_empty() {
        let names = |diagnosis: &Diagnosis| {
            diagnosis
                .placements
                .keys()
                .cloned()
                .collect::<Vec<_>>()
                .join(", ")
        };
        return Err(RecordingError::NothingInCommon {
            what: "the diagnoses have no placement",
            a: names(a),
            b: names(b),
        });
    }
    let lacking = |one: &Diagnosis, other: &Diagnosis| -> Vec<String> {
        one.placements
            .keys()
            .filter(|name| !other.placements.contains_key(*name))
            .cloned()
            .collect()
    };
    let (only_a, only_b) = (lacking(a, b), lacking(b, a));
    only_in(text, "A", &only_a);
    only_in(text, "B", &only_b);
    Ok(Comparison {
        text: std::mem::take(text),
        json: json!({"kind": "diagnoses", "placements": placements, "only_in_a": only_a, "only_in_b": only_b}),
    })
}

fn describe_gap(text: &mut String, a: &PlacementDiagnosis, b: &PlacementDiagnosis) {
    line!(
        text,
        "  {:18}{:>22}{:>22}",
        "RMSE of the gap",
        "accel, m/s2",
        "gyro, rad/s"
    );
    for (side, placement) in [("A", a), ("B", b)] {
        let gap = &placement.gap;
        let change = |pick: fn(&Metrics) -> f64| {
            format!(
                "{} -> {}",
                significant(pick(&gap.before), 3),
                significant(pick(&gap.after), 3)
            )
        };
        let (accel, gyro) = (
            change(|metrics| metrics.accel_rmse),
            change(|metrics| metrics.gyro_rmse),
        );
        line!(
            text,
            "  {:18}{accel:>22}{gyro:>22}",
            format!("{side} before -> after")
        );
    }
}

fn gap(a: &PlacementDiagnosis, b: &PlacementDiagnosis) -> Value {
    let both = |placement: &PlacementDiagnosis| json!({"before": placement.gap.before, "after": placement.gap.after});
    json!({"a": both(a), "b": both(b)})
}

fn causes(text: &mut String, a: &PlacementDiagnosis, b: &PlacementDiagnosis) -> Vec<Value> {
    let find = |placement: &PlacementDiagnosis, effect: &str| {
        placement
            .causes
            .iter()
            .find(|cause| cause.effect == effect)
            .cloned()
    };
    let mut found = Vec::new();
    for cause in &a.causes {
        let Some(now) = find(b, &cause.effect) else {
            line!(text, "  gone     {}", described(cause));
            found.push(json!({"effect": cause.effect, "change": "gone", "a": cause}));
            continue;
        };
        let moved = moved(cause, &now);
        let change = match moved {
            Some(errors) if errors > CHANGED => "changed",
            None if cause.parameters != now.parameters => "changed",
            _ => "same",
        };
        let by = moved.map_or_else(String::new, |errors| {
            format!(", by {errors:.1} standard errors")
        });
        match change {
            "changed" => line!(
                text,
                "  changed  {}\n        -> {}{by}",
                described(cause),
                described(&now)
            ),
            _ => line!(text, "  same     {}{by}", described(&now)),
        }
        found.push(json!({"effect": cause.effect, "change": change, "standard_errors_moved": moved, "a": cause, "b": now}));
    }
    for cause in b
        .causes
        .iter()
        .filter(|cause| find(a, &cause.effect).is_none())
    {
        line!(text, "  new      {}", described(cause));
        found.push(json!({"effect": cause.effect, "change": "new", "b": cause}));
    }
    if a.causes.is_empty() && b.causes.is_empty() {
        line!(text, "  no causes in either");
    }
    found
}

/// `lever_arm (71 %): offset [0.05, 0, -0.06]`.
fn described(cause: &Cause) -> String {
    let parameters: Vec<String> = cause
        .parameters
        .iter()
        .map(|(name, value)| format!("{name} {}", short(value, cause.standard_errors.get(name))))
        .collect();
    format!(
        "{} ({:.0} %): {}",
        cause.effect,
        100.0 * cause.gap_share,
        parameters.join(", ")
    )
}

fn short(value: &Value, error: Option<&Value>) -> String {
    match value {
        Value::Array(items) => {
            let items: Vec<String> = items
                .iter()
                .enumerate()
                .map(|(k, item)| short(item, error.and_then(|error| error.get(k))))
                .collect();
            format!("[{}]", items.join(", "))
        }
        Value::Number(number) => {
            let value = number.as_f64().unwrap_or(f64::NAN);
            match error
                .and_then(Value::as_f64)
                .filter(|error| *error > 0.0 && error.is_finite())
            {
                // To the second digit of the error.
                Some(error) => format!(
                    "{value:.*}",
                    (1 - error.log10().floor() as i32).clamp(0, 9) as usize
                ),
                None if value.abs() > 1e7 => format!("{value:.3}"),
                None => significant(value, 4),
            }
        }
        Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

/// The largest move of any parameter, in standard errors of the difference; none where the
/// parameters have none.
fn moved(a: &Cause, b: &Cause) -> Option<f64> {
    let parts = a.parameters.iter().filter_map(|(name, value)| {
        let errors = (a.standard_errors.get(name)?, b.standard_errors.get(name)?);
        largest(value, b.parameters.get(name)?, errors)
    });
    parts.reduce(f64::max)
}

fn largest(a: &Value, b: &Value, errors: (&Value, &Value)) -> Option<f64> {
    if let (Value::Array(one), Value::Array(other)) = (a, b) {
        let parts = one
            .iter()
            .zip(other)
            .enumerate()
            .filter_map(|(k, (one, other))| {
                largest(one, other, (errors.0.get(k)?, errors.1.get(k)?))
            });
        return parts.reduce(f64::max);
    }
    let error = errors.0.as_f64()?.hypot(errors.1.as_f64()?);
    let moved = (a.as_f64()? - b.as_f64()?).abs() / error;
    moved.is_finite().then_some(moved)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn cause(effect: &str, offset: f64) -> Cause {
        Cause {
            effect: effect.to_owned(),
            probability: 0.9,
            probability_by_margin: 0.9,
            parameters: BTreeMap::from([("offset".to_owned(), json!([offset, 0.0, -0.06]))]),
            standard_errors: BTreeMap::from([("offset".to_owned(), json!([0.003, 0.001, 0.001]))]),
            gap_share: 0.7,
            after: Metrics::default(),
        }
    }

    fn diagnosis(causes: Vec<Cause>) -> Diagnosis {
        let placement = PlacementDiagnosis {
            recordings: Vec::new(),
            magnetometer: None,
            clock_jumps: Vec::new(),
            calibration: Vec::new(),
            reference_response: None,
            verdict: String::new(),
            gap: Default::default(),
            location: Default::default(),
            causes,
            unidentifiable: Vec::new(),
            unexplained: Default::default(),
        };
        Diagnosis {
            schema: cromosim_gap::SCHEMA.to_owned(),
            placements: BTreeMap::from([("wrist".to_owned(), placement)]),
        }
    }

    #[test]
    fn causes_go_come_and_change() {
        let a = diagnosis(vec![
            cause("lever_arm", 0.05),
            cause("mount_slip", 0.0),
            cause("soft_tissue", 0.0),
        ]);
        let b = diagnosis(vec![
            cause("lever_arm", 0.08),
            cause("soft_tissue", 0.001),
            cause("low_pass", 0.0),
        ]);
        let found = compare_diagnoses(&a, &b).unwrap().json;
        let causes = found["placements"]["wrist"]["causes"].as_array().unwrap();
        let changes: Vec<(&str, &str)> = causes
            .iter()
            .map(|cause| {
                (
                    cause["effect"].as_str().unwrap(),
                    cause["change"].as_str().unwrap(),
                )
            })
            .collect();
        assert_eq!(
            changes,
            [
                ("lever_arm", "changed"),
                ("mount_slip", "gone"),
                ("soft_tissue", "same"),
                ("low_pass", "new")
            ]
        );
        assert!(
            (causes[0]["standard_errors_moved"].as_f64().unwrap()
                - 0.03 / (0.003 * 2.0_f64.sqrt()))
            .abs()
                < 1e-9
        );
        let mut other = b.clone();
        other.placements = BTreeMap::from([("head".to_owned(), b.placements["wrist"].clone())]);
        assert!(
            compare_diagnoses(&a, &other)
                .unwrap_err()
                .to_string()
                .contains("A has wrist; B has head")
        );
    }

    #[test]
    fn parameters_have_the_digits_of_their_errors() {
        assert_eq!(
            described(&cause("lever_arm", 0.05)),
            "lever_arm (70 %): offset [0.0500, 0.0000, -0.0600]"
        );
    }
}
