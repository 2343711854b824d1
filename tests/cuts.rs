//! The same seconds of a recorded motion give the same readings, whatever was recorded before and
//! after them: three seconds cut out of a file, and taken by `--start`, against the same seconds of
//! the whole. And no clip begins or ends with a jolt.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::{refuses, root, shared_data, succeed};

/// Frames at 120 Hz and samples at 100 Hz that last 0.05 s: cuts begin at multiples of both.
const FRAMES: usize = 6;
const SAMPLES: usize = 5;
/// The same of 3 s, and of the half second at either end that is left out.
const CUT_FRAMES: usize = 60 * FRAMES;
const LEFT_OUT: usize = 10 * SAMPLES;
/// First frames, which in these files lead out of a T-pose.
const T_POSE: usize = 30;

/// A BVH file as its lines before the frames' number, and its frames.
struct Bvh {
    head: Vec<String>,
    frame_time: String,
    frames: Vec<String>,
}

impl Bvh {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let times = lines
            .iter()
            .position(|line| line.starts_with("Frame Time"))
            .unwrap();
        let frames = lines[times + 1..].iter().filter(|line| !line.is_empty());
        Self {
            head: lines[..times - 1].to_vec(),
            frame_time: lines[times].clone(),
            frames: frames.skip(T_POSE).cloned().collect(),
        }
    }

    fn write(&self, path: &Path, frames: &[String]) {
        let mut text = self.head.join("\n");
        text += &format!("\nFrames: {}\n{}\n", frames.len(), self.frame_time);
        text += &frames.join("\n");
        fs::write(path, text + "\n").unwrap();
    }
}

/// One reading: angular velocity, specific force.
type Reading = [f64; 6];

/// Readings of every placement, by the default scheme.
fn simulated(folder: &Path, motion: &str, options: &[&str]) -> BTreeMap<String, Vec<Reading>> {
    let arguments = [
        "simulate",
        motion,
        "--out",
        "out.mcap",
        "--csv",
        "csv",
        "--no-noise",
        "--force",
    ];
    succeed(folder, &[&arguments[..], options].concat());
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder.join("csv")).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        let reading = |line: &str| -> Reading {
            let values: Vec<f64> = line
                .split(',')
                .skip(5)
                .map(|value| value.parse().unwrap())
                .collect();
            values.try_into().unwrap()
        };
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        all.insert(name, text.lines().skip(1).map(reading).collect());
    }
    all
}

/// Largest specific force within 0.1 s of the ends over the 99th percentile.
fn end_peak(readings: &[Reading]) -> f64 {
    let norm = |reading: &Reading| reading[3..].iter().map(|f| f * f).sum::<f64>().sqrt();
    let forces: Vec<f64> = readings.iter().map(norm).collect();
    let (first, last) = (
        &forces[..2 * SAMPLES],
        &forces[forces.len() - 2 * SAMPLES..],
    );
    let most = first.iter().chain(last).copied().fold(0.0, f64::max);
    let mut sorted = forces.clone();
    sorted.sort_by(f64::total_cmp);
    most / sorted[sorted.len() * 99 / 100]
}

/// Root mean square difference over the standard deviation, of three columns.
fn difference(whole: &[Reading], cut: &[Reading], columns: std::ops::Range<usize>) -> f64 {
    let count = whole.len() as f64;
    let (mut step, mut signal) = (0.0, 0.0);
    for column in columns {
        let mean = whole.iter().map(|reading| reading[column]).sum::<f64>() / count;
        for (whole, cut) in whole.iter().zip(cut) {
            step += (whole[column] - cut[column]).powi(2);
            signal += (whole[column] - mean).powi(2);
        }
    }
    (step / signal).sqrt()
}

#[test]
fn the_same_seconds_give_the_same_readings() {
    let Some(data) = shared_data() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut shares = [Vec::new(), Vec::new()];
    for name in ["06_10", "13_07", "13_36"] {
        let bvh = Bvh::read(&data.join(format!("mocap_cmu/{name}.bvh")));
        bvh.write(&folder.join("whole.bvh"), &bvh.frames);
        let whole = simulated(folder, "whole.bvh", &["--trim", "0"]);
        for part in [1, 3] {
            let steps = (bvh.frames.len() - CUT_FRAMES) * part / 4 / FRAMES;
            let first = steps * FRAMES;
            bvh.write(
                &folder.join("cut.bvh"),
                &bvh.frames[first..first + CUT_FRAMES],
            );
            for (placement, cut) in simulated(folder, "cut.bvh", &["--trim", "0"]) {
                let inside = LEFT_OUT..cut.len() - LEFT_OUT;
                let same = &whole[&placement][steps * SAMPLES..][inside.clone()];
                for (shares, columns) in shares.iter_mut().zip([0..3, 3..6]) {
                    shares.push(difference(same, &cut[inside.clone()], columns));
                }
            }
        }
    }
    for (channel, mut shares) in ["angular velocity", "specific force"]
        .into_iter()
        .zip(shares)
    {
        shares.sort_by(f64::total_cmp);
        let (median, most) = (shares[shares.len() / 2], shares[shares.len() * 19 / 20]);
        println!(
            "{channel}: median {median:.4}, 95 % {most:.4} of {}",
            shares.len()
        );
        assert!(median < 0.02 && most < 0.05, "{channel}: {median} {most}");
    }
}

