//! What nodes that use IMUs (`imu_filter_madgwick`, `robot_localization`) expect of their topics.

use std::time::{Duration, Instant};

use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_ros::testing::in_private_network;
use cromosim_ros::{Qos, Subscription};

use crate::process::{PATIENCE, Process, observer};

fn heard<M: RosMessage>(topic: &Subscription<M>, count: usize) -> Vec<M> {
    let until = Instant::now() + PATIENCE;
    let mut messages = Vec::new();
    while messages.len() < count && Instant::now() < until {
        let received = topic.recv_timeout(Duration::from_secs(1)).unwrap();
        messages.extend(received.map(|received| received.message));
    }
    assert_eq!(messages.len(), count, "too few messages");
    messages
}

#[test]
fn a_placement_remapped_is_rep_145s_imu() {
    in_private_network("imu_users::a_placement_remapped_is_rep_145s_imu", || {
        let folder = tempfile::tempdir().unwrap();
        let node = observer();
        let of = |topic| node.subscription::<Imu>(topic, Qos::recorder()).unwrap();
        let (raw, data) = (of("/imu/data_raw"), of("/imu/data"));
        let mag = node
            .subscription::<MagneticField>("/imu/mag", Qos::recorder())
            .unwrap();
        let run = |name: &str, arguments: &str| {
            let line = format!("node {name} --ros-args {arguments}");
            Process::start(folder.path(), &line.split(' ').collect::<Vec<_>>())
        };
        let remaps = "-r imu/pelvis/data_raw:=imu/data_raw -r imu/pelvis/data:=imu/data -r imu/pelvis/mag:=imu/mag";
        let set = "-p rate_hz:=50.0 -p magnetic_field:=0,1.9e-5,-4.5e-5 -p orientation:=madgwick";
        let _imus = run("virtual_imu", &format!("{remaps} {set}"));
        assert!(raw.wait_for_publishers(1, PATIENCE) && data.wait_for_publishers(1, PATIENCE));
        assert!(mag.wait_for_publishers(1, PATIENCE));
        let _state = run("smpl_state", "-p ready_subscriptions:=1");
        let _replay = run("replay", "-p ready_subscriptions:=1");
        let (raw, data, mag) = (heard(&raw, 50), heard(&data, 50), heard(&mag, 50));
        // imu_filter_madgwick takes a reading and a field of one stamp.
        for (message, field) in raw.iter().zip(&mag) {
            assert_eq!(message.header, field.header);
            let (m, covariance) = (&field.magnetic_field, field.magnetic_field_covariance);
            let strength = (m.x * m.x + m.y * m.y + m.z * m.z).sqrt();
            assert!((4e-5..6e-5).contains(&strength), "{strength} T");
            assert!(covariance[0] > 0.0 && covariance[0] == covariance[8]);
        }
        for messages in [&raw, &data] {
            let stamps: Vec<i64> = messages.iter().map(|m| m.header.stamp.nanos()).collect();
            let apart = |pair: &[i64]| (pair[1] - pair[0]) as f64 * 1e-9;
            // Lost samples of the device leave a gap of some periods.
            assert!(
                stamps.windows(2).all(|pair| {
                    let periods = apart(pair) * 50.0;
                    periods > 0.5 && (periods - periods.round()).abs() < 0.25
                }),
                "50 Hz, in order: {stamps:?}"
            );
        }
        let diagonal = |covariance: [f64; 9]| [covariance[0], covariance[4], covariance[8]];
        for message in raw.iter().chain(&data) {
            assert_eq!(message.header.frame_id, "pelvis_imu");
            for covariance in [
                message.linear_acceleration_covariance,
                message.angular_velocity_covariance,
            ] {
                assert!(diagonal(covariance).iter().all(|variance| *variance > 0.0));
            }
        }
        assert!(raw.iter().all(|m| m.orientation_covariance[0] == -1.0));
        for message in &data {
            let q = message.orientation;
            let norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
            assert!((norm - 1.0).abs() < 1e-9);
            assert!(
                diagonal(message.orientation_covariance)
                    .iter()
                    .all(|v| *v > 0.0)
            );
        }
    });
}
