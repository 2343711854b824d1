//! `cromosim train`: networks that simulate IMUs, learned from pairs of motion and measured IMU.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use cromosim_learned::train::{Data, Engine, Hooks, Progress, Stop, Training};
use cromosim_learned::{LearnedSimulator, Network, Pair, PairBatches, Quantity, Windows};

use crate::body;
use crate::progress::{self, Interrupt};

mod card;
pub mod config;
pub mod data;
mod engine;

use config::Config;

/// Train the accelerometer's and the gyroscope's network
#[derive(Args)]
pub struct Arguments {
    /// What to learn from and how (YAML, schema cromosim/training/1)
    config: PathBuf,
    /// The folder to write the model into: weights (safetensors), card.md, history and checkpoints
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Where the configuration's files are looked for; default: the folder of the configuration
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Body model (SMPL, SMPL-H, SMPL-X; npz or pickle) that motions are played on, rather than the
    /// embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Begin anew where DIR holds a training already, rather than go on with it
    #[arg(long)]
    force: bool,
    /// Say what would be learned from, and stop
    #[arg(long)]
    check: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let config = Config::read(&arguments.config)?;
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
    let interrupt = Interrupt::watch()?;
    let given = arguments
        .body
        .as_ref()
        .map(|path| body::model(Some(path)))
        .transpose()?;
    let pairs = data::pairs(&config, folder, given.as_ref(), &interrupt)?;
    for line in summary(&pairs) {
        println!("{line}");
    }
    let (validation, training): (Vec<Pair>, Vec<Pair>) = pairs
        .into_iter()
        .partition(|pair| config.validation.contains(&pair.subject));
    if arguments.check {
        return Ok(());
    }
    fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: cannot be made", arguments.out.display()))?;
    keep_configuration(arguments)?;
    let mut networks = Vec::new();
    for quantity in Quantity::BOTH {
        match learn(
            &config,
            engine.as_mut(),
            quantity,
            [&training, &validation],
            arguments,
            &interrupt,
        )? {
            Some(network) => networks.push(network),
            None => bail!(
                "interrupted; the same command goes on from {}",
                checkpoint(&arguments.out, quantity).display()
            ),
        }
    }
    let Ok(networks) = <[Network; 2]>::try_from(networks) else {
        bail!("expected two networks")
    };
    let simulator = LearnedSimulator::new(config.input, networks)?;
    let scores = card::scores(&simulator, &validation)?;
    let text = card::text(&config, &simulator, &training, &validation, &scores);
    simulator.write(&arguments.out, &card::notes(&config))?;
    let place = arguments.out.join("card.md");
    fs::write(&place, &text).with_context(|| format!("{}: cannot be written", place.display()))?;
    println!("{}: weights and card.md", arguments.out.display());
    print!("{scores}");
    Ok(())
}

/// DIR/training.yaml is what the training in DIR was begun with: weights that come of another file
/// would not be what their card says.
fn keep_configuration(arguments: &Arguments) -> anyhow::Result<()> {
    let place = arguments.out.join("training.yaml");
    let text = fs::read(&arguments.config)
        .with_context(|| format!("{}: cannot be read", arguments.config.display()))?;
    if !arguments.force && fs::read(&place).is_ok_and(|begun_with| begun_with != text) {
        bail!(
            "{}: differs from {}; give another --out, or --force to begin anew",
            place.display(),
            arguments.config.display()
        );
    }
    fs::write(&place, text).with_context(|| format!("{}: cannot be written", place.display()))
}

/// Seconds by subject and position, and what the analytic simulation leaves.
fn summary(pairs: &[Pair]) -> Vec<String> {
    let mut subjects: Vec<&str> = pairs.iter().map(|pair| pair.subject.as_str()).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let line = |subject: &str| {
        let own: Vec<&Pair> = pairs
            .iter()
            .filter(|pair| pair.subject == subject)
            .collect();
        let mut positions: Vec<&str> = own.iter().map(|pair| pair.position.as_str()).collect();
        positions.sort_unstable();
        positions.dedup();
        let [acceleration, rate] = card::analytic(&own);
        format!(
            "subject {subject}: {} pairs, {:.0} s, {}; the analytic simulation leaves {acceleration:.3} m/s2, {rate:.4} rad/s",
            own.len(),
            card::seconds(own.iter().copied()),
            positions.join(", ")
        )
    };
    subjects.into_iter().map(line).collect()
}

