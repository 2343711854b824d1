//! `cromosim diagnose` end to end: hidden effects are found, the promise holds on another
//! recording, and nothing is named where nothing is.
#![allow(clippy::unwrap_used)]

mod answer;
mod clock_jumps;
#[path = "../common/mod.rs"]
mod common;
mod found;
mod session;
mod special;
