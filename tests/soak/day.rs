//! A day of motion through the nodes at many times real time.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use cromosim_bag::{BagOptions, BagReader, BagWriter, Compression};
use cromosim_motion::{SmplMotion, embedded_walk};
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_recording::{FIRST_STAMP, MessageHeader, smpl_pose};
use cromosim_ros::testing::in_private_network;
use cromosim_spatial::Stamp;

use crate::common::succeed;
use crate::process::{PATIENCE, Process, observer};
use crate::{is_built, node, seen_bytes, setting};

/// What a node may grow by from the first quarter of a day on: the allocator's pieces.
const GROWTH_MB: f64 = 16.0;
/// The same of minutes, in which queues are still filled for the first time.
const EARLY_GROWTH_MB: f64 = 64.0;

/// What is played.
struct Course {
    seconds: f64,
    /// Poses and samples per second of the motion, Hz.
    rate_hz: f64,
    /// How many times faster.
    speed: f64,
    growth_mb: f64,
}

/// The pose at a frame of the embedded walk, forth and back again without end.
fn pose(walk: &SmplMotion, rate_hz: f64, index: usize) -> SmplPose {
    let step = (walk.rate_hz / rate_hz).round() as usize;
    let last = (walk.frames.len() - 1) / step;
    let place = index % (2 * last);
    let header = MessageHeader {
        stamp: stamp(rate_hz, index),
        frame_id: "world",
        body_id: "0",
    };
    smpl_pose(walk, step * place.min(2 * last - place), header)
}

fn stamp(rate_hz: f64, index: usize) -> Stamp {
    FIRST_STAMP.plus_seconds(index as f64 / rate_hz)
}

