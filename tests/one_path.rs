//! Live and offline are one path: with a device that has effects, the node's messages are those
//! that `cromosim simulate` writes of the same states, with its noise and without.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::succeed;
use cromosim_bag::BagReader;
use cromosim_body::BodyModel;
use cromosim_imu::ImuMessages;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField, Temperature};
use cromosim_virtual_imu::{Config, VirtualImuNode, placements};

const DEVICE: &str = "\
schema: cromosim/device/1
declared_noise: {accel_density: 0.002, gyro_density: 0.0003, orientation_stddev: 0.01}
effects:
- {effect: lever_arm, offset: [0.02, 0.0, -0.01]}
- {effect: soft_tissue, natural_hz: 9.0, damping_ratio: 0.3}
- {effect: low_pass, cutoff_hz: 20.0}
- {effect: accel_bias, bias: [0.1, 0.2, -0.3]}
- {effect: gyro_scale, scale: [1.01, 0.99, 1.0]}
- {effect: time_offset, seconds: 0.0125}
- {effect: dropped_samples, fraction: 0.1, mean_burst: 3.0}
- {effect: accel_quantization, lsb: 0.0048}
- {effect: warm_up, start: 22.0, rise: 10.0, time_constant: 3.0, accel_per_kelvin: [0.02, 0.0, -0.01], gyro_per_kelvin: [0.0, 0.002, 0.0]}
magnetometer: {noise_density: 1.0e-8, hard_iron: [2.0e-6, 0, 0], hard_iron_deviation: [1.0e-6, 1.0e-6, 1.0e-6], delay: 0.013, lsb: 1.5e-7}
";
/// Schemes whose first samples rest on the frames that have come live, too, so that filters with a
/// memory start alike.
const PLACEMENTS: &str = "\
schema: cromosim/placements/1
defaults: {rate_hz: 100, device: device.yaml}
placements:
  left_wrist: {site: left_watch, scheme: second_difference}
  right_shin: {site: right_shank_front, scheme: triangle, follow: segment}
";
const FIELD: &str = "0,1.9e-5,-4.5e-5";
const ORIENTATION: &str = "vqf";
const NAMES: [&str; 2] = ["left_wrist", "right_shin"];
/// m/s2, rad/s and of quaternions. Live a state's rotations are normalised once more; what that
/// changes at 1 m, 1e-16 m, is 4e-12 m/s2 in a second difference over (10 ms)2.
const TOLERANCE: f64 = 1e-10;

fn numbers(imu: &Imu) -> [f64; 10] {
    let (f, w, q) = (
        imu.linear_acceleration,
        imu.angular_velocity,
        imu.orientation,
    );
    [f.x, f.y, f.z, w.x, w.y, w.z, q.x, q.y, q.z, q.w]
}

fn same(live: &Imu, offline: &Imu) {
    assert_eq!(live.header, offline.header);
    for (live, offline) in numbers(live).iter().zip(numbers(offline)) {
        assert!(
            (live - offline).abs() < TOLERANCE,
            "{live} live, {offline} offline"
        );
    }
    let covariances = |imu: &Imu| {
        [
            imu.orientation_covariance,
            imu.angular_velocity_covariance,
            imu.linear_acceleration_covariance,
        ]
    };
    assert_eq!(covariances(live), covariances(offline));
}

fn same_field(live: &MagneticField, offline: &MagneticField) {
    assert_eq!(live.header, offline.header);
    let (live, offline) = (&live.magnetic_field, &offline.magnetic_field);
    // A value on the edge of a step may round to either side.
    for (live, offline) in [
        (live.x, offline.x),
        (live.y, offline.y),
        (live.z, offline.z),
    ] {
        assert!(
            (live - offline).abs() < 1e-12,
            "{live} live, {offline} offline"
        );
    }
}

/// The messages that the node makes of a bag's states.
fn live(folder: &Path, bag: &BagReader, noise: bool) -> Vec<(usize, ImuMessages)> {
    let config = Config {
        placements: folder.join("placements.yaml").display().to_string(),
        seed: 7,
        noise,
        magnetic_field: FIELD.to_owned(),
        orientation: ORIENTATION.to_owned(),
        state_rate_hz: 100.0,
        ..Config::default()
    };
    let set = placements(&config).unwrap();
    let mut node = VirtualImuNode::new(config, BodyModel::embedded(), &set, folder).unwrap();
    let states = bag.read::<SmplState>("/smpl/state").unwrap();
    states
        .iter()
        .flat_map(|(_, state)| node.step(state).unwrap().readings)
        .collect()
}

#[test]
fn a_device_with_effects_reads_live_what_it_reads_offline() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("device.yaml"), DEVICE).unwrap();
    fs::write(here.join("placements.yaml"), PLACEMENTS).unwrap();
    let mut lost = Vec::new();
    for (noise, option) in [(true, None), (false, Some("--no-noise"))] {
        let mut command = vec![
            "simulate",
            "--walk",
            "--placements",
            "placements.yaml",
            "--seed",
            "7",
        ];
        command.extend(["--duration", "4", "--trim", "0"]);
        command.extend(["--magnetic-field", FIELD, "--orientation", ORIENTATION]);
        command.extend(["--force", "--out", "offline.mcap"]);
        command.extend(option);
        succeed(here, &command);
        let bag = BagReader::open(&here.join("offline.mcap")).unwrap();
        let live = live(here, &bag, noise);
        for (number, name) in NAMES.into_iter().enumerate() {
            let read = |ending: &str| {
                let topic = format!("/imu/{name}/{ending}");
                bag.read::<Imu>(&topic).unwrap()
            };
            let (data_raw, data) = (read("data_raw"), read("data"));
            let mag = bag
                .read::<MagneticField>(&format!("/imu/{name}/mag"))
                .unwrap();
            let live: Vec<&ImuMessages> = live
                .iter()
                .filter(|(placement, _)| *placement == number)
                .map(|(_, messages)| messages)
                .collect();
            // The last frames release nothing live.
            assert!(
                live.len() + 4 >= data_raw.len() && live.len() > 300,
                "{name}"
            );
            for (live, ((_, data_raw), (_, data))) in live.iter().zip(data_raw.iter().zip(&data)) {
                same(&live.data_raw, data_raw);
                same(&live.data, data);
            }
            for (live, (_, mag)) in live.iter().zip(&mag) {
                same_field(live.mag.as_ref().unwrap(), mag);
            }
            let said: Vec<&Temperature> = live
                .iter()
                .filter_map(|it| it.temperature.as_ref())
                .collect();
            let temperature = bag
                .read::<Temperature>(&format!("/imu/{name}/temperature"))
                .unwrap();
            assert!(said.len() >= 4 && said.len() <= temperature.len());
            for (live, (_, offline)) in said.iter().zip(&temperature) {
                assert_eq!(*live, offline);
            }
            assert!(said[0].temperature == 22.0 && said[3].temperature > 28.0);
            lost.push(401 - data_raw.len());
        }
    }
    assert!(
        lost[0] > 10 && lost[1] > 10,
        "noise loses samples: {lost:?}"
    );
    assert_eq!(lost[2..], [0, 0], "without noise nothing is lost");
}
