//! From the arena to values that share what the pickle shared.

use std::sync::Arc;

use super::fault::{Fault, Reason};
use super::machine::Machine;
use super::node::{Id, Node, Opaque, Source, Tensor};
use crate::blob::Blob;
use crate::dtype::{DType, Kind};
use crate::limits::Budget;
use crate::value::{ArrayData, Dict, Sparse, SparseKind, Value};

/// What a value in a list or dictionary takes, about.
const VALUE_BYTES: u64 = 64;
/// Recursion never goes deeper, whatever the limits say.
const DEPTH_LIMIT: usize = 1000;

/// The value of node `root`; `storage` fetches the bytes of a torch storage.
pub(super) fn finish(
    machine: Machine<'_>,
    root: Id,
    storage: &mut dyn FnMut(&str) -> Result<Blob, String>,
) -> Result<Value, Fault> {
    let depth_limit = machine.budget.depth.min(DEPTH_LIMIT);
    let offset = machine.position;
    let mut done = Vec::new();
    done.resize_with(machine.nodes.len(), || State::Untouched);
    let mut finisher = Finisher {
        machine,
        done,
        storage,
        depth_limit,
        offset,
        refused: None,
    };
    let value = finisher.value(root, 0);
    value.map(|(value, _)| value).map_err(|message| {
        let refused = finisher
            .refused
            .take()
            .map(|name| Reason::Refused(name.to_string()));
        Fault {
            offset: finisher.offset,
            reason: refused.unwrap_or(Reason::Unsound(message)),
        }
    })
}

enum State {
    Untouched,
    InProgress,
    /// The value and how many levels it has.
    Done(Value, usize),
}

struct Finisher<'a, 'b> {
    machine: Machine<'a>,
    done: Vec<State>,
    storage: &'b mut dyn FnMut(&str) -> Result<Blob, String>,
    depth_limit: usize,
    /// Where a fault is to be looked for: the pickle's end, unless an object knows better.
    offset: usize,
    /// The name of an opaque object that is asked for.
    refused: Option<Arc<str>>,
}

impl Finisher<'_, '_> {
    /// The value of a node and how many levels it has.
    fn value(&mut self, id: Id, depth: usize) -> Result<(Value, usize), String> {
        let too_deep = || {
            format!(
                "objects lie within each other more than {} levels deep",
                self.depth_limit
            )
        };
        if depth > self.depth_limit {
            return Err(too_deep());
        }
        match self.done.get(id as usize) {
            Some(State::Done(value, height)) if depth + height <= self.depth_limit => {
                return Ok((value.clone(), *height));
            }
            Some(State::Done(..)) => return Err(too_deep()),
            Some(State::InProgress) => return Err("an object contains itself".to_owned()),
            _ => {}
        }
        self.set(id, State::InProgress);
        // Each node is taken out once: what it becomes is kept instead.
        let node = std::mem::replace(
            self.machine
                .nodes
                .get_mut(id as usize)
                .ok_or("an object is missing")?,
            Node::None,
        );
        let (value, height) = self.made(node, depth)?;
        self.set(id, State::Done(value.clone(), height));
        Ok((value, height))
    }

    fn set(&mut self, id: Id, state: State) {
        if let Some(place) = self.done.get_mut(id as usize) {
            *place = state;
        }
    }

