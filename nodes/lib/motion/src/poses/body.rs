//! From a track to a motion on a body, in a world with z up.

use std::path::Path;
use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, Gender, JOINT_COUNT, ShapeSpace, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

use super::bridge::Played;
use super::format::{MAX_POSES, PoseFormat, VIDEO_RATE_HZ};
use super::report::{PoseReport, RateOrigin, ShapeOrigin};
use super::shape::Shape;
use super::track::{PoseAxes, PoseTrack, world_from_level_camera};
use super::values::{RATES_HZ, RATES_TEXT, problem, too_long};
use crate::axes::{axis_name, minimal_rotation, nearest_axis};
use crate::motion::{continuous, slerp};
use crate::retarget::{floor, scale};
use crate::{MotionError, MotionOptions, SmplMotion};

/// How clearly the mean upward direction must point along an axis: cos 53 degrees.
const CLEARLY_UP: f64 = 0.6;

/// One person's poses in the axes of a camera (x right, y down, z forward), for a global
/// trajectory.
#[derive(Clone, Debug)]
pub struct CameraPoses {
    /// The file's name.
    pub name: String,
    /// The file's name or number for the person.
    pub person: String,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// The source's gender; neutral where it does not say.
    pub gender: Gender,
    /// The video's frame of the first pose; each later one is of the next frame.
    pub first_frame: i64,
    /// camera_from_pelvis and the local rotations; the root position is 0.
    pub poses: Vec<BodyPose>,
    /// How sure each pose is, in [0, 1]: 0 where the track has a gap.
    pub pose_confidence: Vec<f64>,
    /// Shape coefficients of each frame where they are those of the body; no list at all for the
    /// mean shape.
    pub betas: Vec<Vec<f64>>,
}

/// What a track is laid on, and how.
pub(super) struct OnBody<'a> {
    pub path: &'a Path,
    pub format: PoseFormat,
    /// Everybody in the file and their numbers of frames.
    pub people: &'a [(String, usize)],
    pub body: &'a Arc<BodyModel>,
    /// The body that the file's betas are for, where it is given.
    pub source_body: Option<&'a Arc<BodyModel>>,
    pub options: &'a MotionOptions,
}

/// A track's frames with its gaps bridged.
struct Frames {
    poses: Vec<BodyPose>,
    confidence: Vec<f64>,
    played: Played,
}

/// How a track's poses become poses of the body in the world.
struct WorldPoses<'a> {
    track: &'a PoseTrack,
    world_from_file: UnitQuaternion<f64>,
    /// The pelvis joint at rest in the axes of the body that `trans` goes with, m.
    pelvis_in_model: Vector3<f64>,
    /// Factor on the way: the body's leg length by that of the file's own body.
    leg_ratio: f64,
}

impl WorldPoses<'_> {
    fn pose(&self, frame: usize) -> BodyPose {
        let mut local_rotations = self.track.rotations[frame];
        local_rotations[0] = self.world_from_file * local_rotations[0];
        let root_position = match &self.track.trans {
            Some(trans) => {
                let turn = self
                    .track
                    .pelvis_turns
                    .as_ref()
                    .map_or_else(UnitQuaternion::identity, |turns| turns[frame]);
                self.world_from_file * (turn * self.pelvis_in_model + trans[frame]) * self.leg_ratio
            }
            None => Vector3::zeros(),
        };
        BodyPose {
            root_position,
            local_rotations,
        }
    }
}

