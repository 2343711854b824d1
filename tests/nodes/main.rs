//! The nodes as processes over DDS, in a private network namespace.
#![allow(clippy::unwrap_used)]

mod bags;
mod chain;
#[path = "../common/mod.rs"]
mod common;
mod demo;
mod faults;
mod imu_users;
mod launch;
mod other_host;
mod parameters;
mod process;
mod static_peers;
#[path = "../../nodes/lib/ros/tests/stranger/mod.rs"]
mod stranger;
