//! One placement, made ready to be compared: raster, masks, units.

use cromosim_imu::{EffectKind, EffectSet, GridTrace, Reading, SensorModel, Stage};
use cromosim_spatial::{KinematicTrack, PoseEstimate, Stamp};

use crate::{GapError, PlacementRecord};

/// Common time of IMU and reference below which nothing is said, s.
const LEAST_OVERLAP_S: f64 = 4.0;
/// What is left out at the reference's ends, s.
pub(crate) const END_S: f64 = 1.0;
/// What is left out on either side of a hole in the reference, s.
pub(crate) const HOLE_S: f64 = 0.35;
/// Length of the blocks of time that are held out together, s.
pub(crate) const BLOCK_S: f64 = 4.0;
/// Number of parts that are held out in turn.
pub(crate) const FOLDS: usize = 5;

/// One placement with everything that does not change while effects are tried.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub name: String,
    /// t0: stamp of the first IMU message.
    pub epoch: Stamp,
    pub stamps: Vec<Stamp>,
    /// Readings in SI, units factors taken out.
    pub measured: Vec<Reading>,
    pub rate_hz: f64,
    /// Entry of each message on the uniform raster of the IMU's clock.
    pub places: Vec<usize>,
    /// Entries of the raster.
    pub length: usize,
    /// Of each message and axis: whether it is compared.
    pub usable: Vec<[bool; 6]>,
    pub declared: [Option<f64>; 2],
    pub estimate: PoseEstimate,
    /// Fraction of messages that are missing, mean length of a hole in messages.
    pub dropped: (f64, f64),
}

/// A prediction with its stages kept, so that a change of one effect repeats only what comes after
/// it.
#[derive(Clone, Debug)]
pub(crate) struct Prediction {
    segment: GridTrace,
    tissue: GridTrace,
    sensor: GridTrace,
    read: Vec<Reading>,
    pub readings: Vec<Reading>,
}

impl Problem {
    pub fn new(record: &PlacementRecord) -> Result<Self, GapError> {
        let name = record.name.clone();
        let (stamps, measured) = in_order(record)?;
        let reference = &record.reference;
        let estimate = PoseEstimate::fit(
            &reference.stamps,
            &reference.positions,
            &reference.rotations,
        )
        .map_err(|source| GapError::Reference {
            placement: name.clone(),
            source,
        })?;
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let median = intervals[intervals.len() / 2];
        // The raster follows the stamps step by step: a drifting or jittering clock does not run
        // off it.
        let mut places = vec![0];
        for pair in stamps.windows(2) {
            let step = ((pair[1] - pair[0]) / median).round().max(1.0) as usize;
            places.push(places[places.len() - 1] + step);
        }
        let length = places[places.len() - 1] + 1;
        if length > 20_000_000 {
            return Err(GapError::NoOverlap {
                placement: name,
                overlap_s: 0.0,
                imu_s: length as f64 * median,
                needed_s: LEAST_OVERLAP_S,
            });
        }
        let holes = places
            .windows(2)
            .filter(|pair| pair[1] > pair[0] + 1)
            .count();
        let missing = length - stamps.len();
        let rate_hz = (length - 1) as f64 / (stamps[stamps.len() - 1] - stamps[0]);
        let usable = vec![[true; 6]; stamps.len()];
        let dropped = (
            missing as f64 / length as f64,
            if holes > 0 {
                missing as f64 / holes as f64
            } else {
                0.0
            },
        );
        let epoch = stamps[0];
        let mut problem = Self {
            name,
            epoch,
            stamps,
            measured,
            rate_hz,
            places,
            length,
            usable,
            declared: record.imu.declared,
            estimate,
            dropped,
        };
        problem.find_stuck()?;
        Ok(problem)
    }

