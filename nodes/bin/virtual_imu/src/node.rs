//! From the states of a body to the messages of its virtual IMUs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_imu::{
    AmbientField, Device, EffectKind, Follow, ImuError, ImuMessages, MountedSensors, Placement,
    PlacementSet, PoseStd, StreamOptions, StreamingImu, VirtualImu, measure_all,
};
use cromosim_learned::{LearnedSimulator, LivePlacements, MappingFile};
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use cromosim_msgs::geometry_msgs::{PoseStamped, TransformStamped};
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::{PoseSource, Stamp};
use nalgebra::Isometry3;

use crate::config::Config;
use crate::parts::{
    fresh_imus, fresh_networks, pose_source, read_mapping, read_networks, resolved_devices,
};
use crate::refusal::Refusal;

/// States that are looked at before the rate of the states is known.
const RATE_STATES: usize = 13;

/// What one state leads to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// The samples that it released, each with its placement's number.
    pub readings: Vec<(usize, ImuMessages)>,
    /// For `/tf`: the frames of sensors that follow the skin.
    pub frames: TFMessage,
    /// For `reference/NAME`, in the order of the placements.
    pub references: Vec<PoseStamped>,
}

/// The node: a function of the states so far.
pub struct VirtualImuNode {
    config: Config,
    model: Arc<BodyModel>,
    placements: Vec<Placement>,
    devices: Vec<Device>,
    device_folder: PathBuf,
    /// None: nothing is said of magnetometers.
    field: Option<Arc<AmbientField>>,
    /// Of the placements; none before the rate of the states is known.
    streams: Vec<StreamingImu>,
    imus: Vec<VirtualImu>,
    betas: Vec<f64>,
    shaped: ShapedBody,
    sensors: MountedSensors,
    /// States that wait until their rate is known.
    early: Vec<(Stamp, BodyPose, PoseStd)>,
    /// 0 before it is known.
    state_rate_hz: f64,
    last: Option<Stamp>,
    counts: Counts,
    learned: Option<LearnedSimulator>,
    /// The networks' states.
    live: Option<LivePlacements>,
    /// At most, s; 0 without, and before the rate of the states is known.
    networks_delay: f64,
    mapping: MappingFile,
    source: PoseSource,
}

#[derive(Default)]
struct Counts {
    states: u64,
    refused: u64,
    readings: u64,
    without_estimate: u64,
    restarts: u64,
    last_refusal: String,
}

impl VirtualImuNode {
    /// A node for these placements; device files are found relative to `device_folder`.
    ///
    /// # Errors
    /// Sites that the body does not have, devices that are not there.
    pub fn new(
        config: Config,
        model: Arc<BodyModel>,
        placements: &PlacementSet,
        device_folder: &Path,
    ) -> Result<Self, Refusal> {
        let placements: Vec<Placement> = placements.placements().to_vec();
        let devices = resolved_devices(&config, &placements, device_folder)?;
        let field = match config.magnetic_field.as_str() {
            "" => None,
            text => Some(Arc::new(AmbientField::resolve(text)?)),
        };
        let shaped = ShapedBody::new(model.clone(), &[])?;
        let sensors = MountedSensors::new(&shaped, &placements)?;
        let learned = read_networks(&config.learned)?;
        let mapping = read_mapping(&config.mapping, &placements)?;
        let source = pose_source(&config.pose_source)?;
        let imus = fresh_imus(&config, &mapping, (&placements, &devices), field.as_ref())?;
        let live = fresh_networks(learned.as_ref(), &shaped, &placements, &config)?;
        Ok(Self {
            config,
            model,
            placements,
            devices,
            device_folder: device_folder.to_owned(),
            field,
            streams: Vec::new(),
            imus,
            betas: Vec::new(),
            shaped,
            sensors,
            early: Vec::new(),
            state_rate_hz: 0.0,
            last: None,
            counts: Counts::default(),
            learned,
            live,
            networks_delay: 0.0,
            mapping,
            source,
        })
    }

