//! Files of placements.

use cromosim_spatial::in_plain_words;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_norway::{Mapping, Value};

use crate::placement::{RawDefaults, RawPlacement};
use crate::{ImuError, Placement, PlacementProblem};

const SCHEMA: &str = "cromosim/placements/1";
const DEMO: &str = include_str!("../../../../config/placements/demo.yaml");
const FULL17: &str = include_str!("../../../../config/placements/full17.yaml");

/// Rate of placements that no file describes, Hz.
const DEFAULT_RATE_HZ: f64 = 100.0;

/// Placements of distinct names, in the file's order.
///
/// ```yaml
/// schema: cromosim/placements/1
/// defaults: {rate_hz: 100, device: consumer_mems}
/// placements:
///   left_wrist: {site: left_watch}
///   pocket: {point: [0.17, -0.42, 0.07], skin_distance: 0.01, mount: {rotvec: [0, 0, 1.5708]}, follow: segment}
///   shin: {triangle: 1958, barycentrics: [0.7, 0.2, 0.1], rate_hz: 200, scheme: richardson}
/// ```
/// `placements` may also be a list whose entries have a `name`. A placement has one of `site`,
/// `triangle` with `barycentrics` and `point` (m, model frame in T-pose); `mount`
/// (site_from_sensor) is one of `rotvec` (rad), `quaternion_xyzw` and `matrix` (rows);
/// `skin_distance` is in m (default 0); `follow` is `skin` (default) or `segment`; `scheme` as
/// [`crate::Scheme`] (default spline); `device` as [`crate::Device::resolve`] (default: no error);
/// `rate_hz` must be given here or under `defaults`.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementSet {
    placements: Vec<Placement>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    schema: String,
    #[serde(default, skip_serializing)]
    defaults: RawDefaults,
    placements: Value,
}

impl PlacementSet {
    /// Parses a file's text; `file` names it in errors.
    ///
    /// # Errors
    /// [`ImuError::Yaml`], [`ImuError::Schema`] or [`ImuError::Placement`], naming file, placement
    /// and field.
    pub fn parse(text: &str, file: &str) -> Result<Self, ImuError> {
        let raw: RawFile = serde_norway::from_str(text).map_err(|error| ImuError::Yaml {
            file: file.to_owned(),
            problem: in_plain_words(error),
        })?;
        if raw.schema != SCHEMA {
            return Err(ImuError::Schema {
                file: file.to_owned(),
                expected: SCHEMA,
                found: raw.schema,
            });
        }
        let mut placements: Vec<Placement> = Vec::new();
        for (label, value) in entries(raw.placements, file)? {
            let refuse = |(field, problem)| ImuError::Placement {
                file: file.to_owned(),
                placement: label.clone(),
                field,
                problem,
            };
            let raw_placement: RawPlacement =
                serde_norway::from_value(value).map_err(|error| refuse(malformed(&error)))?;
            let placement = raw_placement.parse(&raw.defaults).map_err(refuse)?;
            if placements
                .iter()
                .any(|other| other.name() == placement.name())
            {
                return Err(refuse(("name", PlacementProblem::Duplicate)));
            }
            placements.push(placement);
        }
        if placements.is_empty() {
            let (placement, field) = ("(all)".to_owned(), "placements");
            return Err(ImuError::Placement {
                file: file.to_owned(),
                placement,
                field,
                problem: PlacementProblem::Missing,
            });
        }
        Ok(Self { placements })
    }

