//! The results of an evaluation, as results.json holds them.

use serde::Serialize;

use super::condition::{Condition, TrainingData, Variant};
use super::device::DeviceEstimate;
use super::scores::{ConfusionMatrix, interval, mean};
use super::settings::Settings;

/// The schema of results.json.
pub const SCHEMA: &str = "cromosim/har/1";

/// One training's answer on one person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// The repetition, from 0 on.
    pub seed: usize,
    /// The person who was tested.
    pub subject: String,
    /// Whose real windows were learned from, or were fitted to.
    pub known: Vec<String>,
    /// Macro F1.
    pub f1: f64,
    /// Windows by true and predicted class.
    pub confusion: ConfusionMatrix,
}

/// The mean score of a person over the seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectScore {
    /// The person's name.
    pub subject: String,
    /// Macro F1.
    pub f1: f64,
}

/// How well a classifier does that learned from one condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionResults {
    /// What is learned from.
    pub training: TrainingData,
    /// How virtual windows are made; none of real ones, and where it was chosen for each person
    /// (`chosen`).
    pub variant: Option<Variant>,
    /// The variant of each tested person was chosen by the scores of the others.
    pub chosen: bool,
    /// Share of the training subjects.
    pub share: f64,
    /// Mean over subjects of their means over seeds.
    pub mean: f64,
    /// 95 % interval of it, over subjects.
    pub interval: [f64; 2],
    /// The mean score of each person.
    pub subjects: Vec<SubjectScore>,
    /// F1 of each class over all runs' windows.
    pub class_f1: Vec<Option<f64>>,
    /// The confusion of all runs together.
    pub confusion: ConfusionMatrix,
    /// Every run, by person and repetition.
    pub runs: Vec<Run>,
}

impl ConditionResults {
    /// Puts runs together; `chosen` says that each person's variant was chosen by the scores of the
    /// others.
    pub(super) fn from_runs(
        condition: Condition,
        chosen: bool,
        mut runs: Vec<Run>,
        seed: u64,
    ) -> Self {
        let Condition {
            training,
            variant,
            share,
        } = condition;
        runs.sort_by(|a, b| (&a.subject, a.seed).cmp(&(&b.subject, b.seed)));
        let mut confusion = ConfusionMatrix::default();
        let mut subjects: Vec<SubjectScore> = Vec::new();
        for own in runs.chunk_by(|a, b| a.subject == b.subject) {
            own.iter().for_each(|run| confusion.add(&run.confusion));
            let f1 = mean(&own.iter().map(|run| run.f1).collect::<Vec<_>>());
            subjects.push(SubjectScore {
                subject: own[0].subject.clone(),
                f1,
            });
        }
        let scores: Vec<f64> = subjects.iter().map(|score| score.f1).collect();
        let class_f1 = (0..confusion.0.len())
            .map(|class| confusion.f1(class))
            .collect();
        Self {
            training,
            variant,
            chosen,
            share,
            mean: mean(&scores),
            interval: interval(&scores, seed),
            subjects,
            class_f1,
            confusion,
            runs,
        }
    }

    /// The mean macro F1 of a person.
    pub fn score(&self, subject: &str) -> Option<f64> {
        self.subjects
            .iter()
            .find(|score| score.subject == subject)
            .map(|score| score.f1)
    }

    /// The name in tables and comparisons.
    pub fn name(&self) -> String {
        let variant = match (self.variant, self.chosen) {
            (Some(variant), _) => format!(" ({})", variant.name()),
            (None, true) => " (chosen)".to_owned(),
            (None, false) => String::new(),
        };
        format!(
            "{}{variant}, {:.0} % of the training subjects",
            self.training.name(),
            100.0 * self.share
        )
    }
}

/// What one condition gains over another, person by person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The condition that gains.
    #[serde(rename = "of")]
    pub one: String,
    /// The condition that it is compared with.
    pub over: String,
    /// Mean over subjects of the difference of their macro F1.
    pub gain: f64,
    /// 95 % interval of it, over subjects.
    pub interval: [f64; 2],
}

impl Comparison {
    /// Of two conditions with the same people.
    pub(super) fn between(one: &ConditionResults, other: &ConditionResults, seed: u64) -> Self {
        let gains: Vec<f64> = one
            .subjects
            .iter()
            .filter_map(|score| Some(score.f1 - other.score(&score.subject)?))
            .collect();
        Self {
            one: one.name(),
            over: other.name(),
            gain: mean(&gains),
            interval: interval(&gains, seed),
        }
    }
}