    /// Takes up another configuration whose noise, seed, devices, networks or mapping differ, and their
    /// placements: the same with other schemes. The devices are switched on anew; other networks
    /// start the schemes over, as they need another one.
    ///
    /// # Errors
    /// Networks or a mapping that cannot be used; the node is then as it was.
    pub fn change(&mut self, config: Config, placements: &PlacementSet) -> Result<(), Refusal> {
        if config == self.config {
            return Ok(());
        }
        let other_networks = config.learned != self.config.learned;
        let mapping = if config.mapping == self.config.mapping {
            self.mapping.clone()
        } else {
            read_mapping(&config.mapping, &self.placements)?
        };
        let networks = if other_networks {
            let learned = read_networks(&config.learned)?;
            let placements = placements.placements().to_vec();
            let live = fresh_networks(learned.as_ref(), &self.shaped, &placements, &config)?;
            Some((learned, live, placements))
        } else {
            None
        };
        let devices = if config.device == self.config.device {
            self.devices.clone()
        } else {
            resolved_devices(&config, &self.placements, &self.device_folder)?
        };
        let imus = fresh_imus(
            &config,
            &mapping,
            (&self.placements, &devices),
            self.field.as_ref(),
        )?;
        (self.config, self.mapping, self.imus) = (config, mapping, imus);
        self.devices = devices;
        if let Some(networks) = networks {
            (self.learned, self.live, self.placements) = networks;
            if self.state_rate_hz > 0.0 {
                self.open_streams(self.state_rate_hz)?;
            }
        }
        Ok(())
    }

    /// The placements; their order numbers [`Step::readings`].
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// Whether `imu/NAME/mag` is there: the placement's device has a magnetometer, and the field is
    /// known.
    pub fn has_magnetometer(&self, placement: usize) -> bool {
        self.field.is_some() && self.devices[placement].magnetometer().is_some()
    }

    /// Whether `imu/NAME/temperature` is there: the placement's device warms up.
    pub fn warms_up(&self, placement: usize) -> bool {
        self.devices[placement]
            .effects()
            .contains(EffectKind::WarmUp)
    }

    /// Time between states; zero before it is known.
    pub fn state_interval(&self) -> Duration {
        Duration::try_from_secs_f64(self.state_rate_hz.recip()).unwrap_or_default()
    }

    /// Delay of each placement's scheme and networks, s; none before the rate of the states is
    /// known.
    pub fn delays_seconds(&self) -> Vec<Option<f64>> {
        let delay = |stream: &StreamingImu| stream.delay_seconds().max(self.networks_delay);
        (0..self.placements.len())
            .map(|placement| self.streams.get(placement).map(delay))
            .collect()
    }

    /// The messages that follow from one state.
    ///
    /// # Errors
    /// [`Refusal`]; the state is then left out, and the node goes on with the next.
    pub fn step(&mut self, state: &SmplState) -> Result<Step, Refusal> {
        self.step_and_tell(state, &mut |_, _| {})
    }

    /// As [`Self::step`]; each reading is told, with its placement's number, as soon as it is known,
    /// while those of the other placements are still to be computed.
    ///
    /// # Errors
    /// As [`Self::step`]. What was told before stays said.
    pub fn step_and_tell(
        &mut self,
        state: &SmplState,
        tell: &mut dyn FnMut(usize, &ImuMessages),
    ) -> Result<Step, Refusal> {
        let result = self.try_step(state, tell);
        match &result {
            Ok(step) => {
                self.counts.states += 1;
                self.counts.readings += step.readings.len() as u64;
                let without = |(_, reading): &&(usize, ImuMessages)| {
                    reading.data_raw.linear_acceleration_covariance[0] < 0.0
                };
                self.counts.without_estimate += step.readings.iter().filter(without).count() as u64;
            }
            Err(refusal) => {
                self.counts.refused += 1;
                self.counts.last_refusal = refusal.to_string();
            }
        }
        result
    }

