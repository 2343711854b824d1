//! `cromosim simulate MOTIONS`: motion files to bags, without DDS, on all cores.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use cromosim_bag::{BagOptions, BagSummary, BagWriter, Compression};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{
    Device, Differentiation, DrawnTexture, ImuOptions, KinematicSample, MotionCorrection,
    MountedSensor, MountedSensors, PlacementSet, PoseStd, SensorTrajectory, TextureSegment, Trim,
    VirtualImu, add_texture, point_oddity, simulate_kinematics_on,
};
use cromosim_learned::{LearnedSimulator, MappingFile, Patch, SiteMotion, scheme_for_networks};
use cromosim_motion::{
    MotionOptions, SmplMotion, embedded_walk, read_motion_for, read_people_whole,
};
use cromosim_recording::{
    FIRST_STAMP, MotionSpill, PlayedPerson, Quality, RecordingError, SimulatedPerson,
    SimulatedPlacement, csv_file, reading_mapping, write_people, write_people_csv,
};
use cromosim_spatial::{PoseTimes, Stamp, uniform_stamps};
use indicatif::ProgressBar;
use rayon::prelude::*;

use crate::files::refuse_existing;
use crate::output::{remark, say};
use crate::progress::Interrupt;
use crate::simulate_arguments::{Arguments, TextureOn};
use crate::simulated_quality::{quality_entries, quality_line, unlikely, warn};
use crate::{body, progress};

/// What is the same for all motions of a call.
struct Setup {
    model: Arc<BodyModel>,
    placements: PlacementSet,
    devices: Vec<Device>,
    motion: MotionOptions,
    bandwidth_hz: Option<f64>,
    trim: Trim,
    texture: Option<TextureOn>,
    seed: u64,
    noise: bool,
    pose_error_correlation_s: f64,
    force: bool,
    csv: Option<PathBuf>,
    learned: Option<LearnedSimulator>,
    mapping: MappingFile,
    interrupt: Interrupt,
}

/// Bytes of samples that a motion's placements may keep in memory until they are written.
const IN_MEMORY: usize = 128 << 20;

/// Where samples are put aside.
struct Aside {
    /// Bytes a placement.
    in_memory: usize,
    folder: PathBuf,
}

impl Aside {
    /// Where the output has to have room anyway.
    fn beside(out: &Path, placements: usize) -> Self {
        let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty());
        Self {
            in_memory: IN_MEMORY / placements.max(1),
            folder: folder.unwrap_or(Path::new(".")).to_owned(),
        }
    }
}

