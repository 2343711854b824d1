//! A recording being written.

use std::collections::HashMap;
use std::time::Duration;

use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Vector3};
use re_sdk::time::TimeCell;
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::archetypes::{
    LineStrips3D, Mesh3D, Points3D, Scalars, Transform3D, ViewCoordinates,
};
use re_sdk_types::components::RotationQuat;
use re_sdk_types::datatypes::Quaternion;

use crate::layout::{
    ANCHOR, ANCHOR_POINTS, Layout, QUANTITIES, TIMELINE, WORLD, imu_path, sensor_path,
};
use crate::placement_look::log_placement_look;
use crate::{Destination, DisplayMesh, RecordingOptions, TimeAxis, ViewError, sinks, style};

const BODY: &str = "/world/body";
const SKELETON: &str = "/world/skeleton";
/// How long a flush may take before it counts as lost.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(20);
/// Placements that are first seen while logging get their curves together, this long after the last
/// of them, s.
const LAYOUT_DELAY_S: f64 = 0.5;

/// What went into a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Frames of the body.
    pub body_frames: u64,
    /// Poses of sensors, all placements together.
    pub sensor_frames: u64,
    /// IMU samples, all placements together.
    pub imu_samples: u64,
}

/// A recording being written: see the [crate's page](crate) for its entities.
///
/// Stamps may come in any order, and may jump back when a replay loops. Dropping a recording
/// finishes it too, but only [`Recording::finish`] says whether all went well.
pub struct Recording {
    stream: RecordingStream,
    destinations: Vec<Destination>,
    options: RecordingOptions,
    start: Option<Stamp>,
    body: Option<DisplayMesh>,
    placements: Vec<String>,
    /// Each entity's last frame at the frame rate.
    last_frame: HashMap<EntityPath, i64>,
    /// When the last placement was added since the layout was sent.
    layout_outdated_since: Option<Stamp>,
    summary: Summary,
}

impl Recording {
    /// Opens the destinations, writes what does not change and the layout.
    ///
    /// # Errors
    /// Where a file cannot be created, no viewer answers, or an option is out of range.
    pub fn open(
        destinations: &[Destination],
        options: RecordingOptions,
    ) -> Result<Self, ViewError> {
        options.check()?;
        let stream = sinks::open(destinations, &options.name)?;
        stream.log_static(WORLD, &ViewCoordinates::FLU())?;
        // A viewer follows what it can see; these points are too small and too dark for that.
        let points = Points3D::new(ANCHOR_POINTS)
            .with_radii([0.001])
            .with_colors([style::color(style::BACKGROUND)]);
        stream.log_static(ANCHOR, &points)?;
        let mut recording = Self {
            stream,
            destinations: destinations.to_vec(),
            start: options.start,
            body: None,
            placements: Vec::new(),
            last_frame: HashMap::new(),
            layout_outdated_since: None,
            summary: Summary::default(),
            options,
        };
        for name in recording.options.placements.clone() {
            recording.add_placement(&name)?;
        }
        recording.send_layout()?;
        Ok(recording)
    }

    /// States the body's mesh, and reduces it for display. Needed before [`Self::log_body`]; may be
    /// called again for another body.
    ///
    /// `rest_vertices`: (V, 3), m, any frame; `faces`: (F, 3), outward.
    ///
    /// # Errors
    /// [`ViewError::Face`] where a face names a vertex that is not there.
    pub fn set_body(
        &mut self,
        rest_vertices: &[[f32; 3]],
        faces: &[[u32; 3]],
    ) -> Result<(), ViewError> {
        let mesh = DisplayMesh::new(rest_vertices, faces, self.options.display_vertices)?;
        let shape = Mesh3D::update_fields()
            .with_triangle_indices(mesh.faces().iter().copied())
            .with_albedo_factor(style::BODY);
        self.stream.log_static(BODY, &shape)?;
        self.body = Some(mesh);
        Ok(())
    }

    /// Whether [`Self::log_body`] would show a body of this stamp, so that others need not be
    /// skinned.
    pub fn wants_body(&mut self, stamp: Stamp) -> bool {
        let frame = self.frame(stamp);
        self.body.is_some() && self.last_frame.get(&EntityPath::from(BODY)) != Some(&frame)
    }

