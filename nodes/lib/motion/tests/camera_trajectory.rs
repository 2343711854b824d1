//! The global trajectory on shots that the test makes itself: the error before and after each step, and what must be achieved.
#![allow(clippy::unwrap_used)]

mod common;

use common::shot::{self, Errors, RATE_HZ, Shot};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::camera::{
    CameraError, DepthMap, GlobalTrajectory, Gravity, ScaleSource, Trajectory, TrajectoryOptions, confidence_of_std, global_trajectory,
    standing_height, std_of_confidence,
};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk, read_motion};
use nalgebra::{Isometry3, Vector3};

fn height(motion: &SmplMotion) -> f64 {
    standing_height(&ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap())
}

fn solve(shot: &Shot, options: &TrajectoryOptions) -> Result<GlobalTrajectory, CameraError> {
    let mut depths = |frame: usize| -> Result<Option<DepthMap>, CameraError> { Ok(shot.depths[frame].clone()) };
    global_trajectory(&shot.clip, &mut depths, &BodyModel::embedded(), options)
}

/// Error of a track against the truth: of its position (m) and of its second differences (m/s2), root mean square.
#[derive(Clone, Copy, Debug)]
struct TrackError {
    position: f64,
    acceleration: f64,
}

fn track_error(track: &[Option<Vector3<f64>>], truth: &[Vector3<f64>]) -> TrackError {
    let rms = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let error: Vec<Option<Vector3<f64>>> = track.iter().zip(truth).map(|(own, truth)| own.map(|own| own - truth)).collect();
    let second = |triple: &[Option<Vector3<f64>>]| Some(((triple[2]? - triple[1]? * 2.0 + triple[0]?) * RATE_HZ * RATE_HZ).norm_squared());
    TrackError {
        position: rms(error.iter().flatten().map(Vector3::norm_squared).collect()),
        acceleration: rms(error.windows(3).filter_map(second).collect()),
    }
}

/// The errors after each step, printed.
fn steps(name: &str, shot: &Shot, solved: &GlobalTrajectory) -> [TrackError; 5] {
    let in_source = |world: &Vector3<f64>| (shot.source_from_world * nalgebra::Point3::from(*world)).coords;
    let truth: Vec<Vector3<f64>> = shot.truth.iter().map(|pose| in_source(&pose.root_position)).collect();
    let track = solved.track.as_ref().unwrap();
    let scale = solved.report.scale.unwrap().metres_per_unit;
    let scaled: Vec<Option<Vector3<f64>>> = track.measured.iter().map(|m| m.map(|m| m.position)).collect();
    // Before the scale, in the reconstruction's unit taken as metres.
    let raw: Vec<Option<Vector3<f64>>> = scaled.iter().map(|position| position.map(|position| position / scale)).collect();
    let gated = scaled.iter().zip(&track.accepted).map(|(position, used)| position.filter(|_| *used)).collect::<Vec<_>>();
    let filtered: Vec<_> = track.filtered.iter().map(|state| Some(state.position)).collect();
    let smoothed: Vec<_> = track.smoothed.iter().map(|state| Some(state.position)).collect();
    let errors = [&raw, &scaled, &gated, &filtered, &smoothed].map(|track| track_error(track, &truth));
    println!("{name}: {}", solved.report);
    println!(
        "  joints of the estimator: {:.0} mm off, {:.0} mm without the root's turn",
        1e3 * shot.pose_error_m[0],
        1e3 * shot.pose_error_m[1]
    );
    for (step, error) in ["raw", "scaled", "gated", "filtered", "smoothed"].iter().zip(&errors) {
        println!("  {step:9} position {:.3} m, acceleration {:6.2} m/s2", error.position, error.acceleration);
    }
    errors
}

fn options(motion: &SmplMotion) -> TrajectoryOptions {
    TrajectoryOptions::new(ScaleSource::BodyHeight(height(motion)))
}

/// Rigid motion that lays one track over another: best rotation about z and translation, least squares.
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
    let own: Vec<_> = solved.motion.frames.iter().map(|pose| pose.root_position).collect();
    let aligned = upright_alignment(&own, &truth);
    let laid: Vec<_> = own.iter().map(|p| Some((aligned * nalgebra::Point3::from(*p)).coords)).collect();
    let whole = track_error(&laid, &truth);
    let inside = solved
        .states
        .iter()
        .zip(&laid)
        .zip(&truth)
        .filter(|((state, own), truth)| (own.unwrap() - *truth).norm() < 2.8 * (state.position_covariance.trace() / 3.0).sqrt());
    let inside = inside.count() as f64 / truth.len() as f64;
    println!(
        "  scale off by {:+.2} %, up by {tilt:.2} deg, after yaw and place: {:.3} m; {:.0} % within 2.8 std",
        100.0 * off,
        whole.position,
        100.0 * inside
    );
    assert!(off.abs() < 0.02, "{name}: scale off by {off}");
    assert!(smoothed.acceleration * 5.0 < raw.acceleration && smoothed.acceleration * 5.0 < scaled.acceleration, "{name}: fivefold");
    assert!(smoothed.position < scaled.position && scaled.position < raw.position, "{name}");
    assert!(tilt < 5.0, "{name}: {tilt} deg");
    assert!(inside > 0.8, "{name}: the covariance is too small: {inside}");
}

/// The motion's up in the world of the result.
fn solved_up(shot: &Shot, solved: &GlobalTrajectory) -> Vector3<f64> {
    solved.world_from_source.rotation * (shot.source_from_world.rotation * Vector3::z())
}

