//! joblib writes an array's bytes into the file, after the pickled object that stands for it.

use std::sync::Arc;

use super::fault::Reason;
use super::machine::Machine;
use super::node::{Id, Node};
use super::read::read_nested;
use crate::dtype::Kind;
use crate::value::ArrayData;

impl Machine<'_> {
    /// The array whose `NumpyArrayWrapper` has `state`: its bytes begin where the pickle stands,
    /// after padding that a byte counts.
    pub(super) fn joblib_array(&mut self, state: Id) -> Result<Node, Reason> {
        let attribute = |name: &str| {
            self.lookup(state, name)
                .ok_or_else(|| Reason::from(format!("joblib's array has no {name}")))
        };
        let (shape, dtype, order) = (
            attribute("shape")?,
            attribute("dtype")?,
            attribute("order")?,
        );
        let alignment = self
            .lookup(state, "numpy_array_alignment_bytes")
            .map(|id| self.node(id));
        let aligned = alignment.is_some_and(|node| !matches!(node, Node::None));
        let (shape, dtype) = (self.sizes(shape)?, self.dtype(dtype)?);
        if dtype.kind == Kind::Object {
            return self.joblib_objects();
        }
        if aligned {
            let padding = self.take(1)?.first().copied().unwrap_or_default();
            self.take(padding.into())?;
        }
        let count = shape
            .iter()
            .try_fold(dtype.size, |product, &size| product.checked_mul(size));
        let content =
            self.take(count.ok_or_else(|| format!("shape {shape:?} of {dtype} is too large"))?)?;
        let fortran_order = self.text(order).is_some_and(|order| &*order == "F");
        Ok(Node::Array(Arc::new(ArrayData::contiguous(
            dtype,
            shape,
            fortran_order,
            content,
        )?)))
    }

    /// An array of objects follows as a pickle of its own.
    fn joblib_objects(&mut self) -> Result<Node, Reason> {
        let rest = self
            .bytes
            .part(self.position, self.bytes.len() - self.position)
            .ok_or("cut short")?;
        let (value, end) =
            read_nested(&rest, self.budget, self.nesting + 1).map_err(|fault| fault.nested())?;
        self.position += end;
        Ok(Node::Value(value))
    }
}
