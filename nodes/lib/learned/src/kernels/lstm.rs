//! Long short-term memory over a batch (Hochreiter and Schmidhuber 1997, with the forget gate of
//! Gers et al. 2000), gates in PyTorch's order:
//!
//! i, f, o = sigmoid(z), g = tanh(z), z = W_ih x_t + b_ih + W_hh h_(t-1) + b_hh; c_t = f c_(t-1) +
//! i g; h_t = o tanh(c_t).
//!
//! One product takes the inputs of all steps, one small product each step the hidden state; the way
//! back walks the steps once for the gates' gradients and takes three large products at its end.

use super::product::{PackedMatrix, View, add_product, add_rows, fill_rows};
use pulp::{Arch, Simd, WithSimd};

use super::functions::{sigmoid_lanes, tanh_lanes};

/// Which end of the sequence comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// From the first step to the last.
    Forward,
    /// From the last step to the first.
    Reverse,
}

/// Weights of one direction of one layer; H: hidden units.
#[derive(Debug, Clone, Copy)]
pub struct LstmWeights<'a> {
    /// W_ih, (4 H, inputs)
    pub input: &'a [f32],
    /// W_hh, (4 H, H)
    pub recurrent: &'a [f32],
    /// b_ih, (4 H)
    pub input_bias: &'a [f32],
    /// b_hh, (4 H)
    pub recurrent_bias: &'a [f32],
}

/// Gradients in the shapes of [`LstmWeights`]; what comes is added. Both biases have the same
/// gradient.
#[derive(Debug)]
pub struct LstmGradients<'a> {
    /// (4 H, inputs)
    pub input: &'a mut [f32],
    /// (4 H, H)
    pub recurrent: &'a mut [f32],
    /// (4 H)
    pub bias: &'a mut [f32],
}

/// One direction of one layer, its weights packed.
#[derive(Debug, Clone)]
pub struct Lstm {
    inputs: usize,
    hidden: usize,
    order: Order,
    by_input: PackedMatrix,
    by_hidden: PackedMatrix,
    bias: Vec<f32>,
}

/// What the way forward leaves for the way back.
#[derive(Debug)]
pub struct LstmTape {
    order: Order,
    /// Width of a step of all sequences: batch x H.
    wide: usize,
    /// After their functions, (steps, batch, 4 H).
    gates: Vec<f32>,
    /// c and tanh(c), (steps, batch, H).
    cells: Vec<f32>,
    tanh_cells: Vec<f32>,
    /// h with the zeros before the first step in the order's sense, (steps + 1, batch, H).
    hidden: Vec<f32>,
}

impl LstmTape {
    /// h of every step, (steps, batch, H).
    #[must_use]
    pub fn output(&self) -> &[f32] {
        match self.order {
            Order::Forward => &self.hidden[self.wide..],
            Order::Reverse => &self.hidden[..self.hidden.len() - self.wide],
        }
    }

    /// h before every step, (steps, batch, H).
    fn previous_hidden(&self) -> &[f32] {
        match self.order {
            Order::Forward => &self.hidden[..self.hidden.len() - self.wide],
            Order::Reverse => &self.hidden[self.wide..],
        }
    }
}

impl Lstm {
    /// Packs the weights.
    #[must_use]
    pub fn new(weights: LstmWeights<'_>, order: Order) -> Self {
        let gates = weights.input_bias.len();
        let (inputs, hidden) = (weights.input.len() / gates, gates / 4);
        Self {
            inputs,
            hidden,
            order,
            by_input: PackedMatrix::new(View::new(weights.input, gates, inputs).transposed()),
            by_hidden: PackedMatrix::new(View::new(weights.recurrent, gates, hidden).transposed()),
            bias: weights
                .input_bias
                .iter()
                .zip(weights.recurrent_bias)
                .map(|(input, recurrent)| input + recurrent)
                .collect(),
        }
    }

    /// Hidden units.
    #[must_use]
    pub fn hidden(&self) -> usize {
        self.hidden
    }

    fn steps_in_order(&self, steps: usize) -> impl DoubleEndedIterator<Item = usize> + use<> {
        let order = self.order;
        (0..steps).map(move |index| {
            if order == Order::Forward {
                index
            } else {
                steps - 1 - index
            }
        })
    }

