//! Files that commands write: whole or not at all, and nothing is replaced without `--force`.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::{CROMOSIM, root, text};

/// Runs `cromosim` where no file can grow beyond so many KiB, as on a disk that is nearly full.
fn on_a_small_disk(folder: &Path, kibibytes: u32, arguments: &[&str]) -> Output {
    // The signal that comes with the limit is ignored; what is left is an error of writing.
    let script = format!("trap '' XFSZ; ulimit -f {kibibytes}; exec \"$0\" \"$@\"");
    Command::new("bash")
        .args(["-c", &script, CROMOSIM])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Names of all files in a folder, hidden ones as well.
fn listing(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn what_cannot_be_written_whole_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let bag = root().join("bags/walk").display().to_string();
    let session = root().join("bags/gap/session").display().to_string();
    let commands: [&[&str]; 7] = [
        &[
            "bag",
            "csv",
            &bag,
            "/imu/head/data_raw",
            "--out",
            "head.csv",
        ],
        &["body", "export", "body.npz"],
        &["body", "export", "body.obj"],
        &["convert", &bag, "walk.bvh"],
        &["simulate", "--walk", "--out", "walk.mcap"],
        &["completion", "bash", "--out", "completion"],
        &["diagnose", &session, "--out", "diagnosis"],
    ];
    for arguments in commands {
        let output = on_a_small_disk(folder.path(), 4, arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {}",
            text(&output)
        );
        assert_eq!(said.trim_end().lines().count(), 1, "{arguments:?}: {said}");
        assert!(said.contains("File too large"), "{arguments:?}: {said}");
        assert_eq!(listing(folder.path()), [""; 0], "{arguments:?}");
    }
}

#[test]
fn a_diagnosis_that_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let session = root().join("bags/gap/session").display().to_string();
    let output = on_a_small_disk(folder.path(), 4, &["diagnose", &session, "--out", "d"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.contains("right_wrist: ") && said.contains("time_offset"),
        "{said}"
    );
}

#[test]
fn a_signal_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let motion = folder.path().join("walk.mcap");
    let motion = motion.display().to_string();
    common::succeed(
        folder.path(),
        &["simulate", "--walk", "--rate", "20000", "--out", &motion],
    );
    let before = listing(folder.path());
    let mut child = Command::new(CROMOSIM)
        .args([
            "bag",
            "csv",
            &motion,
            "/imu/head/data_raw",
            "--out",
            "head.csv",
        ])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    // Once the file under its temporary name is there.
    while listing(folder.path()) == before && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    let status = child.wait().unwrap();
    assert!(kill.success() && status.code() == Some(2), "{status}");
    assert_eq!(listing(folder.path()), before);
}

#[test]
fn nothing_is_replaced_without_force() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = |name: &str| root().join(name).display().to_string();
    let (walk, session) = (path("bags/walk"), path("bags/gap/session"));
    let walk_file = path("bags/walk/walk_0.mcap");
    common::succeed(here, &["simulate", "--walk", "--out", "s.mcap"]);
    common::succeed(here, &["convert", &walk, "w.tum", "--site", "left_watch"]);
    // What is there already, and the command that would replace it.
    let cases: [(&str, &[&str]); 13] = [
        (
            "simulated.mcap",
            &["simulate", "--walk", "--out", "simulated.mcap"],
        ),
        (
            "again.mcap",
            &["simulate", "--reference", &session, "--out", "again.mcap"],
        ),
        (
            "rigid.mcap",
            &[
                "simulate",
                "--rigid",
                "w.tum",
                "--rate",
                "50",
                "--out",
                "rigid.mcap",
            ],
        ),
        (
            "csv/new_head.csv",
            &["simulate", "--walk", "--out", "new.mcap", "--csv", "csv"],
        ),
        (
            "diagnosis/effects.yaml",
            &["diagnose", &session, "--out", "diagnosis"],
        ),
        (
            "compared.json",
            &["compare", &walk, &walk, "--out", "compared.json"],
        ),
        ("walk.bvh", &["convert", &walk, "walk.bvh"]),
        (
            "map.yaml",
            &[
                "map",
                "--simulated",
                "s.mcap",
                "--measured",
                &walk,
                "--out",
                "map.yaml",
            ],
        ),
        (
            "fidelity/results.json",
            &["evaluate", "fidelity", "--out", "fidelity"],
        ),
        (
            "head.csv",
            &[
                "bag",
                "csv",
                &walk,
                "/imu/head/data_raw",
                "--out",
                "head.csv",
            ],
        ),
        (
            "mended.mcap",
            &["bag", "recover", &walk_file, "--out", "mended.mcap"],
        ),
        ("body.obj", &["body", "export", "body.obj"]),
        ("done", &["completion", "bash", "--out", "done"]),
    ];
    common::succeed(here, &["convert", &walk, "w.bvh"]);
    for (name, arguments) in cases {
        let place = here.join(name);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::write(&place, "mine").unwrap();
        let before = listing(here);
        let said = ["exists already", "--force", name];
        common::refuses(here, arguments, &said);
        assert_eq!(fs::read_to_string(&place).unwrap(), "mine", "{arguments:?}");
        assert_eq!(listing(here), before, "{arguments:?}");
        // An evaluation takes minutes, and needs data.
        if arguments[0] != "evaluate" {
            common::succeed(here, &[arguments, &["--force"]].concat());
            assert_ne!(fs::read(&place).unwrap(), b"mine", "{arguments:?}");
        }
    }
    // A device is written into, and stays one.
    common::succeed(
        here,
        &[
            "bag",
            "csv",
            &walk,
            "/imu/head/data_raw",
            "--out",
            "/dev/null",
        ],
    );
    assert!(!Path::new("/dev/null").is_file());
    // A demo takes the place of the one before it in its own folder alone.
    fs::create_dir_all(here.join("mine/bag")).unwrap();
    let demo = ["demo", "--duration", "0.1", "--out", "mine"];
    common::refuses(here, &demo, &["mine/bag", "exists already", "--force"]);
}

/// What 1.7 million messages would not fit into where they were all made before any is written.
#[test]
fn many_samples_take_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    let placements = root().join("config/placements/full17.yaml");
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 500000 && exec \"$@\"", "sh"])
        .arg(CROMOSIM)
        .args([
            "simulate",
            "--walk",
            "--rate",
            "5000",
            "--out",
            "many.mcap",
            "--placements",
        ])
        .arg(placements)
        // Each thread reserves addresses.
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    assert!(text(&output).contains("17 placements"), "{}", text(&output));
    // What was put aside is gone.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
