//! Parameters that change between two states.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use cromosim_body::BodyModel;
use cromosim_imu::ImuMessages;
use cromosim_motion::{SmplMotion, embedded_walk};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::std_msgs::Header;
use cromosim_virtual_imu::{Config, VirtualImuNode, placements};

const START: i64 = 1_700_000_000_000_000_000;
const FRAMES: usize = 200;
/// Of the states.
const RATE_HZ: f64 = 100.0;
/// Moves one channel of one placement.
const MAPPING: &str = "\
schema: cromosim/mapping/1
placements:
  left_wrist:
    accel_x: {simulated: [-90.0, 90.0], measured: [-89.5, 90.5]}
    accel_y: &same {simulated: [-90.0, 90.0], measured: [-90.0, 90.0]}
    accel_z: *same
    gyro_x: *same
    gyro_y: *same
    gyro_z: *same
";

fn node(config: Config) -> VirtualImuNode {
    let set = placements(&config).unwrap();
    VirtualImuNode::new(config, BodyModel::embedded(), &set, Path::new(".")).unwrap()
}

fn change(node: &mut VirtualImuNode, config: Config) {
    let set = placements(&config).unwrap();
    node.change(config, &set).unwrap();
}

fn quiet() -> Config {
    Config {
        noise: false,
        ..Config::default()
    }
}

/// What frames in the middle of the walk lead to.
fn feed(
    node: &mut VirtualImuNode,
    motion: &SmplMotion,
    frames: std::ops::Range<usize>,
) -> Vec<(usize, ImuMessages)> {
    let step = |frame: usize| {
        let body = &motion.frames[frame];
        let mut state = SmplState {
            header: Header::new(START + frame as i64 * 10_000_000, "world"),
            betas: motion.betas.clone(),
            shape_space: "cromosim".to_owned(),
            confidence: 1.0,
            ..SmplState::default()
        };
        state.set_root_and_rotations(body.root_position, &body.local_rotations);
        node.step(&state).unwrap().readings
    };
    frames.flat_map(step).collect()
}

#[test]
fn noise_and_seed_change_and_no_sample_is_lost() {
    let motion = embedded_walk();
    let mut changing = node(Config::default());
    let mut before = feed(&mut changing, &motion, 0..FRAMES);
    change(&mut changing, quiet());
    let after = feed(&mut changing, &motion, FRAMES..2 * FRAMES);
    let whole = feed(&mut node(quiet()), &motion, 0..2 * FRAMES);
    // The noise is away from the change on, and was there before.
    assert_eq!(after, whole[whole.len() - after.len()..]);
    let stamps = |readings: &[(usize, ImuMessages)]| -> Vec<_> {
        readings
            .iter()
            .map(|(placement, reading)| (*placement, reading.data.header.stamp.nanos()))
            .collect()
    };
    assert_ne!(before, whole[..before.len()]);
    before.extend(after);
    assert_eq!(stamps(&before), stamps(&whole));

    let with_seed = |seed| Config {
        seed,
        ..Config::default()
    };
    let mut node = node(with_seed(1));
    feed(&mut node, &motion, 0..FRAMES);
    let mut other = self::node(with_seed(1));
    feed(&mut other, &motion, 0..FRAMES);
    change(&mut other, with_seed(2));
    let range = FRAMES..2 * FRAMES;
    assert_ne!(
        feed(&mut node, &motion, range.clone()),
        feed(&mut other, &motion, range)
    );
}

#[test]
fn a_mapping_that_is_not_there_changes_nothing() {
    let motion = embedded_walk();
    let mut changing = node(quiet());
    feed(&mut changing, &motion, 0..FRAMES);
    let wrong = Config {
        mapping: "gone.yaml".to_owned(),
        noise: true,
        ..Config::default()
    };
    let set = placements(&wrong).unwrap();
    let refusal = changing.change(wrong, &set).unwrap_err().to_string();
    assert!(refusal.contains("gone.yaml"), "{refusal}");
    let mut untouched = node(quiet());
    feed(&mut untouched, &motion, 0..FRAMES);
    let range = FRAMES..2 * FRAMES;
    assert_eq!(
        feed(&mut changing, &motion, range.clone()),
        feed(&mut untouched, &motion, range)
    );
}

