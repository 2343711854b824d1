//! The same seconds of a recorded motion give the same readings, whatever was recorded before and
//! after them: three seconds cut out of a file, against the same seconds of the whole.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::{shared_data, succeed};

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

/// Readings of every placement.
fn simulated(folder: &Path, motion: &str) -> BTreeMap<String, Vec<Reading>> {
    let scheme = "adaptive_spline";
    let arguments = [
        "simulate",
        motion,
        "--out",
        "out.mcap",
        "--csv",
        "csv",
        "--no-noise",
        "--scheme",
        scheme,
    ];
    succeed(folder, &[&arguments[..], &["--force"]].concat());
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
        let whole = simulated(folder, "whole.bvh");
        for part in [1, 3] {
            let steps = (bvh.frames.len() - CUT_FRAMES) * part / 4 / FRAMES;
            let first = steps * FRAMES;
            bvh.write(
                &folder.join("cut.bvh"),
                &bvh.frames[first..first + CUT_FRAMES],
            );
            for (placement, cut) in simulated(folder, "cut.bvh") {
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
