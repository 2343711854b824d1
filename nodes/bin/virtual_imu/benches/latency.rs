//! Live latency from SmplState to Imu, beyond the scheme's own delay: `cargo bench -p
//! cromosim_virtual_imu`.
//!
//! A process of its own runs the node; this one publishes the states of the embedded walk at 100 Hz
//! and receives `imu/NAME/data_raw` of every placement over DDS, in a private network namespace. A
//! sample's latency is the time from just before the publication of the state that released it to
//! its reception here, so two hops of DDS are in it. Goal: p99 under 2 ms at 5 and at 17
//! placements. The last case also receives `data`, whose orientation VQF fuses, and `mag`. The
//! subscriptions are a second deep: where RustDDS holds a recorder's thousand messages, it goes through
//! those older than 5 s at every 64th, on all topics at once.
#![allow(missing_docs)]

use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use cromosim_imu::PlacementSet;
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_msgs::std_msgs::Header;
use cromosim_ros::testing::{environment, inside_private_network, network};
use cromosim_ros::{Bell, Clock, Node, NodeOptions, Parameters, Qos, RosArgs, Subscription};

const NODE: &str = "CROMOSIM_BENCH_NODE";
/// Set where the node fuses orientations and has magnetometers.
const COMPLETE: &str = "CROMOSIM_BENCH_COMPLETE";
const STATES: usize = 1000;
const INTERVAL_NANOS: i64 = 10_000_000;
/// A second of messages.
const DEEP: Qos = Qos::reliable().depth(100);
/// Left out: connections, caches and the first look at the states' rate.
const WARM_UP: usize = 100;

fn main() {
    if let Ok(placements) = std::env::var(NODE) {
        let mut arguments = ["--ros-args", "-p", &format!("placements:='{placements}'")]
            .map(str::to_owned)
            .to_vec();
        if std::env::var_os(COMPLETE).is_some() {
            let complete = [
                "-p",
                "magnetic_field:=0,1.9e-5,-4.5e-5",
                "-p",
                "orientation:=vqf",
            ];
            arguments.extend(complete.map(str::to_owned));
        }
        cromosim_virtual_imu::run(&arguments).expect("the node runs");
        return;
    }
    // `cargo test --benches` asks for a list, and gets none.
    if std::env::args().any(|argument| argument == "--list" || argument == "--test") {
        return;
    }
    if !cromosim_ros::testing::is_private()
        && let Some(mut command) = inside_private_network(&[])
    {
        assert!(
            command
                .status()
                .expect("this program starts again")
                .success()
        );
        return;
    }
    println!("latency from SmplState to Imu over DDS, {STATES} states at 100 Hz, adaptive_spline");
    let folder = std::env::temp_dir();
    for (name, set, is_complete) in [
        ("5 placements", PlacementSet::demo(), false),
        ("17 placements", PlacementSet::full17(), false),
        (
            "17 placements, with data by VQF and mag",
            PlacementSet::full17(),
            true,
        ),
    ] {
        let file = folder.join(format!("cromosim_latency_{}.yaml", std::process::id()));
        std::fs::write(&file, set.to_yaml()).expect("a temporary file can be written");
        let latencies = measure(&set, &file.display().to_string(), is_complete);
        std::fs::remove_file(&file).expect("the temporary file is there");
        let at = |fraction: f64| {
            1e3 * latencies[((latencies.len() - 1) as f64 * fraction).round() as usize]
        };
        println!(
            "{name}: {} samples, p50 {:.2} ms, p99 {:.2} ms, max {:.2} ms",
            latencies.len(),
            at(0.5),
            at(0.99),
            at(1.0)
        );
    }
}

/// A topic that is received beside those that are timed.
fn heard<M: RosMessage>(node: &Node, name: &str, ending: &str) -> Subscription<M> {
    node.subscription::<M>(&format!("imu/{name}/{ending}"), DEEP)
        .expect("a subscription")
}

/// The node's process; ended with its owner.
struct NodeProcess(Child);