    /// input: (steps, batch, inputs); hidden state and cells begin at zero.
    #[must_use]
    pub fn forward(&self, input: &[f32], batch: usize) -> LstmTape {
        let rows = input.len() / self.inputs;
        let (steps, wide, wide_gates) =
            (rows / batch, batch * self.hidden, 4 * batch * self.hidden);
        let mut gates = vec![0.0; steps * wide_gates];
        fill_rows(&mut gates, &self.bias);
        add_product(
            &mut gates,
            View::new(input, rows, self.inputs),
            &self.by_input,
        );
        let (mut cells, mut tanh_cells) = (vec![0.0; steps * wide], vec![0.0; steps * wide]);
        let mut hidden = vec![0.0; (steps + 1) * wide];
        let mut before: Option<usize> = None;
        for step in self.steps_in_order(steps) {
            if let Some(before) = before {
                cells.copy_within(before * wide..(before + 1) * wide, step * wide);
            }
            let (earlier, later) = hidden.split_at_mut((step + 1) * wide);
            let (previous, next) = match self.order {
                Order::Forward => (&earlier[step * wide..], &mut later[..wide]),
                Order::Reverse => (&later[..wide], &mut earlier[step * wide..]),
            };
            let gates = &mut gates[step * wide_gates..][..wide_gates];
            add_product(
                gates,
                View::new(previous, batch, self.hidden),
                &self.by_hidden,
            );
            let range = step * wide..(step + 1) * wide;
            let (cells, tanh_cells) = (&mut cells[range.clone()], &mut tanh_cells[range]);
            Arch::new().dispatch(CellsForward {
                units: self.hidden,
                gates,
                cells,
                tanh_cells,
                hidden: next,
            });
            before = Some(step);
        }
        LstmTape {
            order: self.order,
            wide,
            gates,
            cells,
            tanh_cells,
            hidden,
        }
    }

    /// One step from and to a state that the caller keeps; input: (batch, inputs). Allocates
    /// nothing.
    pub fn step(&self, input: &[f32], state: &mut LstmState) {
        let batch = input.len() / self.inputs;
        let LstmState {
            gates,
            cells,
            tanh_cells,
            hidden,
        } = state;
        fill_rows(gates, &self.bias);
        add_product(gates, View::new(input, batch, self.inputs), &self.by_input);
        add_product(
            gates,
            View::new(hidden, batch, self.hidden),
            &self.by_hidden,
        );
        Arch::new().dispatch(CellsForward {
            units: self.hidden,
            gates,
            cells,
            tanh_cells,
            hidden,
        });
    }

    /// Adds the weights' gradients, returns the input's. weights and input: as given before;
    /// output_gradient: (steps, batch, H).
    #[must_use]
    pub fn backward(
        &self,
        weights: LstmWeights<'_>,
        input: &[f32],
        tape: &LstmTape,
        output_gradient: &[f32],
        gradients: LstmGradients<'_>,
    ) -> Vec<f32> {
        let gates = 4 * self.hidden;
        let rows = input.len() / self.inputs;
        let of_gates = self.gate_gradients(weights.recurrent, tape, output_gradient);
        let of_gates_rows = View::new(&of_gates, rows, gates);
        add_product(
            gradients.input,
            of_gates_rows.transposed(),
            &PackedMatrix::new(View::new(input, rows, self.inputs)),
        );
        let previous = PackedMatrix::new(View::new(tape.previous_hidden(), rows, self.hidden));
        add_product(gradients.recurrent, of_gates_rows.transposed(), &previous);
        add_rows(gradients.bias, &of_gates);
        let mut of_input = vec![0.0; input.len()];
        add_product(
            &mut of_input,
            of_gates_rows,
            &PackedMatrix::new(View::new(weights.input, gates, self.inputs)),
        );
        of_input
    }

