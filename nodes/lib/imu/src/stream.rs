//! Live readings: frames go in, samples come out after a constant delay.

use std::collections::VecDeque;

use cromosim_spatial::{PoseSource, SpatialError, Stamp};

use crate::schemes::StencilScheme;
use crate::simulate::{at_frame, between_frames, stencil_variance};
use crate::stream_adaptive::AdaptiveLag;
use crate::stream_spline::{FixedLag, LAG_FRAMES};
use crate::{ImuError, ImuSample, KinematicSample, Scheme, SensorFrame};

/// How a [`StreamingImu`] runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamOptions {
    /// Nominal rate of the frames, Hz: it sets the delay.
    pub input_rate_hz: f64,
    /// Rate of the samples, Hz, on a grid that starts at the first frame.
    pub output_rate_hz: f64,
    /// A pause longer than this (s) between frames ends the series; another begins, and no sample
    /// is made up in between.
    pub longest_gap: f64,
    /// Where the poses come from: what noise the adaptive spline expects of them.
    pub source: PoseSource,
}

impl StreamOptions {
    /// Samples at `output_rate_hz` from frames at `input_rate_hz`; series end at pauses of 0.5 s, and
    /// poses are tracked.
    pub fn resampled(input_rate_hz: f64, output_rate_hz: f64) -> Self {
        Self {
            input_rate_hz,
            output_rate_hz,
            longest_gap: 0.5,
            source: PoseSource::Tracked,
        }
    }
}

/// A scheme over a sliding window. The same frames give the same samples; a sample comes out with
/// the first frame that is [`StreamingImu::delay_seconds`] later than it.
///
/// Delay, in frames at the nominal rate: 4 for Richardson and 3 for the other stencils (2 of them for
/// the cubic between estimates); 10 for the splines; `spline` is fitted
/// to the last 43 frames and smoothed as the last 128 frames ask for, `adaptive_spline` to the last
/// 56 and as these ask for. Away from the start, stencils
/// read exactly what [`crate::simulate`] reads; the splines come close.
#[derive(Clone, Debug)]
pub struct StreamingImu {
    scheme: Scheme,
    options: StreamOptions,
    delay: f64,
    /// The last frames.
    window: Vec<SensorFrame>,
    /// Samples that are due but not yet out.
    pending: VecDeque<Stamp>,
    /// First stamp and number of the next sample on the output grid.
    grid: Option<(Stamp, i64)>,
    fixed_lag: FixedLag,
    adaptive_lag: AdaptiveLag,
}

/// Frames that are kept: enough for every stencil, for the spline's window and its smoothing.
const KEPT_FRAMES: usize = 128;
/// A frame may come this part of an interval early and still release a sample.
const EARLY: f64 = 0.1;

impl StreamingImu {
    /// A stream before its first frame.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] for rates that are not positive.
    pub fn new(scheme: Scheme, options: StreamOptions) -> Result<Self, ImuError> {
        let rates = [options.input_rate_hz, options.output_rate_hz];
        if let Some(rate_hz) = rates
            .into_iter()
            .find(|rate| !(*rate > 0.0 && rate.is_finite()))
        {
            return Err(SpatialError::BadRate { rate_hz }.into());
        }
        // Two more than the stencil needs: the cubic between its estimates.
        let frames = scheme
            .stencil()
            .map_or(LAG_FRAMES, |stencil| stencil.reach() + 2);
        let delay = frames as f64 / options.input_rate_hz;
        let (window, pending) = (Vec::with_capacity(2 * KEPT_FRAMES), VecDeque::new());
        Ok(Self {
            scheme,
            options,
            delay,
            window,
            pending,
            grid: None,
            fixed_lag: FixedLag::default(),
            adaptive_lag: AdaptiveLag::default(),
        })
    }

    /// Time between a sample's stamp and the frame that releases it, s.
    pub fn delay_seconds(&self) -> f64 {
        self.delay
    }

    /// The scheme.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// Takes a frame; returns the samples that it releases, in order.
    ///
    /// # Errors
    /// [`ImuError::FrameNotIncreasing`] or [`ImuError::FrameNotFinite`]; the frame is then left
    /// out, and the stream goes on with the next.
    pub fn push(&mut self, frame: SensorFrame) -> Result<Vec<ImuSample>, ImuError> {
        Ok(self
            .push_kinematics(frame)?
            .iter()
            .map(KinematicSample::imu)
            .collect())
    }

