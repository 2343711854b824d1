//! A training step (forward, backward, clipping, Adam) and inference, against PyTorch on the same
//! machine and threads: `CROMOSIM_TORCH_PYTHON=/path/to/python cargo bench -p cromosim_learned
//! --bench training`.
//!
//! Ours and PyTorch's runs alternate, so that other work on the machine falls on both; the least of
//! all is the one to compare. Batches of 64 windows of 128 steps x 27 channels, three convolutions
//! of 64 channels with five taps, two LSTM layers of 128 units.
//!
//! With `--features burn` the training step runs on Burn's CPU backend too, with our LSTM as one
//! operation (`Burn`) and with one made of Burn's own (`Burn's LSTM`).
#![allow(missing_docs)]

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use cromosim_learned::train::{
    Batch, Batches, Data, Engine, Hooks, KernelEngine, Loss, Schedule, TrainOptions, Training,
};
use cromosim_learned::{Direction, LearnedError, Network, NetworkShape};

const BATCH: usize = 64;
const STEPS: usize = 128;

/// Rounds and repetitions; once where `cargo test` only wants it to run.
fn times(measured: usize) -> usize {
    let measures = std::env::args().any(|argument| argument == "--bench");
    if measures { measured } else { 1 }
}

fn rounds() -> usize {
    times(3)
}

fn repetitions() -> usize {
    times(5)
}

struct Noise(NetworkShape);

fn noise(count: usize, seed: u64) -> Vec<f32> {
    (0..count)
        .map(|index| ((index as f64 + 1e4 * seed as f64) * 1.618).sin() as f32)
        .collect()
}

impl Batches for Noise {
    fn batch(&self, number: u64) -> Result<Batch, LearnedError> {
        let rows = BATCH * STEPS;
        let (inputs, targets) = (
            noise(rows * self.0.inputs, number),
            noise(rows * self.0.outputs, number + 1),
        );
        Ok(Batch {
            inputs,
            targets,
            weights: vec![1.0; rows],
            sequences: BATCH,
            steps: STEPS,
        })
    }
}

/// Milliseconds of each of an engine's steps.
fn training(shape: &NetworkShape, engine: &mut dyn Engine) -> Vec<f64> {
    let options = TrainOptions {
        losses: vec![Loss::SquaredError],
        learning_rate: 1e-3,
        schedule: Schedule::Constant,
        clip: Some(1.0),
        steps: repetitions() as u64 + 1,
        validate_every: u64::MAX,
        patience: None,
        checkpoint_every: u64::MAX,
        seed: 1,
    };
    let mut training = Training::new(shape.clone(), options).expect("a sound shape");
    let mut stamps = Vec::new();
    let mut progress = |_: &_| stamps.push(Instant::now());
    let mut hooks = Hooks {
        progress: &mut progress,
        interrupted: &|| false,
        checkpoint: None,
    };
    let data = Data {
        training: &Noise(shape.clone()),
        validation: None,
    };
    training.run(engine, data, &mut hooks).expect("a training");
    stamps
        .windows(2)
        .map(|pair| 1e3 * (pair[1] - pair[0]).as_secs_f64())
        .collect()
}

fn inference(shape: &NetworkShape, batch: usize) -> Vec<f64> {
    let prepared = Network::new(shape.clone(), 1)
        .expect("a sound shape")
        .prepare();
    let input = noise(batch * STEPS * shape.inputs, 1);
    let once = |_| {
        let start = Instant::now();
        prepared
            .forward(&input, batch, STEPS)
            .expect("an input that fits");
        1e3 * start.elapsed().as_secs_f64()
    };
    (0..=repetitions()).map(once).skip(1).collect()
}

/// Least milliseconds by name.
fn ours(shape: &NetworkShape, threads: usize) -> Vec<(String, f64)> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    let least = |times: Vec<f64>| times.into_iter().fold(f64::INFINITY, f64::min);
    pool.install(|| {
        let mut found = vec![(
            "training".to_owned(),
            least(training(shape, &mut KernelEngine)),
        )];
        #[cfg(feature = "burn")]
        for (name, mut engine) in [
            ("Burn", cromosim_learned::BurnEngine::cpu()),
            ("Burn's LSTM", cromosim_learned::BurnEngine::cpu_composed()),
        ] {
            found.push((
                format!("training by {name}"),
                least(training(shape, &mut engine)),
            ));
        }
        found.extend(
            [1, 16, 64].map(|batch| (format!("inference {batch}"), least(inference(shape, batch)))),
        );
        found
    })
}

fn pytorch(direction: &str, threads: usize) -> Option<serde_json::Value> {
    let python = std::env::var_os("CROMOSIM_TORCH_PYTHON")?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/bench_torch.py");
    let arguments = [
        threads.to_string(),
        repetitions().to_string(),
        direction.to_owned(),
    ];
    let output = Command::new(python)
        .arg(script)
        .args(arguments)
        .output()
        .expect("the interpreter starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(serde_json::from_slice(&output.stdout).expect("a line of JSON"))
}

fn main() {
    for (direction, name) in [(Direction::Both, "both"), (Direction::Forward, "forward")] {
        let shape = NetworkShape {
            inputs: 27,
            channels: 64,
            kernel: 5,
            convolutions: 3,
            hidden: 128,
            layers: 2,
            direction,
            outputs: 3,
        };
        for threads in [1, 2] {
            let mut least: Vec<(String, f64, f64)> = Vec::new();
            for _ in 0..rounds() {
                let found = ours(&shape, threads);
                let theirs = pytorch(name, threads);
                for (index, (what, milliseconds)) in found.into_iter().enumerate() {
                    let of_pytorch = theirs
                        .as_ref()
                        .and_then(|theirs| {
                            theirs[what.split(" by ").next().unwrap_or_default()]["least"].as_f64()
                        })
                        .unwrap_or(f64::NAN);
                    match least.get_mut(index) {
                        Some(entry) => {
                            (entry.1, entry.2) =
                                (entry.1.min(milliseconds), entry.2.min(of_pytorch))
                        }
                        None => least.push((what, milliseconds, of_pytorch)),
                    }
                }
            }
            for (what, ours, theirs) in least {
                println!(
                    "{name}, {threads} threads, {what}: {ours:.1} ms, PyTorch {theirs:.1} ms, ratio {:.2}",
                    ours / theirs
                );
            }
        }
    }
}
