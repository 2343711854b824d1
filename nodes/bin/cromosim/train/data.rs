//! Pairs out of files.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose};
use cromosim_imu::{Placement, Reading, Scheme, SensorFrame, SensorTrajectory};
use cromosim_learned::{KnownMotion, Pair, PairNames, SiteMotion, Worn};
use cromosim_motion::{MotionOptions, read_motion_for, retarget};
use cromosim_recording::datasets::{DatasetFiles, LabelledClip, open_dataset, parse_skeleton_npz};
use cromosim_recording::read_placements;
use cromosim_spatial::Stamp;
use nalgebra::Isometry3;
use rayon::prelude::*;

use super::config::{Config, Source};
use crate::progress::{self, Interrupt};

/// The rate that placements of drawn devices stand for, Hz.
const RATE_HZ: f64 = 100.0;
/// References with a longer gap, s, are cut there.
const LONGEST_GAP: f64 = 0.1;
/// Shorter pieces between gaps, s, are left out.
const SHORTEST: f64 = 2.0;

/// A motion as its frames.
pub struct Motion {
    /// The file's name without its ending.
    pub name: String,
    /// Frames.
    pub poses: Vec<BodyPose>,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// Frames with joints that flip; empty where the file does not say.
    pub suspect: Vec<bool>,
}

impl Motion {
    /// As the drawing of devices takes it.
    pub fn known(&self) -> KnownMotion<'_> {
        KnownMotion {
            poses: &self.poses,
            rate_hz: self.rate_hz,
            suspect: &self.suspect,
        }
    }
}

/// A skeleton clip with what its frames show.
pub struct Skeleton {
    /// On the body.
    pub motion: Motion,
    /// One a frame, or none at all.
    pub labels: Vec<Option<String>>,
    /// Why it is unlike everyday motion; empty where it is not.
    pub atypical: String,
}

/// Skeleton clips as npz begin with what is left of a blend out of the T-pose: hands come down with
/// 300 m/s2.
const BLEND_FRAMES: usize = 6;

/// Reads a skeleton clip (npz) without the blend that it begins with.
pub fn read_skeleton(path: &Path, model: &Arc<BodyModel>) -> anyhow::Result<Skeleton> {
    played(parse_skeleton(path)?, path, model)
}

/// Reads a motion of any kind, skeleton clips as npz among them.
pub fn read_motion(path: &Path, model: &Arc<BodyModel>) -> anyhow::Result<Motion> {
    if let Ok(clip) = parse_skeleton(path) {
        return Ok(played(clip, path, model)?.motion);
    }
    let motion = read_motion_for(path, model, &options())?;
    Ok(Motion {
        name: name_of(path),
        rate_hz: motion.rate_hz,
        poses: motion.frames,
        suspect: Vec::new(),
    })
}

fn parse_skeleton(path: &Path) -> anyhow::Result<LabelledClip> {
    let place = path.display().to_string();
    let file = File::open(path).with_context(|| format!("{place}: cannot be read"))?;
    Ok(parse_skeleton_npz(file, &place)?)
}

fn played(clip: LabelledClip, path: &Path, model: &Arc<BodyModel>) -> anyhow::Result<Skeleton> {
    let LabelledClip {
        clip,
        mut suspect,
        mut labels,
        atypical,
        ..
    } = clip;
    let motion = retarget(&clip, model, &options())?;
    let begin = BLEND_FRAMES.min(motion.frames.len());
    suspect.drain(..begin.min(suspect.len()));
    labels.drain(..begin.min(labels.len()));
    let motion = Motion {
        name: name_of(path),
        rate_hz: motion.rate_hz,
        poses: motion.frames[begin..].to_vec(),
        suspect,
    };
    Ok(Skeleton {
        motion,
        labels,
        atypical,
    })
}

fn options() -> MotionOptions {
    MotionOptions {
        keep_lead_in: true,
        ..MotionOptions::default()
    }
}

