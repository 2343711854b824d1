//! What cannot be is refused in one line, what hardly can be is a warning and is counted in what is
//! written; real motions pass.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::{self, File};
use std::path::Path;

use common::{cromosim_in, refuses, root, shared_data, succeed, text};
use cromosim_arrays::{NpzReader, NpzWriter};

/// `walk.npz` again, with each value of a key changed.
fn changed(folder: &Path, to: &str, key: &str, change: impl Fn(usize, f64) -> f64) {
    let from = folder.join("walk.npz");
    let mut npz = NpzReader::open(&from).unwrap();
    let mut writer = NpzWriter::new(File::create(folder.join(to)).unwrap());
    for name in ["poses", "trans", "betas", "mocap_framerate"] {
        let shape = npz.header(name).unwrap().unwrap().shape;
        let array = npz
            .floats(name, &vec![None; shape.len()], "numbers")
            .unwrap()
            .unwrap();
        let values: Vec<f64> = array
            .values
            .iter()
            .enumerate()
            .map(|(index, &value)| {
                if name == key {
                    change(index, value)
                } else {
                    value
                }
            })
            .collect();
        writer.floats(name, &array.shape, &values).unwrap();
    }
    writer.finish().unwrap();
}

fn walk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let bag = root().join("bags/walk").display().to_string();
    succeed(folder.path(), &["convert", &bag, "walk.npz"]);
    folder
}

#[test]
fn motions_that_nobody_makes_are_refused_everywhere() {
    let folder = walk();
    changed(folder.path(), "centimetres.npz", "trans", |_, value| {
        100.0 * value
    });
    changed(folder.path(), "millimetres.npz", "trans", |_, value| {
        1000.0 * value
    });
    changed(folder.path(), "jump.npz", "trans", |index, value| {
        if index >= 3 * 100 && index % 3 == 0 {
            value + 1000.0
        } else {
            value
        }
    });
    changed(folder.path(), "degrees.npz", "poses", |_, value| {
        value.to_degrees()
    });
    changed(folder.path(), "betas.npz", "betas", |_, _| 50.0);
    let cases: [(&str, &[&str]); 5] = [
        (
            "centimetres.npz",
            &["speed of the pelvis", "m/s", "centimetres"],
        ),
        (
            "millimetres.npz",
            &["speed of the pelvis", "impossible above", "metres"],
        ),
        ("jump.npz", &["speed of the pelvis", "frames 99 and 100"]),
        ("degrees.npz", &["rotation vector", "rad", "radians"]),
        ("betas.npz", &["shape coefficient 50", "impossible above"]),
    ];
    for (name, words) in cases {
        let words = [&[name], words].concat();
        refuses(
            folder.path(),
            &["simulate", name, "--out", "o.mcap"],
            &words,
        );
        refuses(folder.path(), &["convert", name, "o.bvh"], &words);
        let motion = format!("motion:={name}");
        refuses(
            folder.path(),
            &[
                "node",
                "replay",
                "--check-config",
                "--ros-args",
                "-p",
                &motion,
            ],
            &words,
        );
        assert!(!folder.path().join("o.mcap").exists() && !folder.path().join("o.bvh").exists());
    }
}

