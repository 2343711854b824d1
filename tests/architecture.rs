//! The house keeps its walls: who may name which crate, and which way imports run
//! (ARCHITECTURE.md).
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every manifest of the workspace by its folder, relative to the root.
fn manifests() -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for folder in ["nodes/lib", "nodes/bin"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if let Ok(text) = fs::read_to_string(path.join("Cargo.toml")) {
                found.insert(
                    format!("{folder}/{}", path.file_name().unwrap().to_string_lossy()),
                    text,
                );
            }
        }
    }
    for (name, path) in [("msgs", "msgs/Cargo.toml"), (".", "Cargo.toml")] {
        found.insert(
            name.to_owned(),
            fs::read_to_string(root().join(path)).unwrap(),
        );
    }
    found
}

/// The names under `[dependencies]`, without dev-dependencies and the workspace's own table.
fn dependencies(manifest: &str) -> Vec<String> {
    let mut section = String::new();
    let mut names = Vec::new();
    for line in manifest.lines() {
        let line = line.trim();
        if line.starts_with('[') {
            section = line.to_owned();
        } else if section == "[dependencies]" && !line.is_empty() && !line.starts_with('#') {
            let end = line.find(['.', ' ', '=']).unwrap_or(line.len());
            names.push(line[..end].to_owned());
        }
    }
    names
}

#[test]
fn only_one_crate_names_each_wire_library() {
    let owners = [
        ("ros2-client", "nodes/lib/ros"),
        ("rustdds", "nodes/lib/ros"),
        ("mcap", "nodes/lib/bag"),
        ("re_sdk", "nodes/lib/view"),
    ];
    for (folder, manifest) in manifests() {
        for name in dependencies(&manifest) {
            for (library, owner) in owners {
                assert!(
                    name != library || folder == owner,
                    "{folder} depends on {library}; only {owner} may"
                );
            }
        }
    }
}

#[test]
fn imports_run_one_way() {
    let allowed: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("msgs", &[] as &[&str]),
        ("nodes/lib/arrays", &[]),
        ("nodes/lib/charts", &[]),
        ("nodes/lib/spatial", &[]),
        ("nodes/lib/body", &["spatial", "arrays"]),
        ("nodes/lib/motion", &["spatial", "body", "arrays"]),
        ("nodes/lib/imu", &["spatial", "body"]),
        ("nodes/lib/learned", &["spatial", "body", "imu", "arrays"]),
        ("nodes/lib/gap", &["spatial", "imu", "charts"]),
        ("nodes/lib/bag", &["msgs", "spatial"]),
        ("nodes/lib/ros", &["msgs", "spatial"]),
        ("nodes/lib/view", &["spatial"]),
    ]);
    for (folder, manifest) in manifests() {
        let Some(&may) = allowed.get(folder.as_str()) else {
            assert!(
                folder.starts_with("nodes/bin/") || folder == ".",
                "{folder} has no place in the order of imports: add it here"
            );
            continue;
        };
        for name in dependencies(&manifest) {
            if let Some(ours) = name.strip_prefix("cromosim_") {
                assert!(
                    may.contains(&ours),
                    "{folder} imports {name}; it may import {may:?} only"
                );
            }
        }
    }
}

#[test]
fn anyhow_and_rerun_stay_out_of_libraries() {
    for (folder, manifest) in manifests() {
        if folder.starts_with("nodes/lib/") || folder == "msgs" {
            assert!(
                !dependencies(&manifest).contains(&"anyhow".to_owned()),
                "{folder}: libraries have an error enum of their own"
            );
        }
    }
    let command_line = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    assert!(
        command_line.contains("cromosim_viewer = { workspace = true, optional = true }"),
        "the command line links Rerun by a feature"
    );
}

#[test]
fn top_level_holds_what_the_design_names() {
    let expected = [
        "Cargo.toml",
        "Cargo.lock",
        "nodes",
        "msgs",
        "config",
        "launch_scripts",
        "tests",
        "bags",
    ];
    let beside = [
        "README.md",
        "ARCHITECTURE.md",
        "LICENSE",
        "CHANGELOG.md",
        "rustfmt.toml",
        "clippy.toml",
        "target",
        "cromosim-demo",
    ];
    for entry in fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        let known = name.starts_with('.')
            || expected.contains(&name.as_str())
            || beside.contains(&name.as_str());
        assert!(
            known,
            "{name} stands at the top level; it belongs into one of {expected:?}"
        );
    }
}

#[test]
fn readme_begins_with_the_two_commands_and_ci_runs_the_second() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let block: Vec<&str> = readme
        .split("```")
        .nth(1)
        .unwrap()
        .lines()
        .skip(1)
        .filter(|line| !line.is_empty())
        .collect();
    assert_eq!(
        block.len(),
        2,
        "the first code block holds the main job and the tests: {block:?}"
    );
    assert!(block[0].starts_with("cargo run"));
    let ci = fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(
        ci.lines().any(|line| line == block[1]),
        ".ci/run does not call `{}`",
        block[1]
    );
}

#[test]
fn no_file_of_the_shared_data_is_shipped() {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found)
            } else {
                found.push(path)
            }
        }
    }
    let mut shipped = Vec::new();
    for folder in ["bags", "tests", "nodes", "config"] {
        walk(&root().join(folder), &mut shipped);
    }
    let third_party = [
        "02_01.bvh",
        "03_01.bvh",
        "06_10.bvh",
        "07_01.bvh",
        "13_07.bvh",
        "13_36.bvh",
        "fullbody16.npz",
        "manifest.json",
    ];
    for path in shipped {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(
            !third_party.contains(&name.as_str()),
            "{}: third-party data is not committed",
            path.display()
        );
    }
}
