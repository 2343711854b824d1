//! The recorder and the replay.

use std::time::{Duration, Instant};

use cromosim_bag::BagReader;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::rosbag2_interfaces as srv;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::Qos;
use cromosim_ros::testing::in_private_network;

use crate::common::{self, cromosim_in, text};
use crate::process::{PATIENCE, Process, observer};

#[test]
fn a_killed_recorder_loses_half_a_second_at_most() {
    in_private_network(
        "bags::a_killed_recorder_loses_half_a_second_at_most",
        || {
            let folder = tempfile::tempdir().unwrap();
            let recorder = Process::start(
                folder.path(),
                &["node", "recorder", "--ros-args", "-p", "bag_path:=bag"],
            );
            let node = observer();
            let publisher = node
                .publisher::<Imu>("/imu/x/data_raw", Qos::reliable().depth(1000))
                .unwrap();
            assert!(publisher.wait_for_subscriptions(1, PATIENCE));
            let mut imu = Imu::default();
            let begun = Instant::now();
            let mut sent = 0;
            while begun.elapsed() < Duration::from_secs(3) {
                imu.header.stamp.nanosec = sent;
                publisher.publish(&imu).unwrap();
                sent += 1;
                std::thread::sleep(Duration::from_millis(5));
            }
            let in_half_a_second = f64::from(sent) / begun.elapsed().as_secs_f64() * 0.5;
            recorder.signal("-KILL");
            drop(recorder);
            let output = cromosim_in(folder.path(), &["inspect", "bag"]);
            assert_eq!(
                output.status.code(),
                Some(2),
                "an unfinished bag says so: {}",
                text(&output)
            );
            common::succeed(folder.path(), &["bag", "recover", "bag"]);
            let kept = BagReader::open(&folder.path().join("bag_recovered"))
                .unwrap()
                .read::<Imu>("/imu/x/data_raw")
                .unwrap();
            assert!(
                kept.iter()
                    .enumerate()
                    .all(|(index, (_, imu))| imu.header.stamp.nanosec == index as u32),
                "nothing is missing in the middle"
            );
            let lost = f64::from(sent) - kept.len() as f64;
            assert!(
                lost <= in_half_a_second,
                "{lost} of {sent} lost; half a second are {in_half_a_second}"
            );
        },
    );
}

#[test]
fn a_bag_is_replayed_with_everything_in_it() {
    in_private_network("bags::a_bag_is_replayed_with_everything_in_it", || {
        let folder = tempfile::tempdir().unwrap();
        common::succeed(folder.path(), &["simulate", "--walk", "--out", "walk.mcap"]);
        let recorded = BagReader::open(&folder.path().join("walk.mcap")).unwrap();
        let node = observer();
        let wrist = node
            .subscription::<Imu>("/imu/left_wrist/data_raw", Qos::recorder().depth(5000))
            .unwrap();
        let states = node
            .subscription::<SmplState>("/smpl/state", Qos::recorder().depth(5000))
            .unwrap();
        let clock = node
            .subscription::<cromosim_msgs::rosgraph_msgs::Clock>("/clock", Qos::clock())
            .unwrap();
        let parameters = [
            "-p",
            "bag:=walk.mcap",
            "-p",
            "rate:=4.0",
            "-p",
            "clock_rate_hz:=50.0",
            "-p",
            "topics:=[/imu/left_wrist/data_raw, /smpl/state]",
            "-p",
            "ready_subscriptions:=1",
        ];
        let replay = Process::start(
            folder.path(),
            &[["node", "replay", "--ros-args"].as_slice(), &parameters].concat(),
        );
        let mut received = Vec::new();
        while let Some(message) = wrist
            .recv_timeout(if received.is_empty() {
                PATIENCE
            } else {
                Duration::from_secs(2)
            })
            .unwrap()
        {
            received.push(message.message);
        }
        let expected: Vec<Imu> = recorded
            .read::<Imu>("/imu/left_wrist/data_raw")
            .unwrap()
            .into_iter()
            .map(|(_, imu)| imu)
            .collect();
        assert_eq!(received.len(), expected.len());
        assert!(
            received == expected,
            "messages come out as they were recorded, stamps included"
        );
        let mut count = 0;
        while states.try_recv().unwrap().is_some() {
            count += 1;
        }
        assert_eq!(
            count,
            recorded.read::<SmplState>("/smpl/state").unwrap().len()
        );
        let last = std::iter::from_fn(|| clock.try_recv().unwrap())
            .last()
            .unwrap()
            .message
            .clock
            .nanos();
        assert!(
            (1_000_000_000..=11_100_000_000).contains(&last),
            "/clock shows the recording's time: {last}"
        );
        drop(replay);
    });
}

