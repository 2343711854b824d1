//! The same network in PyTorch: golden files, and PyTorch itself where `CROMOSIM_TORCH_PYTHON`
//! names an interpreter that has it.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use cromosim_learned::train::{
    Batch, Batches, Data, Engine, Hooks, KernelEngine, Loss, Schedule, TrainOptions, Training,
};
use cromosim_learned::{
    Classifier, ClassifierShape, Direction, LearnedError, Network, NetworkShape, StreamingBatch,
};
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

/// As in scripts/torch_exchange.py.
const ADAM_STEPS: u64 = 5;
const LEARNING_RATE: f64 = 1e-2;
const LOSS: Loss = Loss::Huber { delta: 0.5 };

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn passes(direction: &str) -> HashMap<String, (Vec<usize>, Vec<f32>)> {
    let bytes = fs::read(here(&format!(
        "tests/data/torch_{direction}_passes.safetensors"
    )))
    .unwrap();
    let values = |bytes: &[u8]| {
        bytes
            .as_chunks()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes))
            .collect()
    };
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    tensors
        .iter()
        .map(|(name, view)| {
            (
                name.to_owned(),
                (view.shape().to_vec(), values(view.data())),
            )
        })
        .collect()
}

fn network(direction: &str) -> Network {
    Network::read(&here(&format!("tests/data/torch_{direction}.safetensors")))
        .unwrap()
        .0
}

fn assert_close(what: &str, found: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let worst = found
        .iter()
        .zip(expected)
        .map(|(found, expected)| (found - expected).abs())
        .fold(0.0, f32::max);
    assert!(worst <= tolerance, "{what}: greatest difference {worst}");
}

struct One(Batch);

impl Batches for One {
    fn batch(&self, _: u64) -> Result<Batch, LearnedError> {
        Ok(self.0.clone())
    }
}

fn batch(direction: &str) -> Batch {
    let passes = passes(direction);
    let (shape, inputs) = passes["input"].clone();
    Batch {
        inputs,
        targets: passes["target"].1.clone(),
        weights: passes["weight"].1.clone(),
        sequences: shape[0],
        steps: shape[1],
    }
}

#[test]
fn outputs_are_those_of_pytorch() {
    for direction in ["both", "forward"] {
        let (batch, passes) = (batch(direction), passes(direction));
        let found = network(direction)
            .forward(&batch.inputs, batch.sequences, batch.steps)
            .unwrap();
        assert_close(direction, &found, &passes["output"].1, 1e-5);
    }
}

#[test]
fn a_classifier_says_what_pytorch_does() {
    let passes = passes("classifier");
    let (shape, input) = &passes["input"];
    let (classifier, _) =
        Classifier::read(&here("tests/data/torch_classifier.safetensors")).unwrap();
    let found = classifier.logits(input, shape[0], shape[1]).unwrap();
    assert_close("logits", &found, &passes["output"].1, 1e-5);
}

#[test]
fn streaming_gives_the_outputs_of_pytorch() {
    let (batch, passes) = (batch("forward"), passes("forward"));
    let mut streaming = StreamingBatch::new(&network("forward"), batch.sequences).unwrap();
    let rows = |values: &[f32], width: usize, step: usize| -> Vec<f32> {
        values
            .chunks(batch.steps * width)
            .flat_map(|sequence| &sequence[step * width..][..width])
            .copied()
            .collect()
    };
    for step in 0..batch.steps {
        let found = streaming.step(&rows(&batch.inputs, 4, step)).unwrap();
        assert_close(
            &format!("step {step}"),
            found,
            &rows(&passes["output"].1, 3, step),
            1e-5,
        );
    }
}

#[test]
fn loss_and_gradients_are_those_of_pytorch() {
    for direction in ["both", "forward"] {
        let (network, passes) = (network(direction), passes(direction));
        let mut gradients = vec![0.0; network.parameters().len()];
        let loss = KernelEngine
            .gradients(&network, &batch(direction), &[LOSS], &mut gradients)
            .unwrap();
        assert_close("loss", &[loss as f32], &passes["loss"].1, 1e-6);
        for tensor in network.shape().tensors() {
            let expected = &passes[&format!("gradient.{}", tensor.name)].1;
            assert_close(
                &format!("{direction}, {}", tensor.name),
                &gradients[tensor.range],
                expected,
                1e-6,
            );
        }
    }
}

