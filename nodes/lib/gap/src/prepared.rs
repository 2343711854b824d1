//! One placement, made ready to be compared: sample grid, masks, units.

use cromosim_imu::{
    AXES, Channel, EffectKind, EffectSet, PerChannel, Reading, ResidualView, SensorModel,
    StagedReadings,
};
use cromosim_spatial::{
    FrameGrid, KinematicTrack, PoseEstimate, PoseNoise, Spectrum, Stamp, welch,
};

use crate::axes::{axes_of_channel, channel_of_axis, value_on_axis};
use crate::error::GapError;
use crate::period::median_period;
use crate::record::{PlacementRecord, PoseSeries};

/// Common time of IMU and reference below which nothing is said, s.
const LEAST_OVERLAP_S: f64 = 4.0;
/// Finite readings below which nothing is said.
const LEAST_MESSAGES: usize = 50;
/// Most entries of a sample grid: stamps that span more are taken for broken (55 hours at 100 Hz).
const MOST_ENTRIES: usize = 20_000_000;
/// Most entries for each message beyond the first [`FREE_ENTRIES`]: memory grows with what was
/// measured, whatever its stamps are.
const MOST_ENTRIES_A_MESSAGE: usize = 64;
/// Half an hour at 100 Hz.
const FREE_ENTRIES: usize = 200_000;
/// What is left out at the reference's ends, s.
const END_S: f64 = 1.0;
/// What is left out on either side of a gap in the reference, s.
const GAP_S: f64 = 0.35;
/// The same at most, as a multiple of the gap, where less than this part of the messages would be left: what is filled in
/// for one pose or two errs beside it for as long as they last. No source for the numbers.
const SHORT_GAP_MARGIN: f64 = 3.0;
const LEAST_LEFT: f64 = 0.5;
/// Poses no farther apart than this are no gap, s: two in each period of motion at 20 Hz, below which that of
/// people and of things in their hands is, hold all of it, and what is filled in between errs no more than
/// poses do. Cameras that lose a marker for one frame in a hundred at 300 Hz would otherwise leave nothing.
const SHORT_GAP_S: f64 = 0.025;
/// And beyond it, as a part of the gap (of its first two seconds): a long gap is filled worse, and
/// its errors reach further.
const GAP_PART: f64 = 0.3;
/// Length of the blocks of time that are held out together, s.
const BLOCK_S: f64 = 4.0;
/// Number of parts that are held out in turn.
pub(crate) const FOLDS: usize = 5;
/// Length of the windows of residual spectra, s.
const WINDOW_S: f64 = 4.0;

/// One placement with everything that does not change while effects are tried.
#[derive(Clone, Debug)]
pub(crate) struct PreparedPlacement {
    pub name: String,
    /// t0: stamp of the first IMU message.
    pub epoch: Stamp,
    pub stamps: Vec<Stamp>,
    /// Readings in SI, units factors taken out.
    pub measured: Vec<Reading>,
    pub rate_hz: f64,
    /// Entry of each message on the uniform sample grid of the IMU's clock.
    pub grid_index: Vec<usize>,
    /// Entries of the sample grid.
    pub length: usize,
    /// Of each message and axis: whether it is compared.
    pub usable: Vec<[bool; 6]>,
    /// White noise per sample that the device declares.
    pub declared: PerChannel<Option<f64>>,
    /// Step that readings are rounded to, in their units; 0 without.
    pub steps: PerChannel<f64>,
    /// Of the reference's motion, in metres, from its own frames.
    pub estimate: PoseEstimate,
    /// The same from poses that were interpolated between these frames; none where they were not.
    pub interpolated: Option<PoseEstimate>,
    /// White noise that these have beyond that of the frames; none where it does not show.
    pub noise_behind_frames: Option<PoseNoise>,
    pub report: ReferenceReport,
    pub missing: MissingMessages,
}

/// How a reference reports its poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceReport {
    /// Units per metre of positions.
    pub length_units: f64,
    /// The frames between which poses were interpolated; none where they were not.
    pub frames: Option<FrameGrid>,
}

impl Default for ReferenceReport {
    fn default() -> Self {
        Self {
            length_units: 1.0,
            frames: None,
        }
    }
}

/// Entries of the sample grid without a message.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MissingMessages {
    /// Of all entries.
    pub fraction: f64,
    /// Mean length of a gap, messages; 0 without any.
    pub mean_burst: f64,
}

/// A prediction with its stages kept, so that a change of one effect repeats only what comes after
/// it.
pub(crate) type Prediction = StagedReadings;

/// The uniform grid under the stamps of an IMU.
struct SampleGrid {
    index: Vec<usize>,
    length: usize,
    /// Median interval, s.
    period_s: f64,
}

