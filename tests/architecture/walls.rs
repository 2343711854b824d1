//! Walls between crates, and what stands at the top level.

use std::collections::BTreeMap;
use std::fs;

use crate::source::tokens;
use crate::{files_below, root};

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
    names_below("[dependencies]", manifest)
}

fn names_below(table: &str, manifest: &str) -> Vec<String> {
    let mut section = String::new();
    let mut names = Vec::new();
    for line in manifest.lines() {
        let line = line.trim();
        if line.starts_with('[') {
            section = line.to_owned();
        } else if section == table && !line.is_empty() && !line.starts_with('#') {
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
        ("rusqlite", "nodes/lib/bag"),
        ("parquet", "nodes/lib/recording"),
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
        ("nodes/lib/video", &["spatial", "body", "motion", "arrays"]),
        ("nodes/lib/imu", &["spatial", "body", "msgs"]),
        ("nodes/lib/learned", &["spatial", "body", "imu", "arrays"]),
        ("nodes/lib/gap", &["spatial", "imu", "charts"]),
        ("nodes/lib/bag", &["msgs", "spatial"]),
        ("nodes/lib/ros", &["msgs", "spatial"]),
        ("nodes/lib/view", &["spatial"]),
        (
            "nodes/lib/recording",
            &[
                "spatial", "body", "motion", "video", "imu", "learned", "gap", "bag", "msgs",
                "arrays",
            ],
        ),
        (
            "nodes/lib/evaluation",
            &[
                "spatial",
                "body",
                "motion",
                "video",
                "imu",
                "learned",
                "bag",
                "msgs",
                "arrays",
                "recording",
                "gap",
                "charts",
            ],
        ),
        (
            "nodes/lib/python",
            &[
                "spatial",
                "body",
                "motion",
                "imu",
                "learned",
                "gap",
                "bag",
                "msgs",
                "recording",
            ],
        ),
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

/// A program is no library: what two of them need stands in `nodes/lib`. Only the command line
/// starts other nodes.
#[test]
fn no_program_imports_another() {
    let programs = programs();
    for (folder, manifest) in manifests() {
        for table in ["[dependencies]", "[dev-dependencies]"] {
            let named = names_below(table, &manifest);
            let foreign = named.iter().find(|name| programs.contains(name));
            assert!(
                folder == "." || foreign.is_none(),
                "{folder} depends on the program {foreign:?}"
            );
        }
    }
    let starts_nodes = ["nodes/bin/cromosim/node.rs", "nodes/bin/cromosim/demo.rs"];
    for file in files_below("nodes") {
        if !file.ends_with(".rs")
            || starts_nodes.contains(&file.as_str())
            || NOT_MOVED_YET.contains(&file.as_str())
        {
            continue;
        }
        let own = file
            .strip_prefix("nodes/bin/")
            .and_then(|rest| rest.split('/').next());
        let own = own.map(|name| format!("cromosim_{name}"));
        let text = fs::read_to_string(root().join(&file)).unwrap();
        for token in tokens(&text) {
            let foreign = programs.contains(&token.text) && own.as_ref() != Some(&token.text);
            assert!(
                !foreign,
                "{file}, line {}: {} is a program, of which only {starts_nodes:?} may know",
                token.line, token.text
            );
        }
    }
}

/// The crates' names of all programs but the command line.
fn programs() -> Vec<String> {
    manifests()
        .keys()
        .filter_map(|folder| folder.strip_prefix("nodes/bin/"))
        .map(|name| format!("cromosim_{name}"))
        .collect()
}

/// Files whose shared code is not in a library yet.
const NOT_MOVED_YET: &[&str] = &[];

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
        "CONTRIBUTING.md",
        "CITATION.cff",
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
    for file in ["bags", "tests", "nodes", "config"]
        .into_iter()
        .flat_map(files_below)
    {
        let name = file.rsplit('/').next().unwrap_or_default();
        assert!(
            !third_party.contains(&name),
            "{file}: third-party data is not committed"
        );
    }
}
