//! Bodies fitted to markers that were made from known motions, with 1 mm noise and a tenth of the
//! points lost.
#![allow(clippy::unwrap_used)]

mod common;

use std::time::Instant;

use common::quantile;
use cromosim_body::{BodyModel, JOINT_COUNT, Joint, ShapedBody};
use cromosim_motion::{
    MarkerClip, MarkerOptions, MarkerReport, MarkerSet, MotionOptions, SmplMotion, embedded_walk,
    fit_markers, place_markers, read_motion,
};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn plug_in_gait() -> MarkerSet {
    MarkerSet::embedded().unwrap().remove(0)
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// Noise of 1 mm on each axis; 5 % of the points lost one by one, 5 % in bursts of up to half a
/// second.
fn spoil(clip: &mut MarkerClip, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for point in clip.frames.iter_mut().flatten() {
        *point = point.map(|point| point + Vector3::from_fn(|_, _| normal(&mut rng) * 1e-3));
        if rng.random_bool(0.05) {
            *point = None;
        }
    }
    let longest = (0.5 * clip.rate_hz) as usize;
    let bursts =
        (0.05 * (clip.frames.len() * clip.labels.len()) as f64 / (0.5 * longest as f64)) as usize;
    for _ in 0..bursts {
        let (marker, start) = (
            rng.random_range(0..clip.labels.len()),
            rng.random_range(0..clip.frames.len()),
        );
        for frame in clip
            .frames
            .iter_mut()
            .skip(start)
            .take(rng.random_range(1..longest))
        {
            frame[marker] = None;
        }
    }
}

/// Of each joint, mm, by frame.
fn joint_errors(known: &SmplMotion, found: &SmplMotion) -> Vec<Vec<f64>> {
    let body = BodyModel::embedded();
    let [theirs, ours] =
        [known, found].map(|motion| ShapedBody::new(body.clone(), &motion.betas).unwrap());
    let mut errors = vec![Vec::new(); JOINT_COUNT];
    for (a, b) in known.frames.iter().zip(&found.frames) {
        let (a, b) = (theirs.world_from_segments(a), ours.world_from_segments(b));
        for joint in 0..JOINT_COUNT {
            errors[joint]
                .push(1000.0 * (a[joint].translation.vector - b[joint].translation.vector).norm());
        }
    }
    errors
}

struct Outcome {
    median_mm: f64,
    high_mm: f64,
    report: MarkerReport,
}

/// Fits to the spoilt markers of a known motion, stuck where `stuck` says, and prints what was
/// measured.
fn fitted(name: &str, known: &SmplMotion, stuck: &MarkerSet, fit_placement: bool) -> Outcome {
    let body = BodyModel::embedded();
    let mut clip = place_markers(known, &body, stuck).unwrap();
    spoil(&mut clip, 5);
    let start = Instant::now();
    let options = MarkerOptions {
        fit_placement,
        ..Default::default()
    };
    let (found, report) = fit_markers(&clip, &body, &plug_in_gait(), &options).unwrap();
    let minute_s = start.elapsed().as_secs_f64() * 60.0 / known.duration_s();
    assert_eq!(found.frames.len(), known.frames.len());
    let errors = joint_errors(known, &found);
    let angle = |(a, b): (&cromosim_body::BodyPose, &cromosim_body::BodyPose)| {
        Joint::ALL.map(|joint| {
            a.local_rotations[joint.index()]
                .angle_to(&b.local_rotations[joint.index()])
                .to_degrees()
        })
    };
    let angles: Vec<f64> = known
        .frames
        .iter()
        .zip(&found.frames)
        .flat_map(angle)
        .collect();
    let of_joint = |joint: Joint| {
        (
            joint.name(),
            quantile(&errors[joint.index()], 0.5),
            quantile(&errors[joint.index()], 0.95),
        )
    };
    let mut joints = Joint::ALL.map(of_joint);
    joints.sort_by(|a, b| b.2.total_cmp(&a.2));
    let all = errors.concat();
    let outcome = Outcome {
        median_mm: quantile(&all, 0.5),
        high_mm: quantile(&all, 0.95),
        report,
    };
    println!(
        "{name}: joints {:.2} mm median, {:.2} mm 95 %; rotations {:.2} deg median; worst joints (median, 95 %, mm) {:.1?}; {minute_s:.1} s per minute; {}; betas {:.2?} for {:.2?}",
        outcome.median_mm,
        outcome.high_mm,
        quantile(&angles, 0.5),
        &joints[..4],
        outcome.report,
        outcome.report.betas,
        known.betas
    );
    outcome
}

/// The embedded walk at 120 Hz in a body far from the mean, with which the fit begins.
fn walk() -> SmplMotion {
    let mut walk = embedded_walk().resampled(120.0).unwrap();
    walk.betas = vec![1.2, -0.8, 0.6, 0.5, -0.7, 0.8, -0.3, 0.4, 0.2, -0.5];
    walk
}

#[test]
fn the_walk_of_another_body() {
    for fit_placement in [true, false] {
        let outcome = fitted(
            &format!("walk, placements fitted: {fit_placement}"),
            &walk(),
            &plug_in_gait(),
            fit_placement,
        );
        assert!(outcome.median_mm < 3.0 && outcome.high_mm < 8.0);
        let report = &outcome.report;
        // Noise alone is 1.7 mm in three dimensions, less what the fit follows.
        assert!(
            (0.0013..0.0020).contains(&report.rms_m)
                && report.markers.iter().all(|marker| marker.rms_m < 0.003),
            "{report}"
        );
        assert!((0.07..0.13).contains(&report.missing_share));
        assert_eq!(
            (
                report.keyframes.len(),
                report.absent.len(),
                report.up_axis.as_str()
            ),
            (12, 0, "+z")
        );
        assert!(
            report
                .joint_sigma_m
                .iter()
                .all(|(_, sigma)| (1e-4..0.02).contains(sigma)),
            "{:?}",
            report.joint_sigma_m
        );
        assert_eq!(
            report.markers.iter().any(|marker| marker.moved_m > 0.0),
            fit_placement
        );
    }
}

/// What frames promise each other depends on the time between them.
#[test]
fn other_rates() {
    for rate_hz in [30.0, 60.0, 250.0] {
        let known = walk()
            .slice(1.0, Some(4.0))
            .unwrap()
            .resampled(rate_hz)
            .unwrap();
        let outcome = fitted(
            &format!("walk at {rate_hz} Hz"),
            &known,
            &plug_in_gait(),
            true,
        );
        assert!(outcome.median_mm < 3.0 && outcome.high_mm < 8.0);
    }
}

/// Recordings of the CMU database, retargeted: their motion, their shape.
#[test]
fn recordings_of_the_cmu_database() {
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
        let motion = read_motion(
            &path,
            &MotionOptions {
                duration_s: Some(10.0),
                ..Default::default()
            },
        )
        .unwrap();
        let name = path.file_name().unwrap().display().to_string();
        let outcome = fitted(&name, &motion, &plug_in_gait(), true);
        assert!(outcome.median_mm < 3.0 && outcome.high_mm < 8.0, "{name}");
    }
}

