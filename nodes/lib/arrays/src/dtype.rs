//! Types of array elements, in numpy's notation.

use std::fmt;

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One byte, 0 or 1.
    Bool,
    /// Signed, 1 to 8 bytes.
    Int,
    /// Unsigned, 1 to 8 bytes.
    Uint,
    /// IEEE 754 of 2, 4 or 8 bytes.
    Float,
    /// The upper half of a float32 (torch.bfloat16).
    Bfloat,
    /// Real and imaginary part, floats of half the size.
    Complex,
    /// UCS-4 text of fixed length, padded with zeros (numpy `U`).
    Text,
    /// Bytes of fixed length, padded with zeros (numpy `S`).
    Bytes,
    /// A Python object, pickled.
    Object,
    /// What this crate does not interpret: records, dates.
    Opaque,
}

/// The type of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DType {
    /// What an element is.
    pub kind: Kind,
    /// Bytes of one element.
    pub size: usize,
    /// Most significant byte first.
    pub big_endian: bool,
}

impl DType {
    /// Little-endian elements of `size` bytes.
    pub const fn new(kind: Kind, size: usize) -> Self {
        Self {
            kind,
            size,
            big_endian: false,
        }
    }

    /// From numpy's description, such as `<f4`, `|S5`, `>i8`, `O`; without a byte order it is
    /// little-endian.
    pub fn parse(description: &str) -> Option<Self> {
        let (order, rest) = match description.as_bytes().first()? {
            b'<' | b'=' | b'|' => (false, description.get(1..)?),
            b'>' => (true, description.get(1..)?),
            _ => (false, description),
        };
        if rest == "?" {
            return Some(Self::new(Kind::Bool, 1));
        }
        let (letter, digits) = (rest.as_bytes().first()?, rest.get(1..)?);
        let number = |digits: &str| {
            if digits.is_empty() {
                Some(0)
            } else {
                digits.parse::<usize>().ok().filter(|&n| n < 1 << 31)
            }
        };
        let (kind, size) = match letter {
            b'b' => (Kind::Bool, number(digits)?),
            b'i' => (Kind::Int, number(digits)?),
            b'u' => (Kind::Uint, number(digits)?),
            b'f' => (Kind::Float, number(digits)?),
            b'c' => (Kind::Complex, number(digits)?),
            b'U' => (Kind::Text, number(digits)?.checked_mul(4)?),
            b'S' | b'a' => (Kind::Bytes, number(digits)?),
            b'O' => (Kind::Object, 8),
            b'V' => (Kind::Opaque, number(digits)?),
            b'M' | b'm' => (Kind::Opaque, 8),
            _ => return None,
        };
        let fits = match kind {
            Kind::Bool => size == 1,
            Kind::Int | Kind::Uint => matches!(size, 1 | 2 | 4 | 8),
            Kind::Float => matches!(size, 2 | 4 | 8),
            Kind::Complex => matches!(size, 8 | 16),
            _ => true,
        };
        fits.then_some(Self {
            kind,
            size,
            big_endian: order,
        })
    }
}

impl fmt::Display for DType {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let order = match (self.size, self.kind) {
            (..=1, _) | (_, Kind::Bytes | Kind::Object | Kind::Opaque) => '|',
            _ if self.big_endian => '>',
            _ => '<',
        };
        let (letter, size) = match self.kind {
            Kind::Bool => ('b', self.size),
            Kind::Int => ('i', self.size),
            Kind::Uint => ('u', self.size),
            Kind::Float => ('f', self.size),
            Kind::Bfloat => return formatter.write_str("bfloat16"),
            Kind::Complex => ('c', self.size),
            Kind::Text => ('U', self.size / 4),
            Kind::Bytes => ('S', self.size),
            Kind::Object => return formatter.write_str("|O"),
            Kind::Opaque => ('V', self.size),
        };
        write!(formatter, "{order}{letter}{size}")
    }
}

/// The value of an IEEE 754 half.
pub(crate) fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2_f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2_f64.powi(exponent - 15),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_come_back() {
        for text in [
            "<f4", ">f8", "<i8", "|b1", "<U5", "|S3", "|u1", "<c16", "|O", "<f2", "|V10",
        ] {
            assert_eq!(DType::parse(text).unwrap().to_string(), text);
        }
        assert_eq!(DType::parse("f4"), DType::parse("<f4"));
        for wrong in ["", "<", "f3", "<f16", "x8", "<U99999999999", "é"] {
            assert_eq!(DType::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn halves() {
        let cases = [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 2_f64.powi(-24)),
            (0x3555, 0.333_251_953_125),
        ];
        assert!(cases.iter().all(|&(bits, value)| half(bits) == value));
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }
}
