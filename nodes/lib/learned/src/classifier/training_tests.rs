use super::*;
use crate::kernels::testing::values;

const STEPS: usize = 12;

fn shape() -> ClassifierShape {
    ClassifierShape {
        inputs: 2,
        maps: 4,
        kernel: 3,
        convolutions: 2,
        hidden: 8,
        layers: 1,
        classes: 3,
    }
}

fn options() -> ClassifierOptions {
    ClassifierOptions {
        steps: 150,
        batch: 16,
        learning_rate: 0.01,
        schedule: Schedule::Cosine { floor: 0.05 },
        clip: Some(1.0),
        dropout: 0.2,
    }
}

/// Classes that differ by frequency; noise and phase differ from window to window. The first class
/// is common, the last rare.
fn examples(count: usize, seed: u64) -> Examples {
    let mut examples = Examples::new(STEPS, 2);
    let noise = values(count * STEPS * 2 + count, seed);
    for index in 0..count {
        let label = if index % 10 < 6 {
            0
        } else if index % 10 < 9 {
            1
        } else {
            2
        };
        let phase = 3.0 * noise[count * STEPS * 2 + index];
        let value = |k: usize| {
            ((k / 2) as f32 * (0.3 + 0.8 * f32::from(label)) + phase).sin()
                + 0.2 * noise[index * STEPS * 2 + k]
        };
        examples.push(&(0..STEPS * 2).map(value).collect::<Vec<_>>(), label);
    }
    examples
}

fn train(pools: &[&Examples], seed: u64) -> Classifier {
    train_classifier(&shape(), &options(), pools, seed, &|| false)
        .unwrap()
        .unwrap()
}

#[test]
fn learns_what_can_be_learned_the_rare_class_too() {
    let (training, unseen) = (examples(200, 1), examples(200, 2));
    let classifier = train(&[&training], 3);
    let said = classifier
        .classes(&unseen.values, unseen.len(), STEPS)
        .unwrap();
    for class in 0..3 {
        let own: Vec<usize> = (0..unseen.len())
            .filter(|index| unseen.labels[*index] == class)
            .collect();
        let right = own.iter().filter(|index| said[**index] == class).count();
        assert!(
            right * 10 >= own.len() * 9,
            "class {class}: {right} of {}",
            own.len()
        );
    }
}

#[test]
fn a_seed_gives_the_same_bits_on_any_thread_and_another_others() {
    let (one, two) = (examples(60, 1), examples(80, 5));
    let again = std::thread::scope(|scope| scope.spawn(|| train(&[&one, &two], 3)).join().unwrap());
    assert_eq!(train(&[&one, &two], 3), again);
    assert_ne!(train(&[&one, &two], 4), again);
    assert_ne!(train(&[&two, &one], 3), again);
}

#[test]
fn every_window_comes_once_before_any_comes_again() {
    let (mut deck, mut random) = (Deck::new(9), random(1, 1));
    let drawn: Vec<usize> = (0..27).map(|_| deck.draw(&mut random)).collect();
    for round in drawn.chunks(9) {
        let mut sorted = round.to_vec();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..9).collect::<Vec<_>>());
    }
    assert_ne!(drawn[..9], drawn[9..18]);
}

#[test]
fn what_is_unsound_is_named_and_an_interrupt_ends_it() {
    let pool = examples(20, 1);
    let message = |options: ClassifierOptions, pools: &[&Examples]| {
        train_classifier(&shape(), &options, pools, 1, &|| false)
            .unwrap_err()
            .to_string()
    };
    assert!(
        message(
            ClassifierOptions {
                dropout: 1.0,
                ..options()
            },
            &[&pool]
        )
        .contains("dropout: 1")
    );
    assert!(
        message(
            ClassifierOptions {
                batch: 1,
                ..options()
            },
            &[&pool, &pool]
        )
        .contains("batch: 1")
    );
    assert!(
        message(options(), &[&pool, &Examples::new(STEPS, 2)]).contains("windows of a pool: 0")
    );
    assert!(message(options(), &[]).contains("steps of a window is 0"));
    let diverged = ClassifierOptions {
        learning_rate: 1e30,
        clip: None,
        schedule: Schedule::Constant,
        ..options()
    };
    assert!(message(diverged, &[&pool]).contains("it has diverged"));
    assert_eq!(
        train_classifier(&shape(), &options(), &[&pool], 1, &|| true).unwrap(),
        None
    );
}

#[test]
fn loss_gradients_and_adam_are_those_of_pytorch() {
    let here = |name: &str| {
        std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name)
    };
    let bytes = std::fs::read(here("torch_classifier_passes.safetensors")).unwrap();
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let of = |name: &str| -> Vec<f32> {
        tensors
            .tensor(name)
            .unwrap()
            .data()
            .as_chunks()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes))
            .collect()
    };
    let close = |what: &str, found: &[f32], tolerance: f32| {
        let worst = found
            .iter()
            .zip(of(what))
            .map(|(found, expected)| (found - expected).abs())
            .fold(0.0, f32::max);
        assert!(
            found.len() == of(what).len() && worst <= tolerance,
            "{what}: greatest difference {worst}"
        );
    };
    let (mut classifier, _) = Classifier::read(&here("torch_classifier.safetensors")).unwrap();
    let labels: Vec<u8> = of("target").iter().map(|label| *label as u8).collect();
    let (input, weights, mut unused) = (of("input"), of("weight"), random(0, 0));
    let mut gradients = vec![0.0; classifier.parameters.len()];
    let mut adam = Adam::new(gradients.len());
    for step in 0..5 {
        let nothing = Dropout {
            probability: 0.0,
            random: &mut unused,
        };
        let loss = gradients_of(
            &classifier,
            (&input, &labels, &weights),
            11,
            nothing,
            &mut gradients,
        );
        if step == 0 {
            close("loss", &[loss as f32], 1e-6);
            for tensor in classifier.shape().tensors() {
                close(
                    &format!("gradient.{}", tensor.name),
                    &gradients[tensor.range],
                    1e-6,
                );
            }
        }
        adam.step(&mut classifier.parameters, &gradients, 1e-2, step + 1);
    }
    for tensor in classifier.shape().tensors() {
        // Adam divides by the gradient's size: where that is near its epsilon, the last bits of a
        // gradient show.
        close(
            &format!("trained.{}", tensor.name),
            &classifier.parameters[tensor.range],
            1e-4,
        );
    }
}
