use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::Direction;
use crate::NetworkShape;
use crate::kernels::testing::values;
use crate::train::TrainOptions;
use crate::train::{Batch, KernelEngine, Loss, Schedule};

fn shape() -> NetworkShape {
    NetworkShape {
        inputs: 3,
        channels: 8,
        kernel: 3,
        convolutions: 1,
        hidden: 8,
        layers: 1,
        direction: Direction::Both,
        outputs: 2,
    }
}

fn options(steps: u64) -> TrainOptions {
    TrainOptions {
        losses: vec![Loss::SquaredError, Loss::Huber { delta: 1.0 }],
        learning_rate: 1e-2,
        schedule: Schedule::Cosine { floor: 0.1 },
        clip: Some(1.0),
        steps,
        validate_every: 5,
        patience: None,
        checkpoint_every: 10,
        seed: 11,
    }
}

/// Targets that a network can learn: products and sums of inputs, now and a step ago; a tenth of
/// the rows is not to be looked at.
struct Toy {
    seed: u64,
}

impl Batches for Toy {
    fn batch(&self, number: u64) -> Result<Batch, LearnedError> {
        let (sequences, steps) = (20, 12);
        let inputs = values(
            sequences * steps * 3,
            self.seed.wrapping_mul(1_000_003) + number,
        );
        let (mut targets, mut weights) = (Vec::new(), Vec::new());
        for row in 0..sequences * steps {
            let (now, before) = (
                &inputs[row * 3..][..3],
                if row % steps == 0 {
                    0.0
                } else {
                    inputs[row * 3 - 3]
                },
            );
            let hidden = row % 10 == 3;
            weights.push(if hidden { 0.0 } else { 1.0 + (row % 3) as f32 });
            targets.extend(if hidden {
                [f32::NAN; 2]
            } else {
                [now[0] * now[1] + before, 0.5 * now[2] - before]
            });
        }
        Ok(Batch {
            inputs,
            targets,
            weights,
            sequences,
            steps,
        })
    }
}

const DATA: Data<'static> = Data {
    training: &Toy { seed: 1 },
    validation: Some((&Toy { seed: 2 }, 2)),
};

fn run(
    training: &mut Training,
    data: Data<'_>,
    checkpoint: Option<&Path>,
    stop_after: u64,
) -> (Stop, Vec<Progress>) {
    let (interrupt, mut seen) = (AtomicBool::new(false), Vec::new());
    let mut progress = |progress: &Progress| {
        seen.push(*progress);
        interrupt.store(progress.step >= stop_after, Ordering::Relaxed);
    };
    let stop = training
        .run(
            &mut KernelEngine,
            data,
            &mut Hooks {
                progress: &mut progress,
                interrupted: &|| interrupt.load(Ordering::Relaxed),
                checkpoint,
            },
        )
        .unwrap();
    (stop, seen)
}

fn file(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("checkpoint.safetensors")
}

#[test]
fn learns() {
    let mut training = Training::new(shape(), options(300)).unwrap();
    let (stop, seen) = run(&mut training, DATA, None, u64::MAX);
    assert_eq!((stop, seen.len()), (Stop::Done, 300));
    let first = seen[4].validation_loss.unwrap();
    let best = training.best().unwrap();
    assert!(
        best.loss < 0.1 * first,
        "validation fell from {first} to {} only",
        best.loss
    );
    assert!((seen[299].learning_rate / 1e-3 - 1.0).abs() < 0.01 && seen[0].learning_rate == 1e-2);
}

#[test]
fn goes_on_from_a_checkpoint_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let mut whole = Training::new(shape(), options(40)).unwrap();
    let (_, all) = run(&mut whole, DATA, None, u64::MAX);
    let mut first = Training::new(shape(), options(40)).unwrap();
    assert_eq!(
        run(&mut first, DATA, Some(&file(&folder)), 17).0,
        Stop::Interrupted
    );
    let mut second = Training::resume(&file(&folder), &shape(), &options(40)).unwrap();
    assert_eq!((second.step(), &second), (17, &first));
    let (stop, rest) = run(&mut second, DATA, Some(&file(&folder)), u64::MAX);
    assert_eq!(
        (stop, rest.as_slice(), &second),
        (Stop::Done, &all[17..], &whole)
    );
    let after = Training::resume_or_new(&file(&folder), shape(), options(40)).unwrap();
    assert_eq!(after, whole);
}

