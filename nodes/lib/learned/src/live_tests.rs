//! Live networks: what they correct, and when.
#![allow(clippy::unwrap_used)]
use cromosim_body::BodyModel;
use cromosim_imu::{MountedSensors, PlacementSet, StreamOptions, StreamingImu};
use cromosim_spatial::uniform_stamps;

use super::*;
use crate::{Direction, Network, NetworkShape, SiteMotion};

const STATES_HZ: f64 = 120.0;
const GAP: f64 = 0.5;

fn simulator(direction: Direction) -> Result<LearnedSimulator, LearnedError> {
    let shape = NetworkShape {
        inputs: 36,
        channels: 8,
        kernel: 5,
        convolutions: 3,
        hidden: 8,
        layers: 2,
        direction,
        outputs: 3,
    };
    LearnedSimulator::new(
        Input::Streaming,
        [Network::new(shape.clone(), 1)?, Network::new(shape, 2)?],
    )
}

fn pose(stamp: &Stamp) -> BodyPose {
    let t = stamp.as_seconds();
    let mut turns = [Vector3::zeros(); 24];
    turns[18] = Vector3::new(0.0, (5.0 * t).sin(), 0.3 * t);
    turns[2] = Vector3::new(0.4 * (3.0 * t).cos(), 0.0, 0.0);
    BodyPose::from_axis_angles(Vector3::new(t, 0.0, 1.0), &turns)
}

fn stamps(from: f64, to: f64) -> Vec<Stamp> {
    uniform_stamps(
        Stamp::from_seconds(from),
        Stamp::from_seconds(to),
        STATES_HZ,
    )
    .unwrap()
}

/// What comes out of placements together, (placements, samples). `keep` says which samples of a
/// frame get to the networks.
fn run(
    placements: &[Placement],
    stamps: &[Stamp],
    keep: impl Fn(&str, usize) -> bool,
) -> Vec<Vec<KinematicSample>> {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let sites = MountedSensors::new(&body, placements).unwrap();
    let options = StreamOptions::resampled(STATES_HZ, 100.0);
    let mut streams: Vec<_> = placements
        .iter()
        .map(|placement| StreamingImu::new(placement.scheme(), options).unwrap())
        .collect();
    let mut live = LivePlacements::new(
        &simulator(Direction::Forward).unwrap(),
        &body,
        placements,
        GAP,
    )
    .unwrap();
    let mut all = vec![Vec::new(); placements.len()];
    for (number, stamp) in stamps.iter().enumerate() {
        let pose = pose(stamp);
        let frames = sites.poses(&pose);
        live.push(*stamp, &pose, &frames);
        let mut released: Vec<_> = streams
            .iter_mut()
            .zip(&frames)
            .map(|(stream, frame)| stream.push_kinematics(frame.at(*stamp)).unwrap())
            .collect();
        for (placement, samples) in placements.iter().zip(&mut released) {
            samples.retain(|_| keep(placement.name(), number));
        }
        live.correct(&mut released).unwrap();
        all.iter_mut()
            .zip(released)
            .for_each(|(all, released)| all.extend(released));
    }
    all
}

#[test]
fn live_is_what_the_whole_series_gives() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let placement = Placement::at_site("left_wrist", "left_watch", 100.0)
        .unwrap()
        .with_scheme(Scheme::Richardson);
    let stamps = stamps(1.0, 4.0);
    let poses: Vec<BodyPose> = stamps.iter().map(pose).collect();
    let motion = SiteMotion::on_body(&body, &placement, &stamps, &poses).unwrap();
    let whole = simulator(Direction::Forward)
        .unwrap()
        .simulate(&motion)
        .unwrap();
    let samples = &run(&[placement], &stamps, |_, _| true)[0];
    assert!(samples.len() > 290);
    // The stream begins with a shorter stencil; the networks' state forgets that.
    for (one, all) in samples.iter().zip(&whole).skip(60) {
        assert_eq!(one.stamp, all.stamp);
        assert!(
            (one.acceleration_in_world - all.acceleration_in_world).norm() < 1e-3,
            "{} {}",
            one.acceleration_in_world,
            all.acceleration_in_world
        );
        assert!((one.angular_velocity_in_world - all.angular_velocity_in_world).norm() < 1e-4);
    }
}

#[test]
fn a_series_before_a_pause_is_corrected_to_its_end() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    for scheme in [
        Scheme::SecondDifference,
        Scheme::Richardson,
        Scheme::Triangle,
    ] {
        let placement = Placement::at_site("left_wrist", "left_watch", 100.0)
            .unwrap()
            .with_scheme(scheme);
        let (before, after) = (stamps(1.0, 3.0), stamps(4.0, 4.2));
        let poses: Vec<BodyPose> = before.iter().map(pose).collect();
        let motion = SiteMotion::on_body(&body, &placement, &before, &poses).unwrap();
        let whole = simulator(Direction::Forward)
            .unwrap()
            .simulate(&motion)
            .unwrap();
        let samples = &run(&[placement], &[before, after].concat(), |_, _| true)[0];
        let found: Vec<_> = samples
            .iter()
            .filter(|sample| sample.stamp <= Stamp::from_seconds(3.0))
            .collect();
        assert_eq!(found.len(), whole.len(), "{scheme}");
        for (one, all) in found.iter().zip(&whole).skip(60) {
            assert_eq!(one.stamp, all.stamp);
            assert!(
                (one.acceleration_in_world - all.acceleration_in_world).norm() < 1e-3,
                "{scheme}: {} {}",
                one.acceleration_in_world,
                all.acceleration_in_world
            );
            assert!(
                (one.angular_velocity_in_world - all.angular_velocity_in_world).norm() < 1e-4,
                "{scheme}"
            );
        }
        assert!(samples.len() > whole.len() + 8);
    }
}

#[test]
fn placements_together_are_what_each_is_alone() {
    let schemes = [
        Scheme::Spline,
        Scheme::Richardson,
        Scheme::Triangle,
        Scheme::Richardson,
    ];
    let placements: Vec<Placement> = PlacementSet::full17()
        .placements()
        .iter()
        .zip(schemes.iter().cycle())
        .map(|(placement, scheme)| placement.clone().with_scheme(*scheme))
        .collect();
    // A pause after which every series begins anew.
    let times = [stamps(1.0, 1.6), stamps(2.9, 4.1)].concat();
    // Two lose samples, each its own: their series too go on or begin anew without the others.
    let keep = |name: &str, number: usize| match name {
        "left_foot" => number % 7 != 3,
        "pelvis" => !(30..50).contains(&number),
        _ => true,
    };
    let together = run(&placements, &times, keep);
    for (placement, together) in placements.iter().zip(&together) {
        let alone = &run(std::slice::from_ref(placement), &times, keep)[0];
        assert!(alone.len() > 120, "{}: {}", placement.name(), alone.len());
        assert_eq!(together, alone, "{}", placement.name());
    }
}

#[test]
fn what_cannot_run_live_is_refused() {
    assert!(
        simulator(Direction::Both)
            .unwrap_err()
            .to_string()
            .contains("direction: forward")
    );
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let fast = Placement::at_site("left_wrist", "left_watch", 200.0).unwrap();
    let error = LivePlacements::new(&simulator(Direction::Forward).unwrap(), &body, &[fast], GAP)
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.contains("left_wrist") && error.contains("100"),
        "{error}"
    );
}
