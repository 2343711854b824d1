//! The global trajectory on shots that the test makes itself: the error before and after each step,
//! and what must be achieved.
#![allow(clippy::unwrap_used)]

#[path = "../../motion/tests/common/mod.rs"]
mod common;
mod shot;

use cromosim_arrays::NpzWriter;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk, read_motion};
use cromosim_spatial::{confidence_of_std, std_of_confidence};
use cromosim_video::{
    CameraAxes, CameraClip, CameraFolder, DepthEncoding, DepthMap, FolderLayout, GlobalTrajectory,
    ScaleSource, Trajectory, TrajectoryOptions, VideoError, global_trajectory, parse_camera,
    parse_depth, parse_openpose, standing_height,
};
use nalgebra::{Isometry3, Vector3};
use shot::{Errors, RATE_HZ, Shot};

fn height(motion: &SmplMotion) -> f64 {
    standing_height(&ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap())
}

fn solve(shot: &Shot, options: &TrajectoryOptions) -> Result<GlobalTrajectory, VideoError> {
    let mut depths =
        |frame: usize| -> Result<Option<DepthMap>, VideoError> { Ok(shot.depths[frame].clone()) };
    global_trajectory(&shot.clip, &mut depths, &BodyModel::embedded(), options)
}

/// Error of a track against the truth: of its position (m) and of its second differences (m/s2),
/// root mean square.
#[derive(Clone, Copy, Debug)]
struct TrackError {
    position: f64,
    acceleration: f64,
}

fn track_error(track: &[Option<Vector3<f64>>], truth: &[Vector3<f64>]) -> TrackError {
    let rms = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let error: Vec<Option<Vector3<f64>>> = track
        .iter()
        .zip(truth)
        .map(|(own, truth)| own.map(|own| own - truth))
        .collect();
    let second = |triple: &[Option<Vector3<f64>>]| {
        Some(((triple[2]? - triple[1]? * 2.0 + triple[0]?) * RATE_HZ * RATE_HZ).norm_squared())
    };
    TrackError {
        position: rms(error.iter().flatten().map(Vector3::norm_squared).collect()),
        acceleration: rms(error.windows(3).filter_map(second).collect()),
    }
}

/// The errors after each step, printed.
fn steps(name: &str, shot: &Shot, solved: &GlobalTrajectory) -> [TrackError; 5] {
    let in_source =
        |world: &Vector3<f64>| (shot.source_from_world * nalgebra::Point3::from(*world)).coords;
    let truth: Vec<Vector3<f64>> = shot
        .truth
        .iter()
        .map(|pose| in_source(&pose.root_position))
        .collect();
    let track = solved.track.as_ref().unwrap();
    let scale = solved.report.scale.unwrap().metres_per_unit;
    let scaled: Vec<Option<Vector3<f64>>> = track
        .measured
        .iter()
        .map(|m| m.map(|m| m.position))
        .collect();
    // Before the scale, in the reconstruction's unit taken as metres.
    let raw: Vec<Option<Vector3<f64>>> = scaled
        .iter()
        .map(|position| position.map(|position| position / scale))
        .collect();
    let gated = scaled
        .iter()
        .zip(&track.accepted)
        .map(|(position, used)| position.filter(|_| *used))
        .collect::<Vec<_>>();
    let filtered: Vec<_> = track
        .filtered
        .iter()
        .map(|state| Some(state.position))
        .collect();
    let smoothed: Vec<_> = track
        .smoothed
        .iter()
        .map(|state| Some(state.position))
        .collect();
    let errors =
        [&raw, &scaled, &gated, &filtered, &smoothed].map(|track| track_error(track, &truth));
    println!("{name}: {}", solved.report);
    println!(
        "  joints of the estimator: {:.0} mm off, {:.0} mm without the root's turn",
        1e3 * shot.pose_error_m[0],
        1e3 * shot.pose_error_m[1]
    );
    let still: Vec<_> = truth.iter().map(|_| Some(Vector3::zeros())).collect();
    println!(
        "  the root's own acceleration is {:.2} m/s2",
        track_error(&still, &truth).acceleration
    );
    for (step, error) in ["raw", "scaled", "gated", "filtered", "smoothed"]
        .iter()
        .zip(&errors)
    {
        println!(
            "  {step:9} position {:.3} m, acceleration {:6.2} m/s2",
            error.position, error.acceleration
        );
    }
    errors
}

fn options(motion: &SmplMotion) -> TrajectoryOptions {
    TrajectoryOptions::new(ScaleSource::BodyHeight(height(motion)))
}

