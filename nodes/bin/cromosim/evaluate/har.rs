//! `cromosim evaluate har`: a classifier of activities learns from real devices (R2R), from virtual
//! ones (V2R) and from both (Mix2R), and is tested on real devices of people it has not seen.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, bail};
use clap::Args;
use cromosim_body::BodyModel;
use cromosim_learned::LearnedSimulator;
use rayon::prelude::*;
use serde::Serialize;

use super::{data_folder, output};
use crate::body;
use crate::progress::{self, Interrupt};
use crate::train::data::mix;

mod activities;
mod clips;
mod device;
mod plan;
mod real;
mod results;
mod scores;
mod settings;
mod signal;
mod simulated;
mod tables;
mod trainings;
mod wear;

use activities::Activities;
use clips::{Clip, Draw};
use real::Real;
use results::{PlacedEstimate, Results, SCHEMA, Skipped, SubjectData, VirtualSide};
use settings::Settings;
use simulated::{Simulator, Stage};
use trainings::{Ground, Virtual};

/// Files that are written.
const FILES: [&str; 3] = ["results.json", "tables.md", "elapsed.json"];
/// Of a quick run.
const QUICK_SUBJECTS: usize = 3;

/// Train a classifier of activities on real, virtual and mixed IMU data, and test it on real people
/// held out one by one
#[derive(Args)]
pub struct Arguments {
    /// The folder to write report.html, its pictures as PNG, tables.md, results.json and
    /// elapsed.json into
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The folder that holds har_spsw and mocap_cmu_har; default: the environment's CROMOSIM_DATA,
    /// else ../shared/data
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Recordings of real people, rather than DIR/har_spsw: of PAMAP2 (one file a person),
    /// RealWorld (accelerometer's zips, one folder a person), or phone and watch
    #[arg(long, value_name = "FILE", num_args = 1..)]
    real: Vec<PathBuf>,
    /// Labelled skeleton clips (npz), rather than DIR/mocap_cmu_har
    #[arg(long, value_name = "FILE", num_args = 1..)]
    motions: Vec<PathBuf>,
    /// Which class an activity counts as (YAML: {sitting: SEATED, ...}); default: the five of the
    /// virtual side, by their usual names
    #[arg(long, value_name = "FILE")]
    activities: Option<PathBuf>,
    /// Networks for the learned simulator: motion_capture, or a folder that `cromosim train` wrote;
    /// without, it is left out
    #[arg(long, value_name = "MODEL")]
    learned: Option<PathBuf>,
    /// Body model (SMPL, SMPL-H, SMPL-X; npz or pickle) that motions are played on, rather than the
    /// embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Take clips named atypical (dribbling, uneven ground), too
    #[arg(long)]
    atypical: bool,
    /// Of everything that is drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Three people, one seed, few steps: shows that all of it runs, in less than a minute
    #[arg(long)]
    quick: bool,
    /// Replace results that are there
    #[arg(long)]
    force: bool,
}

/// What took how long.
#[derive(Serialize)]
struct Elapsed {
    threads: usize,
    trainings: usize,
    seconds_of_one_training: f64,
    seconds_of_the_virtual_side: f64,
    seconds: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let start = Instant::now();
    if let Some(there) = FILES
        .iter()
        .map(|name| arguments.out.join(name))
        .find(|path| path.exists() && !arguments.force)
    {
        bail!(
            "{}: exists already; give another --out, or --force to replace it",
            there.display()
        );
    }
    let interrupt = Interrupt::watch()?;
    let settings = if arguments.quick {
        Settings::quick(arguments.seed)
    } else {
        Settings::full(arguments.seed)
    };
    let model = body::model(arguments.body.as_deref())?;
    let learned = arguments
        .learned
        .as_deref()
        .map(LearnedSimulator::find)
        .transpose()?;
    let real = read_real(arguments, &settings)?;
    let (clips, left_out) = read_clips(arguments, &model, &real.activities)?;
    let draws: Vec<Vec<Draw>> = (0..settings.seeds)
        .map(|seed| {
            clips::draws(
                &clips,
                real.activities.classes().len(),
                &settings,
                mix(&[settings.seed, 10, seed as u64]),
            )
        })
        .collect();
    announce(&real, &clips, &draws);
    let simulators: Vec<Simulator> = plan::simulators(arguments.quick, learned.is_some());
    let simulated = simulate(
        (&model, &clips, &draws),
        &real,
        learned.as_ref(),
        &simulators,
        &settings,
        &interrupt,
    )?;
    let virtual_seconds = start.elapsed().as_secs_f64();
    let ground = Ground {
        settings: &settings,
        real: &real,
        draws: &draws,
        simulated: &simulated,
        interrupt: &interrupt,
    };
    let planned = plan::run(&ground, &simulators, arguments.quick)?;
    let windows = |seed: usize| {
        simulators.first().map_or(Vec::new(), |first| {
            simulated[&(seed, *first, false)]
                .windows
                .counts(real.activities.classes().len())
        })
    };
    let virtual_side = VirtualSide {
        clips: clips.len(),
        left_out,
        draws: draws.iter().map(Vec::len).collect(),
        windows: (0..settings.seeds).map(windows).collect(),
    };
    let trainings = planned.trainings;
    let results = results(&real, settings, virtual_side, planned, learned.is_some());
    let elapsed = Elapsed {
        threads: rayon::current_num_threads(),
        trainings,
        seconds_of_one_training: rayon::current_num_threads() as f64
            * (start.elapsed().as_secs_f64() - virtual_seconds)
            / trainings.max(1) as f64,
        seconds_of_the_virtual_side: virtual_seconds,
        seconds: start.elapsed().as_secs_f64(),
    };
    interrupt.check()?;
    write(&arguments.out, &results, &elapsed)
}

