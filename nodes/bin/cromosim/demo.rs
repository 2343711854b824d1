//! The main job: a motion through all five nodes, each in a process of its own, over DDS on this
//! machine.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use cromosim_body::ShapedBody;
use cromosim_imu::{Device, MountedSensors, PlacementSet};
use cromosim_motion::MotionOptions;
use cromosim_ros::{Network, RosArgs, Security};
use cromosim_spatial::PoseSource;

use crate::files::refuse_existing;
use crate::progress::Interrupt;
use crate::{body, progress, summary};

/// What is left behind by a node that does not end when asked to.
const PATIENCE: Duration = Duration::from_secs(15);
/// Messages still under way once the last pose is out: the scheme's delay and the writers' queues.
const DRAIN: Duration = Duration::from_millis(1500);
/// What a node has for closing its files once the demo has failed.
const LAST_MOMENT: Duration = Duration::from_secs(3);
/// Where a demo goes that was given no folder.
const DEFAULT_OUT: &str = "cromosim-demo";
const READY: &str = "ready";
/// Heading of the help.
const PLAYED: &str = "What is played";

/// Arguments of `cromosim demo`.
#[derive(Args)]
pub struct Arguments {
    /// Play this motion file, rather than 10 s of the embedded walk
    ///
    /// From its beginning to its end
    #[arg(long, value_name = "FILE", help_heading = PLAYED)]
    motion: Option<PathBuf>,
    /// The skeleton map of a BVH or AMC file with joint names of its own
    #[arg(long, value_name = "MAP", requires = "motion", help_heading = PLAYED)]
    skeleton_map: Option<String>,
    /// Stop after so many seconds of the motion
    #[arg(
        long,
        value_name = "SECONDS",
        allow_negative_numbers = true,
        help_heading = PLAYED
    )]
    duration: Option<f64>,
    /// Body model (npz or pickle) rather than the embedded one
    ///
    /// SMPL, SMPL-H or SMPL-X, for all nodes
    #[arg(long, value_name = "FILE", help_heading = PLAYED)]
    body: Option<PathBuf>,
    /// Where on the body the sensors are (YAML); default: five places
    ///
    /// Without, left_wrist, right_ankle, pelvis, sternum and head
    #[arg(long, value_name = "FILE", help_heading = PLAYED)]
    placements: Option<PathBuf>,
    /// Where bag, Rerun recording and logs go [default: cromosim-demo]
    ///
    /// There each demo takes the place of the one before
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace what an earlier demo left in DIR
    #[arg(long)]
    force: bool,
    /// Seed of the sensor noise
    #[arg(
        long,
        default_value_t = 0,
        value_parser = clap::value_parser!(i64).range(0..),
        help_heading = PLAYED
    )]
    seed: i64,
    /// Wait for so many more subscriptions to every IMU
    ///
    /// More than the demo's own
    #[arg(long, value_name = "N", default_value_t = 0)]
    listeners: u32,
    /// Leave the viewer out: no .rrd
    #[arg(long)]
    no_viewer: bool,
}

/// A node in its own process; ended, at the latest, when this is dropped, or when this process ends:
/// the node's standard input ends with it.
struct NodeProcess {
    name: &'static str,
    child: Child,
    log: PathBuf,
    ready: Receiver<()>,
    /// Reads to the end what the node says, and gives its last line.
    said: Option<JoinHandle<String>>,
}

