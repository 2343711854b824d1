//! `cromosim map`: fits what simulated IMUs' distributions lack to those of real ones.

use std::path::PathBuf;

use clap::Args;
use cromosim_evaluation::fit_mapping;

use crate::files::refuse_existing;
use crate::output::say;
use crate::progress::working;

/// Fit a distribution mapping from a simulated to a measured recording
///
/// By ranks, per channel and placement
#[derive(Args)]
pub struct Arguments {
    /// The recording with the simulated IMUs
    #[arg(long, value_name = "RECORDING")]
    simulated: PathBuf,
    /// The recording with the real IMUs
    ///
    /// Need be neither the same motion nor as long
    #[arg(long, value_name = "RECORDING")]
    measured: PathBuf,
    /// The file to write (YAML), for `simulate --mapping`
    ///
    /// And for virtual_imu's parameter `mapping`
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace FILE where it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let out = arguments.out.display();
    refuse_existing(&arguments.out, arguments.force)?;
    let file = working("fitting a mapping", || {
        fit_mapping(&arguments.simulated, &arguments.measured)
    })?;
    file.write(&arguments.out)?;
    let names: Vec<&str> = file.placements.keys().map(String::as_str).collect();
    say!("{out}: {}", names.join(", "))?;
    Ok(())
}
