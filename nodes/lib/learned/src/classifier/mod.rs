//! Activities from windows of IMU readings: DeepConvLSTM (Ordonez and Roggen 2016, Sensors
//! 16(1):115), forward, backward and training.
//!
//! Four convolutions along time, each channel by itself with the same weights (Conv2d kernels of
//! (5, 1) there), ReLU behind each, no padding; two LSTM layers over all channels' feature maps; of
//! the last step's hidden state a linear layer makes one number a class (logits). While training,
//! half of that hidden state is left out (dropout).

mod examples;
mod network;
mod shape;
mod training;

pub use examples::{Examples, cross_entropy};
pub use network::Classifier;
pub use shape::ClassifierShape;
pub use training::{ClassifierOptions, train_classifier};
