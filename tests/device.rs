//! `cromosim device`: devices of recordings at rest, of Kalibr's files and of diagnoses.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use common::{python, refuses, root, skipped, succeed, text};
use cromosim_imu::allan::allan_curve;
use cromosim_imu::{Device, DrawnBiases, EMBEDDED_DEVICES, NoiseSource};
use cromosim_spatial::Stamp;

const RATE_HZ: f64 = 50.0;

/// An IMU series at rest of a device, as a table.
fn write_still(path: &Path, device: &str, count: usize) {
    let device = Device::parse(device, "known.yaml").unwrap();
    let mut white = NoiseSource::white(&device.declared_noise(), 0.0, RATE_HZ, 9, "still").unwrap();
    let mut biases = DrawnBiases::new(device.effects(), 9, "still").unwrap();
    let mut table = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n".to_owned();
    for k in 0..count as i64 {
        let nanos = 1_700_000_000_000_000_000 + k * 20_000_000;
        let mut reading = white.draw();
        reading.specific_force.z += 9.80665;
        biases.add_to(&mut reading, Stamp::from_nanos(nanos));
        let (w, f) = (reading.angular_velocity, reading.specific_force);
        writeln!(
            table,
            "{nanos},{},{},{},{},{},{}",
            w.x, w.y, w.z, f.x, f.y, f.z
        )
        .unwrap();
    }
    std::fs::write(path, table).unwrap();
}

const KNOWN: &str = "schema: cromosim/device/1
declared_noise: {accel_density: 0.002, gyro_density: 0.00015}
effects:
- {effect: accel_bias_instability, deviation: 0.0008, time_constant: 12.0}
- {effect: gyro_bias_walk, density: 0.00002}
";

#[test]
fn a_recording_at_rest_becomes_a_device_with_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_still(&here.join("still.csv"), KNOWN, 100_000);
    let said = succeed(
        here,
        &["device", "from-allan", "still.csv", "--out", "made"],
    );
    assert!(
        said.contains("bias walk") && said.contains("not seen"),
        "{said}"
    );
    let made = Device::read(&here.join("made/body.yaml")).unwrap();
    let near = |found: f64, truth: f64, part: f64| (found / truth - 1.0).abs() < part;
    assert!(
        near(made.accel_density(), 0.002, 0.02),
        "{}",
        made.accel_density()
    );
    assert!(
        near(made.gyro_density(), 0.00015, 0.02),
        "{}",
        made.gyro_density()
    );
    let names: Vec<_> = made.effects().iter().map(|it| it.kind().name()).collect();
    assert_eq!(names, ["accel_bias_instability", "gyro_bias_walk"]);
    for channel in ["accelerometer", "gyroscope"] {
        let svg = std::fs::read_to_string(here.join(format!("made/body_{channel}.svg"))).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.contains("<style>"),
            "{channel}"
        );
        assert!(svg.contains("averaging time") && svg.contains("class=\"reference\""));
    }
    // Nothing is replaced, and the same comes out again.
    refuses(
        here,
        &["device", "from-allan", "still.csv", "--out", "made"],
        &["body.yaml: exists already", "--force"],
    );
    let before = std::fs::read(here.join("made/body.yaml")).unwrap();
    succeed(
        here,
        &[
            "device",
            "from-allan",
            "still.csv",
            "--out",
            "made",
            "--force",
        ],
    );
    assert_eq!(std::fs::read(here.join("made/body.yaml")).unwrap(), before);
    // The device serves where devices do, by its file.
    succeed(
        here,
        &[
            "simulate",
            "--walk",
            "--device",
            "made/body.yaml",
            "--duration",
            "2",
            "--out",
            "walk.mcap",
        ],
    );
    refuses(
        here,
        &["device", "from-allan", "walk.mcap", "--out", "walked"],
        &["walk.mcap, head: ", "readings without a gap"],
    );
    assert!(!here.join("walked").exists());
}

#[test]
fn kalibr_diagnoses_and_names_become_devices() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let kalibr = "accelerometer_noise_density: 1.86e-03\naccelerometer_random_walk: 4.33e-04\ngyroscope_noise_density: 1.87e-04\ngyroscope_random_walk: 2.66e-05\nrostopic: /imu0\nupdate_rate: 200.0\n";
    std::fs::write(here.join("imu.yaml"), kalibr).unwrap();
    succeed(
        here,
        &["device", "from-kalibr", "imu.yaml", "--out", "mine.yaml"],
    );
    succeed(
        here,
        &[
            "device",
            "to-kalibr",
            "mine.yaml",
            "--topic",
            "/imu0",
            "--rate",
            "200",
            "--out",
            "back.yaml",
        ],
    );
    let back = std::fs::read_to_string(here.join("back.yaml")).unwrap();
    assert!(back.contains("gyroscope_random_walk: 2.66e-5\n"), "{back}");
    std::fs::write(here.join("bad.yaml"), kalibr.replace("1.87e-04", "much")).unwrap();
    refuses(
        here,
        &[
            "device",
            "from-kalibr",
            "bad.yaml",
            "--out",
            "bad_device.yaml",
        ],
        &["bad.yaml: gyroscope_noise_density: no such number"],
    );
    assert!(!here.join("bad_device.yaml").exists());

    let effects = "schema: cromosim/effects/1
