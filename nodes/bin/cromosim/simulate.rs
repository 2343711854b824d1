//! `cromosim simulate MOTIONS`: motion files to bags, without DDS, on all cores.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use cromosim_bag::{BagOptions, BagSummary, BagWriter, Compression};
use cromosim_imu::{PlacementSet, point_oddity};
use cromosim_learned::{LearnedSimulator, MappingFile};
use cromosim_motion::{
    MotionOptions, SmplMotion, embedded_walk, read_motion_for, read_people_whole,
};
use cromosim_recording::{
    Aside, FIRST_STAMP, PlayedPerson, SimulatedPerson, SimulatedPlacement, Simulation,
    SimulationOptions, csv_file, write_people, write_people_csv,
};
use cromosim_spatial::Stamp;
use indicatif::ProgressBar;
use rayon::prelude::*;

use crate::files::refuse_existing;
use crate::output::{remark, say};
use crate::progress::Interrupt;
use crate::simulate_arguments::Arguments;
use crate::simulated_quality::{quality_entries, quality_line, unlikely, warn};
use crate::{body, progress};

/// What is the same for all motions of a call.
struct Setup {
    simulation: Simulation,
    motion: MotionOptions,
    force: bool,
    csv: Option<PathBuf>,
    interrupt: Interrupt,
}

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
    let outs = output_names(&arguments.motions, &arguments.out)?;
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

