//! What virtual IMUs are worth to a classifier of activities: it learns from real devices (R2R),
//! from virtual ones (V2R) and from both (Mix2R), and is tested on real devices of people whom it
//! has not seen.

mod activities;
mod charts;
mod clips;
mod condition;
mod dataset;
mod device;
mod experiment;
mod page;
mod plan;
mod player;
mod results;
mod scores;
mod selections;
mod settings;
mod simulator;
mod tables;
mod wearing;
mod windows;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use cromosim_body::BodyModel;
use cromosim_learned::LearnedSimulator;
use rayon::prelude::*;
use serde::Serialize;

pub use activities::Activities;
pub use condition::{TrainingData, Variant};
pub use device::DeviceEstimate;
pub use results::{
    ActivityResults, ChosenVariant, Comparison, ConditionResults, PlacementEstimate, Run, Skipped,
    SubjectData, SubjectScore, VirtualSide,
};
pub use scores::ConfusionMatrix;
pub use settings::Settings;
pub use simulator::Simulator;

use crate::EvaluationError;
use crate::observer::{self, Observer};
use crate::seeds::mixed_seed;
use clips::{ActivityClip, ClipDraw};
use dataset::{RealDataset, Subject};
use experiment::{Experiment, VirtualSet};
use player::ClipPlayer;
pub(crate) use wearing::{DeviceWearing, WornDevice};

/// People of a quick run.
const QUICK_SUBJECTS: usize = 3;

/// What an evaluation is run on.
pub struct ActivityOptions {
    /// The folder that holds har_spsw and mocap_cmu_har.
    pub data: PathBuf,
    /// Recordings of real people, rather than those of har_spsw.
    pub real: Vec<PathBuf>,
    /// Labelled skeleton clips, rather than those of mocap_cmu_har.
    pub motions: Vec<PathBuf>,
    /// The classes that activities count as.
    pub activities: Activities,
    /// Networks of the learned simulator; without, it is left out.
    pub learned: Option<LearnedSimulator>,
    /// The body that motions are played on.
    pub model: Arc<BodyModel>,
    /// Takes clips that are named atypical (dribbling, uneven ground), too.
    pub atypical: bool,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Three people, one seed, few steps: shows that all of it runs.
    pub quick: bool,
}

/// How long the parts of an evaluation took.
#[derive(Serialize)]
pub struct Elapsed {
    threads: usize,
    trainings: usize,
    seconds_of_one_training: f64,
    seconds_of_the_virtual_side: f64,
    /// All of it, s.
    pub seconds: f64,
}

impl Elapsed {
    /// As JSON, which differs from run to run.
    ///
    /// # Errors
    /// None but what JSON refuses.
    pub fn json(&self) -> Result<String, EvaluationError> {
        crate::report::json(self)
    }
}

/// The virtual side of an evaluation: clips, who plays them, and what devices read.
struct VirtualPeople {
    clips: Vec<ActivityClip>,
    /// Names of clips that were left out as atypical.
    left_out: Vec<String>,
    /// What is played, for each seed.
    draws: Vec<Vec<ClipDraw>>,
    simulators: Vec<Simulator>,
    /// By seed, simulator, and whether the root stays in place.
    simulated: BTreeMap<(usize, Simulator, bool), VirtualSet>,
}

/// Trains and tests classifiers under every condition.
///
/// # Errors
/// Files that cannot be read, data that do not go together, and [`EvaluationError::Interrupted`].
pub fn evaluate_activities(
    options: &ActivityOptions,
    observer: &dyn Observer,
) -> Result<(ActivityResults, Elapsed), EvaluationError> {
    let start = Instant::now();
    let settings = if options.quick {
        Settings::quick(options.seed)
    } else {
        Settings::full(options.seed)
    };
    let real = read_real(options, &settings)?;
    let people = virtual_people(options, &real, &settings, observer)?;
    let virtual_seconds = start.elapsed().as_secs_f64();
    let experiment = Experiment {
        settings: &settings,
        real: &real,
        draws: &people.draws,
        simulated: &people.simulated,
        observer,
    };
    let planned = plan::run_plan(&experiment, &people.simulators, options.quick)?;
    observer::check(observer)?;
    let seconds = start.elapsed().as_secs_f64();
    let threads = rayon::current_num_threads();
    let elapsed = Elapsed {
        threads,
        trainings: planned.trainings,
        seconds_of_one_training: threads as f64 * (seconds - virtual_seconds)
            / planned.trainings.max(1) as f64,
        seconds_of_the_virtual_side: virtual_seconds,
        seconds,
    };
    let with_networks = options.learned.is_some();
    let results = results(&real, settings, people, planned, with_networks);
    Ok((results, elapsed))
}

fn read_real(
    options: &ActivityOptions,
    settings: &Settings,
) -> Result<RealDataset, EvaluationError> {
    let files = files_or_default(&options.real, &options.data.join("har_spsw"))?;
    let most_subjects = if options.quick {
        QUICK_SUBJECTS
    } else {
        usize::MAX
    };
    dataset::read_dataset(&files, &options.activities, &settings.grid(), most_subjects)
}

fn files_or_default(given: &[PathBuf], folder: &Path) -> Result<Vec<PathBuf>, EvaluationError> {
    if given.is_empty() {
        dataset::default_files(folder)
    } else {
        Ok(given.to_vec())
    }
}

