//! `cromosim evaluate fidelity`: root mean square errors of simulators against measured IMUs.

use std::path::PathBuf;

use clap::Args;
use cromosim_evaluation::{DataFolder, FidelityOptions, Protocol, evaluate_fidelity};

use super::folders::{data_folder, refuse_results};
use crate::body;
use crate::output::{print, say};
use crate::progress::Terminal;

/// How far simulators are from measured IMUs, on people and positions that no network has seen
#[derive(Args)]
pub struct Arguments {
    /// The folder to write the report into
    ///
    /// report.html, its pictures as PNG, tables.md and results.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What is compared (YAML)
    ///
    /// Schema cromosim/fidelity/1, rather than config/evaluation/fidelity.yaml
    #[arg(long, value_name = "FILE")]
    protocol: Option<PathBuf>,
    /// Where its files are; default: CROMOSIM_DATA, else ../shared/data
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder of models that `cromosim train` wrote
    ///
    /// By the protocol's names, rather than the models that come with the suite
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Body model (npz or pickle) that motions are played on
    ///
    /// SMPL, SMPL-H or SMPL-X, rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// The skeleton map of BVH and AMC files with joint names of their own
    #[arg(long, value_name = "MAP")]
    skeleton_map: Option<String>,
    /// Draw little, to show that all of it runs
    ///
    /// One person and device for each motion and site; of rigid bodies, one IMU of each known motion
    /// and two recordings
    #[arg(long)]
    quick: bool,
    /// Replace what is in DIR
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let protocol = match &arguments.protocol {
        Some(path) => Protocol::read(path)?,
        None => Protocol::embedded()?,
    };
    refuse_results(&arguments.out, &["results.json"], arguments.force)?;
    let terminal = Terminal::watch()?;
    let options = FidelityOptions {
        data: DataFolder {
            folder: data_folder(arguments.data.as_deref()),
            body: body::given(arguments.body.as_deref())?,
            skeleton_map: arguments.skeleton_map.clone(),
        },
        models: arguments.models.clone(),
        quick: arguments.quick,
    };
    let report = evaluate_fidelity(&protocol, &options, &terminal)?.report()?;
    report.write(&arguments.out)?;
    print(format_args!("{}", report.tables))?;
    say!(
        "{}: report.html, tables.md, results.json, pictures",
        arguments.out.display()
    )?;
    Ok(())
}
