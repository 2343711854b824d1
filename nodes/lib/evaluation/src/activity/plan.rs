//! The trainings that are run, and what their scores say together.

use rayon::prelude::*;

use super::condition::{Condition, TrainingData, Variant};
use super::experiment::{Experiment, Job, training_subjects};
use super::results::{ChosenVariant, Comparison, ConditionResults, Run};
use super::scores::mean;
use super::settings::Settings;
use super::simulator::Simulator;
use crate::EvaluationError;
use crate::seeds::mixed_seed;

/// What the trainings gave.
pub(super) struct PlanResults {
    /// Every condition.
    pub conditions: Vec<ConditionResults>,
    /// What conditions gain over each other.
    pub comparisons: Vec<Comparison>,
    /// The variants of the learning curve.
    pub chosen: Vec<ChosenVariant>,
    /// How many trainings there were.
    pub trainings: usize,
}

/// Runs every training: first all conditions, then those of the learning curve, whose variants the
/// first choose.
pub(super) fn run_plan(
    experiment: &Experiment<'_>,
    simulators: &[Simulator],
    quick: bool,
) -> Result<PlanResults, EvaluationError> {
    let settings = experiment.settings;
    let people = experiment.real.subjects.len();
    let conditions = conditions(settings, simulators, quick);
    let first: Vec<Job> = conditions
        .iter()
        .flat_map(|condition| jobs(*condition, people, settings))
        .collect();
    let parts = settings.shares.iter().filter(|share| **share < 1.0).count();
    let trainings = first.len() + parts * people * settings.seeds;
    experiment.observer.begin("trainings", trainings as u64);
    let first = CompletedJobs::run(first, experiment)?;
    let mut results: Vec<ConditionResults> = conditions
        .iter()
        .map(|condition| {
            let runs = first.runs(|job| job.condition == *condition);
            ConditionResults::from_runs(*condition, false, runs, settings.seed)
        })
        .collect();
    let names = experiment
        .real
        .subjects
        .iter()
        .map(|subject| subject.name.clone());
    let chosen: Vec<ChosenVariant> = names
        .map(|subject| choose(&results, &subject).map(|variant| ChosenVariant { subject, variant }))
        .collect::<Option<_>>()
        .unwrap_or_default();
    let second: Vec<Job> = settings
        .shares
        .iter()
        .filter(|share| **share < 1.0)
        .flat_map(|share| curve_jobs(&chosen, *share, settings))
        .collect();
    let second = CompletedJobs::run(second, experiment)?;
    experiment.observer.end();
    results.extend(curve_results(&chosen, &first, &second, settings));
    Ok(PlanResults {
        comparisons: comparisons(&results, settings.seed),
        conditions: results,
        chosen,
        trainings: first.jobs.len() + second.jobs.len(),
    })
}

/// Every condition: of real windows at every share, of virtual ones at the whole.
fn conditions(settings: &Settings, simulators: &[Simulator], quick: bool) -> Vec<Condition> {
    let variants = simulators
        .iter()
        .flat_map(|simulator| Variant::all_with(*simulator))
        // A quick run shows each step once: mapping, effects.
        .filter(|variant| !quick || variant.sees_real());
    let real = settings.shares.iter().flat_map(|share| {
        [TrainingData::Real, TrainingData::Turned].map(|training| Condition {
            training,
            variant: None,
            share: *share,
        })
    });
    let with_virtual = variants.flat_map(|variant| {
        [TrainingData::Virtual, TrainingData::Mixed].map(|training| Condition {
            training,
            variant: Some(variant),
            share: 1.0,
        })
    });
    real.chain(with_virtual).collect()
}

