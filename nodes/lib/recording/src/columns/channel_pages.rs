//! Compressed pages of the channels. `parquet` makes two contexts of zstd anew for each column of each
//! group, which for clips of some seconds is more work than to compress them; here one lasts for a file.
//! The bytes are the same.

use std::io::Write;
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::{Compression, ZstdLevel};
use parquet::column::page::{CompressedPage, Page, PageWriteSpec, PageWriter};
use parquet::column::writer::{get_column_writer, get_typed_column_writer};
use parquet::data_type::FloatType;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedPageWriter, SerializedRowGroupWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;
use zstd::bulk::Compressor;

/// How hard it is tried.
const LEVEL: i32 = 1;

/// Writes columns of channels.
pub(super) struct ChannelPages {
    /// Those of the file, but that nothing is compressed.
    properties: Arc<WriterProperties>,
    compressor: Compressor<'static>,
}

impl ChannelPages {
    pub fn new(properties: Arc<WriterProperties>) -> Result<Self> {
        Ok(Self {
            properties,
            compressor: Compressor::new(LEVEL)?,
        })
    }

    /// Writes the group's next column.
    pub fn write(
        &mut self,
        rows: &mut SerializedRowGroupWriter<'_, &mut (dyn Write + Send)>,
        column: ColumnDescPtr,
        values: &[f32],
    ) -> Result<()> {
        let mut bytes = TrackedWrite::new(Vec::new());
        let pages = Compressing {
            compressor: &mut self.compressor,
            pages: SerializedPageWriter::new(&mut bytes),
        };
        let writer = get_column_writer(column, self.properties.clone(), Box::new(pages));
        let mut writer = get_typed_column_writer::<FloatType>(writer);
        writer.write_batch(values, None, None)?;
        let mut closed = writer.close()?;
        let compression = Compression::ZSTD(ZstdLevel::try_new(LEVEL)?);
        let metadata = closed.metadata.into_builder();
        closed.metadata = metadata.set_compression(compression).build()?;
        rows.append_column(&Bytes::from(bytes.into_inner()?), closed)
    }
}

/// Compresses pages on their way.
struct Compressing<'a> {
    compressor: &'a mut Compressor<'static>,
    pages: SerializedPageWriter<'a, Vec<u8>>,
}

impl PageWriter for Compressing<'_> {
    fn write_page(&mut self, page: CompressedPage) -> Result<PageWriteSpec> {
        let Page::DataPage {
            buf,
            num_values,
            encoding,
            def_level_encoding,
            rep_level_encoding,
            statistics,
        } = page.compressed_page()
        else {
            return Err(ParquetError::General(
                "a channel has data pages alone".to_owned(),
            ));
        };
        let compressed = Page::DataPage {
            buf: self.compressor.compress(buf)?.into(),
            num_values: *num_values,
            encoding: *encoding,
            def_level_encoding: *def_level_encoding,
            rep_level_encoding: *rep_level_encoding,
            statistics: statistics.clone(),
        };
        self.pages
            .write_page(CompressedPage::new(compressed, buf.len()))
    }

    fn close(&mut self) -> Result<()> {
        self.pages.close()
    }
}