/// OUT/NAME.mcap for every motion; two motions of one name would overwrite each other.
fn output_names(motions: &[PathBuf], out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut taken: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let mut outs = Vec::new();
    for motion in motions {
        let place = out
            .join(motion.file_stem().unwrap_or_default())
            .with_extension("mcap");
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

impl Setup {
    fn new(arguments: &Arguments) -> anyhow::Result<Self> {
        let file = arguments.placements.as_deref();
        let placements = match file {
            Some(path) => PlacementSet::read(path)?,
            None if arguments.placement.is_empty() => PlacementSet::demo(),
            None => PlacementSet::at_sites(&arguments.placement, "--placement")?,
        };
        let placements = match &arguments.device {
            Some(device) => placements.map(|placement| placement.with_device(device)),
            None => placements,
        };
        let folder = match arguments.device {
            Some(_) => Path::new("."),
            None => file.and_then(Path::parent).unwrap_or(Path::new(".")),
        };
        let options = SimulationOptions {
            rate_hz: arguments.rate,
            differentiation: arguments.differentiation()?,
            trim: arguments.trim()?,
            texture: arguments.texture()?,
            seed: arguments.seed,
            noise: !arguments.no_noise,
            pose_error_correlation_s: arguments.pose_error_correlation,
            learned: arguments
                .learned
                .as_deref()
                .map(LearnedSimulator::find)
                .transpose()?,
            mapping: read_mapping(arguments.mapping.as_deref(), &names(&placements))?,
        };
        let model = body::model(arguments.body.as_deref())?;
        Ok(Self {
            simulation: Simulation::new(model, placements, folder, options)?,
            motion: arguments.motion.options()?,
            force: arguments.force,
            csv: arguments.csv.clone(),
            interrupt: Interrupt::watch()?,
        })
    }

    fn read(&self, path: Option<&PathBuf>) -> anyhow::Result<Vec<PlayedPerson>> {
        let several = self.motion.asks_for_several();
        Ok(match path {
            Some(path) if several => {
                read_people_whole(path, self.simulation.model(), &self.motion)?
                    .into_iter()
                    .map(PlayedPerson::of_several)
                    .collect()
            }
            Some(path) => {
                let whole = MotionOptions {
                    start_s: 0.0,
                    duration_s: None,
                    ..self.motion.clone()
                };
                let motion = read_motion_for(path, self.simulation.model(), &whole)?;
                vec![self.part(&motion)?]
            }
            None if several => {
                bail!("--person: the embedded walk has one person; name a motion file")
            }
            None => vec![self.part(&embedded_walk())?],
        })
    }

    /// The part of a motion that is asked for.
    fn part(&self, motion: &SmplMotion) -> anyhow::Result<PlayedPerson> {
        let (start_s, duration_s) = (self.motion.start_s, self.motion.duration_s);
        Ok(PlayedPerson::part(motion, start_s, duration_s)?)
    }

    fn simulate(
        &self,
        person: &PlayedPerson,
        aside: &Aside,
        bar: &ProgressBar,
    ) -> anyhow::Result<SimulatedPerson> {
        let check = || self.interrupt.check();
        self.simulation
            .simulate(person, aside, check, || bar.inc(1))
    }

    /// The CSV files of a bag, where they are asked for.
    fn csv_files(&self, people: &[PlayedPerson], out: &Path) -> Vec<PathBuf> {
        let of_person = |folder: &Path, person: &PlayedPerson| -> Vec<PathBuf> {
            let names = names(self.simulation.placements()).into_iter();
            names
                .map(|name| csv_file(out, folder, person, name))
                .collect()
        };
        let folder = self.csv.iter();
        folder
            .flat_map(|folder| people.iter().map(|person| of_person(folder, person)))
            .flatten()
            .collect()
    }

    /// What is unlikely of people and placements; the readers have refused what is impossible.
    fn oddities(&self, people: &[PlayedPerson]) -> anyhow::Result<Vec<String>> {
        let mut oddities = Vec::new();
        for person in people {
            let who = if person.label.is_empty() {
                String::new()
            } else {
                format!("{}: ", person.label)
            };
            let odd = person.motion.oddities().into_iter();
            oddities.extend(odd.map(|odd| format!("{who}{odd}")));
        }
        for placement in self.simulation.placements().placements() {
            let odd = point_oddity(self.simulation.model(), placement)?;
            oddities.extend(odd.map(|odd| format!("placement {}: {odd}", placement.name())));
        }
        Ok(oddities)
    }

    /// What a bag says about how it was made.
    fn metadata(&self, motion: &SmplMotion) -> BTreeMap<String, String> {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        BTreeMap::from([
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
            entry("command", "simulate".to_owned()),
            entry(
                "motion",
                Path::new(&motion.name).file_name().map_or_else(
                    || motion.name.clone(),
                    |name| name.to_string_lossy().into_owned(),
                ),
            ),
            entry("body", self.simulation.model().id().to_owned()),
            entry("seed", self.simulation.options().seed.to_string()),
            entry("noise", self.simulation.options().noise.to_string()),
            entry("placements", self.simulation.placements().to_yaml()),
            entry(
                "learned",
                self.simulation
                    .options()
                    .learned
                    .as_ref()
                    .map_or("none", |networks| networks.input().name())
                    .to_owned(),
            ),
            entry(
                "mapping",
                self.simulation
                    .options()
                    .mapping
                    .placements
                    .keys()
                    .cloned()
                    .collect::<Vec<_>>()
                    .join(", "),
            ),
        ])
    }
}

fn names(placements: &PlacementSet) -> Vec<&str> {
    placements
        .placements()
        .iter()
        .map(cromosim_imu::Placement::name)
        .collect()
}

/// A mapping of these placements at least in part.
pub fn read_mapping(path: Option<&Path>, placements: &[&str]) -> anyhow::Result<MappingFile> {
    let Some(path) = path else {
        return Ok(MappingFile::default());
    };
    let mapping = MappingFile::read(path)?;
    if !placements
        .iter()
        .any(|name| mapping.placements.contains_key(*name))
    {
        let known: Vec<&str> = mapping.placements.keys().map(String::as_str).collect();
        bail!(
            "{}: maps {}; none of the placements {}",
            path.display(),
            known.join(", "),
            placements.join(", ")
        );
    }
    Ok(mapping)
}

fn last_played(people: &[PlayedPerson]) -> Option<Stamp> {
    let last = |person: &PlayedPerson| person.stamps.get(*person.played.end()).copied();
    people.iter().filter_map(last).max()
}

fn write_bag(
    setup: &Setup,
    people: &[PlayedPerson],
    simulated: &mut [SimulatedPerson],
    oddities: &[String],
    out: &Path,
) -> anyhow::Result<BagSummary> {
    let options = BagOptions {
        compression: Compression::Zstd,
        replace: setup.force,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(out, options)?;
    let mut metadata = setup.metadata(&people[0].motion);
    for (person, simulated) in people.iter().zip(simulated.iter()) {
        let quality = |placement: &SimulatedPlacement| {
            quality_entries(&person.frame(&placement.name), &placement.quality)
        };
        metadata.extend(simulated.placements.iter().flat_map(quality));
    }
    metadata.extend(unlikely(oddities.iter().cloned()));
    bag.write_metadata("cromosim", metadata)?;
    bag.attach(
        "placements.yaml",
        "application/yaml",
        FIRST_STAMP,
        setup.simulation.placements().to_yaml().as_bytes(),
    )?;
    write_people(&mut bag, people, simulated, || setup.interrupt.check())?;
    Ok(bag.finish()?)
}

fn simulate_one(
    setup: &Setup,
    people: &[PlayedPerson],
    out: &Path,
    bar: &ProgressBar,
) -> anyhow::Result<String> {
    refuse_existing(out, setup.force)?;
    for path in setup.csv_files(people, out) {
        refuse_existing(&path, setup.force)?;
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
    let summary = write_bag(setup, people, &mut simulated, &oddities, out)?;
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
    let last = last_played(people).map_or(0.0, |last| last - FIRST_STAMP);
    let placements = setup.simulation.placements().placements().len();
    let who = if people.len() > 1 {
        format!("{} people, ", people.len())
    } else {
        String::new()
    };
    Ok(format!(
        "{}: {} messages, {who}{placements} placements, {last:.2} s of {}{}",
        out.display(),
        summary.message_count(),
        motion.name,
        quality_line(
            simulated
                .iter()
                .flat_map(|person| &person.placements)
                .map(|placement| placement.quality)
        )
    ))
}