fn checkpoint(out: &Path, quantity: Quantity) -> PathBuf {
    out.join(format!("{}.checkpoint", quantity.name()))
}

/// Trains one network, from its checkpoint on where there is one; none where it was interrupted.
fn learn(
    config: &Config,
    engine: &mut dyn Engine,
    quantity: Quantity,
    [training, validation]: [&[Pair]; 2],
    arguments: &Arguments,
    interrupt: &Interrupt,
) -> anyhow::Result<Option<Network>> {
    let windows = Windows::Drawn {
        seed: data::mix(&[config.training.seed, quantity as u64]),
        turns: config.turns,
    };
    let batches = PairBatches::new(
        training,
        config.input,
        quantity,
        config.training.windows,
        windows,
    )
    .context("training")?;
    let judged = PairBatches::new(
        validation,
        config.input,
        quantity,
        config.training.windows,
        Windows::InOrder,
    )
    .context("validation")?;
    let place = checkpoint(&arguments.out, quantity);
    let mut state = if arguments.force {
        Training::new(config.shape(), config.options())?
    } else {
        Training::resume_or_new(&place, config.shape(), config.options())?
    };
    let history_place = arguments
        .out
        .join(format!("{}_history.csv", quantity.name()));
    let mut history = History::open(&history_place, state.step())?;
    let bar = progress::bar(config.training.steps, quantity.name());
    bar.set_position(state.step());
    let mut failure = None;
    let mut tell = |progress: &Progress| {
        bar.set_position(progress.step);
        if let Some(loss) = progress.validation_loss {
            bar.set_message(format!("{} {:.4}", quantity.name(), loss));
            failure = failure.take().or_else(|| history.add(progress).err());
        }
    };
    let data = Data {
        training: &batches,
        validation: Some((&judged, judged.count())),
    };
    let mut hooks = Hooks {
        progress: &mut tell,
        interrupt: interrupt.flag(),
        checkpoint: Some(&place),
    };
    let stop = state.run(engine, data, &mut hooks)?;
    bar.finish_and_clear();
    if let Some(error) = failure {
        return Err(error)
            .with_context(|| format!("{}: cannot be written", history_place.display()));
    }
    if stop == Stop::Interrupted {
        return Ok(None);
    }
    let best = state.best().map_or(state.step(), |best| best.step);
    let loss = state.best().map_or(f64::NAN, |best| best.loss);
    println!(
        "{}: {} steps, best validation loss {loss:.5} after step {best}",
        quantity.name(),
        state.step()
    );
    Ok(Some(state.into_network()))
}

/// Losses by step, as CSV; a training that goes on goes on in its file.
struct History(fs::File);

impl History {
    fn open(place: &Path, step: u64) -> anyhow::Result<Self> {
        let refuse = || format!("{}: cannot be written", place.display());
        let kept = if step == 0 {
            String::new()
        } else {
            fs::read_to_string(place).unwrap_or_default()
        };
        // Rows after the checkpoint come again.
        let rows = kept.lines().skip(1).filter(|row| {
            row.split(',')
                .next()
                .and_then(|cell| cell.parse::<u64>().ok())
                .is_some_and(|at| at <= step)
        });
        let text = rows.fold(
            "step,training_loss,validation_loss,learning_rate\n".to_owned(),
            |text, row| text + row + "\n",
        );
        fs::write(place, text).with_context(refuse)?;
        Ok(Self(
            fs::OpenOptions::new()
                .append(true)
                .open(place)
                .with_context(refuse)?,
        ))
    }

    fn add(&mut self, progress: &Progress) -> std::io::Result<()> {
        let Progress {
            step,
            loss,
            learning_rate,
            validation_loss,
            ..
        } = progress;
        writeln!(
            self.0,
            "{step},{loss},{},{learning_rate}",
            validation_loss.unwrap_or(f64::NAN)
        )
    }
}
