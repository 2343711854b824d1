//! The IMUs of a recording again, from its reference motion.

use cromosim_spatial::meant;
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use cromosim_bag::BagWriter;
use cromosim_imu::{
    AmbientField, DeclaredNoise, Differentiation, Effect, EffectSet, EffectsFile, ImuOptions,
    KinematicSample, MagneticMotion, Magnetometer, OrientationSource, PlacementEffects,
    ReadingMapping, RecordedMotion, SampleVariance, SensorFrame, SensorTrajectory, TextureSegment,
    Trim, UnexplainedErrors, add_texture, measure_magnetic_recording, measure_recording,
    simulate_kinematics, track_in_sensor_axes,
};
use cromosim_learned::{LearnedSimulator, MappingFile, SiteMotion};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::{
    FrameGrid, KinematicTrack, PoseEstimate, PoseSeries, Stamp, uniform_stamps,
};
use nalgebra::{Isometry3, Vector3};

use crate::reference_parts::parts;
use crate::{Quality, RecordedPlacement, RecordingError};

/// How the IMUs of a recording are simulated again.
#[derive(Default)]
pub struct Resimulation {
    /// The derivative scheme; none: the estimate of the motion that a diagnosis uses.
    pub scheme: Option<Differentiation>,
    /// What is left out at the ends where a scheme differentiates and nothing was measured.
    pub trim: Trim,
    /// What errs at each placement; those that it does not name stay nominal.
    pub effects: EffectsFile,
    /// Draws texture above what the poses resolve, as an IMU on this segment shows it.
    pub texture: Option<TextureSegment>,
    /// Networks that correct the kinematics; they need a scheme, and do nothing to a bandwidth.
    pub learned: Option<LearnedSimulator>,
    /// Maps readings last, at the placements that it names.
    pub mapping: MappingFile,
    /// Messages per second where none were measured, Hz.
    pub rate_hz: Option<f64>,
    /// Of the noise.
    pub seed: u64,
    /// Whether the random part of the errors is there.
    pub noise: bool,
    /// The magnetic field that magnetometers read; none: the one that a placement's effects hold.
    pub field: Option<Arc<AmbientField>>,
}

/// The mapping of a placement, where there is one.
pub fn reading_mapping(mapping: &MappingFile, placement: &str) -> Option<Box<dyn ReadingMapping>> {
    let mapping = mapping.placements.get(placement)?;
    Some(Box::new(mapping.clone()))
}

/// The placements whose samples have stamps, from messages or by a rate, and the names of the
/// others; all where none has any.
pub fn with_stamps(
    recorded: Vec<RecordedPlacement>,
    rate_hz: Option<f64>,
) -> (Vec<RecordedPlacement>, Vec<String>) {
    if rate_hz.is_some()
        || recorded
            .iter()
            .all(|placement| placement.measured.is_empty())
    {
        return (recorded, Vec::new());
    }
    let (with, without): (Vec<_>, Vec<_>) = recorded
        .into_iter()
        .partition(|placement| !placement.measured.is_empty());
    (
        with,
        without
            .into_iter()
            .map(|placement| placement.name)
            .collect(),
    )
}

/// The effects file; what it names must be there, while placements that it does not name stay
/// nominal.
///
/// # Errors
/// A file that cannot be read, or that names a placement which is not there.
pub fn read_effects(
    file: &Path,
    recorded: &[RecordedPlacement],
) -> Result<EffectsFile, RecordingError> {
    let effects = EffectsFile::read(file)?;
    let names: Vec<&str> = recorded
        .iter()
        .map(|placement| placement.name.as_str())
        .collect();
    if let Some(name) = effects
        .placements
        .keys()
        .find(|name| !names.contains(&name.as_str()))
    {
        return Err(RecordingError::Unsuitable {
            path: file.to_owned(),
            problem: format!(
                "placement `{name}`: the recording has no such placement; it has {}{}",
                names.join(", "),
                meant(name, names.iter().copied())
            ),
        });
    }
    Ok(effects)
}

