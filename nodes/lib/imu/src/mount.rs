//! Sensors on a body of one shape.

use cromosim_body::lanes::{
    IsometryLanes, VectorLanes, isometry_of, isometry_product, product, rotated, scaled, splat,
    splat_isometry, splat_rotation, sum, vector_of,
};
use cromosim_body::{
    BodyModel, BodyPose, Joint, PosesInLanes, ShapedBody, Site, VertexSubset, VisitPoses,
};
use cromosim_spatial::Stamp;
use cromosim_spatial::plausible::{Oddity, POINT_FROM_SKIN};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use pulp::Simd;

use crate::rest_triangle::{RestTriangle, point_of, points_of};
use crate::{Follow, ImuError, Placement, PoseStd, SensorFrame, SensorTrajectory, SiteChoice};

/// Where a sensor is for one pose of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorPose {
    /// The sensor's frame, m.
    pub world_from_sensor: Isometry3<f64>,
    /// Outward unit normal of what the sensor follows: of the triangle, or of the rest triangle
    /// carried along by the segment.
    pub normal_in_world: Vector3<f64>,
    /// Corners of the site's triangle, m.
    pub triangle_in_world: [Vector3<f64>; 3],
}

impl SensorPose {
    /// The sensor's frame with its time.
    pub fn at(&self, stamp: Stamp) -> SensorFrame {
        SensorFrame {
            stamp,
            world_from_sensor: self.world_from_sensor,
            normal_in_world: self.normal_in_world,
            pose_std: PoseStd::NONE,
        }
    }
}

/// A placement on a body of one shape.
///
/// The site's frame at rest: z along the outward normal of the triangle, x along the bone towards
/// its far end (the next joint; of the last segments the direction in which the limb arrives) as
/// far as it is tangential, y = z cross x. Where bone and normal are parallel, x is forward
/// instead. The sensor's frame is the site's turned by the placement's mount, moved outward by its
/// distance from the skin.
#[derive(Clone, Debug)]
pub struct MountedSensor {
    name: String,
    site: Site,
    follow: Follow,
    skin_distance: f64,
    triangle: RestTriangle,
    /// triangle_from_sensor, rotation.
    triangle_from_sensor: UnitQuaternion<f64>,
    segment_from_sensor: Isometry3<f64>,
    /// The rest triangle's outward normal.
    normal_in_segment: Vector3<f64>,
    subset: VertexSubset,
}

impl MountedSensor {
    /// Mounts a placement.
    ///
    /// # Errors
    /// [`ImuError::Site`] for a site that this body does not have, [`ImuError::FlatTriangle`],
    /// [`ImuError::Impossible`] for a point far off the skin.
    pub fn new(body: &ShapedBody, placement: &Placement) -> Result<Self, ImuError> {
        let refuse = |source| ImuError::Site {
            placement: placement.name().to_owned(),
            source: Box::new(source),
        };
        let model = body.model();
        let site = match placement.site() {
            SiteChoice::Named(name) => model.site(name),
            SiteChoice::Triangle {
                triangle,
                barycentrics,
            } => model.site_at(*triangle, *barycentrics),
            SiteChoice::NearestTo(point) => model.nearest_site(*point),
        }
        .map_err(refuse)?;
        if let Some(oddity) = point_oddity(model, placement)?.filter(Oddity::is_impossible) {
            return Err(ImuError::Impossible {
                placement: placement.name().to_owned(),
                field: "point",
                oddity: Box::new(oddity),
            });
        }
        let vertices = model.triangle(&site).map_err(refuse)?;
        let subset = body.subset(&vertices).map_err(refuse)?;
        let subset = subset.with_segments_of([site.joint]);
        let corners = vertices.map(|vertex| body.rest_vertices()[vertex as usize]);
        let flat = || ImuError::FlatTriangle {
            placement: placement.name().to_owned(),
            triangle: site.triangle,
        };
        let (triangle, model_from_triangle) = RestTriangle::new(&corners).ok_or_else(flat)?;
        let normal = model_from_triangle * Vector3::z();
        let model_from_sensor =
            site_axes(&normal, &bone_direction(body, site.joint)) * placement.mount();
        let position = point_of(&corners, &site.barycentrics) + normal * placement.skin_distance();
        let sensor_in_segment = position - body.joints_in_model()[site.joint.index()];
        Ok(Self {
            name: placement.name().to_owned(),
            follow: placement.follow(),
            skin_distance: placement.skin_distance(),
            triangle,
            triangle_from_sensor: model_from_triangle.inverse() * model_from_sensor,
            // A segment's frame is parallel to the model's at rest.
            segment_from_sensor: Isometry3::from_parts(sensor_in_segment.into(), model_from_sensor),
            normal_in_segment: normal,
            subset,
            site,
        })
    }

    /// The placement's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The site on this body.
    pub fn site(&self) -> &Site {
        &self.site
    }

