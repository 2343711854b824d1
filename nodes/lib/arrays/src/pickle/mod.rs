//! Pickles, protocols 0 to 5, read without executing anything.
//!
//! A pickle is a program for a stack machine. The machine here has no functions to call: a name
//! that the program refers to is looked up in a fixed table (`known.rs`), and what is not in it is
//! refused by name. The machine fills an arena of nodes, since Python lets an object change after
//! others refer to it; at the end `finish.rs` turns the arena into values that share what was
//! shared.

mod arguments;
mod fault;
mod finish;
mod joblib;
mod known;
mod machine;
mod node;
mod numpy;
mod object;
mod opcodes;
mod read;
mod skip;
mod text;
mod torch;
mod torch_file;

pub(crate) use fault::{Fault, Reason};
pub(crate) use read::read;
pub(crate) use torch::LEGACY_START;
pub(crate) use torch_file::{read_legacy, read_zipped};
