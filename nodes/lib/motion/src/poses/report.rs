//! How SMPL parameters were read: for `inspect` and the summary line.

use std::fmt;

use cromosim_body::{Gender, ShapeSpace};
use serde::{Deserialize, Serialize};

use super::format::PoseFormat;

/// Who says how many frames a second has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RateOrigin {
    /// The file.
    File,
    /// `rate_hz` of the options.
    Option,
    /// Nobody: a usual video rate is assumed.
    Assumed,
}

/// Where the shape of the body comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ShapeOrigin {
    /// The file's betas.
    File,
    /// Fitted to the bones of the file's own body.
    Fit {
        /// Root mean square of the bone lengths' remaining differences, m.
        length_rms_m: f64,
    },
    /// The mean body.
    Mean,
}

/// What was taken of a file of SMPL parameters, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseReport {
    /// Who wrote it.
    pub format: PoseFormat,
    /// The person.
    pub person: String,
    /// Everybody in the file and their numbers of frames.
    pub people: Vec<(String, usize)>,
    /// Who says the rate.
    pub rate_origin: RateOrigin,
    /// The source's gender.
    pub gender: Option<Gender>,
    /// Whose shapes the source's betas tell.
    pub shape_space: ShapeSpace,
    /// The source's betas, averaged over the track.
    pub source_betas: Vec<f64>,
    /// Where the body's own shape comes from.
    pub shape_origin: ShapeOrigin,
    /// Betas other than 0 that the body does not have.
    pub betas_left_out: usize,
    /// The source's up axis: `+y`; `camera` for a camera held level.
    pub up_axis: String,
    /// Whether the file says where the body goes; else it stays in place.
    pub has_trajectory: bool,
    /// Number of the motion's first frame in the file or its video: people of one file are in step
    /// by it.
    pub first_frame: i64,
    /// Frames in gaps of the track, made by interpolation, with confidence 0.
    pub bridged_frames: usize,
    /// Frames of the track beyond a gap that is too long.
    pub left_out_frames: usize,
    /// How far the source was raised to stand on the floor, m.
    pub floor_shift_m: f64,
}

impl fmt::Display for PoseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, ", self.format)?;
        if self.people.len() > 1 {
            write!(
                f,
                "person {} of {}, ",
                self.person,
                people_text(&self.people)
            )?;
        }
        f.write_str(match self.rate_origin {
            RateOrigin::File => "",
            RateOrigin::Option => "rate as set, ",
            RateOrigin::Assumed => "rate assumed (set rate_hz), ",
        })?;
        write!(
            f,
            "up {}, {}",
            self.up_axis,
            if self.has_trajectory {
                "trajectory of the file"
            } else {
                "in place"
            }
        )?;
        if self.bridged_frames > 0 {
            write!(f, ", {} frames bridged", self.bridged_frames)?;
        }
        if self.left_out_frames > 0 {
            write!(
                f,
                ", {} frames beyond long gaps left out",
                self.left_out_frames
            )?;
        }
        match self.shape_origin {
            ShapeOrigin::File => f.write_str(", betas of the file")?,
            ShapeOrigin::Fit { length_rms_m } => write!(
                f,
                ", shape fitted to its bones within {:.1} mm (RMS)",
                1e3 * length_rms_m
            )?,
            ShapeOrigin::Mean if self.source_betas.iter().all(|&beta| beta == 0.0) => {
                f.write_str(", mean body")?
            }
            ShapeOrigin::Mean => write!(
                f,
                ", mean body instead of betas of {} (set source_body to fit them)",
                self.whose()
            )?,
        }
        if self.betas_left_out > 0 {
            write!(f, ", the last {} of them left out", self.betas_left_out)?;
        }
        Ok(())
    }
}

impl PoseReport {
    fn whose(&self) -> String {
        self.gender.map_or_else(
            || self.shape_space.to_string(),
            |gender| format!("{} {gender}", self.shape_space),
        )
    }
}

/// `1 (120 frames), 2 (3 frames)`; the first twenty.
pub(super) fn people_text(people: &[(String, usize)]) -> String {
    let frames = |count: usize| {
        if count == 1 {
            "1 frame".to_owned()
        } else {
            format!("{count} frames")
        }
    };
    let mut texts: Vec<String> = people
        .iter()
        .take(20)
        .map(|(name, count)| format!("{name} ({})", frames(*count)))
        .collect();
    if people.len() > texts.len() {
        texts.push(format!("and {} more", people.len() - texts.len()));
    }
    texts.join(", ")
}
