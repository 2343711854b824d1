use super::super::cross_entropy;
use super::*;
use crate::kernels::testing::{check_gradient, values, weighted_sum};

fn shape() -> ClassifierShape {
    ClassifierShape {
        inputs: 3,
        maps: 4,
        kernel: 3,
        convolutions: 2,
        hidden: 5,
        layers: 2,
        classes: 4,
    }
}

#[test]
fn gradients_of_the_whole_classifier_agree_with_differences() {
    let (shape, steps, batch) = (shape(), 7, 3);
    let classifier = Classifier::new(shape.clone(), 7).unwrap();
    let (windows, along) = (
        values(batch * steps * shape.inputs, 1),
        values(batch * shape.classes, 2),
    );
    // The same units are left out every time.
    let forward = |parameters: &[f32], windows: &[f32]| {
        let mut random = random(3, 0);
        let layers = Layers::new(&shape, parameters);
        layers.forward(
            windows,
            steps,
            Some(Dropout {
                probability: 0.5,
                random: &mut random,
            }),
        )
    };
    let loss =
        |parameters: &[f32], windows: &[f32]| weighted_sum(&forward(parameters, windows).0, &along);
    let (_, tape) = forward(&classifier.parameters, &windows);
    assert!(tape.kept.contains(&0.0) && tape.kept.contains(&2.0));
    let mut gradients = vec![0.0; classifier.parameters.len()];
    let of_input = Layers::new(&shape, &classifier.parameters).backward(
        &classifier.parameters,
        &tape,
        &along,
        &mut gradients,
    );
    check_gradient(
        "parameters",
        &classifier.parameters,
        &gradients,
        |parameters| loss(parameters, &windows),
    );
    let by_steps = swap_leading_axes(&windows, batch, steps, shape.inputs);
    let in_order = |by_steps: &[f32]| swap_leading_axes(by_steps, steps, batch, shape.inputs);
    check_gradient("windows", &by_steps, &of_input, |by_steps| {
        loss(&classifier.parameters, &in_order(by_steps))
    });
}

#[test]
fn every_channel_is_seen_by_itself() {
    let (shape, steps) = (shape(), 6);
    let classifier = Classifier::new(shape.clone(), 1).unwrap();
    let layers = Layers::new(&shape, &classifier.parameters);
    let maps = |windows: &[f32]| {
        layers
            .convolutions
            .forward(swap_leading_axes(windows, 1, steps, 3), 3, None)
    };
    let (mut windows, first) = (values(steps * 3, 4), 4);
    let before = maps(&windows);
    // Another value in the last channel changes the maps of the last channel alone.
    windows[3 * first + 2] += 1.0;
    let after = maps(&windows);
    for (index, (before, after)) in before.iter().zip(&after).enumerate() {
        let channel = index / shape.maps % shape.inputs;
        assert!(
            channel == 2 || before == after,
            "element {index} of channel {channel}"
        );
    }
    assert_ne!(before, after);
}

#[test]
fn logits_do_not_depend_on_the_batch_and_bad_input_is_refused() {
    let (shape, steps, count) = (shape(), 9, 150);
    let classifier = Classifier::new(shape.clone(), 5).unwrap();
    let windows = values(count * steps * shape.inputs, 9);
    let all = classifier.logits(&windows, count, steps).unwrap();
    let alone = classifier
        .logits(&windows[140 * steps * 3..141 * steps * 3], 1, steps)
        .unwrap();
    assert_eq!(all[140 * 4..141 * 4], alone);
    let largest = classifier.classes(&windows, count, steps).unwrap();
    assert!(
        largest
            .iter()
            .zip(all.chunks(4))
            .all(|(class, row)| row.iter().all(|value| *value <= row[usize::from(*class)]))
    );
    assert!(
        classifier
            .logits(&windows[1..], count, steps)
            .unwrap_err()
            .to_string()
            .contains("150 sequences x 9 steps")
    );
    let short = classifier
        .logits(&windows[..12], 1, 4)
        .unwrap_err()
        .to_string();
    assert!(
        short.contains("steps of a window is 4, it may be 5"),
        "{short}"
    );
}

#[test]
fn files_keep_every_bit_and_others_are_refused() {
    let classifier = Classifier::new(shape(), 2).unwrap();
    let (notes, path) = (
        BTreeMap::from([("seed".to_owned(), "2".to_owned())]),
        Path::new("c.safetensors"),
    );
    let bytes = classifier.to_bytes(&notes, path).unwrap();
    assert_eq!(
        Classifier::from_bytes(&bytes, path).unwrap(),
        (classifier, notes)
    );
    let network = crate::Network::from_bytes(&bytes, path)
        .unwrap_err()
        .to_string();
    assert!(
        network.contains("c.safetensors") && network.contains("cromosim"),
        "{network}"
    );
    assert!(Classifier::from_bytes(&bytes[..bytes.len() - 4], path).is_err());
}

#[test]
fn a_wrong_class_pulls_its_logit_down() {
    let mut logits = [0.3, -0.2, 0.9, 0.1];
    cross_entropy(&mut logits, &[1], &[1.0], 1.0);
    assert!(logits[1] < 0.0 && logits[2] > 0.0 && (logits.iter().sum::<f32>()).abs() < 1e-6);
}
