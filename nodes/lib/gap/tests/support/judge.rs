//! What an answer must say.

use cromosim_gap::{
    Cause, DiagnoseOptions, PlacementAnswer, PlacementDiagnosis, PlacementRecord, diagnose,
};
use cromosim_imu::{Effect, EffectKind, EffectSet, Shape};
use serde_json::Value;

/// The answer with the whole library.
pub fn answer(record: &PlacementRecord) -> PlacementAnswer {
    diagnose(record, &DiagnoseOptions::default()).unwrap()
}

/// Names of the causes, in alphabetical order.
pub fn names(diagnosis: &PlacementDiagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis
        .causes
        .iter()
        .map(|cause| cause.effect.as_str())
        .collect();
    names.sort_unstable();
    names
}

/// Exactly these causes, sure of each, and shares that add up to 1.
pub fn names_exactly(diagnosis: &PlacementDiagnosis, effects: &EffectSet) {
    let mut expected: Vec<&str> = effects.iter().map(|effect| effect.kind().name()).collect();
    expected.sort_unstable();
    assert_eq!(names(diagnosis), expected, "{}", diagnosis.verdict);
    for cause in &diagnosis.causes {
        assert!(
            (0.9..=1.0).contains(&cause.probability),
            "{}: probability {}",
            cause.effect,
            cause.probability
        );
    }
    shares_add_up(diagnosis);
}

/// Causes and the unexplained make 1, in order; so does each list of where the gap lies.
pub fn shares_add_up(diagnosis: &PlacementDiagnosis) {
    let shares: Vec<f64> = diagnosis
        .causes
        .iter()
        .map(|cause| cause.gap_share)
        .collect();
    assert!(
        shares.windows(2).all(|pair| pair[0] >= pair[1]),
        "shares fall: {shares:?}"
    );
    assert!(
        shares.iter().all(|share| (0.0..=1.0).contains(share)),
        "{shares:?}"
    );
    near(
        shares.iter().sum::<f64>() + diagnosis.unexplained.share,
        1.0,
        1e-9,
        "causes and unexplained",
    );
    let location = &diagnosis.location;
    near(location.channels.values().sum(), 1.0, 1e-9, "channels");
    near(location.axes.values().sum(), 1.0, 1e-9, "axes");
    near(
        location.bands_hz.iter().map(|band| band.share).sum(),
        1.0,
        1e-9,
        "bands",
    );
    near(
        location
            .intervals_s
            .iter()
            .map(|interval| interval.share)
            .sum(),
        1.0,
        1e-9,
        "intervals",
    );
}

pub fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{what}: {value}, expected {expected} within {tolerance}"
    );
}

/// All numbers of a JSON value, row after row; a word by its number among the choices.
fn numbers(value: &Value, shape: Shape) -> Vec<f64> {
    match (value, shape) {
        (Value::Array(list), _) => list
            .iter()
            .flat_map(|value| numbers(value, shape))
            .collect(),
        (Value::String(word), Shape::Choice(words)) => {
            vec![words.iter().position(|known| known == word).unwrap() as f64]
        }
        _ => vec![
            value
                .as_f64()
                .unwrap_or_else(|| panic!("{value} is no number")),
        ],
    }
}

pub fn cause(diagnosis: &PlacementDiagnosis, kind: EffectKind) -> &Cause {
    diagnosis
        .causes
        .iter()
        .find(|cause| cause.effect == kind.name())
        .unwrap()
}

/// Every parameter within five standard errors or 2 % (of the vector, or of a factor's distance
/// from 1) of the truth; 5 % where the answer states no standard error.
pub fn values_are(diagnosis: &PlacementDiagnosis, truth: &Effect) {
    let cause = cause(diagnosis, truth.kind());
    for (parameter, expected) in truth.written_parameters() {
        let found = numbers(&cause.parameters[parameter.name], parameter.shape);
        assert_eq!(found.len(), expected.len(), "{}", parameter.name);
        let errors = cause
            .standard_errors
            .get(parameter.name)
            .map_or(vec![0.0; found.len()], |value| {
                numbers(value, parameter.shape)
            });
        let size = expected
            .iter()
            .zip(parameter.neutral)
            .map(|(value, neutral)| (value - neutral).powi(2))
            .sum::<f64>()
            .sqrt();
        // Two per cent of an absolute time say nothing.
        let part = if cause.standard_errors.is_empty() {
            0.05
        } else {
            0.02
        };
        let size = if parameter.shape == Shape::Time {
            0.0
        } else {
            part * size
        };
        for ((found, expected), error) in found.iter().zip(expected).zip(errors) {
            near(
                *found,
                *expected,
                (5.0 * error).max(size) + 1e-12,
                &format!("{} {}", cause.effect, parameter.name),
            );
        }
    }
}
