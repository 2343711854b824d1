//! Virtual IMUs of a moving person, whole motions at once.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{
    AmbientField, Device, Differentiation, DrawnTexture, ImuOptions, KinematicSample,
    MotionCorrection, MountedSensor, MountedSensors, OrientationSource, Placement, PlacementSet,
    PoseStd, SensorTrajectory, TextureSegment, Trim, VirtualImu, add_texture,
    simulate_kinematics_on, simulate_several_on,
};
use cromosim_learned::{LearnedSimulator, MappingFile, Patch, SiteMotion, scheme_for_networks};
use cromosim_spatial::{PoseTimes, Stamp, uniform_stamps};
use rayon::prelude::*;

use crate::motion_spill::MotionSpill;
use crate::{
    PlayedPerson, Quality, RecordingError, SimulatedPerson, SimulatedPlacement, reading_mapping,
};

/// Bytes of samples that a motion's placements may keep in memory until they are written.
const IN_MEMORY: usize = 128 << 20;

/// Placements that are simulated at once: their segments are found once a pose.
const MOST_AT_ONCE: usize = 4;
/// Poses that these may hold in memory: longer motions are simulated a placement at a time. Of a pose
/// there are 1.5 KB.
const POSES_AT_ONCE: usize = 1 << 16;
/// Frames of all placements that may be in memory at once, of 120 bytes each: then the skeleton is found
/// once a pose, not once for each of the groups.
const FRAMES_AT_ONCE: usize = 1 << 18;

/// Where samples are put aside until they are read.
#[derive(Clone, Debug)]
pub struct Aside {
    /// Bytes a placement that stay in memory.
    in_memory: usize,
    folder: PathBuf,
    /// Whether the placements' frames stay too.
    frames: bool,
}

impl Aside {
    /// Where the output has to have room anyway, what is more than 128 MiB of all placements.
    pub fn beside(out: &Path, placements: usize) -> Self {
        let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty());
        Self {
            in_memory: IN_MEMORY / placements.max(1),
            folder: folder.unwrap_or(Path::new(".")).to_owned(),
            frames: false,
        }
    }

    /// All in memory, the placements' frames too.
    pub fn in_memory() -> Self {
        Self {
            in_memory: usize::MAX,
            folder: PathBuf::new(),
            frames: true,
        }
    }
}

/// Which texture is drawn.
#[derive(Clone, Copy, Debug)]
pub enum TextureOn {
    /// What each placement's own segment shows.
    ItsSegment,
    /// What this one shows, wherever the placement is.
    Segment(TextureSegment),
}

impl TextureOn {
    /// The segment, where that of the placement is `own`.
    pub fn or(self, own: TextureSegment) -> TextureSegment {
        match self {
            Self::ItsSegment => own,
            Self::Segment(segment) => segment,
        }
    }
}

/// How a [`Simulation`] differs from what the placements say, and what follows the kinematics.
#[derive(Default)]
pub struct SimulationOptions {
    /// Messages per second in place of the placements' own, Hz.
    pub rate_hz: Option<f64>,
    /// How every placement is differentiated; none: by its own scheme.
    pub differentiation: Option<Differentiation>,
    /// What is left out at the ends.
    pub trim: Trim,
    /// Draws texture above what the poses resolve.
    pub texture: Option<TextureOn>,
    /// Of the noise.
    pub seed: u64,
    /// Whether the random part of the errors is there.
    pub noise: bool,
    /// How long errors of the poses hold, s; 0: new with each pose.
    pub pose_error_correlation_s: f64,
    /// Networks that correct the kinematics.
    pub learned: Option<LearnedSimulator>,
    /// Maps readings last, at the placements that it names.
    pub mapping: MappingFile,
    /// What devices with a magnetometer read; none: nothing is said of it.
    pub field: Option<Arc<AmbientField>>,
    /// Where the orientations come from.
    pub orientation: OrientationSource,
}

