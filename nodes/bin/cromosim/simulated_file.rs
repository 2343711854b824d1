//! What `cromosim simulate` writes of a motion: a bag, or columns.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_recording::columns::{ColumnsHeader, ColumnsWriter};
use cromosim_recording::{
    Aside, FIRST_STAMP, PlayedPerson, SimulatedPerson, SimulatedPlacement, write_file_with,
    write_people, write_people_csv,
};
use cromosim_spatial::Stamp;
use indicatif::ProgressBar;

use crate::files::refuse_existing;
use crate::simulate_arguments::Format;
use crate::simulate_setup::{Output, Setup, Written, names};
use crate::simulated_csv::{the_only, write_table};
use crate::simulated_draws::simulate_draws;
use crate::simulated_json::WrittenFile;
use crate::simulated_quality::{quality_entries, quality_line, unlikely, warn};

fn last_played(people: &[PlayedPerson]) -> Option<Stamp> {
    let last = |person: &PlayedPerson| person.stamps.get(*person.played.end()).copied();
    people.iter().filter_map(last).max()
}

/// What the file says, with what its readings are good for.
fn metadata_of(
    setup: &Setup,
    people: &[PlayedPerson],
    simulated: &[SimulatedPerson],
    oddities: &[String],
) -> BTreeMap<String, String> {
    let mut metadata = setup.settings_of(people);
    for (person, simulated) in people.iter().zip(simulated) {
        let quality = |placement: &SimulatedPlacement| {
            quality_entries(&person.frame(&placement.name), &placement.quality)
        };
        metadata.extend(simulated.placements.iter().flat_map(quality));
    }
    metadata.extend(unlikely(oddities.iter().cloned()));
    metadata
}

/// Writes a bag; gives the number of its messages.
fn write_bag(
    setup: &Setup,
    people: &[PlayedPerson],
    simulated: &mut [SimulatedPerson],
    metadata: BTreeMap<String, String>,
    out: &Path,
) -> anyhow::Result<u64> {
    let options = BagOptions {
        compression: Compression::Zstd,
        replace: setup.force,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(out, options)?;
    bag.write_metadata("cromosim", metadata)?;
    bag.attach(
        "placements.yaml",
        "application/yaml",
        FIRST_STAMP,
        setup.simulation.placements().to_yaml().as_bytes(),
    )?;
    write_people(&mut bag, people, simulated, || setup.interrupt.check())?;
    Ok(bag.finish()?.message_count())
}

/// Writes columns; gives the number of their rows.
fn write_columns(
    setup: &Setup,
    people: &[PlayedPerson],
    simulated: &mut [SimulatedPerson],
    mut metadata: BTreeMap<String, String>,
    output: Output<'_>,
) -> anyhow::Result<u64> {
    metadata.extend(setup.devices());
    let header = ColumnsHeader {
        recording: output.recording.to_owned(),
        metadata,
    };
    write_file_with(output.path, setup.force, |file| {
        let mut columns = ColumnsWriter::new(file, output.path, &header)?;
        for (person, simulated) in people.iter().zip(simulated) {
            columns.write_person(0, person, simulated, || setup.interrupt.check())?;
        }
        Ok(columns.finish()?)
    })
}

/// Writes the file; gives how many it holds, and of what.
fn write(
    setup: &Setup,
    people: &[PlayedPerson],
    simulated: &mut [SimulatedPerson],
    oddities: &[String],
    output: Output<'_>,
) -> anyhow::Result<(u64, &'static str)> {
    let metadata = metadata_of(setup, people, simulated, oddities);
    match setup.format {
        Format::Bag => Ok((
            write_bag(setup, people, simulated, metadata, output.path)?,
            "messages",
        )),
        Format::Parquet => {
            let rows = write_columns(setup, people, simulated, metadata, output)?;
            Ok((rows, "rows"))
        }
        Format::Csv => {
            let (person, placement) = the_only(setup, people, output.path)?;
            let topic = person.topic(&format!("imu/{placement}"));
            let folder = tempfile::tempdir().context("no folder for temporary files")?;
            let bag = folder.path().join("readings.mcap");
            write_bag(setup, people, simulated, metadata, &bag)?;
            let rows = write_table(&bag, &topic, output.path, setup.force)?;
            Ok((rows, "rows"))
        }
    }
}

/// Simulates people and writes their file.
pub fn simulate_one(
    setup: &Setup,
    people: &[PlayedPerson],
    output: Output<'_>,
    bar: &ProgressBar,
) -> anyhow::Result<Written> {
    let out = output.path;
    refuse_existing(out, setup.force)?;
    for path in setup.csv_files(people, out) {
        refuse_existing(&path, setup.force)?;
    }
    if setup.format == Format::Csv {
        the_only(setup, people, out)?;
    }
    if let Some(draws) = &setup.draws {
        return simulate_draws(setup, draws, people, output);
    }
    let aside = Aside::beside(
        out,
        people.len() * setup.simulation.placements().placements().len(),
    );
    let mut simulated = people
        .iter()
        .map(|person| setup.simulate(person, &aside, bar))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let oddities = setup.oddities(people)?;
    let (count, counted) = write(setup, people, &mut simulated, &oddities, output)?;
    if let Some(folder) = &setup.csv {
        for person in people {
            write_people_csv(
                out,
                folder,
                person,
                &names(setup.simulation.placements()),
                setup.force,
            )?;
        }
    }
    let motion = &people[0].motion;
    bar.suspend(|| warn(Path::new(&motion.name), &oddities));
    let line = if setup.json {
        let placements = people.iter().zip(&simulated);
        let placements = placements.flat_map(|(person, simulated)| {
            let of = |own: &SimulatedPlacement| (person.frame(&own.name), own.quality);
            simulated.placements.iter().map(of)
        });
        let file = WrittenFile {
            out,
            counted,
            count,
            source: &motion.name,
            placements: placements.collect(),
            warnings: oddities,
        };
        file.json().to_string()
    } else {
        words(out, (count, counted), people, &simulated)
    };
    Ok(Written { count, line })
}

/// What was written, in words.
fn words(
    out: &Path,
    (count, counted): (u64, &str),
    people: &[PlayedPerson],
    simulated: &[SimulatedPerson],
) -> String {
    let last = last_played(people).map_or(0.0, |last| last - FIRST_STAMP);
    let placements = simulated.first().map_or(0, |own| own.placements.len());
    let who = if people.len() > 1 {
        format!("{} people, ", people.len())
    } else {
        String::new()
    };
    format!(
        "{}: {count} {counted}, {who}{placements} placements, {last:.2} s of {}{}",
        out.display(),
        people[0].motion.name,
        quality_line(
            simulated
                .iter()
                .flat_map(|person| &person.placements)
                .map(|placement| placement.quality)
        )
    )
}