/// One training for each tested person and seed. Virtual windows alone do not depend on who is
/// tested: one training a seed, or, where they are fitted to a real person, two, so that that
/// person is never tested.
fn jobs(condition: Condition, people: usize, settings: &Settings) -> Vec<Job> {
    let job = |seed: usize, known: Vec<usize>, tested: Vec<usize>| Job {
        condition,
        seed,
        known,
        tested,
    };
    let mut jobs = Vec::new();
    for seed in 0..settings.seeds {
        match (condition.training, condition.variant) {
            (TrainingData::Virtual, Some(variant)) if variant.sees_real() => {
                jobs.push(job(seed, vec![0], (1..people).collect()));
                jobs.push(job(seed, vec![1], vec![0]));
            }
            (TrainingData::Virtual, _) => {
                jobs.push(job(seed, Vec::new(), (0..people).collect()));
            }
            _ => jobs.extend((0..people).map(|tested| {
                let order = mixed_seed(&[settings.seed, 13, seed as u64]);
                let known = training_subjects(people, tested, condition.share, order);
                job(seed, known, vec![tested])
            })),
        }
    }
    jobs
}

/// The trainings of Mix2R at a share, each person's with the variant that is chosen for them.
fn curve_jobs(chosen: &[ChosenVariant], share: f64, settings: &Settings) -> Vec<Job> {
    let jobs_of_person = |(tested, chosen_variant): (usize, &ChosenVariant)| {
        let condition = Condition {
            training: TrainingData::Mixed,
            variant: Some(chosen_variant.variant),
            share,
        };
        jobs(condition, chosen.len(), settings)
            .into_iter()
            .filter(move |job| job.tested == [tested])
    };
    chosen.iter().enumerate().flat_map(jobs_of_person).collect()
}

/// Mix2R at every share, each person's with the variant that is chosen for them; `whole` holds the
/// trainings with all training subjects, `parts` the others. Empty where nothing was chosen.
fn curve_results(
    chosen: &[ChosenVariant],
    whole: &CompletedJobs,
    parts: &CompletedJobs,
    settings: &Settings,
) -> Vec<ConditionResults> {
    if chosen.is_empty() {
        return Vec::new();
    }
    let at_share = |share: &f64| {
        let done = if *share < 1.0 { parts } else { whole };
        let wanted = curve_jobs(chosen, *share, settings);
        let condition = Condition {
            training: TrainingData::Mixed,
            variant: None,
            share: *share,
        };
        let runs = done.runs(|job| wanted.contains(job));
        ConditionResults::from_runs(condition, true, runs, settings.seed)
    };
    settings.shares.iter().map(at_share).collect()
}

/// Trainings with what they gave.
struct CompletedJobs {
    jobs: Vec<Job>,
    runs: Vec<Vec<Run>>,
}

impl CompletedJobs {
    fn run(jobs: Vec<Job>, experiment: &Experiment<'_>) -> Result<Self, EvaluationError> {
        let one = |job: &Job| {
            let runs = experiment.run(job);
            experiment.observer.advance(1);
            runs
        };
        // One by one, so that no thread is left with a long queue at the end.
        let runs = jobs
            .par_iter()
            .with_max_len(1)
            .map(one)
            .collect::<Result<_, _>>()?;
        Ok(Self { jobs, runs })
    }

    /// The runs of the jobs that are asked for.
    fn runs(&self, wanted: impl Fn(&Job) -> bool) -> Vec<Run> {
        self.jobs
            .iter()
            .zip(&self.runs)
            .filter(|(job, _)| wanted(job))
            .flat_map(|(_, runs)| runs.clone())
            .collect()
    }
}

/// The variant of Mix2R with the best mean over all people but one; the first of equals.
fn choose(results: &[ConditionResults], without: &str) -> Option<Variant> {
    let mixed = results
        .iter()
        .filter(|result| result.training == TrainingData::Mixed);
    let others = |result: &ConditionResults| {
        let scores = result
            .subjects
            .iter()
            .filter(|score| score.subject != without)
            .map(|score| score.f1);
        mean(&scores.collect::<Vec<_>>())
    };
    let mut best: Option<(f64, Variant)> = None;
    for (score, variant) in mixed.filter_map(|result| Some((others(result), result.variant?))) {
        if best.is_none_or(|(least, _)| score > least) {
            best = Some((score, variant));
        }
    }
    best.map(|(_, variant)| variant)
}