/// Reads clips, draws who plays them, and simulates every device.
fn virtual_people(
    options: &ActivityOptions,
    real: &RealDataset,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<VirtualPeople, EvaluationError> {
    let activities = &real.activities;
    let files = files_or_default(&options.motions, &options.data.join("mocap_cmu_har"))?;
    let (clips, left_out) =
        clips::read_clips(&files, &options.model, activities, options.atypical)?;
    if clips
        .iter()
        .all(|clip| clip.labels.iter().all(Option::is_none))
    {
        return Err(EvaluationError::NoActivity {
            path: files[0].clone(),
            classes: activities.classes().join(", "),
        });
    }
    let draws: Vec<Vec<ClipDraw>> = (0..settings.seeds)
        .map(|seed| {
            let seed = mixed_seed(&[settings.seed, 10, seed as u64]);
            clips::draw_clips(&clips, activities.classes().len(), settings, seed)
        })
        .collect();
    announce(real, &clips, &draws, observer);
    let player = ClipPlayer {
        model: &options.model,
        clips: &clips,
        wearings: &DeviceWearing::for_placements(&real.placements),
        learned: options.learned.as_ref(),
        settings,
    };
    let simulators = Simulator::for_run(options.quick, options.learned.is_some());
    let simulated = simulate(&player, &draws, &simulators, observer)?;
    Ok(VirtualPeople {
        clips,
        left_out,
        draws,
        simulators,
        simulated,
    })
}

/// Says what is learned from and tested on.
fn announce(
    real: &RealDataset,
    clips: &[ActivityClip],
    draws: &[Vec<ClipDraw>],
    observer: &dyn Observer,
) {
    let windows: usize = real
        .subjects
        .iter()
        .map(|subject| subject.windows.len())
        .sum();
    observer.note(&format!(
        "{}: {} people, {windows} windows of {}; {}",
        real.format,
        real.subjects.len(),
        real.placements.join(", "),
        real.activities.classes().join(", ")
    ));
    let drawn: usize = draws.iter().flatten().map(|draw| draw.windows.len()).sum();
    observer.note(&format!(
        "virtual: {} clips, {} draws, {drawn} windows",
        clips.len(),
        draws.iter().map(Vec::len).sum::<usize>()
    ));
}

/// Every seed's draws by every simulator, with the global trajectory and in place.
fn simulate(
    player: &ClipPlayer<'_>,
    draws: &[Vec<ClipDraw>],
    simulators: &[Simulator],
    observer: &dyn Observer,
) -> Result<BTreeMap<(usize, Simulator, bool), VirtualSet>, EvaluationError> {
    let keys: Vec<(usize, Simulator, bool)> = (0..draws.len())
        .flat_map(|seed| {
            simulators.iter().flat_map(move |simulator| {
                [false, true].map(|in_place| (seed, *simulator, in_place))
            })
        })
        .collect();
    let total: usize = keys.iter().map(|(seed, ..)| draws[*seed].len()).sum();
    observer.begin("virtual devices", total as u64);
    let mut all = BTreeMap::new();
    for key @ (seed, simulator, in_place) in keys {
        let play = |draw: &ClipDraw| {
            observer::check(observer)?;
            observer.advance(1);
            player.play(draw, simulator, in_place)
        };
        let played = draws[seed]
            .par_iter()
            .map(play)
            .collect::<Result<Vec<_>, EvaluationError>>()?;
        let windows = player::windows(&draws[seed], &played, None, player.settings)?;
        all.insert(key, VirtualSet { played, windows });
    }
    observer.end();
    Ok(all)
}

fn results(
    real: &RealDataset,
    settings: Settings,
    people: VirtualPeople,
    planned: plan::PlanResults,
    with_networks: bool,
) -> ActivityResults {
    let classes = real.activities.classes().to_vec();
    let windows = |seed: usize| {
        people.simulators.first().map_or(Vec::new(), |first| {
            people.simulated[&(seed, *first, false)]
                .windows
                .counts(classes.len())
        })
    };
    let virtual_side = VirtualSide {
        clips: people.clips.len(),
        draws: people.draws.iter().map(Vec::len).collect(),
        windows: (0..settings.seeds).map(windows).collect(),
        left_out: people.left_out,
    };
    let subject_data = |subject: &Subject| SubjectData {
        subject: subject.name.clone(),
        windows: subject.windows.counts(classes.len()),
    };
    let everybody: Vec<&Subject> = real.subjects.iter().collect();
    let devices = real.placements.iter().enumerate();
    let devices = devices.map(|(device, placement)| PlacementEstimate {
        placement: placement.clone(),
        estimate: experiment::estimate(&everybody, device),
    });
    let skipped = if with_networks {
        Vec::new()
    } else {
        vec![Skipped {
            what: "the learned simulator".to_owned(),
            reason: "no networks were given (--learned MODEL)".to_owned(),
        }]
    };
    ActivityResults {
        schema: results::SCHEMA,
        settings,
        dataset: real.format.to_string(),
        placements: real.placements.clone(),
        subjects: real.subjects.iter().map(subject_data).collect(),
        virtual_side,
        devices: devices.collect(),
        conditions: planned.conditions,
        comparisons: planned.comparisons,
        chosen: planned.chosen,
        skipped,
        classes,
    }
}