/// Markers stuck elsewhere than the set says: by 6 mm along each axis (standard deviation), and 2
/// mm higher or lower.
fn stuck_by_hand(seed: u64) -> MarkerSet {
    let (body, mut rng) = (BodyModel::embedded(), ChaCha8Rng::seed_from_u64(seed));
    let shaped = ShapedBody::new(body.clone(), &[]).unwrap();
    let mut yaml = "name: by_hand\ndescription: by hand\nheight_mm: 9.5\nmarkers:\n".to_owned();
    for marker in plug_in_gait().markers() {
        let place = shaped
            .site_in_model(&marker.site_on(&body, "plug_in_gait").unwrap())
            .unwrap();
        let site = body
            .nearest_site(place + Vector3::from_fn(|_, _| normal(&mut rng) * 6e-3))
            .unwrap();
        let ([a, b, c], height) = (site.barycentrics, 9.5 + 2.0 * normal(&mut rng));
        yaml += &format!(
            "  {}: {{triangle: {}, barycentrics: [{a}, {b}, {c}], height_mm: {height}}}\n",
            marker.label, site.triangle
        );
    }
    MarkerSet::from_yaml(&yaml, "by hand").unwrap()
}

/// What markers cannot tell: where they are stuck. Fitting it helps, and leaves more than noise
/// does.
#[test]
fn markers_stuck_by_hand() {
    let [fitted, given] = [true, false].map(|fit_placement| {
        fitted(
            &format!("stuck by hand, placements fitted: {fit_placement}"),
            &walk(),
            &stuck_by_hand(3),
            fit_placement,
        )
    });
    assert!(fitted.median_mm < 8.0 && fitted.high_mm < 16.0);
    assert!(fitted.high_mm < 0.9 * given.high_mm && fitted.report.rms_m < 0.5 * given.report.rms_m);
}

