//! Parameter files: node sections, each with `ros__parameters`.

use std::path::Path;

use ros2_client::ParameterValue;
use serde_norway::{Mapping, Value};

use super::value::from_yaml;
use crate::error::{RosError, RosResult};
use crate::names::NodeName;

/// A value given for a parameter of the nodes that a pattern fits.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Override {
    /// File and line, or the argument.
    pub(crate) place: String,
    /// `/**`, `/*`, `/left/**`, `/left/virtual_imu`, `virtual_imu`.
    pub(crate) nodes: String,
    pub(crate) name: String,
    pub(crate) value: ParameterValue,
}

impl Override {
    /// From `-p name:=value`; a mapping is several parameters.
    pub(crate) fn from_yaml(
        place: &str,
        nodes: &str,
        name: &str,
        yaml: &str,
    ) -> RosResult<Vec<Self>> {
        let place = format!("--ros-args {place}");
        let wrong = |problem: String| RosError::Argument {
            place: place.clone(),
            problem,
        };
        let value: Value = serde_norway::from_str(yaml)
            .map_err(|error| wrong(format!("value is not YAML: {error}")))?;
        let mut found = Vec::new();
        flatten(&mut vec![name.to_owned()], &value, &mut |path, value| {
            found.push((path.join("."), value))
        });
        found
            .into_iter()
            .map(|(name, value)| {
                let value =
                    from_yaml(value).map_err(|problem| wrong(format!("{name}: {problem}")))?;
                Ok(Self {
                    place: place.clone(),
                    nodes: nodes.to_owned(),
                    name,
                    value,
                })
            })
            .collect()
    }

    /// True where the pattern fits the node. `*` is one part of a name, `**` any number; a name
    /// without a slash fits in every namespace.
    pub(crate) fn is_for(&self, node: &NodeName) -> bool {
        if !self.nodes.contains(['/', '*']) {
            return self.nodes == node.name();
        }
        let name = node.to_string();
        let pattern: Vec<&str> = self.nodes.trim_start_matches('/').split('/').collect();
        let tokens: Vec<&str> = name.trim_start_matches('/').split('/').collect();
        fits(&pattern, &tokens)
    }
}

fn fits(pattern: &[&str], tokens: &[&str]) -> bool {
    match (pattern, tokens) {
        ([], []) => true,
        (["**", rest @ ..], _) => (0..=tokens.len()).any(|skipped| fits(rest, &tokens[skipped..])),
        ([first, rest @ ..], [token, tokens @ ..]) => {
            (*first == "*" || first == token) && fits(rest, tokens)
        }
        _ => false,
    }
}

/// Calls `leaf` with the path of every value that is not a mapping with entries.
pub(crate) fn flatten<'v>(
    path: &mut Vec<String>,
    value: &'v Value,
    leaf: &mut impl FnMut(&[String], &'v Value),
) {
    match value {
        Value::Mapping(entries) if !entries.is_empty() => {
            for (key, value) in entries {
                path.push(key_text(key));
                flatten(path, value, leaf);
                path.pop();
            }
        }
        other => leaf(path, other),
    }
}

fn key_text(key: &Value) -> String {
    match key {
        Value::String(text) => text.clone(),
        other => serde_norway::to_string(other)
            .unwrap_or_default()
            .trim_end()
            .to_owned(),
    }
}

/// A value in a file: its keys from the top, the node pattern, the parameter's name, the value.
type Found<'v> = (Vec<String>, String, String, &'v Value);
/// What is wrong below which keys.
type Wrong = (Vec<String>, String);

/// Reads a ROS 2 parameter file, sections in their order.
///
/// # Errors
/// Names the file and, where it is known, the line.
pub(crate) fn read_params_file(path: &Path) -> RosResult<Vec<Override>> {
    let wrong = |line, problem| RosError::ParamsFile {
        path: path.to_owned(),
        line,
        problem,
    };
    let text = cromosim_spatial::read_text(path).map_err(|error| wrong(None, error.to_string()))?;
    let not_yaml = |error: serde_norway::Error| {
        wrong(
            error.location().map(|place| place.line()),
            format!("not YAML: {error}"),
        )
    };
    let root: Value = serde_norway::from_str(&text).map_err(not_yaml)?;
    let mut found = Vec::new();
    match &root {
        Value::Null => {}
        Value::Mapping(sections) => {
            let read = sections_of(sections, &mut Vec::new(), &mut found);
            read.map_err(|(keys, problem)| wrong(line_of(&text, &keys), problem))?;
        }
        _ => {
            return Err(wrong(
                Some(1),
                "expected node names with 'ros__parameters' below them".into(),
            ));
        }
    }
    found
        .into_iter()
        .map(|(keys, nodes, name, value)| {
            let line = line_of(&text, &keys);
            let value = from_yaml(value)
                .map_err(|problem| wrong(line, format!("parameter '{name}': {problem}")))?;
            let place = line.map_or_else(
                || path.display().to_string(),
                |line| format!("{}, line {line}", path.display()),
            );
            Ok(Override {
                place,
                nodes,
                name,
                value,
            })
        })
        .collect()
}

