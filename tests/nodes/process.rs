//! Node processes, and a node of the test itself that observes them.
#![allow(dead_code)]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cromosim_ros::testing::{environment, network};
use cromosim_ros::{Node, NodeOptions, Parameters, RosArgs};

use crate::common::CROMOSIM;

pub const PATIENCE: Duration = Duration::from_secs(30);

/// A node process; killed when the test ends.
pub struct Process(Child);

impl Process {
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        Self::start_with(folder, arguments, &environment())
    }

    /// As [`Self::start`], with environment variables of the test's own.
    pub fn start_with(folder: &Path, arguments: &[&str], variables: &[(&str, String)]) -> Self {
        let mut command = Command::new(CROMOSIM);
        command
            .args(arguments)
            .current_dir(folder)
            .envs(variables.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        Self(command.spawn().unwrap())
    }

    pub fn id(&self) -> u32 {
        self.0.id()
    }

    /// Whether it has ended, and well; false while it runs.
    pub fn has_succeeded(&mut self) -> bool {
        let status = self.0.try_wait().unwrap();
        status.is_some_and(|status| {
            assert!(status.success(), "{status}");
            true
        })
    }

    pub fn signal(&self, signal: &str) {
        assert!(
            Command::new("kill")
                .args([signal, &self.0.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
    }

    /// Ends the process as a user would, by SIGINT; it must exit cleanly.
    pub fn interrupt(mut self) {
        self.signal("-INT");
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            if let Some(status) = self.0.try_wait().unwrap() {
                assert!(status.success(), "{status}");
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("the process did not end on SIGINT");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub fn observer() -> Node {
    let args = RosArgs::parse(Vec::<String>::new()).unwrap();
    Node::start(
        NodeOptions::new("observer", &args, &Parameters::new())
            .unwrap()
            .network(network()),
    )
    .unwrap()
}
