//! Motion files through the whole chain: replay, smpl_state, virtual_imu and recorder as processes
//! over DDS, against `cromosim simulate`.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{CROMOSIM, root, succeed};
use cromosim_bag::BagReader;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::testing::{environment, in_private_network};
use nalgebra::Vector3;

const PATIENCE: Duration = Duration::from_secs(60);
const PLACEMENTS: [&str; 2] = ["left_wrist", "head"];
/// Noise and biases too: the same seed makes the same ones live and offline.
const PLACEMENTS_YAML: &str = "schema: cromosim/placements/1
defaults: {rate_hz: 100, scheme: richardson, device: consumer_mems}
placements:
  left_wrist: {site: left_watch}
  head: {site: forehead}
";
const IMU_RATE_HZ: f64 = 100.0;
/// Of the scheme, frames: two that it reaches ahead, two for the interpolation.
const DELAY_FRAMES: f64 = 4.0;

/// A node process; killed when the test ends.
struct Node(Child);

impl Drop for Node {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Node {
    fn start(folder: &Path, name: &str, arguments: &[String]) -> Self {
        let mut command = Command::new(CROMOSIM);
        command
            .args(["node", name, "--ros-args"])
            .args(arguments)
            .current_dir(folder)
            .envs(environment())
            .stdin(Stdio::null());
        Self(command.stdout(Stdio::piped()).spawn().unwrap())
    }

