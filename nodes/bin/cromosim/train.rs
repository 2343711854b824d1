//! `cromosim train`: networks that simulate IMUs, learned from pairs of motion and measured IMU.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use cromosim_evaluation::{
    DataFolder, Learnt, TrainingConfig, TrainingRun, data_summary, split_pairs, training_pairs,
};
use cromosim_learned::train::Engine;
use cromosim_learned::{Network, Quantity};

use crate::body;
use crate::output::{print, say};
use crate::progress::Terminal;

/// Train the accelerometer's and the gyroscope's network
#[derive(Args)]
pub struct Arguments {
    /// What to learn from and how (YAML, schema cromosim/training/1)
    config: PathBuf,
    /// The folder to write the model into
    ///
    /// Weights (safetensors), card.md, history and checkpoints
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Where the configuration's files are; default: its own folder
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Body model (npz or pickle) that motions are played on
    ///
    /// SMPL, SMPL-H or SMPL-X, rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// The skeleton map of BVH and AMC files with joint names of their own
    #[arg(long, value_name = "MAP")]
    skeleton_map: Option<String>,
    /// Begin anew, rather than go on with the training in DIR
    #[arg(long)]
    force: bool,
    /// Say what would be learned from, and stop
    #[arg(long)]
    check: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let config = TrainingConfig::read(&arguments.config)?;
    let mut engine = config
        .training
        .engine
        .open()
        .with_context(|| arguments.config.display().to_string())?;
    let folder = arguments
        .data
        .as_deref()
        .or(arguments.config.parent())
        .unwrap_or(Path::new("."));
    let terminal = Terminal::watch()?;
    let data = DataFolder {
        folder: folder.to_owned(),
        body: body::given(arguments.body.as_deref())?,
        skeleton_map: arguments.skeleton_map.clone(),
    };
    let pairs = training_pairs(&config.data, config.training.seed, &data, &terminal)?;
    for line in data_summary(&pairs) {
        say!("{line}")?;
    }
    if arguments.check {
        return Ok(());
    }
    let (training, validation) = split_pairs(pairs, &config.validation);
    fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: cannot be made", arguments.out.display()))?;
    let run = TrainingRun {
        config: &config,
        out: &arguments.out,
        begin_anew: arguments.force,
        training: &training,
        validation: &validation,
    };
    run.keep_configuration(&arguments.config)?;
    let networks = learn(&run, engine.as_mut(), &terminal)?;
    let scores = run.finish(networks)?;
    say!("{}: weights and card.md", arguments.out.display())?;
    print(format_args!("{scores}"))?;
    Ok(())
}

/// The accelerometer's and the gyroscope's network.
fn learn(
    run: &TrainingRun,
    engine: &mut dyn Engine,
    terminal: &Terminal,
) -> anyhow::Result<[Network; 2]> {
    let mut networks = Vec::new();
    for quantity in Quantity::BOTH {
        match run.learn(engine, quantity, terminal)? {
            Learnt::Network {
                network,
                steps,
                best_step,
                best_loss,
            } => {
                say!(
                    "{}: {steps} steps, best validation loss {best_loss:.5} after step {best_step}",
                    quantity.name()
                )?;
                networks.push(network);
            }
            Learnt::Interrupted { checkpoint } => bail!(
                "interrupted; the same command goes on from {}",
                checkpoint.display()
            ),
        }
    }
    <[Network; 2]>::try_from(networks).map_err(|_| anyhow!("expected two networks"))
}
