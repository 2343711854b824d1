//! How far a diagnosis has come.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

// The shares of the steps in what comes above them, as timed on two trials of BROAD (188 and 197 s at
// 286 Hz), each alone and both together; which steps take how long differs twofold between trials.

/// The preparation of the recordings.
pub(crate) const PREPARATION: Range<f64> = 0.0..0.05;
/// What is found in them, after which the answer is put together.
pub(crate) const ANALYSIS: Range<f64> = 0.05..0.92;
/// Of the analysis: the search for effects.
pub(crate) const SEARCH: Range<f64> = 0.0..0.68;
/// Of the search where there are several recordings: each for itself.
pub(crate) const ALONE: Range<f64> = 0.0..0.25;
/// And all together.
pub(crate) const TOGETHER: Range<f64> = 0.25..1.0;
/// Of the search of one recording: at a lower rate, where it has a high one.
pub(crate) const THINNED: Range<f64> = 0.0..0.9;
/// Of the search at one rate: the rounds after the first; then members are exchanged.
pub(crate) const ROUNDS: Range<f64> = 0.1..0.65;
/// Of the analysis: what the rest holds; then calibrations are kept.
pub(crate) const JUDGEMENT: Range<f64> = 0.68..0.98;

/// Who is told how far a diagnosis has come: the share of its work that is done, which only grows
/// and is 1 in the end. Nobody by default.
#[derive(Clone, Default)]
pub struct Progress(Option<Watched>);

#[derive(Clone)]
struct Watched {
    tell: Arc<dyn Fn(f64) + Send + Sync>,
    /// Which part of the whole this is.
    part: Range<f64>,
}

impl Progress {
    /// Calls `tell` with the share of the work that is done.
    pub fn new(tell: impl Fn(f64) + Send + Sync + 'static) -> Self {
        Self(Some(Watched {
            tell: Arc::new(tell),
            part: 0.0..1.0,
        }))
    }

    /// The progress of a part of the work, which is told as a part of the whole.
    pub(crate) fn part(&self, shares: &Range<f64>) -> Self {
        Self(self.0.as_ref().map(|watched| Watched {
            tell: watched.tell.clone(),
            part: watched.of_whole(shares.start)..watched.of_whole(shares.end),
        }))
    }

    /// The progress of one of several equal parts.
    pub(crate) fn one_of(&self, index: usize, count: usize) -> Self {
        let share = |index: usize| index as f64 / count as f64;
        self.part(&(share(index)..share(index + 1)))
    }

    /// Tells that this share of the work is done.
    pub(crate) fn reached(&self, share: f64) {
        if let Some(watched) = &self.0 {
            (watched.tell)(watched.of_whole(share));
        }
    }
}

impl Watched {
    fn of_whole(&self, share: f64) -> f64 {
        self.part.start + share * (self.part.end - self.part.start)
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.0.is_some() {
            "Progress(told)"
        } else {
            "Progress"
        })
    }
}