    /// Gradients before the gates' functions, (steps, batch, 4 H).
    fn gate_gradients(
        &self,
        recurrent: &[f32],
        tape: &LstmTape,
        output_gradient: &[f32],
    ) -> Vec<f32> {
        let (wide, wide_gates) = (tape.wide, 4 * tape.wide);
        let (batch, steps) = (wide / self.hidden, output_gradient.len() / wide);
        let back = PackedMatrix::new(View::new(recurrent, 4 * self.hidden, self.hidden));
        let mut of_gates = vec![0.0; tape.gates.len()];
        let (mut of_hidden, mut of_cells, nothing) =
            (vec![0.0; wide], vec![0.0; wide], vec![0.0; wide]);
        let mut order = self.steps_in_order(steps).rev().peekable();
        let mut behind: Option<usize> = None;
        while let Some(step) = order.next() {
            of_hidden.copy_from_slice(&output_gradient[step * wide..][..wide]);
            if let Some(behind) = behind {
                add_product(
                    &mut of_hidden,
                    View::new(
                        &of_gates[behind * wide_gates..][..wide_gates],
                        batch,
                        4 * self.hidden,
                    ),
                    &back,
                );
            }
            let previous_cells = order.peek().map_or(nothing.as_slice(), |previous| {
                &tape.cells[previous * wide..][..wide]
            });
            Arch::new().dispatch(CellsBackward {
                units: self.hidden,
                gates: &tape.gates[step * wide_gates..][..wide_gates],
                previous_cells,
                tanh_cells: &tape.tanh_cells[step * wide..][..wide],
                of_hidden: &of_hidden,
                of_cells: &mut of_cells,
                of_gates: &mut of_gates[step * wide_gates..][..wide_gates],
            });
            behind = Some(step);
        }
        of_gates
    }
}

/// What a layer keeps from step to step.
#[derive(Debug, Clone)]
pub struct LstmState {
    gates: Vec<f32>,
    cells: Vec<f32>,
    tanh_cells: Vec<f32>,
    hidden: Vec<f32>,
}

impl LstmState {
    /// Zeros.
    #[must_use]
    pub fn new(batch: usize, hidden: usize) -> Self {
        let zeros = vec![0.0; batch * hidden];
        Self {
            gates: vec![0.0; 4 * batch * hidden],
            cells: zeros.clone(),
            tanh_cells: zeros.clone(),
            hidden: zeros,
        }
    }

    /// h, (batch, H).
    #[must_use]
    pub fn hidden(&self) -> &[f32] {
        &self.hidden
    }

    /// Back to zeros.
    pub fn reset(&mut self) {
        self.cells.fill(0.0);
        self.hidden.fill(0.0);
    }

    /// One sequence of `batch` back to zeros.
    pub fn reset_sequence(&mut self, sequence: usize, batch: usize) {
        let wide = self.hidden.len() / batch;
        let row = sequence * wide..(sequence + 1) * wide;
        self.cells[row.clone()].fill(0.0);
        self.hidden[row].fill(0.0);
    }

    /// One sequence of `batch` as it was in another state of the same size.
    pub fn restore_sequence(&mut self, before: &Self, sequence: usize, batch: usize) {
        let wide = self.hidden.len() / batch;
        let row = sequence * wide..(sequence + 1) * wide;
        self.cells[row.clone()].copy_from_slice(&before.cells[row.clone()]);
        self.hidden[row.clone()].copy_from_slice(&before.hidden[row]);
    }
}

/// gates before their functions -> after; cells of the step before -> of this step.
struct CellsForward<'a> {
    units: usize,
    gates: &'a mut [f32],
    cells: &'a mut [f32],
    tanh_cells: &'a mut [f32],
    hidden: &'a mut [f32],
}

impl WithSimd for CellsForward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let units = self.units;
        let states = self
            .cells
            .chunks_exact_mut(units)
            .zip(self.tanh_cells.chunks_exact_mut(units))
            .zip(self.hidden.chunks_exact_mut(units));
        for (gates, ((cells, tanh_cells), hidden)) in
            self.gates.chunks_exact_mut(4 * units).zip(states)
        {
            let (i, rest) = gates.split_at_mut(units);
            let (f, rest) = rest.split_at_mut(units);
            let (g, o) = rest.split_at_mut(units);
            let [(i, i_end), (f, f_end), (g, g_end), (o, o_end)] =
                [i, f, g, o].map(S::as_mut_simd_f32s);
            let [
                (cells, cells_end),
                (tanh_cells, tanh_end),
                (hidden, hidden_end),
            ] = [cells, tanh_cells, hidden].map(S::as_mut_simd_f32s);
            cells_forward(simd, [i, f, g, o], [cells, tanh_cells, hidden]);
            cells_forward(
                pulp::Scalar,
                [i_end, f_end, g_end, o_end],
                [cells_end, tanh_end, hidden_end],
            );
        }
    }
}

