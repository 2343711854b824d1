//! numpy's types, arrays and scalars.

use std::sync::Arc;

use super::fault::Reason;
use super::machine::{Machine, shortened};
use super::node::{Id, Node};
use crate::blob::Blob;
use crate::dtype::{DType, Kind};
use crate::value::ArrayData;

impl Machine<'_> {
    /// `numpy.dtype('f8', False, True)`.
    pub(super) fn numpy_dtype(&mut self, description: Id) -> Result<Node, Reason> {
        if let Node::DType(dtype) = self.node(description) {
            return Ok(Node::DType(*dtype));
        }
        let text = self
            .text(description)
            .ok_or("a numpy type is no text; types made of records are not read")?;
        let unknown = || format!("numpy type `{}` is unknown", shortened(text.as_bytes()));
        Ok(Node::DType(DType::parse(&text).ok_or_else(unknown)?))
    }

    /// The state (version, byte order, …) of a type.
    pub(super) fn numpy_dtype_state(&mut self, dtype: DType, state: Id) -> Result<Node, Reason> {
        let items = self.items(state)?;
        let order = items
            .get(1)
            .and_then(|&order| self.text(order))
            .ok_or("a numpy type has no byte order")?;
        Ok(Node::DType(DType {
            big_endian: &*order == ">",
            ..dtype
        }))
    }

    pub(super) fn dtype(&self, id: Id) -> Result<DType, Reason> {
        match self.node(id) {
            Node::DType(dtype) => Ok(*dtype),
            _ => Err("a numpy type was expected".into()),
        }
    }

    /// The state (version, shape, type, Fortran order, bytes or list) of an array; numpy before 1.0
    /// wrote no version.
    pub(super) fn numpy_array(&mut self, state: Id) -> Result<Node, Reason> {
        let items = self.items(state)?;
        let (&[_, shape, dtype, fortran_order, content] | &[shape, dtype, fortran_order, content]) =
            items.as_slice()
        else {
            return Err("an array's state is not (version, shape, type, order, data)".into());
        };
        let (shape, dtype) = (self.sizes(shape)?, self.dtype(dtype)?);
        let fortran_order = matches!(self.node(fortran_order), Node::Bool(true) | Node::Int(1));
        if dtype.kind == Kind::Object {
            let items = self.items(content)?;
            return objects(shape, items, fortran_order);
        }
        let content = self.bytes_of(content)?;
        Ok(Node::Array(Arc::new(ArrayData::contiguous(
            dtype,
            shape,
            fortran_order,
            content,
        )?)))
    }

    /// Bytes, also where Python 3 reads what Python 2 wrote as text.
    fn bytes_of(&mut self, content: Id) -> Result<Blob, Reason> {
        if let Node::Text(text) = self.node(content) {
            let bytes: Option<Vec<u8>> = text
                .chars()
                .map(|c| u8::try_from(u32::from(c)).ok())
                .collect();
            let bytes = bytes.ok_or("an array's data are no bytes")?;
            self.budget.take(bytes.len() as u64)?;
            return Ok(bytes.into());
        }
        self.blob(content)
            .ok_or_else(|| "an array's data are no bytes".into())
    }

    /// `_frombuffer(bytes, type, shape, order)` of protocol 5.
    pub(super) fn numpy_from_buffer(
        &mut self,
        content: Id,
        dtype: Id,
        shape: Id,
        order: Id,
    ) -> Result<Node, Reason> {
        let (content, dtype, shape) = (
            self.bytes_of(content)?,
            self.dtype(dtype)?,
            self.sizes(shape)?,
        );
        if dtype.kind == Kind::Object {
            return Err("an array of objects lies in a buffer".into());
        }
        let fortran_order = self.text(order).is_some_and(|order| &*order == "F");
        Ok(Node::Array(Arc::new(ArrayData::contiguous(
            dtype,
            shape,
            fortran_order,
            content,
        )?)))
    }

    /// A scalar is an array without dimensions.
    pub(super) fn numpy_scalar(&mut self, dtype: Id, content: Id) -> Result<Node, Reason> {
        let dtype = self.dtype(dtype)?;
        if dtype.kind == Kind::Object {
            return Err("a numpy scalar holds an object".into());
        }
        let content = self.bytes_of(content)?;
        // A type such as `U` without a length takes that of its content.
        let dtype = if dtype.size == 0 {
            DType {
                size: content.len(),
                ..dtype
            }
        } else {
            dtype
        };
        Ok(Node::Array(Arc::new(ArrayData::contiguous(
            dtype,
            Vec::new(),
            false,
            content,
        )?)))
    }
}

/// An array of objects; in Fortran order the list runs along the first dimension first.
pub(super) fn objects(
    shape: Vec<usize>,
    items: Vec<Id>,
    fortran_order: bool,
) -> Result<Node, Reason> {
    let count = shape
        .iter()
        .try_fold(1_usize, |product, &size| product.checked_mul(size));
    if count != Some(items.len()) || shape.len() > 32 {
        return Err(format!("{} objects for an array of shape {shape:?}", items.len()).into());
    }
    if !fortran_order || shape.len() < 2 {
        return Ok(Node::Objects(shape, items));
    }
    let positions: Vec<u64> = (0..items.len() as u64).collect();
    let bytes: Vec<u8> = positions
        .iter()
        .flat_map(|position| position.to_le_bytes())
        .collect();
    let order =
        ArrayData::contiguous(DType::new(Kind::Uint, 8), shape.clone(), true, bytes.into())?;
    let order = order.as_integers().unwrap_or_default();
    let ordered = order
        .iter()
        .filter_map(|&position| items.get(usize::try_from(position).ok()?).copied())
        .collect();
    Ok(Node::Objects(shape, ordered))
}
