//! A part of bytes that are shared: arrays refer to the file that they came in, so that reading
//! copies nothing.

use std::ops::{Deref, Range};
use std::sync::Arc;

/// A range of shared bytes.
#[derive(Clone)]
pub struct Blob {
    bytes: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Blob {
    /// Part of this, `None` where it reaches past the end.
    pub fn part(&self, start: usize, length: usize) -> Option<Self> {
        let end = start
            .checked_add(length)
            .filter(|&end| end <= self.range.len())?;
        Some(Self {
            bytes: Arc::clone(&self.bytes),
            range: self.range.start + start..self.range.start + end,
        })
    }
}

impl From<Vec<u8>> for Blob {
    fn from(bytes: Vec<u8>) -> Self {
        let range = 0..bytes.len();
        Self {
            bytes: Arc::new(bytes),
            range,
        }
    }
}

impl Deref for Blob {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes.get(self.range.clone()).unwrap_or_default()
    }
}

impl std::fmt::Debug for Blob {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} bytes", self.range.len())
    }
}
