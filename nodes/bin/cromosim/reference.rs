//! `cromosim simulate --reference`: the IMUs of a recording again, from its reference motion.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::bail;
use cromosim_bag::{BagOptions, BagSummary, BagWriter, Compression};
use cromosim_body::BodyModel;
use cromosim_imu::{Device, EffectsFile, PlacementEffects, Scheme, TextureSegment};
use cromosim_learned::{LearnedSimulator, scheme_for_networks};
use cromosim_recording::{
    RecordedPlacement, Resimulated, Resimulation, open_mapped, outside_reference, read_effects,
    read_mapped_placements, with_stamps, write_resimulated,
};
use rayon::prelude::*;

use crate::files::refuse_existing;
use crate::output::{remark, say};
use crate::progress::{self, Interrupt};
use crate::rigid_bodies::rigid_placements;
use crate::simulate_arguments::Arguments;
use crate::simulate_setup::read_mapping;
use crate::simulated_json::WrittenFile;
use crate::simulated_quality::{quality_entries, quality_line, unlikely, warn};

/// Runs `simulate --reference RECORDING`.
pub fn run(recording: &Path, arguments: &Arguments) -> anyhow::Result<()> {
    if let (Ok(from), Ok(to)) = (recording.canonicalize(), arguments.out.canonicalize())
        && from == to
    {
        bail!(
            "{}: --out is the recording itself, which would be lost; give another name",
            arguments.out.display()
        );
    }
    refuse_existing(&arguments.out, arguments.force)?;
    let scheme = arguments.differentiation()?;
    let topics = arguments.topics.map()?;
    let (reader, namespace) = open_mapped(recording, arguments.namespace.as_deref(), &topics)?;
    let body = arguments.body.as_deref().map(BodyModel::read).transpose()?;
    let recorded = read_mapped_placements(&reader, body.as_ref(), &topics)?
        .into_iter()
        .map(|(_, placement)| placement)
        .collect::<Result<Vec<_>, _>>()?;
    let effects = given_effects(arguments, &recorded)?;
    let (recorded, without_stamps) = with_stamps(recorded, arguments.rate);
    let how = Resimulation {
        scheme,
        effects,
        field: arguments.field()?.map(Arc::new),
        ..from_arguments(arguments)
    };
    let simulated = simulate_all(&recorded, &how)?;
    let summary = write(
        metadata(recording, &how, arguments),
        &recorded,
        &simulated,
        Written {
            references: false,
            namespace: &namespace,
        },
        arguments,
    )?;
    if arguments.json {
        return print_json(
            recording,
            summary.message_count(),
            (&recorded, &simulated),
            arguments,
        );
    }
    say!(
        "{}: {} messages of {} placements, from the reference in {}",
        arguments.out.display(),
        summary.message_count(),
        recorded.len(),
        recording.display()
    )?;
    print_notes(&recorded, &without_stamps)
}

/// Runs `simulate --rigid TRAJECTORY`: each of its bodies is the reference of one placement.
pub fn run_rigid(trajectory: &Path, arguments: &Arguments) -> anyhow::Result<()> {
    refuse_existing(&arguments.out, arguments.force)?;
    let scheme = arguments.differentiation()?;
    let up = arguments.motion.options()?.up_axis;
    let (recorded, said) = rigid_placements(trajectory, &arguments.placement, up)?;
    let names = recorded.iter().map(|placement| placement.name.as_str());
    let names: Vec<&str> = names.collect();
    let effects = effects_of_rigid(arguments, &recorded)?;
    let learned = arguments
        .learned
        .as_deref()
        .map(LearnedSimulator::find)
        .transpose()?;
    let scheme = scheme.unwrap_or_else(|| match &learned {
        Some(_) => scheme_for_networks(Scheme::default()).into(),
        None => Scheme::default().into(),
    });
    let mapping = read_mapping(arguments.mapping.as_deref(), &names)?;
    let how = Resimulation {
        scheme: Some(scheme),
        field: arguments.field()?.map(Arc::new),
        trim: arguments.trim()?,
        texture: arguments
            .texture()?
            .map(|texture| texture.or(TextureSegment::Held)),
        effects,
        learned,
        mapping,
        ..from_arguments(arguments)
    };
    let simulated = simulate_all(&recorded, &how)?;
    let summary = write(
        metadata(trajectory, &how, arguments),
        &recorded,
        &simulated,
        Written::WITH_REFERENCES,
        arguments,
    )?;
    let odd = recorded.iter().flat_map(|placement| &placement.notes);
    warn(trajectory, &odd.cloned().collect::<Vec<_>>());
    for note in said {
        remark!("{}: {note}", trajectory.display());
    }
    if arguments.json {
        let count = summary.message_count();
        return print_json(trajectory, count, (&recorded, &simulated), arguments);
    }
    say!(
        "{}: {} messages of {}, along {}{}",
        arguments.out.display(),
        summary.message_count(),
        names.join(", "),
        trajectory.display(),
        quality_line(simulated.iter().map(|placement| placement.quality))
    )?;
    Ok(())
}

/// The effects of `--effects`, and of `--device` at every placement.
fn effects_of_rigid(
    arguments: &Arguments,
    recorded: &[RecordedPlacement],
) -> anyhow::Result<EffectsFile> {
    let mut effects = given_effects(arguments, recorded)?;
    if let Some(device) = &arguments.device {
        for placement in recorded {
            let of_device = effects_of_device(device, placement)?;
            effects.placements.insert(placement.name.clone(), of_device);
        }
    }
    Ok(effects)
}