/// Differentiated before it is cut: what `--start` and `--duration` take is what the whole has there.
#[test]
fn a_part_has_the_readings_of_the_whole() {
    let Some(data) = shared_data() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let bvh = Bvh::read(&data.join("mocap_cmu/13_36.bvh"));
    bvh.write(&folder.join("whole.bvh"), &bvh.frames);
    let whole = simulated(folder, "whole.bvh", &["--trim", "0"]);
    let part = simulated(folder, "whole.bvh", &["--start", "4", "--duration", "3"]);
    for (placement, part) in part {
        // 4 s at 100 Hz; with its ends.
        let same = &whole[&placement][400..];
        assert_eq!(
            part.len(),
            301,
            "{placement}: nothing is cut off a part's ends"
        );
        for columns in [0..3, 3..6] {
            let share = difference(&same[..part.len()], &part, columns);
            assert!(share < 1e-3, "{placement}: {share}");
        }
    }
}

/// Of several people, who come and go at times of their own, each is differentiated before the window is
/// cut out of their common clock.
#[test]
fn a_part_of_several_people_has_the_readings_of_the_whole() {
    let file = root().join("nodes/lib/motion/tests/data/poses/chain_wham.pkl");
    let file = file.to_str().unwrap();
    let read = |options: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let all = [&["--person", "all", "--trim", "0"], options].concat();
        simulated(folder.path(), file, &all)
    };
    let whole = read(&[]);
    // One is there from 0 to 2 s, the other from 0.2 to 1.833 s.
    for (start, seconds) in [("0.5", "0.8"), ("1", "10"), ("0", "0.7")] {
        let start_s: f64 = start.parse().unwrap();
        let parts = read(&["--start", start, "--duration", seconds]);
        assert_eq!(parts.len(), whole.len());
        for (name, part) in parts {
            let begins_s = if name.contains("person_3") { 0.2 } else { 0.0 };
            let gone_s = f64::max(start_s - begins_s, 0.0);
            let same = &whole[&name][(gone_s * 100.0).round() as usize..];
            for columns in [0..3, 3..6] {
                let share = difference(&same[..part.len()], &part, columns);
                assert!(share < 1e-3, "{name} from {start} s: {share}");
            }
        }
    }
    // Who has one frame in the window is left out of it.
    let late = read(&["--start", "1.82"]);
    assert!(late.len() == 5 && late.keys().all(|name| name.contains("person_0")));
    let folder = tempfile::tempdir().unwrap();
    for (start, duration) in [("5", "1"), ("0.51", "0.02")] {
        let window = ["--person", "all", "--start", start, "--duration", duration];
        let arguments = [&["simulate", file, "--out", "x.mcap"], &window[..]].concat();
        let there = "there are 0 from 0.000 to 2.000 s, 3 from 0.200 to 1.833 s";
        refuses(
            folder.path(),
            &arguments,
            &["chain_wham.pkl", &format!("start_s is {start}"), there],
        );
    }
    assert!(!folder.path().join("x.mcap").exists());
}

#[test]
fn clips_do_not_begin_or_end_with_a_jolt() {
    let Some(data) = shared_data() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut peaks = Vec::new();
    for name in ["02_01", "03_01", "06_10", "07_01", "13_07", "13_36"] {
        let bvh = Bvh::read(&data.join(format!("mocap_cmu/{name}.bvh")));
        bvh.write(&folder.join("whole.bvh"), &bvh.frames);
        let series = simulated(folder, "whole.bvh", &[]);
        peaks.extend(series.values().map(|readings| end_peak(readings)));
    }
    let jolts = peaks.iter().filter(|peak| **peak > 1.3).count();
    let most = peaks.iter().copied().fold(0.0, f64::max);
    println!(
        "{jolts} of {} series peak at an end, at most {most:.2}",
        peaks.len()
    );
    assert!(jolts == 0, "{jolts} {most}");
}