impl SampleGrid {
    /// Follows the stamps, which increase, step by step: a drifting or jittering clock does not run
    /// off it. None for fewer than two stamps.
    fn under(stamps: &[Stamp]) -> Option<Self> {
        let period_s = median_period(stamps.iter().copied())?;
        let mut index = vec![0];
        for pair in stamps.windows(2) {
            let step = ((pair[1] - pair[0]) / period_s).round().max(1.0) as usize;
            index.push(index[index.len() - 1] + step);
        }
        let length = index[index.len() - 1] + 1;
        Some(Self {
            index,
            length,
            period_s,
        })
    }

    fn missing(&self) -> MissingMessages {
        let gaps = self
            .index
            .windows(2)
            .filter(|pair| pair[1] > pair[0] + 1)
            .count();
        let missing = self.length - self.index.len();
        MissingMessages {
            fraction: missing as f64 / self.length as f64,
            mean_burst: if gaps > 0 {
                missing as f64 / gaps as f64
            } else {
                0.0
            },
        }
    }
}

impl PreparedPlacement {
    /// Sorts the readings, lays the sample grid, and fits the reference's trajectory.
    pub fn new(record: &PlacementRecord) -> Result<Self, GapError> {
        let name = record.name.clone();
        let (stamps, measured) = in_order(record)?;
        let estimate = estimated(&name, &record.reference)?;
        let grid = SampleGrid::under(&stamps).ok_or_else(|| GapError::TooFewMessages {
            placement: name.clone(),
            messages: stamps.len(),
            needed: LEAST_MESSAGES,
        })?;
        let most = FREE_ENTRIES + MOST_ENTRIES_A_MESSAGE * stamps.len();
        if grid.length > most.min(MOST_ENTRIES) {
            return Err(GapError::NoOverlap {
                placement: name,
                overlap_s: 0.0,
                imu_s: grid.length as f64 * grid.period_s,
                needed_s: LEAST_OVERLAP_S,
            });
        }
        let prepared = Self {
            name,
            epoch: stamps[0],
            rate_hz: (grid.length - 1) as f64 / (stamps[stamps.len() - 1] - stamps[0]),
            usable: vec![[true; 6]; stamps.len()],
            missing: grid.missing(),
            length: grid.length,
            grid_index: grid.index,
            stamps,
            measured,
            declared: record.imu.declared,
            steps: PerChannel::default(),
            estimate,
            interpolated: None,
            noise_behind_frames: None,
            report: ReferenceReport::default(),
        };
        let is_dead = |channel| axes_of_channel(channel).all(|axis| prepared.is_constant(axis));
        prepared.refuse_stuck(|axis| is_dead(channel_of_axis(axis)))?;
        Ok(prepared)
    }

    /// Takes the way in which the reference was reported back: its units of length, and the
    /// interpolation between its frames.
    pub fn restore_reference(
        &mut self,
        reference: &PoseSeries,
        report: ReferenceReport,
    ) -> Result<(), GapError> {
        let mut poses = reference.clone();
        if report.length_units != 1.0 {
            for position in &mut poses.positions {
                *position /= report.length_units;
            }
            self.estimate = estimated(&self.name, &poses)?;
        }
        if let Some(frames) = report.frames {
            self.noise_behind_frames = frames.noise_within(&poses);
            let restored = estimated(&self.name, &frames.frames(&poses))?;
            self.interpolated = Some(std::mem::replace(&mut self.estimate, restored));
        }
        self.report = report;
        Ok(())
    }

    /// Leaves out what the reference does not cover when the IMU's stamps are late by `lag_s`, and
    /// what is next to its gaps: less of it beside short ones where too little would be left.
    pub fn cover(&mut self, lag_s: f64) -> Result<(), GapError> {
        let beside_all = |_: f64| GAP_S;
        let beside_short = |gap_s: f64| GAP_S.min(SHORT_GAP_MARGIN * gap_s);
        let all = self.stamps.len();
        let mut inside = self.inside(lag_s, beside_all);
        let count = |inside: &[bool]| inside.iter().filter(|inside| **inside).count();
        if (count(&inside) as f64) < LEAST_LEFT * all as f64 {
            inside = self.inside(lag_s, beside_short);
        }
        let covered = count(&inside);
        for (usable, inside) in self.usable.iter_mut().zip(inside) {
            if !inside {
                *usable = [false; 6];
            }
        }
        let overlap_s = covered as f64 / self.rate_hz;
        if overlap_s < LEAST_OVERLAP_S {
            let imu_s = self.length as f64 / self.rate_hz;
            return Err(GapError::NoOverlap {
                placement: self.name.clone(),
                overlap_s,
                imu_s,
                needed_s: LEAST_OVERLAP_S,
            });
        }
        Ok(())
    }