#[test]
fn adam_ends_where_pytorch_does() {
    for direction in ["both", "forward"] {
        let passes = passes(direction);
        let options = TrainOptions {
            losses: vec![LOSS],
            learning_rate: LEARNING_RATE,
            schedule: Schedule::Constant,
            clip: None,
            steps: ADAM_STEPS,
            validate_every: 1,
            patience: None,
            checkpoint_every: 1,
            seed: 0,
        };
        let mut training = Training::from_network(network(direction), options).unwrap();
        let mut progress = |_: &_| ();
        let mut hooks = Hooks {
            progress: &mut progress,
            interrupted: &|| false,
            checkpoint: None,
        };
        training
            .run(
                &mut KernelEngine,
                Data {
                    training: &One(batch(direction)),
                    validation: None,
                },
                &mut hooks,
            )
            .unwrap();
        for tensor in training.network().shape().tensors() {
            let expected = &passes[&format!("trained.{}", tensor.name)].1;
            // Adam divides by the gradient's size: where that is near its epsilon, the last bits of
            // a gradient show.
            assert_close(
                &format!("{direction}, {}", tensor.name),
                &training.network().parameters()[tensor.range],
                expected,
                1e-4,
            );
        }
    }
}

#[test]
fn pytorch_reads_our_files_and_computes_the_same() {
    let Some(python) = std::env::var_os("CROMOSIM_TORCH_PYTHON") else {
        eprintln!("skipped: CROMOSIM_TORCH_PYTHON names no interpreter with torch and safetensors");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (weights, passes) = (
        folder.path().join("weights.safetensors"),
        folder.path().join("passes.safetensors"),
    );
    let compare = |input: (Vec<usize>, Vec<f32>), output: (Vec<usize>, Vec<f32>)| {
        let bytes = [&input, &output].map(|(_, values)| {
            values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect::<Vec<u8>>()
        });
        let view = |index: usize, shape: &Vec<usize>| {
            TensorView::new(Dtype::F32, shape.clone(), &bytes[index]).unwrap()
        };
        fs::write(
            &passes,
            serialize(
                [("input", view(0, &input.0)), ("output", view(1, &output.0))],
                None,
            )
            .unwrap(),
        )
        .unwrap();
        let run = Command::new(&python)
            .arg(here("scripts/torch_exchange.py"))
            .arg("compare")
            .args([&weights, &passes])
            .output()
            .unwrap();
        assert!(
            run.status.success(),
            "{}{}",
            String::from_utf8_lossy(&run.stdout),
            String::from_utf8_lossy(&run.stderr)
        );
    };
    let numbers =
        |count: usize| -> Vec<f32> { (0..count).map(|index| (index as f32 * 0.7).sin()).collect() };
    for (direction, kernel) in [(Direction::Both, 5), (Direction::Forward, 3)] {
        let shape = NetworkShape {
            inputs: 27,
            channels: 16,
            kernel,
            convolutions: 3,
            hidden: 32,
            layers: 2,
            direction,
            outputs: 3,
        };
        let network = Network::new(shape, 5).unwrap();
        network.write(&weights, &BTreeMap::new()).unwrap();
        let input = numbers(3 * 50 * 27);
        let output = network.forward(&input, 3, 50).unwrap();
        compare((vec![3, 50, 27], input), (vec![3, 50, 3], output));
    }
    let classifier = Classifier::new(ClassifierShape::published(12, 5), 5).unwrap();
    classifier.write(&weights, &BTreeMap::new()).unwrap();
    let input = numbers(70 * 30 * 12);
    let output = classifier.logits(&input, 70, 30).unwrap();
    compare((vec![70, 30, 12], input), (vec![70, 5], output));
}