    /// Leaves out what the reference does not cover when the IMU's stamps are late by `lag_s`, and
    /// what is next to its holes.
    pub fn cover(&mut self, lag_s: f64) -> Result<(), GapError> {
        let (start, end) = (
            self.estimate.start().plus_seconds(lag_s),
            self.estimate.end().plus_seconds(lag_s),
        );
        let gaps: Vec<(Stamp, Stamp)> = self
            .estimate
            .gaps()
            .iter()
            .map(|(from, to)| {
                // A long hole is filled worse, and its errors reach further.
                let margin = HOLE_S + 0.3 * (*to - *from).min(2.0);
                (
                    from.plus_seconds(lag_s - margin),
                    to.plus_seconds(lag_s + margin),
                )
            })
            .collect();
        let mut next = 0;
        let mut covered = 0;
        for (k, stamp) in self.stamps.iter().enumerate() {
            while next < gaps.len() && gaps[next].1 < *stamp {
                next += 1;
            }
            let in_gap = gaps.get(next).is_some_and(|gap| gap.0 <= *stamp);
            let inside = *stamp - start >= END_S && end - *stamp >= END_S && !in_gap;
            covered += usize::from(inside);
            if !inside {
                self.usable[k] = [false; 6];
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

    /// Refuses channels that never change.
    fn find_stuck(&mut self) -> Result<(), GapError> {
        let constant = |axis: usize| {
            self.measured
                .iter()
                .all(|reading| axis_of(reading, axis) == axis_of(&self.measured[0], axis))
        };
        let stuck: Vec<&str> = (0..6)
            .filter(|&axis| constant(axis))
            .map(|axis| crate::AXES[axis])
            .collect();
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
        let segment = model.segment(track);
        let tissue = model.tissue(segment.clone());
        let sensor = model.sensor(tissue.clone());
        let read = model.read(&sensor, &self.stamps);
        let mut readings = read.clone();
        model.linear(&mut readings, &self.stamps);
        Prediction {
            segment,
            tissue,
            sensor,
            read,
            readings,
        }
    }

    /// The readings under `set`, which differs from the set of `base` in effects of `stage` alone.
    pub fn predict_from(
        &self,
        track: &KinematicTrack,
        base: &Prediction,
        set: &EffectSet,
        stage: Stage,
    ) -> Vec<Reading> {
        let model = SensorModel::new(set, self.epoch);
        let mut readings = if stage <= Stage::Segment {
            model.read(
                &model.sensor(model.tissue(model.segment(track))),
                &self.stamps,
            )
        } else if stage == Stage::Tissue {
            model.read(
                &model.sensor(model.tissue(base.segment.clone())),
                &self.stamps,
            )
        } else if stage == Stage::Sensor {
            model.read(&model.sensor(base.tissue.clone()), &self.stamps)
        } else if stage == Stage::Timing {
            model.read(&base.sensor, &self.stamps)
        } else {
            base.read.clone()
        };
        model.linear(&mut readings, &self.stamps);
        readings
    }

    /// Which part of time an entry of the raster belongs to.
    pub fn fold(&self, place: usize) -> usize {
        (place as f64 / (BLOCK_S * self.rate_hz)) as usize % FOLDS
    }
}

/// One of the six values of a reading, in the order of [`crate::AXES`].
pub(crate) fn axis_of(reading: &Reading, axis: usize) -> f64 {
    if axis < 3 {
        reading.specific_force[axis]
    } else {
        reading.angular_velocity[axis - 3]
    }
}

/// The stage from which an effect's change has to be repeated.
pub(crate) fn stage_of(kind: EffectKind) -> Stage {
    kind.spec().stage
}

/// Finite readings in the order of time, none of them twice.
fn in_order(record: &PlacementRecord) -> Result<(Vec<Stamp>, Vec<Reading>), GapError> {
    let placement = record.name.clone();
    let finite = |reading: &Reading| (0..6).all(|axis| axis_of(reading, axis).is_finite());
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
    if pairs.len() < 50 {
        return Err(GapError::TooFewMessages {
            placement,
            messages: pairs.len(),
            needed: 50,
        });
    }
    Ok(pairs.into_iter().unzip())
}
