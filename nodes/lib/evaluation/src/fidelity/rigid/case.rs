//! Rigid bodies with an IMU, and how far each method's readings are from what it measured.

use cromosim_imu::{KinematicSample, Reading, SensorFrame, SensorTrajectory};
use cromosim_recording::datasets::{DatasetFiles, open_dataset};
use cromosim_recording::rigid::PoseTrajectory;
use cromosim_spatial::Stamp;

use super::alignment::{Lagged, aligned, all_lags};
use super::analytic::analytic_motions;
use super::method::{JUDGED, RigidMethod};
use super::pose_errors::PoseErrors;
use super::stated::{OwnErrors, StatedErrors};
use super::truth::{KnownMotion, POSITIONS, known_motions};
use crate::EvaluationError;
use crate::error::At;
use crate::fidelity::errors::SquaredErrors;
use crate::seeds::mixed_seed;

/// Samples so near to an end of the poses are looked at apart, s.
const END_S: f64 = 0.1;
/// A real IMU is fitted to samples so far from the ends, where every method is at its best, s.
const FITTED_FROM_S: f64 = 1.0;
/// The longest stretch of a recording that is scored, and the shortest that is worth it, s.
const LONGEST_S: f64 = 40.0;
const SHORTEST_S: f64 = 10.0;
/// Frames farther apart than so many intervals have a gap between them.
const LONGEST_GAP: f64 = 1.5;

/// One IMU on one rigid body.
pub(super) struct RigidCase {
    /// The motion or trial: what intervals draw anew.
    pub motion: String,
    /// Where the IMU is.
    pub position: String,
    trajectory: SensorTrajectory,
    /// When readings are simulated.
    stamps: Vec<Stamp>,
    measured: Measured,
}

/// What readings are compared with.
enum Measured {
    /// The exact reading at each stamp.
    Known(Vec<Reading>),
    /// A real IMU's, whose clock and mount each method has to explain.
    Real(Vec<Lagged>),
}

/// A method's errors in one case, apart from the ends and there.
#[derive(Clone, Debug, Default)]
pub(super) struct CaseErrors {
    /// Middle, ends.
    pub errors: [SquaredErrors; 2],
    /// Squared errors over what readings state, middle and ends; of the judged method alone.
    pub stated: [StatedErrors; 2],
    /// What was measured, for its size.
    pub measured: Vec<Reading>,
    /// Why the method gave no readings; all else is empty then.
    pub failure: Option<String>,
}

impl RigidCase {
    /// Frames per second of the poses, Hz.
    pub fn rate_hz(&self) -> f64 {
        (self.trajectory.frames().len() - 1) as f64 / self.seconds()
    }

    /// Length of the poses, s.
    pub fn seconds(&self) -> f64 {
        self.trajectory.end() - self.trajectory.start()
    }

    /// A method's errors, or that it failed.
    ///
    /// # Errors
    /// [`EvaluationError::NotAligned`].
    pub fn errors(&self, method: RigidMethod) -> Result<CaseErrors, EvaluationError> {
        let samples = match method.simulate(&self.trajectory, &self.stamps) {
            Ok(samples) => samples,
            Err(error) => {
                let (motion, position) = (&self.motion, &self.position);
                return Ok(CaseErrors {
                    failure: Some(format!("{motion}, {position}: {}: {error}", method.title())),
                    ..CaseErrors::default()
                });
            }
        };
        let measured = self.measured(&samples)?;
        let own = match self.measured {
            Measured::Known(_) => OwnErrors::default(),
            Measured::Real(_) => OwnErrors::of_any_device(self.reading_rate_hz()),
        };
        let mut found = CaseErrors::default();
        for (sample, measured) in samples.iter().zip(&measured) {
            let Some(measured) = measured else { continue };
            let place = usize::from(self.to_nearer_end(sample.stamp) < END_S);
            let simulated = sample.imu().reading();
            found.errors[place].add(&SquaredErrors::between(&[simulated], &[Some(*measured)]));
            if method == JUDGED {
                found.stated[place].add_reading(sample, measured, &own);
                found.measured.push(*measured);
            }
        }
        Ok(found)
    }

    /// Poses, stamps and exact readings; none for a real IMU.
    pub fn known(&self) -> Option<(&SensorTrajectory, &[Stamp], &[Reading])> {
        match &self.measured {
            Measured::Known(readings) => Some((&self.trajectory, &self.stamps, readings)),
            Measured::Real(_) => None,
        }
    }

    fn measured(
        &self,
        samples: &[KinematicSample],
    ) -> Result<Vec<Option<Reading>>, EvaluationError> {
        match &self.measured {
            Measured::Known(readings) => Ok(readings.iter().copied().map(Some).collect()),
            Measured::Real(lags) => {
                let inner = |stamp: &Stamp| self.to_nearer_end(*stamp) > FITTED_FROM_S;
                let fitted: Vec<bool> = self.stamps.iter().map(inner).collect();
                aligned(samples, lags, &fitted).ok_or_else(|| EvaluationError::NotAligned {
                    name: format!("{}, {}", self.motion, self.position),
                })
            }
        }
    }

    /// Readings per second, Hz.
    fn reading_rate_hz(&self) -> f64 {
        let seconds = self.stamps[self.stamps.len() - 1] - self.stamps[0];
        (self.stamps.len() - 1) as f64 / seconds
    }

    /// Time to the nearer end of the poses, s.
    fn to_nearer_end(&self, stamp: Stamp) -> f64 {
        (stamp - self.trajectory.start()).min(self.trajectory.end() - stamp)
    }
}