    fn try_step(
        &mut self,
        state: &SmplState,
        tell: &mut dyn FnMut(usize, &ImuMessages),
    ) -> Result<Step, Refusal> {
        let (root_position, local_rotations) = state.root_and_rotations()?;
        let body = BodyPose {
            root_position,
            local_rotations,
        };
        let stamp = Stamp::from_nanos(state.header.stamp.nanos());
        if self.last == Some(stamp) {
            return Err(Refusal::Repeated(stamp));
        }
        self.model
            .check_named_betas(&state.shape_space, &state.gender, &state.betas)?;
        self.watch_time(stamp);
        if state.betas != self.betas {
            self.shaped = ShapedBody::new(self.model.clone(), &state.betas)?;
            self.sensors = MountedSensors::new(&self.shaped, &self.placements)?;
            self.betas.clone_from(&state.betas);
            self.live = fresh_networks(
                self.learned.as_ref(),
                &self.shaped,
                &self.placements,
                &self.config,
            )?;
        }
        let pose_std =
            PoseStd::from_confidence(state.confidence, self.config.pose_error_correlation_s);
        let mut step = self.frames_of(state, &body);
        self.last = Some(stamp);
        if !self.streams.is_empty() {
            self.push((stamp, &body, pose_std), &mut step.readings, tell)?;
            return Ok(step);
        }
        self.early.push((stamp, body, pose_std));
        if self.config.state_rate_hz > 0.0 || self.early.len() >= RATE_STATES {
            let rate_hz = if self.config.state_rate_hz > 0.0 {
                self.config.state_rate_hz
            } else {
                median_rate(&self.early)
            };
            self.open_streams(rate_hz)?;
            for (stamp, body, pose_std) in std::mem::take(&mut self.early) {
                self.push((stamp, &body, pose_std), &mut step.readings, tell)?;
            }
        }
        Ok(step)
    }

    fn open_streams(&mut self, state_rate_hz: f64) -> Result<(), ImuError> {
        self.networks_delay = if self.live.is_some() {
            LivePlacements::delay_seconds(state_rate_hz)
        } else {
            0.0
        };
        self.state_rate_hz = state_rate_hz;
        self.streams.clear();
        for placement in &self.placements {
            let options = StreamOptions {
                longest_gap: self.config.gap_seconds,
                source: self.source,
                ..StreamOptions::resampled(state_rate_hz, placement.rate_hz())
            };
            let stream = StreamingImu::new(placement.scheme(), options)?;
            let delay = stream.delay_seconds().max(self.networks_delay);
            log::info!(
                "{}: {} of {} poses at {} Hz, delay {delay:.4} s",
                placement.name(),
                placement.scheme(),
                self.source.name(),
                placement.rate_hz()
            );
            self.streams.push(stream);
        }
        Ok(())
    }

    fn push(
        &mut self,
        (stamp, body, pose_std): (Stamp, &BodyPose, PoseStd),
        readings: &mut Vec<(usize, ImuMessages)>,
        tell: &mut dyn FnMut(usize, &ImuMessages),
    ) -> Result<(), Refusal> {
        let poses = self.sensors.poses(body);
        let poses_of = poses
            .iter()
            .map(|pose| pose.at(stamp).with_pose_std(pose_std));
        let streams = self.streams.iter_mut().zip(poses_of);
        if let Some(live) = &mut self.live {
            // The networks see all placements at once.
            let motions = streams
                .map(|(stream, pose)| stream.push_kinematics(pose))
                .collect::<Result<Vec<_>, _>>()?;
            live.push(stamp, body, &poses);
            let measured = measure_all(&mut self.imus, motions, Some(live))?;
            measured.iter().for_each(|(it, reading)| tell(*it, reading));
            readings.extend(measured);
            return Ok(());
        }
        for (placement, ((stream, pose), imu)) in streams.zip(&mut self.imus).enumerate() {
            for motion in stream.push_kinematics(pose)? {
                if let Some(reading) = imu.measure(&motion) {
                    tell(placement, &reading);
                    readings.push((placement, reading));
                }
            }
        }
        Ok(())
    }

    /// A source that starts over (a loop, a seek) starts the schemes over too.
    fn watch_time(&mut self, stamp: Stamp) {
        if self.last.is_some_and(|last| stamp < last) {
            self.counts.restarts += 1;
            self.early.clear();
            self.streams.iter_mut().for_each(StreamingImu::reset);
            self.imus.iter_mut().for_each(VirtualImu::reset);
            self.live.iter_mut().for_each(LivePlacements::reset);
        }
    }

