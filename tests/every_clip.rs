//! Every skeleton clip at hand: the same seconds give the same readings, wherever the clip begins
//! and ends, and no clip begins or ends with a jolt. The limit of the trim was chosen on the clips of
//! `mocap_cmu`, nothing on those of `mocap_cmu_har` that are not among them.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::File;
use std::path::{Path, PathBuf};

use common::shared_data;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{
    Differentiation, ImuSample, MountedSensor, PlacementSet, Scheme, SensorTrajectory, Trim,
    simulate_kinematics,
};
use cromosim_motion::{BvhClip, MotionOptions, SmplMotion, retarget};
use cromosim_recording::datasets::parse_skeleton_npz;
use cromosim_spatial::{Stamp, uniform_stamps};
use nalgebra::Vector3;

const RATE_HZ: f64 = 100.0;
/// These files begin with what is left of a blend out of a T-pose, s.
const BLEND_S: f64 = 0.25;
/// Length of a cut, and what is left out at either end of it, s.
const CUT_S: f64 = 3.0;
const LEFT_OUT_S: f64 = 0.5;
/// Cuts begin at multiples of this, which is whole in frames and in samples, s.
const STEP_S: f64 = 0.05;

/// Specific force, angular velocity.
type Reading = [Vector3<f64>; 2];

/// The skeleton clips of the shared data.
fn clips(data: &Path) -> Vec<PathBuf> {
    let files = |folder: &str| std::fs::read_dir(data.join(folder)).unwrap();
    let mut paths: Vec<PathBuf> = files("mocap_cmu")
        .chain(files("mocap_cmu_har"))
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|kind| kind == "npz"))
        .collect();
    paths.sort();
    paths
}

fn without_blend(path: &Path) -> BvhClip {
    let name = path.display().to_string();
    let clip = parse_skeleton_npz(File::open(path).unwrap(), &name)
        .unwrap()
        .clip;
    let blend = (BLEND_S * clip.rate_hz()).round() as usize;
    cut(&clip, blend..clip.frame_count())
}

/// Frames of a clip as a clip of its own.
fn cut(clip: &BvhClip, frames: std::ops::Range<usize>) -> BvhClip {
    let values = frames
        .flat_map(|frame| clip.frame(frame).to_vec())
        .collect();
    BvhClip::from_parts(
        clip.name(),
        clip.joints().to_vec(),
        clip.frame_time_s(),
        values,
    )
}

/// Readings of the demo's placements.
fn simulated(clip: &BvhClip, by: Differentiation, trim: Trim) -> Vec<Vec<Reading>> {
    let options = MotionOptions {
        keep_lead_in: true,
        ..MotionOptions::default()
    };
    let motion = retarget(clip, &BodyModel::embedded(), &options).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    let placements = PlacementSet::demo();
    let series = placements.placements().iter().map(|placement| {
        let mounted = MountedSensor::new(&body, placement).unwrap();
        readings(&trajectory(&mounted, &motion), by, trim)
    });
    series.collect()
}

fn trajectory(mounted: &MountedSensor, motion: &SmplMotion) -> SensorTrajectory {
    let stamps: Vec<Stamp> = (0..motion.frames.len())
        .map(|k| Stamp::from_seconds(k as f64 / motion.rate_hz))
        .collect();
    mounted.trajectory(&stamps, &motion.frames).unwrap()
}

fn readings(trajectory: &SensorTrajectory, by: Differentiation, trim: Trim) -> Vec<Reading> {
    let stamps = uniform_stamps(trajectory.start(), trajectory.end(), RATE_HZ).unwrap();
    let samples = simulate_kinematics(trajectory, by, &stamps).unwrap();
    let span = trim.span(&samples).unwrap();
    let inside = samples.iter().filter(|sample| span.contains(&sample.stamp));
    inside
        .map(|sample| {
            let ImuSample {
                specific_force,
                angular_velocity,
                ..
            } = sample.imu();
            [specific_force, angular_velocity]
        })
        .collect()
}

/// Largest specific force within 0.1 s of the ends over the 99th percentile.
fn end_peak(readings: &[Reading]) -> f64 {
    let forces: Vec<f64> = readings.iter().map(|[force, _]| force.norm()).collect();
    let near = (0.1 * RATE_HZ) as usize;
    let ends = forces[..near].iter().chain(&forces[forces.len() - near..]);
    let most = ends.copied().fold(0.0, f64::max);
    most / quantile(forces, 0.99)
}

fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() as f64 * part) as usize).min(values.len() - 1)]
}

