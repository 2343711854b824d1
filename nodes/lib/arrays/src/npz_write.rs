//! numpy archives, written with fixed time stamps, so that the same arrays give the same bytes.

use std::io::{self, Seek, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::npz::io_error;

/// An npz archive that is being written.
pub struct NpzWriter<W: Write + Seek> {
    archive: ZipWriter<W>,
}

impl<W: Write + Seek> NpzWriter<W> {
    /// Starts an archive at the writer's position.
    pub fn new(writer: W) -> Self {
        Self {
            archive: ZipWriter::new(writer),
        }
    }

    /// Adds an array of float64, or of float32 where that holds every value exactly.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn floats(&mut self, key: &str, shape: &[usize], values: &[f64]) -> io::Result<()> {
        if values.iter().all(|&value| f64::from(value as f32) == value) {
            self.array(
                key,
                "<f4",
                shape,
                values
                    .iter()
                    .flat_map(|&value| (value as f32).to_le_bytes()),
            )
        } else {
            self.array(
                key,
                "<f8",
                shape,
                values.iter().flat_map(|value| value.to_le_bytes()),
            )
        }
    }

    /// Adds an array of uint32.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn integers(&mut self, key: &str, shape: &[usize], values: &[u32]) -> io::Result<()> {
        self.array(
            key,
            "<u4",
            shape,
            values.iter().flat_map(|value| value.to_le_bytes()),
        )
    }

    /// Adds a scalar array of text.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn text(&mut self, key: &str, text: &str) -> io::Result<()> {
        let element = format!("<U{}", text.chars().count().max(1));
        let padding = if text.is_empty() { "\0" } else { "" };
        self.array(
            key,
            &element,
            &[],
            text.chars()
                .chain(padding.chars())
                .flat_map(|c| u32::from(c).to_le_bytes()),
        )
    }

    /// Writes the archive's directory and gives the writer back.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn finish(self) -> io::Result<W> {
        self.archive.finish().map_err(io_error)
    }

    fn array(
        &mut self,
        key: &str,
        element: &str,
        shape: &[usize],
        bytes: impl Iterator<Item = u8>,
    ) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(DateTime::default());
        self.archive
            .start_file(format!("{key}.npy"), options)
            .map_err(io_error)?;
        let sizes: String = shape.iter().map(|size| format!("{size}, ")).collect();
        let sizes = if shape.len() > 1 {
            sizes.trim_end_matches(", ")
        } else {
            sizes.trim_end()
        };
        let mut header =
            format!("{{'descr': '{element}', 'fortran_order': False, 'shape': ({sizes}), }}");
        let padding = 63 - (10 + header.len()) % 64; // the data begin at a multiple of 64
        header.extend(std::iter::repeat_n(' ', padding));
        header.push('\n');
        self.archive.write_all(b"\x93NUMPY\x01\x00")?;
        self.archive
            .write_all(&(header.len() as u16).to_le_bytes())?;
        self.archive.write_all(header.as_bytes())?;
        self.archive.write_all(&bytes.collect::<Vec<_>>())
    }
}
