//! What is the same for all motions of a call of `cromosim simulate`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use cromosim_evaluation::SimulationDraws;
use cromosim_imu::{Device, OrientationSource, Placement, PlacementSet, point_oddity};
use cromosim_learned::{LearnedSimulator, MappingFile};
use cromosim_motion::{
    MotionOptions, SmplMotion, embedded_walk, read_motion_for, read_people_whole,
};
use cromosim_recording::{
    Aside, PlayedPerson, SimulatedPerson, Simulation, SimulationOptions, csv_file,
};
use indicatif::ProgressBar;

use crate::body;
use crate::progress::Interrupt;
use crate::simulate_arguments::{Arguments, Format};

/// The file to write.
#[derive(Clone, Copy)]
pub struct Output<'a> {
    pub path: &'a Path,
    /// The recording's name in columns.
    pub recording: &'a str,
}

/// A file that was written.
pub struct Written {
    /// Messages or rows.
    pub count: u64,
    /// What is said of it.
    pub line: String,
}

/// What is the same for all motions of a call.
pub struct Setup {
    pub simulation: Simulation,
    pub draws: Option<SimulationDraws>,
    motion: MotionOptions,
    pub format: Format,
    pub force: bool,
    /// Whether what is written is said as JSON.
    pub json: bool,
    pub csv: Option<PathBuf>,
    /// As it was given.
    magnetic_field: Option<String>,
    pub interrupt: Interrupt,
}

impl Setup {
    pub fn new(arguments: &Arguments) -> anyhow::Result<Self> {
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
            field: arguments.field()?.map(Arc::new),
            orientation: arguments.orientation()?,
        };
        let model = body::model(arguments.body.as_deref())?;
        let simulation = Simulation::new(model, placements, folder, options)?;
        let draws = |path: &PathBuf| -> anyhow::Result<SimulationDraws> {
            let draws = SimulationDraws::read(path)?;
            draws.check(simulation.placements(), path)?;
            Ok(draws)
        };
        Ok(Self {
            draws: arguments.draw.as_ref().map(draws).transpose()?,
            simulation,
            motion: arguments.motion.options()?,
            format: arguments.format(),
            force: arguments.force,
            json: arguments.json,
            csv: arguments.csv.clone(),
            magnetic_field: arguments.magnetic_field.clone(),
            interrupt: Interrupt::watch()?,
        })
    }

    /// What a file says about how it was made, whatever the motion.
    pub fn settings(&self) -> BTreeMap<String, String> {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        BTreeMap::from([
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
            entry("command", "simulate".to_owned()),
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

    /// The same of a motion's people.
    pub fn settings_of(&self, people: &[PlayedPerson]) -> BTreeMap<String, String> {
        let motion = &people[0].motion.name;
        let name = Path::new(motion).file_name();
        let name = name.map_or_else(
            || motion.clone(),
            |name| name.to_string_lossy().into_owned(),
        );
        let mut settings = self.settings();
        settings.insert("motion".to_owned(), name);
        if let Some(field) = &self.magnetic_field {
            settings.insert("magnetic_field".to_owned(), field.clone());
        }
        let orientation = self.simulation.options().orientation;
        if orientation != OrientationSource::Truth {
            settings.insert("orientation".to_owned(), orientation.to_string());
        }
        settings
    }

    /// The placements' devices by name, with their effects; `ideal` where a placement names none.
    pub fn devices(&self) -> BTreeMap<String, String> {
        let placements = self.simulation.placements().placements().iter();
        let entry = |(placement, device): (&Placement, &Device)| {
            let name = placement.device().unwrap_or("ideal");
            (format!("device.{name}"), device.to_yaml(name))
        };
        placements
            .zip(self.simulation.devices())
            .map(entry)
            .collect()
    }

    /// All that outputs depend on beside the motion, for the manifest.
    pub fn manifest_settings(
        &self,
        arguments: &Arguments,
    ) -> anyhow::Result<BTreeMap<String, String>> {
        let mut settings = self.settings();
        settings.extend(self.devices());
        let options = self.simulation.options();
        let mapping = arguments.mapping.as_ref().map(fs::read).transpose()?;
        for (key, value) in [
            ("format", format!("{:?}", self.format)),
            ("csv", format!("{:?}", self.csv)),
            ("draws", format!("{:?}", self.draws)),
            ("differentiation", format!("{:?}", options.differentiation)),
            ("trim", format!("{:?}", options.trim)),
            ("magnetic_field", format!("{:?}", options.field)),
            ("orientation", options.orientation.to_string()),
            ("texture", format!("{:?}", options.texture)),
            (
                "pose_error_correlation_s",
                options.pose_error_correlation_s.to_string(),
            ),
            ("networks", format!("{:?}", arguments.learned)),
            (
                "mapping_crc32",
                format!("{:?}", mapping.map(|bytes| crc32fast::hash(&bytes))),
            ),
            ("motion_files", format!("{:?}", self.motion)),
        ] {
            settings.insert(key.to_owned(), value);
        }
        Ok(settings)
    }

    pub fn read(&self, path: Option<&Path>) -> anyhow::Result<Vec<PlayedPerson>> {
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
                vec![self.part(motion)?]
            }
            None if several => {
                bail!("--person: the embedded walk has one person; name a motion file")
            }
            None => vec![self.part(embedded_walk())?],
        })
    }

    /// The part of a motion that is asked for.
    fn part(&self, motion: SmplMotion) -> anyhow::Result<PlayedPerson> {
        let (start_s, duration_s) = (self.motion.start_s, self.motion.duration_s);
        Ok(PlayedPerson::part(&Arc::new(motion), start_s, duration_s)?)
    }

    pub fn simulate(
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
    pub fn csv_files(&self, people: &[PlayedPerson], out: &Path) -> Vec<PathBuf> {
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
    pub fn oddities(&self, people: &[PlayedPerson]) -> anyhow::Result<Vec<String>> {
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
}

pub fn names(placements: &PlacementSet) -> Vec<&str> {
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
