//! numpy's `.npy`: a header in text, then the elements (format versions 1 to 3).

use std::borrow::Cow;
use std::sync::Arc;

use crate::blob::Blob;
use crate::dtype::{DType, Kind};
use crate::limits::Budget;
use crate::pickle::{self, Fault};
use crate::value::{ArrayData, Value};

pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";
/// Bytes from which every header that is read can be parsed.
pub(crate) const HEADER_BYTES_LIMIT: usize = 64 << 10;

/// What a `.npy` says of its array, known before its elements are read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NpyHeader {
    /// numpy's element description; `a record` for structured elements.
    pub element: String,
    /// First dimension fastest.
    pub fortran_order: bool,
    /// The dimensions; none for a scalar.
    pub shape: Vec<u64>,
}

impl NpyHeader {
    /// The header at the start of `bytes` and where the data begin.
    pub(crate) fn parse(bytes: &[u8]) -> Result<(Self, usize), String> {
        let (text, end) = header_text(bytes)?;
        let value = |key: &str| {
            text.split_once(&format!("'{key}':"))
                .map(|(_, rest)| rest.trim_start())
        };
        let descr = value("descr").ok_or("the header has no 'descr'")?;
        let element = match descr
            .strip_prefix('\'')
            .and_then(|rest| rest.split_once('\''))
        {
            Some((element, _)) => element.to_owned(),
            None => "a record".to_owned(),
        };
        let fortran_order = value("fortran_order")
            .ok_or("the header has no 'fortran_order'")?
            .starts_with("True");
        let shape = value("shape")
            .and_then(|rest| rest.strip_prefix('('))
            .and_then(|rest| rest.split_once(')'));
        let (shape, _) = shape.ok_or("the header has no 'shape'")?;
        // Python 2 wrote long integers as 72L.
        let sizes = shape
            .split(',')
            .map(|size| size.trim().trim_end_matches('L'))
            .filter(|size| !size.is_empty());
        let shape = sizes
            .map(|size| {
                size.parse::<u64>()
                    .map_err(|_| format!("shape ({shape}) is not of sizes"))
            })
            .collect::<Result<_, _>>()?;
        let header = Self {
            element,
            fortran_order,
            shape,
        };
        Ok((header, end))
    }
}

/// The Python literal in a header, and where it ends.
fn header_text(bytes: &[u8]) -> Result<(Cow<'_, str>, usize), String> {
    let cut = || "the numpy header is cut short".to_owned();
    if !bytes.starts_with(MAGIC) {
        return Err("not a numpy array".to_owned());
    }
    let (length, start): (usize, usize) = match bytes.get(6).ok_or_else(cut)? {
        1 => (
            usize::from(u16::from_le_bytes(fixed(bytes, 8).ok_or_else(cut)?)),
            10,
        ),
        2 | 3 => (
            u32::from_le_bytes(fixed(bytes, 8).ok_or_else(cut)?) as usize,
            12,
        ),
        version => {
            return Err(format!(
                "numpy format version {version} is unknown; versions 1 to 3 are read"
            ));
        }
    };
    let text = bytes
        .get(start..start.saturating_add(length))
        .filter(|_| length + start <= HEADER_BYTES_LIMIT)
        .ok_or_else(|| format!("the header is cut short or too long ({length} bytes)"))?;
    Ok((String::from_utf8_lossy(text), start + length))
}

fn fixed<const N: usize>(bytes: &[u8], start: usize) -> Option<[u8; N]> {
    bytes.get(start..start + N)?.try_into().ok()
}

/// The array of a whole `.npy`; one of objects is a pickle.
pub(crate) fn read(bytes: &Blob, budget: &mut Budget) -> Result<Value, Fault> {
    let fault = |reason| Fault::new(0, reason);
    let (header, start) = NpyHeader::parse(bytes).map_err(fault)?;
    let content = bytes
        .part(start, bytes.len() - start)
        .ok_or_else(|| fault("the numpy header is cut short".to_owned()))?;
    let unknown = || {
        fault(format!(
            "elements are {}, which this reader does not know",
            header.element
        ))
    };
    let dtype = DType::parse(&header.element).ok_or_else(unknown)?;
    let too_large = |_| fault(format!("shape {:?} is too large", header.shape));
    let shape = header
        .shape
        .iter()
        .map(|&size| usize::try_from(size))
        .collect::<Result<Vec<_>, _>>()
        .map_err(too_large)?;
    if dtype.kind == Kind::Object {
        return object_array(&content, shape, budget).map_err(|error| error.after(start));
    }
    let array =
        ArrayData::contiguous(dtype, shape, header.fortran_order, content).map_err(fault)?;
    Ok(Value::Array(Arc::new(array)))
}

/// numpy pickles the array itself; what it says must agree with the header.
fn object_array(content: &Blob, shape: Vec<usize>, budget: &mut Budget) -> Result<Value, Fault> {
    let value = pickle::read(content, budget)?;
    let found = match &value {
        Value::Array(array) => Some(array.shape()),
        _ => None,
    };
    if found != Some(shape.as_slice()) {
        return Err(Fault::new(
            0,
            format!("the header says shape {shape:?}, the pickle within says {value:?}"),
        ));
    }
    Ok(value)
}