    fn frames_of(&self, state: &SmplState, body: &BodyPose) -> Step {
        let mut step = Step::default();
        let follows_skin = |placement: &Placement| placement.follow() == Follow::Skin;
        if !self.config.publish_reference && !self.placements.iter().any(follows_skin) {
            return step;
        }
        let segments = self.shaped.world_from_segments(body);
        for ((placement, site), frame) in self
            .placements
            .iter()
            .zip(self.sensors.sensors())
            .zip(self.sensors.poses(body))
        {
            if follows_skin(placement) {
                let segment_from_sensor =
                    segments[site.joint().index()].inverse() * frame.world_from_sensor;
                step.frames.transforms.push(self.edge(
                    state.header.stamp,
                    site.joint(),
                    placement,
                    segment_from_sensor,
                ));
            }
            if self.config.publish_reference {
                step.references.push(PoseStamped {
                    header: state.header.clone(),
                    pose: frame.world_from_sensor.into(),
                });
            }
        }
        step
    }

    /// For `/tf_static`: the frames of sensors that follow their segment.
    pub fn static_frames(&self, stamp: Time) -> TFMessage {
        let rigid = self
            .placements
            .iter()
            .zip(self.sensors.sensors())
            .filter(|(placement, _)| placement.follow() == Follow::Segment);
        TFMessage {
            transforms: rigid
                .map(|(placement, site)| {
                    self.edge(stamp, site.joint(), placement, site.segment_from_sensor())
                })
                .collect(),
        }
    }

    fn edge(
        &self,
        stamp: Time,
        joint: Joint,
        placement: &Placement,
        segment_from_sensor: Isometry3<f64>,
    ) -> TransformStamped {
        TransformStamped {
            header: Header {
                stamp,
                frame_id: self.config.frame(joint.name()),
            },
            child_frame_id: self.config.frame(&format!("{}_imu", placement.name())),
            transform: segment_from_sensor.into(),
        }
    }

    /// For `/diagnostics`.
    pub fn diagnostics(&self, stamp: Time, node_name: &str) -> DiagnosticArray {
        let counts = &self.counts;
        let (level, message) = match (counts.states, counts.refused) {
            (0, 0) => (DiagnosticStatus::WARN, "no state has come yet".to_owned()),
            (_, 0) => (DiagnosticStatus::OK, "states arrive".to_owned()),
            _ => (
                DiagnosticStatus::WARN,
                format!(
                    "states were left out; the last one: {}",
                    counts.last_refusal
                ),
            ),
        };
        let value = |key: String, value: String| KeyValue { key, value };
        let mut values = vec![
            value("states".to_owned(), counts.states.to_string()),
            value("states left out".to_owned(), counts.refused.to_string()),
            value("readings".to_owned(), counts.readings.to_string()),
            value(
                "readings without an estimate (confidence 0)".to_owned(),
                counts.without_estimate.to_string(),
            ),
            value(
                "restarts of the source's time".to_owned(),
                counts.restarts.to_string(),
            ),
        ];
        for (placement, delay) in self.placements.iter().zip(self.delays_seconds()) {
            let delay = delay.map_or_else(
                || "not yet known".to_owned(),
                |seconds| format!("{seconds:.4}"),
            );
            values.push(value(
                format!("{}: delay of {}, s", placement.name(), placement.scheme()),
                delay,
            ));
        }
        let status = DiagnosticStatus {
            level,
            name: format!("{node_name}: virtual IMUs"),
            message,
            hardware_id: self.model.id().to_owned(),
            values,
        };
        DiagnosticArray {
            header: Header {
                stamp,
                frame_id: String::new(),
            },
            status: vec![status],
        }
    }
}

/// Rate of states by the median of their intervals, Hz.
fn median_rate(states: &[(Stamp, BodyPose, PoseStd)]) -> f64 {
    let mut intervals: Vec<f64> = states
        .windows(2)
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals
        .get(intervals.len() / 2)
        .map_or(f64::NAN, |interval| interval.recip())
}
