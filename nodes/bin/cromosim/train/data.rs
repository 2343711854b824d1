//! Pairs out of files.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose};
use cromosim_imu::{Placement, Reading, Scheme, SensorFrame, SensorTrajectory};
use cromosim_learned::{Pair, PairNames, SiteMotion};
use cromosim_motion::datasets::{DatasetFiles, open_dataset, parse_skeleton_npz};
use cromosim_motion::{MotionOptions, read_motion_for, retarget};
use cromosim_replay::recording::of_dataset;
use cromosim_spatial::Stamp;
use nalgebra::Isometry3;
use rayon::prelude::*;

use super::config::{Config, Source};
use crate::progress::{self, Interrupt};
use crate::recorded;

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
}

/// Reads a motion of any kind, skeleton clips as npz among them.
pub fn read_motion(path: &Path, model: &Arc<BodyModel>) -> anyhow::Result<Motion> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let options = MotionOptions { keep_lead_in: true, ..MotionOptions::default() };
    let skeleton = || File::open(path).ok().and_then(|file| parse_skeleton_npz(file, &path.display().to_string()).ok());
    let motion = match skeleton() {
        Some(labelled) => retarget(&labelled.clip, model, &options)?,
        None => read_motion_for(path, model, &options)?,
    };
    Ok(Motion { name, rate_hz: motion.rate_hz, poses: motion.frames })
}

/// All pairs of a training, in the order of its file; motions are played on the body that is given, or the embedded one.
pub fn pairs(config: &Config, folder: &Path, given: Option<&Arc<BodyModel>>, interrupt: &Interrupt) -> anyhow::Result<Vec<Pair>> {
    let model = given.cloned().unwrap_or_else(BodyModel::embedded);
    let mut all = Vec::new();
    for (index, source) in config.data.iter().enumerate() {
        let seed = config.training.seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
        all.extend(if source.motions.is_empty() {
            recorded(source, folder, given)?
        } else {
            drawn(source, folder, &model, seed, interrupt)?
        });
    }
    Ok(all)
}

/// Pairs of drawn people and devices.
fn drawn(source: &Source, folder: &Path, model: &Arc<BodyModel>, seed: u64, interrupt: &Interrupt) -> anyhow::Result<Vec<Pair>> {
    let files = source.motion_files(folder)?;
    let scheme = if source.wearing().source.rate_hz < 60.0 { Scheme::Richardson } else { Scheme::Spline };
    let placements = source.sites.iter().map(|site| placement(site, scheme)).collect::<anyhow::Result<Vec<_>>>()?;
    let wearing = source.wearing();
    let bar = progress::bar(files.len() as u64, &format!("subject {}, motions", source.subject));
    let one = |(number, path): (usize, &std::path::PathBuf)| -> anyhow::Result<Vec<Pair>> {
        interrupt.check()?;
        let motion = read_motion(path, model)?;
        let mut pairs = Vec::new();
        for (place, placement) in placements.iter().enumerate() {
            for repeat in 0..source.repeats {
                let names = PairNames {
                    name: format!("{} {} {repeat}", motion.name, placement.name()),
                    subject: source.subject.clone(),
                    position: placement.name().to_owned(),
                };
                let draw = mix(&[seed, number as u64, place as u64, repeat]);
                let pair = wearing.pair(model, names, (&motion.poses, motion.rate_hz), placement, draw);
                pairs.push(pair.with_context(|| format!("{}, site {}", path.display(), placement.name()))?);
            }
        }
        bar.inc(1);
        Ok(pairs)
    };
    let pairs: anyhow::Result<Vec<Vec<Pair>>> = files.par_iter().enumerate().map(one).collect();
    bar.finish_and_clear();
    Ok(pairs?.into_iter().flatten().collect())
}

/// A placement named as its site.
pub fn placement(site: &str, scheme: Scheme) -> anyhow::Result<Placement> {
    match Placement::at_site(site, site, RATE_HZ) {
        Ok(placement) => Ok(placement.with_scheme(scheme)),
        Err((field, problem)) => bail!("site {site}: {field}: {problem}"),
    }
}

/// One seed of several numbers (SplitMix64, Steele et al. 2014).
pub fn mix(numbers: &[u64]) -> u64 {
    numbers.iter().fold(0x9E37_79B9_7F4A_7C15, |state: u64, number| {
        let mut z = (state ^ number).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    })
}

/// Pairs of real devices.
fn recorded(source: &Source, folder: &Path, given: Option<&Arc<BodyModel>>) -> anyhow::Result<Vec<Pair>> {
    let mut pairs = Vec::new();
    for path in source.recording_files(folder)? {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let before = pairs.len();
        if let Some((_, recording)) = open_dataset(&path, &DatasetFiles::default())? {
            for placed in of_dataset(&recording) {
                let (Some(poses), Some(series)) = (placed.poses, placed.series) else { continue };
                let frames =
                    poses.stamps.iter().zip(&poses.positions).zip(&poses.rotations).map(|((stamp, position), rotation)| {
                        SensorFrame::new(*stamp, Isometry3::from_parts((*position).into(), *rotation))
                    });
                let both = series.specific_force.iter().zip(&series.angular_velocity);
                let readings: Vec<Reading> = both.map(|(force, rate)| Reading { force: *force, rate: *rate }).collect();
                pairs.extend(pieces(&name, &source.subject, placed.name, frames.collect(), &series.stamps, &readings)?);
            }
        } else {
            for (position, recorded) in recorded::read(&BagReader::open(&path)?, given)? {
                let recorded = recorded.with_context(|| format!("{}: {position}", path.display()))?;
                let record = recorded.record();
                let (stamps, readings) = (&record.imu.stamps, &record.imu.readings);
                pairs.extend(pieces(&name, &source.subject, &position, recorded.frames, stamps, readings)?);
            }
        }
        if pairs.len() == before {
            bail!("{}: no reference of {SHORTEST} s without a gap beside an IMU", path.display());
        }
    }
    Ok(pairs)
}

/// One pair for each piece of the reference without a gap.
pub fn pieces(
    name: &str,
    subject: &str,
    position: &str,
    frames: Vec<SensorFrame>,
    stamps: &[Stamp],
    readings: &[Reading],
) -> anyhow::Result<Vec<Pair>> {
    let mut pieces: Vec<Vec<SensorFrame>> = vec![Vec::new()];
    for frame in frames {
        let piece = pieces.len() - 1;
        if pieces[piece].last().is_some_and(|last| frame.stamp - last.stamp > LONGEST_GAP) {
            pieces.push(vec![frame]);
        } else {
            pieces[piece].push(frame);
        }
    }
    let long = |piece: &Vec<SensorFrame>| piece.len() > 10 && piece[piece.len() - 1].stamp - piece[0].stamp >= SHORTEST;
    let pair = |(number, piece): (usize, Vec<SensorFrame>)| -> anyhow::Result<Pair> {
        let motion = SiteMotion::rigid(&SensorTrajectory::new(piece)?, Scheme::Spline)?;
        let names = PairNames { name: format!("{name} {number}"), subject: subject.to_owned(), position: position.to_owned() };
        Pair::new(names, motion.clone(), &motion, stamps, readings).with_context(|| format!("{name}, {position}"))
    };
    pieces.into_iter().filter(long).enumerate().map(pair).collect()
}