#[test]
fn what_is_unlikely_is_one_line_and_is_counted() {
    let folder = walk();
    changed(folder.path(), "hop.npz", "trans", |index, value| {
        if index >= 3 * 100 && index % 3 == 0 {
            value + 0.15
        } else {
            value
        }
    });
    fs::write(
        folder.path().join("off.yaml"),
        "schema: cromosim/placements/1\nplacements:\n  pocket: {point: [0.3, -0.42, 0.07], rate_hz: 100}\n",
    )
    .unwrap();
    let arguments = [
        "simulate",
        "hop.npz",
        "--placements",
        "off.yaml",
        "--out",
        "o.mcap",
    ];
    let output = cromosim_in(folder.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}", text(&output));
    let warnings: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("warning"))
        .collect();
    assert_eq!(warnings.len(), 1, "{said}");
    for part in [
        "hop.npz",
        "speed of the pelvis",
        "placement pocket",
        "nearest skin",
    ] {
        assert!(warnings[0].contains(part), "{part}: {said}");
    }
    let bytes = fs::read(folder.path().join("o.mcap")).unwrap();
    let bytes = String::from_utf8_lossy(&bytes);
    assert!(
        bytes.contains("2: speed of the pelvis"),
        "not in the metadata"
    );
    assert!(succeed(folder.path(), &["inspect", "hop.npz"]).contains("speed of the pelvis"));
    // A sound motion has no such entry and no warning.
    let output = cromosim_in(
        folder.path(),
        &["simulate", "walk.npz", "--out", "sound.mcap"],
    );
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{}",
        text(&output)
    );
    let bytes = fs::read(folder.path().join("sound.mcap")).unwrap();
    assert!(!String::from_utf8_lossy(&bytes).contains("unlikely"));
}

#[test]
fn placements_off_the_body_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, fields, words) in [
        (
            "mm.yaml",
            "point: [170, -420, 70]",
            ["point", "impossible above 0.20 m", "metres"],
        ),
        (
            "far.yaml",
            "point: [5, -0.42, 0.07]",
            ["point", "impossible above 0.20 m", "metres"],
        ),
        (
            "degrees.yaml",
            "site: left_watch, mount: {rotvec: [0, 0, 90]}",
            ["mount.rotvec", "90.00", "radians, not degrees"],
        ),
    ] {
        let yaml = format!(
            "schema: cromosim/placements/1\nplacements:\n  wrist: {{{fields}, rate_hz: 100}}\n"
        );
        fs::write(folder.path().join(name), yaml).unwrap();
        let words = [&["wrist"][..], &words].concat();
        refuses(
            folder.path(),
            &[
                "simulate",
                "--walk",
                "--placements",
                name,
                "--out",
                "o.mcap",
            ],
            &words,
        );
        let placements = format!("placements:={name}");
        refuses(
            folder.path(),
            &[
                "node",
                "virtual_imu",
                "--check-config",
                "--ros-args",
                "-p",
                &placements,
            ],
            &words,
        );
    }
}

#[test]
fn rigid_bodies_have_a_speed_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let row = |index: u32, step: f64| {
        format!(
            "{} {} 0 0 0 0 0 1\n",
            0.01 * f64::from(index),
            step * f64::from(index)
        )
    };
    let rows = |step| (0..200).map(|index| row(index, step)).collect::<String>();
    fs::write(folder.path().join("bullet.tum"), rows(24.0)).unwrap();
    fs::write(folder.path().join("rocket.tum"), rows(3.0)).unwrap();
    let arguments = |name| {
        [
            "simulate", "--rigid", name, "--rate", "100", "--out", "o.mcap",
        ]
    };
    refuses(
        folder.path(),
        &arguments("bullet.tum"),
        &["bullet.tum", "2400", "impossible above 1000 m/s"],
    );
    let output = cromosim_in(folder.path(), &arguments("rocket.tum"));
    assert!(
        output.status.success() && text(&output).contains("unlikely above 150 m/s"),
        "{}",
        text(&output)
    );
}

#[test]
fn real_motions_pass() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let samples = root().join("nodes/lib/motion/tests/data/poses");
    let places = [data.join("mocap_cmu"), samples, root().join("bags/walk")];
    let (mut motions, mut odd) = (0, Vec::new());
    for place in places {
        for entry in fs::read_dir(place).unwrap() {
            let path = entry.unwrap().path().display().to_string();
            let said = text(&cromosim_in(folder.path(), &["inspect", &path]));
            assert!(!said.contains("impossible"), "{said}");
            motions += usize::from(said.contains(": motion,"));
            odd.extend(said.contains("unlikely").then_some(said));
        }
    }
    assert!(motions >= 12, "{motions} motions");
    // Samples of random numbers, four to six frames long.
    assert!(odd.len() <= 3, "{odd:?}");
}
