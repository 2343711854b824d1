//! Settings of a trajectory.

use crate::clip::CameraClip;
use crate::error::VideoError;
use crate::scale::ScaleSource;

/// Whether the root moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Trajectory {
    /// From depth maps: the paper's CROMOSim.
    #[default]
    Depth,
    /// The root stays where it is: the paper's CROMOSim Lite.
    None,
}

/// Settings of [`crate::global_trajectory`].
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryOptions {
    /// Whether the root moves.
    pub trajectory: Trajectory,
    /// Metres per unit of depth maps and cameras.
    pub scale: ScaleSource,
    /// Keypoints below it are not there, 0 to 1.
    pub least_confidence: f64,
    /// Standard deviation of a keypoint of confidence 1 in an image of 1080 rows, px; a factor on
    /// it is learnt.
    pub keypoint_std_px: f64,
    /// Standard deviation of a depth by itself from frame to frame: 0.02 is 2 %; a factor on it is
    /// learnt.
    pub depth_std: f64,
    /// Standard deviation of the slow error of a depth map's scale by itself, which no smoothing
    /// takes out: it is added to the covariance along the view.
    pub depth_scale_std: f64,
}

impl TrajectoryOptions {
    /// With this scale; keypoints from confidence 0.3 on, 5 px; depth 2 % from
    /// frame to frame, 5 % slowly.
    pub fn new(scale: ScaleSource) -> Self {
        Self {
            trajectory: Trajectory::Depth,
            scale,
            least_confidence: 0.3,
            keypoint_std_px: 5.0,
            depth_std: 0.02,
            depth_scale_std: 0.05,
        }
    }

    /// Numbers are in their ranges; `clip` names the errors.
    pub(crate) fn check(&self, clip: &CameraClip) -> Result<(), VideoError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        for (what, value) in [
            ("keypoint_std_px", self.keypoint_std_px),
            ("depth_std", self.depth_std),
        ] {
            if !positive(value) {
                return Err(clip.value(what.to_owned(), value, "a finite number above 0"));
            }
        }
        let size = match &self.scale {
            ScaleSource::Given(scale) => ("scale", *scale),
            ScaleSource::BodyHeight(height) => ("body height", *height),
        };
        if !positive(size.1) {
            return Err(clip.value(size.0.to_owned(), size.1, "a finite number above 0"));
        }
        for (what, value) in [
            ("least_confidence", self.least_confidence),
            ("depth_scale_std", self.depth_scale_std),
        ] {
            if !(0.0..1.0).contains(&value) {
                return Err(clip.value(what.to_owned(), value, "0 to below 1"));
            }
        }
        Ok(())
    }
}