/// How motions are seen whose readings are known.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// What errs.
    pub errors: PoseErrors,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// Draws for each motion.
    pub repeats: u64,
    /// Seed of the draws.
    pub seed: u64,
    /// Whether one IMU of each motion is enough, at another place every time.
    pub quick: bool,
}

/// The physics' motions, `repeats` times with newly drawn errors.
///
/// # Errors
/// Arrays that are not as they should be, and as [`Seen::cases`].
pub(super) fn physics_cases(seen: Seen) -> Result<Vec<RigidCase>, EvaluationError> {
    let mut cases = Vec::new();
    for (number, motion) in known_motions()?.iter().enumerate() {
        for repeat in 0..seen.repeats {
            cases.extend(seen.cases(motion, number, repeat)?);
        }
    }
    Ok(cases)
}

/// Motions of closed form, which are drawn anew in each repeat as their errors are.
///
/// # Errors
/// As [`Seen::cases`].
pub(super) fn analytic_cases(seen: Seen) -> Result<Vec<RigidCase>, EvaluationError> {
    let mut cases = Vec::new();
    for repeat in 0..seen.repeats {
        for (number, motion) in analytic_motions(seen.seed, repeat).iter().enumerate() {
            cases.extend(seen.cases(motion, number, repeat)?);
        }
    }
    Ok(cases)
}

impl Seen {
    /// A motion's IMUs with drawn errors of their poses; `number` is its place among the motions.
    ///
    /// # Errors
    /// A rate that does not divide the truth's, and those of the errors' drawing.
    fn cases(
        &self,
        motion: &KnownMotion,
        number: usize,
        repeat: u64,
    ) -> Result<Vec<RigidCase>, EvaluationError> {
        let rate_hz = self.rate_hz;
        let every = (motion.rate_hz / rate_hz).round().max(1.0) as usize;
        if (every as f64 * rate_hz - motion.rate_hz).abs() > 1e-6 {
            return Err(EvaluationError::TruthRate {
                rate_hz,
                truth_hz: motion.rate_hz,
            });
        }
        let stamp = |k: usize| Stamp::from_seconds(k as f64 / motion.rate_hz);
        let frames = motion.sites[0].poses.len().div_ceil(every);
        let seed = mixed_seed(&[self.seed, number as u64, repeat]);
        let drawn = self.errors.draw(frames, rate_hz, seed)?;
        let mut cases = Vec::new();
        for (index, (site, errors)) in motion.sites.iter().zip(&drawn).enumerate() {
            if self.quick && index != number % POSITIONS.len() {
                continue;
            }
            let poses = site.poses.iter().enumerate().step_by(every).zip(errors);
            let frames: Vec<SensorFrame> = poses
                .map(|((k, pose), error)| SensorFrame::new(stamp(k), error.apply(pose)))
                .collect();
            // Behind the last pose nothing can be known.
            let count = (frames.len() - 1) * every + 1;
            cases.push(RigidCase {
                motion: motion.name.to_owned(),
                position: site.position.to_owned(),
                trajectory: SensorTrajectory::new(frames)?.from_source(self.errors.source()),
                stamps: (0..count).map(stamp).collect(),
                measured: Measured::Known(site.readings[..count].to_vec()),
            });
        }
        Ok(cases)
    }
}

/// The longest stretch without a gap of each real IMU with poses in a file; none where all are shorter
/// than [`SHORTEST_S`].
///
/// # Errors
/// A file that cannot be read, or is no recording of a data set.
pub(super) fn recorded_cases(path: &std::path::Path) -> Result<Vec<RigidCase>, EvaluationError> {
    let unknown = || EvaluationError::UnknownDataset {
        path: path.to_owned(),
    };
    let (_, recording) = open_dataset(path, &DatasetFiles::default())?.ok_or_else(unknown)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut cases = Vec::new();
    for trace in recording.traces() {
        let (Some(poses), Some(series)) = (trace.reference, trace.imu) else {
            continue;
        };
        let Some(trajectory) = longest_stretch(poses).at(|| path.display().to_string())? else {
            continue;
        };
        let inside = |stamp: &&Stamp| (trajectory.start()..=trajectory.end()).contains(*stamp);
        let stamps: Vec<Stamp> = series.stamps.iter().filter(inside).copied().collect();
        cases.push(RigidCase {
            motion: name.to_string(),
            position: trace.name.to_owned(),
            measured: Measured::Real(all_lags(&series.stamps, &series.readings(), &stamps)),
            trajectory,
            stamps,
        });
    }
    Ok(cases)
}

/// The longest run of poses without a gap, cut off behind [`LONGEST_S`].
fn longest_stretch(poses: &PoseTrajectory) -> Result<Option<SensorTrajectory>, EvaluationError> {
    let mut intervals: Vec<f64> = poses.stamps.windows(2).map(|two| two[1] - two[0]).collect();
    let gaps = intervals.clone();
    intervals.sort_by(f64::total_cmp);
    let Some(median) = intervals.get(intervals.len() / 2) else {
        return Ok(None);
    };
    let (mut best, mut first) = (0..0, 0);
    for (k, gap) in gaps.iter().chain([&f64::INFINITY]).enumerate() {
        if *gap > LONGEST_GAP * median {
            if k + 1 - first > best.len() {
                best = first..k + 1;
            }
            first = k + 1;
        }
    }
    let mut frames = poses.frames()[best].to_vec();
    let start = frames[0].stamp;
    frames.retain(|frame| frame.stamp - start <= LONGEST_S);
    if frames[frames.len() - 1].stamp - start < SHORTEST_S {
        return Ok(None);
    }
    Ok(Some(SensorTrajectory::new(frames)?))
}