#[inline(always)]
fn cells_forward<S: Simd>(
    simd: S,
    [i, f, g, o]: [&mut [S::f32s]; 4],
    [cells, tanh_cells, hidden]: [&mut [S::f32s]; 3],
) {
    let gates = i.iter_mut().zip(f).zip(g.iter_mut().zip(o));
    for (((i, f), (g, o)), ((cell, tanh_cell), hidden)) in
        gates.zip(cells.iter_mut().zip(tanh_cells).zip(hidden))
    {
        (*i, *f, *o) = (
            sigmoid_lanes(simd, *i),
            sigmoid_lanes(simd, *f),
            sigmoid_lanes(simd, *o),
        );
        *g = tanh_lanes(simd, *g);
        *cell = simd.mul_add_f32s(*f, *cell, simd.mul_f32s(*i, *g));
        *tanh_cell = tanh_lanes(simd, *cell);
        *hidden = simd.mul_f32s(*o, *tanh_cell);
    }
}

/// of_cells: gradient that the step behind sends to the cells -> what this step sends to the one
/// before.
struct CellsBackward<'a> {
    units: usize,
    gates: &'a [f32],
    previous_cells: &'a [f32],
    tanh_cells: &'a [f32],
    of_hidden: &'a [f32],
    of_cells: &'a mut [f32],
    of_gates: &'a mut [f32],
}

impl WithSimd for CellsBackward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let units = self.units;
        for (row, (of_gates, of_cells)) in self
            .of_gates
            .chunks_exact_mut(4 * units)
            .zip(self.of_cells.chunks_exact_mut(units))
            .enumerate()
        {
            let (gates, place) = (
                &self.gates[4 * row * units..][..4 * units],
                row * units..(row + 1) * units,
            );
            let gate = |index: usize| &gates[index * units..][..units];
            let known = [
                gate(0),
                gate(1),
                gate(2),
                gate(3),
                &self.previous_cells[place.clone()],
                &self.tanh_cells[place.clone()],
                &self.of_hidden[place],
            ];
            let known = known.map(S::as_simd_f32s);
            let (i, rest) = of_gates.split_at_mut(units);
            let (f, rest) = rest.split_at_mut(units);
            let (g, o) = rest.split_at_mut(units);
            let [
                (i, i_end),
                (f, f_end),
                (g, g_end),
                (o, o_end),
                (cells, cells_end),
            ] = [i, f, g, o, of_cells].map(S::as_mut_simd_f32s);
            cells_backward(simd, known.map(|(lanes, _)| lanes), [i, f, g, o, cells]);
            cells_backward(
                pulp::Scalar,
                known.map(|(_, end)| end),
                [i_end, f_end, g_end, o_end, cells_end],
            );
        }
    }
}

/// known: i, f, g, o, c of the step before, tanh(c), gradient of h; found: gradients of z of i, f,
/// g, o, and of c.
#[inline(always)]
fn cells_backward<S: Simd>(simd: S, known: [&[S::f32s]; 7], found: [&mut [S::f32s]; 5]) {
    let one = simd.splat_f32s(1.0);
    // s (1 - s) and 1 - t^2: the slopes of sigmoid and tanh by their values.
    let sigmoid_slope = |s| simd.mul_f32s(s, simd.sub_f32s(one, s));
    let tanh_slope = |t| simd.negate_mul_add_f32s(t, t, one);
    for index in 0..known[0].len() {
        let [i, f, g, o, previous_cell, tanh_cell, of_hidden] = known.map(|values| values[index]);
        let of_tanh_cell = simd.mul_f32s(of_hidden, o);
        let of_cell = simd.mul_add_f32s(of_tanh_cell, tanh_slope(tanh_cell), found[4][index]);
        found[0][index] = simd.mul_f32s(simd.mul_f32s(of_cell, g), sigmoid_slope(i));
        found[1][index] = simd.mul_f32s(simd.mul_f32s(of_cell, previous_cell), sigmoid_slope(f));
        found[2][index] = simd.mul_f32s(simd.mul_f32s(of_cell, i), tanh_slope(g));
        found[3][index] = simd.mul_f32s(simd.mul_f32s(of_hidden, tanh_cell), sigmoid_slope(o));
        found[4][index] = simd.mul_f32s(of_cell, f);
    }
}

#[cfg(test)]
#[path = "lstm_tests.rs"]
mod tests;
