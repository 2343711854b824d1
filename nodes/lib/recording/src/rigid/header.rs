//! Tables with a header that names the columns: finding columns by name, and the column of time.

use cromosim_spatial::Stamp;

use super::RigidError;
use super::table::{Row, nanos};

/// A header's cell: its words in lower case, joined by `_`, and the unit in brackets.
pub(super) struct Title {
    pub words: String,
    pub unit: String,
}

impl Title {
    pub fn of(cell: &str) -> Self {
        let (title, unit) = cell.split_once(['[', '(']).unwrap_or((cell, ""));
        let lower = title.trim().trim_start_matches(['#', '%']).to_lowercase();
        let words: Vec<&str> = lower
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .collect();
        Self {
            words: words.join("_"),
            unit: unit.trim_end_matches([']', ')', ' ']).trim().to_lowercase(),
        }
    }

    /// The words end with this name.
    pub fn is(&self, name: &str) -> bool {
        self.words
            .strip_suffix(name)
            .is_some_and(|before| before.is_empty() || before.ends_with('_'))
    }
}

/// Reads a table with commas, semicolons or tabs: the one that the header has most of.
pub(super) fn table_reader(text: &str) -> csv::Reader<&[u8]> {
    let first = text
        .lines()
        .find(|line| !line.trim().is_empty())
        .unwrap_or_default();
    let count = |delimiter: u8| first.bytes().filter(|byte| *byte == delimiter).count();
    let delimiter = *[b',', b';', b'\t']
        .iter()
        .rev()
        .max_by_key(|delimiter| count(**delimiter))
        .unwrap_or(&b',');
    csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes())
}

/// The line (1-based) of a record of the text. The crate counts a line when it reads its last byte, which of
/// `\r\n` is the next record's first.
pub(crate) fn line_of(record: &csv::StringRecord, text: &str) -> usize {
    let Some(place) = record.position() else {
        return 0;
    };
    let start = usize::try_from(place.byte()).unwrap_or(usize::MAX);
    let rest = text.as_bytes().get(start..).unwrap_or_default();
    let before = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    place.line() as usize + before.filter(|byte| **byte == b'\n').count()
}

/// The column with the first of the names that is there.
pub(super) fn find(titles: &[Title], names: &[String]) -> Option<usize> {
    names
        .iter()
        .find_map(|name| titles.iter().position(|title| title.is(name)))
}

/// As [`find`]; the error says what is missing.
pub(super) fn need(
    titles: &[Title],
    names: &[String],
    missing: &str,
    header: &[String],
    name: &str,
) -> Result<usize, RigidError> {
    let absent = || RigidError::Header {
        name: name.to_owned(),
        line: 1,
        missing: missing.to_owned(),
        found: header.to_vec(),
    };
    find(titles, names).ok_or_else(absent)
}

/// Where the time stands, and in which unit.
pub(super) struct TimeColumn {
    column: usize,
    /// Whole nanoseconds beside whole seconds.
    nanoseconds: Option<usize>,
    /// The unit is 10^-digits s; `None` until the first row tells.
    pub digits: Option<i32>,
}

impl TimeColumn {
    pub fn of(titles: &[Title], header: &[String], name: &str) -> Result<Self, RigidError> {
        let owned = |names: &[&str]| {
            names
                .iter()
                .map(|name| (*name).to_owned())
                .collect::<Vec<_>>()
        };
        let nanoseconds = find(titles, &owned(&["nanosec", "nanosecs", "nsec", "nsecs"]));
        let seconds = find(titles, &owned(&["sec", "secs"])).filter(|_| nanoseconds.is_some());
        let units = [("s", 0), ("sec", 0), ("ms", 3), ("us", 6), ("ns", 9)];
        let time_names = ["stamp", "timestamp", "time", "t"];
        let with_unit = time_names
            .iter()
            .flat_map(|name| units.map(|(unit, _)| format!("{name}_{unit}")));
        let all_names: Vec<String> = owned(&time_names).into_iter().chain(with_unit).collect();
        let column = match seconds {
            Some(seconds) => seconds,
            None => need(
                titles,
                &all_names,
                "time (stamp, time, timestamp, t)",
                header,
                name,
            )?,
        };
        let of_unit = |unit: &str| {
            units
                .iter()
                .find(|(name, _)| *name == unit)
                .map(|(_, digits)| *digits)
        };
        let title = &titles[column];
        let by_name = title
            .words
            .rsplit_once('_')
            .filter(|(before, _)| time_names.iter().any(|name| before.ends_with(name)));
        let digits = if seconds.is_some() {
            Some(0)
        } else {
            of_unit(&title.unit).or_else(|| of_unit(by_name?.1))
        };
        Ok(Self {
            column,
            nanoseconds: nanoseconds.filter(|_| seconds.is_some()),
            digits,
        })
    }

    /// A row's stamp. Where no header said the unit, the first row's size does, and `digits` keeps
    /// it.
    pub fn stamp(&self, row: &Row<'_>, digits: &mut Option<i32>) -> Result<Stamp, RigidError> {
        let unit = match *digits {
            Some(unit) => unit,
            None => *digits.insert(match self.size(row)? {
                1e17.. => 9,
                1e14.. => 6,
                1e11.. => 3,
                _ => 0,
            }),
        };
        let stamp = row.stamp(self.column, unit)?;
        let Some(column) = self.nanoseconds else {
            return Ok(stamp);
        };
        let more = nanos(row.cell(column)?, 9).filter(|nanos| (0..1_000_000_000).contains(nanos));
        let more = more.ok_or_else(|| row.error(column, "nanoseconds below 1e9"))?;
        let sum = stamp
            .nanos
            .checked_add(more)
            .ok_or_else(|| row.error(column, "a time"))?;
        Ok(Stamp::from_nanos(sum))
    }

    /// Times are larger than any other number.
    fn size(&self, row: &Row<'_>) -> Result<f64, RigidError> {
        let number = row
            .cell(self.column)?
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite());
        number
            .map(f64::abs)
            .ok_or_else(|| row.error(self.column, "a time"))
    }
}