/// A condition that could not be tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Skipped {
    /// What is left out.
    pub what: String,
    /// The reason, as a phrase.
    pub reason: String,
}

/// How much data a person has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectData {
    /// The person's name.
    pub subject: String,
    /// Windows of each class.
    pub windows: Vec<usize>,
}

/// What virtual people were made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VirtualSide {
    /// Clips that were played.
    pub clips: usize,
    /// Clips left out as atypical.
    pub left_out: Vec<String>,
    /// Draws of a person and a clip, for each seed.
    pub draws: Vec<usize>,
    /// Windows of each class, for each seed.
    pub windows: Vec<Vec<usize>>,
}

/// What is estimated of a placement's devices.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlacementEstimate {
    /// The placement's name.
    pub placement: String,
    /// What the recordings tell of the devices there.
    pub estimate: DeviceEstimate,
}

/// The variant that the others' scores choose for a person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenVariant {
    /// The person's name.
    pub subject: String,
    /// The variant that scores best on the others.
    pub variant: Variant,
}

/// Everything that an evaluation found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActivityResults {
    /// Format and its version, `SCHEMA`.
    pub schema: &'static str,
    /// Sizes and numbers.
    pub settings: Settings,
    /// The name of the data set.
    pub dataset: String,
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Placements of the devices.
    pub placements: Vec<String>,
    /// The people who were tested.
    pub subjects: Vec<SubjectData>,
    /// Clips and windows of the virtual people.
    pub virtual_side: VirtualSide,
    /// Devices, of all people together; a training's own come from those that it knows.
    pub devices: Vec<PlacementEstimate>,
    /// Every condition.
    #[serde(rename = "cells")]
    pub conditions: Vec<ConditionResults>,
    /// What conditions gain over each other.
    pub comparisons: Vec<Comparison>,
    /// The variants of the learning curve.
    pub chosen: Vec<ChosenVariant>,
    /// What could not be tried.
    pub skipped: Vec<Skipped>,
}

impl ActivityResults {
    /// The results of a condition.
    pub(super) fn condition(
        &self,
        training: TrainingData,
        variant: Option<Variant>,
        share: f64,
    ) -> Option<&ConditionResults> {
        self.find(training, variant, false, share)
    }

    /// Mix2R by the variant that the other people's scores chose for each person.
    pub(super) fn mixed_as_chosen(&self, share: f64) -> Option<&ConditionResults> {
        self.find(TrainingData::Mixed, None, true, share)
    }

    fn find(
        &self,
        training: TrainingData,
        variant: Option<Variant>,
        chosen: bool,
        share: f64,
    ) -> Option<&ConditionResults> {
        self.conditions.iter().find(|found| {
            found.training == training
                && found.variant == variant
                && found.chosen == chosen
                && found.share == share
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::simulator::Simulator;
    use super::*;

    fn run(subject: &str, seed: usize, right: u32) -> Run {
        let confusion = ConfusionMatrix(vec![vec![right, 10 - right], vec![0, 10]]);
        Run {
            seed,
            subject: subject.to_owned(),
            known: Vec::new(),
            f1: confusion.macro_f1(),
            confusion,
        }
    }

    #[test]
    fn seeds_are_averaged_before_subjects() {
        let real = Condition {
            training: TrainingData::Real,
            variant: None,
            share: 1.0,
        };
        let learnt = ConditionResults::from_runs(
            real,
            false,
            vec![
                run("b", 0, 4),
                run("a", 1, 10),
                run("a", 0, 10),
                run("b", 1, 4),
            ],
            1,
        );
        assert_eq!(
            learnt
                .subjects
                .iter()
                .map(|score| score.subject.as_str())
                .collect::<Vec<_>>(),
            ["a", "b"]
        );
        assert!(
            (learnt.mean - (1.0 + run("b", 0, 4).f1) / 2.0).abs() < 1e-12
                && learnt.interval[0] < learnt.mean
                && learnt.mean < learnt.interval[1]
        );
        assert_eq!(learnt.confusion.0, [[28, 12], [0, 40]]);
        let better = ConditionResults::from_runs(
            Condition {
                training: TrainingData::Mixed,
                variant: Some(Variant::plain(Simulator::Joint)),
                share: 1.0,
            },
            false,
            vec![run("b", 0, 9), run("a", 0, 10)],
            1,
        );
        let comparison = Comparison::between(&better, &learnt, 1);
        assert!((comparison.gain - (run("b", 0, 9).f1 - run("b", 0, 4).f1) / 2.0).abs() < 1e-12);
        assert_eq!(
            comparison.one,
            "Mix2R (joint, plain), 100 % of the training subjects"
        );
    }
}
