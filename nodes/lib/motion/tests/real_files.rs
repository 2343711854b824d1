//! The recordings of the CMU database, where they are on this machine.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use cromosim_motion::{MotionOptions, SmplMotion, parse_bvh, read_motion};
use nalgebra::UnitQuaternion;

#[test]
fn real_recordings_keep_their_bone_directions() {
    let Some(folder) = common::shared_data("mocap_cmu") else {
        return;
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "bvh"));
    files.sort();
    assert!(!files.is_empty());
    for path in files {
        let motion = read_motion(&path, &MotionOptions::default()).unwrap();
        let report = motion.report.clone().unwrap();
        let step = largest_step(&motion);
        println!(
            "{}: {} frames at {} Hz; {report}; bones {:?}; betas {:.2?}, lengths within {:.4} m, floor {:+.3} m, largest step {:.2} deg a frame ({})",
            path.file_name().unwrap().display(),
            motion.frames.len(),
            motion.rate_hz,
            report
                .bones
                .iter()
                .take(6)
                .map(|(name, deg)| format!("{name} {deg:.2}"))
                .collect::<Vec<_>>(),
            report.betas,
            report.bone_length_rms_m,
            report.floor_shift_m,
            step.0,
            step.1,
        );
        assert_eq!(
            (
                report.map.as_str(),
                report.up_axis.as_str(),
                report.unit_scale_m
            ),
            ("daz", "+y", 0.01)
        );
        assert!(report.bone_direction_median_deg < 1.0, "{report}");
        assert!(
            report
                .bones
                .iter()
                .all(|(_, median_deg)| *median_deg < 10.0),
            "{:?}",
            report.bones
        );
        assert_eq!(
            (motion.rate_hz, report.frames_left_out),
            (120.0, 8),
            "the T-pose and the blend from it are the first eight frames"
        );
        assert_turns_with_the_source(&path, &motion, report.frames_left_out);
        assert!(
            motion
                .frames
                .iter()
                .all(|pose| (0.3..1.6).contains(&pose.root_position.z))
        );
        assert_signs_continue(&motion);
    }
}

/// Largest turn of any joint from frame to frame, and where.
fn largest_step(motion: &SmplMotion) -> (f64, String) {
    let mut largest = (0.0, String::new());
    for (index, pair) in motion.frames.windows(2).enumerate() {
        for joint in cromosim_body::Joint::ALL {
            let angle = pair[0].local_rotations[joint.index()]
                .angle_to(&pair[1].local_rotations[joint.index()])
                .to_degrees();
            if angle > largest.0 {
                largest = (angle, format!("{joint}, frame {index}"));
            }
        }
    }
    largest
}

fn assert_signs_continue(motion: &SmplMotion) {
    for pair in motion.frames.windows(2) {
        for (before, after) in pair[0].local_rotations.iter().zip(&pair[1].local_rotations) {
            assert!(before.coords.dot(&after.coords) >= 0.0);
            assert!(after.coords.iter().all(|value| value.is_finite()));
        }
    }
}

/// In no frame does a joint of the body turn much faster than the fastest joint of the recording:
/// what flips was flipped by the recording.
fn assert_turns_with_the_source(path: &Path, motion: &SmplMotion, left_out: usize) {
    let clip = parse_bvh(&std::fs::read_to_string(path).unwrap(), "source").unwrap();
    let locals = |frame: usize| -> Vec<UnitQuaternion<f64>> {
        let world = clip.world_from_joints(frame);
        let own = clip.joints().iter().zip(&world);
        own.map(|(joint, frame)| {
            joint.parent.map_or(frame.rotation, |parent| {
                world[parent].rotation.inverse() * frame.rotation
            })
        })
        .collect()
    };
    for (index, pair) in motion.frames.windows(2).enumerate() {
        let largest = |before: &[UnitQuaternion<f64>], after: &[UnitQuaternion<f64>]| {
            before
                .iter()
                .zip(after)
                .map(|(a, b)| a.angle_to(b).to_degrees())
                .fold(0.0, f64::max)
        };
        let ours = largest(&pair[0].local_rotations, &pair[1].local_rotations);
        let theirs = largest(&locals(left_out + index), &locals(left_out + index + 1));
        assert!(
            ours < 1.2 * theirs + 0.5,
            "{}: frame {index} turns {ours} deg, the source {theirs}",
            path.display()
        );
    }
}
