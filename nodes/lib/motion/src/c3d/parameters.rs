//! The parameter section: groups and, in them, named arrays.

use super::numbers::Bytes;

/// One parameter, its values still in the file.
struct Parameter<'a> {
    group: i8,
    name: &'a [u8],
    /// -1 characters, 1 bytes, 2 integers, 4 floats.
    kind: i8,
    dimensions: &'a [u8],
    offset: usize,
}

/// All parameters of a file.
pub(super) struct Parameters<'a> {
    file: Bytes<'a>,
    groups: Vec<(i8, &'a [u8])>,
    parameters: Vec<Parameter<'a>>,
}

impl<'a> Parameters<'a> {
    /// Follows the entries from `offset` on until one says that it is the last, or makes no sense.
    /// Each takes seven bytes at least.
    pub fn read(file: Bytes<'a>, offset: usize) -> Self {
        let mut found = Self {
            file,
            groups: Vec::new(),
            parameters: Vec::new(),
        };
        let mut next = Some(offset);
        while let Some(offset) = next {
            next = found.entry(offset);
        }
        found
    }

    /// Reads the entry at `offset`; returns where the next one is, always further on.
    fn entry(&mut self, offset: usize) -> Option<usize> {
        // Negative lengths mark locked entries.
        let length = usize::from(self.file.byte(offset)?.cast_signed().unsigned_abs());
        let group = self.file.byte(offset + 1)?.cast_signed();
        let name = self
            .file
            .slice(offset + 2, length)
            .filter(|name| !name.is_empty())?;
        let link = offset + 2 + length;
        let step = usize::from(self.file.unsigned(link)?);
        if group < 0 {
            self.groups.push((group.checked_neg()?, name));
        } else if let Some(parameter) = self.parameter(group, name, link + 2) {
            self.parameters.push(parameter);
        }
        (step >= 2).then_some(link + step)
    }

    fn parameter(&self, group: i8, name: &'a [u8], offset: usize) -> Option<Parameter<'a>> {
        let kind = self.file.byte(offset)?.cast_signed();
        let rank = usize::from(self.file.byte(offset + 1)?);
        let dimensions = self.file.slice(offset + 2, rank)?;
        Some(Parameter {
            group,
            name,
            kind,
            dimensions,
            offset: offset + 2 + rank,
        })
    }

    fn find(&self, group: &str, name: &str) -> Option<&Parameter<'a>> {
        let same = |bytes: &[u8], word: &str| bytes.eq_ignore_ascii_case(word.as_bytes());
        let (id, _) = self.groups.iter().find(|(_, known)| same(known, group))?;
        self.parameters
            .iter()
            .find(|parameter| parameter.group == *id && same(parameter.name, name))
    }

    /// The first number of a parameter; integers count as unsigned, as the frame counts of long
    /// recordings do.
    pub fn number(&self, group: &str, name: &str) -> Option<f64> {
        let parameter = self.find(group, name)?;
        match parameter.kind {
            1 => self.file.byte(parameter.offset).map(f64::from),
            2 => self.file.unsigned(parameter.offset).map(f64::from),
            4 => self
                .file
                .float(parameter.offset)
                .map(f64::from)
                .filter(|number| number.is_finite()),
            _ => None,
        }
    }

    /// The texts of a parameter of characters (width, count), without the spaces around them.
    pub fn strings(&self, group: &str, name: &str) -> Vec<String> {
        let Some(parameter) = self
            .find(group, name)
            .filter(|parameter| parameter.kind == -1)
        else {
            return Vec::new();
        };
        let sizes: Vec<usize> = parameter
            .dimensions
            .iter()
            .map(|&size| usize::from(size))
            .collect();
        let width = sizes.first().copied().unwrap_or(1);
        // Never more than the file holds: 7 dimensions of 255 would be.
        let count = sizes
            .iter()
            .skip(1)
            .try_fold(1_usize, |product, &size| product.checked_mul(size))
            .unwrap_or(0);
        let Some(bytes) = width
            .checked_mul(count)
            .and_then(|length| self.file.slice(parameter.offset, length))
        else {
            return Vec::new();
        };
        let text = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes);
            text.trim_matches(|c: char| c.is_whitespace() || c == '\0')
                .to_owned()
        };
        if width == 0 {
            Vec::new()
        } else {
            bytes.chunks_exact(width).map(text).collect()
        }
    }

    /// Frames by TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD, two 16-bit halves each, the low one
    /// first.
    pub fn trial_frames(&self) -> Option<usize> {
        let field = |name: &str| {
            let parameter = self
                .find("TRIAL", name)
                .filter(|parameter| parameter.kind == 2)?;
            let half = |index: usize| {
                self.file
                    .unsigned(parameter.offset + 2 * index)
                    .map(usize::from)
            };
            let high = if parameter.dimensions.first().is_some_and(|&size| size > 1) {
                half(1)?
            } else {
                0
            };
            Some(half(0)? + (high << 16))
        };
        (field("ACTUAL_END_FIELD")? + 1)
            .checked_sub(field("ACTUAL_START_FIELD")?)
            .filter(|&frames| frames > 0)
    }
}
