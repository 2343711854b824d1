//! Which marker sits where on the body: data, one YAML file a set.

use std::collections::BTreeMap;

use cromosim_body::{BodyModel, Joint, Site};
use cromosim_spatial::in_plain_words;
use nalgebra::Vector3;
use serde::Deserialize;

use super::ray::site_by_ray;
use crate::MotionError;

const EMBEDDED: [(&str, &str); 1] = [(
    "plug_in_gait",
    include_str!("../../marker_sets/plug_in_gait.yaml"),
)];
/// The largest number of markers in a set.
const MAX_MARKERS: usize = 500;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSet {
    name: String,
    description: String,
    height_mm: f64,
    markers: BTreeMap<String, RawMarker>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMarker {
    site: Option<String>,
    vertex: Option<u32>,
    triangle: Option<u32>,
    barycentrics: Option<[f64; 3]>,
    from: Option<String>,
    to: Option<String>,
    along: Option<f64>,
    direction: Option<[f64; 3]>,
    height_mm: Option<f64>,
    #[serde(default)]
    aliases: Vec<String>,
}

/// Where on the skin a marker is stuck.
#[derive(Clone, Debug, PartialEq)]
pub enum MarkerSite {
    /// A named site of the body.
    Site(String),
    /// A vertex of the mesh; only for the body it was found on.
    Vertex(u32),
    /// A point of a triangle; only for the body it was found on.
    Barycentric(u32, [f64; 3]),
    /// Where a ray leaves the skin of the mean shape in T-pose: from the point `along` of the way
    /// between two joints (0 the first, 1 the second) in `direction` (left, up, forward). Means the
    /// same point of the skin on every body.
    Ray {
        /// The joint that the way begins at.
        from: Joint,
        /// The joint that it leads to; the same one for a point on a joint.
        to: Joint,
        /// Share of the way.
        along: f64,
        /// Model axes, any length but 0.
        direction: Vector3<f64>,
    },
}

/// One marker of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct SetMarker {
    /// The label in recordings, compared without case.
    pub label: String,
    /// Other labels of the same marker.
    pub aliases: Vec<String>,
    /// Where on the skin it is stuck.
    pub site: MarkerSite,
    /// Its centre over the skin along the normal, m.
    pub height_m: f64,
}

/// A marker set: labels, and where on the skin each marker is stuck.
///
/// As YAML: `name`, `description`, `height_mm` (centres over the skin; usual markers 9.5) and
/// `markers`: label to one of `{site: NAME}`, `{vertex: N}`, `{triangle: N, barycentrics: [a, b,
/// c]}`, `{from: JOINT, to: JOINT, along: SHARE, direction: [left, up, forward]}` (see
/// [`MarkerSite::Ray`]; `to` and `along` may be left out), each with `height_mm` and `aliases` of
/// its own where wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerSet {
    name: String,
    description: String,
    markers: Vec<SetMarker>,
}

impl MarkerSet {
    /// The sets that come with the suite: plug_in_gait.
    ///
    /// # Errors
    /// None in practice: a test reads them all.
    pub fn embedded() -> Result<Vec<Self>, MotionError> {
        EMBEDDED
            .iter()
            .map(|(name, yaml)| Self::from_yaml(yaml, &format!("embedded marker set {name}")))
            .collect()
    }

    /// From YAML; `origin` names the file in errors.
    ///
    /// # Errors
    /// [`MotionError::MarkerSetSyntax`] and [`MotionError::MapContent`].
    pub fn from_yaml(yaml: &str, origin: &str) -> Result<Self, MotionError> {
        let raw: RawSet =
            serde_norway::from_str(yaml).map_err(|error| MotionError::MarkerSetSyntax {
                origin: origin.to_owned(),
                problem: in_plain_words(error),
            })?;
        let content = |key: &str, problem: &str| MotionError::MapContent {
            origin: origin.to_owned(),
            key: key.to_owned(),
            problem: problem.to_owned(),
        };
        if raw.markers.is_empty() || raw.markers.len() > MAX_MARKERS {
            return Err(content(
                "markers",
                &format!("{} of them, expected 1 to {MAX_MARKERS}", raw.markers.len()),
            ));
        }
        let mut markers = Vec::with_capacity(raw.markers.len());
        for (label, raw_marker) in raw.markers {
            let height_mm = raw_marker.height_mm.unwrap_or(raw.height_mm);
            let key = format!("markers.{label}");
            if !(0.0..=200.0).contains(&height_mm) {
                return Err(content(&key, "height_mm is not from 0 to 200"));
            }
            let aliases = raw_marker.aliases.clone();
            let site = site(raw_marker).map_err(|problem| content(&key, &problem))?;
            markers.push(SetMarker {
                label,
                aliases,
                site,
                height_m: height_mm * 1e-3,
            });
        }
        Ok(Self {
            name: raw.name,
            description: raw.description,
            markers,
        })
    }

