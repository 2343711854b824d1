//! `cromosim trajectory`: in-place poses of a video become a motion in the world, by keypoints,
//! depth maps and cameras.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use cromosim_body::BodyModel;
use cromosim_motion::{MotionOptions, PoseView, SmplMotion, open_poses, read_motion_for};
use cromosim_recording::convert::{MotionFile, write_motion};
use cromosim_video::{
    CameraAxes, CameraClip, CameraFolder, DepthEncoding, FolderLayout, ScaleSource, Trajectory,
    TrajectoryOptions, global_trajectory,
};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

use crate::body;
use crate::convert::Format;
use crate::files::refuse_existing;
use crate::motion_arguments::MotionArguments;
use crate::output::say;
use crate::progress::working;

/// Heading of the help.
const VIDEO: &str = "The video";

/// Place in-place poses of a video in the world, by keypoints, depth maps and cameras
#[derive(Args)]
#[command(
    override_usage = "cromosim trajectory [OPTIONS] --keypoints <DIR> --depth <DIR> --cameras <DIR>\n           --depth-encoding <WHAT> --camera-axes <AXES> --image <WxH> <POSES> <OUT>"
)]
#[command(group = clap::ArgGroup::new("size").args(["body_height", "scale"]).multiple(false))]
pub struct Arguments {
    /// The in-place poses: what VIBE, PHALP, WHAM, GVHMR or TRAM wrote
    ///
    /// Or any motion whose root orientation is that against a level camera which looks along the
    /// world's y axis
    poses: PathBuf,
    /// The motion to write: .npz, .bvh, .trc, or .mcap
    ///
    /// The ending decides where --to does not; .mcap keeps the frames' confidence
    out: PathBuf,
    /// The format to write: amass, bvh, trc or bag
    #[arg(long, value_enum, value_name = "FORMAT", hide_possible_values = true)]
    to: Option<Format>,
    /// Folder of OpenPose's *_keypoints.json (BODY_25)
    #[arg(long, value_name = "DIR", help_heading = VIDEO)]
    keypoints: PathBuf,
    /// Folder of depth maps, frame_NNNNNN.raw, .npy or .png
    #[arg(long, value_name = "DIR", help_heading = VIDEO)]
    depth: PathBuf,
    /// Folder of cameras, frame_NNNNNN.npz
    #[arg(long, value_name = "DIR", help_heading = VIDEO)]
    cameras: PathBuf,
    /// What the maps hold
    ///
    /// Robust CVD's hold disparity
    #[arg(long, value_name = "WHAT", value_parser = ["depth", "disparity"], help_heading = VIDEO)]
    depth_encoding: String,
    /// Which way the cameras' axes point
    ///
    /// y down and z forward (opencv), or y up and z backward (opengl)
    #[arg(long, value_name = "AXES", value_parser = ["opencv", "opengl"], help_heading = VIDEO)]
    camera_axes: String,
    /// Width and height of the video, in which the keypoints are, px
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = VIDEO)]
    image: [usize; 2],
    /// Size of the image that the intrinsics are for, px
    ///
    /// Default: the video's
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = VIDEO)]
    camera_image: Option<[usize; 2]>,
    /// Size of depth maps without a header, px
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = VIDEO)]
    plain_depth: Option<[usize; 2]>,
    /// Number of the first frame in the files' names
    #[arg(long, value_name = "NUMBER", default_value_t = 0, help_heading = VIDEO)]
    first_number: usize,
    /// Whether the root moves
    ///
    /// depth (the paper's CROMOSim), or none (its Lite)
    #[arg(long, value_name = "HOW", value_parser = ["depth", "none"], default_value = "depth")]
    trajectory: String,
    /// The person's standing height, m: gives the scale
    ///
    /// Of depth maps and cameras
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    body_height: Option<f64>,
    /// Metres per unit of depth maps and cameras; 1: metric
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    scale: Option<f64>,
    /// Body model (npz or pickle) rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Replace OUT where it exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    motion: MotionArguments,
}

/// `1920x1080`.
fn size(text: &str) -> Result<[usize; 2], String> {
    let parts = text
        .split_once('x')
        .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    parts
        .filter(|[width, height]| (1..=1 << 16).contains(width) && (1..=1 << 16).contains(height))
        .ok_or("expected WIDTHxHEIGHT in pixels".to_owned())
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let target = Format::or_ending(arguments.to, &arguments.out)?;
    if !target.takes_motions() {
        bail!(
            "{}: {} holds no motion of a body; give .npz, .bvh, .trc or .mcap",
            arguments.out.display(),
            target.describe()
        );
    }
    refuse_existing(&arguments.out, arguments.force)?;
    let options = options(arguments)?;
    let motion_options = arguments.motion.options()?;
    let model = body::model(arguments.body.as_deref())?;
    let read = || {
        let image = pixels(arguments.image);
        clip(&arguments.poses, image, &model, &motion_options)
    };
    let (mut clip, first_frame) = working("reading poses", read)?;
    let folder = CameraFolder {
        keypoints: arguments.keypoints.clone(),
        depth: arguments.depth.clone(),
        cameras: arguments.cameras.clone(),
        layout: layout(arguments, first_frame),
    };
    let mut files = folder.read(clip.poses.len(), options.least_confidence)?;
    (clip.keypoints, clip.cameras) = (files.keypoints, files.cameras);
    let placed = working("placing in the world", || {
        global_trajectory(&clip, &mut files.depth, &model, &options)
    })?;
    let file = MotionFile {
        target,
        options: &motion_options,
        command: "trajectory",
        replace: arguments.force,
    };
    write_motion(&placed.motion, &model, &file, &arguments.out)?;
    say!(
        "{}: {} of {} frames",
        arguments.out.display(),
        target.describe(),
        placed.motion.frames.len()
    )?;
    say!("  {}", placed.report)?;
    Ok(())
}