impl Drop for NodeProcess {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn measure(set: &PlacementSet, file: &str, is_complete: bool) -> Vec<f64> {
    let program = std::env::current_exe().expect("this program has a path");
    let mut command = Command::new(program);
    command.env(NODE, file).envs(environment());
    if is_complete {
        command.env(COMPLETE, "1");
    }
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let _node_process = NodeProcess(child.expect("the node's process starts"));
    let args = RosArgs::parse(Vec::<String>::new()).expect("no arguments");
    let node = Node::start(
        NodeOptions::new("bench", &args, &Parameters::new())
            .expect("valid")
            .network(network()),
    )
    .expect("DDS starts");
    let states = node
        .publisher::<SmplState>("smpl/state", Qos::reliable())
        .expect("a publisher");
    let bell = Bell::new();
    let subscribe = |name: &str| {
        let subscription = node
            .subscription::<Imu>(&format!("imu/{name}/data_raw"), DEEP)
            .expect("a subscription");
        subscription.ring(Arc::clone(&bell));
        subscription
    };
    let imus: Vec<Subscription<Imu>> = set
        .placements()
        .iter()
        .map(|placement| subscribe(placement.name()))
        .collect();
    let names = || {
        set.placements()
            .iter()
            .filter(|_| is_complete)
            .map(|it| it.name())
    };
    let _data: Vec<_> = names()
        .map(|name| heard::<Imu>(&node, name, "data"))
        .collect();
    let _mag: Vec<_> = names()
        .map(|name| heard::<MagneticField>(&node, name, "mag"))
        .collect();
    let long = Duration::from_secs(20);
    assert!(
        states.wait_for_subscriptions(1, long)
            && imus.iter().all(|imu| imu.wait_for_publishers(1, long)),
        "no connection"
    );

    let walk = cromosim_motion::embedded_walk();
    let begin = Clock::system_now().nanos + 50_000_000;
    let mut sent: Vec<i64> = Vec::new();
    let mut arrivals = Vec::new();
    while sent.len() < STATES {
        let due = begin + sent.len() as i64 * INTERVAL_NANOS;
        let left = due - Clock::system_now().nanos;
        if left > 0 {
            bell.wait(Some(Duration::from_nanos(left as u64)));
            collect(&imus, &mut arrivals);
            continue;
        }
        let body = &walk.frames[sent.len() % walk.frames.len()];
        let mut state = SmplState {
            header: Header::new(due, "world"),
            betas: walk.betas.clone(),
            shape_space: "cromosim".to_owned(),
            confidence: 1.0,
            ..SmplState::default()
        };
        state.set_root_and_rotations(body.root_position, &body.local_rotations);
        sent.push(Clock::system_now().nanos);
        states.publish(&state).expect("the state gets out");
    }
    std::thread::sleep(Duration::from_millis(200));
    collect(&imus, &mut arrivals);
    let latencies = latencies(begin, &sent, &arrivals);
    assert!(
        latencies.len() > (STATES - WARM_UP - 20) * imus.len(),
        "samples are missing: {}",
        latencies.len()
    );
    latencies
}

/// A sample's stamp, and when it arrived here; ns.
type Arrival = (i64, i64);

/// Takes what has come.
fn collect(imus: &[Subscription<Imu>], arrivals: &mut Vec<Arrival>) {
    for subscription in imus {
        while let Some(received) = subscription.try_recv().expect("readable samples") {
            arrivals.push((
                received.message.header.stamp.nanos(),
                received.received_stamp.nanos,
            ));
        }
    }
}

/// Seconds from just before the publication of the state that released each sample, sorted. That
/// state is the first one whose stamp is the scheme's delay later than the sample's; the delay is
/// the median age of samples on the grid of the states.
fn latencies(begin: i64, sent: &[i64], arrivals: &[Arrival]) -> Vec<f64> {
    let frames_of = |nanos: i64| nanos.div_euclid(INTERVAL_NANOS);
    let mut ages: Vec<i64> = arrivals
        .iter()
        .map(|(stamp, arrived)| frames_of(arrived - stamp))
        .collect();
    ages.sort_unstable();
    let delay_frames = ages[ages.len() / 2];
    let releasing = |stamp: i64| {
        usize::try_from(
            (stamp - begin + INTERVAL_NANOS / 2).div_euclid(INTERVAL_NANOS) + delay_frames,
        )
        .ok()
    };
    let latency = |&(stamp, arrived): &Arrival| {
        let state = releasing(stamp).filter(|&state| state > WARM_UP)?;
        Some((arrived - sent.get(state)?) as f64 * 1e-9)
    };
    let mut latencies: Vec<f64> = arrivals.iter().filter_map(latency).collect();
    latencies.sort_unstable_by(f64::total_cmp);
    latencies
}
