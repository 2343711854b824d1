//! MATLAB's level 5 files (`.mat` by `save -v6` and `-v7`, GNU Octave, `scipy.io.savemat`): arrays
//! of numbers and text by name.
//!
//! Source: MathWorks, MAT-File Format, level 5. 128 bytes of header, then elements: a tag (type,
//! bytes) and content, padded to 8 bytes; contents of up to 4 bytes lie in the tag. An array is an
//! element of elements: flags, dimensions, name, numbers by columns; it may stand in a zlib stream.
//! What is no array of real numbers or text (cells, structs, objects, sparse, complex) is passed
//! over.

use std::sync::Arc;

use crate::blob::Blob;
use crate::dtype::{DType, Kind};
use crate::inflate::inflated;
use crate::limits::{Budget, Limits};
use crate::value::{ArrayData, Dict, Value};

/// The first bytes of each such file.
pub(crate) const START: &[u8] = b"MATLAB 5.0 MAT";
const HEADER_BYTES: usize = 128;
/// Type of an element that is an array.
const MATRIX: u32 = 14;
/// Type of an element that is a zlib stream of others.
const COMPRESSED: u32 = 15;
/// The class of arrays of text.
const CHARACTERS: u8 = 4;
/// The classes of numbers, from 6 (double) to 15 (uint64).
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
/// Flag of an array with an imaginary part.
const COMPLEX: u8 = 0x08;
/// Longest name that is read, bytes; MATLAB itself stops at 63 letters.
const NAME_LIMIT: usize = 1 << 12;
/// Most dimensions that are read.
const DIMENSIONS_LIMIT: usize = 32;

/// All arrays of a file by their names.
pub(crate) fn read(bytes: &Blob, budget: &mut Budget) -> Result<Value, String> {
    let big_endian = match bytes.get(126..HEADER_BYTES) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err("the MATLAB header is cut short or damaged".to_owned()),
    };
    let mut file = Elements {
        bytes: bytes.clone(),
        position: HEADER_BYTES,
        big_endian,
    };
    let mut arrays = Vec::new();
    while let Some(element) = file.next()? {
        let array = match element.kind {
            COMPRESSED => {
                let limits = Limits {
                    decoded_bytes: budget.decoded_bytes,
                    ..budget.limits
                };
                let content = inflated(&element.content, limits)?;
                budget.take(content.len() as u64)?;
                let mut within = Elements {
                    bytes: content.into(),
                    position: 0,
                    big_endian,
                };
                within
                    .next()?
                    .filter(|element| element.kind == MATRIX)
                    .map(|element| array(element, big_endian, budget))
            }
            MATRIX => Some(array(element, big_endian, budget)),
            _ => None,
        };
        arrays.extend(array.transpose()?.flatten());
    }
    Ok(Value::Dict(Arc::new(Dict::new(arrays))))
}

struct Element {
    kind: u32,
    content: Blob,
}

/// Elements one after the other.
struct Elements {
    bytes: Blob,
    position: usize,
    big_endian: bool,
}

impl Elements {
    /// The next element, `None` at the end.
    fn next(&mut self) -> Result<Option<Element>, String> {
        if self.position >= self.bytes.len() {
            return Ok(None);
        }
        let at = self.position;
        let cut =
            || format!("byte {at}: an element is cut short; the file is incomplete or damaged");
        let tag = self.number(at).ok_or_else(cut)?;
        // Two bytes of length before the type: the content stands in the tag.
        let (kind, length, start) = match tag >> 16 {
            0 => (tag, self.number(at + 4).ok_or_else(cut)? as usize, at + 8),
            length @ 1..=4 => (tag & 0xffff, length as usize, at + 4),
            length => {
                return Err(format!(
                    "byte {at}: an element of {length} bytes within its tag; the file is damaged"
                ));
            }
        };
        let content = self.bytes.part(start, length).ok_or_else(cut)?;
        let end = start + length;
        // zlib streams are not padded; the last padding of a file may be missing.
        self.position = if kind == COMPRESSED {
            end
        } else {
            end.next_multiple_of(8)
        };
        Ok(Some(Element { kind, content }))
    }