/// The IMU of one placement, simulated again.
pub struct Resimulated {
    /// In order of time.
    pub messages: Vec<Imu>,
    /// Of the magnetometer, in order of time: with the stamps of its recorded messages, or of the IMU's
    /// where none were recorded. Empty without a magnetometer or a field.
    pub magnetic: Vec<MagneticField>,
    /// What they are good for.
    pub quality: Quality,
}

impl Resimulation {
    /// One Imu for each measured message, with its stamp; where nothing was measured, at the rate.
    ///
    /// # Errors
    /// Without stamps and rate, and where the reference's motion cannot be estimated.
    pub fn simulate(&self, placement: &RecordedPlacement) -> Result<Resimulated, RecordingError> {
        let Some(parts) = parts(placement) else {
            return self.simulate_part(placement, &placement.name);
        };
        let mut messages = vec![Imu::default(); placement.measured.len()];
        for (index, (part, places)) in parts.iter().enumerate() {
            let noise_of = match index {
                0 => placement.name.clone(),
                _ => format!("{}, part {}", placement.name, index + 1),
            };
            let simulated = self.simulate_part(part, &noise_of)?.messages;
            for (place, message) in places.iter().zip(simulated) {
                messages[*place] = message;
            }
        }
        // Nothing is laid over such pauses, and so the magnetometer is left out.
        Ok(Resimulated {
            messages,
            magnetic: Vec::new(),
            quality: Quality::default(),
        })
    }

    /// `noise_of` names the noise.
    fn simulate_part(
        &self,
        placement: &RecordedPlacement,
        noise_of: &str,
    ) -> Result<Resimulated, RecordingError> {
        let name = &placement.name;
        let mut stamps = self.stamps(placement)?;
        let rate_hz = mean_rate(&stamps);
        let nominal = PlacementEffects {
            epoch: stamps[0],
            declared_noise: declared(placement, rate_hz),
            effects: EffectSet::new(),
            unexplained: UnexplainedErrors::default(),
            reference_response: None,
            other_sessions: Vec::new(),
            magnetometer: self.field.as_ref().map(|_| Magnetometer::default()),
            field_in_world: None,
        };
        let effects = self.effects.placements.get(name).unwrap_or(&nominal);
        let effects = &effects.in_session_of(stamps[0]);
        let (track, known) = self
            .track(placement, rate_hz, effects)
            .map_err(|error| error.at(name.clone()))?;
        let stamps_are_recorded = !placement.measured.is_empty();
        let mut quality = Quality::default();
        if let (Known::Samples(_, found), false) = (&known, stamps_are_recorded) {
            let (found, span) = found.clone().ok_or(RecordingError::AllTrimmed)?;
            quality = found;
            stamps.retain(|stamp| span.contains(stamp));
        }
        let motion = RecordedMotion {
            track: &track,
            stamps: &stamps,
            variances: &known.variances(&stamps, &effects.effects),
            stamps_are_recorded,
        };
        let options = ImuOptions {
            rate_hz,
            seed: self.seed,
            name: noise_of.to_owned(),
            noise: self.noise,
            frame_id: placement.measured.first().map_or_else(
                || format!("{name}_imu"),
                |message| message.header.frame_id.clone(),
            ),
            mapping: reading_mapping(&self.mapping, name),
            field: None,
            orientation: OrientationSource::Truth,
        };
        let frame_id = options.frame_id.clone();
        let messages = measure_recording(motion, effects, options)?;
        let magnetic = self.magnetic(placement, effects, &track, &stamps, (noise_of, &frame_id));
        Ok(Resimulated {
            messages,
            magnetic,
            quality,
        })
    }

