//! `cromosim simulate MOTIONS`: motion files to bags or columns, without DDS, on all cores.

use crate::output::say;
use crate::progress;
use crate::simulate_arguments::Arguments;
use crate::simulate_many;
use crate::simulate_setup::{Output, Setup};
use crate::simulated_file::simulate_one;

/// Runs `simulate MOTIONS`.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = Setup::new(arguments)?;
    if arguments.is_of_many() {
        return simulate_many::run(arguments, setup);
    }
    let people = setup.read(arguments.motions.first().map(AsRef::as_ref))?;
    let steps = people.len() * (setup.simulation.placements().placements().len() + 1);
    let bar = progress::bar(steps as u64, "simulating, placements");
    let stem = arguments.out.file_stem().unwrap_or_default();
    let output = Output {
        path: &arguments.out,
        recording: &stem.to_string_lossy(),
    };
    let written = simulate_one(&setup, &people, output, &bar);
    bar.finish_and_clear();
    say!("{}", written?.line)
}
