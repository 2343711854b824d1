//! Arrays of numbers and text: as they lie in a file, and in C order.

use crate::blob::Blob;
use crate::dtype::{DType, Kind, half};

/// An array in C order (last dimension fastest).
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Its dimensions; none for a scalar.
    pub shape: Vec<usize>,
    /// Its elements; as many as the product of the shape.
    pub values: Vec<T>,
}

/// An array of elements of fixed size as it lies in a file: any element type, byte order and strides.
#[derive(Clone, Debug)]
pub(crate) struct PlainArray {
    dtype: DType,
    shape: Vec<usize>,
    bytes: Blob,
    /// In elements.
    strides: Vec<usize>,
}

impl PlainArray {
    /// An array in C or Fortran order over exactly `bytes`.
    pub(crate) fn contiguous(
        dtype: DType,
        shape: Vec<usize>,
        fortran_order: bool,
        bytes: Blob,
    ) -> Result<Self, String> {
        let (count, size) = (element_count(&shape)?, dtype.size);
        let expected = count.checked_mul(size);
        if expected != Some(bytes.len()) {
            let takes = expected.map_or("more than any memory holds".to_owned(), |expected| {
                expected.to_string()
            });
            return Err(format!(
                "{} data bytes, but shape {shape:?} of {dtype} takes {takes}",
                bytes.len()
            ));
        }
        if size == 0 && count > EMPTY_LIMIT {
            return Err(format!("shape {shape:?} of elements without bytes"));
        }
        let strides = if fortran_order {
            fortran_strides(&shape)
        } else {
            c_strides(&shape)
        };
        Ok(Self {
            dtype,
            shape,
            bytes,
            strides,
        })
    }

    /// An array whose element (i, j …) is element `first` + i strides\[0\] + j strides\[1\] … of
    /// `bytes`. Also returns how many bytes it shows, where that is more than there are.
    pub(crate) fn strided(
        dtype: DType,
        bytes: &Blob,
        first: usize,
        shape: Vec<usize>,
        strides: Vec<usize>,
    ) -> Result<(Self, u64), String> {
        let count = element_count(&shape)?;
        let shown = count
            .checked_mul(dtype.size)
            .ok_or_else(|| format!("shape {shape:?} of {dtype} is too large"))?;
        let outside = || {
            format!(
                "shape {shape:?} with strides {strides:?} from element {first} reaches past the storage's {} bytes",
                bytes.len()
            )
        };
        if strides.len() != shape.len() || dtype.size == 0 {
            return Err(outside());
        }
        let (mut start, mut length) = (0, 0);
        if count > 0 {
            let reach = shape
                .iter()
                .zip(&strides)
                .try_fold(0_usize, |sum, (&size, &stride)| {
                    sum.checked_add((size - 1).checked_mul(stride)?)
                });
            start = first.checked_mul(dtype.size).ok_or_else(outside)?;
            length = reach
                .and_then(|reach| reach.checked_add(1)?.checked_mul(dtype.size))
                .ok_or_else(outside)?;
        }
        let part = bytes.part(start, length).ok_or_else(outside)?;
        let repeated = if shown > bytes.len() { shown as u64 } else { 0 };
        Ok((
            Self {
                dtype,
                shape,
                bytes: part,
                strides,
            },
            repeated,
        ))
    }

    /// The type of the elements.
    pub(crate) fn dtype(&self) -> DType {
        self.dtype
    }

    /// The dimensions; none for a scalar.
    pub(crate) fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Number of elements.
    pub(crate) fn element_count(&self) -> usize {
        if self.shape.contains(&0) {
            0
        } else {
            self.shape.iter().product()
        }
    }

    /// The element bytes in C order through `decode`, which sees exactly one element.
    fn decoded<T>(&self, decode: impl Fn(&[u8]) -> T) -> Vec<T> {
        let (bytes, strides) = (&self.bytes, &self.strides);
        let (count, size) = (self.element_count(), self.dtype.size);
        if size == 0 {
            return (0..count).map(|_| decode(&[])).collect();
        }
        if *strides == c_strides(&self.shape) {
            return bytes.chunks_exact(size).take(count).map(decode).collect();
        }
        let mut values = Vec::with_capacity(count);
        let (mut index, mut element) = (vec![0; self.shape.len()], 0);
        for _ in 0..count {
            values.push(decode(
                bytes
                    .get(element * size..(element + 1) * size)
                    .unwrap_or(&[]),
            ));
            for ((i, &length), &stride) in index.iter_mut().zip(&self.shape).zip(strides).rev() {
                *i += 1;
                element += stride;
                if *i < length {
                    break;
                }
                element -= *i * stride;
                *i = 0;
            }
        }
        values
    }

    /// Numbers as float64; `None` for text, objects, complex numbers and records.
    pub(crate) fn as_floats(&self) -> Option<Vec<f64>> {
        let big = self.dtype.big_endian;
        Some(match (self.dtype.kind, self.dtype.size) {
            (Kind::Float, 8) => self.decoded(|b| f64::from_bits(unsigned(b, big))),
            (Kind::Float, 4) => {
                self.decoded(|b| f64::from(f32::from_bits(unsigned(b, big) as u32)))
            }
            (Kind::Float, 2) => self.decoded(|b| half(unsigned(b, big) as u16)),
            (Kind::Bfloat, _) => {
                self.decoded(|b| f64::from(f32::from_bits((unsigned(b, big) as u32) << 16)))
            }
            (Kind::Int, size) => self.decoded(|b| signed(b, big, size) as f64),
            (Kind::Uint | Kind::Bool, _) => self.decoded(|b| unsigned(b, big) as f64),
            _ => return None,
        })
    }

