//! Bodies fitted to markers that were made from known motions.
#![allow(clippy::unwrap_used)]

mod common;

use std::time::Instant;

use common::quantile;
use cromosim_body::{BodyModel, JOINT_COUNT, ShapedBody};
use cromosim_motion::{MarkerClip, MarkerOptions, MarkerSet, SmplMotion, embedded_walk, fit_markers, place_markers};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn plug_in_gait() -> MarkerSet {
    MarkerSet::embedded().unwrap().remove(0)
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// Noise of 1 mm on each axis; 5 % of the points lost one by one, 5 % in bursts of up to half a second.
fn spoil(clip: &mut MarkerClip, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for point in clip.frames.iter_mut().flatten() {
        *point = point.map(|point| point + Vector3::from_fn(|_, _| normal(&mut rng) * 1e-3));
        if rng.random_bool(0.05) {
            *point = None;
        }
    }
    let longest = (0.5 * clip.rate_hz) as usize;
    let bursts = (0.05 * (clip.frames.len() * clip.labels.len()) as f64 / (0.5 * longest as f64)) as usize;
    for _ in 0..bursts {
        let (marker, start) = (rng.random_range(0..clip.labels.len()), rng.random_range(0..clip.frames.len()));
        for frame in clip.frames.iter_mut().skip(start).take(rng.random_range(1..longest)) {
            frame[marker] = None;
        }
    }
}

struct Outcome {
    median_mm: f64,
    high_mm: f64,
    worst: Vec<(String, f64)>,
    rotation_deg: f64,
    seconds_per_minute: f64,
}

fn compare(known: &SmplMotion, found: &SmplMotion, seconds: f64) -> Outcome {
    let body = BodyModel::embedded();
    let [theirs, ours] = [known, found].map(|motion| ShapedBody::new(body.clone(), &motion.betas).unwrap());
    let mut errors = vec![Vec::new(); JOINT_COUNT];
    let mut angles = Vec::new();
    for (a, b) in known.frames.iter().zip(&found.frames) {
        let (a_segments, b_segments) = (theirs.world_from_segments(a), ours.world_from_segments(b));
        for joint in 0..JOINT_COUNT {
            errors[joint].push(1000.0 * (a_segments[joint].translation.vector - b_segments[joint].translation.vector).norm());
            angles.push(a.local_rotations[joint].angle_to(&b.local_rotations[joint]).to_degrees());
        }
    }
    let mut worst: Vec<(String, f64)> = cromosim_body::Joint::ALL
        .iter()
        .map(|joint| (format!("{} {:.1}", joint.name(), quantile(&errors[joint.index()], 0.5)), quantile(&errors[joint.index()], 0.95)))
        .collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    let all = errors.concat();
    Outcome {
        median_mm: quantile(&all, 0.5),
        high_mm: quantile(&all, 0.95),
        worst,
        rotation_deg: quantile(&angles, 0.5),
        seconds_per_minute: seconds * 60.0 / known.duration_s(),
    }
}

fn check(name: &str, known: &SmplMotion, options: &MarkerOptions) {
    check_stuck(name, known, &plug_in_gait(), options);
}

fn check_stuck(name: &str, known: &SmplMotion, stuck: &MarkerSet, options: &MarkerOptions) {
    let body = BodyModel::embedded();
    let mut clip = place_markers(known, &body, stuck).unwrap();
    spoil(&mut clip, 5);
    let start = Instant::now();
    let (found, report) = fit_markers(&clip, &body, &plug_in_gait(), options).unwrap();
    let outcome = compare(known, &found, start.elapsed().as_secs_f64());
    println!(
        "{name}: joints {:.2} mm median, {:.2} mm 95 %, rotations {:.2} deg median; worst {:.1?}; {:.1} s per minute; {report}; betas {:.2?} for {:.2?}",
        outcome.median_mm,
        outcome.high_mm,
        outcome.rotation_deg,
        &outcome.worst[..5],
        outcome.seconds_per_minute,
        report.betas,
        known.betas
    );
    assert_eq!(found.frames.len(), known.frames.len());
    if std::env::var_os("FOLDER").is_some() {
        return;
    }
    if std::env::var_os("FOLDER").is_some() {
        return;
    }
    assert!(outcome.median_mm < 8.0 && outcome.high_mm < 8.0);
}

fn walk() -> SmplMotion {
    let betas = vec![1.2, -0.8, 0.6, 0.5, -0.7, 0.8, -0.3, 0.4, 0.2, -0.5];
    let mut walk = embedded_walk().resampled(120.0).unwrap();
    walk.betas = betas;
    walk
}

/// Recordings of the CMU database, retargeted: their motion, their shape.
#[test]
fn recordings_of_the_cmu_database() {
    let Some(folder) = common::shared_data(&std::env::var("FOLDER").unwrap_or("mocap_cmu".to_owned())) else { return };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "bvh"));
    files.sort();
    for path in files.iter().take(std::env::var("COUNT").map_or(100, |c| c.parse().unwrap())) {
        let motion = cromosim_motion::read_motion(path, &cromosim_motion::MotionOptions::default()).unwrap();
        let motion = motion.slice(0.0, Some(10.0)).unwrap();
        check(&format!("{} {:.1} s", motion.name, motion.duration_s()), &motion, &MarkerOptions::default());
        if std::env::var_os("FOLDER").is_some() {
            check(&format!("   held {:.1} s", motion.duration_s()), &motion, &MarkerOptions { fit_placement: false, ..Default::default() });
        }
    }
}

#[test]
fn the_walk_of_another_body() {
    check("walk", &walk(), &MarkerOptions::default());
    check("walk, placements held", &walk(), &MarkerOptions { fit_placement: false, ..Default::default() });
}

/// Markers stuck elsewhere than the set says: by 6 mm along each axis (standard deviation), and 2 mm higher or lower.
fn stuck_by_hand(seed: u64) -> MarkerSet {
    let (body, mut rng) = (BodyModel::embedded(), ChaCha8Rng::seed_from_u64(seed));
    let shaped = ShapedBody::new(body.clone(), &[]).unwrap();
    let mut yaml = "name: by_hand\ndescription: by hand\nheight_mm: 9.5\nmarkers:\n".to_owned();
    for marker in plug_in_gait().markers() {
        let place = shaped.site_in_model(&marker.site_on(&body, "plug_in_gait").unwrap()).unwrap();
        let site = body.nearest_site(place + Vector3::from_fn(|_, _| normal(&mut rng) * 6e-3)).unwrap();
        let ([a, b, c], height) = (site.barycentrics, 9.5 + 2.0 * normal(&mut rng));
        yaml += &format!("  {}: {{triangle: {}, barycentrics: [{a}, {b}, {c}], height_mm: {height}}}\n", marker.label, site.triangle);
    }
    MarkerSet::from_yaml(&yaml, "by hand").unwrap()
}

#[test]
fn markers_stuck_by_hand() {
    for fit_placement in [true, false] {
        let name = format!("stuck by hand, placements fitted: {fit_placement}");
        check_stuck(&name, &walk(), &stuck_by_hand(3), &MarkerOptions { fit_placement, ..Default::default() });
    }
}