/// Memory of a process that is its own, MB.
fn memory_mb(process: &Process) -> f64 {
    let path = format!("/proc/{}/status", process.id());
    let status = fs::read_to_string(path).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes =
        line.and_then(|line| line.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

/// Messages of a topic and their stamps that are not a period after the one before.
fn gaps<M: cromosim_msgs::RosMessage>(
    bag: &BagReader,
    topic: &str,
    rate_hz: f64,
    nanos: impl Fn(&M) -> i64,
) -> (usize, usize) {
    let selection = cromosim_bag::Selection::topic(topic);
    let (mut count, mut gaps, mut last) = (0, 0, None);
    for message in bag.messages(&selection).unwrap() {
        let now = nanos(&message.unwrap().decode::<M>().unwrap());
        let period = 1e9 / rate_hz;
        gaps += usize::from(last.is_some_and(|last| ((now - last) as f64 - period).abs() > 1e3));
        last = Some(now);
        count += 1;
    }
    (count, gaps)
}

fn write_motion(path: &Path, frames: usize, rate_hz: f64) {
    let options = BagOptions {
        compression: Compression::Zstd,
        ..BagOptions::default()
    };
    let mut motion = BagWriter::create(path, options).unwrap();
    let walk = embedded_walk();
    for index in 0..frames {
        let message = pose(&walk, rate_hz, index);
        motion
            .write("/smpl/pose", stamp(rate_hz, index), &message)
            .unwrap();
    }
    motion.finish().unwrap();
}

/// The viewer writes to a file; what it draws of the body is drawn twenty times in all.
fn start_nodes(folder: &Path, course: &Course) -> Vec<(&'static str, Process)> {
    let rate_hz = course.rate_hz;
    let placements = format!(
        "schema: cromosim/placements/1\ndefaults: {{rate_hz: {rate_hz}, device: consumer_mems}}\nplacements:\n  head: {{site: forehead}}\n"
    );
    fs::write(folder.join("placements.yaml"), placements).unwrap();

    let state_rate = format!("state_rate_hz:={rate_hz:?}");
    let gap = format!("gap_seconds:={:?}", 2.5 / rate_hz);
    let mesh_rate = format!("mesh_rate_hz:={:?}", 20.0 / course.seconds);
    let follows = "use_sim_time:=true";
    // The recorder last: it is also the last to end.
    let nodes: [(&str, &[&str]); 5] = [
        ("smpl_state", &[follows]),
        (
            "virtual_imu",
            &["placements:=placements.yaml", &state_rate, &gap, follows],
        ),
        (
            "gap_monitor",
            // Against itself: what counts here is that it goes on.
            &[
                "placements:=[head]",
                "simulated_topic:=/imu/{name}/data",
                follows,
            ],
        ),
        ("viewer", &["recording:=seen.rrd", &mesh_rate, follows]),
        ("recorder", &["bag_path:=bag", "compression:=zstd"]),
    ];
    let nodes = nodes
        .into_iter()
        .filter(|(name, _)| is_built(name))
        .map(|(name, parameters)| (name, node(folder, name, parameters)))
        .collect();
    // All that talk to each other have met before the first pose.
    let looking = observer();
    let imus = looking.subscription::<Imu>("/imu/head/data_raw", cromosim_ros::Qos::recorder());
    let imus = imus.unwrap();
    assert!(imus.wait_for_publishers(1, PATIENCE));
    std::thread::sleep(Duration::from_secs(3));
    drop((imus, looking));
    nodes
}

/// Plays a course, and looks at all that is left.
fn play(folder: &Path, course: &Course) {
    let &Course {
        seconds,
        rate_hz,
        speed,
        growth_mb,
    } = course;
    let frames = (seconds * rate_hz) as usize;
    write_motion(&folder.join("motion.mcap"), frames, rate_hz);
    let nodes = start_nodes(folder, course);
    let begun = Instant::now();
    let times = format!("rate:={speed:?}");
    let mut replay = node(
        folder,
        "replay",
        &["bag:=motion.mcap", &times, "clock_rate_hz:=20.0"],
    );
    let mut memory: Vec<Vec<f64>> = Vec::new();
    while !replay.has_succeeded() {
        let all = nodes.iter().map(|(_, process)| process).chain([&replay]);
        memory.push(all.map(memory_mb).collect());
        std::thread::sleep(Duration::from_millis(500));
        let most = Duration::from_secs_f64(10.0 * seconds / speed + 120.0);
        assert!(begun.elapsed() < most, "the replay does not end");
    }
    let took_s = begun.elapsed().as_secs_f64();
    std::thread::sleep(Duration::from_secs(3));
    let mut names = Vec::new();
    for (name, process) in nodes {
        process.interrupt();
        names.push(name);
    }
    names.push("replay");
    println!("{seconds} s in {took_s:.0} s");
    check_memory(&names, &memory, growth_mb);
    check_bag(folder, frames, rate_hz);
    if is_built("viewer") {
        // Curves of each sample, and pictures of the body.
        let seen = seen_bytes(&folder.join("seen.rrd"));
        println!("the viewer's file: {seen} bytes");
        assert!(
            seen > 40 * frames as u64,
            "{seen} bytes of {frames} samples"
        );
    }
}

/// From a quarter of the time on nothing grows.
fn check_memory(names: &[&str], memory: &[Vec<f64>], growth_mb: f64) {
    let (first, rest) = memory.split_at(memory.len() / 4);
    let most =
        |part: &[Vec<f64>], which: usize| part.iter().map(|now| now[which]).fold(0.0, f64::max);
    for (which, name) in names.iter().enumerate() {
        let (before, after) = (most(first, which), most(rest, which));
        println!("{name}: {before:.1} MB in the first quarter, {after:.1} MB after");
        assert!(
            after - before < growth_mb,
            "{name}: {before:.1} -> {after:.1} MB"
        );
    }
}

/// Every pose, state, frame and sample is there, in its place.
fn check_bag(folder: &Path, frames: usize, rate_hz: f64) {
    println!("{}", succeed(folder, &["inspect", "bag"]));
    let bag = BagReader::open(&folder.join("bag")).unwrap();
    let poses = gaps(&bag, "/smpl/pose", rate_hz, |one: &SmplPose| {
        one.header.stamp.nanos()
    });
    let states = gaps(&bag, "/smpl/state", rate_hz, |one: &SmplState| {
        one.header.stamp.nanos()
    });
    let raw = gaps(&bag, "/imu/head/data_raw", rate_hz, |one: &Imu| {
        one.header.stamp.nanos()
    });
    let full = gaps(&bag, "/imu/head/data", rate_hz, |one: &Imu| {
        one.header.stamp.nanos()
    });
    println!(
        "messages and gaps: poses {poses:?}, states {states:?}, samples {raw:?} and {full:?}, of {frames}"
    );
    assert_eq!(poses, (frames, 0));
    assert_eq!(states, (frames, 0));
    let transforms = bag.read::<TFMessage>("/tf").map(|all| all.len()).unwrap();
    assert!(transforms >= frames, "{transforms} transforms");
    // The scheme needs some poses before the first sample and after the last.
    assert!(raw.0 + 20 >= frames && raw.1 == 0, "{raw:?} of {frames}");
    assert_eq!(full, raw);
}

#[test]
fn minutes_of_simulated_time_lose_nothing() {
    in_private_network("day::minutes_of_simulated_time_lose_nothing", || {
        let folder = tempfile::tempdir().unwrap();
        let course = Course {
            seconds: 300.0,
            rate_hz: 10.0,
            speed: 20.0,
            growth_mb: EARLY_GROWTH_MB,
        };
        play(folder.path(), &course);
    });
}

/// `CROMOSIM_SOAK_SECONDS` of motion of `CROMOSIM_SOAK_HZ` poses a second at `CROMOSIM_SOAK_SPEED`
/// times their speed.
#[test]
#[ignore = "takes a quarter of an hour and more"]
fn a_day_of_simulated_time_loses_nothing() {
    in_private_network("day::a_day_of_simulated_time_loses_nothing", || {
        let folder = tempfile::tempdir().unwrap();
        let course = Course {
            seconds: setting("CROMOSIM_SOAK_SECONDS", 86_400.0),
            rate_hz: setting("CROMOSIM_SOAK_HZ", 10.0),
            speed: setting("CROMOSIM_SOAK_SPEED", 100.0),
            growth_mb: GROWTH_MB,
        };
        play(folder.path(), &course);
    });
}