fn sections_of<'v>(
    entries: &'v Mapping,
    keys: &mut Vec<String>,
    found: &mut Vec<Found<'v>>,
) -> Result<(), Wrong> {
    for (key, value) in entries {
        keys.push(key_text(key));
        match value {
            _ if keys.last().is_some_and(|key| key == "ros__parameters") => {
                parameters_of(value, keys, found)?
            }
            Value::Mapping(entries) => sections_of(entries, keys, found)?,
            _ => {
                return Err((
                    keys.clone(),
                    format!(
                        "'{}': expected 'ros__parameters' below the node name",
                        keys.join("/")
                    ),
                ));
            }
        }
        keys.pop();
    }
    Ok(())
}

fn parameters_of<'v>(
    value: &'v Value,
    keys: &[String],
    found: &mut Vec<Found<'v>>,
) -> Result<(), Wrong> {
    let nodes = keys[..keys.len() - 1].join("/");
    if nodes.is_empty() {
        return Err((
            keys.to_vec(),
            "'ros__parameters' must stand below a node name ('/**' for every node)".into(),
        ));
    }
    match value {
        Value::Null => return Ok(()),
        Value::Mapping(entries) if entries.is_empty() => return Ok(()),
        Value::Mapping(_) => {}
        _ => {
            return Err((
                keys.to_vec(),
                "'ros__parameters': expected parameters below it".into(),
            ));
        }
    }
    flatten(&mut Vec::new(), value, &mut |path, value| {
        let keys = keys.iter().chain(path).cloned().collect();
        found.push((keys, nodes.clone(), path.join("."), value));
    });
    Ok(())
}

/// The line of the last of these keys, each looked for below the one before; counted from 1. None
/// in flow style.
fn line_of(text: &str, keys: &[String]) -> Option<usize> {
    const QUOTES: [char; 2] = ['"', '\''];
    let mut lines = text.lines().enumerate();
    let mut found = None;
    for key in keys {
        let is_key = |line: &str| {
            let rest = line
                .trim_start()
                .trim_start_matches(QUOTES)
                .strip_prefix(key.as_str());
            rest.is_some_and(|rest| {
                rest.trim_start_matches(QUOTES)
                    .trim_start()
                    .starts_with(':')
            })
        };
        found = Some(lines.find(|(_, line)| is_key(line))?.0 + 1);
    }
    found
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn read(text: &str) -> RosResult<Vec<Override>> {
        let file = tempfile::Builder::new().suffix(".yaml").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_params_file(file.path())
    }

    #[test]
    fn sections_and_nested_maps_become_dotted_names_with_their_lines() {
        let text = "# comment\n/**:\n  ros__parameters:\n    use_sim_time: true\nleft:\n  virtual_imu:\n    ros__parameters:\n      \
                    noise:\n        seed: 7\n      rate_hz: 100.0\n";
        let found = read(text).unwrap();
        let seen: Vec<_> = found
            .iter()
            .map(|o| (o.nodes.as_str(), o.name.as_str(), o.value.clone()))
            .collect();
        assert_eq!(
            seen,
            [
                ("/**", "use_sim_time", ParameterValue::Boolean(true)),
                ("left/virtual_imu", "noise.seed", ParameterValue::Integer(7)),
                ("left/virtual_imu", "rate_hz", ParameterValue::Double(100.0)),
            ]
        );
        assert!(
            found[1].place.ends_with(".yaml, line 9"),
            "{}",
            found[1].place
        );
        let left = NodeName::new("/left", "virtual_imu").unwrap();
        assert!(found.iter().all(|o| o.is_for(&left)));
        let right = NodeName::new("/right", "virtual_imu").unwrap();
        assert_eq!(found.iter().filter(|o| o.is_for(&right)).count(), 1);
    }

    #[test]
    fn patterns_fit_as_in_ros() {
        let node = NodeName::new("/a/b", "n").unwrap();
        let fits = |nodes: &str| {
            let (place, name) = (String::new(), String::new());
            Override {
                place,
                nodes: nodes.into(),
                name,
                value: ParameterValue::NotSet,
            }
            .is_for(&node)
        };
        for nodes in ["/**", "/a/**", "/**/n", "/a/*/n", "/a/b/n", "a/b/n", "n"] {
            assert!(fits(nodes), "{nodes}");
        }
        for nodes in ["/*", "/a/*", "/n", "m", "/b/**"] {
            assert!(!fits(nodes), "{nodes}");
        }
    }

    #[test]
    fn wrong_files_are_named_with_their_line() {
        for (text, expected) in [
            (
                "n:\n  ros__parameters:\n    a: [1, x]\n",
                "line 3: parameter 'a': a list",
            ),
            (
                "n:\n  rate: 5\n",
                "line 2: 'n/rate': expected 'ros__parameters'",
            ),
            (
                "ros__parameters:\n  a: 1\n",
                "line 1: 'ros__parameters' must stand below a node name",
            ),
            (
                "n:\n  ros__parameters: 3\n",
                "line 2: 'ros__parameters': expected",
            ),
            ("- a\n", "line 1: expected node names"),
            ("n: [\n", "not YAML"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        }
    }
}
