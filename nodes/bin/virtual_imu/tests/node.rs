//! The node as a function of states, without DDS.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use cromosim_body::BodyModel;
use cromosim_imu::PlacementSet;
use cromosim_motion::{SmplMotion, embedded_walk};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::std_msgs::Header;
use cromosim_virtual_imu::{Config, Reading, VirtualImuNode};
use nalgebra::{UnitQuaternion, Vector3};

const START: i64 = 1_700_000_000_000_000_000;

fn node(config: Config) -> VirtualImuNode {
    VirtualImuNode::new(config, BodyModel::embedded(), &PlacementSet::demo(), Path::new(".")).unwrap()
}

fn quiet() -> Config {
    Config { noise: false, ..Config::default() }
}

fn state(motion: &SmplMotion, frame: usize, nanos: i64) -> SmplState {
    let body = &motion.frames[frame];
    let mut state = SmplState { header: Header::new(nanos, "world"), betas: motion.betas.clone(), ..SmplState::default() };
    state.set_root_and_rotations(body.root_position, &body.local_rotations);
    state
}

/// The readings of the walk's frames, whose stamps begin at `start`.
fn walk(node: &mut VirtualImuNode, motion: &SmplMotion, start: i64) -> Vec<Reading> {
    let step = |frame| node.step(&state(motion, frame, start + frame as i64 * 10_000_000)).unwrap().readings;
    (0..motion.frames.len()).flat_map(step).collect()
}

#[test]
fn a_body_at_rest_reads_gravity_upwards_and_no_rate() {
    let mut standing = embedded_walk();
    let first = standing.frames[0].clone();
    standing.frames.fill(first);
    for reading in walk(&mut node(quiet()), &standing, START) {
        let world_from_sensor: UnitQuaternion<f64> = reading.full.orientation.try_into().unwrap();
        let force = world_from_sensor * Vector3::from(reading.full.linear_acceleration);
        assert!((force - Vector3::new(0.0, 0.0, 9.80665)).norm() < 1e-4, "{force}");
        assert!(Vector3::from(reading.full.angular_velocity).norm() < 1e-5);
        assert_eq!(reading.raw.linear_acceleration, reading.full.linear_acceleration);
        assert_eq!(reading.raw.orientation_covariance[0], -1.0);
        assert!(reading.raw.header.frame_id.ends_with("_imu"));
    }
}

#[test]
fn every_sample_comes_out_once_with_the_stated_delay() {
    let motion = embedded_walk();
    let mut node = node(quiet());
    let mut stamps = vec![Vec::new(); node.placements().len()];
    for frame in 0..motion.frames.len() {
        let now = START + frame as i64 * 10_000_000;
        for reading in node.step(&state(&motion, frame, now)).unwrap().readings {
            let stamp = reading.full.header.stamp.nanos();
            // The first states wait until their rate is known.
            if frame > 20 {
                let delay = node.delays_seconds()[reading.placement].unwrap();
                assert!(((now - stamp) as f64 * 1e-9 - delay).abs() < 2e-3, "stated {delay} s, found {} ns", now - stamp);
            }
            stamps[reading.placement].push(stamp);
        }
    }
    for stamps in stamps {
        assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] == 10_000_000), "a grid without holes or doubles");
        assert_eq!(stamps[0], START);
        assert!(stamps.len() >= motion.frames.len() - 10);
    }
}

#[test]
fn a_source_that_starts_over_starts_the_schemes_over() {
    let motion = embedded_walk();
    let mut node = node(quiet());
    let first = walk(&mut node, &motion, START);
    let again = walk(&mut node, &motion, START - 60_000_000_000);
    assert_eq!(first.len(), again.len());
    assert!(again.iter().all(|reading| reading.full.header.stamp.nanos() < START));
    let largest = again.iter().map(|reading| Vector3::from(reading.full.linear_acceleration).norm()).fold(0.0, f64::max);
    assert!(largest < 60.0, "the jump of the source shows as {largest} m/s2");
}

#[test]
fn the_seed_makes_the_noise() {
    let motion = embedded_walk();
    let run = |seed| walk(&mut node(Config { seed, ..Config::default() }), &motion, START);
    assert!(run(1) == run(1));
    assert!(run(1) != run(2));
}

#[test]
fn nonsense_is_refused_and_the_node_goes_on() {
    let motion = embedded_walk();
    let mut node = node(quiet());
    let mut readings = 0;
    for frame in 0..200 {
        let mut state = state(&motion, frame, START + frame as i64 * 10_000_000);
        if frame == 100 {
            state.local_rotations[7].x = f64::NAN;
            assert!(node.step(&state).is_err());
            continue;
        }
        if frame == 120 {
            state.betas = vec![f64::INFINITY];
            assert!(node.step(&state).is_err());
            continue;
        }
        readings += node.step(&state).unwrap().readings.len();
    }
    assert!(readings >= 5 * 185, "{readings}");
    let report = node.diagnostics(Header::new(START, "").stamp, "/virtual_imu");
    assert!(report.status[0].message.contains("left out"), "{report:?}");
}

/// A node with one placement, whose device has these effects.
fn with_device(name: &str, effects: &str) -> Result<VirtualImuNode, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let text = format!("schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0.0, gyro_density: 0.0}}\neffects:\n{effects}");
    std::fs::write(folder.join(name), text).unwrap();
    let placements = format!("schema: cromosim/placements/1\nplacements:\n  wrist: {{site: left_watch, rate_hz: 100, device: {name}}}\n");
    let placements = PlacementSet::parse(&placements, "placements.yaml").unwrap();
    VirtualImuNode::new(Config::default(), BodyModel::embedded(), &placements, folder).map_err(|refusal| refusal.to_string())
}

#[test]
fn a_devices_effects_act_live() {
    let motion = embedded_walk();
    let ideal = walk(&mut with_device("ideal.yaml", "- {effect: accel_bias, bias: [0.0, 0.0, 0.0]}").unwrap(), &motion, START);
    let effects = "- {effect: time_offset, seconds: 0.25}\n- {effect: clock_drift, ppm: 1000}\n- {effect: gyro_units, factor: 1000}\n\
                   - {effect: mount_rotation, rotvec: [0.0, 0.0, 1.5707963267948966]}\n";
    let changed = walk(&mut with_device("changed.yaml", effects).unwrap(), &motion, START);
    assert_eq!(ideal.len(), changed.len());
    for (ideal, changed) in ideal.iter().zip(&changed) {
        let since = ideal.raw.header.stamp.nanos() - START;
        assert_eq!(changed.raw.header.stamp.nanos() - START, since + since / 1000 + 250_000_000);
        let (ideal, changed) = (Vector3::from(ideal.raw.angular_velocity), Vector3::from(changed.raw.angular_velocity));
        assert!((changed - Vector3::new(ideal.y, -ideal.x, ideal.z) * 1000.0).norm() < 1e-6, "{ideal} {changed}");
    }
    let lossy = walk(&mut with_device("lossy.yaml", "- {effect: dropped_samples, fraction: 0.3, mean_burst: 5}").unwrap(), &motion, START);
    assert!(lossy.len() < ideal.len() * 9 / 10 && !lossy.is_empty());
}

#[test]
fn effects_of_a_reference_are_none_of_a_live_device() {
    let refusal = with_device("tilted.yaml", "- {effect: reference_tilt, rotvec: [0.01, 0.0, 0.0]}").err().unwrap();
    assert!(refusal.contains("tilted.yaml: `reference_tilt` is an effect of a recording's reference"), "{refusal}");
}
