//! The walk over the stages of the measurement model, which simulation, diagnosis and training
//! share.

use std::mem::take;
use std::ops::RangeInclusive;
use std::sync::Arc;

use cromosim_spatial::{KinematicTrack, Stamp};

use super::{EffectKind, GridTrace, Reading, SensorModel, Stage};
use crate::Channel;

impl Stage {
    /// The stages that a recording passes, in their order: the one place that states it. What acts
    /// in the reference is undone before, where the reference's motion is estimated.
    pub const ORDER: [Self; 6] = [
        Self::Segment,
        Self::Tissue,
        Self::Sensor,
        Self::Timing,
        Self::Linear,
        Self::Digital,
    ];
}

/// What a recording's measurement starts from.
#[derive(Clone, Copy, Debug)]
pub enum MeasurementInput<'a> {
    /// The motion of the reference frame; all stages follow.
    Motion(&'a KinematicTrack),
    /// What an error-free sensor reads, in sensor axes on a grid; the stages from
    /// [`Stage::Timing`] on follow.
    IdealReadings(&'a GridTrace),
}

impl SensorModel {
    /// What the device reads at the stamps of its own clock. `add_noise` is given the readings before
    /// the digital stage clips and rounds them, see [`crate::NoiseSource::add_to`].
    pub fn measure(
        &self,
        input: MeasurementInput<'_>,
        stamps: &[Stamp],
        add_noise: impl FnOnce(&mut [Reading]),
    ) -> Vec<Reading> {
        let mut work = Work::new(stamps);
        let first = match input {
            MeasurementInput::Motion(track) => {
                work.motion = Some(track);
                Stage::Segment
            }
            MeasurementInput::IdealReadings(trace) => {
                work.trace = Trace::Borrowed(trace);
                Stage::Timing
            }
        };
        self.pass(&mut work, first..=Stage::Linear, |_, _| ());
        add_noise(&mut work.readings);
        self.pass(&mut work, Stage::Digital..=Stage::Digital, |_, _| ());
        work.readings
    }

    /// All stages without noise.
    pub fn run(&self, track: &KinematicTrack, stamps: &[Stamp]) -> Vec<Reading> {
        self.measure(MeasurementInput::Motion(track), stamps, |_| ())
    }

    /// Passes stages in their order and shows `keep` the result of each.
    fn pass(
        &self,
        work: &mut Work<'_>,
        stages: RangeInclusive<Stage>,
        mut keep: impl FnMut(Stage, &Work<'_>),
    ) {
        for stage in Stage::ORDER {
            if stages.contains(&stage) {
                self.pass_one(stage, work);
                keep(stage, work);
            }
        }
    }

    fn pass_one(&self, stage: Stage, work: &mut Work<'_>) {
        match stage {
            Stage::Reference => {}
            Stage::Segment => {
                work.trace = Trace::from(work.motion.map(|m| self.segment(m)).unwrap_or_default());
            }
            Stage::Tissue => {
                if let (Some(motion), Some(_)) = (work.motion, &self.tissue) {
                    let trace = take(&mut work.trace).into_owned();
                    work.trace = Trace::from(self.tissue(trace, motion));
                }
            }
            Stage::Sensor => {
                if self.acts_on_sensor_axes() {
                    let trace = take(&mut work.trace).into_owned();
                    work.trace = Trace::from(self.sensor(trace));
                }
            }
            Stage::Timing => {
                let (trace, stamps) = (work.trace.get(), work.stamps);
                work.readings = match work.only {
                    Some((channel, before)) => {
                        self.sample_one(channel, trace, stamps, &before.sampled)
                    }
                    None => self.sample(trace, stamps),
                };
            }
            Stage::Linear => match work.only {
                Some((channel, before)) => {
                    self.linear_one(channel, &mut work.readings, work.stamps);
                    take_channel(other(channel), &before.readings, &mut work.readings);
                }
                None => self.linear(&mut work.readings, work.stamps),
            },
            Stage::Digital => self.digital(&mut work.readings),
        }
    }

    /// The channel that an effect changes, where it is one.
    fn only_channel_of(&self, kind: EffectKind) -> Option<Channel> {
        let spec = kind.spec();
        match spec.channels {
            // The gyroscope feels what the sensor does.
            [Channel::Accelerometer] if self.coupling.is_some() && spec.stage < Stage::Linear => {
                None
            }
            [channel] => Some(*channel),
            _ => None,
        }
    }

    /// Whether [`SensorModel::sensor`] changes anything.
    fn acts_on_sensor_axes(&self) -> bool {
        let turns = self.sensor_from_segment.is_some() || self.coupling.is_some();
        let filters = &self.low_pass;
        (self.slip.is_none() && turns)
            || filters.accelerometer.is_some()
            || filters.gyroscope.is_some()
    }
}

/// A recording on its way through the stages: first readings on a grid, then at the stamps.
struct Work<'a> {
    motion: Option<&'a KinematicTrack>,
    stamps: &'a [Stamp],
    trace: Trace<'a>,
    readings: Vec<Reading>,
    /// The one channel that differs from readings before.
    only: Option<(Channel, &'a StagedReadings)>,
}

/// Readings on a grid; what passes a stage that changes nothing is not copied.
enum Trace<'a> {
    Borrowed(&'a GridTrace),
    Shared(Arc<GridTrace>),
}

impl Trace<'_> {
    fn get(&self) -> &GridTrace {
        match self {
            Self::Borrowed(trace) => trace,
            Self::Shared(trace) => trace,
        }
    }

    fn into_owned(self) -> GridTrace {
        match self {
            Self::Borrowed(trace) => trace.clone(),
            Self::Shared(trace) => Arc::unwrap_or_clone(trace),
        }
    }

    fn shared(&self) -> Arc<GridTrace> {
        match self {
            Self::Borrowed(trace) => Arc::new(GridTrace::clone(trace)),
            Self::Shared(trace) => Arc::clone(trace),
        }
    }
}

impl Default for Trace<'_> {
    fn default() -> Self {
        Self::Shared(Arc::default())
    }
}