    /// Shows the body; says whether, which is not where the frame rate leaves this stamp out.
    ///
    /// `vertices_in_world`: (V, 3), m, all the body's vertices.
    ///
    /// # Errors
    /// [`ViewError::Count`] where no body was set or the number of vertices is another one.
    pub fn log_body(
        &mut self,
        stamp: Stamp,
        vertices_in_world: &[[f32; 3]],
    ) -> Result<bool, ViewError> {
        let path = EntityPath::from(BODY);
        let Some(mesh) = &self.body else {
            return Err(ViewError::Count {
                what: "body vertices (no body is set)",
                expected: 0,
                found: vertices_in_world.len(),
            });
        };
        let shown = mesh.pick(vertices_in_world)?;
        if !self.next_frame(&path, stamp)? {
            return Ok(false);
        }
        self.log_anchor(&shown)?;
        let normals = self
            .body
            .as_ref()
            .map(|mesh| mesh.normals(&shown))
            .unwrap_or_default();
        self.stream.log(
            path,
            &Mesh3D::update_fields()
                .with_vertex_positions(shown)
                .with_vertex_normals(normals),
        )?;
        self.summary.body_frames += 1;
        Ok(true)
    }

    /// Shows the skeleton as lines from each joint to its parent; says whether, as
    /// [`Self::log_body`] does. A body hides most of it: meant for recordings without one.
    ///
    /// `joints_in_world`: m; `parents`: the index of each joint's parent, none for a root.
    ///
    /// # Errors
    /// [`ViewError::Count`] where the lists differ in length or a parent is not one of the joints.
    pub fn log_skeleton(
        &mut self,
        stamp: Stamp,
        joints_in_world: &[[f32; 3]],
        parents: &[Option<usize>],
    ) -> Result<bool, ViewError> {
        if parents.len() != joints_in_world.len() {
            return Err(ViewError::Count {
                what: "parents of joints",
                expected: joints_in_world.len(),
                found: parents.len(),
            });
        }
        let mut bones = Vec::with_capacity(parents.len());
        for (joint, parent) in joints_in_world.iter().zip(parents) {
            let Some(parent) = *parent else { continue };
            let end = joints_in_world.get(parent);
            let end = end.ok_or(ViewError::Count {
                what: "joints up to a parent",
                expected: parent + 1,
                found: joints_in_world.len(),
            })?;
            bones.push([*joint, *end]);
        }
        if !self.next_frame(&EntityPath::from(SKELETON), stamp)? {
            return Ok(false);
        }
        if self.body.is_none() {
            self.log_anchor(joints_in_world)?;
        }
        self.stream.log(
            SKELETON,
            &LineStrips3D::new(bones)
                .with_colors([style::color(style::SKELETON)])
                .with_radii([0.012]),
        )?;
        Ok(true)
    }

    /// Shows a sensor's frame; says whether, as [`Self::log_body`] does.
    ///
    /// # Errors
    /// [`ViewError::Sdk`] alone.
    pub fn log_sensor(
        &mut self,
        stamp: Stamp,
        placement: &str,
        world_from_sensor: &Isometry3<f64>,
    ) -> Result<bool, ViewError> {
        self.see_placement(stamp, placement)?;
        let path = sensor_path(placement);
        if !self.next_frame(&path, stamp)? {
            return Ok(false);
        }
        let translation = world_from_sensor.translation.vector.cast::<f32>();
        let [x, y, z, w] = world_from_sensor.rotation.coords.cast::<f32>().into();
        let rotation = RotationQuat(Quaternion::from_xyzw([x, y, z, w]));
        let pose = Transform3D::new()
            .with_translation(<[f32; 3]>::from(translation))
            .with_quaternion(rotation);
        self.stream.log(path, &pose)?;
        self.summary.sensor_frames += 1;
        Ok(true)
    }

    /// Adds one IMU sample to its curves: specific force, m/s², and angular velocity, rad/s, both
    /// on the sensor's axes.
    ///
    /// # Errors
    /// [`ViewError::Sdk`] alone.
    pub fn log_imu(
        &mut self,
        stamp: Stamp,
        placement: &str,
        specific_force: &Vector3<f64>,
        angular_velocity: &Vector3<f64>,
    ) -> Result<(), ViewError> {
        self.see_placement(stamp, placement)?;
        self.set_time(stamp);
        for ((quantity, _), value) in QUANTITIES
            .into_iter()
            .zip([specific_force, angular_velocity])
        {
            self.stream.log(
                imu_path(placement, quantity),
                &Scalars::new(value.iter().copied()),
            )?;
        }
        self.summary.imu_samples += 1;
        Ok(())
    }

