//! How a trajectory came about: for `inspect` and the summary line.

use std::fmt;

use crate::filter::FilterNoise;
use crate::scale::ScaleEstimate;

/// What the trajectory rests on and how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryReport {
    /// All frames.
    pub frames: usize,
    /// Frames whose measurement made the track.
    pub used: usize,
    /// Frames without a measurement: no keypoints, no depth, no camera, or too little confidence.
    pub left_out: Vec<usize>,
    /// Frames whose measurement was an outlier.
    pub gated: Vec<usize>,
    /// The longest time without a measurement, s.
    pub longest_gap_s: f64,
    /// Frames without a pose, which was interpolated between its neighbours.
    pub poses_bridged: usize,
    /// Frames without a camera, which was interpolated between its neighbours.
    pub cameras_bridged: usize,
    /// Metres per unit; `None` without a trajectory.
    pub scale: Option<ScaleEstimate>,
    /// The filter's noise as learnt; `None` without a trajectory.
    pub noise: Option<FilterNoise>,
    /// Standard deviation per axis of the positions, median of the frames, m: with the part that
    /// does not average out (scale errors of the depth maps). 0 without a trajectory.
    pub position_std_m: f64,
    /// Of the velocities, m/s. 0 without a trajectory.
    pub velocity_std: f64,
    /// Up, in the reconstruction's world.
    pub up_in_source: [f64; 3],
    /// Root mean square of the heights of the lowest foot points above the floor, m.
    pub floor_rms_m: f64,
    /// Shape coefficients, averaged over the clip.
    pub betas: Vec<f64>,
}

impl fmt::Display for TrajectoryReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(scale), Some(noise)) = (self.scale, self.noise) else {
            return write!(
                formatter,
                "{} frames in place, {} poses bridged",
                self.frames, self.poses_bridged
            );
        };
        write!(
            formatter,
            "{} of {} frames used ({} left out, {} outliers, longest gap {:.2} s), {:.4} m per unit ({:.1} %), jerk {:.0} m2/s5 level and {:.0} up, bounce {:.1} cm at {:.2} Hz, pixel errors x {:.2}, depth errors x {:.2}, position within {:.3} m, velocity within {:.3} m/s, feet within {:.3} m of the floor",
            self.used,
            self.frames,
            self.left_out.len(),
            self.gated.len(),
            self.longest_gap_s,
            scale.metres_per_unit,
            100.0 * scale.relative_std,
            noise.horizontal_jerk,
            noise.vertical_jerk,
            100.0 * noise.bounce_std,
            noise.bounce_hz,
            noise.pixel_factor,
            noise.depth_factor,
            self.position_std_m,
            self.velocity_std,
            self.floor_rms_m,
        )
    }
}