impl OnBody<'_> {
    /// The track as a motion in a world with z up, its feet on the floor where the file's own floor
    /// is not known.
    pub fn motion(&self, track: PoseTrack) -> Result<SmplMotion, MotionError> {
        let (rate_hz, rate_origin) = self.rate(&track)?;
        let shape = Shape::choose(
            self.path,
            &track,
            self.body,
            self.source_body,
            self.options.shape,
        )?;
        let shaped = ShapedBody::new(self.body.clone(), &shape.betas)?;
        let (world_from_file, up_axis) = self.world_from_file(&track)?;
        let poses = self.world_poses(&track, &shape, &shaped, world_from_file);
        let Frames {
            poses,
            confidence,
            played,
        } = self.frames(&track, rate_hz, |frame| poses.pose(frame))?;
        let mut frames = continuous(poses);
        // MoCap knows its floor; a video's is a guess, and another body's feet are elsewhere.
        let knows_floor = !self.format.is_video() && shape.origin == ShapeOrigin::File;
        let floor_shift_m = if knows_floor {
            0.0
        } else {
            floor::stand_on_floor(&shaped, &mut frames, rate_hz)
        };
        let report = PoseReport {
            rate_origin,
            up_axis,
            floor_shift_m,
            ..self.report(&track, &shape, &played)
        };
        Ok(SmplMotion {
            name: self.path.display().to_string(),
            rate_hz,
            gender: self
                .body
                .gender()
                .or(track.gender)
                .unwrap_or(Gender::Neutral),
            betas: shape.betas,
            shape_space: self.body.shape_space(),
            frames,
            confidence: self.format.is_video().then_some(confidence),
            report: None,
            markers: None,
            poses: Some(report),
        })
    }

    fn world_poses<'a>(
        &self,
        track: &'a PoseTrack,
        shape: &Shape,
        shaped: &ShapedBody,
        world_from_file: UnitQuaternion<f64>,
    ) -> WorldPoses<'a> {
        let pelvis_in_model = match &shape.source_joints {
            Some(joints) => joints[0],
            None if track.shape_space != self.body.shape_space() => usual_pelvis(track.shape_space),
            None => shaped.joints_in_model()[0],
        };
        let leg_ratio = shape.source_joints.as_ref().map_or(1.0, |source| {
            leg_length(shaped.joints_in_model()) / leg_length(source)
        });
        WorldPoses {
            track,
            world_from_file,
            pelvis_in_model,
            leg_ratio,
        }
    }

    /// What track and shape say; rate, up axis and floor are the motion's to fill in.
    fn report(&self, track: &PoseTrack, shape: &Shape, played: &Played) -> PoseReport {
        PoseReport {
            format: self.format,
            person: track.person.clone(),
            people: self.people.to_vec(),
            rate_origin: RateOrigin::File,
            gender: track.gender,
            shape_space: track.shape_space,
            source_betas: track.mean_betas(),
            shape_origin: shape.origin,
            betas_left_out: shape.betas_left_out,
            up_axis: String::new(),
            has_trajectory: track.trans.is_some(),
            first_frame: first_frame(track, played),
            bridged_frames: played.length - played.frames.len(),
            left_out_frames: track.rotations.len() - played.frames.len(),
            floor_shift_m: 0.0,
        }
    }

    /// The track in the camera's axes, in place; `None` where the file has it in a world.
    pub fn camera_poses(&self, track: &PoseTrack) -> Result<Option<CameraPoses>, MotionError> {
        if track.axes != PoseAxes::Camera {
            return Ok(None);
        }
        let (rate_hz, _) = self.rate(track)?;
        let pose = |frame: usize| BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: track.rotations[frame],
        };
        let Frames {
            poses,
            confidence,
            played,
        } = self.frames(track, rate_hz, pose)?;
        let own = track.shape_space == self.body.shape_space()
            && track.shape_space != ShapeSpace::Cromosim;
        let own = own
            && self
                .body
                .check_betas(track.shape_space, track.gender, &track.mean_betas())
                .is_ok();
        let betas_at = |frame: usize| {
            track
                .betas_at(frame)
                .iter()
                .take(self.body.beta_count())
                .copied()
                .collect()
        };
        let sources = played.sources(track.frame_ids.as_deref());
        Ok(Some(CameraPoses {
            name: self.path.display().to_string(),
            person: track.person.clone(),
            rate_hz,
            gender: track.gender.unwrap_or(Gender::Neutral),
            first_frame: first_frame(track, &played),
            poses: continuous(poses),
            pose_confidence: confidence,
            betas: if own {
                sources
                    .into_iter()
                    .map(|(frame, _)| betas_at(frame))
                    .collect()
            } else {
                Vec::new()
            },
        }))
    }

    /// The rate, Hz: the option's, else the file's, else what is usual for video.
    fn rate(&self, track: &PoseTrack) -> Result<(f64, RateOrigin), MotionError> {
        if let Some(rate_hz) = self.options.rate_hz {
            let expected = RATES_TEXT.to_owned();
            let name = self.path.display().to_string();
            let wrong = MotionError::Setting {
                name,
                setting: "rate_hz",
                value: rate_hz,
                expected,
            };
            return if RATES_HZ.contains(&rate_hz) {
                Ok((rate_hz, RateOrigin::Option))
            } else {
                Err(wrong)
            };
        }
        match track.rate_hz {
            Some(rate_hz) => Ok((rate_hz, RateOrigin::File)),
            None if self.format.is_video() => Ok((VIDEO_RATE_HZ, RateOrigin::Assumed)),
            None => Err(problem(
                self.path,
                "mocap_framerate",
                "missing, and mocap_frame_rate too; set rate_hz",
            )),
        }
    }

    /// The part of the track that is played, at a constant rate.
    fn frames(
        &self,
        track: &PoseTrack,
        rate_hz: f64,
        pose: impl Fn(usize) -> BodyPose,
    ) -> Result<Frames, MotionError> {
        let ids = track.frame_ids.as_deref();
        let played = Played::longest_part(ids, track.rotations.len(), rate_hz);
        if played.length > MAX_POSES {
            return Err(too_long(self.path));
        }
        let (mut poses, mut confidence) = (
            Vec::with_capacity(played.length),
            Vec::with_capacity(played.length),
        );
        for (frame, fraction) in played.sources(ids) {
            if fraction == 0.0 {
                poses.push(pose(frame));
                confidence.push(
                    track
                        .confidence
                        .as_ref()
                        .map_or(1.0, |values| values[frame]),
                );
            } else {
                poses.push(between(&pose(frame), &pose(frame + 1), fraction));
                confidence.push(0.0);
            }
        }
        Ok(Frames {
            poses,
            confidence,
            played,
        })
    }

    /// The rotation from the file's axes into a world with z up, and the name of the file's up
    /// axis.
    fn world_from_file(
        &self,
        track: &PoseTrack,
    ) -> Result<(UnitQuaternion<f64>, String), MotionError> {
        let up = match (self.options.up_axis.direction(), track.axes) {
            (Some(up), _) | (None, PoseAxes::Up(up)) => up,
            (None, PoseAxes::Camera) => {
                return Ok((world_from_level_camera(), "camera".to_owned()));
            }
            (None, PoseAxes::Detect) => {
                let mean = track.mean_upward();
                let up = nearest_axis(mean);
                if up.dot(&mean) < CLEARLY_UP {
                    return Err(MotionError::UpAxis {
                        name: self.path.display().to_string(),
                        mean: mean.into(),
                    });
                }
                up
            }
        };
        Ok((minimal_rotation(up, Vector3::z()), axis_name(up)))
    }
}