#[test]
fn threads_do_not_change_bits() {
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut training = Training::new(shape(), options(6)).unwrap();
        pool.install(|| run(&mut training, DATA, None, u64::MAX));
        training
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn stops_early_and_keeps_the_best() {
    // A rate at which it jumps about: most validations are worse than the best.
    let options = TrainOptions {
        learning_rate: 0.5,
        schedule: Schedule::Constant,
        patience: Some(3),
        clip: None,
        ..options(2000)
    };
    let mut training = Training::new(shape(), options).unwrap();
    let (stop, seen) = run(&mut training, DATA, None, u64::MAX);
    let validations: Vec<f64> = seen
        .iter()
        .filter_map(|progress| progress.validation_loss)
        .collect();
    let least = validations.iter().copied().fold(f64::INFINITY, f64::min);
    let best = training.best().unwrap().clone();
    assert_eq!((stop, best.loss), (Stop::Early, least));
    assert_eq!(best.step + 15, training.step());
    assert_ne!(best.network.parameters(), training.network().parameters());
    assert_eq!(training.into_network(), best.network);
}

#[test]
fn a_checkpoint_of_another_training_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut training = Training::new(shape(), options(3)).unwrap();
    run(&mut training, DATA, Some(&file(&folder)), u64::MAX);
    let message = |shape: &NetworkShape, options: &TrainOptions| {
        Training::resume(&file(&folder), shape, options)
            .unwrap_err()
            .to_string()
    };
    let other = message(
        &shape(),
        &TrainOptions {
            learning_rate: 0.02,
            ..options(3)
        },
    );
    assert!(other.contains("checkpoint.safetensors: options.learning_rate is 0.01 in the checkpoint, 0.02 is asked for"), "{other}");
    let other = message(
        &NetworkShape {
            hidden: 9,
            ..shape()
        },
        &options(3),
    );
    assert!(
        other.contains("shape.hidden is 8 in the checkpoint, 9 is asked for"),
        "{other}"
    );
    let bytes = std::fs::read(file(&folder)).unwrap();
    std::fs::write(file(&folder), &bytes[..bytes.len() - 5]).unwrap();
    assert!(message(&shape(), &options(3)).contains("not a sound safetensors file"));
}

#[test]
fn batches_and_options_that_cannot_be_are_refused() {
    struct Wrong(fn(&mut Batch));
    impl Batches for Wrong {
        fn batch(&self, number: u64) -> Result<Batch, LearnedError> {
            let mut batch = Toy { seed: 1 }.batch(number)?;
            (self.0)(&mut batch);
            Ok(batch)
        }
    }
    type Change = fn(&mut Batch);
    let changes: [(Change, &str); 5] = [
        (
            |batch| batch.inputs[5] = f32::NAN,
            "batch 0: input 5 is NaN",
        ),
        (
            |batch| batch.targets[3] = f32::INFINITY,
            "batch 0: row 1 counts, but its targets are",
        ),
        (|batch| batch.weights[2] = -1.0, "batch 0: weight 2 is -1"),
        (
            |batch| batch.weights.fill(0.0),
            "batch 0: all weights are 0",
        ),
        (
            |batch| batch.steps = 11,
            "batch 0: 20 sequences x 11 steps x 3 inputs are not the 720 there are",
        ),
    ];
    for (change, expected) in changes {
        let mut training = Training::new(shape(), options(3)).unwrap();
        let mut progress = |_: &Progress| {};
        let mut hooks = Hooks {
            progress: &mut progress,
            interrupted: &|| false,
            checkpoint: None,
        };
        let data = Data {
            training: &Wrong(change),
            validation: None,
        };
        let error = training
            .run(&mut KernelEngine, data, &mut hooks)
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
    let refused = |options: TrainOptions| Training::new(shape(), options).unwrap_err().to_string();
    assert_eq!(
        refused(TrainOptions {
            steps: 0,
            ..options(1)
        }),
        "training options: steps: 0; it has to be at least 1"
    );
    assert!(
        refused(TrainOptions {
            losses: vec![Loss::SquaredError; 3],
            ..options(1)
        })
        .contains("one for all outputs or 2 are needed")
    );
    assert!(
        refused(TrainOptions {
            learning_rate: f64::NAN,
            ..options(1)
        })
        .contains("learning_rate: NaN")
    );
}
