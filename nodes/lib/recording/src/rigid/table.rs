//! Rows of numbers in a text file, with errors that know line and column, and exact stamps.

use cromosim_spatial::Stamp;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::RigidError;

/// Numbers beyond this are none of a motion.
const LARGEST: f64 = 1e12;
/// A quaternion as near as this to length 1 stays as it is written.
const EXACT_LENGTH: f64 = 1e-9;
const LENGTH_TOLERANCE: f64 = 1e-2;

/// The text of a file, without a byte order mark.
pub(crate) fn text<'a>(bytes: &'a [u8], name: &str) -> Result<&'a str, RigidError> {
    let text = std::str::from_utf8(bytes).map_err(|error| RigidError::NotText {
        name: name.to_owned(),
        offset: error.valid_up_to(),
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// One line's cells.
pub(crate) struct Row<'a> {
    pub name: &'a str,
    /// 1-based.
    pub line: usize,
    pub cells: Vec<&'a str>,
}

/// Lines with data: neither empty nor beginning with `#`.
pub(crate) fn rows<'a>(
    text: &'a str,
    name: &'a str,
    split: fn(&'a str) -> Vec<&'a str>,
) -> impl Iterator<Item = Row<'a>> {
    let lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()));
    let data = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    data.map(move |(line, content)| Row {
        name,
        line,
        cells: split(content),
    })
}

pub(crate) fn by_blanks(line: &str) -> Vec<&str> {
    line.split_ascii_whitespace().collect()
}

pub(crate) fn by_commas(line: &str) -> Vec<&str> {
    line.split(',').map(str::trim).collect()
}

impl Row<'_> {
    pub fn expect_columns(
        &self,
        fits: impl Fn(usize) -> bool,
        expected: &str,
    ) -> Result<(), RigidError> {
        if fits(self.cells.len()) {
            return Ok(());
        }
        let (name, line, found) = (self.name.to_owned(), self.line, self.cells.len());
        Err(RigidError::Columns {
            name,
            line,
            expected: expected.to_owned(),
            found,
        })
    }

    /// The number in a column (0-based).
    pub fn number(&self, column: usize) -> Result<f64, RigidError> {
        let cell = self.cell(column)?;
        let number = cell
            .parse()
            .ok()
            .filter(|number: &f64| number.abs() < LARGEST);
        number.ok_or_else(|| self.error(column, "a finite number"))
    }

    /// As [`Self::number`], where NaN marks a missing value.
    pub fn number_or_nan(&self, column: usize) -> Result<Option<f64>, RigidError> {
        if self.cell(column)?.eq_ignore_ascii_case("nan") {
            Ok(None)
        } else {
            self.number(column).map(Some)
        }
    }

    /// Three numbers from a column on.
    pub fn vector(&self, column: usize) -> Result<Vector3<f64>, RigidError> {
        Ok(Vector3::new(
            self.number(column)?,
            self.number(column + 1)?,
            self.number(column + 2)?,
        ))
    }

    /// x, y, z, w from their columns.
    pub fn rotation(&self, [x, y, z, w]: [usize; 4]) -> Result<UnitQuaternion<f64>, RigidError> {
        let quaternion = Quaternion::new(
            self.number(w)?,
            self.number(x)?,
            self.number(y)?,
            self.number(z)?,
        );
        unit_quaternion(quaternion).map_err(|length| RigidError::Quaternion {
            name: self.name.to_owned(),
            line: self.line,
            length,
        })
    }

    /// The stamp in a column whose unit is `10^-digits` s.
    pub fn stamp(&self, column: usize, digits: i32) -> Result<Stamp, RigidError> {
        let nanos = nanos(self.cell(column)?, digits);
        nanos
            .map(Stamp::from_nanos)
            .ok_or_else(|| self.error(column, "a time"))
    }

    pub fn cell(&self, column: usize) -> Result<&str, RigidError> {
        self.cells
            .get(column)
            .copied()
            .ok_or_else(|| RigidError::Columns {
                name: self.name.to_owned(),
                line: self.line,
                expected: format!("at least {}", column + 1),
                found: self.cells.len(),
            })
    }

    pub fn error(&self, column: usize, expected: &str) -> RigidError {
        let found = self.cells.get(column).copied().unwrap_or_default();
        let found = format!("\"{}\"", found.chars().take(40).collect::<String>());
        RigidError::Value {
            name: self.name.to_owned(),
            line: self.line,
            column: column + 1,
            expected: expected.to_owned(),
            found,
        }
    }

    /// Time goes on.
    pub fn check_order(&self, stamp: Stamp, previous: Option<&Stamp>) -> Result<(), RigidError> {
        match previous {
            Some(previous) if stamp <= *previous => Err(RigidError::Order {
                name: self.name.to_owned(),
                line: self.line,
                stamp_ns: stamp.nanos,
                previous_ns: previous.nanos,
            }),
            _ => Ok(()),
        }
    }
}

