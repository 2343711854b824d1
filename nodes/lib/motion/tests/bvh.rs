//! BVH files as tools write them, and as they are when something went wrong.
#![allow(clippy::unwrap_used)]

mod common;

use common::own_file;
use cromosim_motion::{BvhClip, Channel, MotionError, parse_bvh};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn read(name: &str) -> BvhClip {
    parse_bvh(&std::fs::read_to_string(own_file(name)).unwrap(), name).unwrap()
}

fn valid() -> String {
    std::fs::read_to_string(own_file("a_ok.bvh")).unwrap()
}

/// The one-line message of what is wrong with a text.
fn message(text: &str) -> String {
    let message = parse_bvh(text, "walk.bvh").unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

#[test]
fn all_variants_are_read() {
    for name in [
        "a_ok.bvh",
        "b_6ch.bvh",
        "c_tabs_crlf.bvh",
        "d_space_name.bvh",
        "e_brace_sameline.bvh",
    ] {
        let clip = read(name);
        assert_eq!(clip.joints().len(), 2, "{name}");
        assert_eq!(
            clip.joints()[1].tip,
            Some(Vector3::new(0.0, -43.0, 0.0)),
            "{name}"
        );
        assert_eq!(clip.rate_hz(), 120.0, "{name}");
        let thigh = clip.world_from_joints(0)[1].translation.vector;
        let hips = clip.world_from_joints(0)[0];
        assert!(
            (thigh - (hips.translation.vector + hips.rotation * Vector3::x() * 10.0)).norm()
                < 1e-12,
            "{name}"
        );
        assert_eq!(
            hips.translation.vector,
            Vector3::new(0.0, 90.0, 0.0),
            "{name}"
        );
    }
    assert_eq!(
        read("d_space_name.bvh").joints()[1].name,
        "mixamorig:Left UpLeg"
    );
    assert_eq!(
        read("b_6ch.bvh").joints()[1].channels[..2],
        [Channel::Position(0), Channel::Position(1)]
    );
    assert_eq!(read("c_tabs_crlf.bvh").frame(1)[8], 6e-5);
    let (plain, brace) = (read("a_ok.bvh"), read("e_brace_sameline.bvh"));
    assert_eq!(
        (plain.joints(), plain.frame(0)),
        (brace.joints(), brace.frame(0))
    );
}

#[test]
fn other_habits_are_read() {
    let text = valid()
        .to_lowercase()
        .trim_end()
        .replace("frames: 2", "FRAMES :2")
        .replace("offset", "\n OFFSET\n");
    let clip = parse_bvh(&format!("\u{feff}  \n{text}"), "walk.bvh").unwrap();
    assert_eq!(
        (clip.frame_count(), clip.joints()[0].name.as_str()),
        (2, "hips")
    );
    let any_order = valid()
        .replace("3 Zrotation Xrotation Yrotation", "2 Yrotation Zrotation")
        .replace("1 2 3 4 5 6", "1 2 3 4 5");
    assert_eq!(
        parse_bvh(&any_order, "walk.bvh").unwrap().joints()[1].channels,
        [Channel::Rotation(1), Channel::Rotation(2)]
    );
    let rounded = valid().replace("0.00833333", "0.033333");
    assert_eq!(parse_bvh(&rounded, "walk.bvh").unwrap().rate_hz(), 30.0);
}

/// Rz(1) Ry(2) Rx(3) for the root's `Zrotation Yrotation Xrotation`, computed by hand from sines
/// and cosines.
#[test]
fn rotations_multiply_in_the_order_of_the_channels() {
    let matrix = read("a_ok.bvh").world_from_joints(0)[0]
        .rotation
        .to_rotation_matrix();
    let [(sz, cz), (sy, cy), (sx, cx)] =
        [1.0_f64, 2.0, 3.0].map(|degrees: f64| degrees.to_radians().sin_cos());
    assert!((matrix[(2, 0)] + sy).abs() < 1e-12);
    assert!((matrix[(1, 0)] - sz * cy).abs() < 1e-12);
    assert!((matrix[(2, 1)] - cy * sx).abs() < 1e-12);
    assert!((matrix[(0, 1)] - (cz * sy * sx - sz * cx)).abs() < 1e-12);
}

#[test]
fn errors_name_file_line_expected_and_found() {
    let text = valid();
    let cases = [
        (
            text.replace("5 6\n", "5\n"),
            "walk.bvh, line 19: expected 9 channels, found 8",
        ),
        (
            text.replace("0 90 1 1 2", "0 90 nan 1 2"),
            "walk.bvh, line 20: value 3 is nan, expected a finite number below 1e9 in size",
        ),
        (
            text.replace("0 90 1 1 2", "0 90 -inf 1 2"),
            "walk.bvh, line 20: value 3 is -inf",
        ),
        (
            text.replace("0 90 1 1 2", "0 90 1e300 1 2"),
            "walk.bvh, line 20: value 3 is 1e300",
        ),
        (
            text.replace("0 90 1 1 2", "0 90 1,5 1 2"),
            "walk.bvh, line 20: expected a number, found \"1,5\"",
        ),
        (
            text.replace("Frames: 2", "Frames: 0"),
            "walk.bvh, line 17: expected Frames: and their number, at least 1, found \"Frames: 0\"",
        ),
        (
            text.replace("Frames: 2", "Frames: -1"),
            "walk.bvh, line 17: expected Frames:",
        ),
        (
            text.replace("Frames: 2", "Frames: 3"),
            "walk.bvh, line 20: expected 3 frames (as line 17 says), found 2",
        ),
        (
            text.replace("Frames: 2", "Frames: 1"),
            "walk.bvh, line 20: expected 1 frames (as line 17 says), found 2",
        ),
        (
            text.replace("0.00833333", "0"),
            "walk.bvh, line 18: expected Frame Time: and seconds from 0.00001 to 10, found \"Frame Time: 0\"",
        ),
        (
            text.replace("0.00833333", "-0.01"),
            "walk.bvh, line 18: expected Frame Time:",
        ),
        (
            text.replace("0.00833333", "NaN"),
            "walk.bvh, line 18: expected Frame Time:",
        ),
        (
            text.replace("MOTION\n", ""),
            "walk.bvh, line 16: expected MOTION or ROOT, found \"Frames:\"",
        ),
        (
            text.replace("HIERARCHY\n", ""),
            "walk.bvh, line 1: expected HIERARCHY, found \"ROOT\"",
        ),
        (
            text.replace("ROOT Hips\n", "ROOT\n"),
            "walk.bvh, line 3: expected the joint's name, found \"{\"",
        ),
        (
            text.replace("CHANNELS 6", "CHANNELS 7"),
            "walk.bvh, line 5: expected a number of channels from 0 to 6, found \"7\"",
        ),
        (
            text.replace("Xposition Yposition", "Xposition Xposition"),
            "walk.bvh, line 5: expected a channel, each once",
        ),
        (
            text.replace("Xposition", "Wposition"),
            "walk.bvh, line 5: expected a channel",
        ),
        (
            text.replace("OFFSET 10.0 0.0", "OFFSET 10.0 zero"),
            "walk.bvh, line 8: expected a number of OFFSET, found \"zero\"",
        ),
        (
            text.replace("OFFSET 10.0 0.0", "OFFSET inf 0.0"),
            "walk.bvh, line 8: value 1 is inf",
        ),
        (
            String::new(),
            "walk.bvh, line 1: expected HIERARCHY, found the end of the file",
        ),
        (
            "HIERARCHY\nMOTION\n".to_owned(),
            "walk.bvh, line 2: expected ROOT, found \"MOTION\"",
        ),
    ];
    for (text, expected) in cases {
        let found = message(&text);
        assert!(
            found.starts_with(expected),
            "expected {expected}\n   found {found}"
        );
    }
}

#[test]
fn a_truncated_file_is_an_error_wherever_it_ends() {
    let text = valid();
    let complete = text.trim_end().len();
    // The last number may lose digits unnoticed: a shorter number is a number.
    for end in 0..complete {
        let cut = &text[..end];
        match parse_bvh(cut, "walk.bvh") {
            Err(error) => assert!(error.to_string().starts_with("walk.bvh, line "), "{error}"),
            Ok(_) => assert!(
                complete - end < 2,
                "cut at {end} of {complete} is taken for whole"
            ),
        }
    }
}

#[test]
fn declared_sizes_take_no_memory() {
    let text = valid().replace("Frames: 2", "Frames: 18446744073709551615");
    assert!(matches!(
        parse_bvh(&text, "walk.bvh"),
        Err(MotionError::FrameCount { found: 2, .. })
    ));
    let deep: String = (0..3000)
        .map(|index| format!("JOINT j{index} {{ OFFSET 0 0 0 "))
        .collect();
    let error = message(&format!("HIERARCHY\nROOT r {{ OFFSET 0 0 0\n{deep}"));
    assert!(error.contains("more than 2048 joints"), "{error}");
    assert!(
        message(&valid().replace("CHANNELS 6", "CHANNELS 99999999999999999999"))
            .contains("channels from 0 to 6")
    );
}

/// Random damage to valid files: the parser returns, and what it accepts is sound.
#[test]
fn damaged_files_never_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let names = [
        "a_ok.bvh",
        "b_6ch.bvh",
        "c_tabs_crlf.bvh",
        "d_space_name.bvh",
        "e_brace_sameline.bvh",
    ];
    let files: Vec<Vec<u8>> = names
        .iter()
        .map(|name| std::fs::read(own_file(name)).unwrap())
        .collect();
    let pieces: [&[u8]; 12] = [
        b"{",
        b"}",
        b"JOINT x",
        b"End Site",
        b"nan",
        b"1e999",
        b"-",
        b"\n",
        b"CHANNELS 6",
        b"99999999999999999999",
        b"\xff\xfe",
        b"Frames: 0",
    ];
    let (mut accepted, rounds) = (0, 20_000);
    for _ in 0..rounds {
        let mut bytes = files[rng.random_range(0..files.len())].clone();
        for _ in 0..rng.random_range(1..6) {
            if bytes.is_empty() {
                break;
            }
            let at = rng.random_range(0..bytes.len());
            match rng.random_range(0..5) {
                0 => bytes[at] = rng.random_range(0..=255),
                1 => drop(bytes.remove(at)),
                2 => bytes.truncate(at.max(1)),
                3 => {
                    let piece = pieces[rng.random_range(0..pieces.len())];
                    bytes.splice(at..at, piece.iter().copied());
                }
                _ => {
                    let end = (at + rng.random_range(0..40)).min(bytes.len());
                    let copy = bytes[at..end].to_vec();
                    let to = rng.random_range(0..bytes.len());
                    bytes.splice(to..to, copy);
                }
            }
        }
        if let Ok(clip) = parse_bvh(&String::from_utf8_lossy(&bytes), "damaged.bvh") {
            accepted += 1;
            assert!(clip.frame_count() > 0 && clip.frame(0).iter().all(|value| value.is_finite()));
            assert!(
                clip.joints()
                    .iter()
                    .enumerate()
                    .all(|(index, joint)| joint.parent.is_none_or(|parent| parent < index))
            );
            assert_eq!(
                clip.world_from_joints(usize::MAX).len(),
                clip.joints().len()
            );
        }
    }
    println!("{accepted} of {rounds} damaged files are still BVH files");
    assert!(accepted > 0 && accepted < rounds);
}