/// A device as what errs.
fn effects_of_device(
    device: &str,
    recorded: &RecordedPlacement,
) -> anyhow::Result<PlacementEffects> {
    let device = Device::resolve(Some(device), Path::new("."))?;
    Ok(PlacementEffects {
        epoch: recorded.span().0,
        declared_noise: device.declared_noise(),
        effects: device.effects().clone(),
        unexplained: device.unexplained(),
        reference_response: None,
        other_sessions: Vec::new(),
        magnetometer: device.magnetometer().cloned(),
        field_in_world: None,
    })
}

/// What was written, as JSON; notes are its warnings.
fn print_json(
    source: &Path,
    count: u64,
    (recorded, simulated): (&[RecordedPlacement], &[Resimulated]),
    arguments: &Arguments,
) -> anyhow::Result<()> {
    let notes = recorded.iter().flat_map(|placement| {
        let notes = placement.notes.iter().cloned();
        let notes = notes.chain(outside_reference(placement));
        notes.map(|note| format!("placement {}: {note}", placement.name))
    });
    let placements = recorded.iter().zip(simulated);
    let file = WrittenFile {
        out: &arguments.out,
        counted: "messages",
        count,
        source: &source.display().to_string(),
        placements: placements
            .map(|(placement, simulated)| (placement.name.clone(), simulated.quality))
            .collect(),
        warnings: notes.collect(),
    };
    say!("{}", file.json())
}

/// The effects of `--effects`; none without.
fn given_effects(
    arguments: &Arguments,
    recorded: &[RecordedPlacement],
) -> anyhow::Result<EffectsFile> {
    let effects = arguments
        .effects
        .as_deref()
        .map(|file| read_effects(file, recorded))
        .transpose()?;
    Ok(effects.unwrap_or_default())
}

/// What a user should know of the placements, and which of them were left out.
fn print_notes(recorded: &[RecordedPlacement], without_stamps: &[String]) -> anyhow::Result<()> {
    for placement in recorded {
        for line in placement
            .notes
            .iter()
            .cloned()
            .chain(outside_reference(placement))
        {
            say!("  {}: {line}", placement.name)?;
        }
    }
    if !without_stamps.is_empty() {
        say!(
            "  {}: no messages on /imu/NAME/data_raw to take the stamps from; left out (--rate HZ takes them in)",
            without_stamps.join(", ")
        )?;
    }
    Ok(())
}

/// Each placement on whatever core is free.
fn simulate_all(
    recorded: &[RecordedPlacement],
    how: &Resimulation,
) -> anyhow::Result<Vec<Resimulated>> {
    let interrupt = Interrupt::watch()?;
    let bar = progress::bar(recorded.len() as u64, "simulating, placements");
    let one = |placement: &RecordedPlacement| {
        interrupt.check()?;
        let simulated = how.simulate(placement);
        bar.inc(1);
        Ok(simulated?)
    };
    let results: Vec<anyhow::Result<Resimulated>> = recorded.par_iter().map(one).collect();
    bar.finish_and_clear();
    results.into_iter().collect()
}

/// What is written beside the samples, and where.
#[derive(Clone, Copy)]
struct Written<'a> {
    references: bool,
    namespace: &'a str,
}

impl Written<'_> {
    const WITH_REFERENCES: Self = Written {
        references: true,
        namespace: "",
    };
}

fn metadata(
    recording: &Path,
    how: &Resimulation,
    arguments: &Arguments,
) -> BTreeMap<String, String> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    let mut entries = BTreeMap::from([
        entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        entry(
            "command",
            if arguments.rigid.is_some() {
                "simulate --rigid"
            } else {
                "simulate --reference"
            }
            .to_owned(),
        ),
        entry(
            "reference",
            recording
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        ),
        entry(
            "scheme",
            how.scheme
                .map_or_else(|| "estimate".to_owned(), |scheme| scheme.to_string()),
        ),
        entry("seed", arguments.seed.to_string()),
        entry("noise", (!arguments.no_noise).to_string()),
    ]);
    if arguments.effects.is_some() || arguments.device.is_some() {
        entries.insert("effects".to_owned(), how.effects.to_yaml());
    }
    if let Some(networks) = &how.learned {
        entries.insert("learned".to_owned(), networks.input().name().to_owned());
    }
    if arguments.mapping.is_some() {
        entries.insert(
            "mapping".to_owned(),
            how.mapping
                .placements
                .keys()
                .cloned()
                .collect::<Vec<_>>()
                .join(", "),
        );
    }
    entries
}

/// What every mode takes.
fn from_arguments(arguments: &Arguments) -> Resimulation {
    Resimulation {
        rate_hz: arguments.rate,
        seed: arguments.seed,
        noise: !arguments.no_noise,
        ..Resimulation::default()
    }
}

fn write(
    mut metadata: BTreeMap<String, String>,
    recorded: &[RecordedPlacement],
    simulated: &[Resimulated],
    written: Written,
    arguments: &Arguments,
) -> anyhow::Result<BagSummary> {
    let options = BagOptions {
        compression: Compression::Zstd,
        replace: arguments.force,
        ..BagOptions::default()
    };
    for (placement, simulated) in recorded.iter().zip(simulated) {
        if simulated.quality.bandwidth.is_some() {
            metadata.extend(quality_entries(&placement.name, &simulated.quality));
        }
    }
    if written.references {
        metadata.extend(unlikely(recorded.iter().flat_map(|one| one.notes.clone())));
    }
    let mut bag = BagWriter::create(&arguments.out, options)?;
    bag.write_metadata("cromosim", metadata)?;
    let interrupt = Interrupt::watch()?;
    write_resimulated(
        &mut bag,
        recorded,
        simulated,
        written.references,
        written.namespace,
        || interrupt.check(),
    )?;
    Ok(bag.finish()?)
}