    fn made(&mut self, node: Node, depth: usize) -> Result<(Value, usize), String> {
        let value = match node {
            Node::None => Value::None,
            Node::Bool(value) => Value::Bool(value),
            Node::Int(value) => Value::Int(value),
            Node::BigInt(digits) => Value::BigInt(digits),
            Node::Float(value) => Value::Float(value),
            Node::Complex(real, imaginary) => Value::Complex(real, imaginary),
            Node::Text(text) => Value::Text(text),
            Node::Bytes(bytes) => Value::Bytes(self.copied(&bytes)?),
            Node::OldText(bytes) => match std::str::from_utf8(&bytes) {
                Ok(text) => Value::Text(text.into()),
                Err(_) => Value::Bytes(self.copied(&bytes)?),
            },
            Node::Known(_, name) => Value::Name(name),
            Node::DType(dtype) => Value::Name(dtype.to_string().into()),
            Node::Array(array) => Value::Array(array),
            Node::Value(value) => value,
            Node::Tensor(tensor) => self.tensor(&tensor)?,
            Node::Storage(_) => {
                return Err("a torch storage stands where a tensor was expected".to_owned());
            }
            Node::NewArray | Node::JoblibArray => return Err("an array has no content".to_owned()),
            Node::List(items) => {
                return self
                    .items(&items, depth)
                    .map(|(items, height)| (Value::List(Arc::new(items)), height));
            }
            Node::Tuple(items) => {
                return self
                    .items(&items, depth)
                    .map(|(items, height)| (Value::Tuple(Arc::new(items)), height));
            }
            Node::Objects(shape, items) => {
                let (items, height) = self.items(&items, depth)?;
                let array = ArrayData::objects(shape, items)?;
                return Ok((Value::Array(Arc::new(array)), height));
            }
            Node::Dict(pairs) => return self.dictionary(pairs, depth),
            // It also lies where nothing is skipped.
            Node::Opaque(opaque) => return Err(self.refuse(*opaque)),
            Node::Sparse(kind, state) => {
                self.sparse(kind, state.ok_or("a sparse matrix has no content")?, depth)?
            }
            Node::ChumpyArray(state) => {
                self.attribute(state.ok_or("a chumpy array has no content")?, "x", depth)?
            }
            Node::ChumpySelect(state) => {
                self.select(state.ok_or("a chumpy array has no content")?, depth)?
            }
        };
        Ok((value, 0))
    }

    fn dictionary(&mut self, pairs: Vec<(Id, Id)>, depth: usize) -> Result<(Value, usize), String> {
        let (keys, values): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
        let ((keys, key_height), (values, height)) =
            (self.items(&keys, depth)?, self.items(&values, depth)?);
        let dict = Dict::new(keys.into_iter().zip(values));
        Ok((Value::Dict(Arc::new(dict)), height.max(key_height)))
    }

    fn items(&mut self, ids: &[Id], depth: usize) -> Result<(Vec<Value>, usize), String> {
        self.machine.budget.take(VALUE_BYTES * ids.len() as u64)?;
        let (mut values, mut height) = (Vec::with_capacity(ids.len()), 0);
        for &id in ids {
            let (value, levels) = self.value(id, depth + 1)?;
            height = height.max(levels);
            values.push(value);
        }
        Ok((values, height + 1))
    }

    fn refuse(&mut self, opaque: Opaque) -> String {
        self.offset = opaque.offset;
        self.refused.insert(opaque.name).to_string()
    }

    fn copied(&mut self, bytes: &[u8]) -> Result<Arc<[u8]>, String> {
        self.machine.budget.take(bytes.len() as u64)?;
        Ok(Arc::from(bytes))
    }

    fn tensor(&mut self, tensor: &Tensor) -> Result<Value, String> {
        self.offset = tensor.offset;
        let bytes = match &tensor.storage.source {
            Source::Loaded(bytes) => bytes.clone(),
            Source::Key(key) => (self.storage)(key)?,
        };
        let array = tensor_array(tensor, &bytes, self.machine.budget)?;
        self.offset = self.machine.position;
        Ok(Value::Array(Arc::new(array)))
    }

    /// An object's attribute.
    fn attribute(&mut self, state: Id, name: &str, depth: usize) -> Result<Value, String> {
        let (state, _) = self.value(state, depth + 1)?;
        let Value::Dict(state) = state else {
            return Err("an object's state is no dictionary".to_owned());
        };
        state
            .get(name)
            .cloned()
            .ok_or_else(|| format!("an object has no attribute `{name}`"))
    }

    /// Elements `idxs` of the flat `a`, in shape `preferred_shape`.
    fn select(&mut self, state: Id, depth: usize) -> Result<Value, String> {
        let (from, picks) = (
            self.attribute(state, "a", depth)?,
            self.attribute(state, "idxs", depth)?,
        );
        let (Value::Array(from), Value::Array(picks)) = (from, picks) else {
            return Err("chumpy's Select is not of arrays".to_owned());
        };
        let shape = match self.attribute(state, "preferred_shape", depth)? {
            Value::Tuple(sizes) | Value::List(sizes) => {
                sizes.iter().map(size).collect::<Option<Vec<_>>>()
            }
            _ => None,
        };
        let shape = shape.unwrap_or_else(|| picks.shape().to_vec());
        self.machine
            .budget
            .take(16 * (from.element_count() + picks.element_count()) as u64)?;
        let (values, picks) = (
            from.as_floats()
                .ok_or("chumpy's Select is not of numbers")?,
            picks.as_integers().ok_or("idxs are no integers")?,
        );
        let picked = picks
            .iter()
            .map(|&pick| values.get(usize::try_from(pick).ok()?))
            .collect::<Option<Vec<_>>>();
        let bytes: Vec<u8> = picked
            .ok_or("chumpy's Select picks elements that are not there")?
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let array = ArrayData::contiguous(DType::new(Kind::Float, 8), shape, false, bytes.into())?;
        Ok(Value::Array(Arc::new(array)))
    }