/// Half a second in which a whole forearm is hidden, and a quarter of a second without any marker:
/// the body goes on, and comes back.
#[test]
fn gaps_are_bridged() {
    let (body, known) = (BodyModel::embedded(), walk().slice(2.0, Some(3.0)).unwrap());
    let mut clip = place_markers(&known, &body, &plug_in_gait()).unwrap();
    let forearm: Vec<usize> = (0..39)
        .filter(|&marker| {
            ["LELB", "LFRM", "LWRA", "LWRB", "LFIN"].contains(&clip.labels[marker].as_str())
        })
        .collect();
    clip.frames[60..120]
        .iter_mut()
        .for_each(|frame| forearm.iter().for_each(|&marker| frame[marker] = None));
    clip.frames[250..280]
        .iter_mut()
        .flatten()
        .for_each(|point| *point = None);
    let (found, _) = fit_markers(&clip, &body, &plug_in_gait(), &MarkerOptions::default()).unwrap();
    let errors = joint_errors(&known, &found);
    let worst = |frames: std::ops::Range<usize>| {
        errors
            .iter()
            .flat_map(|of_joint| &of_joint[frames.clone()])
            .fold(0.0, |a, &b| f64::max(a, b))
    };
    let (forearm, seen) = (worst(60..120), worst(130..240).max(worst(290..360)));
    let (root, all) = (
        errors[0][250..280].iter().fold(0.0, |a, &b| f64::max(a, b)),
        worst(250..280),
    );
    println!(
        "largest error, mm: forearm hidden {forearm:.0}, all hidden {all:.0} (pelvis {root:.0}), all seen {seen:.1}"
    );
    // A quarter of a second is half the swing of a leg, which nothing between its ends tells.
    assert!(forearm < 60.0 && root < 50.0 && all < 300.0 && seen < 15.0);
    assert!(
        found.confidence.unwrap()[250..280]
            .iter()
            .all(|share| *share == 0.0)
    );
}

/// The same markers give the same bits on one thread and on three.
#[test]
fn threads_do_not_matter() {
    let (body, known) = (BodyModel::embedded(), walk().slice(0.0, Some(5.0)).unwrap());
    let mut clip = place_markers(&known, &body, &plug_in_gait()).unwrap();
    spoil(&mut clip, 8);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            fit_markers(&clip, &body, &plug_in_gait(), &MarkerOptions::default())
                .unwrap()
                .0
        })
    };
    let (one, three) = (on(1), on(3));
    assert!(one.frames == three.frames && one.betas == three.betas);
}

/// Markers that are no body: an error or a finite motion, never a panic.
#[test]
fn absurd_markers_never_panic() {
    let body = BodyModel::embedded();
    let known = walk().slice(0.0, Some(0.2)).unwrap();
    let whole = place_markers(&known, &body, &plug_in_gait()).unwrap();
    let (mut rng, mut read, mut refused) = (ChaCha8Rng::seed_from_u64(3), 0, 0);
    for round in 0..40 {
        let mut clip = whole.clone();
        let (lost, odd) = (rng.random_range(0.0..1.0), rng.random_range(0.0..0.5));
        for point in clip.frames.iter_mut().flatten() {
            let place = Point3::from(Vector3::from_fn(|_, _| {
                [0.0, 1e8, -1e8, 0.3][rng.random_range(0..4)]
            }));
            *point = match round % 4 {
                0 => point.filter(|_| !rng.random_bool(lost)),
                1 => point.map(|point| if rng.random_bool(odd) { place } else { point }),
                2 => Some(place),
                _ => Some(Point3::new(
                    0.3,
                    0.3,
                    if rng.random_bool(0.5) { 1.0 } else { 1.5 },
                )),
            };
        }
        match fit_markers(&clip, &body, &plug_in_gait(), &MarkerOptions::default()) {
            Ok((motion, report)) => {
                read += 1;
                assert!(
                    motion
                        .frames
                        .iter()
                        .all(|pose| pose.root_position.norm().is_finite())
                        && report.rms_m.is_finite()
                );
            }
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().contains('\n'));
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > 0 && refused > 0);
    let empty = MarkerClip {
        frames: Vec::new(),
        ..whole
    };
    assert!(fit_markers(&empty, &body, &plug_in_gait(), &MarkerOptions::default()).is_err());
}