    /// The joint whose segment carries the sensor.
    pub fn joint(&self) -> Joint {
        self.site.joint
    }

    /// The mount: maps points (m) in the sensor's frame to the segment's, whose origin is its joint; in
    /// the rest pose, and all the time where the sensor follows the segment.
    pub fn segment_from_sensor(&self) -> Isometry3<f64> {
        self.segment_from_sensor
    }

    /// Where the sensor is for one pose of the body.
    pub fn pose(&self, body: &BodyPose) -> SensorPose {
        let mut positions = Vec::with_capacity(3);
        let segments = self
            .subset
            .positions_and_segments_into(body, &mut positions);
        self.pose_from(
            &segments[self.site.joint.index()],
            [positions[0], positions[1], positions[2]],
        )
    }

    /// Its trajectory over a whole motion.
    ///
    /// # Errors
    /// As [`SensorTrajectory::new`]; stamps beyond the poses, or poses beyond the stamps, are left
    /// out.
    pub fn trajectory(
        &self,
        stamps: &[Stamp],
        poses: &[BodyPose],
    ) -> Result<SensorTrajectory, ImuError> {
        SensorTrajectory::new(
            stamps
                .iter()
                .zip(poses)
                .map(|(stamp, pose)| self.pose(pose).at(*stamp))
                .collect(),
        )
    }

    fn pose_from(
        &self,
        world_from_segment: &Isometry3<f64>,
        corners: [Vector3<f64>; 3],
    ) -> SensorPose {
        let (world_from_sensor, normal_in_world) = match self.follow {
            Follow::Segment => (
                world_from_segment * self.segment_from_sensor,
                world_from_segment.rotation * self.normal_in_segment,
            ),
            Follow::Skin => {
                let world_from_triangle = self
                    .triangle
                    .frame(&corners)
                    .unwrap_or(world_from_segment.rotation);
                let normal = world_from_triangle * Vector3::z();
                let position =
                    point_of(&corners, &self.site.barycentrics) + normal * self.skin_distance;
                (
                    Isometry3::from_parts(
                        position.into(),
                        world_from_triangle * self.triangle_from_sensor,
                    ),
                    normal,
                )
            }
        };
        SensorPose {
            world_from_sensor,
            normal_in_world,
            triangle_in_world: corners,
        }
    }

    /// [`Self::pose_from`] of each lane, operation by operation: world_from_sensor, and the normal.
    #[inline(always)]
    fn poses_from<S: Simd>(
        &self,
        s: S,
        world_from_segment: &IsometryLanes<S>,
        corners: &[VectorLanes<S>; 3],
    ) -> (IsometryLanes<S>, VectorLanes<S>) {
        match self.follow {
            Follow::Segment => (
                isometry_product(
                    s,
                    world_from_segment,
                    &splat_isometry(s, &self.segment_from_sensor),
                ),
                rotated(s, &world_from_segment.0, &splat(s, &self.normal_in_segment)),
            ),
            Follow::Skin => {
                let world_from_triangle = self.triangle.frames(s, corners, &world_from_segment.0);
                let normal = rotated(s, &world_from_triangle, &splat(s, &Vector3::z()));
                let off_skin = scaled(s, &normal, s.splat_f64s(self.skin_distance));
                let point = points_of(s, corners, &self.site.barycentrics);
                let triangle_from_sensor = splat_rotation(s, &self.triangle_from_sensor);
                (
                    (
                        product(s, &world_from_triangle, &triangle_from_sensor),
                        sum(s, &point, &off_skin),
                    ),
                    normal,
                )
            }
        }
    }
}

/// What is odd about the point that a placement gives for its site; `None` also for other sites.
///
/// # Errors
/// [`ImuError::Site`] for a point that is not finite.
pub fn point_oddity(model: &BodyModel, placement: &Placement) -> Result<Option<Oddity>, ImuError> {
    let SiteChoice::NearestTo(point) = placement.site() else {
        return Ok(None);
    };
    let site = model.nearest_site(*point);
    let distance = site.and_then(|site| model.distance_to_site(*point, &site));
    match distance {
        Ok(distance) => Ok(POINT_FROM_SKIN.judge(distance, "")),
        Err(source) => Err(ImuError::Site {
            placement: placement.name().to_owned(),
            source: Box::new(source),
        }),
    }
}

/// Several placements on one body, evaluated together: the skeleton is computed once a pose.
#[derive(Clone, Debug)]
pub struct MountedSensors {
    sensors: Vec<MountedSensor>,
    subset: Option<VertexSubset>,
}