    /// What its magnetometer reads; nothing where it has none, or no field is known.
    fn magnetic(
        &self,
        placement: &RecordedPlacement,
        effects: &PlacementEffects,
        track: &KinematicTrack,
        imu_stamps: &[Stamp],
        (noise_of, frame_id): (&str, &str),
    ) -> Vec<MagneticField> {
        let found = || effects.field_in_world.map(AmbientField::uniform);
        let field = self.field.clone().or_else(|| found().map(Arc::new));
        let Some((field, magnetometer)) = field.zip(effects.magnetometer.as_ref()) else {
            return Vec::new();
        };
        let recorded: Vec<Stamp> = placement.magnetic_stamps().collect();
        let stamps = if recorded.is_empty() {
            imu_stamps
        } else {
            &recorded
        };
        let motion = MagneticMotion {
            track,
            positions: &positions_at(placement, stamps),
            stamps,
            rate_hz: mean_rate(stamps),
        };
        let noise = self.noise.then_some((self.seed, noise_of));
        measure_magnetic_recording(motion, effects, magnetometer, &field, (noise, frame_id))
    }

    fn stamps(&self, placement: &RecordedPlacement) -> Result<Vec<Stamp>, RecordingError> {
        let (start, end) = placement.span();
        match (placement.measured.as_slice(), self.rate_hz) {
            ([], Some(rate_hz)) => Ok(uniform_stamps(start, end, rate_hz)?),
            ([], None) => Err(RecordingError::NoStamps {
                placement: placement.name.clone(),
            }),
            (measured, _) => Ok(measured
                .iter()
                .map(|message| Stamp::from_nanos(message.header.stamp.nanos()))
                .collect()),
        }
    }

    /// The reference's motion as the diagnosis estimates it (then with the response of the effects file), or by a
    /// scheme, at least at 200 Hz and twice the IMU's rate; and what is known of its errors.
    fn track(
        &self,
        placement: &RecordedPlacement,
        imu_rate_hz: f64,
        known: &PlacementEffects,
    ) -> Result<(KinematicTrack, Known), RecordingError> {
        let effects = &known.effects;
        let undone = effects.reference_smoothing();
        let rate_hz = (2.0 * imu_rate_hz).max(200.0);
        let poses = own_frames(placement.poses(), effects);
        let Some(scheme) = self.scheme else {
            let estimate = PoseEstimate::fit(&poses.stamps, &poses.positions, &poses.rotations)
                .map_err(|source| RecordingError::NotEstimated { source })?;
            let estimate = undone
                .map(|smoothing| estimate.undoing(smoothing))
                .unwrap_or(estimate);
            let mut lines = effects.iter().filter_map(Effect::spectral_line);
            let estimate = lines
                .next()
                .map(|line| estimate.without_machine(line.hz))
                .unwrap_or(estimate);
            let response = known.reference_response.as_ref();
            let estimate = response
                .map(|response| estimate.with_response(response))
                .unwrap_or(estimate);
            let track = estimate.track_for(imu_rate_hz);
            return Ok((track, Known::Estimate(Box::new(estimate))));
        };
        if undone.is_some() {
            return Err(RecordingError::CannotUndo {
                scheme: scheme.to_string(),
            });
        }
        let units = effects.length_factor();
        let trajectory = trajectory_in_metres(&poses, units)?;
        let networks = self.learned.as_ref();
        let (mut samples, rate_hz) = differentiated(&trajectory, scheme, rate_hz, networks)?;
        let mut quality = Quality::of(&samples, self.trim);
        if let Some(segment) = self.texture {
            let drawn = add_texture(&mut samples, segment, (self.seed, &placement.name));
            let drawn = drawn.ok_or_else(|| RecordingError::NoBandwidth {
                placement: placement.name.clone(),
            })?;
            if let Some((quality, _)) = &mut quality {
                quality.texture = Some(drawn);
            }
        }
        let mut track = track_in_sensor_axes(&samples, rate_hz);
        // The effects take the units back.
        for acceleration in &mut track.acceleration_in_segment {
            *acceleration *= units;
        }
        Ok((track, Known::Samples(samples, quality)))
    }
}

/// What is known of the errors of a motion.
enum Known {
    /// Samples of a scheme, with their variances; what they are good for, and when.
    Samples(
        Vec<KinematicSample>,
        Option<(Quality, RangeInclusive<Stamp>)>,
    ),
    /// Of positions in the reference's own units.
    Estimate(Box<PoseEstimate>),
}

