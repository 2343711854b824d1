//! The embedded walk is a motion one would show, and one that a sensor believes.
#![allow(clippy::unwrap_used)]

mod common;

use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_motion::{SmplMotion, embedded_walk};
use nalgebra::Vector3;

fn body() -> ShapedBody {
    ShapedBody::new(BodyModel::embedded(), &embedded_walk().betas).unwrap()
}

/// Positions of a joint, m.
fn track(motion: &SmplMotion, body: &ShapedBody, joint: Joint) -> Vec<Vector3<f64>> {
    motion
        .frames
        .iter()
        .map(|pose| {
            body.world_from_segments(pose)[joint.index()]
                .translation
                .vector
        })
        .collect()
}

fn accelerations(positions: &[Vector3<f64>], rate_hz: f64) -> Vec<f64> {
    positions
        .windows(3)
        .map(|p| (p[2] - 2.0 * p[1] + p[0]).norm() * rate_hz * rate_hz)
        .collect()
}

/// Every material point of the soles, as long as it is on the floor, stays where it is.
#[test]
fn stance_feet_do_not_slip_or_sink() {
    let (motion, body) = (embedded_walk(), body());
    let lowest = body
        .rest_vertices()
        .iter()
        .map(|vertex| vertex.y)
        .fold(f64::MAX, f64::min);
    let soles: Vec<u32> = (0..body.rest_vertices().len() as u32)
        .filter(|&v| body.rest_vertices()[v as usize].y < lowest + 0.01)
        .collect();
    let subset = body.subset(&soles).unwrap();
    let mut landed: Vec<Option<Vector3<f64>>> = vec![None; soles.len()];
    let (mut slip, mut sink, mut contact): (f64, f64, usize) = (0.0, 0.0, 0);
    for pose in &motion.frames {
        let positions = subset.positions(pose);
        for (position, landed) in positions.iter().zip(&mut landed) {
            sink = sink.max(-position.z);
            if position.z > 0.002 {
                *landed = None;
                continue;
            }
            let start = *landed.get_or_insert(*position);
            slip = slip.max((position - start).xy().norm());
        }
        // While the heel rises, the skin under the toes is drawn up by 2 to 3 mm.
        contact += usize::from(positions.iter().any(|position| position.z < 0.003));
    }
    println!(
        "slip {:.2} mm, sink {:.2} mm, {} of {} frames in contact",
        slip * 1e3,
        sink * 1e3,
        contact,
        motion.frames.len()
    );
    assert!(slip < 0.01, "a point of the sole slips {slip} m");
    assert!(sink < 0.006, "a sole sinks {sink} m into the floor");
    assert_eq!(
        contact,
        motion.frames.len(),
        "a walk never leaves the floor"
    );
}

#[test]
fn joints_bend_as_joints_do() {
    let (motion, body) = (embedded_walk(), body());
    for joint in [Joint::LeftKnee, Joint::RightKnee] {
        let bends: Vec<f64> = motion
            .frames
            .iter()
            .map(|pose| {
                pose.local_rotations[joint.index()]
                    .scaled_axis()
                    .x
                    .to_degrees()
            })
            .collect();
        let (least, most) = (common::quantile(&bends, 0.0), common::quantile(&bends, 1.0));
        println!(
            "{joint}: {least:.1} to {most:.1} deg, at 0 s {:.1}",
            bends[0]
        );
        assert!(
            least > 1.0,
            "{joint} is stretched to {least} deg: the leg does not reach its foot"
        );
        assert!((45.0..80.0).contains(&most), "{joint} bends {most} deg");
    }
    for joint in [Joint::LeftAnkle, Joint::RightAnkle] {
        let most = motion
            .frames
            .iter()
            .map(|pose| pose.local_rotations[joint.index()].angle().to_degrees())
            .fold(0.0, f64::max);
        println!("{joint}: up to {most:.1} deg");
        assert!(most < 45.0);
    }
    for joint in Joint::ALL {
        let step = |pair: &[cromosim_body::BodyPose]| {
            let angle = pair[0].local_rotations[joint.index()]
                .angle_to(&pair[1].local_rotations[joint.index()]);
            angle.to_degrees() * motion.rate_hz
        };
        let fastest = motion.frames.windows(2).map(step).fold(0.0, f64::max);
        println!("{joint}: {fastest:.0} deg/s");
        assert!(fastest < 550.0, "{joint} turns {fastest} deg/s");
    }
    let head = motion
        .frames
        .iter()
        .map(|pose| pose.world_rotations()[Joint::Head.index()] * Vector3::y());
    let tilt = head
        .map(|up| up.z.clamp(-1.0, 1.0).acos().to_degrees())
        .fold(0.0, f64::max);
    assert!(tilt < 12.0, "the head tilts {tilt} deg");
    let _ = body;
}

