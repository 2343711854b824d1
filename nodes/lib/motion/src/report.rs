//! How a source was read: for `inspect` and the summary line.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What retargeting took, left out and achieved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RetargetReport {
    /// The skeleton map.
    pub map: String,
    /// The source's up axis: `+y`.
    pub up_axis: String,
    /// Metres per unit of the source.
    pub unit_scale_m: f64,
    /// The source's height in metres at that scale, estimated from its bones.
    pub source_height_m: f64,
    /// Where the rest pose was taken from: `zero pose`, `frame 0`, `map`.
    pub rest: String,
    /// Factor on root translation beside the unit: the body's leg length by the source's.
    pub leg_ratio: f64,
    /// Leading frames (T-pose and blend) that were left out.
    pub frames_left_out: usize,
    /// Angle between corresponding bones over all frames and bones, median, degrees. The bones are
    /// upper arms, forearms, hands, thighs, shins, feet and neck, and the lines through the hips,
    /// the shoulders and along the trunk; spine and collar joints sit at different places in
    /// different skeletons, so the lines between them are not compared.
    pub bone_direction_median_deg: f64,
    /// The largest angle of any bone in any frame, degrees.
    pub bone_direction_max_deg: f64,
    /// Median angle of each bone, degrees, worst first.
    pub bones: Vec<(String, f64)>,
    /// Shape coefficients fitted to the bone lengths.
    pub betas: Vec<f64>,
    /// Root mean square of the bone lengths' remaining differences, m.
    pub bone_length_rms_m: f64,
    /// How far the source was raised to stand on the floor, m.
    pub floor_shift_m: f64,
}

impl fmt::Display for RetargetReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "skeleton {}, up {}, {:.5} m per unit ({:.2} m tall), rest pose from {}, {} leading frames left out, bone directions within {:.2} deg (median; max {:.1})",
            self.map,
            self.up_axis,
            self.unit_scale_m,
            self.source_height_m,
            self.rest,
            self.frames_left_out,
            self.bone_direction_median_deg,
            self.bone_direction_max_deg
        )
    }
}
