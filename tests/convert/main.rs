//! `cromosim convert` and what goes with it: files there and back through the command, refusals,
//! robots and props.
#![allow(clippy::unwrap_used)]

mod captures;
#[path = "../common/mod.rs"]
mod common;
mod datasets;
mod files;
mod motions;
mod refusals;
mod rigid;