/// Number of the first frame that is played.
fn first_frame(track: &PoseTrack, played: &Played) -> i64 {
    track
        .frame_ids
        .as_ref()
        .map_or(0, |ids| ids[played.frames.start])
}

/// The pose `fraction` of the way from one to the other.
fn between(from: &BodyPose, to: &BodyPose, fraction: f64) -> BodyPose {
    BodyPose {
        root_position: from.root_position.lerp(&to.root_position, fraction),
        local_rotations: std::array::from_fn(|joint| {
            slerp(
                &from.local_rotations[joint],
                &to.local_rotations[joint],
                fraction,
            )
        }),
    }
}

/// Where the mean body's pelvis joint stands in its model frame, m, to a centimetre: for files
/// whose body is not at hand. Errors of it, a few centimetres by the betas, move a whole motion;
/// only where a camera turns (TRAM) do they turn with it.
fn usual_pelvis(space: ShapeSpace) -> Vector3<f64> {
    match space {
        ShapeSpace::Cromosim => Vector3::new(0.0, -0.22, 0.0),
        ShapeSpace::Smpl => Vector3::new(0.0, -0.22, 0.03),
        ShapeSpace::SmplX => Vector3::new(0.0, -0.35, 0.01),
    }
}

fn leg_length(joints: &[Vector3<f64>; JOINT_COUNT]) -> f64 {
    scale::leg_length(&|joint| Some(joints[joint.index()]))
}
