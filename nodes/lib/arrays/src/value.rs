//! What a container holds, as Python would see it. Arrays of objects hold values and values hold
//! arrays, so that both stand here.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use crate::array::{PlainArray, element_count};
use crate::blob::Blob;
use crate::dtype::{DType, Kind};

/// A Python value. Cloning is cheap: what it holds is shared, as it was in the file.
#[derive(Clone)]
#[non_exhaustive]
pub enum Value {
    /// Python's `None`.
    None,
    /// A `bool`.
    Bool(bool),
    /// An `int` within 64 bits.
    Int(i64),
    /// Any other `int`: its decimal digits, or its bytes as `0x…` (two's complement, most
    /// significant first).
    BigInt(Arc<str>),
    /// A `float`, 64 bits.
    Float(f64),
    /// A `complex`: real and imaginary part.
    Complex(f64, f64),
    /// `str`; of Python 2 also a `str` of sound UTF-8.
    Text(Arc<str>),
    /// `bytes` or `bytearray`; of Python 2 a `str` that is no text.
    Bytes(Arc<[u8]>),
    /// A `list`, `set`, `frozenset` (in the file's order).
    List(Arc<Vec<Value>>),
    /// A `tuple` or `torch.Size`.
    Tuple(Arc<Vec<Value>>),
    /// A `dict`, `OrderedDict` or `defaultdict`.
    Dict(Arc<Dict>),
    /// A numpy array or scalar, a torch tensor, a chumpy array.
    Array(Arc<ArrayData>),
    /// A matrix of scipy.sparse.
    Sparse(Arc<Sparse>),
    /// A type or function that is named but not called, such as `torch.float32`.
    Name(Arc<str>),
}

/// A dictionary in the order of the file; of keys set twice the last value counts.
#[derive(Default)]
pub struct Dict {
    pairs: Vec<(Value, Value)>,
    by_text: HashMap<Arc<str>, usize>,
}

/// Which index of a sparse matrix is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SparseKind {
    /// Of a `csc_matrix`: the column index.
    Columns,
    /// Of a `csr_matrix`: the row index.
    Rows,
}

/// A sparse matrix; indices are checked against the shape.
#[derive(Debug)]
pub struct Sparse {
    /// Number of rows and of columns.
    pub shape: [usize; 2],
    /// Row, column and value of each stored element, in the file's order.
    pub entries: Vec<(u32, u32, f64)>,
    /// How the file stored it.
    pub kind: SparseKind,
}

impl Dict {
    pub(crate) fn new(pairs: impl IntoIterator<Item = (Value, Value)>) -> Self {
        let mut dict = Self::default();
        let mut by_number = HashMap::new();
        for (key, value) in pairs {
            let next = dict.pairs.len();
            let index = match (&key, key.text()) {
                (_, Some(text)) => *dict.by_text.entry(text).or_insert(next),
                (Value::Int(number), None) => *by_number.entry(*number).or_insert(next),
                _ => next,
            };
            match dict.pairs.get_mut(index) {
                Some(pair) => pair.1 = value,
                None => dict.pairs.push((key, value)),
            }
        }
        dict
    }

    /// The value under a key of text (`str`, or `bytes` of the same letters).
    pub fn get(&self, key: &str) -> Option<&Value> {
        self.by_text
            .get(key)
            .and_then(|&index| self.pairs.get(index))
            .map(|(_, value)| value)
    }

    /// Keys and values in the order of the file.
    pub fn pairs(&self) -> &[(Value, Value)] {
        &self.pairs
    }
}

impl Value {
    /// The text of `str` or of `bytes` in UTF-8.
    pub(crate) fn text(&self) -> Option<Arc<str>> {
        match self {
            Self::Text(text) => Some(Arc::clone(text)),
            Self::Bytes(bytes) => std::str::from_utf8(bytes).ok().map(Arc::from),
            _ => None,
        }
    }

    /// The object in a 0-dimensional array of objects, as `numpy.save` wraps a dictionary; else the
    /// value itself.
    pub fn unwrapped(&self) -> &Self {
        let mut value = self;
        // Arrays of objects nest at most as deep as `Limits::depth`.
        while let Self::Array(array) = value
            && array.shape().is_empty()
            && let [only] = array.object_elements()
        {
            value = only;
        }
        value
    }

    /// The Python type's name, for messages.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::None => "None",
            Self::Bool(_) => "a bool",
            Self::Int(_) | Self::BigInt(_) => "an int",
            Self::Float(_) => "a float",
            Self::Complex(..) => "a complex number",
            Self::Text(_) => "text",
            Self::Bytes(_) => "bytes",
            Self::List(_) => "a list",
            Self::Tuple(_) => "a tuple",
            Self::Dict(_) => "a dictionary",
            Self::Array(_) => "an array",
            Self::Sparse(_) => "a sparse matrix",
            Self::Name(_) => "a name",
        }
    }
}

