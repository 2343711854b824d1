//! Bad input: one line that names file and place, exit code 2, and nothing half-written.
#![allow(clippy::unwrap_used)]

mod commands;
#[path = "../common/mod.rs"]
mod common;
mod diagnoses;
mod nodes;
mod slips;

use std::fs;
use std::path::Path;

use common::cromosim_in;

/// Runs the command, which must fail as the rules say; `expected` are parts of its one line.
fn refuses(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let before = listing(folder);
    let output = cromosim_in(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
    assert_eq!(
        error.trim_end().lines().count(),
        1,
        "{arguments:?} says more than a line: {error}"
    );
    for part in expected {
        assert!(
            error.contains(part),
            "{arguments:?}: '{part}' is not in: {error}"
        );
    }
    assert!(!error.contains("panicked"), "{error}");
    assert_eq!(
        listing(folder),
        before,
        "{arguments:?} left something behind"
    );
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
