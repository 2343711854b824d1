//! The adaptive spline, live: a window with a fixed lag over which what was learnt moves on.

use cromosim_spatial::{PoseAdaptation, PoseSource, PoseSpline, PoseTimes, Stamp};

use crate::schemes::spline::{SplineVariance, sample};
use crate::stream_spline::last_frames;
use crate::{ImuError, KinematicSample, SensorFrame};

/// Frames before the sample that the window reaches back: three times what neighbours share at 100
/// Hz.
const PAST_FRAMES: usize = 45;

/// What was learnt of the frames in the last window.
#[derive(Clone, Debug, Default)]
pub(crate) struct AdaptiveLag {
    stamps: Vec<Stamp>,
    times: Option<PoseTimes>,
    learnt: PoseAdaptation,
}

impl AdaptiveLag {
    /// Samples at stamps within `kept`, by a spline over its last frames, whose poses come from there.
    pub(crate) fn sample(
        &mut self,
        kept: &[SensorFrame],
        source: PoseSource,
        due: &[Stamp],
        samples: &mut Vec<KinematicSample>,
    ) -> Result<(), ImuError> {
        let (frames, stamps, poses) = last_frames(kept, due, PAST_FRAMES);
        let start = stamps.first().copied().unwrap_or_default();
        let dropped = self.stamps.partition_point(|stamp| *stamp < start);
        let moved = self
            .times
            .as_ref()
            .and_then(|times| times.moved_to(&stamps));
        let times = match moved {
            Some(times) => times,
            None => PoseTimes::new(&stamps)?,
        };
        let learnt = (&mut self.learnt, dropped);
        let spline = PoseSpline::fit_following(&times, &poses, source, learnt)?;
        self.stamps = stamps;
        self.times = Some(times.clone());
        let errors = SplineVariance::new(&times, &spline, frames)?;
        samples.extend(due.iter().map(|&stamp| {
            let known = errors.as_ref().map(|errors| errors.at(stamp));
            sample(&spline, source, (stamp, &times.locate(stamp)), known)
        }));
        Ok(())
    }

    /// Begins anew: a series has ended.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }
}
