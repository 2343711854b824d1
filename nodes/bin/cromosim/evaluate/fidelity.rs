//! `cromosim evaluate fidelity`: root mean square errors of simulators against measured IMUs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use cromosim_body::BodyModel;
use cromosim_learned::{LearnedSimulator, MappingFile};
use rayon::prelude::*;

use super::{data_folder, output};
use crate::body;
use crate::progress::{self, Interrupt};

mod cases;
mod protocol;
mod score;
mod tables;

use cases::{Case, Simulator};
use protocol::{Protocol, Study};
use score::{Results, StudyResults};

/// How far simulators are from measured IMUs, on people and positions that no network has seen
#[derive(Args)]
pub struct Arguments {
    /// The folder to write report.html, its pictures as PNG, tables.md and results.json into
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What is compared (YAML, schema cromosim/fidelity/1) rather than
    /// config/evaluation/fidelity.yaml
    #[arg(long, value_name = "FILE")]
    protocol: Option<PathBuf>,
    /// Where the protocol's files are looked for; default: CROMOSIM_DATA, else ../shared/data
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folders of models that `cromosim train` wrote, by the protocol's names, rather than the
    /// models that come with the suite
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Body model (SMPL, SMPL-H, SMPL-X; npz or pickle) that motions are played on, rather than the
    /// embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// One draw of person and device a motion and site
    #[arg(long)]
    quick: bool,
    /// Replace what is in DIR
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let protocol = Protocol::read(arguments.protocol.as_deref())?;
    let folder = data_folder(arguments.data.as_deref());
    let results_place = arguments.out.join("results.json");
    if results_place.exists() && !arguments.force {
        bail!(
            "{}: exists already; give another --out, or --force to replace it",
            results_place.display()
        );
    }
    let interrupt = Interrupt::watch()?;
    let given = arguments
        .body
        .as_ref()
        .map(|path| body::model(Some(path)))
        .transpose()?;
    let mut studies = Vec::new();
    for study in &protocol.studies {
        studies.push(run_study(
            study,
            &protocol,
            &folder,
            given.as_ref(),
            arguments,
            &interrupt,
        )?);
    }
    let results = Results::new(&protocol, arguments.quick, studies);
    let tables = tables::markdown(&results);
    let texts = [
        (
            "results.json",
            serde_json::to_string_pretty(&results)? + "\n",
        ),
        ("tables.md", tables.clone()),
    ];
    output::write(
        &arguments.out,
        &texts,
        &tables::page(&results),
        &tables::charts(&results),
    )?;
    print!("{tables}");
    println!(
        "{}: report.html, tables.md, results.json, pictures",
        arguments.out.display()
    );
    Ok(())
}

/// All simulators on all recordings of a study.
fn run_study(
    study: &Study,
    protocol: &Protocol,
    folder: &Path,
    given: Option<&Arc<BodyModel>>,
    arguments: &Arguments,
    interrupt: &Interrupt,
) -> anyhow::Result<StudyResults> {
    let model = given.cloned().unwrap_or_else(BodyModel::embedded);
    let learned = model_of(&study.model, arguments.models.as_deref())?;
    let cases = |sources: &[_], seed: u64| -> anyhow::Result<Vec<Case>> {
        cases::all(
            sources,
            folder,
            &model,
            given,
            seed,
            arguments.quick,
            interrupt,
        )
    };
    let test = cases(&study.test, protocol.seed)?;
    let mut mapping = MappingFile::default();
    if let Some(networks) = &learned {
        mapping = cases::fit_mapping(
            &cases(&study.mapping, protocol.seed.wrapping_add(1))?,
            networks,
        )?;
    }
    let bar = progress::bar(
        test.len() as u64,
        &format!("study {}, recordings", study.name),
    );
    let one = |case: &Case| -> anyhow::Result<_> {
        interrupt.check()?;
        let mut sums = Vec::new();
        for simulator in Simulator::ALL {
            let readings = case.simulate(simulator, learned.as_ref(), &mapping)?;
            sums.push(readings.map(|readings| score::Sums::of(&readings, case.measured())));
        }
        bar.inc(1);
        Ok(sums)
    };
    let sums: Vec<Vec<Option<score::Sums>>> =
        test.par_iter().map(one).collect::<anyhow::Result<_>>()?;
    bar.finish_and_clear();
    Ok(StudyResults::new(study, &test, &sums, protocol.seed))
}

/// A model by its name in a folder, else one that comes with the suite; none where the protocol
/// says `none`.
fn model_of(name: &str, models: Option<&Path>) -> anyhow::Result<Option<LearnedSimulator>> {
    Ok(match models {
        _ if name == "none" => None,
        Some(folder) => Some(LearnedSimulator::read(&folder.join(name))?),
        None => Some(LearnedSimulator::named(name)?),
    })
}