/// Rigid motion that lays one track over another: best rotation about z and translation, least
/// squares.
fn upright_alignment(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Isometry3<f64> {
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (a, b) = (mean(from), mean(to));
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = ((p - a).xy(), (q - b).xy());
        sine += p.perp(&q);
        cosine += p.dot(&q);
    }
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sine.atan2(cosine));
    Isometry3::from_parts(Vector3::from(b - turn * a).into(), turn)
}

fn check_published(name: &str, motion: &SmplMotion, seed: u64) {
    const RECONSTRUCTION: f64 = 0.6;
    let shot = shot::shoot(motion, &shot::PUBLISHED, RECONSTRUCTION, seed);
    let solved = solve(&shot, &options(motion)).unwrap();
    let [raw, scaled, _, _, smoothed] = steps(name, &shot, &solved);
    let off = solved.report.scale.unwrap().metres_per_unit * RECONSTRUCTION - 1.0;
    let tilt = solved_up(&shot, &solved).angle(&Vector3::z()).to_degrees();
    let truth: Vec<_> = shot.truth.iter().map(|pose| pose.root_position).collect();
    let own: Vec<_> = solved
        .motion
        .frames
        .iter()
        .map(|pose| pose.root_position)
        .collect();
    let aligned = upright_alignment(&own, &truth);
    let laid: Vec<_> = own
        .iter()
        .map(|p| Some((aligned * nalgebra::Point3::from(*p)).coords))
        .collect();
    let whole = track_error(&laid, &truth);
    let inside = solved
        .states
        .iter()
        .zip(&laid)
        .zip(&truth)
        .filter(|((state, own), truth)| {
            (own.unwrap() - *truth).norm() < 2.8 * (state.position_covariance.trace() / 3.0).sqrt()
        });
    let inside = inside.count() as f64 / truth.len() as f64;
    println!(
        "  scale off by {:+.2} %, up by {tilt:.2} deg, after yaw and place: {:.3} m; {:.0} % within 2.8 std",
        100.0 * off,
        whole.position,
        100.0 * inside
    );
    // A clip of under 5 s does not average out the estimator's slow errors; it has to know so.
    let allowed = if truth.len() as f64 > 5.0 * RATE_HZ {
        0.02
    } else {
        (2.5 * solved.report.scale.unwrap().relative_std).max(0.02)
    };
    assert!(
        off.abs() < allowed,
        "{name}: scale off by {off}, allowed {allowed}"
    );
    assert!(
        smoothed.acceleration * 5.0 < raw.acceleration
            && smoothed.acceleration * 5.0 < scaled.acceleration,
        "{name}: fivefold"
    );
    assert!(
        smoothed.position < scaled.position && scaled.position < raw.position,
        "{name}"
    );
    assert!(tilt < 5.0, "{name}: {tilt} deg");
    assert!(
        inside > 0.8,
        "{name}: the covariance is too small: {inside}"
    );
}

/// The motion's up in the world of the result.
fn solved_up(shot: &Shot, solved: &GlobalTrajectory) -> Vector3<f64> {
    solved.world_from_source.rotation * (shot.source_from_world.rotation * Vector3::z())
}

#[test]
fn the_walk_is_found_again_through_published_errors() {
    for seed in 1..=3 {
        check_published(
            &format!("embedded walk, seed {seed}"),
            &embedded_walk(),
            seed,
        );
    }
}

#[test]
fn recorded_motions_are_found_again_through_published_errors() {
    let Some(folder) = common::shared_data("mocap_cmu") else {
        return;
    };
    for name in ["07_01.bvh", "06_10.bvh"] {
        let motion = read_motion(&folder.join(name), &MotionOptions::default()).unwrap();
        check_published(name, &motion, 7);
    }
}

#[test]
fn without_errors_the_root_comes_back() {
    let walk = embedded_walk().slice(2.0, Some(3.0)).unwrap();
    let shot = shot::shoot(&walk, &shot::NONE, 1.0, 1);
    let given = TrajectoryOptions {
        scale: ScaleSource::Given(1.0),
        ..options(&walk)
    };
    let [raw, .., smoothed] = steps("no errors", &shot, &solve(&shot, &given).unwrap());
    // What is left: an arm that passes before half of the window.
    assert!(
        raw.position < 0.03 && smoothed.position < 0.01,
        "{raw:?} {smoothed:?}"
    );
    let by_height = solve(&shot, &options(&walk)).unwrap().report.scale.unwrap();
    println!("scale by height without errors: {by_height:?}");
    assert!((by_height.metres_per_unit - 1.0).abs() < 0.003);
}

