//! [`MotionResponse`] as effects files have it.

use std::fmt::Write;

use cromosim_spatial::{MotionResponse, PoseDensities};
use serde::Deserialize;

use super::number::number;
use crate::ImuError;

/// Largest factor that a file may have: a reference that holds a tenth of a motion holds none of it.
const LARGEST_FACTOR: f64 = 10.0;

/// As it stands in the file: the position's factors by what the accelerometer shows of them, the rotation's by the gyroscope.
/// Files of earlier versions lack the densities of the poses from which these were learnt.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawResponse {
    hz: Vec<f64>,
    accel: Vec<f64>,
    gyro: Vec<f64>,
    position_density: Option<Vec<f64>>,
    rotation_density: Option<Vec<f64>>,
}

impl RawResponse {
    /// The response of a placement of a file, where there is one.
    ///
    /// # Errors
    /// [`ImuError::Yaml`] with what is wrong with it.
    pub fn parsed(
        raw: Option<Self>,
        file: &str,
        placement: &str,
    ) -> Result<Option<MotionResponse>, ImuError> {
        raw.map(Self::parse)
            .transpose()
            .map_err(|problem| ImuError::Yaml {
                file: file.to_owned(),
                problem: format!("placement `{placement}`: reference_response: {problem}"),
            })
    }

    /// Checked; in words what is wrong with it.
    fn parse(self) -> Result<MotionResponse, String> {
        let Self {
            hz,
            accel,
            gyro,
            position_density,
            rotation_density,
        } = self;
        let is_increasing = hz.windows(2).all(|pair| pair[0] < pair[1]);
        let are_frequencies = hz.iter().all(|value| value.is_finite() && *value >= 0.0);
        if hz.is_empty() || !is_increasing || !are_frequencies {
            return Err("hz: expected increasing frequencies from 0 on".to_owned());
        }
        for (field, factors) in [("accel", &accel), ("gyro", &gyro)] {
            if factors.len() != hz.len() {
                return Err(format!(
                    "{field}: expected {} factors, one for each of hz, found {}",
                    hz.len(),
                    factors.len()
                ));
            }
            let is_factor = |value: &f64| (0.0..=LARGEST_FACTOR).contains(value);
            if let Some(odd) = factors.iter().find(|value| !is_factor(value)) {
                return Err(format!(
                    "{field}: expected factors from 0 to {LARGEST_FACTOR}, found {odd}"
                ));
            }
        }
        Ok(MotionResponse {
            learnt_from: learnt_from(hz.len(), position_density, rotation_density)?,
            hz,
            position: accel,
            rotation: gyro,
        })
    }
}

/// The densities of the poses at `count` frequencies; in words what is wrong with them.
fn learnt_from(
    count: usize,
    position: Option<Vec<f64>>,
    rotation: Option<Vec<f64>>,
) -> Result<Option<PoseDensities>, String> {
    let (position, rotation) = match (position, rotation) {
        (None, None) => return Ok(None),
        (Some(position), Some(rotation)) => (position, rotation),
        (None, _) => return Err("position_density: expected beside rotation_density".to_owned()),
        (_, None) => return Err("rotation_density: expected beside position_density".to_owned()),
    };
    for (field, densities) in [
        ("position_density", &position),
        ("rotation_density", &rotation),
    ] {
        if densities.len() != count {
            return Err(format!(
                "{field}: expected {count} densities, one for each of hz, found {}",
                densities.len()
            ));
        }
        let is_density = |value: &f64| value.is_finite() && *value >= 0.0;
        if let Some(odd) = densities.iter().find(|value| !is_density(value)) {
            return Err(format!(
                "{field}: expected densities from 0 on, found {odd}"
            ));
        }
    }
    Ok(Some(PoseDensities { position, rotation }))
}

/// A line of the file; nothing where there is none.
pub(crate) fn write_response(text: &mut String, indent: &str, response: Option<&MotionResponse>) {
    let Some(response) = response else {
        return;
    };
    let list = |values: &[f64]| {
        let values: Vec<String> = values.iter().map(|value| number(*value)).collect();
        values.join(", ")
    };
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "{indent}reference_response: {{hz: [{}], accel: [{}], gyro: [{}]",
        list(&response.hz),
        list(&response.position),
        list(&response.rotation)
    );
    if let Some(learnt) = &response.learnt_from {
        let _ = write!(
            text,
            ", position_density: [{}], rotation_density: [{}]",
            list(&learnt.position),
            list(&learnt.rotation)
        );
    }
    text.push_str("}\n");
}