    /// Whole numbers; `None` for elements of another type. Unsigned ones above i64's range become
    /// its largest value.
    pub(crate) fn as_integers(&self) -> Option<Vec<i64>> {
        let big = self.dtype.big_endian;
        Some(match self.dtype.kind {
            Kind::Int => self.decoded(|b| signed(b, big, self.dtype.size)),
            Kind::Uint | Kind::Bool => {
                self.decoded(|b| i64::try_from(unsigned(b, big)).unwrap_or(i64::MAX))
            }
            _ => return None,
        })
    }

    /// Text elements (numpy `U` or `S`), without the zeros that pad them.
    pub(crate) fn as_texts(&self) -> Option<Vec<String>> {
        let big = self.dtype.big_endian;
        let from_code_points = |element: &[u8]| -> String {
            element
                .chunks_exact(4)
                .map(|b| {
                    char::from_u32(unsigned(b, big) as u32).unwrap_or(char::REPLACEMENT_CHARACTER)
                })
                .collect()
        };
        let texts = match self.dtype.kind {
            Kind::Text => self.decoded(from_code_points),
            Kind::Bytes => self.decoded(|b| String::from_utf8_lossy(b).into_owned()),
            _ => return None,
        };
        Some(
            texts
                .into_iter()
                .map(|text| text.trim_end_matches('\0').to_owned())
                .collect(),
        )
    }
}

/// Most elements without bytes (numpy `U0`), which cost the file nothing.
const EMPTY_LIMIT: usize = 1 << 16;
/// Most dimensions of an array; those of numpy 1 (numpy 2 has 64).
const RANK_LIMIT: usize = 32;
/// Largest dimension of an array that is empty because another one is 0.
const EMPTY_DIMENSION_LIMIT: usize = 1 << 24;

/// How many elements an array has, once its shape is found to be possible.
pub(crate) fn element_count(shape: &[usize]) -> Result<usize, String> {
    if shape.len() > RANK_LIMIT {
        return Err(format!(
            "{} dimensions; numpy has at most {RANK_LIMIT}",
            shape.len()
        ));
    }
    let empty = shape.contains(&0);
    if empty && shape.iter().any(|&size| size > EMPTY_DIMENSION_LIMIT) {
        return Err(format!("shape {shape:?} of an empty array"));
    }
    // Of an empty array too, so that whoever multiplies its other dimensions does not overflow.
    let product = shape
        .iter()
        .filter(|&&size| size > 0)
        .try_fold(1_usize, |product, &size| product.checked_mul(size));
    product
        .map(|product| if empty { 0 } else { product })
        .ok_or_else(|| format!("shape {shape:?} has more elements than any memory holds"))
}

fn c_strides(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1_usize; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis].saturating_mul(shape[axis]);
    }
    strides
}

fn fortran_strides(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1_usize; shape.len()];
    for axis in 1..shape.len() {
        strides[axis] = strides[axis - 1].saturating_mul(shape[axis - 1]);
    }
    strides
}

fn unsigned(bytes: &[u8], big_endian: bool) -> u64 {
    let step = |sum: u64, &byte: &u8| sum << 8 | u64::from(byte);
    if big_endian {
        bytes.iter().fold(0, step)
    } else {
        bytes.iter().rev().fold(0, step)
    }
}

fn signed(bytes: &[u8], big_endian: bool, size: usize) -> i64 {
    let unused = 64 - 8 * size.clamp(1, 8) as u32;
    ((unsigned(bytes, big_endian) << unused) as i64) >> unused
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn strides_orders_and_bytes() {
        let bytes = |values: &[i16]| {
            Blob::from(
                values
                    .iter()
                    .flat_map(|value| value.to_be_bytes())
                    .collect::<Vec<_>>(),
            )
        };
        let dtype = DType::parse(">i2").unwrap();
        let fortran =
            PlainArray::contiguous(dtype, vec![2, 3], true, bytes(&[1, 4, 2, 5, 3, -6])).unwrap();
        assert_eq!(fortran.as_integers().unwrap(), [1, 2, 3, 4, 5, -6]);
        assert_eq!(fortran.as_floats().unwrap()[5], -6.0);
        let (expanded, shown) =
            PlainArray::strided(dtype, &bytes(&[9, 7, 8]), 1, vec![3, 2], vec![0, 1]).unwrap();
        assert_eq!(
            (expanded.as_integers().unwrap(), shown),
            (vec![7, 8, 7, 8, 7, 8], 12)
        );
        for (first, shape, strides) in [
            (2, vec![2], vec![1]),
            (0, vec![usize::MAX, 2], vec![0, 1]),
            (0, vec![2], vec![usize::MAX]),
            (usize::MAX, vec![1], vec![1]),
        ] {
            assert!(PlainArray::strided(dtype, &bytes(&[9, 7, 8]), first, shape, strides).is_err());
        }
    }

    #[test]
    fn declared_sizes_are_checked() {
        let check = |shape: &[usize], descr: &str, length: usize| {
            PlainArray::contiguous(
                DType::parse(descr).unwrap(),
                shape.to_vec(),
                false,
                Blob::from(vec![0; length]),
            )
            .is_ok()
        };
        assert!(check(&[], "<f8", 8) && check(&[0, 7], "<f8", 0) && check(&[3], "<U0", 0));
        assert!(
            !check(&[1 << 40, 1 << 40], "<f8", 8)
                && !check(&[1 << 60], "<U0", 0)
                && !check(&[1 << 60, 0], "<f8", 0)
        );
        assert!(
            check(&[1 << 20, 0], "<f8", 0) && !check(&[1 << 23, 1 << 23, 1 << 23, 0], "<f8", 0)
        );
        assert!(!check(&[2], "<f8", 15) && !check(&[2], "<f8", 17) && !check(&[1; 40], "<f8", 8));
    }
}
