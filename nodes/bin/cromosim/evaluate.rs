//! `cromosim evaluate`: what simulated IMUs are worth.

use clap::Subcommand;

mod fidelity;
mod folders;
mod har;

/// Evaluations.
#[derive(Subcommand)]
pub enum Command {
    /// How far simulators are from measured IMUs
    ///
    /// On people and positions that no network has seen
    Fidelity(fidelity::Arguments),
    /// Does a classifier of activities learn from virtual IMUs what it needs on real ones?
    Har(Box<har::Arguments>),
}

/// Runs one of them.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Fidelity(arguments) => fidelity::run(arguments),
        Command::Har(arguments) => har::run(arguments),
    }
}