placements:
  wrist:
    epoch: 1700000000.0
    declared_noise: {accel_density: 0.0014, gyro_density: 0.00012}
    effects:
      - {effect: reference_tilt, rotvec: [0.01, 0.0, 0.0]}
      - {effect: accel_bias, bias: [0.1, 0.0, 0.0]}
      - {effect: gyro_saturation, limit: 8.7}
    unexplained: {accel_variance: 0.002, gyro_variance: 1.0e-5, gyro_late: -0.001}
";
    std::fs::create_dir(here.join("diagnosis")).unwrap();
    std::fs::write(here.join("diagnosis/effects.yaml"), effects).unwrap();
    let said = succeed(
        here,
        &["device", "from-diagnosis", "diagnosis", "--out", "found"],
    );
    assert!(said.contains("left out: reference_tilt"), "{said}");
    let wrist = Device::read(&here.join("found/wrist.yaml")).unwrap();
    let names: Vec<_> = wrist.effects().iter().map(|it| it.kind().name()).collect();
    assert_eq!(names, ["accel_bias", "gyro_saturation"]);
    assert_eq!(wrist.unexplained().variance.accelerometer, 0.002);
    assert_eq!(wrist.gyro_density(), 0.00012);

    let list = succeed(here, &["device", "show"]);
    for (name, _) in EMBEDDED_DEVICES {
        assert!(
            list.lines().any(|line| line.starts_with(name)),
            "{name} in {list}"
        );
        let shown = succeed(here, &["device", "show", name]);
        assert!(
            shown.contains("white noise") && shown.contains("Allan deviation"),
            "{shown}"
        );
    }
    let sheet = succeed(here, &["device", "show", "icm20948"]);
    assert!(
        sheet.contains("230.0 ug/sqrt(Hz)") && sheet.contains("DS-000189"),
        "{sheet}"
    );
    refuses(here, &["device", "show", "bmi999"], &["bmi999", "bmi270"]);
    assert!(succeed(here, &["completion", "bash"]).contains("movella_dot"));
}

#[test]
fn allantools_finds_the_same_deviations() {
    let Some(python) = python() else { return };
    let has_it = Command::new(&python)
        .args(["-c", "import allantools"])
        .output()
        .unwrap();
    if !has_it.status.success() {
        return skipped("no allantools in CROMOSIM_PYTHON");
    }
    let folder = tempfile::tempdir().unwrap();
    write_still(&folder.path().join("still.csv"), KNOWN, 20_000);
    let table = std::fs::read_to_string(folder.path().join("still.csv")).unwrap();
    let column = |k: usize| -> Vec<f64> {
        let rows = table.lines().skip(1);
        rows.map(|row| row.split(',').nth(k).unwrap().parse().unwrap())
            .collect()
    };
    let output = Command::new(&python)
        .arg(root().join("tests/interop/allan.py"))
        .arg(folder.path().join("still.csv"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    let found = String::from_utf8(output.stdout).unwrap();
    let (mut worst, mut count): (f64, usize) = (0.0, 0);
    for (k, lines) in [1, 4].into_iter().zip(found.split("\n\n")) {
        let curve = allan_curve(&column(k), RATE_HZ);
        for (point, line) in curve.iter().zip(lines.lines()) {
            let theirs: Vec<f64> = line
                .split(' ')
                .take(3)
                .map(|it| it.parse().unwrap())
                .collect();
            assert!((point.tau_s / theirs[0] - 1.0).abs() < 1e-9, "{line}");
            let ours = [point.deviation, point.degrees_of_freedom];
            let theirs = [theirs[1], theirs[2]];
            worst = worst.max((ours[0] / theirs[0] - 1.0).abs());
            // Their degrees of freedom of the one noise, of three, that the slope shows here.
            if line.ends_with("same") {
                worst = worst.max((ours[1] / theirs[1] - 1.0).abs());
            }
            count += 1;
        }
    }
    println!("{count} points, worst relative difference {worst:.1e}");
    assert!(count > 40 && worst < 1e-6, "{count} {worst}");
}
