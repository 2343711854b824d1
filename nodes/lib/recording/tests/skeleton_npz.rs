//! Skeleton clips as npz against the BVH files they were made from.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::File;

use common::shared_data;
use cromosim_body::BodyModel;
use cromosim_motion::{MotionOptions, parse_bvh, retarget};
use cromosim_recording::datasets::parse_skeleton_npz;

#[test]
fn a_clip_is_the_bvh_it_was_made_from() {
    let Some(folder) = shared_data("mocap_cmu") else {
        return;
    };
    for name in ["02_01", "13_36"] {
        let npz = parse_skeleton_npz(
            File::open(folder.join(format!("{name}.npz"))).unwrap(),
            name,
        )
        .unwrap();
        let bvh = parse_bvh(
            &std::fs::read_to_string(folder.join(format!("{name}.bvh"))).unwrap(),
            name,
        )
        .unwrap();
        let left_out = bvh.frame_count() - npz.clip.frame_count();
        for frame in (0..npz.clip.frame_count()).step_by(17) {
            let own = npz.clip.world_from_joints(frame);
            let theirs = bvh.world_from_joints(frame + left_out);
            for (joint, place) in npz.clip.joints().iter().zip(&own) {
                let Some(index) = bvh
                    .joints()
                    .iter()
                    .position(|other| other.name == joint.name)
                else {
                    panic!("{}", joint.name)
                };
                let away =
                    (theirs[index].translation.vector * 0.01 - place.translation.vector).norm();
                assert!(away < 1e-4, "{name}, frame {frame}, {}: {away}", joint.name);
            }
        }
    }
}

#[test]
fn labels_name_frames_and_the_clip_can_be_retargeted() {
    let Some(folder) = shared_data("mocap_cmu_har") else {
        return;
    };
    let labelled =
        parse_skeleton_npz(File::open(folder.join("14_30.npz")).unwrap(), "14_30").unwrap();
    assert_eq!(
        (
            labelled.subject.as_str(),
            labelled.atypical.as_str(),
            labelled.labels.len()
        ),
        ("14", "", labelled.clip.frame_count())
    );
    let seconds = |label: &str| {
        labelled
            .labels
            .iter()
            .flatten()
            .filter(|name| *name == label)
            .count() as f64
            / 120.0
    };
    assert!((seconds("SEATED") - 9.9).abs() < 0.06 && (seconds("TURNING") - 4.4).abs() < 0.06);
    let motion = retarget(
        &labelled.clip,
        &BodyModel::embedded(),
        &MotionOptions {
            keep_lead_in: true,
            ..MotionOptions::default()
        },
    )
    .unwrap();
    assert_eq!(motion.frames.len(), labelled.labels.len());
    let flips = parse_skeleton_npz(File::open(folder.join("03_02.npz")).unwrap(), "03_02")
        .unwrap()
        .suspect;
    assert!(flips.len() > 100 && flips.contains(&true) && flips.contains(&false));
    let report = motion.report.unwrap();
    assert!(report.bone_direction_median_deg < 1.0, "{report}");
}

/// What nobody can do is refused, so no real clip may look so.
#[test]
fn no_real_clip_is_beyond_what_people_can_do() {
    let Some(folder) = shared_data("mocap_cmu_har") else {
        return;
    };
    let body = BodyModel::embedded();
    let options = MotionOptions {
        keep_lead_in: true,
        ..MotionOptions::default()
    };
    let others = folder.parent().unwrap().join("mocap_cmu");
    let files = [folder, others].map(|folder| std::fs::read_dir(folder).unwrap());
    let (mut clips, mut odd) = (0, Vec::new());
    for entry in files.into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "npz") {
            continue;
        }
        let name = path.display().to_string();
        let labelled = parse_skeleton_npz(File::open(&path).unwrap(), &name).unwrap();
        clips += 1;
        for oddity in retarget(&labelled.clip, &body, &options)
            .unwrap()
            .oddities()
        {
            assert!(!oddity.is_impossible(), "{name}: {oddity}");
            odd.push(format!("{name}: {oddity}"));
        }
    }
    println!("{clips} clips, {} warnings: {odd:#?}", odd.len());
    assert!(clips >= 50 && odd.len() <= 5, "{clips}: {odd:#?}");
}