#[test]
fn the_pose_stands_in_the_world_and_in_place_where_asked() {
    let walk = embedded_walk().slice(2.0, Some(3.0)).unwrap();
    let errors = Errors {
        pose_slow_deg: 0.0,
        pose_white_deg: 0.0,
        camera_deg: 0.0,
        ..shot::PUBLISHED
    };
    let shot = shot::shoot(&walk, &errors, 0.6, 3);
    let solved = solve(&shot, &options(&walk)).unwrap();
    let lite = solve(
        &shot,
        &TrajectoryOptions {
            trajectory: Trajectory::None,
            ..options(&walk)
        },
    )
    .unwrap();
    // Orientations against the truth differ by one turn only, which keeps up within what the floor,
    // or without a track the cameras and the trunk, tell.
    for (solved, most_deg) in [(&solved, 2.0), (&lite, 10.0)] {
        let motion = &solved.motion;
        let turn = motion.frames[0].local_rotations[0] * shot.truth[0].local_rotations[0].inverse();
        let up = solved_up(&shot, solved);
        println!(
            "up is off by {:.2} degrees",
            up.angle(&Vector3::z()).to_degrees()
        );
        assert!(up.angle(&Vector3::z()) < f64::to_radians(most_deg));
        assert!((turn * Vector3::z()).angle(&up) < 1e-6);
        for (own, truth) in motion.frames.iter().zip(&shot.truth) {
            assert!((turn * truth.local_rotations[0]).angle_to(&own.local_rotations[0]) < 1e-6);
            assert!(own.local_rotations[5].angle_to(&truth.local_rotations[5]) < 1e-9);
        }
    }
    let first = lite.motion.frames[0].root_position;
    assert!(
        lite.motion
            .frames
            .iter()
            .all(|pose| pose.root_position == first)
            && first.xy().norm() == 0.0
    );
    assert!(
        (first.z - shot.truth[0].root_position.z).abs() < 0.03,
        "stands on the floor: {}",
        first.z
    );
    assert_eq!((lite.motion.confidence, lite.states.len()), (None, 0));
    // Confidence and standard deviation say the same.
    let confidence = solved.motion.confidence.unwrap();
    for (confidence, state) in confidence.iter().zip(&solved.states) {
        let std_m = (state.position_covariance.trace() / 3.0).sqrt();
        assert_eq!(*confidence, confidence_of_std(std_m));
        assert!((std_of_confidence(*confidence) - std_m).abs() < 1e-9);
    }
}

#[test]
fn the_same_shot_gives_the_same_bits() {
    let walk = embedded_walk().slice(2.0, Some(1.5)).unwrap();
    let shot = shot::shoot(&walk, &shot::PUBLISHED, 0.6, 4);
    let [a, b] = [0, 1].map(|_| solve(&shot, &options(&walk)).unwrap());
    assert_eq!(a.motion.frames, b.motion.frames);
    assert_eq!(a.report, b.report);
}

#[test]
fn what_is_missing_is_said() {
    let walk = embedded_walk().slice(2.0, Some(1.0)).unwrap();
    let mut shot = shot::shoot(&walk, &shot::NONE, 1.0, 1);
    let message =
        |shot: &Shot, options: &TrajectoryOptions| solve(shot, options).unwrap_err().to_string();
    assert!(
        message(&shot, &TrajectoryOptions::new(ScaleSource::Given(-1.0))).contains("scale is -1")
    );
    shot.depths.iter_mut().skip(5).for_each(|map| *map = None);
    assert!(
        message(&shot, &options(&walk)).contains("5 of 31 frames"),
        "{}",
        message(&shot, &options(&walk))
    );
    shot.clip.cameras.pop();
    assert!(message(&shot, &options(&walk)).contains("cameras of 30 frames, but poses of 31"));
}