fn options(arguments: &Arguments) -> anyhow::Result<TrajectoryOptions> {
    let trajectory = if arguments.trajectory == "none" {
        Trajectory::None
    } else {
        Trajectory::Depth
    };
    let scale = match (arguments.body_height, arguments.scale, trajectory) {
        (Some(metres), ..) => ScaleSource::BodyHeight(metres),
        (None, Some(factor), _) => ScaleSource::Given(factor),
        // In place there is nothing to scale.
        (None, None, Trajectory::None) => ScaleSource::Given(1.0),
        (None, None, Trajectory::Depth) => {
            bail!(
                "no scale of depth maps and cameras; give --body-height, or --scale (1 where they are metric)"
            )
        }
    };
    Ok(TrajectoryOptions {
        trajectory,
        ..TrajectoryOptions::new(scale)
    })
}

fn layout(arguments: &Arguments, first_frame: usize) -> FolderLayout {
    FolderLayout {
        encoding: if arguments.depth_encoding == "disparity" {
            DepthEncoding::Disparity
        } else {
            DepthEncoding::Depth
        },
        axes: if arguments.camera_axes == "opengl" {
            CameraAxes::OpenGl
        } else {
            CameraAxes::OpenCv
        },
        keypoint_image_px: pixels(arguments.image),
        intrinsics_image_px: pixels(arguments.camera_image.unwrap_or(arguments.image)),
        first_number: arguments.first_number + first_frame,
        plain_depth_px: arguments.plain_depth,
    }
}

fn pixels([width, height]: [usize; 2]) -> Vector2<f64> {
    Vector2::new(width as f64, height as f64)
}

/// The poses, and the video's frame of the first of them.
fn clip(
    path: &Path,
    image: Vector2<f64>,
    model: &Arc<BodyModel>,
    options: &MotionOptions,
) -> anyhow::Result<(CameraClip, usize)> {
    let Some(file) = open_poses(path, PoseView::Camera)?.filter(|file| file.format.is_video())
    else {
        return Ok((in_place(&read_motion_for(path, model, options)?, image), 0));
    };
    let people = file.into_camera_poses(model, options)?;
    if people.is_empty() {
        bail!(
            "{}: no poses in a camera's axes; VIBE, PHALP, WHAM, GVHMR and TRAM have such",
            path.display()
        );
    }
    let names: Vec<String> = people.iter().map(|poses| poses.person.clone()).collect();
    let chosen = match &options.person {
        Some(person) => people.into_iter().find(|poses| poses.person == *person),
        // Of equal length the first, as everywhere.
        None => people
            .into_iter()
            .rev()
            .max_by_key(|poses| poses.poses.len()),
    };
    let Some(poses) = chosen else {
        bail!(
            "{}: nobody is called {}; there are: {}",
            path.display(),
            options.person.as_deref().unwrap_or_default(),
            names.join(", ")
        )
    };
    let clip = CameraClip {
        name: poses.name,
        rate_hz: poses.rate_hz,
        gender: poses.gender,
        poses: poses.poses,
        pose_confidence: poses.pose_confidence,
        betas: poses.betas,
        keypoints: Vec::new(),
        keypoint_image_px: image,
        cameras: Vec::new(),
    };
    Ok((clip, usize::try_from(poses.first_frame).unwrap_or(0)))
}

/// The motion as an estimator would give it: before a level camera that looks along the world's y
/// axis, so that the camera's x is the world's, its y down and its z the world's y.
fn in_place(motion: &SmplMotion, keypoint_image_px: Vector2<f64>) -> CameraClip {
    let camera_from_world =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let count = motion.frames.len();
    let mut poses = motion.frames.clone();
    for pose in &mut poses {
        pose.local_rotations[0] = camera_from_world * pose.local_rotations[0];
    }
    CameraClip {
        name: motion.name.clone(),
        rate_hz: motion.rate_hz,
        gender: motion.gender,
        poses,
        pose_confidence: motion
            .confidence
            .clone()
            .unwrap_or_else(|| vec![1.0; count]),
        betas: vec![motion.betas.clone(); count],
        keypoints: Vec::new(),
        keypoint_image_px,
        cameras: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_videos_own_estimates_are_taken_in_the_cameras_axes() -> anyhow::Result<()> {
        let folder =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("nodes/lib/motion/tests/data/poses");
        let (model, image) = (BodyModel::embedded(), Vector2::new(1920.0, 1080.0));
        let read =
            |name: &str, options: &MotionOptions| clip(&folder.join(name), image, &model, options);
        for name in ["vibe.joblib", "wham.pkl", "phalp.pkl", "gvhmr.pt"] {
            let (clip, _) = read(name, &MotionOptions::default())?;
            assert!(
                clip.poses.len() >= 4
                    && clip
                        .poses
                        .iter()
                        .all(|pose| pose.root_position.norm() == 0.0),
                "{name}"
            );
        }
        // A person who stands before a level camera has the head towards the image's top: up is -y.
        let (vibe, _) = read("vibe.joblib", &MotionOptions::default())?;
        assert!((vibe.poses[0].local_rotations[0] * Vector3::y()).y < -0.5);
        let nobody = MotionOptions {
            person: Some("17".to_owned()),
            ..MotionOptions::default()
        };
        let error = read("wham.pkl", &nobody)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(
            error.contains("nobody is called 17") && error.contains("0, 3"),
            "{error}"
        );
        let error = read("slahmr.npz", &MotionOptions::default())
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(
            error.contains("slahmr.npz: no poses in a camera's axes"),
            "{error}"
        );
        Ok(())
    }
}
