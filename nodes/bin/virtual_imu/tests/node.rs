//! The node as a function of states, without DDS.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use cromosim_body::BodyModel;
use cromosim_imu::{ImuMessages, PlacementSet};
use cromosim_motion::{SmplMotion, embedded_walk};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::std_msgs::Header;
use cromosim_virtual_imu::{Config, VirtualImuNode};
use nalgebra::{UnitQuaternion, Vector3};

const START: i64 = 1_700_000_000_000_000_000;

fn node(config: Config) -> VirtualImuNode {
    VirtualImuNode::new(
        config,
        BodyModel::embedded(),
        &PlacementSet::demo(),
        Path::new("."),
    )
    .unwrap()
}

/// The demo's placements with sensors that err in nothing.
fn error_free(config: Config) -> VirtualImuNode {
    let names = PlacementSet::demo()
        .to_yaml()
        .replace("consumer_mems", "ideal");
    let placements = PlacementSet::parse(&names, "ideal.yaml").unwrap();
    VirtualImuNode::new(config, BodyModel::embedded(), &placements, Path::new(".")).unwrap()
}

fn quiet() -> Config {
    Config {
        noise: false,
        ..Config::default()
    }
}

fn state(motion: &SmplMotion, frame: usize, nanos: i64) -> SmplState {
    let body = &motion.frames[frame];
    let mut state = SmplState {
        header: Header::new(nanos, "world"),
        betas: motion.betas.clone(),
        shape_space: "cromosim".to_owned(),
        confidence: 1.0,
        ..SmplState::default()
    };
    state.set_root_and_rotations(body.root_position, &body.local_rotations);
    state
}

/// The readings of the walk's frames, whose stamps begin at `start`.
fn walk(node: &mut VirtualImuNode, motion: &SmplMotion, start: i64) -> Vec<(usize, ImuMessages)> {
    let step = |frame| {
        node.step(&state(motion, frame, start + frame as i64 * 10_000_000))
            .unwrap()
            .readings
    };
    (0..motion.frames.len()).flat_map(step).collect()
}

#[test]
fn a_body_at_rest_reads_gravity_upwards_and_no_rate() {
    let mut standing = embedded_walk();
    let first = standing.frames[0].clone();
    standing.frames.fill(first);
    for (_, reading) in walk(&mut error_free(quiet()), &standing, START) {
        let world_from_sensor: UnitQuaternion<f64> = reading.data.orientation.try_into().unwrap();
        let force = world_from_sensor * Vector3::from(reading.data.linear_acceleration);
        assert!(
            (force - Vector3::new(0.0, 0.0, 9.80665)).norm() < 1e-4,
            "{force}"
        );
        assert!(Vector3::from(reading.data.angular_velocity).norm() < 1e-5);
        assert_eq!(
            reading.data_raw.linear_acceleration,
            reading.data.linear_acceleration
        );
        assert_eq!(reading.data_raw.orientation_covariance[0], -1.0);
        assert!(reading.data_raw.header.frame_id.ends_with("_imu"));
    }
}

