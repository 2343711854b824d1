//! What happens when nobody takes what a command prints: a reader that has gone away ends it
//! quietly, an output that cannot be written is one line and an exit code.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::File;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::{CROMOSIM, TINY_BVH, root, succeed};

/// Every command that prints and needs no network; `OUT` is a new name for each run.
const PRINTING: [&[&str]; 14] = [
    &["--help"],
    &["completion", "bash"],
    &["inspect", "REPO/bags/gap/session", "REPO/bags/walk"],
    &["bag", "csv", "REPO/bags/walk", "/imu/head/data_raw"],
    &[
        "bag",
        "recover",
        "REPO/bags/walk/walk_0.mcap",
        "--out",
        "OUT.mcap",
    ],
    &["body", "export", "OUT.obj"],
    &["compare", "REPO/bags/walk", "REPO/bags/walk"],
    &["convert", "REPO/bags/walk", "OUT.bvh"],
    &["simulate", "--walk", "--duration", "1", "--out", "OUT.mcap"],
    &[
        "simulate",
        "--reference",
        "REPO/bags/gap/session",
        "--out",
        "OUT.mcap",
    ],
    &["diagnose", "REPO/bags/gap/session", "--out", "OUT"],
    &["node", "--help"],
    &["node", "replay", "--help"],
    &["node", "replay", "--check-config"],
];

fn run(folder: &Path, arguments: &[&str], name: &str, stdout: Stdio) -> Output {
    let repository = root().display().to_string();
    let arguments = arguments
        .iter()
        .map(|argument| argument.replace("REPO", &repository).replace("OUT", name));
    Command::new(CROMOSIM)
        .args(arguments)
        .current_dir(folder)
        .stdout(stdout)
        .output()
        .unwrap()
}

/// A pipe that nobody reads.
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[test]
fn a_closed_pipe_ends_every_command_quietly() {
    let folder = tempfile::tempdir().unwrap();
    for (index, arguments) in PRINTING.iter().enumerate() {
        let output = run(
            folder.path(),
            arguments,
            &format!("closed_{index}"),
            closed_pipe(),
        );
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success(),
            "{arguments:?}: {} {said}",
            output.status
        );
        assert!(
            !said.contains("error") && !said.contains("panicked"),
            "{arguments:?}: {said}"
        );
    }
    // What was asked for is there all the same.
    for name in [
        "closed_4.mcap",
        "closed_5.obj",
        "closed_7.bvh",
        "closed_8.mcap",
        "closed_9.mcap",
    ] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
    assert!(folder.path().join("closed_10/diagnosis.json").exists());
}

#[test]
fn an_output_that_cannot_be_written_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (index, arguments) in PRINTING.iter().enumerate().skip(1) {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let output = run(
            folder.path(),
            arguments,
            &format!("full_{index}"),
            full.into(),
        );
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        let errors: Vec<&str> = said
            .lines()
            .filter(|line| line.starts_with("error"))
            .collect();
        assert!(
            errors.len() == 1
                && errors[0].contains("standard output")
                && errors[0].contains("No space left")
                && !said.contains("panicked"),
            "{arguments:?}: {said}"
        );
    }
}

#[test]
fn errors_do_not_need_a_reader() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tiny.bvh"), TINY_BVH).unwrap();
    let mut command = Command::new(CROMOSIM);
    command
        .args(["inspect", "tiny.bvh"])
        .current_dir(folder.path());
    let status = command.stderr(closed_pipe()).status().unwrap();
    assert_eq!(status.code(), Some(2));
    // And a remark that nobody reads stops nothing.
    succeed(
        folder.path(),
        &[
            "convert",
            &root().join("bags/walk").display().to_string(),
            "walk.bvh",
        ],
    );
}