/// Root mean square difference over the standard deviation, of one channel.
fn difference(whole: &[Reading], cut: &[Reading], channel: usize) -> f64 {
    let mean = whole
        .iter()
        .map(|reading| reading[channel])
        .sum::<Vector3<f64>>()
        / whole.len() as f64;
    let (mut step, mut signal) = (0.0, 0.0);
    for (whole, cut) in whole.iter().zip(cut) {
        step += (whole[channel] - cut[channel]).norm_squared();
        signal += (whole[channel] - mean).norm_squared();
    }
    (step / signal).sqrt()
}

#[test]
fn readings_do_not_depend_on_where_a_clip_begins_and_ends() {
    let Some(data) = shared_data() else {
        return;
    };
    let (mut shares, mut peaks) = ([Vec::new(), Vec::new()], Vec::new());
    let (mut trimmed_s, mut longest_s) = (0.0, 0.0_f64);
    let by = Differentiation::from(Scheme::default());
    let paths = clips(&data);
    for path in &paths {
        let (name, clip) = (path.display().to_string(), without_blend(path));
        let frames = |seconds: f64| (seconds * clip.rate_hz()).round() as usize;
        let ends = simulated(&clip, by, Trim::Uncertain);
        let whole_s = (clip.frame_count() - 1) as f64 / clip.rate_hz();
        for readings in &ends {
            let gone_s = whole_s - (readings.len() - 1) as f64 / RATE_HZ;
            trimmed_s += gone_s;
            longest_s = longest_s.max(gone_s);
        }
        peaks.extend(
            ends.iter()
                .map(|readings| (end_peak(readings), name.clone())),
        );
        let spare_s = clip.frame_count() as f64 / clip.rate_hz() - CUT_S;
        if spare_s < CUT_S {
            continue;
        }
        let whole = simulated(&clip, by, Trim::Seconds(0.0));
        for part in [0.25, 0.75] {
            let start_s = (spare_s * part / STEP_S).floor() * STEP_S;
            let first = frames(start_s);
            let own = cut(&clip, first..first + frames(CUT_S));
            for (whole, cut) in whole.iter().zip(simulated(&own, by, Trim::Seconds(0.0))) {
                let left_out = (LEFT_OUT_S * RATE_HZ) as usize;
                let inside = left_out..cut.len() - left_out;
                let start = (start_s * RATE_HZ).round() as usize;
                for (channel, shares) in shares.iter_mut().enumerate() {
                    let same = &whole[start..][inside.clone()];
                    shares.push(difference(same, &cut[inside.clone()], channel));
                }
            }
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let jolts = peaks.iter().filter(|(peak, _)| *peak > 1.3).count();
    println!(
        "{} clips; {jolts} of {} series peak at an end: {:?}",
        paths.len(),
        peaks.len(),
        &peaks[..6.min(peaks.len())]
    );
    println!(
        "trimmed: at most {longest_s:.2} s of a series, {:.3} s on average",
        trimmed_s / peaks.len() as f64
    );
    assert_eq!(jolts, 0, "{:?}", peaks[0]);
    for (channel, shares) in ["specific force", "angular velocity"].iter().zip(shares) {
        let (median, most) = (
            quantile(shares.clone(), 0.5),
            quantile(shares.clone(), 0.95),
        );
        println!(
            "{channel}: median {median:.4}, 95 % {most:.4}, worst {:.4} of {}",
            quantile(shares.clone(), 1.0),
            shares.len()
        );
        assert!(median < 0.02 && most < 0.05, "{channel}: {median} {most}");
    }
}

#[test]
fn a_fixed_bandwidth_does_not_jolt_at_the_ends() {
    let Some(data) = shared_data() else {
        return;
    };
    let clips: Vec<BvhClip> = clips(&data)
        .iter()
        .map(|path| without_blend(path))
        .collect();
    for bandwidth_hz in [2.0, 4.0, 6.0, 10.0] {
        let by = Differentiation::Bandwidth(bandwidth_hz);
        let [kept, trimmed] = [Trim::Seconds(0.0), Trim::Uncertain].map(|trim| {
            let series = clips.iter().flat_map(|clip| simulated(clip, by, trim));
            let peaks: Vec<f64> = series.map(|readings| end_peak(&readings)).collect();
            let jolts = peaks.iter().filter(|peak| **peak > 1.3).count();
            (peaks.len(), jolts, quantile(peaks, 1.0))
        });
        // Noise that is as large farther inside is trimmed at neither.
        let ((count, before, _), (_, after, worst)) = (kept, trimmed);
        println!(
            "{bandwidth_hz} Hz: series, jolts at an end, worst: {kept:?}; ends left out: {trimmed:?}"
        );
        assert!(
            before >= 10 && after * 200 <= count && worst < 1.5,
            "{bandwidth_hz} Hz"
        );
    }
}