#[test]
fn every_sample_comes_out_once_with_the_stated_delay() {
    let motion = embedded_walk();
    let mut node = node(quiet());
    let mut stamps = vec![Vec::new(); node.placements().len()];
    for frame in 0..motion.frames.len() {
        let now = START + frame as i64 * 10_000_000;
        for (placement, reading) in node.step(&state(&motion, frame, now)).unwrap().readings {
            let stamp = reading.data.header.stamp.nanos();
            // The first states wait until their rate is known.
            if frame > 20 {
                let delay = node.delays_seconds()[placement].unwrap();
                assert!(
                    ((now - stamp) as f64 * 1e-9 - delay).abs() < 2e-3,
                    "stated {delay} s, found {} ns",
                    now - stamp
                );
            }
            stamps[placement].push(stamp);
        }
    }
    for stamps in stamps {
        assert!(
            stamps
                .windows(2)
                .all(|pair| pair[1] - pair[0] == 10_000_000),
            "a grid without holes or doubles"
        );
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
    assert!(
        again
            .iter()
            .all(|(_, reading)| reading.data.header.stamp.nanos() < START)
    );
    let largest = again
        .iter()
        .map(|(_, reading)| Vector3::from(reading.data.linear_acceleration).norm())
        .fold(0.0, f64::max);
    assert!(
        largest < 60.0,
        "the jump of the source shows as {largest} m/s2"
    );
}

#[test]
fn the_seed_makes_the_noise() {
    let motion = embedded_walk();
    let run = |seed| {
        walk(
            &mut node(Config {
                seed,
                ..Config::default()
            }),
            &motion,
            START,
        )
    };
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

/// The readings of the walk's first second with this confidence, without those that rest on its
/// ends.
fn with_confidence(config: Config, confidence: f64) -> Vec<ImuMessages> {
    let motion = embedded_walk().slice(0.0, Some(1.0)).unwrap();
    let placements = cromosim_virtual_imu::placements(&config).unwrap();
    let mut node =
        VirtualImuNode::new(config, BodyModel::embedded(), &placements, Path::new(".")).unwrap();
    let step = |frame: usize| {
        let state = SmplState {
            confidence,
            ..state(&motion, frame, START + frame as i64 * 10_000_000)
        };
        let readings = node.step(&state).unwrap().readings;
        readings.into_iter().map(|(_, reading)| reading)
    };
    (0..motion.frames.len()).flat_map(step).collect()
}

#[test]
fn confidence_grows_the_covariances() {
    let scheme = || Config {
        scheme: "second_difference".to_owned(),
        ..Config::default()
    };
    let certain = with_confidence(scheme(), 1.0);
    assert!(
        certain == with_confidence(scheme(), f64::NAN),
        "where the source cannot say, nothing is added"
    );
    // 1 mm: (6 / h4) (1 mm)2 and (1 / 2 h2) (2 mrad)2, more where gravity tilts.
    let doubtful = with_confidence(scheme(), 1.0 / (1.0 + 1e-4));
    assert_eq!(certain.len(), doubtful.len());
    for (certain, doubtful) in certain.iter().zip(&doubtful).skip(100) {
        assert_eq!(
            certain.data_raw.linear_acceleration, doubtful.data_raw.linear_acceleration,
            "the reading stays as it is"
        );
        let grown =
            |pick: fn(&ImuMessages) -> [f64; 9]| (pick(doubtful)[0] - pick(certain)[0]).sqrt();
        let (force, rate) = (
            grown(|r| r.data_raw.linear_acceleration_covariance),
            grown(|r| r.data_raw.angular_velocity_covariance),
        );
        assert!((24.0..25.0).contains(&force), "{force} m/s2");
        assert!((0.14..0.15).contains(&rate), "{rate} rad/s");
        assert!((grown(|r| r.data.orientation_covariance) - 0.002).abs() < 1e-6);
        assert_eq!(doubtful.data_raw.orientation_covariance[0], -1.0);
    }
    let holding = with_confidence(
        Config {
            pose_error_correlation_s: 0.5,
            ..scheme()
        },
        0.5,
    );
    let force = holding[200].data_raw.linear_acceleration_covariance[0].sqrt();
    assert!(
        (0.5..5.0).contains(&force),
        "0.1 m that hold for half a second are sqrt(3) 0.1 / 0.25 m/s2, and 0.2 rad of gravity: {force}"
    );
}

#[test]
fn at_confidence_0_there_is_no_estimate() {
    let motion = embedded_walk();
    let mut node = node(quiet());
    let mut lost = Vec::new();
    for frame in 0..300 {
        let confidence = if (100..130).contains(&frame) {
            0.0
        } else {
            1.0
        };
        let state = SmplState {
            confidence,
            ..state(&motion, frame, START + frame as i64 * 10_000_000)
        };
        for (_, reading) in node.step(&state).unwrap().readings {
            let covariances = [
                reading.data_raw.linear_acceleration_covariance,
                reading.data_raw.angular_velocity_covariance,
                reading.data.orientation_covariance,
            ];
            let at = (reading.data_raw.header.stamp.nanos() - START) / 10_000_000;
            if (105..125).contains(&at) {
                assert!(
                    covariances.iter().all(|covariance| covariance[0] == -1.0),
                    "frame {at}"
                );
            }
            if !(85..=145).contains(&at) {
                assert!(
                    covariances.iter().all(|covariance| covariance[0] >= 0.0),
                    "frame {at}"
                );
            }
            lost.extend((reading.data_raw.linear_acceleration_covariance[0] < 0.0).then_some(at));
        }
    }
    let report = node.diagnostics(Header::new(START, "").stamp, "/virtual_imu");
    let told = report.status[0]
        .values
        .iter()
        .find(|value| value.key.contains("without an estimate"))
        .unwrap();
    assert_eq!(told.value, lost.len().to_string());
}

#[test]
fn betas_of_another_body_are_refused() {
    let motion = embedded_walk();
    let foreign = SmplState {
        betas: vec![0.5],
        shape_space: "smpl".to_owned(),
        ..state(&motion, 0, START)
    };
    assert!(
        node(quiet())
            .step(&foreign)
            .unwrap_err()
            .to_string()
            .contains("belong to SMPL")
    );
}

#[test]
fn two_people_have_errors_of_their_own() {
    let motion = embedded_walk();
    let run = |prefix: &str| {
        walk(
            &mut node(Config {
                prefix: prefix.to_owned(),
                ..Config::default()
            }),
            &motion,
            START,
        )
    };
    let (one, other) = (run("person_1"), run("person_2"));
    assert_eq!(
        one[0].1.data_raw.header.frame_id,
        format!(
            "person_1/{}_imu",
            node(quiet()).placements()[one[0].0].name()
        )
    );
    assert!(
        one.iter()
            .zip(&other)
            .all(|((_, one), (_, other))| one.data_raw.linear_acceleration
                != other.data_raw.linear_acceleration)
    );
}

/// A node with one placement, whose device has these effects.
fn with_device(name: &str, effects: &str, config: Config) -> Result<VirtualImuNode, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let text = format!(
        "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0.0, gyro_density: 0.0}}\neffects:\n{effects}"
    );
    std::fs::write(folder.join(name), text).unwrap();
    let placements = format!(
        "schema: cromosim/placements/1\nplacements:\n  wrist: {{site: left_watch, rate_hz: 100, device: {name}}}\n"
    );
    let placements = PlacementSet::parse(&placements, "placements.yaml").unwrap();
    VirtualImuNode::new(config, BodyModel::embedded(), &placements, folder)
        .map_err(|refusal| refusal.to_string())
}

#[test]
fn a_devices_effects_act_live() {
    let motion = embedded_walk();
    let ideal = walk(
        &mut with_device(
            "ideal.yaml",
            "- {effect: accel_bias, bias: [0.0, 0.0, 0.0]}",
            Config::default(),
        )
        .unwrap(),
        &motion,
        START,
    );
    let effects = "- {effect: time_offset, seconds: 0.25}\n- {effect: clock_drift, ppm: 1000}\n- {effect: gyro_units, factor: 1000}\n\
                   - {effect: mount_rotation, rotvec: [0.0, 0.0, 1.5707963267948966]}\n";
    let changed = walk(
        &mut with_device("changed.yaml", effects, Config::default()).unwrap(),
        &motion,
        START,
    );
    assert_eq!(ideal.len(), changed.len());
    for ((_, ideal), (_, changed)) in ideal.iter().zip(&changed) {
        let since = ideal.data_raw.header.stamp.nanos() - START;
        assert_eq!(
            changed.data_raw.header.stamp.nanos() - START,
            since + since / 1000 + 250_000_000
        );
        let (ideal, changed) = (
            Vector3::from(ideal.data_raw.angular_velocity),
            Vector3::from(changed.data_raw.angular_velocity),
        );
        assert!(
            (changed - Vector3::new(ideal.y, -ideal.x, ideal.z) * 1000.0).norm() < 1e-6,
            "{ideal} {changed}"
        );
    }
    let lossy = walk(
        &mut with_device(
            "lossy.yaml",
            "- {effect: dropped_samples, fraction: 0.3, mean_burst: 5}",
            Config::default(),
        )
        .unwrap(),
        &motion,
        START,
    );
    assert!(lossy.len() < ideal.len() * 9 / 10 && !lossy.is_empty());
}

#[test]
fn without_noise_the_deterministic_effects_stay_and_nothing_is_lost() {
    let motion = embedded_walk();
    let run = |name: &str, effects: &str| {
        let mut node = with_device(name, effects, quiet()).unwrap();
        walk(&mut node, &motion, START)
    };
    let ideal = run("plain.yaml", "- {effect: accel_noise, density: 0.1}");
    let biased = run(
        "biased.yaml",
        "- {effect: accel_bias, bias: [0.5, 0.0, -0.25]}\n- {effect: accel_noise, density: 0.1}\n\
         - {effect: dropped_samples, fraction: 0.3, mean_burst: 5}",
    );
    assert_eq!(ideal.len(), biased.len());
    for ((_, ideal), (_, biased)) in ideal.iter().zip(&biased) {
        let force = |imu: &ImuMessages| Vector3::from(imu.data_raw.linear_acceleration);
        let difference = force(biased) - force(ideal);
        assert!((difference - Vector3::new(0.5, 0.0, -0.25)).norm() < 1e-12);
    }
}

#[test]
fn effects_of_a_reference_are_none_of_a_live_device() {
    let refusal = with_device(
        "tilted.yaml",
        "- {effect: reference_tilt, rotvec: [0.01, 0.0, 0.0]}",
        Config::default(),
    )
    .err()
    .unwrap();
    assert!(
        refusal.contains("tilted.yaml: `reference_tilt` is an effect of a recording's reference"),
        "{refusal}"
    );
}

/// Networks whose last layer is zero but for its bias: what they add is known.
fn constant_networks(folder: &std::path::Path, acceleration: [f32; 3], angular_velocity: [f32; 3]) {
    use cromosim_learned::{Direction, Input, LearnedSimulator, Network, NetworkShape};
    let shape = NetworkShape {
        inputs: Input::Streaming.channels(),
        channels: 4,
        kernel: 3,
        convolutions: 3,
        hidden: 4,
        layers: 2,
        direction: Direction::Forward,
        outputs: 3,
    };
    let constant = |values: [f32; 3]| {
        let mut network = Network::new(shape.clone(), 1).unwrap();
        let tensors = network.shape().tensors();
        for tensor in tensors
            .iter()
            .filter(|tensor| tensor.name.starts_with("linear."))
        {
            let place = &mut network.parameters_mut()[tensor.range.clone()];
            place.fill(0.0);
            if tensor.name == "linear.bias" {
                place.copy_from_slice(&values);
            }
        }
        network
    };
    let networks = [constant(acceleration), constant(angular_velocity)];
    LearnedSimulator::new(Input::Streaming, networks)
        .unwrap()
        .write(folder, &BTreeMap::new())
        .unwrap();
}

#[test]
fn networks_correct_what_the_scheme_says_before_the_device() {
    let folder = tempfile::tempdir().unwrap();
    constant_networks(folder.path(), [0.1, 0.0, 0.0], [0.0, 0.5, 0.0]);
    let motion = embedded_walk();
    let read = |learned: String| {
        let mut node = error_free(Config { learned, ..quiet() });
        let states = (0..200).map(|frame| state(&motion, frame, START + frame as i64 * 10_000_000));
        states
            .flat_map(|state| node.step(&state).unwrap().readings)
            .collect::<Vec<_>>()
    };
    let (plain, learned) = (
        read(String::new()),
        read(folder.path().display().to_string()),
    );
    assert_eq!(plain.len(), learned.len());
    for ((_, before), (_, after)) in plain.iter().zip(&learned) {
        let difference = |a: cromosim_msgs::geometry_msgs::Vector3,
                          b: cromosim_msgs::geometry_msgs::Vector3| {
            (Vector3::from(a) - Vector3::from(b)).norm()
        };
        // 0.1 of 5 m/s2 and 0.5 of 2 rad/s, whatever way the sensor is turned.
        assert!(
            (difference(
                after.data_raw.linear_acceleration,
                before.data_raw.linear_acceleration
            ) - 0.5)
                .abs()
                < 1e-5
        );
        assert!(
            (difference(
                after.data_raw.angular_velocity,
                before.data_raw.angular_velocity
            ) - 1.0)
                .abs()
                < 1e-5
        );
    }
}
