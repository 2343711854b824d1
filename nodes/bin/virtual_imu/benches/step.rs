//! What a state costs the node, without DDS: `cargo bench -p cromosim_virtual_imu --bench step`.
//!
//! 17 placements at 100 Hz on states at 100 Hz: 100 microseconds a state are 1 % of a core. Goal
//! with networks: 20 %.
#![allow(missing_docs)]

use std::collections::BTreeMap;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_body::BodyModel;
use cromosim_imu::{PlacementSet, Scheme};
use cromosim_learned::{Direction, Input, LearnedSimulator, Network, NetworkShape};
use cromosim_motion::embedded_walk;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::std_msgs::Header;
use cromosim_virtual_imu::{Config, VirtualImuNode};

const START: i64 = 1_700_000_000_000_000_000;
const INTERVAL_NANOS: i64 = 10_000_000;

/// Random streaming networks in a folder of their own.
fn networks(channels: usize, hidden: usize) -> tempfile::TempDir {
    let direction = Direction::Forward;
    let inputs = Input::Streaming.channels();
    let shape = NetworkShape {
        inputs,
        channels,
        kernel: 5,
        convolutions: 3,
        hidden,
        layers: 2,
        direction,
        outputs: 3,
    };
    let network = |seed| Network::new(shape.clone(), seed).expect("a sound shape");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let simulator =
        LearnedSimulator::new(Input::Streaming, [network(1), network(2)]).expect("causal networks");
    simulator
        .write(folder.path(), &BTreeMap::new())
        .expect("a folder that can be written");
    folder
}

/// The states of the embedded walk, one after the other.
fn states() -> Vec<SmplState> {
    let walk = embedded_walk();
    let state = |body: &cromosim_body::BodyPose| {
        let (betas, shape_space) = (walk.betas.clone(), "cromosim".to_owned());
        let mut state = SmplState {
            betas,
            shape_space,
            confidence: 1.0,
            ..SmplState::default()
        };
        state.set_root_and_rotations(body.root_position, &body.local_rotations);
        state
    };
    walk.frames.iter().map(state).collect()
}

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("17 placements at 100 Hz, one state");
    let states = states();
    let sizes = [None, Some((32, 64)), Some((64, 128))];
    for (scheme, size) in [Scheme::Spline, Scheme::Richardson]
        .iter()
        .flat_map(|scheme| sizes.map(|size| (*scheme, size)))
    {
        let folder = size.map(|(channels, hidden)| networks(channels, hidden));
        let learned = folder
            .as_ref()
            .map_or_else(String::new, |folder| folder.path().display().to_string());
        let placements = PlacementSet::full17()
            .map(|placement| placement.with_rate_hz(100.0).with_scheme(scheme));
        let config = Config {
            learned,
            state_rate_hz: 100.0,
            ..Config::default()
        };
        let mut node =
            VirtualImuNode::new(config, BodyModel::embedded(), &placements, Path::new("."))
                .expect("a sound node");
        let mut count = 0;
        let name = size.map_or_else(
            || "no networks".to_owned(),
            |(channels, hidden)| format!("channels {channels}, hidden {hidden}"),
        );
        group.bench_function(format!("{scheme}, {name}"), |bencher| {
            bencher.iter(|| {
                let mut state = states[count % states.len()].clone();
                state.header = Header::new(START + count as i64 * INTERVAL_NANOS, "world");
                count += 1;
                node.step(&state).expect("a sound state").readings.len()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
