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