    fn number(&self, at: usize) -> Option<u32> {
        number(self.bytes.get(at..at.checked_add(4)?)?, self.big_endian)
    }
}

fn number(bytes: &[u8], big_endian: bool) -> Option<u32> {
    let bytes = *bytes.first_chunk()?;
    Some(if big_endian {
        u32::from_be_bytes(bytes)
    } else {
        u32::from_le_bytes(bytes)
    })
}

/// Name and value of an array, `None` for what is passed over.
fn array(
    matrix: Element,
    big_endian: bool,
    budget: &mut Budget,
) -> Result<Option<(Value, Value)>, String> {
    let mut parts = Elements {
        bytes: matrix.content,
        position: 0,
        big_endian,
    };
    let mut part = |what: &str| {
        parts
            .next()?
            .ok_or_else(|| format!("an array has no {what}; the file is damaged"))
    };
    let flags = part("flags")?;
    let word = number(&flags.content, big_endian).ok_or("an array's flags are cut short")?;
    let (class, flags) = (word as u8, (word >> 8) as u8);
    if !(NUMBERS.contains(&class) || class == CHARACTERS) || flags & COMPLEX != 0 {
        return Ok(None);
    }
    let (dimensions, name, content) = (part("dimensions")?, part("name")?, part("content")?);
    let (sizes, rest) = dimensions.content.as_chunks::<4>();
    let shape = sizes
        .iter()
        .map(|size| number(size, big_endian).map(|size| size as usize))
        .collect::<Option<Vec<_>>>();
    let Some(shape) =
        shape.filter(|shape| rest.is_empty() && (2..=DIMENSIONS_LIMIT).contains(&shape.len()))
    else {
        return Err("an array's dimensions are no list of sizes".to_owned());
    };
    if name.content.len() > NAME_LIMIT {
        return Err(format!("a name of {} bytes", name.content.len()));
    }
    // Bytes that MATLAB keeps for its own objects have no name.
    if name.content.is_empty() {
        return Ok(None);
    }
    let name = String::from_utf8_lossy(&name.content).into_owned();
    let in_name = |problem: String| format!("array {name}: {problem}");
    let value = if class == CHARACTERS {
        budget
            .take(4 * content.content.len() as u64)
            .map_err(in_name)?;
        match text(&content, big_endian) {
            Some(text) => Value::Text(text.into()),
            None => return Ok(None),
        }
    } else {
        let dtype = dtype(content.kind, big_endian)
            .ok_or_else(|| in_name(format!("elements of type {}", content.kind)))?;
        Value::Array(Arc::new(
            ArrayData::contiguous(dtype, shape, true, content.content).map_err(in_name)?,
        ))
    };
    Ok(Some((Value::Text(name.into()), value)))
}

/// Numbers may be stored in a smaller type than their array has.
fn dtype(kind: u32, big_endian: bool) -> Option<DType> {
    let (kind, size) = match kind {
        1 => (Kind::Int, 1),
        2 => (Kind::Uint, 1),
        3 => (Kind::Int, 2),
        4 => (Kind::Uint, 2),
        5 => (Kind::Int, 4),
        6 => (Kind::Uint, 4),
        7 => (Kind::Float, 4),
        9 => (Kind::Float, 8),
        12 => (Kind::Int, 8),
        13 => (Kind::Uint, 8),
        _ => return None,
    };
    Some(DType {
        kind,
        size,
        big_endian,
    })
}

/// Of several rows the letters come by columns, as MATLAB's `x(:)'`.
fn text(content: &Element, big_endian: bool) -> Option<String> {
    let units = || {
        content.content.as_chunks::<2>().0.iter().map(|two| {
            if big_endian {
                u16::from_be_bytes(*two)
            } else {
                u16::from_le_bytes(*two)
            }
        })
    };
    match content.kind {
        4 | 17 => Some(
            char::decode_utf16(units())
                .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
                .collect(),
        ),
        1 | 2 | 16 => Some(String::from_utf8_lossy(&content.content).into_owned()),
        _ => None,
    }
}
