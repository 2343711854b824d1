//! `cromosim`: virtual IMUs from body motion. The command line over the libraries and nodes.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use output::remark;
use simulate_arguments::Mode;

mod bag;
mod body;
mod compare;
mod convert;
mod demo;
mod device;
mod device_allan;
mod diagnose;
mod diagnose_recordings;
#[cfg(feature = "view")]
mod diagnose_view;
mod evaluate;
mod files;
mod inspect;
mod inspect_json;
mod list;
mod map;
mod memory;
mod motion_arguments;
mod named;
mod node;
mod output;
mod progress;
mod reference;
mod rigid_bodies;
mod simulate;
mod simulate_arguments;
mod simulate_many;
mod simulate_setup;
mod simulated_csv;
mod simulated_draws;
mod simulated_file;
mod simulated_json;
mod simulated_quality;
mod summary;
mod topic_arguments;
mod train;
mod trajectory;

/// Virtual IMUs from body motion: ROS 2 nodes in Rust, offline simulation, bags and pictures.
#[derive(Parser)]
#[command(
    name = "cromosim",
    version,
    propagate_version = true,
    max_term_width = 120
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Play a motion through the five nodes over DDS on this machine
    ///
    /// Leaves a bag and a Rerun recording
    Demo(demo::Arguments),
    /// Simulate IMUs from motion files, or again from a recording's reference
    ///
    /// Offline, on all cores
    Simulate(Box<simulate_arguments::Arguments>),
    /// Say which effects separate a recording's real IMUs from their simulation
    ///
    /// And how far the gap falls with them
    Diagnose(diagnose::Arguments),
    /// Say what differs between two diagnoses, or between the IMUs of two recordings
    Compare(compare::Arguments),
    /// Convert motions, trajectories, IMU series and recordings into each other's files
    Convert(Box<convert::Arguments>),
    /// Place in-place poses of a video in the world, by keypoints, depth maps and cameras
    Trajectory(Box<trajectory::Arguments>),
    /// Train networks that simulate IMUs, on pairs of motion and measured IMU
    Train(train::Arguments),
    /// Fit a distribution mapping from simulated to real IMUs
    Map(map::Arguments),
    /// Measure what simulated IMUs are worth
    ///
    /// Against measured ones, and on the recognition of activities
    Evaluate {
        #[command(subcommand)]
        command: evaluate::Command,
    },
    /// Say what is in a motion, body, trajectory or bag file
    Inspect(Box<inspect::Arguments>),
    /// Work on bags: mend an unfinished one, export IMU topics as CSV
    Bag {
        #[command(subcommand)]
        command: bag::Command,
    },
    /// Work on bodies: export the model or a mesh, list its sites
    Body {
        #[command(subcommand)]
        command: body::Command,
    },
    /// Work on devices: show them, make them of a recording at rest, Kalibr or a diagnosis
    Device {
        #[command(subcommand)]
        command: device::Command,
    },
    /// List names: sites, effects, schemes, devices, models, nodes
    List {
        #[command(subcommand)]
        command: list::Command,
    },
    /// Run one node: replay, smpl_state, virtual_imu, recorder, viewer or gap_monitor
    Node(node::Arguments),
    /// Print a shell's completion script
    Completion {
        /// The shell
        shell: Shell,
        /// Write to this file rather than to standard output
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replace the file where it exists
        #[arg(long)]
        force: bool,
    },
}

fn completion(shell: Shell, out: Option<PathBuf>, force: bool) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "cromosim", &mut script);
    match out {
        Some(path) => files::write_whole(&path, force, |file| {
            file.write_all(&script)
                .with_context(|| format!("{}: cannot be written", path.display()))
        }),
        None => output::print(format_args!("{}", String::from_utf8_lossy(&script))),
    }
}

fn simulate(arguments: &simulate_arguments::Arguments) -> anyhow::Result<()> {
    match arguments.mode()? {
        Mode::Motions => simulate::run(arguments),
        Mode::Reference(recording) => reference::run(recording, arguments),
        Mode::Rigid(trajectory) => reference::run_rigid(trajectory, arguments),
    }
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Simulate(arguments) => simulate(&arguments),
        Command::Diagnose(arguments) => diagnose::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Trajectory(arguments) => trajectory::run(&arguments),
        Command::Train(arguments) => train::run(&arguments),
        Command::Map(arguments) => map::run(&arguments),
        Command::Evaluate { command } => evaluate::run(&command),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Bag { command } => bag::run(&command),
        Command::Body { command } => body::run(&command),
        Command::Device { command } => device::run(&command),
        Command::List { command } => list::run(&command),
        Command::Node(arguments) => node::run(&arguments),
        Command::Completion { shell, out, force } => completion(shell, out, force),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if output::nobody_reads(&error) => ExitCode::SUCCESS,
        Err(error) => {
            remark!("error: {}", one_line(&error));
            ExitCode::from(2)
        }
    }
}

/// The chain of causes on one line; a cause that its effect already quotes is not said twice.
fn one_line(error: &anyhow::Error) -> String {
    let mut line = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !line.contains(&cause) {
            line = format!("{line}: {cause}");
        }
    }
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}