fn name_of(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// All pairs of a training, in the order of its file; motions are played on the body that is given,
/// or the embedded one.
pub fn pairs(
    config: &Config,
    folder: &Path,
    given: Option<&Arc<BodyModel>>,
    interrupt: &Interrupt,
) -> anyhow::Result<Vec<Pair>> {
    let model = given.cloned().unwrap_or_else(BodyModel::embedded);
    let mut all = Vec::new();
    for (index, source) in config.data.iter().enumerate() {
        if source.motions.is_empty() {
            for piece in recorded(source, folder, given)? {
                all.push(piece.pair(&source.subject)?);
            }
        } else {
            let seed = config
                .training
                .seed
                .wrapping_mul(1_000_003)
                .wrapping_add(index as u64);
            let pair = |worn: Worn, names| Ok(worn.pair(names, worn.motion(Scheme::Spline)?)?);
            all.extend(draw(source, folder, &model, seed, interrupt, pair)?);
        }
    }
    Ok(all)
}

/// Drawn people and devices of a source, each made into something.
pub fn draw<T: Send>(
    source: &Source,
    folder: &Path,
    model: &Arc<BodyModel>,
    seed: u64,
    interrupt: &Interrupt,
    make: impl Fn(Worn, PairNames) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let files = source.motion_files(folder)?;
    let placements = source
        .sites
        .iter()
        .map(|site| placement(site))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let wearing = source.wearing();
    let bar = progress::bar(
        files.len() as u64,
        &format!("subject {}, motions", source.subject),
    );
    let one = |(number, path): (usize, &std::path::PathBuf)| -> anyhow::Result<Vec<T>> {
        interrupt.check()?;
        let motion = read_motion(path, model)?;
        let mut made = Vec::new();
        for (place, placement) in placements.iter().enumerate() {
            for repeat in 0..source.repeats {
                let names = PairNames {
                    name: format!("{} {} {repeat}", motion.name, placement.name()),
                    subject: source.subject.clone(),
                    position: placement.name().to_owned(),
                };
                let draw = mix(&[seed, number as u64, place as u64, repeat]);
                let worn = wearing.draw(model, &motion.known(), placement, draw);
                let worn =
                    worn.with_context(|| format!("{}, site {}", path.display(), placement.name()))?;
                made.push(make(worn, names).with_context(|| path.display().to_string())?);
            }
        }
        bar.inc(1);
        Ok(made)
    };
    let made: anyhow::Result<Vec<Vec<T>>> = files.par_iter().enumerate().map(one).collect();
    bar.finish_and_clear();
    Ok(made?.into_iter().flatten().collect())
}

/// A placement named as its site.
fn placement(site: &str) -> anyhow::Result<Placement> {
    Placement::at_site(site, site, RATE_HZ)
        .map_err(|(field, problem)| anyhow!("site {site}: {field}: {problem}"))
}

/// One seed of several numbers (SplitMix64, Steele et al. 2014).
pub fn mix(numbers: &[u64]) -> u64 {
    numbers
        .iter()
        .fold(0x9E37_79B9_7F4A_7C15, |state: u64, number| {
            let mut z = (state ^ number).wrapping_add(0x9E37_79B9_7F4A_7C15);
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        })
}

/// A real device beside its reference, where the reference has no gap.
pub struct Piece {
    /// The recording, and which of its pieces.
    pub name: String,
    /// Where the device was.
    pub position: String,
    /// The reference.
    pub trajectory: SensorTrajectory,
    /// Of all readings of the recording.
    stamps: Arc<Vec<Stamp>>,
    readings: Arc<Vec<Reading>>,
}

impl Piece {
    /// The pair, its motion by the spline.
    pub fn pair(&self, subject: &str) -> anyhow::Result<Pair> {
        let motion = SiteMotion::rigid(&self.trajectory, Scheme::Spline)?;
        let names = PairNames {
            name: self.name.clone(),
            subject: subject.to_owned(),
            position: self.position.clone(),
        };
        let pair = Pair::new(names, motion.clone(), &motion, &self.stamps, &self.readings);
        pair.with_context(|| format!("{}, {}", self.name, self.position))
    }
}

/// The real devices of a source.
pub fn recorded(
    source: &Source,
    folder: &Path,
    given: Option<&Arc<BodyModel>>,
) -> anyhow::Result<Vec<Piece>> {
    let mut all = Vec::new();
    for path in source.recording_files(folder)? {
        let name = name_of(&path);
        let before = all.len();
        let mut add = |position: &str, frames, stamps, readings| -> anyhow::Result<()> {
            if !source.sites.is_empty() && !source.sites.iter().any(|site| site == position) {
                return Ok(());
            }
            all.extend(pieces(
                &name,
                position,
                source.part_of(frames),
                stamps,
                readings,
            )?);
            Ok(())
        };
        if let Some((_, recording)) = open_dataset(&path, &DatasetFiles::default())? {
            for trace in recording.traces() {
                let (Some(poses), Some(series)) = (trace.reference, trace.imu) else {
                    continue;
                };
                let frames = poses
                    .stamps
                    .iter()
                    .zip(&poses.positions)
                    .zip(&poses.rotations)
                    .map(|((stamp, position), rotation)| {
                        SensorFrame::new(
                            *stamp,
                            Isometry3::from_parts((*position).into(), *rotation),
                        )
                    });
                let both = series.specific_force.iter().zip(&series.angular_velocity);
                let readings = both
                    .map(|(force, rate)| Reading {
                        specific_force: *force,
                        angular_velocity: *rate,
                    })
                    .collect();
                add(
                    trace.name,
                    frames.collect(),
                    series.stamps.clone(),
                    readings,
                )?;
            }
        } else {
            for (position, recorded) in read_placements(&BagReader::open(&path)?, given)? {
                let recorded =
                    recorded.with_context(|| format!("{}: {position}", path.display()))?;
                let record = recorded.record();
                let (stamps, readings) = (record.imu.stamps.clone(), record.imu.readings.clone());
                add(&position, recorded.frames, stamps, readings)?;
            }
        }
        if all.len() == before {
            let named = if source.sites.is_empty() {
                String::new()
            } else {
                format!(" called {}", source.sites.join(" or "))
            };
            bail!(
                "{}: no reference of {SHORTEST} s without a gap beside an IMU{named}",
                path.display()
            );
        }
    }
    Ok(all)
}

/// One for each piece of the reference without a gap.
fn pieces(
    name: &str,
    position: &str,
    frames: Vec<SensorFrame>,
    stamps: Vec<Stamp>,
    readings: Vec<Reading>,
) -> anyhow::Result<Vec<Piece>> {
    let mut pieces: Vec<Vec<SensorFrame>> = vec![Vec::new()];
    for frame in frames {
        let piece = pieces.len() - 1;
        if pieces[piece]
            .last()
            .is_some_and(|last| frame.stamp - last.stamp > LONGEST_GAP)
        {
            pieces.push(vec![frame]);
        } else {
            pieces[piece].push(frame);
        }
    }
    let (stamps, readings) = (Arc::new(stamps), Arc::new(readings));
    let long = |piece: &Vec<SensorFrame>| {
        piece.len() > 10 && piece[piece.len() - 1].stamp - piece[0].stamp >= SHORTEST
    };
    let piece = |(number, frames): (usize, Vec<SensorFrame>)| -> anyhow::Result<Piece> {
        let (name, position) = (format!("{name} {number}"), position.to_owned());
        Ok(Piece {
            name,
            position,
            trajectory: SensorTrajectory::new(frames)?,
            stamps: stamps.clone(),
            readings: readings.clone(),
        })
    };
    pieces
        .into_iter()
        .filter(long)
        .enumerate()
        .map(piece)
        .collect()
}
