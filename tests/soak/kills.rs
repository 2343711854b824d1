//! Nodes that are killed at random, and what goes on.

use std::path::Path;
use std::time::{Duration, Instant};

use cromosim_bag::{BagReader, Selection};
use cromosim_msgs::diagnostic_msgs::DiagnosticArray;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::in_private_network;
use cromosim_ros::{Node, Qos, Subscription};

use crate::common::succeed;
use crate::process::{Process, observer};
use crate::{is_built, node, seen_bytes, setting};

/// A machine with other work is slow; a node that does not come back is not back then either.
const LONG: Duration = Duration::from_secs(60);
const NAMES: [&str; 6] = [
    "replay",
    "smpl_state",
    "virtual_imu",
    "gap_monitor",
    "recorder",
    // Last, so that it can be left out.
    "viewer",
];
/// Of [`NAMES`].
const RECORDER: usize = 4;
const MONITOR: usize = 3;
const VIEWER: usize = 5;
/// What the viewer has written once it shows bodies and curves.
const SEEN_BYTES: u64 = 100_000;

/// Random numbers that are the same everywhere (splitmix64).
struct Random(u64);

impl Random {
    fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % most
    }
}

/// What shows that all is well again.
struct Watch {
    imus: Subscription<Imu>,
    diagnoses: Subscription<DiagnosticArray>,
}

impl Watch {
    fn new(node: &Node) -> Self {
        Self {
            imus: node
                .subscription("/imu/head/data_raw", Qos::recorder())
                .unwrap(),
            diagnoses: node.subscription("/diagnostics", Qos::recorder()).unwrap(),
        }
    }

    /// Waits for what comes from now on: ten samples in a row, and the monitor's word.
    fn wait(&self, what: &str, of_monitor: bool) {
        while self.imus.try_recv().unwrap().is_some() {}
        while self.diagnoses.try_recv().unwrap().is_some() {}
        let begun = Instant::now();
        let (mut samples, mut said) = (0, !of_monitor);
        while samples < 10 || !said {
            assert!(begun.elapsed() < LONG, "{what}: {samples} samples, {said}");
            let imu = self.imus.recv_timeout(Duration::from_millis(100)).unwrap();
            samples += usize::from(imu.is_some());
            while let Some(one) = self.diagnoses.try_recv().unwrap() {
                let mut status = one.message.status.iter();
                said |= status.any(|status| status.name.contains("gap"));
            }
        }
    }
}

/// Waits until the viewer's file holds what it shows.
fn wait_for_pictures(recording: &Path, what: &str) {
    let begun = Instant::now();
    while seen_bytes(recording) < SEEN_BYTES {
        assert!(
            begun.elapsed() < LONG,
            "{what}: {} bytes",
            seen_bytes(recording)
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    std::fs::remove_file(recording).unwrap();
}

fn start(folder: &Path, which: usize, bag: &str) -> Process {
    let recording = format!("recording:={bag}.rrd");
    let bag = format!("bag_path:={bag}");
    let parameters: &[&str] = match which {
        0 => &["loop:=true"],
        2 => &["rate_hz:=50.0"],
        MONITOR => &["placements:=[head]", "simulated_topic:=/imu/{name}/data"],
        RECORDER => &[&bag],
        VIEWER => &[&recording, "mesh_rate_hz:=1.0"],
        _ => &[],
    };
    node(folder, NAMES[which], parameters)
}

/// Recovers a killed recorder's bag; how many messages it holds.
fn recovered(folder: &Path, bag: &str) -> usize {
    succeed(folder, &["bag", "recover", bag]);
    let path = folder.join(format!("{bag}_recovered"));
    let reader = BagReader::open(&path).unwrap();
    let messages = reader.messages(&Selection::default()).unwrap();
    let count = messages.map(Result::unwrap).count();
    for name in [path, folder.join(bag)] {
        std::fs::remove_dir_all(name).unwrap();
    }
    count
}

/// Kills each node so often, in random order and at random times.
fn kill(folder: &Path, times: u64) {
    let looking = observer();
    let watch = Watch::new(&looking);
    let mut random = Random(16);
    let mut bag = "bag0".to_owned();
    let count = NAMES.iter().filter(|name| is_built(name)).count();
    let mut processes: Vec<Process> = (0..count).map(|which| start(folder, which, &bag)).collect();
    watch.wait("the beginning", true);
    let mut order: Vec<usize> = (0..count * times as usize).collect();
    for place in (1..order.len()).rev() {
        order.swap(place, random.below(place as u64 + 1) as usize);
    }
    let mut took: Vec<Vec<f64>> = vec![Vec::new(); NAMES.len()];
    let mut kept = 0;
    for (round, number) in order.into_iter().enumerate() {
        let which = number % count;
        std::thread::sleep(Duration::from_millis(random.below(400)));
        let begun = Instant::now();
        let next = format!("bag{}", round + 1);
        // Dropped is killed, by SIGKILL.
        drop(processes.remove(which));
        if which == RECORDER {
            kept += recovered(folder, &bag);
            bag.clone_from(&next);
        }
        processes.insert(which, start(folder, which, &next));
        let what = format!("round {round}, {} killed", NAMES[which]);
        watch.wait(&what, which == MONITOR);
        if which == VIEWER {
            wait_for_pictures(&folder.join(format!("{next}.rrd")), &what);
        }
        took[which].push(begun.elapsed().as_secs_f64());
    }
    for process in processes {
        process.interrupt();
    }
    BagReader::open(&folder.join(&bag)).unwrap();
    for (name, took) in NAMES.into_iter().zip(&mut took).take(count) {
        took.sort_by(f64::total_cmp);
        let (middle, last) = (took[took.len() / 2], took[took.len() - 1]);
        println!(
            "{name}: {} kills, well again after {middle:.1} s (median), {last:.1} s at most",
            took.len()
        );
    }
    println!("{kept} messages in the bags of killed recorders");
    assert!(kept > 0);
}

#[test]
fn killed_nodes_come_back() {
    in_private_network("kills::killed_nodes_come_back", || {
        let folder = tempfile::tempdir().unwrap();
        kill(folder.path(), 2);
    });
}

/// Each node `CROMOSIM_SOAK_KILLS` times.
#[test]
#[ignore = "takes half an hour"]
fn a_hundred_times_killed_nodes_come_back() {
    in_private_network("kills::a_hundred_times_killed_nodes_come_back", || {
        let folder = tempfile::tempdir().unwrap();
        kill(folder.path(), setting("CROMOSIM_SOAK_KILLS", 100.0) as u64);
    });
}
