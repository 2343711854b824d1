//! What is compared: a YAML file.

use std::path::Path;

use cromosim_spatial::in_plain_words;
use serde::Deserialize;

use super::rigid::RigidStudy;
use super::truth_source::TruthSource;
use crate::EvaluationError;
use crate::error::At;
use crate::training_data::DataSource;

const SCHEMA: &str = "cromosim/fidelity/1";
const EMBEDDED: &str = include_str!("../../../../../config/evaluation/fidelity.yaml");
const EMBEDDED_NAME: &str = "config/evaluation/fidelity.yaml";

/// Studies with one seed (YAML, schema cromosim/fidelity/1).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    schema: String,
    /// Seed of people, devices and errors that are drawn, and of the bootstrap.
    pub seed: u64,
    /// The studies, in the order of the tables.
    pub studies: Vec<Study>,
    /// Studies of rigid bodies, in the order of the tables.
    #[serde(default)]
    pub rigid: Vec<RigidStudy>,
}

/// Recordings that are scored together, by position.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// What its measured side is, for the table.
    pub measured: String,
    /// The networks: a model's name, or `none`.
    pub model: String,
    /// What is scored.
    pub test: Vec<DataSource>,
    /// The little data that the distribution mapping is fitted on, at the same positions; none: no
    /// mapping.
    #[serde(default)]
    pub mapping: Vec<DataSource>,
    /// Whether the study is left out, and listed as such, where there is no folder of data.
    #[serde(default)]
    pub optional: bool,
}

impl Study {
    /// What the measured side of its test rests on; the suite's own spline, where a part of it does.
    pub fn truth(&self) -> TruthSource {
        if self.test.iter().any(|source| !source.motions.is_empty()) {
            TruthSource::OwnSpline
        } else {
            TruthSource::MeasuredBesideSpline
        }
    }
}

impl Protocol {
    /// The protocol that comes with the suite.
    ///
    /// # Errors
    /// None, as a test shows.
    pub fn embedded() -> Result<Self, EvaluationError> {
        Self::parse(EMBEDDED, EMBEDDED_NAME)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not sound.
    pub fn read(path: &Path) -> Result<Self, EvaluationError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| EvaluationError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    fn parse(text: &str, file: &str) -> Result<Self, EvaluationError> {
        let protocol: Self =
            serde_norway::from_str(text).map_err(|error| EvaluationError::Yaml {
                file: file.to_owned(),
                problem: in_plain_words(error),
            })?;
        if protocol.schema != SCHEMA {
            return Err(EvaluationError::Schema {
                file: file.to_owned(),
                expected: SCHEMA,
                found: protocol.schema,
            });
        }
        for study in &protocol.studies {
            if study.test.is_empty() {
                return Err(EvaluationError::NoTestData {
                    file: file.to_owned(),
                    study: study.name.clone(),
                });
            }
            for source in study.test.iter().chain(&study.mapping) {
                source
                    .check()
                    .at(|| format!("{file}: study {}", study.name))?;
            }
        }
        for study in &protocol.rigid {
            study
                .check()
                .map_err(|problem| EvaluationError::RigidStudy {
                    file: file.to_owned(),
                    study: study.name.clone(),
                    problem,
                })?;
        }
        Ok(protocol)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn files_that_come_with_the_suite_are_sound() {
        let own = Protocol::embedded().unwrap();
        assert_eq!((own.studies.len(), own.rigid.len()), (8, 14));
        let own_spline = |study: &&Study| study.truth() == TruthSource::OwnSpline;
        assert_eq!(own.studies.iter().filter(own_spline).count(), 6);
        let totalcapture = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../config/evaluation/totalcapture.yaml");
        assert_eq!(
            Protocol::read(&totalcapture).unwrap().studies[0].test[0].sites,
            ["L_LowArm", "R_LowArm"]
        );
    }
}