/// Placements with their devices on a body, ready for any number of motions.
pub struct Simulation {
    model: Arc<BodyModel>,
    placements: PlacementSet,
    devices: Vec<Device>,
    options: Arc<SimulationOptions>,
    /// Of the noise.
    seed: u64,
}

impl Simulation {
    /// Of these placements on this body; files of devices are relative to `folder`.
    ///
    /// # Errors
    /// A device that is no embedded one's name and no file of one.
    pub fn new(
        model: Arc<BodyModel>,
        placements: PlacementSet,
        folder: &Path,
        options: SimulationOptions,
    ) -> Result<Self, RecordingError> {
        let placements = placements.map(|placement| {
            let rate_hz = options.rate_hz.unwrap_or(placement.rate_hz());
            let scheme = match options.differentiation {
                Some(Differentiation::Scheme(scheme)) => scheme,
                None if options.learned.is_some() => scheme_for_networks(placement.scheme()),
                _ => placement.scheme(),
            };
            placement.with_rate_hz(rate_hz).with_scheme(scheme)
        });
        let devices = placements
            .placements()
            .iter()
            .map(|placement| Device::resolve(placement.device(), folder))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            model,
            placements,
            devices,
            seed: options.seed,
            options: Arc::new(options),
        })
    }

    /// With this device at the placement of that name, whatever the placement says.
    #[must_use]
    pub fn with_device(mut self, placement: &str, device: &Device) -> Self {
        let placements = self.placements.placements().iter();
        for (at, own) in placements.zip(&mut self.devices) {
            if at.name() == placement {
                own.clone_from(device);
            }
        }
        self
    }

    /// The same with other placements, their devices, and another seed of the noise.
    #[must_use]
    pub fn varied(&self, placements: PlacementSet, devices: Vec<Device>, seed: u64) -> Self {
        Self {
            model: self.model.clone(),
            placements,
            devices,
            options: self.options.clone(),
            seed,
        }
    }

    /// The body.
    pub fn model(&self) -> &Arc<BodyModel> {
        &self.model
    }

    /// The placements as they are simulated.
    pub fn placements(&self) -> &PlacementSet {
        &self.placements
    }

    /// Their devices, in the placements' order.
    pub fn devices(&self) -> &[Device] {
        &self.devices
    }

    /// The rest.
    pub fn options(&self) -> &SimulationOptions {
        &self.options
    }

    /// All placements of a person, in their order, each on whatever core is free. `check` is called
    /// before each placement and may give up; `advance` after the trajectories and each placement.
    ///
    /// # Errors
    /// Of `check`, and what the placements, networks or the motion cannot do.
    pub fn simulate<E: From<RecordingError> + Send>(
        &self,
        person: &PlayedPerson,
        aside: &Aside,
        check: impl Fn() -> Result<(), E> + Sync,
        advance: impl Fn() + Sync,
    ) -> Result<SimulatedPerson, E> {
        let (placements, sites) = self.simulate_each(person, aside, check, advance, Ok)?;
        Ok(SimulatedPerson { placements, sites })
    }

    /// As [`Simulation::simulate`], with what `finish` makes of each placement on the same core, as soon as it
    /// is simulated: its samples are in the caches then, and their memory serves the next.
    ///
    /// # Errors
    /// As [`Simulation::simulate`], and those of `finish`.
    pub fn simulate_each<T: Send, E: From<RecordingError> + Send>(
        &self,
        person: &PlayedPerson,
        aside: &Aside,
        check: impl Fn() -> Result<(), E> + Sync,
        advance: impl Fn() + Sync,
        finish: impl Fn(SimulatedPlacement) -> Result<T, E> + Sync,
    ) -> Result<(Vec<T>, MountedSensors), E> {
        let PlayedPerson { motion, stamps, .. } = person;
        let shaped =
            ShapedBody::new(self.model.clone(), &motion.betas).map_err(RecordingError::from)?;
        let sites = MountedSensors::new(&shaped, self.placements.placements())
            .map_err(RecordingError::from)?;
        let played = person.played.clone().count();
        if played < 2 {
            let name = motion.name.clone();
            return Err(RecordingError::NoMotion {
                name,
                frames: played,
            }
            .into());
        }
        let times = PoseTimes::new(stamps).map_err(RecordingError::from)?;
        advance();
        let count = sites.sensors().len();
        let groups = groups(count, stamps.len());
        let mut trajectories = Vec::new();
        if count * stamps.len() <= FRAMES_AT_ONCE {
            trajectories = self.trajectories(person, &sites)?;
        }
        let mut trajectories = trajectories.into_iter();
        let own = |indices: Range<usize>| {
            let own: Vec<_> = trajectories.by_ref().take(indices.len()).collect();
            (indices, own)
        };
        let groups: Vec<_> = groups.into_iter().map(own).collect();
        let together = |(indices, own): (Range<usize>, _)| -> Result<Vec<T>, E> {
            check()?;
            let motions = self.motions(person, &shaped, (indices.clone(), own), &times);
            let one = |(index, motion): (usize, _)| {
                check()?;
                let mounted = (&shaped, &sites.sensors()[index]);
                let simulated = self.simulate_placement(person, mounted, index, motion, aside);
                let finished = simulated.map_err(E::from).and_then(&finish);
                advance();
                finished
            };
            indices.zip(motions?).map(one).collect()
        };
        // Of several errors the first placement's is said, whichever comes first.
        let placements: Vec<Result<_, E>> = groups.into_par_iter().map(together).collect();
        let placements = placements.into_iter().collect::<Result<Vec<_>, E>>()?;
        Ok((placements.into_iter().flatten().collect(), sites))
    }

    /// Trajectories and ideal motions of some placements; the trajectories are found where none are given.
    fn motions(
        &self,
        person: &PlayedPerson,
        shaped: &ShapedBody,
        (indices, mut trajectories): (Range<usize>, Vec<SensorTrajectory>),
        times: &PoseTimes,
    ) -> Result<Vec<(SensorTrajectory, Vec<KinematicSample>)>, RecordingError> {
        let placements = &self.placements.placements()[indices];
        if trajectories.is_empty() {
            trajectories = self.trajectories(person, &MountedSensors::new(shaped, placements)?)?;
        }
        let [start, end] =
            [person.played.start(), person.played.end()].map(|frame| person.stamps[*frame]);
        let mut outputs: Vec<Vec<Stamp>> = Vec::with_capacity(placements.len());
        for (k, placement) in placements.iter().enumerate() {
            let same = (0..k).find(|&j| placements[j].rate_hz() == placement.rate_hz());
            outputs.push(match same {
                Some(j) => outputs[j].clone(),
                None => uniform_stamps(start, end, placement.rate_hz())?,
            });
        }
        let schemes: BTreeSet<_> = placements.iter().map(|one| one.scheme().name()).collect();
        let by = |placement: &Placement| match self.options.differentiation {
            Some(by @ Differentiation::Bandwidth(_)) => by,
            _ => placement.scheme().into(),
        };
        let motions = match placements.first().map(by) {
            Some(Differentiation::Scheme(scheme)) if schemes.len() == 1 => {
                simulate_several_on(times, &trajectories, scheme, &outputs)?
            }
            _ => {
                let several = placements.iter().zip(&trajectories).zip(&outputs);
                several
                    .map(|((placement, trajectory), output)| {
                        simulate_kinematics_on(times, trajectory, by(placement), output)
                    })
                    .collect::<Result<_, _>>()?
            }
        };
        Ok(trajectories.into_iter().zip(motions).collect())
    }

    /// Of a long motion of some placements at a time: the frames of all would be most of its memory.
    fn trajectories(
        &self,
        person: &PlayedPerson,
        mounted: &MountedSensors,
    ) -> Result<Vec<SensorTrajectory>, RecordingError> {
        let motion = &person.motion;
        let confidences = motion.confidence.as_deref().unwrap_or_default();
        let correlation_s = self.options.pose_error_correlation_s;
        let stds: Vec<PoseStd> = confidences
            .iter()
            .map(|&confidence| PoseStd::from_confidence(confidence, correlation_s))
            .collect();
        let trajectories = mounted.trajectories(&person.stamps, &motion.frames)?;
        let finished = |trajectory: SensorTrajectory| {
            trajectory
                .with_pose_stds(&stds)
                .from_source(motion.source())
        };
        Ok(trajectories.into_iter().map(finished).collect())
    }

    fn simulate_placement(
        &self,
        person: &PlayedPerson,
        (shaped, mounted): (&ShapedBody, &MountedSensor),
        index: usize,
        (trajectory, mut motion): (SensorTrajectory, Vec<KinematicSample>),
        aside: &Aside,
    ) -> Result<SimulatedPlacement, RecordingError> {
        let (placement, device) = (&self.placements.placements()[index], &self.devices[index]);
        let (name, rate_hz) = (placement.name(), placement.rate_hz());
        let options = ImuOptions {
            rate_hz,
            seed: self.seed,
            // Several people's devices err each on its own, as those of nodes with a prefix do.
            name: person.frame(name),
            noise: self.options.noise,
            frame_id: person.frame(&format!("{name}_imu")),
            mapping: reading_mapping(&self.options.mapping, name),
            field: self.options.field.clone(),
            orientation: self.options.orientation,
        };
        let imu = VirtualImu::new(device, options)?;
        let (mut quality, span) =
            Quality::of(&motion, self.options.trim).ok_or(RecordingError::AllTrimmed)?;
        motion.truncate(motion.partition_point(|sample| sample.stamp <= *span.end()));
        // What is left out in front stays where it lies: all behind it would have to move.
        let mut first = motion.partition_point(|sample| sample.stamp < *span.start());
        let whose = person.frame(name);
        quality.texture = self.draw_texture(&mut motion[first..], mounted, &whose)?;
        if let Some(networks) = &self.options.learned {
            motion.drain(..std::mem::take(&mut first));
            let patch = Patch::new(shaped, mounted.site())?;
            let poses = person.motion.frames.iter();
            let points: Vec<_> = poses.map(|pose| patch.points(pose)).collect();
            let seen = SiteMotion::new(&trajectory, placement.scheme(), &points)?;
            networks
                .correction(seen)
                .correct(std::slice::from_mut(&mut motion))?;
        }
        let mut frames = Vec::new();
        if aside.frames {
            frames = trajectory.into_frames();
            frames.truncate(person.played.end() + 1);
            frames.drain(..person.played.start());
        }
        Ok(SimulatedPlacement {
            frames,
            name: name.to_owned(),
            motion: MotionSpill::new(motion, first, (aside.in_memory, &aside.folder))?,
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
    ) -> Result<Option<DrawnTexture>, RecordingError> {
        let Some(texture) = self.options.texture else {
            return Ok(None);
        };
        let segment = texture.or(TextureSegment::of_joint(mounted.joint()));
        let drawn = add_texture(motion, segment, (self.seed, whose));
        let drawn = drawn.ok_or_else(|| RecordingError::NoBandwidth {
            placement: whose.to_owned(),
        })?;
        Ok(Some(drawn))
    }
}

/// Which placements are simulated at once: as many as memory allows, but no fewer groups than there are
/// cores.
fn groups(placements: usize, poses: usize) -> Vec<Range<usize>> {
    let within_memory = (POSES_AT_ONCE / poses.max(1)).clamp(1, MOST_AT_ONCE);
    let shared = placements.div_ceil(rayon::current_num_threads());
    let size = within_memory.min(shared).max(1);
    let starts = (0..placements).step_by(size);
    starts
        .map(|start| start..(start + size).min(placements))
        .collect()
}
