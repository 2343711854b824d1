//! Nodes for long, by simulated time, and nodes that are killed: see README.md here.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod day;
mod kills;
#[path = "../nodes/process.rs"]
mod process;

use std::path::Path;

use crate::process::Process;

/// A number from the environment, for runs by hand.
fn setting(name: &str, default: f64) -> f64 {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// Without Rerun there is no viewer.
fn is_built(name: &str) -> bool {
    name != "viewer" || cfg!(feature = "view")
}

/// Bytes of the viewer's file so far.
fn seen_bytes(recording: &Path) -> u64 {
    std::fs::metadata(recording).map_or(0, |file| file.len())
}

/// Starts a node with parameters.
fn node(folder: &Path, name: &str, parameters: &[&str]) -> Process {
    let mut arguments = vec!["node", name, "--ros-args"];
    arguments.extend(parameters.iter().flat_map(|parameter| ["-p", *parameter]));
    Process::start(folder, &arguments)
}
