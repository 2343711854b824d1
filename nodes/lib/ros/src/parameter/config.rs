//! Parameters from and to a configuration struct.

use cromosim_spatial::in_plain_words;
use ros2_client::ParameterValue;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_norway::{Mapping, Value};

use super::declaration::Parameter;
use super::file::flatten;
use super::store::Parameters;
use super::value::{from_yaml, to_yaml};
use crate::error::{RosError, RosResult};

impl Parameters {
    /// Declares a parameter for every field of a configuration, with the field's value as default;
    /// fields of inner structs have dotted names. The parameters are read-only, for a configuration
    /// is read once; [`Parameters::amend`] changes that.
    ///
    /// An empty map stands open: any parameter below its name is taken and checked by
    /// [`Parameters::config`]. `None` and empty lists say nothing of their type: any value is
    /// taken, and checked there too.
    ///
    /// # Errors
    /// Where a field is not a scalar, a list of scalars, a struct or a map.
    pub fn declare_config<C: Serialize>(&self, defaults: &C) -> RosResult<()> {
        let wrong = |problem: String| RosError::Config { problem };
        let root = serde_norway::to_value(defaults).map_err(|error| wrong(error.to_string()))?;
        let mut leaves = Vec::new();
        flatten(&mut Vec::new(), &root, &mut |path, value| {
            leaves.push((path.join("."), value))
        });
        for (name, value) in leaves {
            if matches!(value, Value::Mapping(_)) {
                self.open_config(&name);
                continue;
            }
            let default =
                from_yaml(value).map_err(|problem| wrong(format!("field '{name}': {problem}")))?;
            let untyped = value.is_null() || value.as_sequence().is_some_and(Vec::is_empty);
            self.declare(Parameter {
                untyped,
                in_config: true,
                ..Parameter::with_value(&name, default).read_only()
            })?;
        }
        Ok(())
    }

    /// The configuration that the parameters make now.
    ///
    /// # Errors
    /// What serde says: a missing or unknown field, a value out of an enum.
    pub fn config<C: DeserializeOwned>(&self) -> RosResult<C> {
        let mut root = Mapping::new();
        for (name, value) in self.config_values() {
            insert(&mut root, &name, &value).map_err(|problem| RosError::Config { problem })?;
        }
        for name in self.open_configs() {
            insert_map(&mut root, &name);
        }
        serde_norway::from_value(Value::Mapping(root)).map_err(|error| RosError::Config {
            problem: one_line(&in_plain_words(error)),
        })
    }
}

fn insert(root: &mut Mapping, name: &str, value: &ParameterValue) -> Result<(), String> {
    let Some((first, rest)) = name.split_once('.') else {
        root.insert(name.into(), to_yaml(value));
        return Ok(());
    };
    match root
        .entry(first.into())
        .or_insert_with(|| Value::Mapping(Mapping::new()))
    {
        Value::Mapping(inner) => insert(inner, rest, value),
        _ => Err(format!(
            "'{first}' is a value and has '{rest}' below it too"
        )),
    }
}

/// An open map that nothing was put into must still be there, empty.
fn insert_map(root: &mut Mapping, name: &str) {
    let (first, rest) = name
        .split_once('.')
        .map_or((name, None), |(first, rest)| (first, Some(rest)));
    let inner = root
        .entry(first.into())
        .or_insert_with(|| Value::Mapping(Mapping::new()));
    if let (Value::Mapping(inner), Some(rest)) = (inner, rest) {
        insert_map(inner, rest);
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeMap;

    use super::*;
    use crate::RosArgs;

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Config {
        rate_hz: f64,
        scheme: Scheme,
        device: Option<String>,
        names: Vec<String>,
        noise: Noise,
        placements: BTreeMap<String, Placement>,
    }

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Scheme {
        Spline,
        Differences,
    }

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Noise {
        seed: u64,
    }

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Placement {
        site: String,
    }

    fn defaults() -> Config {
        let placements = BTreeMap::new();
        Config {
            rate_hz: 100.0,
            scheme: Scheme::Spline,
            device: None,
            names: vec![],
            noise: Noise { seed: 1 },
            placements,
        }
    }

    fn config(given: &[&str]) -> RosResult<Config> {
        let parameters = Parameters::new();
        parameters.declare_config(&defaults())?;
        let line = std::iter::once("--ros-args").chain(given.iter().flat_map(|text| ["-p", text]));
        let args = RosArgs::parse(line)?;
        parameters.apply(&args, &args.node_name("n")?)?;
        parameters.config()
    }

    #[test]
    fn a_config_comes_back_with_what_was_given() {
        assert_eq!(config(&[]).unwrap(), defaults());
        let config = config(&[
            "rate_hz:=50",
            "scheme:=differences",
            "device:=phone",
            "names:=[a, b]",
            "noise.seed:=7",
            "placements.left_wrist.site:=left_watch",
            "use_sim_time:=true",
        ])
        .unwrap();
        assert_eq!(
            (config.rate_hz, config.scheme, config.noise.seed),
            (50.0, Scheme::Differences, 7)
        );
        assert_eq!(config.device.as_deref(), Some("phone"));
        assert_eq!(config.names, ["a", "b"]);
        assert_eq!(config.placements["left_wrist"].site, "left_watch");
    }

    #[test]
    fn wrong_values_are_refused() {
        for (given, expected) in [
            (
                "rate_hz:=fast",
                "-p rate_hz:=fast: parameter 'rate_hz': expected a number, found 'fast'",
            ),
            (
                "rate_khz:=1",
                "unknown parameter 'rate_khz', did you mean 'rate_hz'?",
            ),
            ("scheme:=guess", "unknown variant `guess`"),
            ("placements.w.sight:=x", "sight"),
            ("noise.seed:=-1", "-1"),
        ] {
            let text = config(&[given]).unwrap_err().to_string();
            assert!(text.contains(expected) && !text.contains('\n'), "{text}");
        }
    }
}
