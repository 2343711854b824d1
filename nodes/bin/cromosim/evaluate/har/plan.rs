//! Which trainings there are, in which order, and what comes of them.

use rayon::prelude::*;

use super::results::{Cell, Chosen, Comparison, Run, Training, Variant};
use super::scores::mean;
use super::simulated::Simulator;
use super::trainings::{Ground, Job, training_subjects};
use crate::progress;
use crate::train::data::mix;

/// What the trainings gave.
pub struct Planned {
    /// Ways of learning.
    pub cells: Vec<Cell>,
    /// What they gain.
    pub comparisons: Vec<Comparison>,
    /// The variants of the learning curve.
    pub chosen: Vec<Chosen>,
    /// How many there were.
    pub trainings: usize,
}

/// The simulators of a run.
pub fn simulators(quick: bool, learned: bool) -> Vec<Simulator> {
    let all = Simulator::ALL
        .into_iter()
        .filter(|simulator| *simulator != Simulator::Learned || learned);
    all.filter(|simulator| !quick || *simulator != Simulator::Joint)
        .collect()
}

/// The ways of making virtual windows.
fn variants(simulators: &[Simulator], quick: bool) -> Vec<Variant> {
    let all = simulators
        .iter()
        .flat_map(|simulator| Variant::all_of(*simulator));
    // A quick run shows each step once: mapping, effects.
    all.filter(|variant| !quick || variant.sees_real())
        .collect()
}

/// A way of learning before it has runs.
type Way = (Training, Option<Variant>, f64);

/// One training for each tested person and seed. Virtual windows alone do not depend on who is
/// tested: one training a seed, or, where they are fitted to a real person, two, so that that
/// person is never tested.
fn jobs(way: Way, people: usize, seeds: usize, seed_of: impl Fn(usize) -> u64) -> Vec<Job> {
    let (training, variant, share) = way;
    let job = |seed: usize, known: Vec<usize>, tested: Vec<usize>| Job {
        training,
        variant,
        share,
        seed,
        known,
        tested,
    };
    let mut jobs = Vec::new();
    for seed in 0..seeds {
        match (training, variant) {
            (Training::Virtual, Some(variant)) if variant.sees_real() => {
                jobs.push(job(seed, vec![0], (1..people).collect()));
                jobs.push(job(seed, vec![1], vec![0]));
            }
            (Training::Virtual, _) => jobs.push(job(seed, Vec::new(), (0..people).collect())),
            _ => jobs.extend((0..people).map(|tested| {
                job(
                    seed,
                    training_subjects(people, tested, share, seed_of(seed)),
                    vec![tested],
                )
            })),
        }
    }
    jobs
}

/// Runs everything.
pub fn run(ground: &Ground<'_>, simulators: &[Simulator], quick: bool) -> anyhow::Result<Planned> {
    let (people, settings) = (ground.real.subjects.len(), ground.settings);
    let seed_of = |seed: usize| mix(&[settings.seed, 13, seed as u64]);
    let of_way = |way: Way| jobs(way, people, settings.seeds, seed_of);
    let variants = variants(simulators, quick);
    let mut ways: Vec<Way> = settings
        .shares
        .iter()
        .flat_map(|share| {
            [Training::Real, Training::Turned].map(|training| (training, None, *share))
        })
        .collect();
    ways.extend(variants.iter().flat_map(|variant| {
        [Training::Virtual, Training::Mixed].map(|training| (training, Some(*variant), 1.0))
    }));
    let first: Vec<Job> = ways.iter().flat_map(|way| of_way(*way)).collect();
    let curve =
        settings.shares.iter().filter(|share| **share < 1.0).count() * people * settings.seeds;
    let bar = progress::bar((first.len() + curve) as u64, "trainings");
    let runs = run_all(ground, &first, &bar)?;
    let mut cells: Vec<Cell> = ways
        .iter()
        .map(|way| cell(way, false, of(way, &first, &runs), settings.seed))
        .collect();

    let chosen: Vec<Variant> = (0..people)
        .map(|person| choose(&cells, &ground.real.subjects[person].name))
        .collect::<Option<_>>()
        .unwrap_or_default();
    let at = |share: f64| -> Vec<Job> {
        let with = |tested: usize| {
            jobs(
                (Training::Mixed, chosen.get(tested).copied(), share),
                people,
                settings.seeds,
                seed_of,
            )
        };
        (0..people)
            .flat_map(|tested| {
                with(tested)
                    .into_iter()
                    .filter(move |job| job.tested == [tested])
            })
            .collect()
    };
    let shares: &[f64] = if chosen.is_empty() {
        &[]
    } else {
        &settings.shares
    };
    let second: Vec<Job> = shares
        .iter()
        .filter(|share| **share < 1.0)
        .flat_map(|share| at(*share))
        .collect();
    let second_runs = run_all(ground, &second, &bar)?;
    bar.finish_and_clear();
    for share in shares {
        let (jobs, all_runs) = if *share < 1.0 {
            (&second, &second_runs)
        } else {
            (&first, &runs)
        };
        let wanted = at(*share);
        let own = jobs
            .iter()
            .zip(all_runs)
            .filter(|(job, _)| wanted.contains(job))
            .flat_map(|(_, runs)| runs.clone())
            .collect();
        cells.push(Cell::of(
            Training::Mixed,
            None,
            *share,
            true,
            own,
            settings.seed,
        ));
    }
    let comparisons = comparisons(&cells, settings.seed);
    let names = ground
        .real
        .subjects
        .iter()
        .map(|subject| subject.name.clone());
    let chosen = names
        .zip(chosen)
        .map(|(subject, variant)| Chosen { subject, variant })
        .collect();
    Ok(Planned {
        cells,
        comparisons,
        chosen,
        trainings: first.len() + second.len(),
    })
}