#[test]
fn networks_come_and_go() {
    let motion = embedded_walk();
    let learned = Config {
        learned: "streaming".to_owned(),
        ..quiet()
    };
    let mut changing = node(quiet());
    feed(&mut changing, &motion, 0..FRAMES);
    change(&mut changing, learned.clone());
    let corrected = feed(&mut changing, &motion, FRAMES..2 * FRAMES);
    let mut fresh = node(Config {
        state_rate_hz: RATE_HZ,
        ..learned
    });
    let expected = feed(&mut fresh, &motion, FRAMES..2 * FRAMES);
    assert!(!expected.is_empty());
    assert_eq!(corrected, expected, "as a node that began with them");
    change(&mut changing, quiet());
    let plain = feed(&mut changing, &motion, 2 * FRAMES..3 * FRAMES);
    let mut fresh = node(Config {
        state_rate_hz: RATE_HZ,
        ..quiet()
    });
    assert_eq!(plain, feed(&mut fresh, &motion, 2 * FRAMES..3 * FRAMES));
}

#[test]
fn another_device_and_another_orientation_act_from_the_next_state_on() {
    let motion = embedded_walk();
    let with = |device: &str, orientation: &str| Config {
        device: device.to_owned(),
        orientation: orientation.to_owned(),
        ..quiet()
    };
    let mut changing = node(quiet());
    feed(&mut changing, &motion, 0..FRAMES);
    change(&mut changing, with("icm42688p", "none"));
    let after = feed(&mut changing, &motion, FRAMES..2 * FRAMES);
    assert!(
        after
            .iter()
            .all(|(_, it)| it.data.orientation_covariance[0] == -1.0)
    );
    assert!(after.iter().any(|(_, it)| it.temperature.is_some()));
    let whole = feed(&mut node(with("icm42688p", "none")), &motion, 0..2 * FRAMES);
    // The same but for the warming up, which began with the change.
    let (now, then) = (
        &after[after.len() - 1].1.data,
        &whole[whole.len() - 1].1.data,
    );
    assert_eq!(now.header, then.header);
    assert!((now.linear_acceleration.x - then.linear_acceleration.x).abs() < 2e-3 + 0.0048);

    change(&mut changing, with("", "vqf"));
    let fused = feed(&mut changing, &motion, 2 * FRAMES..3 * FRAMES);
    assert!(
        fused
            .iter()
            .all(|(_, it)| it.data.orientation_covariance[8] > 3.0 && it.temperature.is_none())
    );

    for (wrong, word) in [
        (with("icm", ""), "unknown device `icm`"),
        (with("", "madgwik"), "the nearest is madgwick"),
        (with("gone.yaml", "truth"), "gone.yaml"),
    ] {
        let set = placements(&wrong).unwrap();
        let refusal = changing.change(wrong, &set).unwrap_err().to_string();
        assert!(refusal.contains(word), "{refusal}");
    }
    let kept = feed(&mut changing, &motion, 3 * FRAMES..4 * FRAMES);
    assert!(
        kept.iter()
            .all(|(_, it)| it.data.orientation_covariance[8] > 3.0)
    );
}

#[test]
fn a_mapping_acts_from_the_next_state_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.yaml");
    std::fs::write(&file, MAPPING).unwrap();
    let mapped = Config {
        mapping: file.display().to_string(),
        ..quiet()
    };
    let motion = embedded_walk();
    let mut changing = node(quiet());
    feed(&mut changing, &motion, 0..FRAMES);
    change(&mut changing, mapped);
    let range = FRAMES..2 * FRAMES;
    let after = feed(&mut changing, &motion, range.clone());
    let mut plain = node(quiet());
    feed(&mut plain, &motion, 0..FRAMES);
    for ((placement, mapped), (_, plain)) in after.iter().zip(feed(&mut plain, &motion, range)) {
        let moved = mapped.data.linear_acceleration.x - plain.data.linear_acceleration.x;
        let is_mapped = changing.placements()[*placement].name() == "left_wrist";
        assert!(
            (moved - if is_mapped { 0.5 } else { 0.0 }).abs() < 1e-6,
            "{moved}"
        );
    }
}
