//! Entries of dictionaries that are left out unread, whatever they hold.

use super::fault::{Fault, Reason};
use super::machine::Machine;
use super::node::{Id, Node};

/// Takes the entries off that the budget names by their keys from the root on. Unknown names may
/// stand below them, and nowhere else in the pickle: the first that does is refused.
pub(super) fn skip(machine: &mut Machine<'_>, root: Id) -> Result<(), Fault> {
    if !machine.skips() {
        return Ok(());
    }
    let mut below = Vec::new();
    for path in machine.budget.skipped {
        let Some((last, folders)) = path.split_last() else {
            continue;
        };
        let place = folders
            .iter()
            .try_fold(root, |place, key| machine.lookup(place, key));
        if let Some(place) = place {
            below.extend(machine.take_off(place, last));
        }
    }
    let mut skipped = vec![false; machine.nodes.len()];
    while let Some(id) = below.pop() {
        if let Some(seen @ false) = skipped.get_mut(id as usize) {
            *seen = true;
            machine.parts(id, &mut below);
        }
    }
    let opaque = machine
        .nodes
        .iter()
        .zip(&skipped)
        .find_map(|(node, skipped)| match node {
            Node::Opaque(opaque) if !skipped => Some(opaque),
            _ => None,
        });
    opaque.map_or(Ok(()), |opaque| {
        Err(Fault::new(
            opaque.offset,
            Reason::Refused(opaque.name.to_string()),
        ))
    })
}

impl Machine<'_> {
    /// Takes the entries under a key out of a dictionary and gives what they held.
    fn take_off(&mut self, dict: Id, key: &str) -> Vec<Id> {
        let Node::Dict(pairs) = self.node(dict) else {
            return Vec::new();
        };
        let (taken, kept): (Vec<_>, Vec<_>) = pairs
            .iter()
            .partition(|(other, _)| self.is_text(*other, key));
        self.replace(dict, Node::Dict(kept));
        taken.into_iter().map(|(_, value)| value).collect()
    }

    /// What a node refers to.
    fn parts(&self, id: Id, parts: &mut Vec<Id>) {
        match self.node(id) {
            Node::List(items) | Node::Tuple(items) | Node::Objects(_, items) => parts.extend(items),
            Node::Dict(pairs) => parts.extend(pairs.iter().flat_map(|&(key, value)| [key, value])),
            Node::Sparse(_, state) | Node::ChumpyArray(state) | Node::ChumpySelect(state) => {
                parts.extend(state)
            }
            Node::Opaque(opaque) => parts.extend(&opaque.parts),
            _ => {}
        }
    }
}
