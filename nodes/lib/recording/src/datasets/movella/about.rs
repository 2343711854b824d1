//! What stands above the rows of readings, and where their columns are.

use std::collections::BTreeMap;

use crate::rigid::table::Row;

/// The column that tells such a file.
pub(super) const COUNTER: &str = "packetcounter";
/// The device's own clock.
pub(super) const DEVICE_TIME: &str = "sampletimefine";
/// Lines before the header, at most.
pub(super) const MOST_LINES_BEFORE: usize = 60;

/// The header's line and what it is parted by.
pub(super) fn header(text: &str) -> Option<(usize, char)> {
    let lines = text.lines().take(MOST_LINES_BEFORE).enumerate();
    let mut found = lines.filter_map(|(index, line)| {
        let delimiter = [',', ';', '\t']
            .into_iter()
            .max_by_key(|delimiter| line.matches(*delimiter).count())?;
        let mut cells = line.split(delimiter);
        let told = cells.any(|cell| plain(cell) == COUNTER);
        (told && line.matches(delimiter).count() > 2).then_some((index, delimiter))
    });
    found.next()
}

/// A column's name without case and signs: `Acc_X` and `acc[x]` are `accx`.
pub(super) fn plain(cell: &str) -> String {
    let letters = cell.chars().filter(char::is_ascii_alphanumeric);
    letters.map(|letter| letter.to_ascii_lowercase()).collect()
}

/// What stands above the rows.
pub(super) struct About<'a> {
    pub is_mt: bool,
    pub rate_hz: Option<f64>,
    pub tag: Option<&'a str>,
    pub titles: Vec<&'a str>,
    pub columns: BTreeMap<String, usize>,
}

impl<'a> About<'a> {
    pub fn of(text: &'a str, header: usize, delimiter: char) -> Self {
        let mut said: BTreeMap<String, &str> = BTreeMap::new();
        let mut has_slashes = false;
        for line in text.lines().take(header) {
            has_slashes |= line.starts_with("//");
            if let Some((key, value)) = line.split_once(':') {
                let value = value.trim_matches([',', ';', '\t', ' ']);
                said.entry(plain(key)).or_insert(value);
            }
        }
        let line = text.lines().nth(header).unwrap_or_default();
        let titles: Vec<&str> = line.split(delimiter).map(str::trim).collect();
        let mut columns = BTreeMap::new();
        for (index, title) in titles.iter().enumerate() {
            columns.entry(plain(title)).or_insert(index);
        }
        let rate = ["outputrate", "updaterate"]
            .iter()
            .find_map(|key| said.get(*key))
            .and_then(|rate| {
                rate.to_lowercase()
                    .trim_end_matches("hz")
                    .trim()
                    .parse()
                    .ok()
            });
        Self {
            is_mt: has_slashes
                || columns.contains_key("quatq0")
                || columns.contains_key("oriincq0"),
            rate_hz: rate.filter(|rate| (1e-3..1e6).contains(rate)),
            tag: said.get("devicetag").copied().filter(|tag| !tag.is_empty()),
            titles,
            columns,
        }
    }

    /// The columns of these names, where all are there.
    pub fn find<const N: usize>(&self, names: [&str; N]) -> Option<[usize; N]> {
        let mut found = [0; N];
        for (own, name) in found.iter_mut().zip(names) {
            *own = *self.columns.get(name)?;
        }
        Some(found)
    }
}

pub(super) fn is_empty(row: &Row<'_>, column: usize) -> bool {
    let cell = row.cells.get(column).copied().unwrap_or_default();
    cell.is_empty() || cell.eq_ignore_ascii_case("nan")
}