/// Runs `simulate MOTIONS`.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = Setup::new(arguments)?;
    if arguments.motions.len() <= 1 {
        let people = setup.read(arguments.motions.first())?;
        let steps = people.len() * (setup.placements.placements().len() + 1);
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
        let given = arguments.differentiation()?;
        let placements = placements.map(|placement| {
            let rate_hz = arguments.rate.unwrap_or(placement.rate_hz());
            let scheme = match given {
                Some(Differentiation::Scheme(scheme)) => scheme,
                None if arguments.learned.is_some() => scheme_for_networks(placement.scheme()),
                _ => placement.scheme(),
            };
            placement.with_rate_hz(rate_hz).with_scheme(scheme)
        });
        let folder = file.and_then(Path::parent).unwrap_or(Path::new("."));
        let devices = placements
            .placements()
            .iter()
            .map(|placement| Device::resolve(placement.device(), folder))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            model: body::model(arguments.body.as_deref())?,
            devices,
            motion: arguments.motion.options()?,
            bandwidth_hz: arguments.bandwidth,
            trim: arguments.trim()?,
            texture: arguments.texture()?,
            seed: arguments.seed,
            noise: !arguments.no_noise,
            pose_error_correlation_s: arguments.pose_error_correlation,
            force: arguments.force,
            csv: arguments.csv.clone(),
            learned: arguments
                .learned
                .as_deref()
                .map(LearnedSimulator::find)
                .transpose()?,
            mapping: read_mapping(arguments.mapping.as_deref(), &names(&placements))?,
            placements,
            interrupt: Interrupt::watch()?,
        })
    }

    fn read(&self, path: Option<&PathBuf>) -> anyhow::Result<Vec<PlayedPerson>> {
        let several = self.motion.asks_for_several();
        Ok(match path {
            Some(path) if several => read_people_whole(path, &self.model, &self.motion)?
                .into_iter()
                .map(PlayedPerson::of_several)
                .collect(),
            Some(path) => {
                let whole = MotionOptions {
                    start_s: 0.0,
                    duration_s: None,
                    ..self.motion.clone()
                };
                let motion = read_motion_for(path, &self.model, &whole)?;
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

    /// All placements of a person, each on whatever core is free.
    fn simulate(
        &self,
        person: &PlayedPerson,
        aside: &Aside,
        bar: &ProgressBar,
    ) -> anyhow::Result<SimulatedPerson> {
        let PlayedPerson { motion, stamps, .. } = person;
        let shaped = ShapedBody::new(self.model.clone(), &motion.betas)?;
        let sites = MountedSensors::new(&shaped, self.placements.placements())?;
        let played = person.played.clone().count();
        if played < 2 {
            bail!(
                "{}: {played} frame is no motion; at least 2 are needed",
                motion.name
            );
        }
        let confidences = motion.confidence.as_deref().unwrap_or_default();
        let stds: Vec<PoseStd> = confidences
            .iter()
            .map(|&confidence| PoseStd::from_confidence(confidence, self.pose_error_correlation_s))
            .collect();
        let times = PoseTimes::new(stamps)?;
        bar.inc(1);
        let one = |index: usize| {
            self.interrupt.check()?;
            // Poses of one placement at a time: those of all would be most of a long motion's memory.
            let alone = &self.placements.placements()[index..=index];
            let trajectories = MountedSensors::new(&shaped, alone)?;
            let trajectories = trajectories.trajectories(stamps, &motion.frames)?;
            let trajectory = trajectories
                .into_iter()
                .next()
                .context("a placement has a trajectory")?
                .with_pose_stds(&stds)
                .from_source(motion.source());
            let mounted = (&shaped, &sites.sensors()[index]);
            let simulated =
                self.simulate_placement(person, mounted, index, (&trajectory, &times), aside);
            bar.inc(1);
            simulated
        };
        let placements = (0..sites.sensors().len()).into_par_iter().map(one);
        Ok(SimulatedPerson {
            placements: placements.collect::<anyhow::Result<_>>()?,
            sites,
        })
    }

    fn simulate_placement(
        &self,
        person: &PlayedPerson,
        (shaped, mounted): (&ShapedBody, &MountedSensor),
        index: usize,
        (trajectory, times): (&SensorTrajectory, &PoseTimes),
        aside: &Aside,
    ) -> anyhow::Result<SimulatedPlacement> {
        let (placement, device) = (&self.placements.placements()[index], &self.devices[index]);
        let (name, rate_hz) = (placement.name(), placement.rate_hz());
        let [start, end] = [person.played.start(), person.played.end()]
            .map(|frame| trajectory.frames()[*frame].stamp);
        let output = uniform_stamps(start, end, rate_hz)?;
        let options = ImuOptions {
            rate_hz,
            seed: self.seed,
            // Several people's devices err each on its own, as those of nodes with a prefix do.
            name: person.frame(name),
            noise: self.noise,
            frame_id: person.frame(&format!("{name}_imu")),
            mapping: reading_mapping(&self.mapping, name),
        };
        let imu = VirtualImu::new(device, options)?;
        let by = match self.bandwidth_hz {
            Some(bandwidth_hz) => Differentiation::Bandwidth(bandwidth_hz),
            None => placement.scheme().into(),
        };
        let mut motion = simulate_kinematics_on(times, trajectory, by, &output)?;
        let (mut quality, span) =
            Quality::of(&motion, self.trim).ok_or(RecordingError::AllTrimmed)?;
        motion.retain(|sample| span.contains(&sample.stamp));
        let whose = person.frame(name);
        quality.texture = self.draw_texture(&mut motion, mounted, &whose)?;
        let mut motion = [motion];
        if let Some(networks) = &self.learned {
            let patch = Patch::new(shaped, mounted.site())?;
            let poses = person.motion.frames.iter();
            let points: Vec<_> = poses.map(|pose| patch.points(pose)).collect();
            let seen = SiteMotion::new(trajectory, placement.scheme(), &points)?;
            networks.correction(seen).correct(&mut motion)?;
        }
        let [motion] = motion;
        Ok(SimulatedPlacement {
            name: name.to_owned(),
            motion: MotionSpill::new(&motion, aside.in_memory, &aside.folder)?,
            imu,
            quality,
        })
    }

    /// Draws what is asked for above what the motion resolves.
    fn draw_texture(
        &self,
        motion: &mut [KinematicSample],
        mounted: &MountedSensor,
        whose: &str,
    ) -> anyhow::Result<Option<DrawnTexture>> {
        let Some(texture) = self.texture else {
            return Ok(None);
        };
        let segment = texture.or(TextureSegment::of_joint(mounted.joint()));
        let drawn = add_texture(motion, segment, (self.seed, whose));
        let drawn = drawn.ok_or_else(|| RecordingError::NoBandwidth {
            placement: whose.to_owned(),
        })?;
        Ok(Some(drawn))
    }

    /// The CSV files of a bag, where they are asked for.
    fn csv_files(&self, people: &[PlayedPerson], out: &Path) -> Vec<PathBuf> {
        let of_person = |folder: &Path, person: &PlayedPerson| -> Vec<PathBuf> {
            let names = names(&self.placements).into_iter();
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
        for placement in self.placements.placements() {
            let odd = point_oddity(&self.model, placement)?;
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
            entry("body", self.model.id().to_owned()),
            entry("seed", self.seed.to_string()),
            entry("noise", self.noise.to_string()),
            entry("placements", self.placements.to_yaml()),
            entry(
                "learned",
                self.learned
                    .as_ref()
                    .map_or("none", |networks| networks.input().name())
                    .to_owned(),
            ),
            entry(
                "mapping",
                self.mapping
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
        setup.placements.to_yaml().as_bytes(),
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
    let aside = Aside::beside(out, people.len() * setup.placements.placements().len());
    let mut simulated = people
        .iter()
        .map(|person| setup.simulate(person, &aside, bar))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let oddities = setup.oddities(people)?;
    let summary = write_bag(setup, people, &mut simulated, &oddities, out)?;
    if let Some(folder) = &setup.csv {
        for person in people {
            write_people_csv(out, folder, person, &names(&setup.placements), setup.force)?;
        }
    }
    let motion = &people[0].motion;
    bar.suspend(|| warn(Path::new(&motion.name), &oddities));
    let last = last_played(people).map_or(0.0, |last| last - FIRST_STAMP);
    let placements = setup.placements.placements().len();
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
