//! What is compared: a YAML file.

use std::path::Path;

use anyhow::{Context, bail};
use serde::Deserialize;

use crate::train::config::Source;

const SCHEMA: &str = "cromosim/fidelity/1";
const DEFAULT: &str = include_str!("../../../../../config/evaluation/fidelity.yaml");

/// Studies with one seed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    schema: String,
    /// Of people, devices and errors that are drawn, and of the bootstrap.
    pub seed: u64,
    /// In order.
    pub studies: Vec<Study>,
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
    pub test: Vec<Source>,
    /// The little data that the distribution mapping is fitted on, at the same positions; none: no
    /// mapping.
    #[serde(default)]
    pub mapping: Vec<Source>,
}

impl Protocol {
    /// Reads a file, or the one that comes with the suite.
    pub fn read(path: Option<&Path>) -> anyhow::Result<Self> {
        let (text, name) = match path {
            Some(path) => (
                std::fs::read_to_string(path)
                    .with_context(|| format!("{}: cannot be read", path.display()))?,
                path.display().to_string(),
            ),
            None => (
                DEFAULT.to_owned(),
                "config/evaluation/fidelity.yaml".to_owned(),
            ),
        };
        let protocol: Self = serde_norway::from_str(&text).with_context(|| name.clone())?;
        if protocol.schema != SCHEMA {
            bail!(
                "{name}: schema: expected `{SCHEMA}`, found `{}`",
                protocol.schema
            );
        }
        for study in &protocol.studies {
            if study.test.is_empty() {
                bail!("{name}: study {}: no test data", study.name);
            }
            for source in study.test.iter().chain(&study.mapping) {
                source
                    .check()
                    .with_context(|| format!("{name}: study {}", study.name))?;
            }
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
        assert_eq!(Protocol::read(None).unwrap().studies.len(), 8);
        let totalcapture =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("config/evaluation/totalcapture.yaml");
        assert_eq!(
            Protocol::read(Some(&totalcapture)).unwrap().studies[0].test[0].sites,
            ["L_LowArm", "R_LowArm"]
        );
    }
}
