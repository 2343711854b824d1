//! `cromosim evaluate har`: a classifier of activities learns from real devices (R2R), from virtual
//! ones (V2R) and from both (Mix2R), and is tested on real devices of people whom it has not seen.

use std::path::PathBuf;

use clap::Args;
use cromosim_evaluation::{Activities, ActivityOptions, evaluate_activities};
use cromosim_learned::LearnedSimulator;

use super::folders::{data_folder, refuse_results};
use crate::body;
use crate::output::{print, say};
use crate::progress::Terminal;

/// Files that are written beside the report.
const FILES: [&str; 3] = ["results.json", "tables.md", "elapsed.json"];

/// Heading of the help.
const DATA: &str = "Whom and what it learns from";

/// Train a classifier of activities on real, virtual and mixed IMU data
///
/// And test it on real people held out one by one
#[derive(Args)]
pub struct Arguments {
    /// The folder to write the report into
    ///
    /// report.html, its pictures as PNG, tables.md, results.json and elapsed.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The folder that holds har_spsw and mocap_cmu_har
    ///
    /// Default: the environment's CROMOSIM_DATA, else ../shared/data
    #[arg(long, value_name = "DIR", help_heading = DATA)]
    data: Option<PathBuf>,
    /// Recordings of real people, rather than DIR/har_spsw
    ///
    /// Of PAMAP2 (one file a person), RealWorld (accelerometer's zips, one folder a person), or phone
    /// and watch
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = DATA)]
    real: Vec<PathBuf>,
    /// Labelled skeleton clips (npz), rather than DIR/mocap_cmu_har
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = DATA)]
    motions: Vec<PathBuf>,
    /// Which class an activity counts as (YAML)
    ///
    /// {sitting: SEATED, ...}; default: the five of the virtual side, by their usual names
    #[arg(long, value_name = "FILE", help_heading = DATA)]
    activities: Option<PathBuf>,
    /// Networks for the learned simulator, such as motion_capture
    ///
    /// Or a folder that `cromosim train` wrote; without, it is left out
    #[arg(long, value_name = "MODEL", help_heading = DATA)]
    learned: Option<PathBuf>,
    /// Body model (npz or pickle) that motions are played on
    ///
    /// SMPL, SMPL-H or SMPL-X, rather than the embedded one
    #[arg(long, value_name = "FILE", help_heading = DATA)]
    body: Option<PathBuf>,
    /// Take clips named atypical (dribbling, uneven ground), too
    #[arg(long, help_heading = DATA)]
    atypical: bool,
    /// Seed of everything that is drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw little, to show that all of it runs
    ///
    /// Three people, one seed, few steps; less than a minute
    #[arg(long)]
    quick: bool,
    /// Replace results that are there
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    refuse_results(&arguments.out, &FILES, arguments.force)?;
    let terminal = Terminal::watch()?;
    let options = ActivityOptions {
        data: data_folder(arguments.data.as_deref()),
        real: arguments.real.clone(),
        motions: arguments.motions.clone(),
        model: body::model(arguments.body.as_deref())?,
        learned: arguments
            .learned
            .as_deref()
            .map(LearnedSimulator::find)
            .transpose()?,
        activities: arguments
            .activities
            .as_deref()
            .map_or_else(|| Ok(Activities::five()), Activities::read)?,
        atypical: arguments.atypical,
        seed: arguments.seed,
        quick: arguments.quick,
    };
    let (results, elapsed) = evaluate_activities(&options, &terminal)?;
    let mut report = results.report()?;
    report.texts.push(("elapsed.json", elapsed.json()?));
    report.write(&arguments.out)?;
    print(format_args!("{}", report.tables))?;
    say!(
        "{}: report.html, pictures, {}; {:.0} s",
        arguments.out.display(),
        FILES.join(", "),
        elapsed.seconds
    )?;
    Ok(())
}