    /// Which messages the reference covers, with some margin beside gaps of some length, s.
    fn inside(&self, lag_s: f64, margin_s: impl Fn(f64) -> f64) -> Vec<bool> {
        let (start, end) = (
            self.estimate.start().plus_seconds(lag_s),
            self.estimate.end().plus_seconds(lag_s),
        );
        let gaps: Vec<(Stamp, Stamp)> = self
            .estimate
            .gaps()
            .iter()
            .filter(|(from, to)| *to - *from > SHORT_GAP_S)
            .map(|(from, to)| {
                let gap_s = *to - *from;
                let margin = margin_s(gap_s) + GAP_PART * gap_s.min(2.0);
                (
                    from.plus_seconds(lag_s - margin),
                    to.plus_seconds(lag_s + margin),
                )
            })
            .collect();
        let mut next = 0;
        let is_inside = |stamp: &Stamp| {
            while next < gaps.len() && gaps[next].1 < *stamp {
                next += 1;
            }
            let in_gap = gaps.get(next).is_some_and(|gap| gap.0 <= *stamp);
            *stamp - start >= END_S && end - *stamp >= END_S && !in_gap
        };
        self.stamps.iter().map(is_inside).collect()
    }

    /// Whether an axis never changes.
    pub fn is_constant(&self, axis: usize) -> bool {
        let of = |reading| value_on_axis(reading, axis);
        let first = of(&self.measured[0]);
        self.measured.iter().all(|reading| of(reading) == first)
    }

    /// Refuses those of the axes, if any.
    pub fn refuse_stuck(&self, is_stuck: impl Fn(usize) -> bool) -> Result<(), GapError> {
        let axes = (0..6).filter(|&axis| is_stuck(axis));
        let stuck: Vec<&str> = axes.map(|axis| AXES[axis]).collect();
        if stuck.is_empty() {
            Ok(())
        } else {
            Err(GapError::Stuck {
                placement: self.name.clone(),
                axes: stuck.join(", "),
            })
        }
    }

    /// Kinematics of an estimate of the reference.
    pub fn track(&self, estimate: &PoseEstimate) -> KinematicTrack {
        estimate.track_for(self.rate_hz)
    }

    /// Runs the model without its digital stage: what clips, rounds and rescales is dealt with on
    /// the measured side.
    pub fn predict(&self, track: &KinematicTrack, set: &EffectSet) -> Prediction {
        let model = SensorModel::new(set, self.epoch);
        Prediction::new(&model, track, &self.stamps)
    }

    /// The readings under `set`, which differs from the set of `base` in the values of one effect alone.
    pub fn predict_from(
        &self,
        track: &KinematicTrack,
        base: &Prediction,
        set: &EffectSet,
        kind: EffectKind,
    ) -> Vec<Reading> {
        let model = SensorModel::new(set, self.epoch);
        base.with_other(kind, &model, track, &self.stamps)
    }

    /// The readings under the second of two sets, of which `base` is under the first and whose mounts slip at different
    /// times.
    pub fn predict_with_other_slip(
        &self,
        base: &Prediction,
        sets: [&EffectSet; 2],
    ) -> Vec<Reading> {
        let [own, other] = sets.map(|set| SensorModel::new(set, self.epoch));
        base.with_other_slip(&own, &other, &self.stamps)
    }

    /// Which part of time an entry of the sample grid belongs to.
    pub fn fold(&self, entry: usize) -> usize {
        (entry as f64 / (BLOCK_S * self.rate_hz)) as usize % FOLDS
    }

    /// What the effects' first guesses look at.
    pub fn view<'a>(&'a self, simulated: &'a [Reading]) -> ResidualView<'a> {
        ResidualView {
            stamps: &self.stamps,
            epoch: self.epoch,
            rate_hz: self.rate_hz,
            measured: &self.measured,
            simulated,
        }
    }

    /// Values (by message and axis) on the sample grid, one series for each axis, with straight
    /// lines over what is not compared.
    pub fn on_sample_grid(&self, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
        let mut series = self.scattered([true; 6], value);
        for (axis, values) in series.iter_mut().enumerate() {
            let messages = self.grid_index.iter().zip(&self.usable);
            bridge(
                values,
                messages.filter_map(|(entry, usable)| usable[axis].then_some(*entry)),
            );
        }
        series
    }

