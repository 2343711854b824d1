//! `cromosim evaluate`: what the simulation is worth.

use clap::Subcommand;

mod har;

/// Evaluations.
#[derive(Subcommand)]
pub enum Command {
    /// Recognition of activities: does a classifier learn from virtual IMUs what it needs on real ones?
    Har(Box<har::Arguments>),
}

/// Runs the command.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Har(arguments) => har::run(arguments),
    }
}
