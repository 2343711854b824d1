//! The front page stays a page, and what ARCHITECTURE.md names is there.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::root;

/// Lines that the front README may have.
const FRONT_PAGE_LINES: usize = 150;

#[test]
fn the_front_page_is_a_page() {
    let lines = fs::read_to_string(root().join("README.md"))
        .unwrap()
        .lines()
        .count();
    assert!(
        lines <= FRONT_PAGE_LINES,
        "README.md has {lines} lines; what is about one crate belongs into its README"
    );
}

/// A path within the repository, rather than a name, a command or a pattern (`NAME`, `*`).
fn is_path(code: &str) -> bool {
    let folders = [
        "nodes/",
        "msgs/",
        "config/",
        "launch_scripts/",
        "tests/",
        "bags/",
        ".ci/",
    ];
    folders.iter().any(|folder| code.starts_with(folder))
        && !code.contains(char::is_whitespace)
        && !code.contains("NAME")
        && !code.contains('*')
}

#[test]
fn architecture_names_what_is_there() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let paths: Vec<&str> = text
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|code| is_path(code))
        .collect();
    assert!(paths.len() > 30, "only {} paths are named", paths.len());
    let missing: Vec<&&str> = paths
        .iter()
        .filter(|path| !root().join(path).exists())
        .collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names {missing:?}");
}
