//! Positions of labelled markers, whatever file they came from.

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::MotionError;

/// Rates that are believed, Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 0.1..=1e5;

/// A recording of an optical system: at least one frame, all rows as long as the labels.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerClip {
    /// The file's name.
    pub name: String,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// Metres per unit of the file; it is in the frames already.
    pub unit_scale_m: f64,
    /// One a marker, as in the file: `LFHD` or, with the subject, `Bob:LFHD`.
    pub labels: Vec<String>,
    /// (frames, markers), m, file axes; `None` where the marker was not seen.
    pub frames: Vec<Vec<Option<Point3<f64>>>>,
}

impl MarkerClip {
    /// The subjects that the labels name before a colon, sorted.
    pub fn subjects(&self) -> Vec<String> {
        let subjects: BTreeSet<&str> = self
            .labels
            .iter()
            .filter_map(|label| split(label).0)
            .collect();
        subjects.into_iter().map(str::to_owned).collect()
    }

    /// The labels without the subject's name; those of other subjects are `None`. `wanted` chooses
    /// a subject, and need not where there is one only.
    ///
    /// # Errors
    /// [`MotionError::Subject`], which lists the subjects.
    pub fn labels_of(&self, wanted: Option<&str>) -> Result<Vec<Option<&str>>, MotionError> {
        let subjects = self.subjects();
        let chosen = match wanted {
            Some(wanted) => subjects
                .iter()
                .find(|subject| subject.eq_ignore_ascii_case(wanted)),
            None => subjects.first().filter(|_| subjects.len() == 1),
        };
        // Where nobody is named, there is nobody to choose.
        if chosen.is_none() && (wanted.is_some() || subjects.len() > 1) {
            return Err(MotionError::Subject {
                name: self.name.clone(),
                given: wanted.unwrap_or("none").to_owned(),
                known: subjects,
            });
        }
        let own = |label| match (split(label), chosen) {
            ((Some(subject), bare), Some(chosen)) => (subject == chosen).then_some(bare),
            ((_, bare), _) => Some(bare),
        };
        Ok(self
            .labels
            .iter()
            .map(|label| own(label.as_str()))
            .collect())
    }
}

/// Subject and label.
fn split(label: &str) -> (Option<&str>, &str) {
    match label.split_once(':') {
        Some((subject, bare)) if !subject.trim().is_empty() => (Some(subject.trim()), bare.trim()),
        Some((_, bare)) => (None, bare.trim()),
        None => (None, label.trim()),
    }
}

/// Metres per unit by the unit's name.
pub(crate) fn unit_scale(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "mm" | "millimeters" | "millimetres" => Some(0.001),
        "cm" | "centimeters" | "centimetres" => Some(0.01),
        "m" | "meters" | "metres" => Some(1.0),
        "in" | "inch" | "inches" => Some(0.0254),
        "ft" | "feet" => Some(0.3048),
        _ => None,
    }
}

/// A rate that a recording may have.
pub(crate) fn checked_rate(name: &str, rate_hz: f64) -> Result<f64, MotionError> {
    if RATES_HZ.contains(&rate_hz) {
        return Ok(rate_hz);
    }
    let expected = format!("{} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
    Err(MotionError::Setting {
        name: name.to_owned(),
        setting: "rate_hz",
        value: rate_hz,
        expected,
    })
}
