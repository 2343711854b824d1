//! `cromosim node NAME`: any node of the suite in this process, with the arguments that its own
//! binary takes.

use clap::Args;
use cromosim_spatial::meant;

use crate::list;
use crate::named::Named;
use crate::output::say;

/// Run one node in this process; what follows the name is the node's own, `--ros-args` included
#[derive(Args)]
#[command(disable_help_flag = true, disable_version_flag = true)]
pub struct Arguments {
    /// replay, smpl_state, virtual_imu, recorder, viewer or gap_monitor
    #[arg(allow_hyphen_values = true, hide_possible_values = true, value_parser = Named(list::node_names))]
    name: String,
    /// The node's arguments; `--help` lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Runs the node until it ends or is interrupted.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let rest = &arguments.arguments;
    match arguments.name.as_str() {
        "replay" => cromosim_replay::run(rest),
        "smpl_state" => cromosim_smpl_state::run(rest),
        "virtual_imu" => cromosim_virtual_imu::run(rest),
        "recorder" => cromosim_recorder::run(rest),
        "gap_monitor" => cromosim_gap_monitor::run(rest),
        #[cfg(feature = "view")]
        "viewer" => cromosim_viewer::run(rest),
        #[cfg(not(feature = "view"))]
        "viewer" => anyhow::bail!(
            "this cromosim was built without the feature `view`; build it with default features to get the viewer"
        ),
        "--help" | "-h" => {
            say!(
                "Usage: cromosim node <replay|smpl_state|virtual_imu|recorder|viewer|gap_monitor>\n           [-h | --help] [--check-config] [--ros-args ...]"
            )?;
            Ok(())
        }
        other => anyhow::bail!(
            "there is no node '{other}'; there are {}{}",
            list::node_names().join(", "),
            meant(other, list::node_names().iter().map(AsRef::as_ref))
        ),
    }
}
