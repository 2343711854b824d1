//! The paper's protocol, from its training file to its table, on files laid out as TotalCapture's
//! that the test makes: five people who walk.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use common::{root, succeed};
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory, simulate};
use cromosim_motion::embedded_walk;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

const METRES_PER_INCH: f64 = 0.0254;
const RATE_HZ: f64 = 60.0;
const SENSORS: [(&str, &str, Joint); 4] = [
    ("Pelvis", "Hips", Joint::Pelvis),
    ("R_LowArm", "RightForeArm", Joint::RightElbow),
    ("L_LowArm", "LeftForeArm", Joint::LeftElbow),
    ("R_Foot", "RightFoot", Joint::RightAnkle),
];

/// A subject's trial: sensors 3 cm off their joints, turned, and so that the wrist's accelerometer
/// reads 4 % too much.
fn write_trial(folder: &Path, subject: usize) {
    let walk = embedded_walk()
        .slice(0.5 * subject as f64, Some(6.0))
        .unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &[0.5 * subject as f64 - 1.0]).unwrap();
    let stamps: Vec<Stamp> = (0..walk.frames.len())
        .map(|frame| Stamp::from_seconds(frame as f64 / RATE_HZ))
        .collect();
    let segments: Vec<_> = walk
        .frames
        .iter()
        .map(|pose| body.world_from_segments(pose))
        .collect();
    let z_up_from_y_up =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let (mut positions, mut orientations) = (String::new(), String::new());
    let names = SENSORS.map(|(_, joint, _)| joint).join("\t");
    writeln!(positions, "{names}").unwrap();
    writeln!(orientations, "{names}").unwrap();
    let mut lines = vec![String::new(); stamps.len()];
    for (number, (sensor, _, joint)) in SENSORS.into_iter().enumerate() {
        let mount =
            UnitQuaternion::from_euler_angles(0.3 * number as f64, 0.2 * subject as f64, -0.4);
        let joint_from_sensor =
            Isometry3::from_parts(Vector3::new(0.02, 0.02, -0.01).into(), mount);
        let frames: Vec<_> = stamps
            .iter()
            .zip(&segments)
            .map(|(stamp, segments)| {
                SensorFrame::new(*stamp, segments[joint.index()] * joint_from_sensor)
            })
            .collect();
        let readings = simulate(
            &SensorTrajectory::new(frames.clone()).unwrap(),
            Scheme::Spline,
            &stamps,
        )
        .unwrap();
        for ((line, frame), reading) in lines.iter_mut().zip(&frames).zip(&readings) {
            let turn = frame.world_from_sensor.rotation;
            let force = reading.specific_force
                * if sensor.ends_with("LowArm") {
                    1.04
                } else {
                    1.0
                };
            let rate = reading.angular_velocity;
            write!(
                line,
                "{sensor}\t{}\t{}\t{}\t{}",
                turn.w, turn.i, turn.j, turn.k
            )
            .unwrap();
            writeln!(
                line,
                "\t{}\t{}\t{}\t{}\t{}\t{}\t0.2\t0.1\t-0.4",
                force.x, force.y, force.z, rate.x, rate.y, rate.z
            )
            .unwrap();
        }
    }
    for segments in &segments {
        for (_, _, joint) in SENSORS {
            let own = segments[joint.index()];
            let at = z_up_from_y_up.inverse() * own.translation.vector / METRES_PER_INCH;
            let turn = z_up_from_y_up.inverse() * own.rotation;
            write!(positions, "{} {} {}\t", at.x, at.y, at.z).unwrap();
            write!(
                orientations,
                "{} {} {} {}\t",
                turn.i, turn.j, turn.k, turn.w
            )
            .unwrap();
        }
        positions.push('\n');
        orientations.push('\n');
    }
    let mut sensors = format!("{}\t{}\n", SENSORS.len(), stamps.len());
    for (number, line) in lines.iter().enumerate() {
        write!(sensors, "{}\n{line}", number + 1).unwrap();
    }
    let here = folder.join(format!("S{subject}"));
    fs::create_dir_all(here.join("walking1")).unwrap();
    fs::write(here.join("walking1_Xsens_AuxFields.sensors"), sensors).unwrap();
    // Without gyroscopes: the data set has both, and the protocol has to leave it alone.
    fs::write(
        here.join("walking1_Xsens.sensors"),
        "1\t1\n1\nHead\t1\t0\t0\t0\t0\t0\t9.8\n",
    )
    .unwrap();
    fs::write(here.join("walking1/gt_skel_gbl_pos.txt"), positions).unwrap();
    fs::write(here.join("walking1/gt_skel_gbl_ori.txt"), orientations).unwrap();
}

#[test]
fn the_papers_protocol_runs_from_training_to_table() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    (1..=5).for_each(|subject| write_trial(&here.join("totalcapture"), subject));
    let training = fs::read_to_string(root().join("config/training/totalcapture.yaml")).unwrap();
    // The file's own, but for its size.
    let small = [
        ("channels: 32", "channels: 8"),
        ("hidden: 64", "hidden: 16"),
        ("steps: 3000", "steps: 80"),
        ("validate_every: 100", "validate_every: 20"),
    ];
    let training = small.into_iter().fold(training, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    fs::write(here.join("training.yaml"), training).unwrap();
    let said = succeed(
        here,
        &[
            "train",
            "training.yaml",
            "--data",
            "totalcapture",
            "--out",
            "models/totalcapture",
        ],
    );
    assert!(
        said.contains("| R_LowArm |") && said.contains("| Pelvis |") && !said.contains("L_LowArm"),
        "{said}"
    );
    let card = fs::read_to_string(here.join("models/totalcapture/card.md")).unwrap();
    assert!(
        card.contains("TotalCapture, research only")
            && card.contains("4 (validation)")
            && !card.contains("| 5"),
        "{card}"
    );

    let protocol = root()
        .join("config/evaluation/totalcapture.yaml")
        .display()
        .to_string();
    let command = [
        "evaluate",
        "fidelity",
        "--protocol",
        &protocol,
        "--data",
        "totalcapture",
        "--models",
        "models",
        "--out",
        "out",
    ];
    let said = succeed(here, &command);
    assert!(said.contains("TotalCapture"), "{said}");
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("out/results.json")).unwrap()).unwrap();
    let positions = results["studies"][0]["positions"].as_array().unwrap();
    let names: Vec<_> = positions
        .iter()
        .map(|position| position["position"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["L_LowArm", "R_LowArm", "all"]);
    for position in positions {
        let rmse = |simulator: &str| {
            let all = position["simulators"].as_array().unwrap();
            let own = all
                .iter()
                .find(|own| own["simulator"] == simulator)
                .unwrap_or_else(|| panic!("{simulator}"));
            [0, 1].map(|which| own["rmse"][which].as_f64().unwrap())
        };
        // Inches, axes, mounts and times have found each other: what is left is 3 cm of lever arm
        // and 4 % of scale.
        let (spline, learned) = (rmse("spline"), rmse("learned"));
        assert!(spline[0] < 0.8 && spline[1] < 0.05, "{spline:?}");
        // Subject 5 and the left wrist were not seen, yet the scale was learned.
        assert!(learned[0] < spline[0], "{learned:?}, spline {spline:?}");
        assert!(rmse("mapped")[0] < spline[0] && rmse("perfect")[0] < 1e-6);
    }
}
