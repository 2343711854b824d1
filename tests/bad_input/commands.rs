//! Motion files, settings and modes of the offline commands.

use std::fs;

use crate::common::TINY_BVH;
use crate::refuses;

#[test]
fn motion_files() {
    let folder = tempfile::tempdir().unwrap();
    let truncated = &TINY_BVH[..TINY_BVH.len() - 30];
    let cases = [
        (
            "truncated.bvh",
            truncated.to_owned(),
            vec!["truncated.bvh", "line"],
        ),
        (
            "cut_header.bvh",
            TINY_BVH[..120].to_owned(),
            vec!["cut_header.bvh", "line"],
        ),
        (
            "nan.bvh",
            TINY_BVH.replace("0 90 0 0 0 0 0 0 0\n0", "0 90 0 nan 0 0 0 0 0\n0"),
            vec!["nan.bvh", "line 19"],
        ),
        (
            "channels.bvh",
            TINY_BVH.replace("0 90 0 0 0 0 0 0 0\n0", "0 90 0 0 0 0 0 0\n0"),
            vec!["channels.bvh", "line 19", "9", "8"],
        ),
        (
            "no_frames.bvh",
            TINY_BVH.replace("Frames: 2", "Frames: 0"),
            vec!["no_frames.bvh", "line 17"],
        ),
        (
            "backwards.bvh",
            TINY_BVH.replace("Frame Time: 0.01", "Frame Time: -0.01"),
            vec!["backwards.bvh", "line 18"],
        ),
        ("no_body.bvh", TINY_BVH.to_owned(), vec!["no_body.bvh"]),
        ("text.bvh", "what is this".to_owned(), vec!["text.bvh"]),
        ("empty.bvh", String::new(), vec!["empty.bvh"]),
    ];
    for (name, content, _) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
    }
    for (name, _, expected) in &cases {
        refuses(
            folder.path(),
            &["simulate", name, "--out", "out.mcap"],
            expected,
        );
        refuses(folder.path(), &["inspect", name], expected);
        refuses(
            folder.path(),
            &[
                "node",
                "replay",
                "--check-config",
                "--ros-args",
                "-p",
                &format!("motion:={name}"),
            ],
            expected,
        );
    }
    refuses(
        folder.path(),
        &["simulate", "missing.bvh", "--out", "out.mcap"],
        &["missing.bvh"],
    );
    refuses(
        folder.path(),
        &["demo", "--motion", "nan.bvh"],
        &["nan.bvh", "line 19"],
    );
    fs::create_dir(folder.path().join("folder.bvh")).unwrap();
    refuses(
        folder.path(),
        &["simulate", "folder.bvh", "--out", "out.mcap"],
        &["folder.bvh"],
    );
}

#[test]
fn placements_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let file = |fields: &str| {
        format!("schema: cromosim/placements/1\nplacements:\n  wrist: {{{fields}}}\n")
    };
    let cases = [
        (
            "site.yaml",
            file("site: left_toe_ring, rate_hz: 100"),
            vec!["left_toe_ring", "wrist"],
        ),
        (
            "mount.yaml",
            file(
                "site: left_watch, rate_hz: 100, mount: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}",
            ),
            vec!["mount.yaml", "wrist", "mount"],
        ),
        (
            "rate.yaml",
            file("site: left_watch, rate_hz: -5"),
            vec!["rate.yaml", "wrist", "rate_hz"],
        ),
        (
            "unknown.yaml",
            file("site: left_watch, rate_hz: 100, colour: red"),
            vec!["unknown.yaml", "wrist", "colour"],
        ),
        (
            "none.yaml",
            "schema: cromosim/placements/1\nplacements: {}\n".to_owned(),
            vec!["none.yaml", "placements"],
        ),
        ("yaml.yaml", "placements: [".to_owned(), vec!["yaml.yaml"]),
    ];
    for (name, content, expected) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
        refuses(
            folder.path(),
            &[
                "simulate",
                "--walk",
                "--placements",
                name,
                "--out",
                "out.mcap",
            ],
            expected,
        );
        refuses(
            folder.path(),
            &[
                "node",
                "virtual_imu",
                "--check-config",
                "--ros-args",
                "-p",
                &format!("placements:={name}"),
            ],
            expected,
        );
    }
    refuses(
        folder.path(),
        &["simulate", "--walk", "--rate", "-5", "--out", "out.mcap"],
        &["--rate", "-5"],
    );
    refuses(
        folder.path(),
        &["simulate", "--walk", "--rate", "1e9", "--out", "out.mcap"],
        &["--rate", "100000"],
    );
    refuses(
        folder.path(),
        &[
            "simulate", "--walk", "--scheme", "guess", "--out", "out.mcap",
        ],
        &["guess", "spline"],
    );
    refuses(
        folder.path(),
        &[
            "simulate",
            "--walk",
            "--body",
            "nobody.npz",
            "--out",
            "out.mcap",
        ],
        &["nobody.npz"],
    );
    refuses(
        folder.path(),
        &["simulate", "--walk", "--out", "missing/out.mcap"],
        &["missing"],
    );
}