/// Each Mix2R over R2R of the same share, without turned copies and with them; those over R2R; of
/// V2R, each variant over its simulator's plain one, and over the analytic simulator's alike.
fn comparisons(results: &[ConditionResults], seed: u64) -> Vec<Comparison> {
    let find = |training: TrainingData, variant: Option<Variant>, share: f64| {
        results.iter().find(|result| {
            !result.chosen
                && result.training == training
                && result.variant == variant
                && result.share == share
        })
    };
    let over = |result: &ConditionResults| match (result.training, result.variant) {
        (TrainingData::Mixed, _) => vec![
            find(TrainingData::Real, None, result.share),
            find(TrainingData::Turned, None, result.share),
        ],
        (TrainingData::Turned, _) => vec![find(TrainingData::Real, None, result.share)],
        (TrainingData::Virtual, Some(variant)) => {
            let others = [
                Variant::plain(variant.simulator),
                Variant {
                    simulator: Simulator::Analytic,
                    ..variant
                },
            ];
            others
                .into_iter()
                .filter(|other| *other != variant)
                .map(|other| find(TrainingData::Virtual, Some(other), result.share))
                .collect()
        }
        _ => Vec::new(),
    };
    results
        .iter()
        .flat_map(|result| {
            over(result)
                .into_iter()
                .flatten()
                .map(|other| Comparison::between(result, other, seed))
                .collect::<Vec<_>>()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::activity::scores::ConfusionMatrix;

    #[test]
    fn nobody_is_tested_who_was_seen_and_everybody_is_tested() {
        let mapped = Variant::mapped(Simulator::Analytic);
        let settings = Settings {
            seeds: 2,
            ..Settings::full(1)
        };
        for (training, variant, share) in [
            (TrainingData::Real, None, 0.25),
            (TrainingData::Mixed, Some(mapped), 1.0),
            (TrainingData::Virtual, Some(mapped), 1.0),
            (
                TrainingData::Virtual,
                Some(Variant::plain(Simulator::Joint)),
                1.0,
            ),
        ] {
            let condition = Condition {
                training,
                variant,
                share,
            };
            let jobs = jobs(condition, 12, &settings);
            assert!(
                jobs.iter()
                    .all(|job| job.tested.iter().all(|tested| !job.known.contains(tested))),
                "{condition:?}"
            );
            for seed in 0..2 {
                let mut tested: Vec<usize> = jobs
                    .iter()
                    .filter(|job| job.seed == seed)
                    .flat_map(|job| job.tested.clone())
                    .collect();
                tested.sort_unstable();
                assert_eq!(tested, (0..12).collect::<Vec<_>>(), "{condition:?}");
            }
            let fewest = if training == TrainingData::Virtual {
                0
            } else {
                1
            };
            assert!(jobs.iter().all(|job| job.known.len() >= fewest
                && (training != TrainingData::Virtual || job.known.len() <= 1)));
        }
    }

    fn scored(variant: Variant, scores: [f64; 3]) -> ConditionResults {
        let run = |(index, f1): (usize, f64)| Run {
            seed: 0,
            subject: format!("s{index}"),
            known: Vec::new(),
            f1,
            confusion: ConfusionMatrix(vec![vec![1]]),
        };
        ConditionResults::from_runs(
            Condition {
                training: TrainingData::Mixed,
                variant: Some(variant),
                share: 1.0,
            },
            false,
            scores.into_iter().enumerate().map(run).collect(),
            1,
        )
    }

    #[test]
    fn a_variant_is_chosen_by_the_others_alone() {
        let [plain, mapped, ..] = Variant::all_with(Simulator::Analytic);
        // Mapping is best on average, but only because of s0.
        let results = [
            scored(plain, [0.1, 0.8, 0.8]),
            scored(mapped, [1.0, 0.7, 0.7]),
        ];
        assert_eq!(
            ["s0", "s1"].map(|without| choose(&results, without)),
            [Some(plain), Some(mapped)]
        );
        assert_eq!(choose(&[], "s0"), None);
    }
}
