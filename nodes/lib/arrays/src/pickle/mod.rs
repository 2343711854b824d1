//! Pickles, protocols 0 to 5, read without executing anything.
//!
//! A pickle is a program for a stack machine. The machine here has no functions to call: a name
//! that the program refers to is looked up in a fixed table (`known.rs`), and what is not in it is
//! refused by name. The machine fills an arena of nodes, since Python lets an object change after
//! others refer to it; at the end `finish.rs` turns the arena into values that share what was
//! shared.

mod finish;
mod joblib;
mod known;
mod machine;
mod node;
mod numpy;
mod object;
mod skip;
mod text;
pub(crate) mod torch;

use crate::blob::Blob;
use crate::limits::Budget;
use crate::value::Value;

pub(crate) use torch::{LEGACY_START, read_legacy, read_zipped};

/// How deep pickles may lie within pickles: arrays of objects in joblib files, torch storages in
/// plain pickles.
const NESTING_LIMIT: usize = 4;

/// What a pickle does wrong.
#[derive(Debug)]
pub(crate) enum Reason {
    Unsound(String),
    /// The Python name.
    Refused(String),
}

impl From<String> for Reason {
    fn from(message: String) -> Self {
        Self::Unsound(message)
    }
}

impl From<&str> for Reason {
    fn from(message: &str) -> Self {
        Self::Unsound(message.to_owned())
    }
}

/// What a pickle does wrong, and where.
#[derive(Debug)]
pub(crate) struct Fault {
    pub offset: usize,
    pub reason: Reason,
}

impl Fault {
    pub fn new(offset: usize, reason: impl Into<Reason>) -> Self {
        Self {
            offset,
            reason: reason.into(),
        }
    }

    /// The same fault, in a file in which the pickle begins at `start`.
    pub fn after(self, start: usize) -> Self {
        Self {
            offset: self.offset + start,
            ..self
        }
    }

    /// As the reason of an opcode in which a pickle was nested.
    pub fn nested(self) -> Reason {
        match self.reason {
            Reason::Unsound(message) => Reason::Unsound(format!(
                "in the pickle within, byte {}: {message}",
                self.offset
            )),
            refused @ Reason::Refused(_) => refused,
        }
    }
}

/// The value of a plain pickle, which may contain joblib's arrays.
pub(crate) fn read(content: &Blob, budget: &mut Budget) -> Result<Value, Fault> {
    read_nested(content, budget, 0).map(|(value, _)| value)
}

/// The value and where the pickle ends.
fn read_nested(
    content: &Blob,
    budget: &mut Budget,
    nesting: usize,
) -> Result<(Value, usize), Fault> {
    let mut machine = machine::Machine::new(content.clone(), budget, nesting)?;
    let root = machine.run()?;
    skip::skip(&mut machine, root)?;
    let end = machine.position;
    let value = finish::finish(machine, root, &mut |key| {
        Err(format!("storage {key} lies outside this file"))
    })?;
    Ok((value, end))
}
