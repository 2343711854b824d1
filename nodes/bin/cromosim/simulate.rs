//! `cromosim simulate MOTIONS`: motion files to bags, without DDS, on all cores.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use indicatif::ProgressBar;
use rayon::prelude::*;

use crate::output::{remark, say};
use crate::progress;
use crate::simulate_arguments::Arguments;
use crate::simulate_setup::Setup;
use crate::simulated_file::simulate_one;

/// Runs `simulate MOTIONS`.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = Setup::new(arguments)?;
    if arguments.motions.len() <= 1 {
        let people = setup.read(arguments.motions.first())?;
        let steps = people.len() * (setup.simulation.placements().placements().len() + 1);
        let bar = progress::bar(steps as u64, "simulating, placements");
        let line = simulate_one(&setup, &people, &arguments.out, &bar);
        bar.finish_and_clear();
        say!("{}", line?)?;
        return Ok(());
    }
    fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: cannot be made", arguments.out.display()))?;
    let outs = output_names(&arguments.motions, &arguments.out, setup.format.ending())?;
    let bar = progress::bar(outs.len() as u64, "simulating, files");
    let results: Vec<anyhow::Result<String>> = arguments
        .motions
        .par_iter()
        .zip(&outs)
        .map(|(path, out)| {
            let result = setup
                .read(Some(path))
                .and_then(|people| simulate_one(&setup, &people, out, &ProgressBar::hidden()));
            bar.inc(1);
            result
        })
        .collect();
    bar.finish_and_clear();
    let failed = results.iter().filter(|result| result.is_err()).count();
    let mut said = Ok(());
    for result in &results {
        match result {
            Ok(line) => said = said.and_then(|()| say!("{line}")),
            Err(error) => remark!("error: {error:#}"),
        }
    }
    if failed > 0 {
        bail!(
            "{failed} of {} files failed (above); the others are written",
            results.len()
        );
    }
    said
}

/// OUT/NAME.mcap, or its like, for every motion; two of one name would overwrite each other.
fn output_names(motions: &[PathBuf], out: &Path, ending: &str) -> anyhow::Result<Vec<PathBuf>> {
    let mut taken: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let mut outs = Vec::new();
    for motion in motions {
        let place = out
            .join(motion.file_stem().unwrap_or_default())
            .with_extension(ending);
        if let Some(other) = taken.insert(place.clone(), motion) {
            bail!(
                "{} and {} would both become {}; simulate them into two directories",
                other.display(),
                motion.display(),
                place.display()
            );
        }
        outs.push(place);
    }
    Ok(outs)
}
