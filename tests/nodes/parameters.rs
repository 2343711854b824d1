//! Parameters that change while nodes run, as `ros2 param set` changes them.

use cromosim_msgs::rosbag2_interfaces as srv;
use cromosim_ros::Node;
use cromosim_ros::testing::in_private_network;

use crate::process::{PATIENCE, Process, observer};

/// `rcl_interfaces/msg/ParameterValue`: its type, then a field for each.
type Value = (
    u8,
    bool,
    i64,
    f64,
    String,
    Vec<u8>,
    Vec<bool>,
    Vec<i64>,
    Vec<f64>,
    Vec<String>,
);

fn boolean(value: bool) -> Value {
    (
        1,
        value,
        0,
        0.0,
        String::new(),
        vec![],
        vec![],
        vec![],
        vec![],
        vec![],
    )
}

fn integer(value: i64) -> Value {
    (
        2,
        false,
        value,
        0.0,
        String::new(),
        vec![],
        vec![],
        vec![],
        vec![],
        vec![],
    )
}

fn double(value: f64) -> Value {
    (
        3,
        false,
        0,
        value,
        String::new(),
        vec![],
        vec![],
        vec![],
        vec![],
        vec![],
    )
}

fn text(value: &str) -> Value {
    (
        4,
        false,
        0,
        0.0,
        value.to_owned(),
        vec![],
        vec![],
        vec![],
        vec![],
        vec![],
    )
}

/// Success and reason, as `ros2 param set` gets them.
fn set(node: &Node, of: &str, name: &str, value: Value) -> (bool, String) {
    let client = node
        .client_as::<Vec<(String, Value)>, Vec<(bool, String)>>(
            &format!("{of}/set_parameters"),
            "rcl_interfaces/srv/SetParameters",
        )
        .unwrap();
    assert!(client.wait_for_service(PATIENCE));
    let answer = client.call(&vec![(name.to_owned(), value)], PATIENCE);
    answer.unwrap().remove(0)
}

fn get(node: &Node, of: &str, name: &str) -> Value {
    let client = node
        .client_as::<Vec<String>, Vec<Value>>(
            &format!("{of}/get_parameters"),
            "rcl_interfaces/srv/GetParameters",
        )
        .unwrap();
    assert!(client.wait_for_service(PATIENCE));
    let answer = client.call(&vec![name.to_owned()], PATIENCE);
    answer.unwrap().remove(0)
}

/// Each is refused with words that hold the given ones, and the value stays.
fn refuses(node: &Node, of: &str, name: &str, value: Value, reason: &str) {
    let before = get(node, of, name);
    let (successful, why) = set(node, of, name, value);
    assert!(!successful && why.contains(reason), "{name}: {why:?}");
    assert_eq!(get(node, of, name), before);
}

#[test]
fn virtual_imu_takes_up_noise_seed_networks_and_mapping() {
    in_private_network(
        "parameters::virtual_imu_takes_up_noise_seed_networks_and_mapping",
        || {
            let folder = tempfile::tempdir().unwrap();
            let node = observer();
            let imus = Process::start(
                folder.path(),
                &["node", "virtual_imu", "--ros-args", "-r", "__ns:=/people"],
            );
            let of = "/people/virtual_imu";
            let done = (true, String::new());
            assert_eq!(set(&node, of, "noise", boolean(false)), done);
            assert_eq!(set(&node, of, "seed", integer(7)), done);
            assert_eq!(set(&node, of, "learned", text("streaming")), done);
            assert_eq!(set(&node, of, "learned", text("")), done);
            assert_eq!(get(&node, of, "seed"), integer(7));
            refuses(&node, of, "mapping", text("gone.yaml"), "gone.yaml");
            refuses(&node, of, "learned", text("nowhere"), "nowhere");
            refuses(&node, of, "noise", text("loud"), "expected a boolean");
            refuses(&node, of, "rate_hz", double(50.0), "read-only");
            refuses(&node, of, "placements", text("other.yaml"), "read-only");
            imus.interrupt();
        },
    );
}

#[test]
fn replay_takes_up_rate_and_loop() {
    in_private_network("parameters::replay_takes_up_rate_and_loop", || {
        let folder = tempfile::tempdir().unwrap();
        let node = observer();
        let begin_at_once = "ready_subscriptions:=0";
        let replay = Process::start(
            folder.path(),
            &[
                "node",
                "replay",
                "--ros-args",
                "-p",
                begin_at_once,
                "-p",
                "start_paused:=true",
            ],
        );
        let rate = node.client::<srv::GetRate>("/replay/get_rate").unwrap();
        assert!(rate.wait_for_service(PATIENCE));
        let plays_at = || {
            rate.call(&srv::GetRateRequest::default(), PATIENCE)
                .unwrap()
                .rate
        };
        let done = (true, String::new());
        assert_eq!(set(&node, "/replay", "rate", double(100.0)), done);
        assert_eq!(plays_at(), 100.0);
        refuses(&node, "/replay", "rate", double(-1.0), "positive factor");
        refuses(&node, "/replay", "motion", text("x.bvh"), "read-only");
        assert_eq!(plays_at(), 100.0);
        // What rosbag2's service sets is the parameter's value too.
        let other = node.client::<srv::SetRate>("/replay/set_rate").unwrap();
        let request = srv::SetRateRequest { rate: 50.0 };
        assert!(
            other.wait_for_service(PATIENCE) && other.call(&request, PATIENCE).unwrap().success
        );
        assert_eq!(get(&node, "/replay", "rate"), double(50.0));

        // Ten seconds at 50 times the speed, then the silence: it would have ended without the loop.
        assert_eq!(set(&node, "/replay", "loop", boolean(true)), done);
        let poses = node
            .subscription::<cromosim_msgs::cromosim_msgs::SmplPose>(
                "/smpl/pose",
                cromosim_ros::Qos::recorder(),
            )
            .unwrap();
        assert!(poses.wait_for_publishers(1, PATIENCE));
        let resume = node.client::<srv::Resume>("/replay/resume").unwrap();
        assert!(resume.wait_for_service(PATIENCE));
        resume
            .call(&srv::ResumeRequest::default(), PATIENCE)
            .unwrap();
        let roots = || {
            let pose = poses.recv_timeout(PATIENCE).unwrap().unwrap();
            pose.message.world_from_pelvis.position.x
        };
        let first = roots();
        let again = (0..3000).any(|_| roots() == first);
        assert!(again, "the first pose comes again");
        assert_eq!(set(&node, "/replay", "loop", boolean(false)), done);
        let mut replay = replay;
        let until = std::time::Instant::now() + PATIENCE;
        while !replay.has_succeeded() {
            assert!(
                std::time::Instant::now() < until,
                "it ends without the loop"
            );
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    });
}