impl Known {
    /// What the errors leave at the stamps.
    fn variances(&self, stamps: &[Stamp], effects: &EffectSet) -> Vec<SampleVariance> {
        match self {
            Self::Samples(samples, _) => variances_at(samples, stamps),
            Self::Estimate(estimate) => {
                effects.reference_variances(estimate, effects.length_factor(), stamps)
            }
        }
    }
}

/// The frames of a reference that was interpolated between them, where the effects say so and the
/// poses show it; else the poses.
fn own_frames(poses: PoseSeries, effects: &EffectSet) -> PoseSeries {
    effects
        .frame_rate_hz()
        .and_then(|rate_hz| FrameGrid::at_rate(&poses, rate_hz))
        .map_or_else(|| poses.clone(), |grid| grid.frames(&poses))
}

/// Poses as the derivative schemes take them.
fn trajectory_in_metres(
    poses: &PoseSeries,
    length_units: f64,
) -> Result<SensorTrajectory, RecordingError> {
    let frame = |k: usize| {
        let position = poses.positions[k] / length_units;
        let pose = Isometry3::from_parts(position.into(), poses.rotations[k]);
        SensorFrame::new(poses.stamps[k], pose)
    };
    Ok(SensorTrajectory::new(
        (0..poses.stamps.len()).map(frame).collect(),
    )?)
}

/// The motion by a scheme and what networks add to it, on a grid from the first frame to the last, and its
/// rate, Hz.
fn differentiated(
    trajectory: &SensorTrajectory,
    scheme: Differentiation,
    least_rate_hz: f64,
    networks: Option<&LearnedSimulator>,
) -> Result<(Vec<KinematicSample>, f64), RecordingError> {
    let (start, seconds) = (trajectory.start(), trajectory.end() - trajectory.start());
    // A whole number of intervals, so that the grid ends where the reference does.
    let rate_hz = (seconds * least_rate_hz).ceil().max(1.0) / seconds;
    let grid = uniform_stamps(start, trajectory.end(), rate_hz)?;
    let mut motion = simulate_kinematics(trajectory, scheme, &grid)?;
    if let (Some(networks), Differentiation::Scheme(scheme)) = (networks, scheme) {
        motion = networks.correct(&SiteMotion::rigid(trajectory, scheme)?, &motion)?;
    }
    Ok((motion, rate_hz))
}

/// Where the reference frame is at stamps, on straight lines between its poses.
fn positions_at(placement: &RecordedPlacement, stamps: &[Stamp]) -> Vec<Vector3<f64>> {
    let frames = &placement.frames;
    let at = |stamp: &Stamp| {
        let after = frames.partition_point(|frame| frame.stamp < *stamp);
        let (before, after) = (after.saturating_sub(1), after.min(frames.len() - 1));
        let [from, to] = [before, after].map(|place| &frames[place]);
        let span_s = to.stamp - from.stamp;
        let part = if span_s > 0.0 {
            ((*stamp - from.stamp) / span_s).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let [from, to] = [from, to].map(|frame| frame.world_from_sensor.translation.vector);
        from.lerp(&to, part)
    };
    stamps.iter().map(at).collect()
}

/// The variances of the samples that follow the stamps; none without samples.
fn variances_at(samples: &[KinematicSample], stamps: &[Stamp]) -> Vec<SampleVariance> {
    let Some(last) = samples.len().checked_sub(1) else {
        return Vec::new();
    };
    let following = |stamp: &Stamp| samples.partition_point(|sample| sample.stamp < *stamp);
    let at = |stamp: &Stamp| samples[following(stamp).min(last)].variance;
    stamps.iter().map(at).collect()
}

/// The white noise that the messages declare, none where it is unknown: density = sigma /
/// sqrt(rate).
fn declared(placement: &RecordedPlacement, rate_hz: f64) -> DeclaredNoise {
    let declared = placement.declared();
    let density = |sigma: Option<f64>| sigma.unwrap_or(0.0) / rate_hz.sqrt();
    DeclaredNoise {
        accel_density: density(declared.accelerometer),
        gyro_density: density(declared.gyroscope),
    }
}

/// Mean rate of stamps in Hz, losses counted by how many medians of the intervals they span: the
/// rate that a diagnosis of them goes by.
fn mean_rate(stamps: &[Stamp]) -> f64 {
    let mut stamps = stamps.to_vec();
    stamps.sort();
    stamps.dedup();
    let intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = intervals.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2) else {
        return 1.0;
    };
    let steps: f64 = intervals
        .iter()
        .map(|interval| (interval / median).round().max(1.0))
        .sum();
    steps / (stamps[stamps.len() - 1] - stamps[0])
}