    fn sparse(&mut self, kind: SparseKind, state: Id, depth: usize) -> Result<Value, String> {
        let shape = self
            .attribute(state, "_shape", depth)
            .or_else(|_| self.attribute(state, "shape", depth))?;
        let sizes = match &shape {
            Value::Tuple(sizes) | Value::List(sizes) => {
                sizes.iter().map(size).collect::<Option<Vec<_>>>()
            }
            _ => None,
        };
        let Some(&[rows, columns]) = sizes.as_deref() else {
            return Err("a sparse matrix has no shape of two sizes".to_owned());
        };
        let mut numbers = |name: &str| match self.attribute(state, name, depth)? {
            Value::Array(array) => Ok(array),
            _ => Err(format!("a sparse matrix' {name} is no array")),
        };
        let (content, indices, ends) = (numbers("data")?, numbers("indices")?, numbers("indptr")?);
        self.machine.budget.take(
            16 * (content.element_count() + indices.element_count() + ends.element_count()) as u64,
        )?;
        let integers = |array: &ArrayData| {
            array
                .as_integers()
                .ok_or("a sparse matrix' indices are no integers")
        };
        let content = content
            .as_floats()
            .ok_or("a sparse matrix is not of numbers")?;
        let (indices, ends) = (integers(&indices)?, integers(&ends)?);
        let entries = entries(kind, [rows, columns], &content, &indices, &ends)
            .ok_or("a sparse matrix' indices do not suit its shape")?;
        Ok(Value::Sparse(Arc::new(Sparse {
            shape: [rows, columns],
            entries,
            kind,
        })))
    }
}

/// Row, column and value of each element; `None` where an index lies outside.
fn entries(
    kind: SparseKind,
    shape: [usize; 2],
    content: &[f64],
    indices: &[i64],
    ends: &[i64],
) -> Option<Vec<(u32, u32, f64)>> {
    let [rows, columns] = shape;
    let (lines, across) = if kind == SparseKind::Columns {
        (columns, rows)
    } else {
        (rows, columns)
    };
    u32::try_from(rows.max(columns)).ok()?;
    if ends.len() != lines.checked_add(1)?
        || content.len() != indices.len()
        || ends.first() != Some(&0)
    {
        return None;
    }
    let mut entries = Vec::with_capacity(content.len());
    for (line, range) in ends.windows(2).enumerate() {
        let range = usize::try_from(range[0]).ok()?..usize::try_from(range[1]).ok()?;
        for (&index, &value) in indices.get(range.clone())?.iter().zip(content.get(range)?) {
            let (line, index) = (
                line as u32,
                u32::try_from(index)
                    .ok()
                    .filter(|&index| (index as usize) < across)?,
            );
            entries.push(if kind == SparseKind::Columns {
                (index, line, value)
            } else {
                (line, index, value)
            });
        }
    }
    Some(entries)
}

/// A size, as a Python int or a numpy scalar.
fn size(value: &Value) -> Option<usize> {
    match value {
        Value::Int(value) => usize::try_from(*value).ok(),
        Value::Array(array) if array.shape().is_empty() => {
            usize::try_from(*array.as_integers()?.first()?).ok()
        }
        _ => None,
    }
}

/// The array of a tensor, once its storage is at hand.
fn tensor_array(tensor: &Tensor, storage: &Blob, budget: &mut Budget) -> Result<ArrayData, String> {
    let (array, repeated) = ArrayData::strided(
        tensor.dtype,
        storage,
        tensor.first,
        tensor.shape.clone(),
        tensor.strides.clone(),
    )?;
    budget.take_expanded(repeated)?;
    Ok(array)
}