    /// As [`StreamingImu::push`], in world axes and with the position.
    ///
    /// # Errors
    /// As [`StreamingImu::push`].
    pub fn push_kinematics(
        &mut self,
        frame: SensorFrame,
    ) -> Result<Vec<KinematicSample>, ImuError> {
        if !frame.is_finite() {
            return Err(ImuError::FrameNotFinite { stamp: frame.stamp });
        }
        let mut released = Vec::new();
        if let Some(last) = self.window.last() {
            if frame.stamp <= last.stamp {
                return Err(ImuError::FrameNotIncreasing {
                    previous: last.stamp,
                    next: frame.stamp,
                });
            }
            if frame.stamp - last.stamp > self.options.longest_gap {
                released = self.finish_kinematics()?;
            }
        }
        self.note_pending(frame.stamp);
        if self.window.len() >= 2 * KEPT_FRAMES {
            self.window.drain(..KEPT_FRAMES);
        }
        self.window.push(frame);
        if self.scheme == Scheme::Spline {
            self.fixed_lag
                .learn(&self.window[self.window.len().saturating_sub(KEPT_FRAMES)..]);
        }
        let limit = frame
            .stamp
            .plus_seconds(EARLY / self.options.input_rate_hz - self.delay);
        self.release(limit, &mut released)?;
        Ok(released)
    }

    /// Ends the series: the samples up to the last frame, as far as they are still to come. The
    /// output grid goes on where it was.
    ///
    /// # Errors
    /// As [`StreamingImu::push`].
    pub fn finish(&mut self) -> Result<Vec<ImuSample>, ImuError> {
        Ok(self
            .finish_kinematics()?
            .iter()
            .map(KinematicSample::imu)
            .collect())
    }

    /// As [`StreamingImu::finish`], in world axes and with the position.
    ///
    /// # Errors
    /// As [`StreamingImu::push`].
    pub fn finish_kinematics(&mut self) -> Result<Vec<KinematicSample>, ImuError> {
        let mut released = Vec::new();
        if let Some(last) = self.window.last().map(|frame| frame.stamp) {
            self.release(last, &mut released)?;
        }
        self.window.clear();
        self.pending.clear();
        self.fixed_lag.forget_frames();
        self.adaptive_lag.forget();
        Ok(released)
    }

    /// Forgets everything: for sources that jump back in time.
    pub fn reset(&mut self) {
        self.window.clear();
        self.pending.clear();
        self.grid = None;
        self.fixed_lag = FixedLag::default();
        self.adaptive_lag.forget();
    }

    /// Notes the samples that fall after the last frame and up to `now`; within a series, so not
    /// into a gap.
    fn note_pending(&mut self, now: Stamp) {
        let rate_hz = self.options.output_rate_hz;
        let (first, mut number) = self.grid.unwrap_or((now, 0));
        let stamp = |number: i64| first.plus_seconds(number as f64 / rate_hz);
        if self.window.is_empty() {
            // A series begins: what fell into the pause is left out.
            let reached = ((now - first) * rate_hz).floor() as i64 - 1;
            number = number.max(reached);
            while stamp(number) < now {
                number += 1;
            }
        }
        while stamp(number) <= now {
            self.pending.push_back(stamp(number));
            number += 1;
        }
        self.grid = Some((first, number));
    }

    /// Estimates the pending samples up to `limit`.
    fn release(
        &mut self,
        limit: Stamp,
        released: &mut Vec<KinematicSample>,
    ) -> Result<(), ImuError> {
        let count = self.pending.partition_point(|stamp| *stamp <= limit);
        if count == 0 || self.window.len() < 2 {
            return Ok(());
        }
        let due: Vec<Stamp> = self.pending.drain(..count).collect();
        let Some(stencil) = self.scheme.stencil() else {
            return match self.scheme {
                Scheme::AdaptiveSpline => {
                    let source = self.options.source;
                    self.adaptive_lag
                        .sample(&self.window, source, &due, released)
                }
                _ => self.fixed_lag.sample(&self.window, &due, released),
            };
        };
        for stamp in due {
            let variance = stencil_variance(stencil, &self.window, stamp);
            released.push(KinematicSample {
                variance,
                ..self.by_stencil(stencil, stamp)
            });
        }
        Ok(())
    }

    fn by_stencil(&self, stencil: StencilScheme, stamp: Stamp) -> KinematicSample {
        let after = self
            .window
            .partition_point(|frame| frame.stamp < stamp)
            .min(self.window.len() - 1);
        if self.window[after].stamp == stamp {
            return at_frame(stencil, &self.window, after);
        }
        let width = self.window.len().min(4);
        let start = after.saturating_sub(2).min(self.window.len() - width);
        let around: Vec<_> = (start..start + width)
            .map(|k| at_frame(stencil, &self.window, k))
            .collect();
        between_frames(&around, stamp)
    }
}

#[cfg(test)]
#[path = "stream_tests.rs"]
mod tests;
