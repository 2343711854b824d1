//! From a source's poses to the state of one body in the world, and its frames.

use std::sync::Arc;

use cromosim_body::{BodyError, BodyModel, BodyPose, Joint};
use cromosim_msgs::NotABody;
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use cromosim_msgs::geometry_msgs::TransformStamped;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::config::Config;
use crate::shape::PersonShape;
use crate::smooth::Smoother;

/// The messages that follow from one pose.
pub struct Step {
    /// For `smpl/state`.
    pub state: SmplState,
    /// For `/tf`: world -> pelvis -> segments.
    pub frames: TFMessage,
}

/// Why a pose was left out.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The message holds no valid body: wrong lengths, or numbers that are not finite.
    #[error(transparent)]
    Pose(#[from] NotABody),
    /// The betas do not fit the node's body.
    #[error(transparent)]
    Shape(#[from] BodyError),
    /// The confidence is outside 0 to 1.
    #[error("confidence is {0}; expected 0 to 1, or NaN where the source cannot say")]
    Confidence(f64),
}

/// The node: a function of the poses so far.
pub struct SmplStateNode {
    config: Config,
    model: Arc<BodyModel>,
    world_from_source: Isometry3<f64>,
    shape: PersonShape,
    smoother: Smoother,
    counts: Counts,
}

#[derive(Default)]
struct Counts {
    poses: u64,
    refused: u64,
    restarts: u64,
    last_nanos: Option<i64>,
    longest_gap: f64,
    last_refusal: String,
}

/// base_link (x forward, y left, z up, REP-103) in the axes of the pelvis (x left, y up, z
/// forward).
pub fn pelvis_from_base_link() -> UnitQuaternion<f64> {
    let columns = [Vector3::z(), Vector3::x(), Vector3::y()];
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
        nalgebra::Matrix3::from_columns(&columns),
    ))
}

impl SmplStateNode {
    /// A node for bodies of this model; `source_body` is the one that betas of another shape space
    /// are for.
    ///
    /// # Errors
    /// [`BodyError`] for a damaged model only.
    pub fn new(
        config: Config,
        model: Arc<BodyModel>,
        source_body: Option<Arc<BodyModel>>,
    ) -> Result<Self, BodyError> {
        let world_from_source = Isometry3::from_parts(
            Translation3::from(Vector3::from(config.source_position)),
            UnitQuaternion::from_scaled_axis(Vector3::from(config.source_rotvec)),
        );
        let shape = PersonShape::new(model.clone(), source_body)?;
        let smoother = Smoother::new(config.smoothing_cutoff_hz);
        Ok(Self {
            config,
            model,
            world_from_source,
            shape,
            smoother,
            counts: Counts::default(),
        })
    }

    /// The state and the frames that follow from one pose.
    pub fn step(&mut self, source: &SmplPose) -> Result<Step, Refusal> {
        let result = self.state_after(source);
        match &result {
            Ok(_) => self.counts.poses += 1,
            Err(refusal) => {
                self.counts.refused += 1;
                self.counts.last_refusal = refusal.to_string();
            }
        }
        result
    }

    fn state_after(&mut self, source: &SmplPose) -> Result<Step, Refusal> {
        let nanos = source.header.stamp.nanos();
        self.watch_time(nanos);
        let (root_position, local_rotations) = source.root_and_rotations()?;
        if !(source.confidence.is_nan() || (0.0..=1.0).contains(&source.confidence)) {
            return Err(Refusal::Confidence(source.confidence));
        }
        self.shape.take(source)?;
        let root_position = (self.world_from_source
            * nalgebra::Point3::from(root_position * self.shape.leg_ratio()))
        .coords;
        let mut body = BodyPose {
            root_position,
            local_rotations,
        };
        body.local_rotations[0] = self.world_from_source.rotation * body.local_rotations[0];
        let body = self.smoother.smooth(nanos, body);
        let header = Header {
            stamp: source.header.stamp,
            frame_id: self.config.world_frame.clone(),
        };
        let frames = self.frames(&header, &body);
        let mut state = SmplState {
            header,
            body_id: source.body_id.clone(),
            gender: source.gender.clone(),
            betas: self.shape.betas().to_vec(),
            shape_space: self.model.shape_space().name().to_owned(),
            confidence: source.confidence,
            ..SmplState::default()
        };
        state.set_root_and_rotations(body.root_position, &body.local_rotations);
        Ok(Step { state, frames })
    }

    /// A source that starts over (a loop, a seek) starts the smoothing over too.
    fn watch_time(&mut self, nanos: i64) {
        if let Some(last) = self.counts.last_nanos {
            let gap = (nanos - last) as f64 * 1e-9;
            if gap < 0.0 {
                self.counts.restarts += 1;
                self.smoother.restart();
            } else {
                self.counts.longest_gap = self.counts.longest_gap.max(gap);
            }
        }
        self.counts.last_nanos = Some(nanos);
    }

    fn frames(&self, header: &Header, body: &BodyPose) -> TFMessage {
        let joints = self.shape.shaped().joints_in_model();
        let transforms = Joint::ALL.into_iter().map(|joint| {
            let (parent, translation) = match joint.parent() {
                None => (self.config.world_frame.clone(), body.root_position),
                Some(parent) => (
                    self.config.frame(parent.name()),
                    joints[joint.index()] - joints[parent.index()],
                ),
            };
            let parent_from_joint = Isometry3::from_parts(
                Translation3::from(translation),
                body.local_rotations[joint.index()],
            );
            TransformStamped {
                header: Header {
                    stamp: header.stamp,
                    frame_id: parent,
                },
                child_frame_id: self.config.frame(joint.name()),
                transform: parent_from_joint.into(),
            }
        });
        TFMessage {
            transforms: transforms.collect(),
        }
    }

    /// For `/tf_static`: base_link at the pelvis with the axes of REP-103.
    pub fn static_frames(&self, stamp: Time) -> TFMessage {
        let beside = Isometry3::from_parts(Translation3::identity(), pelvis_from_base_link());
        let edge = TransformStamped {
            header: Header {
                stamp,
                frame_id: self.config.frame(Joint::Pelvis.name()),
            },
            child_frame_id: self.config.frame("base_link"),
            transform: beside.into(),
        };
        TFMessage {
            transforms: vec![edge],
        }
    }

    /// For `/diagnostics`.
    pub fn diagnostics(&self, stamp: Time, node_name: &str) -> DiagnosticArray {
        let counts = &self.counts;
        let (level, message) = match (counts.poses, counts.refused) {
            (0, 0) => (DiagnosticStatus::WARN, "no pose has come yet".to_owned()),
            (_, 0) => (DiagnosticStatus::OK, "poses arrive".to_owned()),
            _ => (
                DiagnosticStatus::WARN,
                format!("poses were left out; the last one: {}", counts.last_refusal),
            ),
        };
        let value = |key: &str, value: String| KeyValue {
            key: key.to_owned(),
            value,
        };
        let status = DiagnosticStatus {
            level,
            name: format!("{node_name}: body"),
            message,
            hardware_id: self.model.id().to_owned(),
            values: vec![
                value("poses", counts.poses.to_string()),
                value("poses left out", counts.refused.to_string()),
                value("restarts of the source's time", counts.restarts.to_string()),
                value("longest gap, s", format!("{:.4}", counts.longest_gap)),
                value("betas", format!("{:.3?}", self.shape.betas())),
            ],
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
