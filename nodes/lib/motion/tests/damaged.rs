//! Random damage to files of every format: the parsers return, and what they accept is sound and no
//! larger than the file allows.
//!
//! Bounds on memory, by the code: a BVH or AMC value is a word of the text; an ASF file has at most
//! 2048 bones and as many children; a C3D point takes at least 8 bytes of the file and 32 in
//! memory; a TRC file may not have more points than bytes.
#![allow(clippy::unwrap_used)]

mod common;

use common::acclaim::{Acclaim, cmu_bones};
use common::known::{joint_shift, rest, y_up};
use common::marker_files::{Kind, c3d, trc};
use common::own_file;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{
    AMC_RATE_HZ, MarkerClip, MotionFormat, embedded_walk, parse_amc, parse_asf, parse_bvh,
    parse_c3d, parse_trc,
};
use nalgebra::Point3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rounds a format; the long form is what was run before a release.
fn rounds() -> usize {
    std::env::var("CROMOSIM_DAMAGE_ROUNDS")
        .ok()
        .and_then(|rounds| rounds.parse().ok())
        .unwrap_or(5_000)
}

const PIECES: [&[u8]; 14] = [
    b"nan",
    b"1e999",
    b"-",
    b"\n",
    b"\t",
    b"99999999999999999999",
    b"\xff\xfe",
    b"\xff\xff\xff\xff",
    b"\x00\x00",
    b":root",
    b"begin\n",
    b"end\n",
    b"root ",
    b"65535",
];

fn damaged(rng: &mut impl Rng, sample: &[u8]) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..rng.random_range(1..6) {
        if bytes.is_empty() {
            break;
        }
        // Headers are where the declared sizes are.
        let end = if rng.random_bool(0.5) {
            bytes.len()
        } else {
            bytes.len().min(1200)
        };
        let at = rng.random_range(0..end);
        match rng.random_range(0..5) {
            0 => bytes[at] = rng.random_range(0..=255),
            1 => drop(bytes.remove(at)),
            2 => bytes.truncate(at.max(1)),
            3 => {
                let piece = PIECES[rng.random_range(0..PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
            _ => {
                let copy = bytes[at..(at + rng.random_range(0..40)).min(bytes.len())].to_vec();
                let to = rng.random_range(0..bytes.len());
                bytes.splice(to..to, copy);
            }
        }
    }
    bytes
}

/// Runs `accepts` on damaged copies; it says whether the parser took a copy, after checking what
/// came out.
fn run(name: &str, samples: &[Vec<u8>], accepts: impl Fn(&[u8]) -> bool) {
    let (mut rng, rounds) = (ChaCha8Rng::seed_from_u64(17), rounds());
    let mut accepted = 0;
    for round in 0..rounds {
        let bytes = damaged(&mut rng, &samples[round % samples.len()]);
        let _ = MotionFormat::of(&bytes);
        accepted += usize::from(accepts(&bytes));
    }
    println!("{name}: {accepted} of {rounds} damaged files are still accepted");
    assert!(
        accepted > 0 && accepted < rounds,
        "{name}: {accepted} of {rounds}"
    );
}

fn clip() -> MarkerClip {
    let frames = (0..3)
        .map(|frame| {
            (0..4)
                .map(|marker| Some(Point3::new(1.0, f64::from(frame), f64::from(marker))))
                .collect()
        })
        .collect();
    let labels = ["A:a", "A:b", "c", "d"].map(str::to_owned).to_vec();
    MarkerClip {
        name: "made".to_owned(),
        rate_hz: 100.0,
        unit_scale_m: 0.001,
        labels,
        frames,
    }
}

fn is_sound(clip: &MarkerClip, bytes: usize) -> bool {
    let points: usize = clip.frames.iter().map(Vec::len).sum();
    assert!(
        points <= bytes
            && !clip.frames.is_empty()
            && clip
                .frames
                .iter()
                .all(|frame| frame.len() == clip.labels.len())
    );
    assert!(
        clip.frames
            .iter()
            .flatten()
            .flatten()
            .all(|point| point.coords.iter().all(|value| value.is_finite()))
    );
    assert!(clip.rate_hz > 0.0 && clip.labels_of(None).is_ok() == (clip.subjects().len() < 2));
    true
}

#[test]
fn bvh() {
    let samples: Vec<Vec<u8>> = ["a_ok.bvh", "b_6ch.bvh", "c_tabs_crlf.bvh"]
        .iter()
        .map(|name| std::fs::read(own_file(name)).unwrap())
        .collect();
    run("BVH", &samples, |bytes| {
        let clip = parse_bvh(&String::from_utf8_lossy(bytes), "damaged.bvh");
        clip.is_ok_and(|clip| clip.frame(0).iter().all(|value| value.is_finite()))
    });
}

#[test]
fn asf_and_amc() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let (joint_shift, rest) = (joint_shift(), rest(0.0, 0.0, 20.0, 0.0));
    let acclaim = Acclaim {
        bones: cmu_bones(),
        body: &body,
        joint_shift,
        rest,
        unit_m: 0.0254 / 0.45,
        degrees: true,
    };
    let (asf, amc) = (
        acclaim.asf(),
        acclaim.amc(&embedded_walk().frames[..2], y_up()),
    );
    run("ASF", &[asf.clone().into_bytes()], |bytes| {
        let skeleton = parse_asf(&String::from_utf8_lossy(bytes), "damaged.asf");
        skeleton.is_ok_and(|skeleton| {
            assert!(
                skeleton
                    .bones
                    .iter()
                    .enumerate()
                    .all(|(index, bone)| bone.parent.is_none_or(|parent| parent < index))
            );
            let _ = parse_amc(&amc, "whole.amc", &skeleton, AMC_RATE_HZ);
            true
        })
    });
    let skeleton = parse_asf(&asf, "whole.asf").unwrap();
    run("AMC", &[amc.clone().into_bytes()], |bytes| {
        let clip = parse_amc(
            &String::from_utf8_lossy(bytes),
            "damaged.amc",
            &skeleton,
            AMC_RATE_HZ,
        );
        clip.is_ok_and(|clip| {
            let last = clip.world_from_joints(usize::MAX);
            clip.frame_count() > 0
                && last
                    .iter()
                    .all(|frame| frame.translation.vector.norm().is_finite())
        })
    });
}

#[test]
fn c3d_files() {
    let mut samples: Vec<Vec<u8>> = ["ez.c3d", "pyc3d.c3d"]
        .iter()
        .map(|name| std::fs::read(own_file(name)).unwrap())
        .collect();
    samples.extend(
        [Kind::DecFloat, Kind::MipsInteger, Kind::IntelInteger].map(|kind| c3d(&clip(), kind, 2)),
    );
    run("C3D", &samples, |bytes| {
        parse_c3d(bytes, "damaged.c3d").is_ok_and(|clip| is_sound(&clip, bytes.len()))
    });
}

#[test]
fn trc_files() {
    run("TRC", &[trc(&clip()).into_bytes()], |bytes| {
        // What stands for invalid bytes is longer than they are.
        parse_trc(&String::from_utf8_lossy(bytes), "damaged.trc")
            .is_ok_and(|clip| is_sound(&clip, 3 * bytes.len()))
    });
}