impl NodeProcess {
    fn start(
        name: &'static str,
        parameters: &[(&str, String)],
        logs: &Path,
    ) -> anyhow::Result<Self> {
        let log = logs.join(format!("{name}.log"));
        let file =
            File::create(&log).with_context(|| format!("{}: cannot be written", log.display()))?;
        let mut command =
            Command::new(std::env::current_exe().context("the path of this program is unknown")?);
        command.args(["node", name, "--end-with-stdin", "--ros-args"]);
        for (key, value) in parameters {
            command.arg("-p").arg(format!("{key}:={value}"));
        }
        // A group of its own: Ctrl-C reaches the demo alone, which ends the nodes in their order.
        command.process_group(0);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("{name} cannot be started"))?;
        let (sender, ready) = mpsc::channel();
        if let Some(out) = child.stdout.take() {
            // Reads to the end, so that the node never blocks on a full pipe.
            std::thread::spawn(move || {
                for line in BufReader::new(out).lines().map_while(Result::ok) {
                    if line == READY {
                        let _ = sender.send(());
                    }
                }
            });
        }
        let said = child.stderr.take().map(|stderr| keep_log(stderr, file));
        Ok(Self {
            name,
            child,
            log,
            ready,
            said,
        })
    }

    /// Waits until the node has said that its topics are connected.
    fn wait_ready(&mut self, stop: &Interrupt) -> anyhow::Result<()> {
        let until = Instant::now() + PATIENCE;
        loop {
            match self.ready.recv_timeout(Duration::from_millis(50)) {
                Ok(()) => return Ok(()),
                Err(mpsc::RecvTimeoutError::Timeout) if Instant::now() < until => {}
                Err(_) => return Err(self.failed(&format!("is not ready after {PATIENCE:?}"))),
            }
            self.check_running()?;
            if stop.is_set() {
                bail!("interrupted before the motion began");
            }
        }
    }

    /// What went wrong, with what the node said last; it is killed where it still runs.
    fn failed(&mut self, how: &str) -> anyhow::Error {
        let _ = self.child.kill();
        let last = self.said.take().and_then(|said| said.join().ok());
        let last = last.filter(|line| !line.is_empty());
        let last = last.unwrap_or_else(|| "it said nothing".to_owned());
        anyhow!("{} {how}: {last} (log: {})", self.name, self.log.display())
    }

    /// An error where the node has ended.
    fn check_running(&mut self) -> anyhow::Result<()> {
        if self.child.try_wait()?.is_some() {
            return Err(self.failed("ended early"));
        }
        Ok(())
    }

    /// SIGINT, as a user's Ctrl-C: the node closes its files.
    fn interrupt(&mut self) {
        if !matches!(self.child.try_wait(), Ok(None)) {
            // Its number may be another process's by now.
            return;
        }
        let pid = self.child.id().to_string();
        let _ = Command::new("kill").args(["-INT", &pid]).status();
    }

    fn finish(&mut self) -> anyhow::Result<()> {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            if let Some(status) = self.child.try_wait()? {
                return if status.success() {
                    Ok(())
                } else {
                    Err(self.failed("failed"))
                };
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Err(self.failed(&format!("did not end within {PATIENCE:?} and was killed")))
    }
}

/// Writes a node's lines to its log, as far as the disk takes them, and gives the last one.
fn keep_log(stderr: ChildStderr, mut file: File) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut last = String::new();
        for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line);
            let _ = writeln!(file, "{line}");
            if !line.trim().is_empty() {
                last = line.into_owned();
            }
        }
        last
    })
}