    /// Placements at named sites with the defaults at 100 Hz, each given as `NAME=SITE`, such as
    /// `left_wrist=left_watch`; `option` names what gave them in errors.
    ///
    /// # Errors
    /// [`ImuError::Placement`] for what is no such pair, a name that is no ROS name, and two of one
    /// name. Whether a body has the site is known once it is mounted there.
    pub fn at_sites(pairs: &[String], option: &str) -> Result<Self, ImuError> {
        let mut placements: Vec<Placement> = Vec::new();
        for pair in pairs {
            let refuse = |(field, problem)| ImuError::Placement {
                file: option.to_owned(),
                placement: pair.clone(),
                field,
                problem,
            };
            let (name, site) = pair
                .split_once('=')
                .ok_or_else(|| refuse(("site", PlacementProblem::Missing)))?;
            let placement = Placement::at_site(name, site, DEFAULT_RATE_HZ).map_err(refuse)?;
            if placements.iter().any(|other| other.name() == name) {
                return Err(refuse(("name", PlacementProblem::Duplicate)));
            }
            placements.push(placement);
        }
        Ok(Self { placements })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`PlacementSet::parse`], and [`ImuError::Unreadable`].
    pub fn read(path: &Path) -> Result<Self, ImuError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| ImuError::Unreadable {
            file: path.to_owned(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// The five placements of the demo: left_wrist, right_ankle, pelvis, sternum, head, at 100 Hz.
    pub fn demo() -> Self {
        Self::parse(DEMO, "demo.yaml").expect("the embedded placements are sound")
    }

    /// Seventeen placements like those of a full inertial suit, at 100 Hz.
    pub fn full17() -> Self {
        Self::parse(FULL17, "full17.yaml").expect("the embedded placements are sound")
    }

    /// The placements, in order.
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// The placement of a name.
    pub fn get(&self, name: &str) -> Option<&Placement> {
        self.placements
            .iter()
            .find(|placement| placement.name() == name)
    }

    /// The placements with what `change` makes of each: one rate or one scheme for all, say.
    #[must_use]
    pub fn map(self, change: impl FnMut(Placement) -> Placement) -> Self {
        Self {
            placements: self.placements.into_iter().map(change).collect(),
        }
    }

    /// The resolved placements as a file, every value written out.
    pub fn to_yaml(&self) -> String {
        let entry = |placement: &Placement| {
            (
                Value::from(placement.name()),
                serde_norway::to_value(RawPlacement::from(placement)),
            )
        };
        let map = |(name, value): (Value, Result<Value, _>)| {
            (name, value.expect("numbers and strings can be written"))
        };
        let placements: Mapping = self.placements.iter().map(entry).map(map).collect();
        let file = RawFile {
            schema: SCHEMA.to_owned(),
            defaults: RawDefaults::default(),
            placements: Value::Mapping(placements),
        };
        serde_norway::to_string(&file).expect("numbers and strings can be written")
    }
}

/// The placements' labels and fields, with the key of a map as the name.
fn entries(value: Value, file: &str) -> Result<Vec<(String, Value)>, ImuError> {
    let refuse = |placement: String, field, problem| {
        Err(ImuError::Placement {
            file: file.to_owned(),
            placement,
            field,
            problem,
        })
    };
    match value {
        Value::Mapping(map) => {
            let mut entries = Vec::with_capacity(map.len());
            for (key, mut value) in map {
                let Value::String(name) = key else {
                    return refuse(
                        format!("{key:?}"),
                        "name",
                        PlacementProblem::Malformed {
                            message: "the name must be a string".into(),
                        },
                    );
                };
                if let Value::Mapping(fields) = &mut value
                    && fields.insert("name".into(), name.as_str().into()).is_some()
                {
                    return refuse(
                        name,
                        "name",
                        PlacementProblem::Malformed {
                            message: "given twice, as the key and inside".into(),
                        },
                    );
                }
                entries.push((name, value));
            }
            Ok(entries)
        }
        Value::Sequence(list) => {
            let label = |k: usize, value: &Value| {
                value
                    .get("name")
                    .and_then(Value::as_str)
                    .map_or_else(|| format!("#{}", k + 1), str::to_owned)
            };
            Ok(list
                .into_iter()
                .enumerate()
                .map(|(k, value)| (label(k, &value), value))
                .collect())
        }
        _ => refuse(
            "(all)".into(),
            "placements",
            PlacementProblem::Malformed {
                message: "expected a map or a list".into(),
            },
        ),
    }
}

fn malformed(error: &serde_norway::Error) -> (&'static str, PlacementProblem) {
    (
        "fields",
        PlacementProblem::Malformed {
            message: in_plain_words(error),
        },
    )
}

#[cfg(test)]
#[path = "placement_tests.rs"]
mod tests;
