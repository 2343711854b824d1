//! From messages to what Rerun shows.

use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_body::{BodyError, BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_msgs::NotABody;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;
use cromosim_view::{Recording, Summary, ViewError};
use nalgebra::Isometry3;

use crate::config::Config;

/// Why something is not shown.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The state is no body.
    #[error(transparent)]
    State(#[from] NotABody),
    /// The shape does not suit the body.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// Rerun cannot take it.
    #[error(transparent)]
    View(#[from] ViewError),
}

/// The node: a function of the messages so far, into a recording.
pub struct ViewerNode {
    config: Config,
    model: Arc<BodyModel>,
    shaped: ShapedBody,
    betas: Vec<f64>,
    recording: Recording,
    vertices: Vec<[f32; 3]>,
    /// Sensor by its frame's name: the segment that carries it, and segment_from_sensor.
    mounted: BTreeMap<String, (Joint, Isometry3<f64>)>,
}

impl ViewerNode {
    /// A node that draws into `recording`.
    ///
    /// # Errors
    /// Where the body's mesh cannot be shown.
    pub fn new(
        config: Config,
        model: Arc<BodyModel>,
        mut recording: Recording,
    ) -> Result<Self, Refusal> {
        let shaped = ShapedBody::new(model.clone(), &[])?;
        let rest: Vec<[f32; 3]> = shaped
            .rest_vertices()
            .iter()
            .map(|vertex| vertex.map(|x| x as f32).into())
            .collect();
        recording.set_body(&rest, model.faces())?;
        Ok(Self {
            config,
            model,
            shaped,
            betas: Vec::new(),
            recording,
            vertices: Vec::new(),
            mounted: BTreeMap::new(),
        })
    }

    /// Draws the body and the sensors on it.
    ///
    /// # Errors
    /// [`Refusal`]; the state is then not shown.
    pub fn show_state(&mut self, state: &SmplState) -> Result<(), Refusal> {
        let stamp = Stamp::from_nanos(state.header.stamp.nanos());
        if !self.recording.wants_body(stamp) {
            return Ok(());
        }
        let (root_position, local_rotations) = state.root_and_rotations()?;
        let body = BodyPose {
            root_position,
            local_rotations,
        };
        if state.betas != self.betas {
            self.model
                .check_named_betas(&state.shape_space, &state.gender, &state.betas)?;
            self.shaped = ShapedBody::new(self.model.clone(), &state.betas)?;
            self.betas.clone_from(&state.betas);
        }
        self.shaped.skin(&body, &mut self.vertices);
        self.recording.log_body(stamp, &self.vertices)?;
        let segments = self.shaped.world_from_segments(&body);
        if self.config.skeleton {
            let joints =
                segments.map(|segment| segment.translation.vector.map(|x| x as f32).into());
            let parents = Joint::ALL.map(|joint| joint.parent().map(Joint::index));
            self.recording.log_skeleton(stamp, &joints, &parents)?;
        }
        for (name, (joint, segment_from_sensor)) in &self.mounted {
            self.recording.log_sensor(
                stamp,
                name,
                &(segments[joint.index()] * segment_from_sensor),
            )?;
        }
        Ok(())
    }

    /// Learns where sensors sit: frames `NAME_imu` below a segment.
    pub fn learn_frames(&mut self, frames: &TFMessage) {
        for edge in &frames.transforms {
            let (Some(child), Some(parent)) = (
                self.own(&edge.child_frame_id),
                self.own(&edge.header.frame_id),
            ) else {
                continue;
            };
            let (Some(name), Some(joint)) = (child.strip_suffix("_imu"), Joint::from_name(parent))
            else {
                continue;
            };
            let Ok(segment_from_sensor) = edge.transform.try_into() else {
                continue;
            };
            self.mounted
                .insert(name.to_owned(), (joint, segment_from_sensor));
        }
    }

    /// The frame's name without this body's prefix.
    fn own<'a>(&self, frame: &'a str) -> Option<&'a str> {
        if self.config.prefix.is_empty() {
            Some(frame)
        } else {
            frame.strip_prefix(&self.config.prefix)?.strip_prefix('/')
        }
    }

    /// Adds a sample to the curves of a placement.
    ///
    /// # Errors
    /// [`Refusal::View`].
    pub fn show_imu(&mut self, placement: &str, imu: &Imu) -> Result<(), Refusal> {
        let stamp = Stamp::from_nanos(imu.header.stamp.nanos());
        self.recording.log_imu(
            stamp,
            placement,
            &imu.linear_acceleration.into(),
            &imu.angular_velocity.into(),
        )?;
        Ok(())
    }

    /// Hands over what is on its way.
    ///
    /// # Errors
    /// [`Refusal::View`] where a disk is full or a viewer went away.
    pub fn flush(&self) -> Result<(), Refusal> {
        Ok(self.recording.flush()?)
    }

    /// Closes the recording.
    ///
    /// # Errors
    /// [`Refusal::View`], as for `flush`.
    pub fn finish(self) -> Result<Summary, Refusal> {
        Ok(self.recording.finish()?)
    }
}