impl Drop for NodeProcess {
    /// The demo failed: the node may still close its files, and is killed where it does not.
    fn drop(&mut self) {
        self.interrupt();
        let until = Instant::now() + LAST_MOMENT;
        while Instant::now() < until && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Where the demo leaves what it made.
struct Places {
    bag: PathBuf,
    recording: PathBuf,
    logs: PathBuf,
}

impl Places {
    /// Clears what an earlier demo left, and nothing else; of a folder that the user named, only
    /// with `force`.
    fn prepare(given: Option<&Path>, force: bool) -> anyhow::Result<Self> {
        let out = given.unwrap_or(Path::new(DEFAULT_OUT));
        let places = Self {
            bag: out.join("bag"),
            recording: out.join("demo.rrd"),
            logs: out.join("logs"),
        };
        if given.is_some() {
            for path in [&places.bag, &places.recording] {
                refuse_existing(path, force)?;
            }
        }
        clear(&places.bag, |name| {
            name == "metadata.yaml" || name.ends_with(".mcap")
        })?;
        clear(&places.logs, |name| name.ends_with(".log"))?;
        if places.recording.exists() {
            fs::remove_file(&places.recording)
                .with_context(|| format!("{}: cannot be replaced", places.recording.display()))?;
        }
        fs::create_dir_all(&places.logs)
            .with_context(|| format!("{}: cannot be made", places.logs.display()))?;
        Ok(places)
    }
}

/// Removes a folder that holds nothing but what a demo leaves.
fn clear(folder: &Path, ours: impl Fn(&str) -> bool) -> anyhow::Result<()> {
    let cannot = || format!("{}: cannot be replaced", folder.display());
    if !folder.exists() {
        return Ok(());
    }
    for entry in fs::read_dir(folder).with_context(cannot)? {
        let name = entry.with_context(cannot)?.file_name();
        if !ours(&name.to_string_lossy()) {
            bail!(
                "{}: no demo made this, and it would be replaced; give another --out",
                folder.join(name).display()
            );
        }
    }
    fs::remove_dir_all(folder).with_context(cannot)
}

/// Runs the demo and prints what it made.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let (duration, source) = arguments.check()?;
    let places = Places::prepare(arguments.out.as_deref(), arguments.force)?;
    let stop = Interrupt::watch()?;

    // Listeners first, so that nobody misses the beginning.
    let mut nodes = arguments.listeners(&places, source)?;
    for node in &mut nodes {
        node.wait_ready(&stop)?;
    }
    let mut replay = NodeProcess::start("replay", &arguments.replay_parameters(), &places.logs)?;
    // Upstream first: whoever records closes last.
    nodes.reverse();
    if let Err(error) = play(&mut replay, &mut nodes, duration, &stop) {
        // All together: nobody need hear the others out any more.
        nodes.iter_mut().for_each(NodeProcess::interrupt);
        return Err(error);
    }
    std::thread::sleep(DRAIN);
    for node in &mut nodes {
        node.interrupt();
        node.finish()?;
    }
    summary::print(
        &places.bag,
        (!arguments.no_viewer).then_some(&*places.recording),
    )
}

fn play(
    replay: &mut NodeProcess,
    nodes: &mut [NodeProcess],
    duration: f64,
    stop: &Interrupt,
) -> anyhow::Result<()> {
    replay.wait_ready(stop)?;
    let bar = progress::bar(
        (duration * 10.0).ceil() as u64,
        "playing, tenths of a second",
    );
    let begun = Instant::now();
    while replay.child.try_wait()?.is_none() {
        if stop.is_set() {
            replay.interrupt();
            break;
        }
        nodes.iter_mut().try_for_each(NodeProcess::check_running)?;
        bar.set_position((begun.elapsed().as_secs_f64() * 10.0) as u64);
        std::thread::sleep(Duration::from_millis(20));
    }
    bar.finish_and_clear();
    replay.finish()
}

impl Arguments {
    /// Seconds that the demo will play, and where their poses come from. Finds what is wrong with the input before any process
    /// starts.
    fn check(&self) -> anyhow::Result<(f64, PoseSource)> {
        if let Some(seconds) = self.duration
            && !(seconds.is_finite() && seconds > 0.0)
        {
            bail!("--duration {seconds}: expected a positive number of seconds");
        }
        // What the nodes would refuse.
        Network::from_env()?;
        Security::from_env(&RosArgs::default())?;
        let model = body::model(self.body.as_deref())?;
        let motion = match &self.motion {
            Some(path) => {
                let options = MotionOptions {
                    skeleton_map: self.skeleton_map.clone(),
                    ..MotionOptions::default()
                };
                cromosim_motion::read_motion_for(path, &model, &options)?
            }
            None => cromosim_motion::embedded_walk(),
        };
        if let Some(path) = &self.placements {
            let placements = PlacementSet::read(path)?;
            MountedSensors::new(&ShapedBody::new(model, &[])?, placements.placements())?;
            for placement in placements.placements() {
                Device::resolve(placement.device(), path.parent().unwrap_or(Path::new(".")))?;
            }
        }
        let whole = motion.duration_s();
        let seconds = self.duration.map_or(whole, |seconds| seconds.min(whole));
        Ok((seconds, motion.source()))
    }