/// A rotation from a quaternion whose length is 1 within a hundredth; within a billionth it stays
/// bit for bit as it is.
///
/// # Errors
/// The length where it is not.
pub fn unit_quaternion(quaternion: Quaternion<f64>) -> Result<UnitQuaternion<f64>, f64> {
    let length = quaternion.norm();
    match (length - 1.0).abs() {
        off if off <= EXACT_LENGTH => Ok(UnitQuaternion::new_unchecked(quaternion)),
        off if off <= LENGTH_TOLERANCE => Ok(UnitQuaternion::new_normalize(quaternion)),
        _ => Err(length),
    }
}

/// Nanoseconds of a decimal number whose unit is `10^-digits` s, without passing through floats:
/// `1403636579.763555527` with 0 digits. What is finer than a nanosecond is rounded to the nearest,
/// halves away from zero. `None` where it is no number or beyond the range of stamps (292 years).
pub(crate) fn nanos(text: &str, digits: i32) -> Option<i64> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (
            mantissa,
            exponent
                .parse::<i32>()
                .ok()
                .filter(|exponent| exponent.abs() < 100)?,
        ),
        None => (text, 0),
    };
    let (negative, mantissa) = match mantissa.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let all_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if (whole.is_empty() && fraction.is_empty())
        || !all_digits(whole)
        || !all_digits(fraction)
        || whole.len() + fraction.len() > 200
    {
        return None;
    }
    // The number of digits, from the front, that make whole nanoseconds.
    let kept = whole.len() as i32 + exponent + 9 - digits;
    let mut value: i64 = 0;
    let mut places = whole.bytes().chain(fraction.bytes());
    for _ in 0..kept.max(0) {
        let digit = places.next().map_or(0, |byte| i64::from(byte - b'0'));
        value = value.checked_mul(10)?.checked_add(digit)?;
    }
    if kept >= 0 && places.next().is_some_and(|byte| byte >= b'5') {
        value = value.checked_add(1)?;
    }
    Some(if negative { -value } else { value })
}

/// Seconds with nine decimals: the inverse of [`nanos`] with 0 digits.
pub(crate) fn seconds_text(stamp: Stamp) -> String {
    let sign = if stamp.nanos < 0 { "-" } else { "" };
    let size = stamp.nanos.unsigned_abs();
    format!("{sign}{}.{:09}", size / 1_000_000_000, size % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_exact() {
        for (text, digits, expected) in [
            ("1403636579.763555527", 0, 1_403_636_579_763_555_527),
            ("1403636579763555584", 9, 1_403_636_579_763_555_584),
            ("1.403636579763555584e+09", 0, 1_403_636_579_763_555_584),
            ("1700000000123", 3, 1_700_000_000_123_000_000),
            ("0.0000000015", 0, 2),
            ("-0.5", 0, -500_000_000),
            (".25", 0, 250_000_000),
            ("12.", 0, 12_000_000_000),
            ("7", 9, 7),
            ("0.4", 9, 0),
            ("0.5", 9, 1),
            ("1e-30", 0, 0),
        ] {
            assert_eq!(nanos(text, digits), Some(expected), "{text}");
        }
        for text in [
            "",
            ".",
            "-",
            "1e",
            "nan",
            "1 2",
            "1e999",
            "99999999999",
            "1_0",
            "--1",
        ] {
            assert_eq!(nanos(text, 0), None, "{text}");
        }
        for value in [
            0,
            1,
            -1,
            999_999_999,
            -1_000_000_001,
            i64::MAX / 2,
            1_403_636_579_763_555_527,
        ] {
            assert_eq!(
                nanos(&seconds_text(Stamp::from_nanos(value)), 0),
                Some(value)
            );
        }
    }
}
