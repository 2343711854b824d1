//! How an input is read, and which of the settings were given.

use std::sync::Arc;

use cromosim_body::BodyModel;
use cromosim_motion::{MotionOptions, ShapeChoice, UpAxis};

use crate::datasets::DatasetFiles;

/// A point of the body whose trajectory is taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Followed {
    /// The frame of this joint's segment, by SMPL's name.
    Joint(String),
    /// A sensor at this named site of the skin: z outward, x along the bone.
    Site(String),
}

impl Followed {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Joint(name) | Self::Site(name) => name,
        }
    }
}

/// How an input is read. Settings that its kind does not take are refused.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Of motion files; `start_s` and `duration_s` are the part of a data set's recording, too, and
    /// `person` is one of the bodies in a bag.
    pub motion: MotionOptions,
    /// The body that motions are read for, rather than the embedded one.
    pub body: Option<Arc<BodyModel>>,
    /// Of a motion: the trajectory of this point.
    pub followed: Option<Followed>,
    /// Of a bag: the topic to take; needed where several suit.
    pub topic: Option<String>,
    /// Of a bag's TF: the frame whose motion to take.
    pub frame: Option<String>,
    /// Of a bag's TF: the frame that stands still; the root of the tree where absent.
    pub fixed_frame: Option<String>,
    /// Of a data set: this placement alone.
    pub placement: Option<String>,
    /// Of a data set: what belongs to the recording and lies elsewhere.
    pub files: DatasetFiles,
    /// The placement's name in a bag that is written; `body`, or as the data set says, where
    /// absent.
    pub name: Option<String>,
}

impl ReadOptions {
    /// The command line's name of the first setting of motion files that is not as by default;
    /// start and duration, which other things than motions may have too, on demand.
    pub fn motion_setting(&self, with_part: bool) -> Option<&'static str> {
        self.motion_settings(with_part).next()
    }

    /// As [`Self::motion_setting`], all of them.
    pub fn motion_settings(&self, with_part: bool) -> impl Iterator<Item = &'static str> + use<> {
        let motion = &self.motion;
        given([
            (motion.up_axis != UpAxis::Detect, "--up-axis"),
            (motion.unit_scale_m.is_some(), "--unit"),
            (motion.skeleton_map.is_some(), "--skeleton-map"),
            (with_part && motion.start_s != 0.0, "--start"),
            (with_part && motion.duration_s.is_some(), "--duration"),
            (motion.skeleton.is_some(), "--skeleton"),
            (motion.rate_hz.is_some(), "--motion-rate"),
            (motion.marker_set.is_some(), "--marker-set"),
            (motion.subject.is_some(), "--subject"),
            (motion.placements_as_given, "--placements-as-given"),
            (motion.person.is_some(), "--person"),
            (motion.shape != ShapeChoice::Detect, "--shape"),
            (motion.source_body.is_some(), "--source-body"),
        ])
    }

    /// The command line's name of the first setting that only data sets take.
    pub(super) fn dataset_setting(&self) -> Option<&'static str> {
        let settings = [
            (self.placement.is_some(), "--placement"),
            (self.files.reference.is_some(), "--reference"),
            (self.files.gyroscope.is_some(), "--gyroscope"),
        ];
        given(settings).next()
    }

    /// The command line's name of the first setting that only bags take.
    pub(super) fn bag_setting(&self) -> Option<&'static str> {
        let settings = [
            (self.topic.is_some(), "--topic"),
            (self.frame.is_some(), "--frame"),
        ];
        given(settings).next()
    }
}

fn given<const N: usize>(
    settings: [(bool, &'static str); N],
) -> impl Iterator<Item = &'static str> {
    let given = settings.into_iter().filter(|(given, _)| *given);
    given.map(|(_, name)| name)
}