#[test]
fn the_walk_is_found_again_through_published_errors() {
    for seed in 1..=3 {
        check_published(&format!("embedded walk, seed {seed}"), &embedded_walk(), seed);
    }
}

#[test]
fn recorded_motions_are_found_again_through_published_errors() {
    let Some(folder) = common::shared_data("mocap_cmu") else { return };
    for name in ["07_01.bvh", "02_01.bvh", "06_10.bvh"] {
        let motion = read_motion(&folder.join(name), &MotionOptions::default()).unwrap();
        check_published(name, &motion, 7);
    }
}

#[test]
fn without_errors_the_root_comes_back() {
    let walk = embedded_walk().slice(2.0, Some(3.0)).unwrap();
    let shot = shot::shoot(&walk, &shot::NONE, 1.0, 1);
    let given = TrajectoryOptions { scale: ScaleSource::Given(1.0), ..options(&walk) };
    let [raw, .., smoothed] = steps("no errors", &shot, &solve(&shot, &given).unwrap());
    // What is left is the skin: arms before the hips, thighs that move it.
    assert!(raw.position < 0.05 && smoothed.position < 0.05, "{raw:?} {smoothed:?}");
    let by_height = solve(&shot, &options(&walk)).unwrap().report.scale.unwrap();
    println!("scale by height without errors: {by_height:?}");
    assert!((by_height.metres_per_unit - 1.0).abs() < 0.01);
}

#[test]
fn the_pose_stands_in_the_world_and_in_place_where_asked() {
    let walk = embedded_walk().slice(2.0, Some(3.0)).unwrap();
    let errors = Errors { pose_slow_deg: 0.0, pose_white_deg: 0.0, camera_deg: 0.0, ..shot::PUBLISHED };
    let shot = shot::shoot(&walk, &errors, 0.6, 3);
    let up = shot.source_from_world.rotation * Vector3::z();
    let given = TrajectoryOptions { gravity: Gravity::Given(up * 3.0), ..options(&walk) };
    let solved = solve(&shot, &given).unwrap();
    let lite = solve(&shot, &TrajectoryOptions { trajectory: Trajectory::None, ..given }).unwrap();
    assert!(solved_up(&shot, &solved).angle(&Vector3::z()) < 1e-9);
    // Orientations against the truth differ by one yaw only.
    for motion in [&solved.motion, &lite.motion] {
        let yaw = motion.frames[0].local_rotations[0] * shot.truth[0].local_rotations[0].inverse();
        assert!(yaw.axis().is_none_or(|axis| axis.z.abs() > 1.0 - 1e-6));
        for (own, truth) in motion.frames.iter().zip(&shot.truth) {
            assert!((yaw * truth.local_rotations[0]).angle_to(&own.local_rotations[0]) < 1e-6);
            assert!(own.local_rotations[5].angle_to(&truth.local_rotations[5]) < 1e-9);
        }
    }
    let first = lite.motion.frames[0].root_position;
    assert!(lite.motion.frames.iter().all(|pose| pose.root_position == first) && first.xy().norm() == 0.0);
    assert!((first.z - shot.truth[0].root_position.z).abs() < 0.03, "stands on the floor: {}", first.z);
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
    let message = |shot: &Shot, options: &TrajectoryOptions| solve(shot, options).unwrap_err().to_string();
    assert!(message(&shot, &TrajectoryOptions::new(ScaleSource::Given(-1.0))).contains("scale is -1"));
    assert!(message(&shot, &TrajectoryOptions::new(ScaleSource::Object(Vec::new()))).contains("no scale"));
    let down = TrajectoryOptions { gravity: Gravity::Given(Vector3::zeros()), ..options(&walk) };
    assert!(message(&shot, &down).contains("no up direction"));
    shot.depths.iter_mut().skip(5).for_each(|map| *map = None);
    assert!(message(&shot, &options(&walk)).contains("5 of 31 frames"), "{}", message(&shot, &options(&walk)));
    shot.clip.cameras.pop();
    assert!(message(&shot, &options(&walk)).contains("cameras of 30 frames, but poses of 31"));
}

#[test]
fn zz_diag() {
    let folder = common::shared_data("mocap_cmu").unwrap();
    let p = shot::PUBLISHED;
    for (name, motion) in [
        ("walk", embedded_walk()),
        ("07_01", read_motion(&folder.join("07_01.bvh"), &MotionOptions::default()).unwrap()),
        ("06_10", read_motion(&folder.join("06_10.bvh"), &MotionOptions::default()).unwrap()),
    ] {
        for (what, errors) in [
            ("none", Errors { dropout: 0.1, ..shot::NONE }),
            ("all", p),
            ("pose only", Errors { keypoint_px: 0.0, depth_scale: 0.0, keypoint_offset_m: 0.0, depth_flicker: 0.0, depth_pixel: 0.0, ..p }),
        ] {
            let mut line = String::new();
            for seed in 1..=6 {
                let shot = shot::shoot(&motion, &errors, 0.6, seed);
                let solved = solve(&shot, &options(&motion)).unwrap();
                let sc = solved.report.scale.unwrap();
                let tilt = solved_up(&shot, &solved).angle(&Vector3::z()).to_degrees();
                let noise = solved.report.noise.unwrap();
                line += &format!(
                    " {:+.1}({:.1}) t{tilt:.1} jv{:.0};",
                    100.0 * (sc.metres_per_unit * 0.6 - 1.0),
                    100.0 * sc.relative_std,
                    noise.vertical_jerk
                );
            }
            println!("{name} {what}:{line}");
        }
    }
}
