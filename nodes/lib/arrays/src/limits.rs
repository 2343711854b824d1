//! What a hostile file may cost.

/// Bounds on what is built from one container. Whatever a header declares is checked against the
/// bytes that are there before memory is taken; these bounds are for what honest bytes can still
/// multiply into (compression, shared objects, deep nesting).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that decompressed data, and objects rebuilt from it, may take in all.
    pub decoded_bytes: u64,
    /// Opcodes of a pickle, nested ones included.
    pub opcodes: u64,
    /// Levels of lists, dictionaries and arrays of objects within each other.
    pub depth: usize,
}

impl Default for Limits {
    /// 4 GiB, 50 million opcodes, 100 levels: hours of video estimates with all their vertices.
    fn default() -> Self {
        Self {
            decoded_bytes: 4 << 30,
            opcodes: 50_000_000,
            depth: 100,
        }
    }
}

/// Any file may take so many bytes once it is decoded, and [`DECODED_FACTOR`] times its own size: a
/// small file that asks for gigabytes is no honest one. Packed arrays of estimates shrink to a
/// third, empty ones to a thousandth, which the floor leaves room for; a pickled float has nine
/// bytes and takes 160 here, of an integer below 256 two bytes take as much.
const DECODED_FLOOR: u64 = 64 << 20;
/// See [`DECODED_FLOOR`].
const DECODED_FACTOR: u64 = 64;

impl Limits {
    /// The same, but no more than a file of so many bytes may take.
    pub(crate) fn of_file(self, bytes: u64) -> Self {
        let most = DECODED_FLOOR.saturating_add(DECODED_FACTOR.saturating_mul(bytes));
        Self {
            decoded_bytes: self.decoded_bytes.min(most),
            ..self
        }
    }
}

/// Elements of the largest array that accessors hand out as numbers: 2 GiB of float64.
pub const ELEMENTS_LIMIT: usize = 1 << 28;

/// A tensor with a stride of 0 shows the same bytes many times. It may show this many bytes, and
/// [`EXPANSION`] times what the file has.
pub(crate) const EXPANDED_BYTES: u64 = 16 << 20;
pub(crate) const EXPANSION: u64 = 256;

/// What is left of the limits while a container is read.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    pub decoded_bytes: u64,
    pub opcodes: u64,
    pub expanded_bytes: u64,
    pub depth: usize,
    pub limits: Limits,
    /// Entries of dictionaries that are left out, by their keys from the root on.
    pub skipped: &'static [&'static [&'static str]],
}

impl Budget {
    pub fn new(limits: Limits, container_bytes: u64) -> Self {
        Self {
            decoded_bytes: limits.decoded_bytes,
            opcodes: limits.opcodes,
            expanded_bytes: EXPANDED_BYTES
                .saturating_add(EXPANSION.saturating_mul(container_bytes)),
            depth: limits.depth,
            limits,
            skipped: &[],
        }
    }

    /// Takes `bytes` off; the message where too little is left.
    pub fn take(&mut self, bytes: u64) -> Result<(), String> {
        self.decoded_bytes = self
            .decoded_bytes
            .checked_sub(bytes)
            .ok_or_else(|| self.too_much())?;
        Ok(())
    }

    pub fn too_much(&self) -> String {
        format!(
            "the content takes more than the {} bytes that a file of this size may take; save what is needed of it as npz",
            self.limits.decoded_bytes
        )
    }

    pub fn take_expanded(&mut self, bytes: u64) -> Result<(), String> {
        let left = self.expanded_bytes.checked_sub(bytes);
        self.expanded_bytes = left.ok_or_else(|| {
            format!("a tensor repeats few bytes into {bytes}; save a contiguous copy of it")
        })?;
        Ok(())
    }
}
