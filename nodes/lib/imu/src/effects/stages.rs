//! The walk over the stages of the measurement model, which simulation, diagnosis and training
//! share.

use std::borrow::Cow;
use std::mem::take;
use std::ops::RangeInclusive;

use cromosim_spatial::{KinematicTrack, Stamp};

use super::{GridTrace, Reading, SensorModel, Stage};

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
                work.trace = Cow::Borrowed(trace);
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
                work.trace = Cow::Owned(work.motion.map(|m| self.segment(m)).unwrap_or_default());
            }
            Stage::Tissue => {
                if let Some(motion) = work.motion {
                    let trace = take(&mut work.trace).into_owned();
                    work.trace = Cow::Owned(self.tissue(trace, motion));
                }
            }
            Stage::Sensor => {
                work.trace = Cow::Owned(self.sensor(take(&mut work.trace).into_owned()))
            }
            Stage::Timing => work.readings = self.sample(&work.trace, work.stamps),
            Stage::Linear => self.linear(&mut work.readings, work.stamps),
            Stage::Digital => self.digital(&mut work.readings),
        }
    }
}

/// A recording on its way through the stages: first readings on a grid, then at the stamps.
struct Work<'a> {
    motion: Option<&'a KinematicTrack>,
    stamps: &'a [Stamp],
    trace: Cow<'a, GridTrace>,
    readings: Vec<Reading>,
}

/// The readings of a motion after each stage but the digital one, so that a change of one effect
/// repeats only the stages from its own on.
#[derive(Clone, Debug, Default)]
pub struct StagedReadings {
    segment: GridTrace,
    tissue: GridTrace,
    sensor: GridTrace,
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
            Stage::Segment => kept.segment = work.trace.clone().into_owned(),
            Stage::Tissue => kept.tissue = work.trace.clone().into_owned(),
            Stage::Timing => kept.sampled = work.readings.clone(),
            _ => {}
        };
        model.pass(&mut work, Stage::Segment..=Stage::Linear, keep);
        Self {
            sensor: work.trace.into_owned(),
            readings: work.readings,
            ..kept
        }
    }

    /// The readings before noise and the digital stage of `model`, whose effects differ from the
    /// ones of these readings in `stage` and later stages alone.
    pub fn repeated_from(
        &self,
        stage: Stage,
        model: &SensorModel,
        motion: &KinematicTrack,
        stamps: &[Stamp],
    ) -> Vec<Reading> {
        let first = stage.clamp(Stage::Segment, Stage::Linear);
        let mut work = Work::new(stamps);
        work.motion = Some(motion);
        match first {
            Stage::Tissue => work.trace = Cow::Borrowed(&self.segment),
            Stage::Sensor => work.trace = Cow::Borrowed(&self.tissue),
            Stage::Timing => work.trace = Cow::Borrowed(&self.sensor),
            Stage::Linear => work.readings = self.sampled.clone(),
            _ => {}
        }
        model.pass(&mut work, first..=Stage::Linear, |_, _| ());
        work.readings
    }
}

impl<'a> Work<'a> {
    fn new(stamps: &'a [Stamp]) -> Self {
        Self {
            motion: None,
            stamps,
            trace: Cow::default(),
            readings: Vec::new(),
        }
    }
}