/// An array as it lies in the file: elements of any type, byte order and strides, or objects.
#[derive(Clone, Debug)]
pub struct ArrayData(Elements);

#[derive(Clone, Debug)]
enum Elements {
    Plain(PlainArray),
    Objects {
        shape: Vec<usize>,
        /// In C order.
        values: Arc<Vec<Value>>,
    },
}

impl ArrayData {
    /// An array in C or Fortran order over exactly `bytes`.
    pub(crate) fn contiguous(
        dtype: DType,
        shape: Vec<usize>,
        fortran_order: bool,
        bytes: Blob,
    ) -> Result<Self, String> {
        let plain = PlainArray::contiguous(dtype, shape, fortran_order, bytes)?;
        Ok(Self(Elements::Plain(plain)))
    }

    /// A view of `bytes`, see [`PlainArray::strided`].
    pub(crate) fn strided(
        dtype: DType,
        bytes: &Blob,
        first: usize,
        shape: Vec<usize>,
        strides: Vec<usize>,
    ) -> Result<(Self, u64), String> {
        let (plain, repeated) = PlainArray::strided(dtype, bytes, first, shape, strides)?;
        Ok((Self(Elements::Plain(plain)), repeated))
    }

    /// An array of objects in C order.
    pub(crate) fn objects(shape: Vec<usize>, values: Vec<Value>) -> Result<Self, String> {
        if element_count(&shape)? != values.len() {
            return Err(format!(
                "{} objects for an array of shape {shape:?}",
                values.len()
            ));
        }
        Ok(Self(Elements::Objects {
            shape,
            values: Arc::new(values),
        }))
    }

    /// The type of the elements.
    pub fn dtype(&self) -> DType {
        match &self.0 {
            Elements::Plain(plain) => plain.dtype(),
            Elements::Objects { .. } => DType::new(Kind::Object, 8),
        }
    }

    /// The dimensions; none for a scalar.
    pub fn shape(&self) -> &[usize] {
        match &self.0 {
            Elements::Plain(plain) => plain.shape(),
            Elements::Objects { shape, .. } => shape,
        }
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        match &self.0 {
            Elements::Plain(plain) => plain.element_count(),
            Elements::Objects { values, .. } => values.len(),
        }
    }

    /// The elements of an array of objects, in C order; empty for any other array.
    pub fn object_elements(&self) -> &[Value] {
        match &self.0 {
            Elements::Plain(_) => &[],
            Elements::Objects { values, .. } => values,
        }
    }

    /// Numbers as float64; `None` for text, objects, complex numbers and records.
    pub(crate) fn as_floats(&self) -> Option<Vec<f64>> {
        self.plain()?.as_floats()
    }

    /// Whole numbers; `None` for elements of another type. Unsigned ones above i64's range become
    /// its largest value.
    pub(crate) fn as_integers(&self) -> Option<Vec<i64>> {
        self.plain()?.as_integers()
    }

    /// Text elements (numpy `U` or `S`), without the zeros that pad them; `None` for any other.
    pub(crate) fn as_texts(&self) -> Option<Vec<String>> {
        self.plain()?.as_texts()
    }

    fn plain(&self) -> Option<&PlainArray> {
        match &self.0 {
            Elements::Plain(plain) => Some(plain),
            Elements::Objects { .. } => None,
        }
    }
}

/// One level only: shared values could fill any memory when written out.
impl fmt::Debug for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => formatter.write_str("None"),
            Self::Bool(value) => write!(formatter, "{value}"),
            Self::Int(value) => write!(formatter, "{value}"),
            Self::BigInt(digits) => formatter.write_str(digits),
            Self::Float(value) => write!(formatter, "{value}"),
            Self::Complex(real, imaginary) => write!(formatter, "{real}{imaginary:+}i"),
            Self::Text(text) => write!(formatter, "{text:?}"),
            Self::Bytes(bytes) => write!(formatter, "{} bytes", bytes.len()),
            Self::List(items) => write!(formatter, "list of {}", items.len()),
            Self::Tuple(items) => write!(formatter, "tuple of {}", items.len()),
            Self::Dict(dict) => write!(formatter, "{dict:?}"),
            Self::Array(array) => {
                write!(formatter, "array {:?} of {}", array.shape(), array.dtype())
            }
            Self::Sparse(sparse) => write!(formatter, "sparse {:?}", sparse.shape),
            Self::Name(name) => write!(formatter, "name {name}"),
        }
    }
}

impl fmt::Debug for Dict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "dictionary of {}", self.pairs.len())
    }
}
