//! What an evaluation says.

use serde::Serialize;

use super::device::DeviceEstimate;
use super::scores::{Confusion, interval, mean};
use super::settings::Settings;
use super::simulated::Simulator;

/// The schema of results.json.
pub const SCHEMA: &str = "cromosim/har/1";

/// What is learned from. Tested is always on real devices of people who were not learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Training {
    /// Real windows.
    #[serde(rename = "R2R")]
    Real,
    /// Real windows and the same turned, half of every batch each: what drawn ways of wearing
    /// devices give without any virtual ones.
    #[serde(rename = "R2R, turned")]
    Turned,
    /// Virtual windows.
    #[serde(rename = "V2R")]
    Virtual,
    /// Both, half of every batch each.
    #[serde(rename = "Mix2R")]
    Mixed,
}

impl Training {
    /// As the paper calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "R2R",
            Self::Turned => "R2R, turned",
            Self::Virtual => "V2R",
            Self::Mixed => "Mix2R",
        }
    }
}

/// How virtual windows are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Variant {
    /// How motions become readings.
    pub simulator: Simulator,
    /// Their distributions are mapped to real ones.
    pub mapped: bool,
    /// The root does not travel (Lite).
    pub in_place: bool,
    /// Noise, biases, resolution and stamps are those estimated of the real devices.
    pub effects: bool,
}

impl Variant {
    /// Without anything further.
    pub const fn plain(simulator: Simulator) -> Self {
        Self {
            simulator,
            mapped: false,
            in_place: false,
            effects: false,
        }
    }

    /// The simulator's four: plain, mapped, in place, with effects.
    pub fn all_of(simulator: Simulator) -> [Self; 4] {
        let plain = Self::plain(simulator);
        [
            plain,
            Self {
                mapped: true,
                ..plain
            },
            Self {
                in_place: true,
                ..plain
            },
            Self {
                effects: true,
                ..plain
            },
        ]
    }

    /// Whether real readings are needed to make it.
    pub fn sees_real(self) -> bool {
        self.mapped || self.effects
    }

    /// What is done beside the simulator.
    pub fn further(self) -> &'static str {
        match (self.mapped, self.in_place, self.effects) {
            (false, false, false) => "plain",
            (true, false, false) => "distribution mapping",
            (false, true, false) => "in place (Lite)",
            (false, false, true) => "device effects",
            _ => "several",
        }
    }

    /// As in tables.
    pub fn name(self) -> String {
        format!("{}, {}", self.simulator.name(), self.further())
    }
}

/// One training's answer on one person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Which repetition, from 0 on.
    pub seed: usize,
    /// Who was tested.
    pub subject: String,
    /// Whose real windows were learned from, or were fitted to.
    pub known: Vec<String>,
    /// Macro F1.
    pub f1: f64,
    /// By true and said class.
    pub confusion: Confusion,
}

/// The mean score of a person over the seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectScore {
    /// Who.
    pub subject: String,
    /// Macro F1.
    pub f1: f64,
}

/// One way of learning.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// What is learned from.
    pub training: Training,
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
    /// By subject.
    pub subjects: Vec<SubjectScore>,
    /// F1 of each class over all runs' windows.
    pub class_f1: Vec<Option<f64>>,
    /// All runs together.
    pub confusion: Confusion,
    /// Every run.
    pub runs: Vec<Run>,
}

impl Cell {
    /// Puts runs together.
    pub fn of(
        training: Training,
        variant: Option<Variant>,
        share: f64,
        chosen: bool,
        mut runs: Vec<Run>,
        seed: u64,
    ) -> Self {
        runs.sort_by(|a, b| (&a.subject, a.seed).cmp(&(&b.subject, b.seed)));
        let mut confusion = Confusion::default();
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

    /// Score of a person.
    pub fn score(&self, subject: &str) -> Option<f64> {
        self.subjects
            .iter()
            .find(|score| score.subject == subject)
            .map(|score| score.f1)
    }

    /// As in tables and messages.
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

/// What one way of learning gains over another, person by person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The one.
    pub of: String,
    /// The other.
    pub over: String,
    /// Mean over subjects of the difference of their macro F1.
    pub gain: f64,
    /// 95 % interval of it, over subjects.
    pub interval: [f64; 2],
}

impl Comparison {
    /// Of two cells with the same people.
    pub fn of(one: &Cell, other: &Cell, seed: u64) -> Self {
        let gains: Vec<f64> = one
            .subjects
            .iter()
            .filter_map(|score| Some(score.f1 - other.score(&score.subject)?))
            .collect();
        Self {
            of: one.name(),
            over: other.name(),
            gain: mean(&gains),
            interval: interval(&gains, seed),
        }
    }
}

/// A way of learning that could not be tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Skipped {
    /// Which.
    pub what: String,
    /// Why.
    pub reason: String,
}

/// A person's data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectData {
    /// Who.
    pub subject: String,
    /// Windows of each class.
    pub windows: Vec<usize>,
}

/// The virtual side.
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
pub struct PlacedEstimate {
    /// Where.
    pub placement: String,
    /// What.
    pub estimate: DeviceEstimate,
}

/// The variant that the others' scores choose for a person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chosen {
    /// Who.
    pub subject: String,
    /// What.
    pub variant: Variant,
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Sizes and numbers.
    pub settings: Settings,
    /// Whose recordings.
    pub dataset: String,
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Placements of the devices.
    pub placements: Vec<String>,
    /// People.
    pub subjects: Vec<SubjectData>,
    /// Virtual people.
    pub virtual_side: VirtualSide,
    /// Devices, of all people together; a training's own come from those that it knows.
    pub devices: Vec<PlacedEstimate>,
    /// Ways of learning.
    pub cells: Vec<Cell>,
    /// What they gain.
    pub comparisons: Vec<Comparison>,
    /// The variants of the learning curve.
    pub chosen: Vec<Chosen>,
    /// What could not be tried.
    pub skipped: Vec<Skipped>,
}

impl Results {
    /// The cell of a way of learning.
    pub fn cell(
        &self,
        training: Training,
        variant: Option<Variant>,
        chosen: bool,
        share: f64,
    ) -> Option<&Cell> {
        self.cells.iter().find(|cell| {
            cell.training == training
                && cell.variant == variant
                && cell.chosen == chosen
                && cell.share == share
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn run(subject: &str, seed: usize, right: u32) -> Run {
        let confusion = Confusion(vec![vec![right, 10 - right], vec![0, 10]]);
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
        let cell = Cell::of(
            Training::Real,
            None,
            1.0,
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
            cell.subjects
                .iter()
                .map(|score| score.subject.as_str())
                .collect::<Vec<_>>(),
            ["a", "b"]
        );
        assert!(
            (cell.mean - (1.0 + run("b", 0, 4).f1) / 2.0).abs() < 1e-12
                && cell.interval[0] < cell.mean
                && cell.mean < cell.interval[1]
        );
        assert_eq!(cell.confusion.0, [[28, 12], [0, 40]]);
        let better = Cell::of(
            Training::Mixed,
            Some(Variant::plain(Simulator::Joint)),
            1.0,
            false,
            vec![run("b", 0, 9), run("a", 0, 10)],
            1,
        );
        let comparison = Comparison::of(&better, &cell, 1);
        assert!((comparison.gain - (run("b", 0, 9).f1 - run("b", 0, 4).f1) / 2.0).abs() < 1e-12);
        assert_eq!(
            comparison.of,
            "Mix2R (joint, plain), 100 % of the training subjects"
        );
    }
}
