//! The frames around one frame, and their differences.

use std::ops::Range;

use cromosim_spatial::derivative_weights;
use nalgebra::Vector3;

use crate::SensorFrame;

/// The frames that an estimate at frame `k` of `count` takes.
pub(crate) fn stencil_range(count: usize, k: usize, reach: usize) -> Range<usize> {
    // A one-sided second derivative needs one frame more to have the same order of error.
    let inside = k >= reach && k + reach < count;
    let width = (2 * reach + if inside { 1 } else { 2 }).min(count);
    let start = k.saturating_sub(reach).min(count - width);
    start..start + width
}

/// The frames around one frame, with the weights of their differences.
pub(super) struct Stencil<'a> {
    pub(super) frames: &'a [SensorFrame],
    /// The frame itself.
    pub(super) centre: &'a SensorFrame,
    /// By order of the derivative and by frame, 1/s^order.
    pub(super) weights: [[f64; cromosim_spatial::MAX_STENCIL]; 3],
}

impl<'a> Stencil<'a> {
    /// Around frame `k`, `reach` frames to either side.
    pub(super) fn new(frames: &'a [SensorFrame], k: usize, reach: usize) -> Self {
        let range = stencil_range(frames.len(), k, reach);
        let (centre, width) = (&frames[k], range.len());
        let frames = &frames[range];
        let mut seconds = [0.0; cromosim_spatial::MAX_STENCIL];
        for (seconds, frame) in seconds.iter_mut().zip(frames) {
            *seconds = frame.stamp - centre.stamp;
        }
        Self {
            frames,
            centre,
            weights: derivative_weights(&seconds[..width], 0.0),
        }
    }

    /// `sum_j w_j x_j` with the weights of a derivative of the given order.
    pub(super) fn sum(
        &self,
        order: usize,
        of: impl Fn(&SensorFrame) -> Vector3<f64>,
    ) -> Vector3<f64> {
        self.frames
            .iter()
            .zip(self.weights[order])
            .map(|(frame, weight)| of(frame) * weight)
            .sum()
    }

    /// Second derivative of the position. Differences from the centre, so that rounding does not
    /// grow with the distance from the origin.
    pub(super) fn acceleration(&self) -> Vector3<f64> {
        let centre = self.centre.world_from_sensor.translation.vector;
        self.sum(2, |frame| {
            frame.world_from_sensor.translation.vector - centre
        })
    }
}
