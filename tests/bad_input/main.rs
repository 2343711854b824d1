//! Bad input: one line that names file and place, exit code 2, and nothing half-written.
#![allow(clippy::unwrap_used)]

mod commands;
#[path = "../common/mod.rs"]
mod common;
mod diagnoses;
mod nodes;
mod slips;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

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
    names_no_internals(&error);
    assert_eq!(
        listing(folder),
        before,
        "{arguments:?} left something behind"
    );
}

/// Users know no types, functions or modules of the source.
fn names_no_internals(error: &str) {
    for internal in [
        "panicked", "::", "struct ", "enum ", "unwrap", "Some(", "Err(",
    ] {
        assert!(!error.contains(internal), "'{internal}' in: {error}");
    }
    let mut words = error.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
    let type_name = words.find(|word| types_of_the_source().contains(*word));
    assert_eq!(type_name, None, "{error}");
}

/// Types of more than one word, which no message means otherwise.
fn types_of_the_source() -> &'static BTreeSet<String> {
    static TYPES: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
        let has_words = |name: &str| name.chars().skip(1).any(char::is_uppercase);
        let mut types = BTreeSet::new();
        for file in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("nodes")) {
            let text = fs::read_to_string(file).unwrap();
            let after = |word: &'static str| text.split(word).skip(1);
            types.extend(
                after("struct ")
                    .chain(after("enum "))
                    .filter_map(|rest| rest.split(|letter: char| !letter.is_alphanumeric()).next())
                    .filter(|name| name.starts_with(char::is_uppercase) && has_words(name))
                    .map(str::to_owned),
            );
        }
        assert!(types.contains("PlacementRecord"));
        types
    });
    &TYPES
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