#[test]
fn playback_services_pause_step_seek_and_change_the_rate() {
    in_private_network(
        "bags::playback_services_pause_step_seek_and_change_the_rate",
        || {
            let folder = tempfile::tempdir().unwrap();
            let node = observer();
            let poses = node
                .subscription::<SmplPose>("/smpl/pose", Qos::recorder())
                .unwrap();
            let parameters = [
                "-p",
                "start_paused:=true",
                "-p",
                "clock_rate_hz:=10.0",
                "-r",
                "__ns:=/stage",
                "-r",
                "smpl/pose:=/smpl/pose",
            ];
            let replay = Process::start(
                folder.path(),
                &[["node", "replay", "--ros-args"].as_slice(), &parameters].concat(),
            );
            assert!(poses.wait_for_publishers(1, PATIENCE));
            let nothing = || {
                poses
                    .recv_timeout(Duration::from_millis(300))
                    .unwrap()
                    .is_none()
            };
            assert!(nothing(), "it begins paused");
            macro_rules! call {
                ($service:ident, $name:literal, $request:expr) => {{
                    let client = node
                        .client::<srv::$service>(concat!("/stage/replay/", $name))
                        .unwrap();
                    assert!(client.wait_for_service(PATIENCE));
                    client.call(&$request, PATIENCE).unwrap()
                }};
            }
            assert!(call!(IsPaused, "is_paused", srv::IsPausedRequest::default()).paused);
            assert_eq!(
                call!(Burst, "burst", srv::BurstRequest { num_messages: 3 }).actually_burst,
                3
            );
            let stamps: Vec<i64> = (0..3)
                .map(|_| {
                    poses
                        .recv_timeout(PATIENCE)
                        .unwrap()
                        .unwrap()
                        .message
                        .header
                        .stamp
                        .nanos()
                })
                .collect();
            assert_eq!(stamps[0], 1_000_000_000);
            assert!(nothing(), "three and no more");
            let time = cromosim_msgs::builtin_interfaces::Time::from_nanos(6_000_000_000);
            assert!(call!(Seek, "seek", srv::SeekRequest { time }).success);
            let beyond = cromosim_msgs::builtin_interfaces::Time::from_nanos(60_000_000_000);
            assert!(!call!(Seek, "seek", srv::SeekRequest { time: beyond }).success);
            assert!(call!(PlayNext, "play_next", srv::PlayNextRequest::default()).success);
            let after = poses
                .recv_timeout(PATIENCE)
                .unwrap()
                .unwrap()
                .message
                .header
                .stamp
                .nanos();
            assert!((6_000_000_000..6_020_000_000).contains(&after), "{after}");
            assert!(call!(SetRate, "set_rate", srv::SetRateRequest { rate: 5.0 }).success);
            assert!(!call!(SetRate, "set_rate", srv::SetRateRequest { rate: -1.0 }).success);
            assert_eq!(
                call!(GetRate, "get_rate", srv::GetRateRequest::default()).rate,
                5.0
            );
            call!(Resume, "resume", srv::ResumeRequest::default());
            let mut last = 0;
            while let Some(pose) = poses.recv_timeout(Duration::from_secs(3)).unwrap() {
                last = pose.message.header.stamp.nanos();
            }
            assert!(last > 10_900_000_000, "it plays to the end: {last}");
            drop(replay);
        },
    );
}
