//! Which format a file has.

use std::io::{self, Read, Seek, SeekFrom};

use crate::pickle::LEGACY_START;
use crate::{mat, npy};

/// The first bytes of HDF5.
const HDF5_START: &[u8] = b"\x89HDF\r\n\x1a\n";

/// How a file of arrays is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A single numpy array, possibly of pickled objects.
    Npy,
    /// A zip archive: `.npz`, or torch's `.pt` since version 1.6.
    Zip,
    /// A pickle, joblib's uncompressed files among them.
    Pickle,
    /// torch's `.pt` before version 1.6.
    TorchLegacy,
    /// A pickle within a zlib stream, as joblib compresses.
    Zlib,
    /// A pickle within a gzip stream.
    Gzip,
    /// MATLAB's `.mat` of versions 5 to 7.
    Mat,
    /// HDF5, as MATLAB 7.3 writes it too: told, but not read.
    Hdf5,
}

impl Format {
    /// The format by the first and the last bytes of a file; `None` for any other. Leaves `reader` at
    /// its start.
    ///
    /// # Errors
    /// What `reader` says.
    pub fn detect(reader: &mut (impl Read + Seek)) -> io::Result<Option<Self>> {
        let start = first_bytes(reader)?;
        let mut last = [0];
        if reader.seek(SeekFrom::End(0))? > 0 {
            reader.seek(SeekFrom::End(-1))?;
            reader.read_exact(&mut last)?;
        }
        reader.rewind()?;
        Ok(Self::from_ends(&start, last[0]))
    }

    fn from_ends(start: &[u8], last: u8) -> Option<Self> {
        match *start {
            _ if start.starts_with(npy::MAGIC) => Some(Self::Npy),
            _ if start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06") => {
                Some(Self::Zip)
            }
            _ if start.starts_with(mat::START) => Some(Self::Mat),
            _ if start.starts_with(HDF5_START) || start.starts_with(b"MATLAB 7.") => {
                Some(Self::Hdf5)
            }
            _ if start.starts_with(LEGACY_START) => Some(Self::TorchLegacy),
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            // zlib's two header bytes are a multiple of 31.
            [0x78, flags, ..] if (0x78_00 + u32::from(flags)) % 31 == 0 => Some(Self::Zlib),
            [0x80, 2..=5, ..] => Some(Self::Pickle),
            // Protocols 0 and 1 begin with an object and end with the opcode that stops.
            [
                b'(' | b'}' | b']' | b')' | b'c' | b'V' | b'X' | b'S' | b'U' | b'T' | b'N' | b'I'
                | b'J' | b'K' | b'M' | b'F' | b'G' | b'L',
                ..,
            ] if last == b'.' => Some(Self::Pickle),
            _ => None,
        }
    }
}

/// Up to 16 bytes from the start of a file.
pub(crate) fn first_bytes(reader: &mut (impl Read + Seek)) -> io::Result<Vec<u8>> {
    reader.rewind()?;
    let mut start = Vec::new();
    reader.by_ref().take(16).read_to_end(&mut start)?;
    Ok(start)
}
