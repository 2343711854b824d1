//! The node gap_monitor over DDS, in a private network namespace: real and virtual messages in,
//! /diagnostics out.
#![allow(clippy::unwrap_used)]

mod common;

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{CROMOSIM, cromosim_in, root, text};
use cromosim_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_ros::testing::{environment, in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RosArgs};

const PATIENCE: Duration = Duration::from_secs(30);

/// Killed when the test ends.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn imu(nanos: i64, error: f64) -> Imu {
    let seconds = nanos as f64 * 1e-9 % 1000.0;
    let mut imu = Imu {
        header: Header::new(nanos, "imu"),
        ..Imu::default()
    };
    imu.linear_acceleration.x = 2.0 * (3.0 * seconds).sin() + error;
    imu.linear_acceleration.y = 1.5 * (5.0 * seconds).cos();
    imu.linear_acceleration.z = 9.8 + (4.0 * seconds).sin();
    imu.angular_velocity.x = (2.0 * seconds).sin();
    imu.angular_velocity.y = 0.7 * (3.3 * seconds).cos();
    imu.angular_velocity.z = 0.5 * (5.1 * seconds).sin();
    imu
}

#[test]
fn a_biased_imu_is_reported_on_diagnostics() {
    in_private_network("a_biased_imu_is_reported_on_diagnostics", || {
        let folder = tempfile::tempdir().unwrap();
        let parameters = [
            "node",
            "gap_monitor",
            "--ros-args",
            "-p",
            "placements:=[wrist]",
            "-p",
            "rate_hz:=5.0",
            "-p",
            "window_s:=2.0",
        ];
        let mut command = Command::new(CROMOSIM);
        command
            .args(parameters)
            .current_dir(folder.path())
            .envs(environment())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        let _monitor = Process(command.spawn().unwrap());

        let args = RosArgs::parse(Vec::<String>::new()).unwrap();
        let node = Node::start(
            NodeOptions::new("observer", &args, &Parameters::new())
                .unwrap()
                .network(network()),
        )
        .unwrap();
        let said = node
            .subscription::<DiagnosticArray>("/diagnostics", Qos::reliable().depth(100))
            .unwrap();
        // A driver with ROS's profile of sensor data, and a reliable virtual IMU.
        let measured = node
            .publisher::<Imu>("/imu/wrist/data_raw", Qos::sensor_data())
            .unwrap();
        let simulated = node
            .publisher::<Imu>("/virtual/wrist/data_raw", Qos::reliable())
            .unwrap();
        assert!(
            measured.wait_for_subscriptions(1, PATIENCE)
                && simulated.wait_for_subscriptions(1, PATIENCE)
        );

        let until = Instant::now() + PATIENCE;
        let mut last = None;
        while Instant::now() < until {
            let nanos = node.now().nanos;
            measured.publish(&imu(nanos, 0.8)).unwrap();
            simulated.publish(&imu(nanos, 0.0)).unwrap();
            std::thread::sleep(Duration::from_millis(10));
            while let Some(received) = said.try_recv().unwrap() {
                last = received
                    .message
                    .status
                    .into_iter()
                    .find(|status| status.name == "/gap_monitor: wrist");
            }
            if last.as_ref().is_some_and(|status: &DiagnosticStatus| {
                status.level == DiagnosticStatus::WARN && status.message.contains("accel_bias")
            }) {
                return;
            }
        }
        panic!("the bias was not reported; the last status: {last:?}");
    });
}

#[test]
fn the_node_is_part_of_the_command_line_and_its_files_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let file = root().join("config/gap_monitor.yaml");
    let said = common::succeed(
        folder.path(),
        &[
            "node",
            "gap_monitor",
            "--check-config",
            "--ros-args",
            "--params-file",
            file.to_str().unwrap(),
        ],
    );
    assert!(said.contains("is valid"), "{said}");
    let output = cromosim_in(folder.path(), &["node", "gap_monitor", "--check-config"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output).starts_with("error: parameter 'placements': expected the names"),
        "{}",
        text(&output)
    );
    let scripts = root().join("launch_scripts");
    assert!(
        Command::new("bash")
            .arg("-n")
            .arg(scripts.join("gap.sh"))
            .status()
            .unwrap()
            .success()
    );
    let compile = "import ast, sys; ast.parse(open(sys.argv[1]).read())";
    assert!(
        Command::new("python3")
            .args(["-c", compile])
            .arg(scripts.join("gap.launch.py"))
            .status()
            .unwrap()
            .success()
    );
}
