//! torch's tensors: views of storages, which a zip archive holds beside the pickle, a legacy file
//! after it, and a plain pickle as bytes.

use std::collections::HashMap;
use std::sync::Arc;

use super::fault::{Fault, Reason};
use super::known::Known;
use super::machine::Machine;
use super::node::{Id, Node, Source, Storage, Tensor};
use crate::blob::Blob;
use crate::dtype::DType;
use crate::limits::Budget;

/// How files begin that torch wrote before version 1.6, and storages in plain pickles: a pickled
/// number.
pub(crate) const LEGACY_START: &[u8] = b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.";

impl Machine<'_> {
    /// `BINPERSID`: ('storage', type, key, device, element count[, view]).
    pub(super) fn persistent(&mut self) -> Result<(), Reason> {
        let id = self.pop()?;
        let items = self.items(id)?;
        let unknown = || {
            Reason::from("a persistent id that is not torch's ('storage', type, key, device, size)")
        };
        let &[tag, class, key, _device, _count, ref view @ ..] = items.as_slice() else {
            return Err(unknown());
        };
        if self.text(tag).as_deref() != Some("storage") {
            return Err(unknown());
        }
        if view
            .first()
            .is_some_and(|&view| !matches!(self.node(view), Node::None))
        {
            return Err(
                "a storage that is part of another, as torch before 0.4 wrote; save it again"
                    .into(),
            );
        }
        let dtype = match self.node(class) {
            Node::Known(Known::Storage(dtype), _) => Some(*dtype),
            Node::Known(Known::UntypedStorage, _) => None,
            _ => return Err(unknown()),
        };
        let key = self.text(key).ok_or_else(unknown)?;
        self.push(Node::Storage(Arc::new(Storage {
            dtype,
            source: Source::Key(key),
        })))
    }

    /// `_rebuild_tensor_v2(storage, first element, shape, strides, …)`; `_v3` also tells the type.
    pub(super) fn tensor(
        &mut self,
        storage: Id,
        first: Id,
        shape: Id,
        strides: Id,
        dtype: Option<&Id>,
    ) -> Result<Node, Reason> {
        let Node::Storage(storage) = self.node(storage).clone() else {
            return Err("a tensor has no storage".into());
        };
        let dtype = match dtype.map(|&id| self.node(id)) {
            Some(Node::Known(Known::TensorType(dtype), _)) => Some(*dtype),
            _ => storage.dtype,
        };
        let dtype = dtype.ok_or("a tensor has no type")?;
        let (first, shape, strides) = (self.size(first)?, self.sizes(shape)?, self.sizes(strides)?);
        let offset = self.position;
        Ok(Node::Tensor(Box::new(Tensor {
            storage,
            dtype,
            first,
            shape,
            strides,
            offset,
        })))
    }

    /// `_load_from_bytes(bytes)`: a file within the pickle that holds one storage.
    pub(super) fn loaded_storage(&mut self, content: Id) -> Result<Node, Reason> {
        let content = self.blob(content).ok_or("a storage's file is no bytes")?;
        let mut legacy =
            Legacy::new(&content, self.budget, self.nesting + 1).map_err(|fault| fault.nested())?;
        let root = legacy.root.node(legacy.id).clone();
        let Node::Storage(storage) = root else {
            return Err("a storage's file holds something else".into());
        };
        let Source::Key(key) = &storage.source else {
            return Err("a storage's file holds something else".into());
        };
        let loaded = legacy
            .storages
            .remove(key)
            .ok_or_else(|| format!("storage {key} is missing"))?;
        Ok(Node::Storage(Arc::new(Storage {
            dtype: storage.dtype,
            source: Source::Loaded(loaded),
        })))
    }
}

/// Five pickles (magic number, version, system, root object, storage keys), then of each storage
/// its element count and its elements.
pub(super) struct Legacy<'a> {
    /// The machine that read them all.
    pub root: Machine<'a>,
    /// The root object.
    pub id: Id,
    /// The bytes of each storage by its key.
    pub storages: HashMap<Arc<str>, Blob>,
}

impl<'a> Legacy<'a> {
    pub fn new(content: &Blob, budget: &'a mut Budget, nesting: usize) -> Result<Self, Fault> {
        if !content.starts_with(LEGACY_START) {
            return Err(Fault::new(0, "torch's magic number is missing"));
        }
        let mut machine = Machine::new(content.clone(), budget, nesting)?;
        for _ in 0..2 {
            machine.run()?;
        }
        let system = machine.run()?;
        if let Some(order) = machine.lookup(system, "little_endian")
            && !matches!(machine.node(order), Node::Bool(true))
        {
            return Err(Fault::new(
                machine.position,
                "torch wrote it on a big-endian machine, which this reader does not know",
            ));
        }
        let id = machine.run()?;
        let keys = machine.run()?;
        let storages = machine.legacy_storages(keys)?;
        Ok(Self {
            root: machine,
            id,
            storages,
        })
    }
}

impl Machine<'_> {
    fn legacy_storages(&mut self, keys: Id) -> Result<HashMap<Arc<str>, Blob>, Fault> {
        let mut sizes: HashMap<Arc<str>, usize> = HashMap::new();
        for node in &self.nodes {
            if let Node::Storage(storage) = node
                && let Source::Key(key) = &storage.source
            {
                sizes.insert(
                    Arc::clone(key),
                    storage.dtype.map_or(1, |dtype: DType| dtype.size),
                );
            }
        }
        let mut storages = HashMap::new();
        let at = self.position;
        let fault = |reason| Fault { offset: at, reason };
        for key in self.items(keys).map_err(fault)? {
            let offset = self.position;
            let fault = |reason| Fault { offset, reason };
            let key = self
                .text(key)
                .ok_or_else(|| fault("a storage key is no text".into()))?;
            let size = *sizes
                .get(&key)
                .ok_or_else(|| fault("a storage that no tensor uses".into()))?;
            let count = self.take(8).map_err(fault)?;
            let count = count
                .iter()
                .rev()
                .fold(0_u64, |sum, &byte| sum << 8 | u64::from(byte));
            let bytes = usize::try_from(count)
                .ok()
                .and_then(|count| count.checked_mul(size))
                .unwrap_or(usize::MAX);
            storages.insert(key, self.take(bytes).map_err(fault)?);
        }
        Ok(storages)
    }
}