/// What a user should know of samples that the reference does not cover.
pub fn outside_reference(placement: &RecordedPlacement) -> Option<String> {
    let (start, end) = placement.span();
    let covered =
        |message: &&Imu| (start..=end).contains(&Stamp::from_nanos(message.header.stamp.nanos()));
    let missing = placement.measured.len() - placement.measured.iter().filter(covered).count();
    (missing > 0).then(|| {
        format!("{missing} messages lie outside the reference; they hold what its ends read")
    })
}

/// Writes the messages in order of time, with the references where they are wanted,
/// under `/imu/NAME/data_raw`, `/imu/NAME/mag` and `/reference/NAME`.
///
/// # Errors
/// Of `check`, which is called before each message, and of the bag.
pub fn write_resimulated<E: From<RecordingError>>(
    bag: &mut BagWriter,
    recorded: &[RecordedPlacement],
    simulated: &[Resimulated],
    with_references: bool,
    namespace: &str,
    check: impl Fn() -> Result<(), E>,
) -> Result<(), E> {
    let topics_of = |placement: &RecordedPlacement| {
        Kind::ALL.map(|kind| namespace.to_owned() + &kind.topic(&placement.name))
    };
    let topics: Vec<[String; 3]> = recorded.iter().map(topics_of).collect();
    for (nanos, kind, number, index) in in_order_of_time(recorded, simulated, with_references) {
        check()?;
        let stamp = Stamp::from_nanos(nanos);
        let topic = &topics[number][kind as usize];
        let written = match kind {
            Kind::Sample => bag.write(topic, stamp, &simulated[number].messages[index]),
            Kind::Field => bag.write(topic, stamp, &simulated[number].magnetic[index]),
            Kind::Reference => {
                let pose = recorded[number].frames[index].world_from_sensor.into();
                let header = Header::new(nanos, "world");
                bag.write(topic, stamp, &PoseStamped { header, pose })
            }
        };
        written.map_err(RecordingError::from)?;
    }
    Ok(())
}

/// Of one time, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Reference,
    Sample,
    Field,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Reference, Self::Sample, Self::Field];

    fn topic(self, name: &str) -> String {
        match self {
            Self::Reference => format!("/reference/{name}"),
            Self::Sample => format!("/imu/{name}/data_raw"),
            Self::Field => format!("/imu/{name}/mag"),
        }
    }
}

/// Nanoseconds, kind, placement and index of each message.
fn in_order_of_time(
    recorded: &[RecordedPlacement],
    simulated: &[Resimulated],
    with_references: bool,
) -> Vec<(i64, Kind, usize, usize)> {
    let mut order = Vec::new();
    for (number, (placement, simulated)) in recorded.iter().zip(simulated).enumerate() {
        let frames = if with_references {
            placement.frames.as_slice()
        } else {
            &[]
        };
        let of = |kind, stamps: Vec<i64>| {
            let indexed = stamps.into_iter().enumerate();
            indexed.map(move |(index, nanos)| (nanos, kind, number, index))
        };
        let references = frames.iter().map(|frame| frame.stamp.nanos).collect();
        let samples = simulated.messages.iter().map(|it| it.header.stamp.nanos());
        let fields = simulated.magnetic.iter().map(|it| it.header.stamp.nanos());
        order.extend(of(Kind::Reference, references));
        order.extend(of(Kind::Sample, samples.collect()));
        order.extend(of(Kind::Field, fields.collect()));
    }
    order.sort_by_key(|(nanos, kind, ..)| (*nanos, *kind));
    order
}