fn read_real(arguments: &Arguments, settings: &Settings) -> anyhow::Result<Real> {
    let activities = arguments
        .activities
        .as_deref()
        .map_or_else(|| Ok(Activities::five()), Activities::read)?;
    let files = if arguments.real.is_empty() {
        real::default_files(&data_folder(arguments.data.as_deref()).join("har_spsw"))?
    } else {
        arguments.real.clone()
    };
    real::read(
        &files,
        &activities,
        &settings.grid(),
        if arguments.quick {
            QUICK_SUBJECTS
        } else {
            usize::MAX
        },
    )
}

fn read_clips(
    arguments: &Arguments,
    model: &Arc<BodyModel>,
    activities: &Activities,
) -> anyhow::Result<(Vec<Clip>, Vec<String>)> {
    let files = if arguments.motions.is_empty() {
        real::default_files(&data_folder(arguments.data.as_deref()).join("mocap_cmu_har"))?
    } else {
        arguments.motions.clone()
    };
    let (clips, left_out) = clips::read(&files, model, activities, arguments.atypical)?;
    if !clips
        .iter()
        .any(|clip| clip.labels.iter().any(Option::is_some))
    {
        bail!(
            "{}: no clip shows any of {}",
            files[0].display(),
            activities.classes().join(", ")
        );
    }
    Ok((clips, left_out))
}

fn announce(real: &Real, clips: &[Clip], draws: &[Vec<Draw>]) {
    let windows: usize = real
        .subjects
        .iter()
        .map(|subject| subject.windows.len())
        .sum();
    let classes = real.activities.classes();
    println!(
        "{}: {} people, {windows} windows of {}; {}",
        real.format,
        real.subjects.len(),
        real.placements.join(", "),
        classes.join(", ")
    );
    let drawn: usize = draws.iter().flatten().map(|draw| draw.windows.len()).sum();
    println!(
        "virtual: {} clips, {} draws, {drawn} windows",
        clips.len(),
        draws.iter().map(Vec::len).sum::<usize>()
    );
}

/// Every seed's draws by every simulator, with the global trajectory and in place.
fn simulate(
    (model, clips, draws): (&Arc<BodyModel>, &[Clip], &[Vec<Draw>]),
    real: &Real,
    learned: Option<&LearnedSimulator>,
    simulators: &[Simulator],
    settings: &Settings,
    interrupt: &Interrupt,
) -> anyhow::Result<BTreeMap<(usize, Simulator, bool), Virtual>> {
    let wears: Vec<_> = real
        .placements
        .iter()
        .filter_map(|name| wear::wear(name))
        .collect();
    let stage = Stage {
        model,
        clips,
        wears: &wears,
        learned,
        settings,
    };
    let keys: Vec<(usize, Simulator, bool)> = (0..draws.len())
        .flat_map(|seed| {
            simulators.iter().flat_map(move |simulator| {
                [false, true].map(|in_place| (seed, *simulator, in_place))
            })
        })
        .collect();
    let total: usize = keys.iter().map(|(seed, ..)| draws[*seed].len()).sum();
    let bar = progress::bar(total as u64, "virtual devices");
    let mut all = BTreeMap::new();
    for key @ (seed, simulator, in_place) in keys {
        let play = |draw: &Draw| {
            interrupt.check()?;
            bar.inc(1);
            stage.play(draw, simulator, in_place)
        };
        let played = draws[seed]
            .par_iter()
            .map(play)
            .collect::<anyhow::Result<Vec<_>>>()?;
        let windows = simulated::windows(&draws[seed], &played, None, settings)?;
        all.insert(key, Virtual { played, windows });
    }
    bar.finish_and_clear();
    Ok(all)
}

fn results(
    real: &Real,
    settings: Settings,
    virtual_side: VirtualSide,
    planned: plan::Planned,
    learned: bool,
) -> Results {
    let classes = real.activities.classes().to_vec();
    let subjects = real
        .subjects
        .iter()
        .map(|subject| SubjectData {
            subject: subject.name.clone(),
            windows: subject.windows.counts(classes.len()),
        })
        .collect();
    let everybody: Vec<_> = real.subjects.iter().collect();
    let devices = real
        .placements
        .iter()
        .enumerate()
        .map(|(device, placement)| PlacedEstimate {
            placement: placement.clone(),
            estimate: trainings::estimate(&everybody, device),
        });
    let skipped = if learned {
        Vec::new()
    } else {
        vec![Skipped {
            what: "the learned simulator".to_owned(),
            reason: "no networks were given (--learned MODEL)".to_owned(),
        }]
    };
    Results {
        schema: SCHEMA,
        settings,
        dataset: real.format.to_string(),
        placements: real.placements.clone(),
        subjects,
        virtual_side,
        devices: devices.collect(),
        cells: planned.cells,
        comparisons: planned.comparisons,
        chosen: planned.chosen,
        skipped,
        classes,
    }
}

fn write(out: &Path, results: &Results, elapsed: &Elapsed) -> anyhow::Result<()> {
    let tables = tables::markdown(results);
    let json = |value: serde_json::Result<String>| value.map(|text| text + "\n").context("results");
    let texts = [
        json(serde_json::to_string_pretty(results))?,
        tables.clone(),
        json(serde_json::to_string_pretty(elapsed))?,
    ];
    let named: Vec<(&str, String)> = FILES.into_iter().zip(texts).collect();
    output::write(
        out,
        &named,
        &tables::page(results),
        &tables::charts(results),
    )?;
    print!("{tables}");
    println!(
        "{}: report.html, pictures, {}; {:.0} s",
        out.display(),
        FILES.join(", "),
        elapsed.seconds
    );
    Ok(())
}