#[test]
fn wrists_feel_what_wrists_feel() {
    let (motion, body) = (embedded_walk(), body());
    for joint in [
        Joint::LeftWrist,
        Joint::RightWrist,
        Joint::Pelvis,
        Joint::Head,
        Joint::LeftAnkle,
    ] {
        let accelerations = accelerations(&track(&motion, &body, joint), motion.rate_hz);
        let peak = common::quantile(&accelerations, 1.0);
        let walking = &accelerations[150..450];
        let rms = (walking.iter().map(|a| a * a).sum::<f64>() / walking.len() as f64).sqrt();
        println!("{joint}: peak {peak:.1} m/s2, rms while walking {rms:.1}");
        if matches!(joint, Joint::LeftWrist | Joint::RightWrist) {
            assert!((5.0..20.0).contains(&peak), "{joint}: peak {peak} m/s2");
        }
        if matches!(joint, Joint::Pelvis | Joint::Head) {
            assert!((1.0..9.0).contains(&peak), "{joint}: peak {peak} m/s2");
        }
    }
}

/// The steepest changes are the knees', a few hundredths of a second after toe-off.
#[test]
fn accelerations_change_gradually() {
    let (motion, body) = (embedded_walk(), body());
    for joint in Joint::ALL {
        let positions = track(&motion, &body, joint);
        let acceleration: Vec<Vector3<f64>> = positions
            .windows(3)
            .map(|p| (p[2] - 2.0 * p[1] + p[0]) * motion.rate_hz * motion.rate_hz)
            .collect();
        let jump = acceleration
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).norm())
            .fold(0.0, f64::max);
        println!("{joint}: acceleration changes by at most {jump:.2} m/s2 a frame");
        assert!(jump < 18.0, "{joint}: {jump} m/s2 from frame to frame");
    }
}

#[test]
fn it_walks_reaches_and_turns() {
    let (motion, body) = (embedded_walk(), body());
    assert_eq!(
        (motion.duration_s(), motion.rate_hz, motion.betas.len()),
        (10.0, 100.0, 10)
    );
    let pelvis = track(&motion, &body, Joint::Pelvis);
    let way = pelvis[1000] - pelvis[0];
    let speed = (pelvis[400].x - pelvis[200].x) / 2.0;
    println!(
        "way {way:.3}, steady speed {speed:.3} m/s, height {:.3} to {:.3}",
        lowest(&pelvis),
        -lowest(&pelvis.iter().map(|p| -p).collect::<Vec<_>>())
    );
    assert!((speed - 0.65 * 1.8).abs() < 0.03, "{speed} m/s");
    assert!(way.x > 4.5 && way.y.abs() < 0.1);
    let wrist = track(&motion, &body, Joint::RightWrist);
    let reach = wrist[680] - pelvis[680];
    println!("reach {reach:.3}");
    assert!(
        reach.x > 0.45 && reach.z > 0.3,
        "the arm reaches out: {reach}"
    );
    let forward = |frame: usize| motion.frames[frame].local_rotations[0] * Vector3::z();
    assert!(
        forward(0).x > 0.99 && forward(1000).y > 0.98,
        "it turns left: {}",
        forward(1000)
    );
    let swing = track(&motion, &body, Joint::LeftWrist)
        .iter()
        .zip(&pelvis)
        .map(|(wrist, pelvis)| wrist.x - pelvis.x)
        .collect::<Vec<_>>();
    let (back, front) = (
        common::quantile(&swing[200..450], 0.0),
        common::quantile(&swing[200..450], 1.0),
    );
    println!("left wrist swings from {back:.2} to {front:.2} m");
    assert!(front - back > 0.25);
}

fn lowest(positions: &[Vector3<f64>]) -> f64 {
    positions
        .iter()
        .map(|position| position.z)
        .fold(f64::MAX, f64::min)
}

#[test]
fn it_is_the_same_every_time() {
    assert_eq!(embedded_walk().frames, embedded_walk().frames);
}
