//! `cromosim evaluate`: what simulated IMUs are worth.

use std::path::{Path, PathBuf};

use clap::Subcommand;

mod bootstrap;
mod fidelity;
mod har;
mod output;

/// Evaluations.
#[derive(Subcommand)]
pub enum Command {
    /// How far simulators are from measured IMUs, on people and positions that no network has seen
    Fidelity(fidelity::Arguments),
    /// Recognition of activities: does a classifier learn from virtual IMUs what it needs on real
    /// ones?
    Har(Box<har::Arguments>),
}

/// Runs one.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Fidelity(arguments) => fidelity::run(arguments),
        Command::Har(arguments) => har::run(arguments),
    }
}

/// The folder with the third-party data: what is given, else CROMOSIM_DATA, else ../shared/data.
fn data_folder(given: Option<&Path>) -> PathBuf {
    let stated = || std::env::var_os("CROMOSIM_DATA").map(PathBuf::from);
    given
        .map(Path::to_owned)
        .or_else(stated)
        .unwrap_or_else(|| PathBuf::from("../shared/data"))
}
