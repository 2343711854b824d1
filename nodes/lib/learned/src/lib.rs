//! What the analytic simulation cannot know, learned from pairs of motion and measured IMU
//! (CROMOSim, Hao, Wang, Zheng): networks, what they are fed, training, and the mapping of
//! distributions.
//!
//! A [`Patch`] is three triangles of the skin around a site; a [`SiteMotion`] their nine points
//! over time, with the analytic kinematics beside them. [`Input`] says what of it a [`Network`]
//! sees. [`Pair`] adds what a real IMU measured, turned into the world by the reference
//! orientation; [`PairBatches`] are windows of pairs, [`train::Training`] learns from them, and a
//! [`LearnedSimulator`] applies what was learned, [`LivePlacements`] sample by sample.
//! [`RankMapping`] maps distributions after the simulation. [`DeviceRanges`] and [`SourceErrors`]
//! make devices and sources of motion that nobody has seen.
//!
//! The [`kernels`] give the same bits on any number of threads and at any vector width. The feature
//! `burn` adds an engine for Burn's backends, the feature `cuda` its NVIDIA one.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod align;
#[cfg(feature = "burn")]
mod autodiff;
mod classifier;
mod degrade;
mod device_draw;
mod error;
mod features;
pub mod kernels;
mod layers;
mod learning;
mod live;
mod mapping;
mod named;
mod network;
mod pairs;
mod patch;
mod shape;
mod simulator;
mod site_motion;
mod stacks;
mod streaming;
mod tensors;
pub mod train;
mod virtual_pairs;
mod weights;
mod windows;

pub use align::{Alignment, align};
#[cfg(feature = "burn")]
pub use autodiff::BurnEngine;
pub use classifier::{
    Classifier, ClassifierOptions, ClassifierShape, Examples, cross_entropy, train_classifier,
};
pub use degrade::SourceErrors;
pub use device_draw::{DeviceRanges, DrawnDevice};
pub use error::LearnedError;
pub use features::{Input, Quantity};
pub use learning::{PairBatches, Turns, Windows};
pub use live::LivePlacements;
pub use mapping::{MappingFile, PlacementMapping, RankMapping};
pub use network::{Network, PreparedNetwork};
pub use pairs::{Pair, PairNames, Target};
pub use patch::{PATCH_POINTS, Patch};
pub use shape::{Direction, MOST_PARAMETERS, NetworkShape, Tensor};
pub use simulator::{LearnedSimulator, WholeMotionCorrection, scheme_for_networks};
pub use site_motion::{NETWORK_RATE_HZ, SiteMotion};
pub use streaming::{StreamingBatch, StreamingNetwork};
pub use virtual_pairs::{DrawnWearer, KnownMotion, WearerRanges, draw_shape};
pub use windows::{Blend, HOP, WINDOW, window_starts};