    fn listeners(&self, places: &Places, source: PoseSource) -> anyhow::Result<Vec<NodeProcess>> {
        let viewers = i64::from(!self.no_viewer);
        let path = |path: &Path| -> anyhow::Result<String> {
            Ok(quoted(&std::path::absolute(path)?.display().to_string()))
        };
        let body = self
            .body
            .as_deref()
            .map(path)
            .transpose()?
            .map(|file| ("body", file));
        let recorder = [
            ("bag_path", path(&places.bag)?),
            ("seed", self.seed.to_string()),
            ("run", quoted(&self.describe())),
        ];
        // Whoever needs a body is told of the same one.
        let parameters = |own: &[(&'static str, String)]| {
            own.iter().cloned().chain(body.clone()).collect::<Vec<_>>()
        };
        let mut nodes = vec![NodeProcess::start("recorder", &recorder, &places.logs)?];
        if !self.no_viewer {
            nodes.push(NodeProcess::start(
                "viewer",
                &parameters(&[("recording", path(&places.recording)?)]),
                &places.logs,
            )?);
        }
        let listeners = 1 + viewers + i64::from(self.listeners);
        let mut imu = parameters(&[
            ("seed", self.seed.to_string()),
            ("ready_subscriptions", listeners.to_string()),
            ("pose_source", source.name().to_owned()),
        ]);
        if let Some(file) = &self.placements {
            imu.push(("placements", path(file)?));
        }
        nodes.push(NodeProcess::start("virtual_imu", &imu, &places.logs)?);
        nodes.push(NodeProcess::start(
            "smpl_state",
            &parameters(&[("ready_subscriptions", (2 + viewers).to_string())]),
            &places.logs,
        )?);
        Ok(nodes)
    }

    /// For the bag's metadata: what the nodes were told. The placements are attached to the bag.
    fn describe(&self) -> String {
        let name = |path: &Option<PathBuf>, default: &str| {
            path.as_deref().and_then(Path::file_name).map_or_else(
                || default.to_owned(),
                |name| name.to_string_lossy().into_owned(),
            )
        };
        let duration = self
            .duration
            .map_or_else(|| "whole".to_owned(), |seconds| format!("{seconds} s"));
        format!(
            "demo; motion: {}; body: {}; duration: {duration}; placements: {}; seed: {}; all else as the nodes' defaults",
            name(&self.motion, "embedded walk"),
            name(&self.body, "embedded"),
            name(&self.placements, "demo.yaml"),
            self.seed
        )
    }

    fn replay_parameters(&self) -> Vec<(&'static str, String)> {
        let mut parameters = vec![("ready_subscriptions", "2".to_owned())];
        if let Some(motion) = &self.motion {
            let motion = std::path::absolute(motion).unwrap_or_else(|_| motion.clone());
            parameters.push(("motion", quoted(&motion.display().to_string())));
        }
        if let Some(map) = &self.skeleton_map {
            parameters.push(("skeleton_map", quoted(map)));
        }
        if let Some(body) = &self.body {
            let body = std::path::absolute(body).unwrap_or_else(|_| body.clone());
            parameters.push(("body", quoted(&body.display().to_string())));
        }
        if let Some(seconds) = self.duration {
            parameters.push(("duration_seconds", format!("{seconds:?}")));
        }
        parameters
    }
}

/// A YAML string, whatever stands in the path.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "''"))
}
