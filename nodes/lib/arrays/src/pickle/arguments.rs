//! What opcodes and calls are given: nodes as texts, sizes, items and bytes.

use std::sync::Arc;

use super::fault::Reason;
use super::machine::Machine;
use super::node::{Id, Node};
use crate::blob::Blob;

/// Bytes that a shallow copy of one item takes.
pub(super) const ITEM_BYTES: u64 = 16;
/// Longest name that is written as bytes.
const TEXT_LIMIT: usize = 4096;

impl Machine<'_> {
    /// The text of `str` (of Python 2 too); `None` for what is no text.
    pub(super) fn text(&self, id: Id) -> Option<Arc<str>> {
        match self.node(id) {
            Node::Text(text) => Some(Arc::clone(text)),
            // A longer one is no name, and would be copied each time it is asked for.
            Node::OldText(bytes) | Node::Bytes(bytes) if bytes.len() <= TEXT_LIMIT => {
                std::str::from_utf8(bytes).ok().map(Arc::from)
            }
            _ => None,
        }
    }

    pub(super) fn blob(&self, id: Id) -> Option<Blob> {
        match self.node(id) {
            Node::OldText(bytes) | Node::Bytes(bytes) => Some(bytes.clone()),
            _ => None,
        }
    }

    /// The items of a tuple or list, with what copying them costs.
    pub(super) fn items(&mut self, id: Id) -> Result<Vec<Id>, Reason> {
        let (Node::List(items) | Node::Tuple(items)) = self.node(id) else {
            return Err("a tuple was expected".into());
        };
        let items = items.clone();
        self.budget.take(ITEM_BYTES * items.len() as u64)?;
        Ok(items)
    }

    pub(super) fn size(&self, id: Id) -> Result<usize, Reason> {
        match self.node(id) {
            Node::Int(value) => {
                usize::try_from(*value).map_err(|_| format!("a size is {value}").into())
            }
            _ => Err("a size is no number".into()),
        }
    }

    pub(super) fn sizes(&mut self, id: Id) -> Result<Vec<usize>, Reason> {
        if let Node::Int(_) = self.node(id) {
            return Ok(vec![self.size(id)?]);
        }
        let items = self.items(id)?;
        items.into_iter().map(|item| self.size(item)).collect()
    }

    /// What `name` finds in a dictionary whose keys are text.
    pub(super) fn lookup(&self, dict: Id, name: &str) -> Option<Id> {
        let Node::Dict(pairs) = self.node(dict) else {
            return None;
        };
        pairs
            .iter()
            .rev()
            .find(|(key, _)| self.is_text(*key, name))
            .map(|&(_, value)| value)
    }

    pub(super) fn is_text(&self, id: Id, expected: &str) -> bool {
        match self.node(id) {
            Node::Text(text) => **text == *expected,
            Node::OldText(bytes) | Node::Bytes(bytes) => **bytes == *expected.as_bytes(),
            _ => false,
        }
    }

    pub(super) fn float(&self, id: Id) -> Result<f64, Reason> {
        match self.node(id) {
            Node::Float(value) => Ok(*value),
            Node::Int(value) => Ok(*value as f64),
            _ => Err("a number was expected".into()),
        }
    }
}
