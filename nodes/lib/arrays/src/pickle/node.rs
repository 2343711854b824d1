//! Objects under construction.

use std::sync::Arc;

use super::known::Known;
use crate::blob::Blob;
use crate::dtype::DType;
use crate::value::{ArrayData, SparseKind, Value};

/// Index into the arena.
pub(super) type Id = u32;

/// An object under construction.
#[derive(Clone, Debug)]
pub(super) enum Node {
    None,
    Bool(bool),
    Int(i64),
    BigInt(Arc<str>),
    Float(f64),
    Complex(f64, f64),
    Text(Arc<str>),
    Bytes(Blob),
    /// A `str` of Python 2: text or bytes.
    OldText(Blob),
    List(Vec<Id>),
    Tuple(Vec<Id>),
    Dict(Vec<(Id, Id)>),
    Known(Known, Arc<str>),
    DType(DType),
    /// A numpy array that waits for its state.
    NewArray,
    Array(Arc<ArrayData>),
    Objects(Vec<usize>, Vec<Id>),
    Sparse(SparseKind, Option<Id>),
    ChumpyArray(Option<Id>),
    ChumpySelect(Option<Id>),
    JoblibArray,
    Storage(Arc<Storage>),
    Tensor(Box<Tensor>),
    /// What an unknown name stands for or makes, with all that it was given. Nothing is made of it:
    /// it can only be skipped.
    Opaque(Box<Opaque>),
    /// Out of a nested pickle.
    Value(Value),
}

/// See [`Node::Opaque`].
#[derive(Clone, Debug)]
pub(super) struct Opaque {
    pub name: Arc<str>,
    /// Where the pickle names it.
    pub offset: usize,
    /// The nodes that it was given: arguments, state, items.
    pub parts: Vec<Id>,
}

/// The memory behind torch tensors.
#[derive(Debug)]
pub(super) struct Storage {
    /// `None` where only the tensor says.
    pub dtype: Option<DType>,
    pub source: Source,
}

#[derive(Debug)]
pub(super) enum Source {
    /// Elsewhere in the file, under this name.
    Key(Arc<str>),
    Loaded(Blob),
}

/// A torch tensor: a view of a storage, in elements.
#[derive(Clone, Debug)]
pub(super) struct Tensor {
    pub storage: Arc<Storage>,
    pub dtype: DType,
    pub first: usize,
    pub shape: Vec<usize>,
    pub strides: Vec<usize>,
    /// Where the pickle asks for it.
    pub offset: usize,
}