impl From<GridTrace> for Trace<'_> {
    fn from(trace: GridTrace) -> Self {
        Self::Shared(Arc::new(trace))
    }
}

/// The readings of a motion after each stage but the digital one, so that a change of one effect
/// repeats only the stages from its own on. Stages that change nothing share what they leave.
#[derive(Clone, Debug, Default)]
pub struct StagedReadings {
    segment: Arc<GridTrace>,
    tissue: Arc<GridTrace>,
    sensor: Arc<GridTrace>,
    sampled: Vec<Reading>,
    /// The readings before noise and the digital stage.
    pub readings: Vec<Reading>,
}

impl StagedReadings {
    /// Runs the stages from [`Stage::Segment`] to [`Stage::Linear`] and keeps the result of each.
    pub fn new(model: &SensorModel, motion: &KinematicTrack, stamps: &[Stamp]) -> Self {
        let mut work = Work::new(stamps);
        work.motion = Some(motion);
        let mut kept = Self::default();
        let keep = |stage: Stage, work: &Work<'_>| match stage {
            Stage::Segment => kept.segment = work.trace.shared(),
            Stage::Tissue => kept.tissue = work.trace.shared(),
            Stage::Timing => kept.sampled = work.readings.clone(),
            _ => {}
        };
        model.pass(&mut work, Stage::Segment..=Stage::Linear, keep);
        Self {
            sensor: work.trace.shared(),
            readings: work.readings,
            ..kept
        }
    }

    /// The readings before noise and the digital stage of `model`, whose effects differ from the
    /// ones of these readings in the values of one alone.
    pub fn with_other(
        &self,
        kind: EffectKind,
        model: &SensorModel,
        motion: &KinematicTrack,
        stamps: &[Stamp],
    ) -> Vec<Reading> {
        let first = kind.spec().stage.clamp(Stage::Segment, Stage::Linear);
        let mut work = Work::new(stamps);
        work.motion = Some(motion);
        work.only = model.only_channel_of(kind).map(|channel| (channel, self));
        match first {
            Stage::Tissue => work.trace = Trace::Shared(Arc::clone(&self.segment)),
            Stage::Sensor => work.trace = Trace::Shared(Arc::clone(&self.tissue)),
            Stage::Timing => work.trace = Trace::Shared(Arc::clone(&self.sensor)),
            Stage::Linear => work.readings = self.sampled.clone(),
            _ => {}
        }
        model.pass(&mut work, first..=Stage::Linear, |_, _| ());
        work.readings
    }

    /// [`StagedReadings::with_other`] where the mount slips at another time: of `other` rather than of
    /// `own`, the model of these readings. What that does not touch is not repeated. The stamps are in
    /// their order.
    pub fn with_other_slip(
        &self,
        own: &SensorModel,
        other: &SensorModel,
        stamps: &[Stamp],
    ) -> Vec<Reading> {
        let mut readings = self.readings.clone();
        let touched = other.between_slips(own, stamps);
        let stamps = &stamps[touched.clone()];
        let mut repeated = other.sample(&self.sensor, stamps);
        other.linear(&mut repeated, stamps);
        readings[touched].copy_from_slice(&repeated);
        readings
    }
}

impl<'a> Work<'a> {
    fn new(stamps: &'a [Stamp]) -> Self {
        Self {
            motion: None,
            stamps,
            trace: Trace::default(),
            readings: Vec::new(),
            only: None,
        }
    }
}

fn other(channel: Channel) -> Channel {
    match channel {
        Channel::Accelerometer => Channel::Gyroscope,
        Channel::Gyroscope => Channel::Accelerometer,
    }
}

fn take_channel(channel: Channel, from: &[Reading], to: &mut [Reading]) {
    for (from, to) in from.iter().zip(to) {
        to[channel] = from[channel];
    }
}

#[cfg(test)]
#[path = "stages_tests.rs"]
mod tests;