#[test]
fn a_folder_of_files_gives_what_the_shot_gave() {
    let walk = embedded_walk().slice(2.0, Some(1.0)).unwrap();
    let shot = shot::shoot(&walk, &shot::PUBLISHED, 0.6, 4);
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..shot.clip.poses.len() {
        let path = |name: String| folder.path().join(name);
        let depth = shot::disparity_file(shot.depths[frame].as_ref().unwrap());
        std::fs::write(path(format!("frame_{frame:06}.raw")), depth).unwrap();
        let camera = shot.clip.cameras[frame].unwrap();
        let matrix = camera.world_from_camera.to_homogeneous().transpose();
        let mut npz = NpzWriter::new(std::io::Cursor::new(Vec::new()));
        npz.floats("intrinsics", &[2], camera.focal_px.as_slice())
            .unwrap();
        npz.floats("extrinsics", &[4, 4], matrix.as_slice())
            .unwrap();
        std::fs::write(
            path(format!("frame_{frame:06}.npz")),
            npz.finish().unwrap().into_inner(),
        )
        .unwrap();
        let people: Vec<_> = shot.clip.keypoints[frame].into_iter().collect();
        std::fs::write(
            path(format!("clip_{frame:012}_keypoints.json")),
            shot::keypoint_file(&people),
        )
        .unwrap();
    }
    let at = || folder.path().to_owned();
    let layout = FolderLayout {
        encoding: DepthEncoding::Disparity,
        axes: CameraAxes::OpenCv,
        keypoint_image_px: shot.clip.keypoint_image_px,
        intrinsics_image_px: shot.clip.cameras[0].unwrap().image_px,
        first_number: 0,
        plain_depth_px: None,
    };
    let mut read = CameraFolder {
        keypoints: at(),
        depth: at(),
        cameras: at(),
        layout,
    }
    .read(shot.clip.poses.len(), 0.3)
    .unwrap();
    let clip = CameraClip {
        keypoints: read.keypoints,
        cameras: read.cameras,
        ..shot.clip.clone()
    };
    let from_files = global_trajectory(
        &clip,
        &mut read.depth,
        &BodyModel::embedded(),
        &options(&walk),
    )
    .unwrap();
    let from_memory = solve(&shot, &options(&walk)).unwrap();
    for (a, b) in from_files
        .motion
        .frames
        .iter()
        .zip(&from_memory.motion.frames)
    {
        // Disparities are rounded to float32 once more.
        assert!(
            (a.root_position - b.root_position).norm() < 1e-4,
            "{} {}",
            a.root_position,
            b.root_position
        );
    }
    let nothing = CameraFolder {
        keypoints: at(),
        depth: std::env::temp_dir().join("none such"),
        cameras: at(),
        layout,
    }
    .read(3, 0.3);
    assert!(
        nothing
            .unwrap_err()
            .to_string()
            .contains("none such: cannot read")
    );
}

/// Counts a damaged file as refused (by name) or taken; what was taken is sound.
fn count<T: std::fmt::Debug>(
    counts: &mut [usize; 2],
    read: Result<T, VideoError>,
    is_sound: impl Fn(&T) -> bool,
) {
    match read {
        Ok(content) => {
            assert!(is_sound(&content), "{content:?}");
            counts[1] += 1;
        }
        Err(error) => {
            assert!(error.to_string().starts_with("x"), "{error}");
            counts[0] += 1;
        }
    }
}

#[test]
fn damaged_files_are_refused_by_name_or_hold_sound_values() {
    let walk = embedded_walk().slice(2.0, Some(0.1)).unwrap();
    let shot = shot::shoot(&walk, &shot::NONE, 1.0, 1);
    let [mut of_depth, mut of_keypoints, mut of_camera] = [[0; 2]; 3];
    let depths = shot.depths[0].as_ref().unwrap().depths()[..1200].to_vec();
    let small = DepthMap::new(40, 30, depths).unwrap();
    common::damaged(&shot::disparity_file(&small), 500, |bytes| {
        let read = parse_depth(bytes, DepthEncoding::Disparity, "x");
        count(&mut of_depth, read, |map| {
            let sound = |depth: &f32| *depth >= 0.0 && depth.is_finite();
            map.depths().len() == map.width() * map.height() && map.depths().iter().all(sound)
        });
    });
    let people: Vec<_> = shot.clip.keypoints[0].into_iter().collect();
    common::damaged(shot::keypoint_file(&people).as_bytes(), 500, |bytes| {
        count(&mut of_keypoints, parse_openpose(bytes, "x"), |people| {
            people.iter().flatten().all(|point| {
                point.u.abs().max(point.v.abs()) < 1e6 && (0.0..=1.0).contains(&point.confidence)
            })
        });
    });
    let mut npz = NpzWriter::new(std::io::Cursor::new(Vec::new()));
    npz.floats("intrinsics", &[2], &[300.0, 300.0]).unwrap();
    let identity = nalgebra::Matrix4::<f64>::identity();
    npz.floats("extrinsics", &[4, 4], identity.as_slice())
        .unwrap();
    let size = nalgebra::Vector2::new(40.0, 30.0);
    let bytes = npz.finish().unwrap().into_inner();
    common::damaged(&bytes, 500, |bytes| {
        let read = parse_camera(bytes, size, CameraAxes::OpenGl, "x");
        count(&mut of_camera, read, |camera| {
            let position = camera.world_from_camera.translation.vector;
            camera.focal_px.min() > 0.0
                && camera.image_px == size
                && position.iter().all(|value| value.is_finite())
                && (camera.world_from_camera.rotation.norm() - 1.0).abs() < 1e-9
        });
    });
    println!("refused, taken: {of_depth:?} {of_keypoints:?} {of_camera:?}");
    for [refused, taken] in [of_depth, of_keypoints, of_camera] {
        assert!(refused > 50 && taken >= 5);
    }
}