    /// The same without the straight lines, 0 where nothing is compared, as a whitener takes it; the
    /// series of an axis that is not asked for is empty.
    pub fn scattered(&self, axes: [bool; 6], value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
        let mut series: Vec<Vec<f64>> = axes
            .iter()
            .map(|asked| vec![0.0; if *asked { self.length } else { 0 }])
            .collect();
        for (axis, values) in series
            .iter_mut()
            .enumerate()
            .filter(|(axis, _)| axes[*axis])
        {
            for (k, (&entry, usable)) in self.grid_index.iter().zip(&self.usable).enumerate() {
                if usable[axis] {
                    values[entry] = value(k, axis);
                }
            }
        }
        series
    }

    /// Measured less predicted, on the sample grid.
    pub fn residual(&self, predicted: &[Reading]) -> Vec<Vec<f64>> {
        self.on_sample_grid(|k, axis| self.difference(predicted, k, axis))
    }

    /// The same as [`PreparedPlacement::scattered`] has it.
    pub fn scattered_residual(&self, predicted: &[Reading]) -> Vec<Vec<f64>> {
        self.scattered([true; 6], |k, axis| self.difference(predicted, k, axis))
    }

    fn difference(&self, predicted: &[Reading], k: usize, axis: usize) -> f64 {
        value_on_axis(&self.measured[k], axis) - value_on_axis(&predicted[k], axis)
    }

    /// Norms of the residual by channel, m/s2 and rad/s times the root of the number of values.
    pub fn residual_norms(&self, predicted: &[Reading]) -> PerChannel<f64> {
        let residual = self.residual(predicted);
        PerChannel::from_fn(|channel| {
            let own = residual[axes_of_channel(channel)].iter().flatten();
            own.map(|e| e * e).sum::<f64>().sqrt()
        })
    }

    /// The Welch spectrum of one channel of series on the sample grid, mean over its three axes.
    pub fn channel_spectrum(&self, series: &[Vec<f64>], channel: Channel) -> Spectrum {
        let window = ((WINDOW_S * self.rate_hz) as usize)
            .min(self.length / 2)
            .max(16);
        let mut sum = Spectrum::default();
        for values in &series[axes_of_channel(channel)] {
            let spectrum = welch(values, self.rate_hz, window);
            if sum.density.is_empty() {
                sum = Spectrum {
                    density: vec![0.0; spectrum.density.len()],
                    ..spectrum
                };
            }
            sum.density
                .iter_mut()
                .zip(&spectrum.density)
                .for_each(|(total, value)| *total += value / 3.0);
        }
        sum
    }
}

/// The motion behind the poses of a reference.
pub(crate) fn estimated(placement: &str, reference: &PoseSeries) -> Result<PoseEstimate, GapError> {
    PoseEstimate::fit(
        &reference.stamps,
        &reference.positions,
        &reference.rotations,
    )
    .map_err(|source| GapError::Reference {
        placement: placement.to_owned(),
        source,
    })
}

/// Straight lines over all but some entries, which are given in their order, held at the ends; a
/// series without any stays as it is.
pub(crate) fn bridge(series: &mut [f64], entries: impl Iterator<Item = usize>) {
    let mut last: Option<usize> = None;
    for entry in entries {
        match last {
            None => {
                let value = series[entry];
                series[..entry].fill(value);
            }
            Some(before) if entry > before + 1 => {
                let (from, to) = (series[before], series[entry]);
                for (step, value) in series[before + 1..entry].iter_mut().enumerate() {
                    *value = from + (to - from) * (step + 1) as f64 / (entry - before) as f64;
                }
            }
            _ => {}
        }
        last = Some(entry);
    }
    if let Some(before) = last {
        let value = series[before];
        series[before + 1..].fill(value);
    }
}

/// Finite readings in the order of time, none of them twice.
fn in_order(record: &PlacementRecord) -> Result<(Vec<Stamp>, Vec<Reading>), GapError> {
    let placement = record.name.clone();
    let finite = |reading: &Reading| (0..6).all(|axis| value_on_axis(reading, axis).is_finite());
    let mut pairs: Vec<(Stamp, Reading)> = record
        .imu
        .stamps
        .iter()
        .copied()
        .zip(record.imu.readings.iter().copied())
        .collect();
    let all = pairs.len();
    pairs.retain(|(_, reading)| finite(reading));
    if pairs.is_empty() && all > 0 {
        return Err(GapError::NotFinite { placement });
    }
    pairs.sort_by_key(|(stamp, _)| *stamp);
    pairs.dedup_by_key(|(stamp, _)| *stamp);
    if pairs.len() < LEAST_MESSAGES {
        return Err(GapError::TooFewMessages {
            placement,
            messages: pairs.len(),
            needed: LEAST_MESSAGES,
        });
    }
    Ok(pairs.into_iter().unzip())
}