impl MountedSensors {
    /// Mounts placements.
    ///
    /// # Errors
    /// As [`MountedSensor::new`].
    pub fn new(body: &ShapedBody, placements: &[Placement]) -> Result<Self, ImuError> {
        let sensors = placements
            .iter()
            .map(|placement| MountedSensor::new(body, placement))
            .collect::<Result<Vec<_>, _>>()?;
        let vertices: Vec<u32> = sensors
            .iter()
            .flat_map(|sensor| sensor.subset.vertices())
            .collect();
        let refuse = |source| ImuError::Site {
            placement: "(all)".to_owned(),
            source: Box::new(source),
        };
        let subset = if sensors.is_empty() {
            None
        } else {
            let joints = sensors.iter().map(MountedSensor::joint);
            Some(
                body.subset(&vertices)
                    .map_err(refuse)?
                    .with_segments_of(joints),
            )
        };
        Ok(Self { sensors, subset })
    }

    /// The mounted placements, in order.
    pub fn sensors(&self) -> &[MountedSensor] {
        &self.sensors
    }

    /// Where the sensors of all placements are for one pose of the body, in order.
    pub fn poses(&self, body: &BodyPose) -> Vec<SensorPose> {
        let mut poses = Vec::new();
        self.poses_into(body, &mut Vec::new(), &mut poses);
        poses
    }

    /// Their trajectories over a whole motion, in order.
    ///
    /// # Errors
    /// As [`SensorTrajectory::new`]; stamps beyond the poses, or poses beyond the stamps, are left
    /// out.
    pub fn trajectories(
        &self,
        stamps: &[Stamp],
        poses: &[BodyPose],
    ) -> Result<Vec<SensorTrajectory>, ImuError> {
        let mut by_sensor: Vec<Vec<SensorFrame>> = self
            .sensors
            .iter()
            .map(|_| Vec::with_capacity(stamps.len()))
            .collect();
        if let Some(subset) = &self.subset {
            let poses = &poses[..poses.len().min(stamps.len())];
            subset.visit_poses(
                poses,
                FramesOf {
                    sensors: &self.sensors,
                    stamps,
                    by_sensor: &mut by_sensor,
                },
            );
        }
        by_sensor.into_iter().map(SensorTrajectory::new).collect()
    }

    fn poses_into(
        &self,
        body: &BodyPose,
        positions: &mut Vec<Vector3<f64>>,
        poses: &mut Vec<SensorPose>,
    ) {
        poses.clear();
        let Some(subset) = &self.subset else { return };
        let segments = subset.positions_and_segments_into(body, positions);
        let corners = positions.chunks_exact(3).map(|c| [c[0], c[1], c[2]]);
        poses.extend(self.sensors.iter().zip(corners).map(|(sensor, corners)| {
            sensor.pose_from(&segments[sensor.site.joint.index()], corners)
        }));
    }
}

/// Appends the frames of all sensors to their series.
struct FramesOf<'a> {
    sensors: &'a [MountedSensor],
    stamps: &'a [Stamp],
    by_sensor: &'a mut [Vec<SensorFrame>],
}

impl VisitPoses for FramesOf<'_> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, first: usize, poses: &PosesInLanes<S>) {
        let stamps = &self.stamps[first..first + poses.count()];
        let corners = poses.positions().as_chunks::<3>().0;
        let sensors = self.by_sensor.iter_mut().zip(self.sensors);
        for ((series, sensor), corners) in sensors.zip(corners) {
            let segment = poses.world_from_segment(sensor.site.joint);
            let (world_from_sensor, normal) = sensor.poses_from(s, segment, corners);
            series.extend(stamps.iter().enumerate().map(|(lane, stamp)| SensorFrame {
                stamp: *stamp,
                world_from_sensor: isometry_of::<S>(&world_from_sensor, lane),
                normal_in_world: vector_of::<S>(&normal, lane),
                pose_std: PoseStd::NONE,
            }));
        }
    }
}

/// From a joint to the next one towards the far end; of a last joint the way from its parent. Model
/// frame, unit length.
fn bone_direction(body: &ShapedBody, joint: Joint) -> Vector3<f64> {
    let joints = body.joints_in_model();
    let next = match joint {
        Joint::Pelvis => Some(Joint::Spine1),
        Joint::Spine3 => Some(Joint::Neck),
        _ => joint.children().next(),
    };
    let (from, to) = match (next, joint.parent()) {
        (Some(next), _) => (joint, next),
        (None, parent) => (parent.unwrap_or(joint), joint),
    };
    (joints[to.index()] - joints[from.index()])
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::zeros)
}

/// model_from_site at rest: z the normal, x the bone's tangent.
fn site_axes(normal: &Vector3<f64>, bone: &Vector3<f64>) -> UnitQuaternion<f64> {
    let tangent =
        |direction: &Vector3<f64>| (direction - normal * normal.dot(direction)).try_normalize(0.2);
    // One of left and forward is at least 45 degrees off any normal.
    let x = tangent(bone)
        .or_else(|| tangent(&Vector3::z()))
        .or_else(|| tangent(&Vector3::x()))
        .unwrap_or_else(Vector3::x);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(
        &[x, normal.cross(&x), *normal],
    )))
}

#[cfg(test)]
#[path = "mount_tests.rs"]
mod tests;
