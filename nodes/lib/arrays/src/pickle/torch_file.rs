//! The pickles of torch's files.

use super::fault::Fault;
use super::finish::finish;
use super::machine::Machine;
use super::torch::Legacy;
use crate::blob::Blob;
use crate::limits::Budget;
use crate::value::Value;

/// The value of `data.pkl` in a torch archive; `storage` fetches the entry of a storage.
pub(crate) fn read_zipped(
    content: &Blob,
    budget: &mut Budget,
    storage: &mut dyn FnMut(&str) -> Result<Blob, String>,
) -> Result<Value, Fault> {
    let mut machine = Machine::new(content.clone(), budget, 0)?;
    let root = machine.run()?;
    finish(machine, root, storage)
}

/// The value of a file that torch wrote before version 1.6.
pub(crate) fn read_legacy(content: &Blob, budget: &mut Budget) -> Result<Value, Fault> {
    let Legacy { root, id, storages } = Legacy::new(content, budget, 0)?;
    finish(root, id, &mut |key| {
        storages
            .get(key)
            .cloned()
            .ok_or_else(|| format!("storage {key} is missing"))
    })
}
