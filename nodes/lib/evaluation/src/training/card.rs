//! What stands beside a model's weights: data, licences, sizes, scores.

use std::collections::BTreeMap;
use std::fmt::Write;

use cromosim_learned::{LearnedSimulator, NETWORK_RATE_HZ, Pair};

use super::config::TrainingConfig;
use super::engine::EngineChoice;
use crate::EvaluationError;
use crate::training_data::DataSource;

/// Seconds with a target.
fn seconds<'a>(pairs: impl Iterator<Item = &'a Pair>) -> f64 {
    pairs
        .map(|pair| pair.targets.iter().flatten().count() as f64 / NETWORK_RATE_HZ)
        .sum()
}

/// Root mean square per axis of what the analytic simulation leaves: acceleration, m/s2, and
/// angular velocity, rad/s; world axes.
fn analytic_rms(pairs: &[&Pair]) -> [f64; 2] {
    let mut all = SquaredErrors::default();
    for pair in pairs {
        let kinematics = &pair.motion.kinematics;
        let left = pair.rms(|sample| {
            (
                kinematics[sample].acceleration_in_world,
                kinematics[sample].angular_velocity_in_world,
            )
        });
        all.add(left.unwrap_or_default(), samples(pair));
    }
    all.roots()
}

/// A line for each subject: pairs, seconds, positions, and what the analytic simulation leaves.
pub fn data_summary(pairs: &[Pair]) -> Vec<String> {
    let mut subjects: Vec<&str> = pairs.iter().map(|pair| pair.subject.as_str()).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let line = |subject: &str| {
        let own: Vec<&Pair> = pairs
            .iter()
            .filter(|pair| pair.subject == subject)
            .collect();
        let mut positions: Vec<&str> = own.iter().map(|pair| pair.position.as_str()).collect();
        positions.sort_unstable();
        positions.dedup();
        let [acceleration, angular_velocity] = analytic_rms(&own);
        format!(
            "subject {subject}: {} pairs, {:.0} s, {}; the analytic simulation leaves {acceleration:.3} m/s2, {angular_velocity:.4} rad/s",
            own.len(),
            seconds(own.iter().copied()),
            positions.join(", ")
        )
    };
    subjects.into_iter().map(line).collect()
}

/// Samples with a target.
fn samples(pair: &Pair) -> f64 {
    pair.targets.iter().flatten().count() as f64
}

/// Squared errors per axis of acceleration and angular velocity, summed over samples.
#[derive(Clone, Copy, Default)]
struct SquaredErrors {
    sums: [f64; 2],
    samples: f64,
}

impl SquaredErrors {
    /// Adds a pair's root mean squares over so many samples.
    fn add(&mut self, rms: [f64; 2], samples: f64) {
        for (sum, own) in self.sums.iter_mut().zip(rms) {
            *sum += own.powi(2) * samples;
        }
        self.samples += samples;
    }

    fn roots(self) -> [f64; 2] {
        self.sums.map(|sum| (sum / self.samples.max(1.0)).sqrt())
    }
}

/// A table of the root mean square errors per axis of analytic and learned simulation by position;
/// world axes.
pub(super) fn scores(
    simulator: &LearnedSimulator,
    pairs: &[Pair],
) -> Result<String, EvaluationError> {
    let mut by_position: BTreeMap<&str, [SquaredErrors; 2]> = BTreeMap::new();
    for pair in pairs {
        let learned = simulator.simulate(&pair.motion)?;
        let rms = [&pair.motion.kinematics, &learned].map(|kinematics| {
            pair.rms(|sample| {
                (
                    kinematics[sample].acceleration_in_world,
                    kinematics[sample].angular_velocity_in_world,
                )
            })
        });
        if let [Some(analytic), Some(learned)] = rms {
            let errors = by_position.entry(&pair.position).or_default();
            errors[0].add(analytic, samples(pair));
            errors[1].add(learned, samples(pair));
        }
    }
    let mut text =
        "| position | acceleration, m/s2: analytic | learned | angular velocity, rad/s: analytic | learned |\n|---|---|---|---|---|\n"
            .to_owned();
    for (position, errors) in by_position {
        let [analytic, learned] = errors.map(SquaredErrors::roots);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {position} | {:.3} | {:.3} | {:.3} | {:.3} |",
            analytic[0], learned[0], analytic[1], learned[1]
        );
    }
    Ok(text)
}

/// The card; `pairs` are those of the training and of the validation.
pub(super) fn text(
    config: &TrainingConfig,
    simulator: &LearnedSimulator,
    pairs: [&[Pair]; 2],
    scores: &str,
) -> String {
    let mut text = head(config, simulator);
    for source in &config.data {
        let own = pairs
            .into_iter()
            .flatten()
            .filter(|pair| pair.subject == source.subject);
        let held_out = if config.validation.contains(&source.subject) {
            " (validation)"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "| {}{held_out} | {} | {:.0} | {} |",
            source.subject,
            description(source),
            seconds(own),
            source.licence
        );
    }
    let _ = write!(
        text,
        "\n## Scores on the validation subjects\n\nRoot mean square error per axis against the measured IMU turned into the world. These subjects chose when the training stopped, so they are no test.\n\n{scores}"
    );
    text
}

/// Who made the model, its sizes, and the head of the table of its data.
fn head(config: &TrainingConfig, simulator: &LearnedSimulator) -> String {
    let shape = config.shape();
    let engine = match config.training.engine {
        EngineChoice::Kernels => String::new(),
        other => format!(" by {other:?}"),
    };
    format!(
        "# Model card\n\nMade by cromosim {}, `cromosim train`{engine}, seed {}.\n\nInput `{}`, {} convolutions of {} channels and {} taps, {} LSTM layers of {} ({:?}), {} parameters a network; one for acceleration, one for angular velocity, at {NETWORK_RATE_HZ} Hz.\n\n## Data\n\n| subject | what | seconds | licence |\n|---|---|---|---|\n",
        env!("CARGO_PKG_VERSION"),
        config.training.seed,
        config.input.name(),
        shape.convolutions,
        shape.channels,
        shape.kernel,
        shape.layers,
        shape.hidden,
        shape.direction,
        simulator.networks()[0].parameters().len(),
    )
}

fn description(source: &DataSource) -> String {
    if source.motions.is_empty() {
        return format!("real devices: {}", source.recordings.join(", "));
    }
    let rate = source
        .rate_hz
        .map_or(String::new(), |rate_hz| format!(" of {rate_hz} Hz"));
    format!(
        "drawn people and devices on {}, {:?}{rate}, at {}, {} draws each",
        source.motions.join(", "),
        source.source,
        source.sites.join(", "),
        source.repeats
    )
}