    /// Waits for the line `ready`.
    fn ready(&mut self) {
        let mut line = String::new();
        BufReader::new(self.0.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert_eq!(line.trim(), "ready");
    }

    fn ended(&mut self) {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.0.try_wait().unwrap() {
                return assert!(status.success(), "{status}");
            }
            assert!(Instant::now() < until, "the process did not end");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn interrupt(mut self) {
        assert!(
            Command::new("kill")
                .args(["-INT", &self.0.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        self.ended();
    }
}

fn parameters(given: &[&str]) -> Vec<String> {
    given
        .iter()
        .flat_map(|parameter| ["-p".to_owned(), (*parameter).to_owned()])
        .collect()
}

/// Plays a motion file into a bag, with a smpl_state and a virtual_imu in each of these namespaces
/// (`""`: none).
fn record(folder: &Path, motion: &Path, namespaces: &[&str], replay: &[&str]) -> BagReader {
    std::fs::write(folder.join("placements.yaml"), PLACEMENTS_YAML).unwrap();
    let mut recorder = Node::start(folder, "recorder", &parameters(&["bag_path:=live"]));
    recorder.ready();
    let mut nodes = Vec::new();
    for namespace in namespaces {
        let own = |given: &[&str]| {
            let mut arguments = parameters(given);
            if !namespace.is_empty() {
                arguments.extend(parameters(&[&format!("prefix:={namespace}")]));
                arguments.extend(["-r".to_owned(), format!("__ns:=/{namespace}")]);
            }
            arguments
        };
        nodes.push(Node::start(
            folder,
            "virtual_imu",
            &own(&["placements:=placements.yaml", "ready_subscriptions:=1"]),
        ));
        nodes.push(Node::start(
            folder,
            "smpl_state",
            &own(&["ready_subscriptions:=2"]),
        ));
    }
    nodes.iter_mut().for_each(Node::ready);
    let file = format!("motion:='{}'", motion.display());
    let mut given = vec![
        file.as_str(),
        "clock_rate_hz:=20.0",
        "ready_subscriptions:=2",
        "ready_timeout_seconds:=60.0",
    ];
    given.extend(replay);
    // It ends when everything it sent was received.
    Node::start(folder, "replay", &parameters(&given)).ended();
    std::thread::sleep(Duration::from_secs(1));
    nodes.into_iter().for_each(Node::interrupt);
    recorder.interrupt();
    BagReader::open(&folder.join("live")).unwrap()
}

/// The live bag holds what it should, and reads what `offline` reads.
fn compare(live: &BagReader, offline: &BagReader, label: &str, frames: usize, rate_hz: f64) {
    let topic = |name: &str| {
        if label.is_empty() {
            format!("/{name}")
        } else {
            format!("/{label}/{name}")
        }
    };
    assert_eq!(
        live.read::<SmplPose>(&topic("smpl/pose")).unwrap().len(),
        frames,
        "{label}: poses"
    );
    let states = |bag: &BagReader| -> Vec<SmplState> {
        bag.read::<SmplState>(&topic("smpl/state"))
            .unwrap()
            .into_iter()
            .map(|(_, state)| state)
            .collect()
    };
    let (played, expected) = (states(live), states(offline));
    assert_eq!(
        (played.len(), expected.len()),
        (frames, frames),
        "{label}: every pose becomes a state"
    );
    assert!(played.iter().zip(&expected).all(|(live, offline)| {
        live.header.stamp == offline.header.stamp
            && live.betas == offline.betas
            && live.body_id == offline.body_id
    }));
    let seconds = ((frames - 1) as f64 - DELAY_FRAMES + 0.1) / rate_hz;
    let count = (seconds * IMU_RATE_HZ + 1e-6).floor() as usize + 1;
    for placement in PLACEMENTS {
        let read = |bag: &BagReader, ending: &str| {
            bag.read::<Imu>(&topic(&format!("imu/{placement}/{ending}")))
                .unwrap()
        };
        let (raw, full) = (read(live, "data_raw"), read(live, "data"));
        assert_eq!(
            (raw.len(), full.len()),
            (count, count),
            "{label} {placement}: all but the scheme's delay"
        );
        let offline = read(offline, "data_raw");
        let mut largest = [0.0_f64; 2];
        // The first three frames are read before all of the offline stencil's frames are there.
        for ((_, live), (_, offline)) in raw
            .iter()
            .zip(&offline)
            .skip((3.0 / rate_hz * IMU_RATE_HZ).ceil() as usize + 1)
        {
            assert_eq!(
                live.header.stamp, offline.header.stamp,
                "{label} {placement}: stamps are the recording's"
            );
            assert_eq!(live.header.frame_id, offline.header.frame_id);
            assert_eq!(
                live.linear_acceleration_covariance,
                offline.linear_acceleration_covariance
            );
            let force = Vector3::from(live.linear_acceleration)
                - Vector3::from(offline.linear_acceleration);
            let rate =
                Vector3::from(live.angular_velocity) - Vector3::from(offline.angular_velocity);
            largest = [largest[0].max(force.norm()), largest[1].max(rate.norm())];
        }
        println!(
            "{label} {placement}: {count} messages, live and offline within {} m/s2 and {} rad/s",
            largest[0], largest[1]
        );
        // The same formulas of the same numbers: what is left is rounding.
        assert!(
            largest[0] < 1e-6 && largest[1] < 1e-7,
            "{label} {placement}: {largest:?}"
        );
        let gravity = raw
            .iter()
            .map(|(_, imu)| Vector3::from(imu.linear_acceleration).norm())
            .sum::<f64>()
            / raw.len() as f64;
        assert!(
            (7.0..20.0).contains(&gravity),
            "{label} {placement}: it is a body under gravity, {gravity} m/s2 in the mean"
        );
    }
}

fn sample(name: &str) -> PathBuf {
    root().join("nodes/lib/motion/tests/data/poses").join(name)
}

fn simulated(folder: &Path, motion: &Path, options: &[&str]) -> BagReader {
    let arguments = [
        "simulate",
        motion.to_str().unwrap(),
        "--out",
        "offline.mcap",
        "--placements",
        "placements.yaml",
    ];
    succeed(folder, &[arguments.as_slice(), options].concat());
    BagReader::open(&folder.join("offline.mcap")).unwrap()
}

#[test]
fn a_bvh_file_goes_through_the_nodes_to_a_bag() {
    in_private_network("a_bvh_file_goes_through_the_nodes_to_a_bag", || {
        let folder = tempfile::tempdir().unwrap();
        let motion = folder.path().join("walk.bvh");
        succeed(
            folder.path(),
            &[
                "convert",
                sample("chain_amass.npz").to_str().unwrap(),
                "walk.bvh",
            ],
        );
        let live = record(folder.path(), &motion, &[""], &[]);
        compare(
            &live,
            &simulated(folder.path(), &motion, &[]),
            "",
            121,
            60.0,
        );
    });
}

#[test]
fn amass_goes_through_the_nodes_to_a_bag() {
    in_private_network("amass_goes_through_the_nodes_to_a_bag", || {
        let folder = tempfile::tempdir().unwrap();
        let (motion, body) = (
            sample("chain_amass.npz"),
            root().join("nodes/lib/body/tests/data/model_smplh_female.npz"),
        );
        // The person's betas are SMPL-H's: the embedded body is fitted to their bones.
        let live = record(
            folder.path(),
            &motion,
            &[""],
            &[&format!("source_body:='{}'", body.display())],
        );
        let offline = simulated(
            folder.path(),
            &motion,
            &["--source-body", body.to_str().unwrap()],
        );
        compare(&live, &offline, "", 121, 60.0);
        let (_, state) = live.read::<SmplState>("/smpl/state").unwrap().remove(0);
        assert!(
            state.shape_space == "cromosim" && state.betas.iter().any(|beta| beta.abs() > 0.1),
            "{:?}",
            state.betas
        );
    });
}

/// Two people of one WHAM file, each in a namespace and with frames of its own.
#[test]
fn wham_people_go_through_the_nodes_to_a_bag() {
    in_private_network("wham_people_go_through_the_nodes_to_a_bag", || {
        let folder = tempfile::tempdir().unwrap();
        let motion = sample("chain_wham.pkl");
        let live = record(
            folder.path(),
            &motion,
            &["person_0", "person_3"],
            &["person:=all"],
        );
        let offline = simulated(folder.path(), &motion, &["--person", "all"]);
        compare(&live, &offline, "person_0", 61, 30.0);
        compare(&live, &offline, "person_3", 50, 30.0);
        let begins = |label: &str| {
            live.read::<SmplPose>(&format!("/{label}/smpl/pose"))
                .unwrap()[0]
                .1
                .header
                .stamp
                .nanos()
        };
        assert_eq!(
            (begins("person_0"), begins("person_3")),
            (1_000_000_000, 1_200_000_000),
            "in step with the video"
        );
        let frames = live.read::<TFMessage>("/tf").unwrap();
        let has = |parent: &str, child: &str| {
            let edges = frames.iter().flat_map(|(_, message)| &message.transforms);
            edges
                .into_iter()
                .any(|edge| edge.header.frame_id == parent && edge.child_frame_id == child)
        };
        for label in ["person_0", "person_3"] {
            assert!(
                has("world", &format!("{label}/pelvis"))
                    && has(&format!("{label}/head"), &format!("{label}/head_imu")),
                "{label}"
            );
        }
        assert!(
            !has("world", "pelvis"),
            "nobody's frames are without a prefix"
        );
    });
}