    /// The set's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the set is for, in a few words.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// The markers, sorted by label.
    pub fn markers(&self) -> &[SetMarker] {
        &self.markers
    }
}

fn site(raw: RawMarker) -> Result<MarkerSite, String> {
    let given = [
        raw.site.is_some(),
        raw.vertex.is_some(),
        raw.triangle.is_some(),
        raw.from.is_some(),
    ];
    if given.iter().filter(|given| **given).count() != 1 {
        return Err("expected one of site, vertex, triangle and from".to_owned());
    }
    if raw.triangle.is_some() != raw.barycentrics.is_some() {
        return Err("triangle and barycentrics belong together".to_owned());
    }
    if raw.from.is_some() != raw.direction.is_some()
        || (raw.from.is_none() && (raw.to.is_some() || raw.along.is_some()))
    {
        return Err("from and direction belong together, to and along with them".to_owned());
    }
    match (
        raw.site,
        raw.vertex,
        raw.triangle.zip(raw.barycentrics),
        raw.from.zip(raw.direction),
    ) {
        (Some(site), ..) => Ok(MarkerSite::Site(site)),
        (_, Some(vertex), ..) => Ok(MarkerSite::Vertex(vertex)),
        (_, _, Some((triangle, barycentrics)), _) => {
            Ok(MarkerSite::Barycentric(triangle, barycentrics))
        }
        (_, _, _, Some((from, direction))) => {
            let joint = |name: &str| {
                Joint::from_name(name).ok_or_else(|| format!("SMPL has no joint {name}"))
            };
            let to = joint(raw.to.as_deref().unwrap_or(&from))?;
            let (along, direction) = (raw.along.unwrap_or(0.0), Vector3::from(direction));
            if !(along.abs() <= 10.0 && direction.norm() > 1e-6 && direction.norm() < 1e6) {
                return Err(
                    "expected along from -10 to 10 and a direction that is not 0".to_owned(),
                );
            }
            Ok(MarkerSite::Ray {
                from: joint(&from)?,
                to,
                along,
                direction,
            })
        }
        _ => Err("expected one of site, vertex, triangle and from".to_owned()),
    }
}

impl SetMarker {
    /// The point of the skin on `body`.
    ///
    /// # Errors
    /// [`MotionError::Body`] for a site, vertex or triangle that the body does not have,
    /// [`MotionError::MapContent`] for a ray that meets no skin.
    pub fn site_on(&self, body: &BodyModel, set: &str) -> Result<Site, MotionError> {
        let missed = |problem: &str| MotionError::MapContent {
            origin: format!("marker set {set}"),
            key: format!("markers.{}", self.label),
            problem: problem.to_owned(),
        };
        match &self.site {
            MarkerSite::Site(name) => Ok(body.site(name)?),
            MarkerSite::Barycentric(triangle, barycentrics) => {
                Ok(body.site_at(*triangle, *barycentrics)?)
            }
            MarkerSite::Vertex(vertex) => {
                let corner =
                    |triangle: &[u32; 3]| triangle.iter().position(|corner| corner == vertex);
                let found = body
                    .faces()
                    .iter()
                    .enumerate()
                    .find_map(|(triangle, corners)| Some((triangle, corner(corners)?)));
                let Some((triangle, corner)) = found else {
                    return Err(missed(&format!(
                        "no triangle has vertex {vertex} on body {}",
                        body.id()
                    )));
                };
                Ok(body.site_at(
                    triangle as u32,
                    std::array::from_fn(|index| f64::from(u8::from(index == corner))),
                )?)
            }
            MarkerSite::Ray {
                from,
                to,
                along,
                direction,
            } => {
                let (joints, _) = body.joint_shape_directions();
                let start = joints[from.index()].lerp(&joints[to.index()], *along);
                let (triangle, barycentrics) = site_by_ray(body, start, *direction)
                    .ok_or_else(|| missed("the ray meets no skin; check from, to and direction"))?;
                Ok(body.site_at(triangle, barycentrics)?)
            }
        }
    }
}
