//! A plain pickle.

use super::fault::Fault;
use super::finish::finish;
use super::machine::Machine;
use super::skip::skip;
use crate::blob::Blob;
use crate::limits::Budget;
use crate::value::Value;

/// The value of a plain pickle, which may contain joblib's arrays.
pub(crate) fn read(content: &Blob, budget: &mut Budget) -> Result<Value, Fault> {
    read_nested(content, budget, 0).map(|(value, _)| value)
}

/// The value and where the pickle ends.
pub(super) fn read_nested(
    content: &Blob,
    budget: &mut Budget,
    nesting: usize,
) -> Result<(Value, usize), Fault> {
    let mut machine = Machine::new(content.clone(), budget, nesting)?;
    let root = machine.run()?;
    skip(&mut machine, root)?;
    let end = machine.position;
    let value = finish(machine, root, &mut |key| {
        Err(format!("storage {key} lies outside this file"))
    })?;
    Ok((value, end))
}
