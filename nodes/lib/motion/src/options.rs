//! Settings of reading and retargeting.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::axes::UpAxis;
use crate::{MarkerOptions, MarkerSet, MotionError, ShapeChoice, SkeletonMap};

/// What [`MotionOptions::person`] says for everybody.
const EVERYBODY: &str = "all";

/// The pose of the source that is compared with SMPL's T-pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RestChoice {
    /// The zero pose where it is a standing human, else what the map says, else a T-pose in the
    /// first frame.
    #[default]
    Detect,
    /// All channels zero.
    ZeroPose,
    /// The map's `rest_axes`.
    Map,
    /// This frame, 0-based, which must show a T-pose or an A-pose.
    Frame(usize),
}

/// How to read a motion file; every field has a default.
#[derive(Clone, Debug, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionOptions {
    /// An embedded skeleton map's name or a YAML file; found by the joints' names where absent.
    pub skeleton_map: Option<String>,
    /// The source's up axis.
    pub up_axis: UpAxis,
    /// Metres per unit of the source; found by the skeleton's height where absent.
    pub unit_scale_m: Option<f64>,
    /// The source's rest pose.
    pub rest: RestChoice,
    /// Keeps a leading T-pose and the frames that blend it into the motion.
    pub keep_lead_in: bool,
    /// An AMC file's skeleton (ASF); the one beside it where absent.
    pub skeleton: Option<PathBuf>,
    /// An embedded marker set's name or a YAML file; plug_in_gait where absent.
    pub marker_set: Option<String>,
    /// Whose markers are taken; needed where the labels name several people.
    pub subject: Option<String>,
    /// Takes markers to be stuck exactly where the marker set says, instead of about a centimetre
    /// around it.
    pub placements_as_given: bool,
    /// Where the body's shape comes from.
    pub shape: ShapeChoice,
    /// The body file that the motion's betas are for, so that another body can be fitted to that
    /// person's bones (SMPL parameters only).
    pub source_body: Option<PathBuf>,
    /// Which person of a file of several, by its name or number there; who is in it for the longest
    /// time, where absent. For [`crate::read_people`] also `all`, or several with commas between.
    pub person: Option<String>,
    /// Frames per second, Hz, of AMC files (120 where absent) and SMPL parameters (video estimates
    /// do not say it: 30 where absent; where a file does, this one counts). Not of BVH and markers.
    pub rate_hz: Option<f64>,
    /// Where to begin, s after the first frame that is kept.
    pub start_s: f64,
    /// How much to take, s; all where absent.
    pub duration_s: Option<f64>,
}

impl MotionOptions {
    /// Whether [`Self::person`] asks for several people: `all`, or names with commas between (`7,`
    /// is several that are one).
    pub fn asks_for_several(&self) -> bool {
        self.person
            .as_deref()
            .is_some_and(|person| person == EVERYBODY || person.contains(','))
    }

    /// The names asked for; none for everybody.
    pub(crate) fn people(&self) -> Option<Vec<&str>> {
        let person = self
            .person
            .as_deref()
            .filter(|&person| person != EVERYBODY)?;
        let names: Vec<&str> = person
            .split(',')
            .map(str::trim)
            .filter(|name| !name.is_empty())
            .collect();
        Some(if names.is_empty() {
            vec![person]
        } else {
            names
        })
    }

    /// The chosen map, from its file if it is no embedded one; `None` where it is to be detected.
    pub(crate) fn map(&self) -> Result<Option<SkeletonMap>, MotionError> {
        let Some(given) = &self.skeleton_map else {
            return Ok(None);
        };
        let embedded = SkeletonMap::embedded()?;
        if let Some(map) = embedded.iter().find(|map| map.name() == given) {
            return Ok(Some(map.clone()));
        }
        let path = Path::new(given);
        if !path.exists() {
            return Err(MotionError::UnknownMap {
                given: given.clone(),
                known: embedded.into_iter().map(|map| map.name).collect(),
            });
        }
        let yaml = cromosim_spatial::read_text(path).map_err(|source| MotionError::Read {
            path: path.to_owned(),
            source,
        })?;
        SkeletonMap::from_yaml(&yaml, given).map(Some)
    }

    /// The chosen marker set, from its file if it is no embedded one.
    ///
    /// # Errors
    /// [`MotionError::UnknownMarkerSet`], [`MotionError::Read`], and those of
    /// [`MarkerSet::from_yaml`].
    pub fn markers_set(&self) -> Result<MarkerSet, MotionError> {
        let given = self.marker_set.as_deref().unwrap_or("plug_in_gait");
        let embedded = MarkerSet::embedded()?;
        if let Some(set) = embedded.iter().find(|set| set.name() == given) {
            return Ok(set.clone());
        }
        let path = Path::new(given);
        if !path.exists() {
            let known = embedded.iter().map(|set| set.name().to_owned()).collect();
            return Err(MotionError::UnknownMarkerSet {
                given: given.to_owned(),
                known,
            });
        }
        let yaml = cromosim_spatial::read_text(path).map_err(|source| MotionError::Read {
            path: path.to_owned(),
            source,
        })?;
        MarkerSet::from_yaml(&yaml, given)
    }

    pub(crate) fn markers_options(&self) -> MarkerOptions {
        MarkerOptions {
            subject: self.subject.clone(),
            up_axis: self.up_axis,
            unit_scale_m: self.unit_scale_m,
            fit_placement: !self.placements_as_given,
            ..Default::default()
        }
    }
}