fn run_all(
    ground: &Ground<'_>,
    jobs: &[Job],
    bar: &indicatif::ProgressBar,
) -> anyhow::Result<Vec<Vec<Run>>> {
    let one = |job: &Job| {
        let runs = ground.run(job);
        bar.inc(1);
        runs
    };
    // One by one, so that no thread is left with a long queue at the end.
    jobs.par_iter().with_max_len(1).map(one).collect()
}

fn of(way: &Way, jobs: &[Job], runs: &[Vec<Run>]) -> Vec<Run> {
    let own = |job: &Job| (job.training, job.variant, job.share) == *way;
    jobs.iter()
        .zip(runs)
        .filter(|(job, _)| own(job))
        .flat_map(|(_, runs)| runs.clone())
        .collect()
}

fn cell((training, variant, share): &Way, chosen: bool, runs: Vec<Run>, seed: u64) -> Cell {
    Cell::of(*training, *variant, *share, chosen, runs, seed)
}

/// The variant of Mix2R with the best mean over all people but one; the first of equals.
fn choose(cells: &[Cell], without: &str) -> Option<Variant> {
    let mixed = cells.iter().filter(|cell| cell.training == Training::Mixed);
    let others = |cell: &Cell| {
        let scores = cell
            .subjects
            .iter()
            .filter(|score| score.subject != without)
            .map(|score| score.f1);
        mean(&scores.collect::<Vec<_>>())
    };
    let mut best: Option<(f64, Variant)> = None;
    for (score, variant) in mixed.filter_map(|cell| Some((others(cell), cell.variant?))) {
        if best.is_none_or(|(least, _)| score > least) {
            best = Some((score, variant));
        }
    }
    best.map(|(_, variant)| variant)
}

/// Each Mix2R over R2R of the same share, without turned copies and with them; those over R2R; of
/// V2R, each variant over its simulator's plain one, and over the analytic simulator's alike.
fn comparisons(cells: &[Cell], seed: u64) -> Vec<Comparison> {
    let find = |training: Training, variant: Option<Variant>, share: f64| {
        cells.iter().find(|cell| {
            !cell.chosen
                && cell.training == training
                && cell.variant == variant
                && cell.share == share
        })
    };
    let over = |cell: &Cell| match (cell.training, cell.variant) {
        (Training::Mixed, _) => vec![
            find(Training::Real, None, cell.share),
            find(Training::Turned, None, cell.share),
        ],
        (Training::Turned, _) => vec![find(Training::Real, None, cell.share)],
        (Training::Virtual, Some(variant)) => {
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
                .map(|other| find(Training::Virtual, Some(other), cell.share))
                .collect()
        }
        _ => Vec::new(),
    };
    cells
        .iter()
        .flat_map(|cell| {
            over(cell)
                .into_iter()
                .flatten()
                .map(|other| Comparison::of(cell, other, seed))
                .collect::<Vec<_>>()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::har::results::Run;
    use crate::evaluate::har::scores::Confusion;

    #[test]
    fn nobody_is_tested_who_was_seen_and_everybody_is_tested() {
        let mapped = Variant {
            mapped: true,
            ..Variant::plain(Simulator::Analytic)
        };
        for way in [
            (Training::Real, None, 0.25),
            (Training::Mixed, Some(mapped), 1.0),
            (Training::Virtual, Some(mapped), 1.0),
            (
                Training::Virtual,
                Some(Variant::plain(Simulator::Joint)),
                1.0,
            ),
        ] {
            let jobs = jobs(way, 12, 2, |seed| seed as u64);
            assert!(
                jobs.iter()
                    .all(|job| job.tested.iter().all(|tested| !job.known.contains(tested))),
                "{way:?}"
            );
            for seed in 0..2 {
                let mut tested: Vec<usize> = jobs
                    .iter()
                    .filter(|job| job.seed == seed)
                    .flat_map(|job| job.tested.clone())
                    .collect();
                tested.sort_unstable();
                assert_eq!(tested, (0..12).collect::<Vec<_>>(), "{way:?}");
            }
            let fewest = if way.0 == Training::Virtual { 0 } else { 1 };
            assert!(jobs.iter().all(|job| job.known.len() >= fewest
                && (way.0 != Training::Virtual || job.known.len() <= 1)));
        }
    }

    fn scored(variant: Variant, scores: [f64; 3]) -> Cell {
        let run = |(index, f1): (usize, f64)| Run {
            seed: 0,
            subject: format!("s{index}"),
            known: Vec::new(),
            f1,
            confusion: Confusion(vec![vec![1]]),
        };
        Cell::of(
            Training::Mixed,
            Some(variant),
            1.0,
            false,
            scores.into_iter().enumerate().map(run).collect(),
            1,
        )
    }

    #[test]
    fn a_variant_is_chosen_by_the_others_alone() {
        let [plain, mapped, ..] = Variant::all_of(Simulator::Analytic);
        // Mapping is best on average, but only because of s0.
        let cells = [
            scored(plain, [0.1, 0.8, 0.8]),
            scored(mapped, [1.0, 0.7, 0.7]),
        ];
        assert_eq!(
            ["s0", "s1"].map(|without| choose(&cells, without)),
            [Some(plain), Some(mapped)]
        );
        assert_eq!(choose(&[], "s0"), None);
    }
}