    /// Hands everything logged so far to the destinations. Worth calling now and then in a long
    /// run: only here, and at the end, does a full disk or a viewer that went away become known.
    ///
    /// # Errors
    /// [`ViewError::Lost`].
    pub fn flush(&self) -> Result<(), ViewError> {
        self.stream
            .flush_with_timeout(FLUSH_TIMEOUT)
            .map_err(|error| {
                let destination = self
                    .destinations
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(", ");
                ViewError::Lost {
                    destination,
                    reason: error.to_string(),
                }
            })
    }

    /// What went in so far.
    pub fn summary(&self) -> Summary {
        self.summary
    }

    /// Writes what is left, closes files with their index, and says what went in.
    ///
    /// # Errors
    /// [`ViewError::Lost`].
    pub fn finish(mut self) -> Result<Summary, ViewError> {
        if self.layout_outdated_since.is_some() {
            self.send_layout()?;
        }
        self.flush()?;
        self.stream.finalize_deferred_sinks();
        Ok(self.summary)
    }

    /// The stamp in nanoseconds on the timeline. The first one ever asked for is the start, where
    /// none was given.
    fn nanos_on_timeline(&mut self, stamp: Stamp) -> i64 {
        let start = *self.start.get_or_insert(stamp);
        match self.options.time_axis {
            TimeAxis::SinceStart => stamp.nanos.saturating_sub(start.nanos),
            TimeAxis::Date => stamp.nanos,
        }
    }

    /// The number of the frame that a stamp falls into. All entities share it, so that body and
    /// sensors are shown at the same stamps.
    fn frame(&mut self, stamp: Stamp) -> i64 {
        let start = *self.start.get_or_insert(stamp);
        // A hundredth of a frame of tolerance, for stamps that were rounded to nanoseconds.
        ((stamp - start) * self.options.frame_rate_hz + 0.01).floor() as i64
    }

    /// Whether the entity has a new frame at this stamp; then the time is set.
    fn next_frame(&mut self, path: &EntityPath, stamp: Stamp) -> Result<bool, ViewError> {
        let frame = self.frame(stamp);
        if self.last_frame.insert(path.clone(), frame) == Some(frame) {
            return Ok(false);
        }
        if self
            .layout_outdated_since
            .is_some_and(|since| (stamp - since).abs() > LAYOUT_DELAY_S)
        {
            self.send_layout()?;
        }
        self.set_time(stamp);
        Ok(true)
    }

    fn set_time(&mut self, stamp: Stamp) {
        let nanos = self.nanos_on_timeline(stamp);
        let cell = match self.options.time_axis {
            TimeAxis::SinceStart => TimeCell::from_duration_nanos(nanos),
            TimeAxis::Date => TimeCell::from_timestamp_nanos_since_epoch(nanos),
        };
        self.stream.set_time(TIMELINE, cell);
    }

    /// Puts the camera's target on the ground under the mean of the points, at the stamp set last.
    fn log_anchor(&mut self, points: &[[f32; 3]]) -> Result<(), ViewError> {
        let sum = points.iter().fold([0.0_f64; 2], |sum, point| {
            [sum[0] + f64::from(point[0]), sum[1] + f64::from(point[1])]
        });
        let [x, y] = sum.map(|value| (value / points.len() as f64) as f32);
        if x.is_finite() && y.is_finite() {
            self.stream
                .log(ANCHOR, &Transform3D::from_translation([x, y, 0.0]))?;
        }
        Ok(())
    }

    fn see_placement(&mut self, stamp: Stamp, name: &str) -> Result<(), ViewError> {
        if !self.placements.iter().any(|known| known == name) {
            self.add_placement(name)?;
            self.layout_outdated_since = Some(stamp);
        }
        Ok(())
    }

    fn add_placement(&mut self, name: &str) -> Result<(), ViewError> {
        log_placement_look(&self.stream, name, self.placements.len())?;
        self.placements.push(name.to_owned());
        Ok(())
    }

    fn send_layout(&mut self) -> Result<(), ViewError> {
        self.layout_outdated_since = None;
        let layout = Layout {
            placements: &self.placements,
            live: self.destinations.iter().any(Destination::is_live),
            curve_window_s: self.options.curve_window_s,
        };
        layout.send(&self.stream)
    }
}
