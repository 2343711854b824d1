//! The nodes as processes over DDS, in a private network namespace.
#![allow(clippy::unwrap_used)]

mod bags;
mod chain;
#[path = "../common/mod.rs"]
mod common;
mod demo;
mod faults;
mod launch;
mod process;
