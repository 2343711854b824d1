//! `cromosim evaluate`: what simulated IMUs are worth.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Subcommand;

mod fidelity;
mod har;

/// Evaluations.
#[derive(Subcommand)]
pub enum Command {
    /// How far simulators are from measured IMUs, on people and positions that no network has seen
    Fidelity(fidelity::Arguments),
    /// Recognition of activities: does a classifier learn from virtual IMUs what it needs on real
    /// ones?
    Har(Box<har::Arguments>),
}

/// Runs one of them.
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

/// Refuses a folder that holds results already, unless `force`.
fn refuse_existing(out: &Path, names: &[&str], force: bool) -> anyhow::Result<()> {
    let mut existing = names.iter().map(|name| out.join(name));
    if let Some(path) = existing.find(|path| path.exists() && !force) {
        bail!(
            "{}: exists already; give another --out, or --force to replace it",
            path.display()
        );
    }
    Ok(())
}
