use super::*;
use crate::kernels::testing::{check_gradient, values, weighted_sum};

const STEPS: usize = 5;
const BATCH: usize = 3;
const INPUTS: usize = 4;
/// More than one register and a rest, for every vector width.
const HIDDEN: usize = 19;

/// Weights in one vector: W_ih, W_hh, b_ih, b_hh.
fn split(all: &[f32]) -> LstmWeights<'_> {
    let (input, rest) = all.split_at(4 * HIDDEN * INPUTS);
    let (recurrent, rest) = rest.split_at(4 * HIDDEN * HIDDEN);
    let (input_bias, recurrent_bias) = rest.split_at(4 * HIDDEN);
    LstmWeights {
        input,
        recurrent,
        input_bias,
        recurrent_bias,
    }
}

fn weights() -> Vec<f32> {
    values(4 * HIDDEN * (INPUTS + HIDDEN + 2), 1)
        .iter()
        .map(|value| 0.4 * value)
        .collect()
}

/// The definition, in f64, unit by unit.
fn by_definition(all: &[f32], input: &[f32]) -> Vec<f64> {
    let weights = split(all);
    let sigmoid = |x: f64| 1.0 / (1.0 + (-x).exp());
    let mut output = vec![0.0; STEPS * BATCH * HIDDEN];
    for sequence in 0..BATCH {
        let (mut hidden, mut cells) = (vec![0.0; HIDDEN], vec![0.0; HIDDEN]);
        for step in 0..STEPS {
            let x = &input[(step * BATCH + sequence) * INPUTS..][..INPUTS];
            let z = |gate: usize, unit: usize| {
                let row = gate * HIDDEN + unit;
                let of_input: f64 = (0..INPUTS)
                    .map(|index| f64::from(weights.input[row * INPUTS + index] * x[index]))
                    .sum();
                let of_hidden: f64 = (0..HIDDEN)
                    .map(|index| f64::from(weights.recurrent[row * HIDDEN + index]) * hidden[index])
                    .sum();
                of_input
                    + of_hidden
                    + f64::from(weights.input_bias[row] + weights.recurrent_bias[row])
            };
            let state: Vec<(f64, f64)> = (0..HIDDEN)
                .map(|unit| {
                    let cell =
                        sigmoid(z(1, unit)) * cells[unit] + sigmoid(z(0, unit)) * z(2, unit).tanh();
                    (cell, sigmoid(z(3, unit)) * cell.tanh())
                })
                .collect();
            (cells, hidden) = state.into_iter().unzip();
            output[(step * BATCH + sequence) * HIDDEN..][..HIDDEN].copy_from_slice(&hidden);
        }
    }
    output
}

fn in_reverse(values: &[f32]) -> Vec<f32> {
    values
        .chunks(values.len() / STEPS)
        .rev()
        .flatten()
        .copied()
        .collect()
}

#[test]
fn agrees_with_the_definition_in_both_orders() {
    let (all, input) = (weights(), values(STEPS * BATCH * INPUTS, 2));
    let expected = by_definition(&all, &input);
    let forward = Lstm::new(split(&all), Order::Forward).forward(&input, BATCH);
    assert!(
        forward
            .output()
            .iter()
            .zip(&expected)
            .all(|(found, expected)| (f64::from(*found) - expected).abs() < 2e-6)
    );
    let reverse = Lstm::new(split(&all), Order::Reverse).forward(&in_reverse(&input), BATCH);
    assert_eq!(in_reverse(reverse.output()), forward.output());
}

#[test]
fn step_by_step_gives_the_same_bits() {
    let (all, input) = (weights(), values(STEPS * BATCH * INPUTS, 2));
    let lstm = Lstm::new(split(&all), Order::Forward);
    let whole = lstm.forward(&input, BATCH);
    let mut state = LstmState::new(BATCH, HIDDEN);
    for (input, expected) in input
        .chunks(BATCH * INPUTS)
        .zip(whole.output().chunks(BATCH * HIDDEN))
    {
        lstm.step(input, &mut state);
        assert_eq!(state.hidden(), expected);
    }
}

#[test]
fn gradients_agree_with_differences_in_both_orders() {
    let (all, input, along) = (
        weights(),
        values(STEPS * BATCH * INPUTS, 2),
        values(STEPS * BATCH * HIDDEN, 3),
    );
    for order in [Order::Forward, Order::Reverse] {
        let loss = |all: &[f32], input: &[f32]| {
            weighted_sum(
                Lstm::new(split(all), order).forward(input, BATCH).output(),
                &along,
            )
        };
        let lstm = Lstm::new(split(&all), order);
        let mut found = vec![0.0; all.len() - 4 * HIDDEN];
        let (of_input_weights, rest) = found.split_at_mut(4 * HIDDEN * INPUTS);
        let (recurrent, bias) = rest.split_at_mut(4 * HIDDEN * HIDDEN);
        let gradients = LstmGradients {
            input: of_input_weights,
            recurrent,
            bias,
        };
        let of_input = lstm.backward(
            split(&all),
            &input,
            &lstm.forward(&input, BATCH),
            &along,
            gradients,
        );
        check_gradient("input", &input, &of_input, |input| loss(&all, input));
        let bias = found[4 * HIDDEN * (INPUTS + HIDDEN)..].to_vec();
        found.extend(bias);
        check_gradient("weights", &all, &found, |all| loss(all, &input));
    }
}

#[test]
fn gradients_come_on_top_of_what_is_there() {
    let (all, input, along) = (
        weights(),
        values(STEPS * BATCH * INPUTS, 2),
        values(STEPS * BATCH * HIDDEN, 3),
    );
    let lstm = Lstm::new(split(&all), Order::Forward);
    let tape = lstm.forward(&input, BATCH);
    let of_bias = |start: f32| {
        let (mut of_input, mut recurrent, mut bias) = (
            vec![0.0; 4 * HIDDEN * INPUTS],
            vec![0.0; 4 * HIDDEN * HIDDEN],
            vec![start; 4 * HIDDEN],
        );
        let gradients = LstmGradients {
            input: &mut of_input,
            recurrent: &mut recurrent,
            bias: &mut bias,
        };
        let _ = lstm.backward(split(&all), &input, &tape, &along, gradients);
        bias
    };
    assert!(
        of_bias(2.0)
            .iter()
            .zip(of_bias(0.0))
            .all(|(more, less)| (more - less - 2.0).abs() < 1e-5)
    );
}
