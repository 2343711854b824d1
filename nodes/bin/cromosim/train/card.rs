//! What stands beside the weights: data, licences, sizes, scores.

use std::collections::BTreeMap;
use std::fmt::Write;

use cromosim_learned::{LearnedSimulator, NETWORK_RATE_HZ, Pair};

use super::config::Config;
use super::engine::Choice;

/// Seconds with a target.
pub fn seconds<'a>(pairs: impl Iterator<Item = &'a Pair>) -> f64 {
    pairs
        .map(|pair| pair.targets.iter().flatten().count() as f64 / NETWORK_RATE_HZ)
        .sum()
}

/// Root mean square per axis of what the analytic simulation leaves, m/s2 and rad/s.
pub fn analytic(pairs: &[&Pair]) -> [f64; 2] {
    let (mut sums, mut all) = ([0.0; 2], 0.0);
    for pair in pairs {
        let count = pair.targets.iter().flatten().count() as f64;
        let kinematics = &pair.motion.kinematics;
        let left = pair.rms(|sample| {
            (
                kinematics[sample].acceleration_in_world,
                kinematics[sample].angular_velocity_in_world,
            )
        });
        let left = left.unwrap_or_default();
        sums = [
            sums[0] + left[0].powi(2) * count,
            sums[1] + left[1].powi(2) * count,
        ];
        all += count;
    }
    sums.map(|sum: f64| (sum / all.max(1.0)).sqrt())
}

/// Notes in the weights' files.
pub fn notes(config: &Config) -> BTreeMap<String, String> {
    let mut licences: Vec<&str> = config
        .data
        .iter()
        .map(|source| source.licence.as_str())
        .collect();
    licences.sort_unstable();
    licences.dedup();
    BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("licences of the data".to_owned(), licences.join("; ")),
    ])
}

/// Root mean square error per axis of analytic and learned simulation by position, world axes.
pub fn scores(simulator: &LearnedSimulator, pairs: &[Pair]) -> anyhow::Result<String> {
    let mut sums: BTreeMap<&str, ([f64; 2], [f64; 2], f64)> = BTreeMap::new();
    for pair in pairs {
        let learned = simulator.simulate(&pair.motion)?;
        let analytic = &pair.motion.kinematics;
        let count = pair.targets.iter().flatten().count() as f64;
        let of_analytic = pair.rms(|sample| {
            (
                analytic[sample].acceleration_in_world,
                analytic[sample].angular_velocity_in_world,
            )
        });
        let of_learned = pair.rms(|sample| {
            (
                learned[sample].acceleration_in_world,
                learned[sample].angular_velocity_in_world,
            )
        });
        if let (Some(before), Some(after)) = (of_analytic, of_learned) {
            let (old, new, all) = sums.entry(&pair.position).or_default();
            for channel in 0..2 {
                old[channel] += before[channel].powi(2) * count;
                new[channel] += after[channel].powi(2) * count;
            }
            *all += count;
        }
    }
    let mut text =
        "| position | acceleration, m/s2: analytic | learned | angular velocity, rad/s: analytic | learned |\n|---|---|---|---|---|\n"
            .to_owned();
    for (position, (old, new, count)) in sums {
        let root = |sum: f64| (sum / count).sqrt();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {position} | {:.3} | {:.3} | {:.3} | {:.3} |",
            root(old[0]),
            root(new[0]),
            root(old[1]),
            root(new[1])
        );
    }
    Ok(text)
}

/// The card.
pub fn text(
    config: &Config,
    simulator: &LearnedSimulator,
    training: &[Pair],
    validation: &[Pair],
    scores: &str,
) -> String {
    let shape = config.shape();
    let mut text = format!(
        "# Model card\n\nMade by cromosim {}, `cromosim train`{}, seed {}.\n\nInput `{}`, {} convolutions of {} channels and {} taps, {} LSTM layers of {} ({:?}), {} parameters a network; one for acceleration, one for angular velocity, at {NETWORK_RATE_HZ} Hz.\n\n## Data\n\n| subject | what | seconds | licence |\n|---|---|---|---|\n",
        env!("CARGO_PKG_VERSION"),
        if config.training.engine == Choice::Kernels {
            String::new()
        } else {
            format!(" by {:?}", config.training.engine)
        },
        config.training.seed,
        config.input.name(),
        shape.convolutions,
        shape.channels,
        shape.kernel,
        shape.layers,
        shape.hidden,
        shape.direction,
        simulator.networks()[0].parameters().len(),
    );
    for source in &config.data {
        let what = if source.motions.is_empty() {
            format!("real devices: {}", source.recordings.join(", "))
        } else {
            format!(
                "drawn people and devices on {}, {:?}{}, at {}, {} draws each",
                source.motions.join(", "),
                source.source,
                source
                    .rate_hz
                    .map_or(String::new(), |rate_hz| format!(" of {rate_hz} Hz")),
                source.sites.join(", "),
                source.repeats
            )
        };
        let own = training
            .iter()
            .chain(validation)
            .filter(|pair| pair.subject == source.subject);
        let held = if config.validation.contains(&source.subject) {
            " (validation)"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "| {}{held} | {what} | {:.0} | {} |",
            source.subject,
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
