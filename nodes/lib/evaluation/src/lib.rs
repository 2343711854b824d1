//! Evaluations, and the trainings of networks: what simulated IMUs are worth.
//!
//! - [`evaluate_fidelity`]: how far simulators are from measured IMUs, on people and positions that
//!   no network has seen.
//! - [`evaluate_activities`]: what virtual IMUs are worth to a classifier of activities.
//! - [`TrainingConfig`], [`training_pairs`], [`TrainingRun`]: what a training learns from, and the
//!   folder that it works in.
//! - [`SimulationDraws`]: people, ways of wearing and devices, drawn anew for each motion.
//! - [`fit_mapping`]: the distribution mapping from one recording to another.
//!
//! Computations that take long tell an [`Observer`] of their progress and ask it whether to stop.
//! Results are the same bytes for the same seed, on any number of threads.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod activity;
mod bootstrap;
mod error;
mod fidelity;
mod low_pass;
mod mapping;
mod observer;
mod report;
mod seeds;
mod simulation_draws;
mod training;
mod training_data;
mod wanted;

pub use activity::{
    Activities, ActivityOptions, ActivityResults, ChosenVariant, Comparison, ConditionResults,
    ConfusionMatrix, DeviceEstimate, Elapsed, PlacementEstimate, Run, Settings, Simulator, Skipped,
    SubjectData, SubjectScore, TrainingData, Variant, VirtualSide, evaluate_activities,
};
pub use error::EvaluationError;
pub use fidelity::{
    AnalyticSource, FidelityOptions, FidelityResults, Method, MethodResults, PhysicsSource,
    PictureResults, PoseErrors, PositionResults, PracticeResults, Protocol, RigidMethodResults,
    RigidPartResults, RigidPicture, RigidStudy, RigidStudyResults, SeenResults, StatedResults,
    Study, StudyResults, TruthSource, evaluate_fidelity,
};
pub use mapping::fit_mapping;
pub use observer::{Observer, Unobserved};
pub use report::Report;
pub use simulation_draws::{DrawnSimulation, SimulationDraws};
pub use training::{
    EngineChoice, Learnt, NetworkSizes, TrainingConfig, TrainingRun, TrainingSettings, data_summary,
};
pub use training_data::{DataFolder, DataSource, PoseSource, split_pairs, training_pairs};