#[test]
fn options_of_another_mode_of_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let reference = ["simulate", "--reference", "r.mcap", "--out", "out.mcap"];
    let rigid = [
        "simulate", "--rigid", "r.tum", "--rate", "100", "--out", "out.mcap",
    ];
    let of_motions: [&[&str]; 14] = [
        &["--placements", "p.yaml"],
        &["--csv", "csv"],
        &["--pose-error-correlation", "1"],
        &["--unit", "0.01"],
        &["--start", "1"],
        &["--duration", "1"],
        &["--skeleton", "s.asf"],
        &["--motion-rate", "60"],
        &["--marker-set", "plug_in_gait"],
        &["--subject", "anna"],
        &["--placements-as-given"],
        &["--person", "1"],
        &["--shape", "mean"],
        &["--source-body", "b.npz"],
    ];
    for option in of_motions {
        for (mode, name) in [(&reference[..], "--reference"), (&rigid[..], "--rigid")] {
            refuses(
                folder.path(),
                &[mode, option].concat(),
                &[option[0], "goes with motion files", name],
            );
        }
    }
    let motions = ["simulate", "--walk", "--out", "out.mcap"];
    let nothing = ["simulate", "--out", "out.mcap"];
    refuses(folder.path(), &nothing, &["no motion file", "--walk"]);
    let cases: [(&[&str], &[&str], &str); 12] = [
        (&nothing, &["--walk", "walk.bvh"], "leave one of them out"),
        (&rigid, &["--walk"], "not with --rigid"),
        (&motions, &["--placement", "wrist"], "NAME=SITE"),
        (&motions, &["--effects", "e.yaml"], "not with motion files"),
        (
            &reference,
            &["--placement", "wrist"],
            "not with --reference",
        ),
        (&reference, &["--up-axis", "z"], "not with --reference"),
        (&reference, &["--device", "d.yaml"], "not with --reference"),
        (&reference, &["--learned", "video"], "not with --reference"),
        (&reference, &["--mapping", "m.yaml"], "not with --reference"),
        (&reference, &["--rigid", "r.tum"], "give one of them"),
        (&rigid, &["--body", "b.npz"], "not with --rigid"),
        (&rigid, &["walk.bvh"], "--rigid"),
    ];
    for (mode, option, expected) in cases {
        refuses(
            folder.path(),
            &[mode, option].concat(),
            &[option[0], expected],
        );
    }
    refuses(
        folder.path(),
        &["simulate", "--rigid", "r.tum", "--out", "out.mcap"],
        &["--rate"],
    );
    refuses(
        folder.path(),
        &[&rigid[..], &["--device", "d.yaml", "--effects", "e.yaml"]].concat(),
        &["--device", "--effects"],
    );
}

/// A named pipe into which nobody writes: reading it would wait for ever.
#[test]
fn pipes_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo")
        .arg(&pipe)
        .status()
        .unwrap();
    assert!(made.success());
    let commands: [&[&str]; 14] = [
        &["inspect", "pipe"],
        &["convert", "pipe", "o.bvh"],
        &["simulate", "pipe", "--out", "o.mcap"],
        &[
            "simulate",
            "--walk",
            "--placements",
            "pipe",
            "--out",
            "o.mcap",
        ],
        &["simulate", "--walk", "--body", "pipe", "--out", "o.mcap"],
        &["simulate", "--walk", "--mapping", "pipe", "--out", "o.mcap"],
        &[
            "simulate", "--rigid", "pipe", "--rate", "50", "--out", "o.mcap",
        ],
        &["simulate", "--reference", "pipe", "--out", "o.mcap"],
        &["diagnose", "pipe", "--out", "o"],
        &["diagnose", "pipe", "--out", "o", "--config", "pipe"],
        &["compare", "pipe", "pipe"],
        &["bag", "csv", "pipe", "/imu/head/data_raw"],
        &["bag", "recover", "pipe"],
        &["train", "pipe", "--out", "o"],
    ];
    for arguments in commands {
        let output = std::process::Command::new("timeout")
            .args(["60", crate::common::CROMOSIM])
            .args(arguments)
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            said.contains("pipe: ") && said.contains("a pipe or device"),
            "{arguments:?}: {said}"
        );
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    }
}
