//! One recording of a placement, brought to where the search starts.

use std::sync::Arc;

use cromosim_imu::{Channel, EffectSet, PerChannel, ReadOff, Reading};
use cromosim_spatial::{FrameGrid, KinematicTrack};

use crate::axes::{axes_of_channel, channel_of_axis, value_on_axis};
use crate::coarse_alignment::CoarseAlignment;
use crate::digital::{Digital, Moments, mask_clipped, settle_limits};
use crate::error::GapError;
use crate::library::Library;
use crate::policy::clipping::STILL_PART;
use crate::prepared::{PreparedPlacement, ReferenceReport, estimated};
use crate::record::PlacementRecord;
use crate::sensor_noise::declared_in_si;
use crate::trace::trace;

/// What the analysis of one recording starts from.
#[derive(Clone, Debug)]
pub(crate) struct Session {
    pub prepared: PreparedPlacement,
    /// The readings in the device's units.
    pub raw: Vec<Reading>,
    /// Which axes of each message are compared, clipped ones included.
    pub covered: Vec<[bool; 6]>,
    /// Sets of effects that the closed forms found, the best first.
    pub starts: Vec<EffectSet>,
    pub digital: PerChannel<Digital>,
    /// Factors of the device's units.
    pub units: PerChannel<f64>,
    pub track: Arc<KinematicTrack>,
}

impl Session {
    /// With the closed forms' units of the device, or with given ones.
    pub fn new(
        record: &PlacementRecord,
        library: &Library,
        units: Option<PerChannel<f64>>,
    ) -> Result<Self, GapError> {
        let mut prepared = PreparedPlacement::new(record)?;
        let raw = prepared.measured.clone();
        let mut track = prepared.track(&prepared.estimate);
        let (alignment, report) = aligned(record, &prepared, &track, library)?;
        if report.length_units != 1.0 || report.frames.is_some() {
            prepared.restore_reference(&record.reference, report)?;
            track = prepared.track(&prepared.estimate);
        }
        let mut digital =
            PerChannel::from_fn(|channel| Digital::read_off(&prepared.measured, channel, library));
        prepared.cover(alignment.lag_s)?;
        if let Some(drift) = alignment.drift {
            let seconds = prepared.length as f64 / prepared.rate_hz;
            prepared.cover(alignment.lag_s + drift.per_second * seconds)?;
        }
        let covered = prepared.usable.clone();
        let units = units.unwrap_or_else(|| allowed_units(&alignment, library));
        let starts = alignment.starts();
        let starts: Vec<EffectSet> = starts.iter().map(|set| library.restrict(set)).collect();
        refuse_stuck_axes(&prepared, &track, &starts[0], &digital)?;
        settle_limits(&mut digital, &prepared, &track, &starts[0], units);
        for channel in Channel::ALL {
            mask_clipped(&mut prepared, channel, &digital[channel]);
        }
        bring_to_si(&mut prepared, &digital, units);
        trace(|| {
            eprintln!(
                "{}: {alignment:?} {digital:?} {:?} {:?}",
                prepared.name,
                prepared.estimate.noise(),
                prepared
                    .interpolated
                    .as_ref()
                    .map(|estimate| estimate.noise())
            )
        });
        Ok(Self {
            prepared,
            raw,
            covered,
            starts,
            digital,
            units,
            track: Arc::new(track),
        })
    }
}

/// Refuses axes that never change, but for those that round all of their motion away: the other axes lie on a lattice,
/// and move much more under `start`.
fn refuse_stuck_axes(
    prepared: &PreparedPlacement,
    track: &KinematicTrack,
    start: &EffectSet,
    digital: &PerChannel<Digital>,
) -> Result<(), GapError> {
    if !(0..6).any(|axis| prepared.is_constant(axis)) {
        return Ok(());
    }
    let simulated = prepared.predict(track, start).readings;
    let movement = |axis: usize| {
        let mut moments = Moments::default();
        let readings = simulated.iter().zip(&prepared.usable);
        let covered = readings.filter(|(_, usable)| usable[axis]);
        covered.for_each(|(reading, _)| moments.add(value_on_axis(reading, axis)));
        moments.variance()
    };
    let is_rounded_away = |axis: usize| {
        let channel = channel_of_axis(axis);
        let most = axes_of_channel(channel).map(movement).fold(0.0, f64::max);
        digital[channel].has_lattice() && movement(axis) < STILL_PART.powi(2) * most
    };
    prepared.refuse_stuck(|axis| prepared.is_constant(axis) && !is_rounded_away(axis))
}

/// Takes the factors of the device's units out of the readings and of what is declared for them.
fn bring_to_si(
    prepared: &mut PreparedPlacement,
    digital: &PerChannel<Digital>,
    units: PerChannel<f64>,
) {
    for reading in &mut prepared.measured {
        reading.specific_force /= units.accelerometer;
        reading.angular_velocity /= units.gyroscope;
    }
    prepared.steps = PerChannel::from_fn(|channel| digital[channel].step(units[channel]));
    prepared.declared = declared_in_si(prepared, units);
}

/// Factors of the units that the library may name; 1 where it may not.
fn allowed_units(alignment: &CoarseAlignment, library: &Library) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| {
        if library.allows_read_off(ReadOff::UnitFactor(channel)) {
            alignment.units[channel]
        } else {
            1.0
        }
    })
}

/// The closed forms, and how the reference reports its poses as far as the library may name it.
fn aligned(
    record: &PlacementRecord,
    prepared: &PreparedPlacement,
    track: &KinematicTrack,
    library: &Library,
) -> Result<(CoarseAlignment, ReferenceReport), GapError> {
    let frames = library
        .allows_read_off(ReadOff::ReferenceFrames)
        .then(|| FrameGrid::find(&record.reference))
        .flatten();
    // Chords between frames have accelerations at their ends alone: units are told by the frames'.
    let of_frames = match &frames {
        Some(frames) => {
            let estimate = estimated(&prepared.name, &frames.frames(&record.reference))?;
            Some(prepared.track(&estimate))
        }
        None => None,
    };
    let alignment = CoarseAlignment::find(prepared, of_frames.as_ref().unwrap_or(track));
    let length_units = if library.allows_read_off(ReadOff::ReferenceLength) {
        alignment.length_units
    } else {
        1.0
    };
    let report = ReferenceReport {
        length_units,
        frames,
    };
    Ok((alignment, report))
}
