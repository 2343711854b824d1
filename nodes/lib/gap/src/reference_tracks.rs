//! The reference's motion under sets of effects: what a set names is undone, the rest stays as it was
//! reported.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_imu::{EffectSet, ReadOff};
use cromosim_spatial::{KinematicTrack, MotionResponse, PoseEstimate, ZeroPhaseSmoothing};

use crate::fit::FitModel;

/// Tracks of one reference, made when they are asked for; positions in its units of length.
pub(crate) struct ReferenceTracks<'a> {
    model: &'a FitModel<'a>,
    tracks: RefCell<BTreeMap<Undone, Arc<KinematicTrack>>>,
}

/// What of the analysis' motion is undone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Undone {
    smoothing: bool,
    interpolation: bool,
}

impl<'a> ReferenceTracks<'a> {
    pub fn new(model: &'a FitModel<'a>) -> Self {
        Self {
            model,
            tracks: RefCell::default(),
        }
    }

    /// The motion that a simulation under a set starts from.
    pub fn track(&self, set: &EffectSet) -> Arc<KinematicTrack> {
        let make = || {
            let prepared = self.model.prepared;
            let track = if self.is_that_of_analysis(set) {
                Arc::clone(&self.model.track)
            } else {
                Arc::new(prepared.track(&self.estimate(set)))
            };
            self.in_reported_units(track)
        };
        let undone = self.undone(set);
        Arc::clone(self.tracks.borrow_mut().entry(undone).or_insert_with(make))
    }

    /// The same motion with a response.
    pub fn track_with(&self, set: &EffectSet, response: &MotionResponse) -> Arc<KinematicTrack> {
        let estimate = self.estimate(set).with_response(response);
        self.in_reported_units(Arc::new(self.model.prepared.track(&estimate)))
    }

    fn in_reported_units(&self, mut track: Arc<KinematicTrack>) -> Arc<KinematicTrack> {
        let units = self.model.prepared.report.length_units;
        if units != 1.0 {
            for acceleration in &mut Arc::make_mut(&mut track).acceleration_in_segment {
                *acceleration *= units;
            }
        }
        track
    }

    /// The estimate of that motion, in metres.
    pub fn estimate(&self, set: &EffectSet) -> Arc<PoseEstimate> {
        let (prepared, basis) = (self.model.prepared, &self.model.basis);
        if self.is_that_of_analysis(set) {
            return basis.estimate.clone();
        }
        let undone = self.undone(set);
        let reported = prepared.interpolated.as_ref();
        let estimate = reported
            .filter(|_| !undone.interpolation)
            .unwrap_or(&prepared.estimate);
        Arc::new(match basis.undone_smoothing.filter(|_| undone.smoothing) {
            Some(smoothing) => estimate.undoing(smoothing),
            None => estimate.clone(),
        })
    }

    /// The smoothing that a set undoes.
    pub fn undone_smoothing(&self, set: &EffectSet) -> Option<ZeroPhaseSmoothing> {
        let undone = self.model.basis.undone_smoothing;
        undone.filter(|_| set.get_read_off(ReadOff::ReferenceSpectrum).is_some())
    }

    fn undone(&self, set: &EffectSet) -> Undone {
        Undone {
            smoothing: self.undone_smoothing(set).is_some(),
            interpolation: self.model.prepared.interpolated.is_some()
                && set.get_read_off(ReadOff::ReferenceFrames).is_some(),
        }
    }

    /// Whether a set undoes all that the analysis undoes.
    fn is_that_of_analysis(&self, set: &EffectSet) -> bool {
        self.undone(set)
            == Undone {
                smoothing: self.model.basis.undone_smoothing.is_some(),
                interpolation: self.model.prepared.interpolated.is_some(),
            }
    }
}
