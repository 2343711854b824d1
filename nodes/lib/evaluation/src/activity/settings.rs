//! Sizes and numbers of an evaluation.

use cromosim_learned::train::Schedule;
use cromosim_learned::{ClassifierOptions, ClassifierShape};
use serde::Serialize;

use super::windows::WindowGrid;

/// Everything that the results depend on beside the data; it stands in results.json.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Seed of all that is drawn.
    pub seed: u64,
    /// Repetitions, each with other initial weights, draws of virtual people and choices of
    /// training subjects.
    pub seeds: usize,
    /// Samples per second of the windows, Hz.
    pub rate_hz: usize,
    /// Cutoff of the low-pass (Butterworth of second order, forward and back), Hz.
    pub low_pass_hz: f64,
    /// Samples of a window (1 s).
    pub window: usize,
    /// Samples from one window's start to the next one's (half a window).
    pub hop: usize,
    /// Virtual windows of each class.
    pub virtual_windows: usize,
    /// Standard deviation of the virtual people's shape coefficients.
    pub shape_std: f64,
    /// Range of how many times as fast as recorded virtual people move.
    pub speed: [f64; 2],
    /// Shares of the training subjects on the learning curve, the whole last.
    pub shares: Vec<f64>,
    /// Maps of each convolution of the classifier, a DeepConvLSTM.
    pub maps: usize,
    /// Taps of a convolution.
    pub kernel: usize,
    /// Convolutions, one after the other.
    pub convolutions: usize,
    /// Units of an LSTM layer.
    pub hidden: usize,
    /// LSTM layers.
    pub layers: usize,
    /// The classifier's training.
    pub training: ClassifierOptions,
}

impl Settings {
    /// The sizes of a full run. A window of 24 samples is what the network was made for (0.8 s at 30 Hz
    /// there).
    pub fn full(seed: u64) -> Self {
        Self {
            seed,
            seeds: 3,
            rate_hz: 24,
            low_pass_hz: 8.0,
            window: 24,
            hop: 12,
            virtual_windows: 400,
            shape_std: 1.0,
            speed: [0.8, 1.25],
            shares: vec![0.1, 0.25, 0.5, 1.0],
            maps: 16,
            kernel: 5,
            convolutions: 4,
            hidden: 64,
            layers: 2,
            training: ClassifierOptions {
                steps: 200,
                batch: 64,
                learning_rate: 4e-3,
                schedule: Schedule::Cosine { floor: 0.02 },
                clip: Some(1.0),
                dropout: 0.5,
            },
        }
    }

    /// A look at whether all of it runs; its scores say little.
    pub fn quick(seed: u64) -> Self {
        let full = Self::full(seed);
        let training = ClassifierOptions {
            steps: 30,
            batch: 16,
            learning_rate: 5e-3,
            ..full.training
        };
        Self {
            seeds: 1,
            virtual_windows: 20,
            shares: vec![0.5, 1.0],
            maps: 8,
            hidden: 16,
            training,
            ..full
        }
    }

    /// The windows' grid.
    pub fn grid(&self) -> WindowGrid {
        WindowGrid {
            rate_hz: self.rate_hz,
            low_pass_hz: self.low_pass_hz,
            window: self.window,
            hop: self.hop,
        }
    }

    /// The classifier for so many channels and classes.
    pub fn shape(&self, inputs: usize, classes: usize) -> ClassifierShape {
        let Self {
            maps,
            kernel,
            convolutions,
            hidden,
            layers,
            ..
        } = *self;
        ClassifierShape {
            inputs,
            maps,
            kernel,
            convolutions,
            hidden,
            layers,
            classes,
        }
    }
}
