//! numpy's archives of arrays (`.npz`: a zip of `.npy` files, format versions 1 to 3), read with a limit on every size and written
//! with fixed time stamps, so that the same arrays give the same bytes.

use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::BodyError;

/// The largest array that is read, bytes: five times SMPL-X's largest.
pub const ARRAY_BYTES_LIMIT: u64 = 512 << 20;
const HEADER_BYTES_LIMIT: usize = 64 << 10;

/// An array in C order (last dimension fastest).
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Its dimensions; none for a scalar.
    pub shape: Vec<usize>,
    /// Its elements; as many as the product of the shape.
    pub values: Vec<T>,
}

/// An npz archive that is being read; errors carry its path and the key.
#[derive(Debug)]
pub struct NpzReader<R> {
    path: PathBuf,
    archive: ZipArchive<R>,
}

impl NpzReader<io::BufReader<std::fs::File>> {
    /// Opens the archive at `path`.
    ///
    /// # Errors
    /// [`BodyError::Open`], [`BodyError::Archive`].
    pub fn open(path: &Path) -> Result<Self, BodyError> {
        let file = std::fs::File::open(path).map_err(|source| BodyError::Open { path: path.to_owned(), source })?;
        Self::new(io::BufReader::new(file), path)
    }
}

impl<R: Read + Seek> NpzReader<R> {
    /// Reads from `reader`; `path` only names it in errors.
    ///
    /// # Errors
    /// [`BodyError::Archive`].
    pub fn new(reader: R, path: &Path) -> Result<Self, BodyError> {
        let archive = ZipArchive::new(reader).map_err(|error| BodyError::Archive { path: path.to_owned(), source: io_error(error) })?;
        Ok(Self { path: path.to_owned(), archive })
    }

    /// The arrays' names, sorted.
    pub fn keys(&self) -> Vec<String> {
        let key = |name: Result<std::borrow::Cow<'_, str>, ZipError>| name.ok()?.strip_suffix(".npy").map(str::to_owned);
        let mut keys: Vec<_> = self.archive.file_names().filter_map(key).collect();
        keys.sort();
        keys
    }

    /// The array `key` of float32 or float64; `None` where there is none. `expected` holds the dimensions that are given, and is named
    /// by `expectation` in the error.
    ///
    /// # Errors
    /// [`BodyError::Unreadable`], [`BodyError::TooLarge`], [`BodyError::ElementType`], [`BodyError::Shape`], [`BodyError::NotFinite`].
    pub fn floats(&mut self, key: &str, expected: &[Option<usize>], expectation: &str) -> Result<Option<Array<f64>>, BodyError> {
        let Some((header, bytes)) = self.entry(key)? else { return Ok(None) };
        let shape = self.checked_shape(key, &header, expected, expectation)?;
        let values: Vec<f64> = match header.element.as_str() {
            "<f8" => elements(&bytes, f64::from_le_bytes),
            ">f8" => elements(&bytes, f64::from_be_bytes),
            "<f4" => elements(&bytes, |b| f64::from(f32::from_le_bytes(b))),
            ">f4" => elements(&bytes, |b| f64::from(f32::from_be_bytes(b))),
            _ => return Err(self.element_type(key, header.element, "float32 or float64 (<f4, <f8)")),
        };
        let values = self.in_c_order(key, values, &shape, header.fortran_order)?;
        if let Some(element) = values.iter().position(|value| !value.is_finite()) {
            return Err(BodyError::NotFinite { path: self.path.clone(), key: key.to_owned(), element, value: values[element] });
        }
        Ok(Some(Array { shape, values }))
    }

    /// The array `key` of integers of any width; `None` where there is none.
    ///
    /// # Errors
    /// [`BodyError::Unreadable`], [`BodyError::TooLarge`], [`BodyError::ElementType`], [`BodyError::Shape`].
    pub fn integers(&mut self, key: &str, expected: &[Option<usize>], expectation: &str) -> Result<Option<Array<i64>>, BodyError> {
        let Some((header, bytes)) = self.entry(key)? else { return Ok(None) };
        let shape = self.checked_shape(key, &header, expected, expectation)?;
        let values: Vec<i64> = match header.element.as_str() {
            "<i8" => elements(&bytes, i64::from_le_bytes),
            "<u8" => elements(&bytes, |b| i64::try_from(u64::from_le_bytes(b)).unwrap_or(i64::MAX)),
            "<i4" => elements(&bytes, |b| i64::from(i32::from_le_bytes(b))),
            "<u4" => elements(&bytes, |b| i64::from(u32::from_le_bytes(b))),
            "<i2" => elements(&bytes, |b| i64::from(i16::from_le_bytes(b))),
            "<u2" => elements(&bytes, |b| i64::from(u16::from_le_bytes(b))),
            _ => return Err(self.element_type(key, header.element, "little-endian integers (<i4, <u4, <i8 …)")),
        };
        Ok(Some(Array { values: self.in_c_order(key, values, &shape, header.fortran_order)?, shape }))
    }

    /// The text in the scalar array `key` (numpy `U` or `S`); `None` where there is none or it is no text.
    ///
    /// # Errors
    /// [`BodyError::Unreadable`], [`BodyError::TooLarge`].
    pub fn text(&mut self, key: &str) -> Result<Option<String>, BodyError> {
        let Some((header, bytes)) = self.entry(key)? else { return Ok(None) };
        if header.shape.iter().any(|&size| size != 1) {
            return Ok(None);
        }
        let text: String = match header.element.get(..2) {
            Some("<U") => elements(&bytes, u32::from_le_bytes).into_iter().filter_map(char::from_u32).collect(),
            Some("|S") => String::from_utf8_lossy(&bytes).into_owned(),
            _ => return Ok(None),
        };
        Ok(Some(text.trim_end_matches('\0').to_owned()))
    }

    /// Header and data bytes of an array, the sizes checked against each other.
    fn entry(&mut self, key: &str) -> Result<Option<(Header, Vec<u8>)>, BodyError> {
        let (path, owned_key) = (self.path.clone(), key.to_owned());
        let unreadable = |source| BodyError::Unreadable { path: path.clone(), key: owned_key.clone(), source };
        let entry = match self.archive.by_name(&format!("{key}.npy")) {
            Ok(entry) => entry,
            Err(ZipError::FileNotFound) => return Ok(None),
            Err(error) => return Err(unreadable(io_error(error))),
        };
        let too_large = |bytes| BodyError::TooLarge { path: path.clone(), key: owned_key.clone(), bytes, limit: ARRAY_BYTES_LIMIT };
        if entry.size() > ARRAY_BYTES_LIMIT {
            return Err(too_large(entry.size()));
        }
        let mut bytes = Vec::new();
        entry.take(ARRAY_BYTES_LIMIT + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > ARRAY_BYTES_LIMIT {
            return Err(too_large(bytes.len() as u64)); // the directory told a smaller size
        }
        let (header, start) = Header::parse(&bytes).map_err(|message| unreadable(invalid(message)))?;
        if let Some(expected) = header.data_bytes()
            && expected != (bytes.len() - start) as u64
        {
            let message =
                format!("{} data bytes, but shape {:?} of {} takes {expected}", bytes.len() - start, header.shape, header.element);
            return Err(unreadable(invalid(message)));
        }
        bytes.drain(..start);
        Ok(Some((header, bytes)))
    }

    fn checked_shape(&self, key: &str, header: &Header, expected: &[Option<usize>], expectation: &str) -> Result<Vec<usize>, BodyError> {
        let suits = header.shape.len() == expected.len()
            && header.shape.iter().zip(expected).all(|(&found, expected)| expected.is_none_or(|expected| found == expected as u64));
        if !suits {
            return Err(BodyError::Shape {
                path: self.path.clone(),
                key: key.to_owned(),
                found: header.shape.clone(),
                expected: expectation.to_owned(),
            });
        }
        Ok(header.shape.iter().map(|&size| size as usize).collect())
    }

    fn element_type(&self, key: &str, found: String, expected: &'static str) -> BodyError {
        BodyError::ElementType { path: self.path.clone(), key: key.to_owned(), found, expected }
    }

    fn in_c_order<T: Copy>(&self, key: &str, values: Vec<T>, shape: &[usize], fortran_order: bool) -> Result<Vec<T>, BodyError> {
        if values.len() != shape.iter().product::<usize>() {
            let source = invalid("the element count differs from the shape");
            return Err(BodyError::Unreadable { path: self.path.clone(), key: key.to_owned(), source });
        }
        Ok(if fortran_order && shape.len() > 1 { transposed(&values, shape) } else { values })
    }
}

/// Fortran order (first dimension fastest) into C order.
fn transposed<T: Copy>(values: &[T], shape: &[usize]) -> Vec<T> {
    let mut index = vec![0; shape.len()];
    let mut ordered = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        let source = index.iter().zip(shape).rev().fold(0, |flat, (i, size)| flat * size + i);
        ordered.push(values[source]);
        for (i, size) in index.iter_mut().zip(shape).rev() {
            *i += 1;
            if *i < *size {
                break;
            }
            *i = 0;
        }
    }
    ordered
}

fn elements<const N: usize, T>(bytes: &[u8], decode: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|chunk| decode(*chunk)).collect()
}

/// The header of a `.npy` file: numpy's element description, the order, and the shape.
struct Header {
    element: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

impl Header {
    /// The header at the start of `bytes` and where the data begin.
    fn parse(bytes: &[u8]) -> Result<(Self, usize), String> {
        if bytes.len() < 12 || &bytes[..6] != b"\x93NUMPY" {
            return Err("not a numpy array".to_owned());
        }
        let (length, start) = match bytes[6] {
            1 => (usize::from(u16::from_le_bytes([bytes[8], bytes[9]])), 10),
            2 | 3 => (u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize, 12),
            version => return Err(format!("numpy format version {version} is unknown")),
        };
        if length > HEADER_BYTES_LIMIT || start + length > bytes.len() {
            return Err(format!("the header is cut short or too long ({length} bytes)"));
        }
        let text = String::from_utf8_lossy(&bytes[start..start + length]);
        let value = |key: &str| text.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
        let descr = value("descr").ok_or("the header has no 'descr'")?;
        let element = match descr.strip_prefix('\'').and_then(|rest| rest.split_once('\'')) {
            Some((element, _)) => element.to_owned(),
            None => "a record".to_owned(),
        };
        let fortran_order = value("fortran_order").ok_or("the header has no 'fortran_order'")?.starts_with("True");
        let shape = value("shape").and_then(|rest| rest.strip_prefix('(')).and_then(|rest| rest.split_once(')'));
        let (shape, _) = shape.ok_or("the header has no 'shape'")?;
        let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
        let shape =
            sizes.map(|size| size.parse::<u64>().map_err(|_| format!("shape ({shape}) is not of sizes"))).collect::<Result<_, _>>()?;
        Ok((Self { element, fortran_order, shape }, start + length))
    }

    /// Bytes that the data take; `None` for elements without a fixed size, `u64::MAX` where no memory would do.
    fn data_bytes(&self) -> Option<u64> {
        let (kind, size) = (self.element.as_bytes().get(1)?, self.element.get(2..)?.parse::<u64>().ok()?);
        let size = if *kind == b'U' { size.checked_mul(4) } else { Some(size) };
        Some(self.shape.iter().try_fold(size?, |product, &next| product.checked_mul(next)).unwrap_or(u64::MAX))
    }
}

/// An npz archive that is being written.
pub struct NpzWriter<W: Write + Seek> {
    archive: ZipWriter<W>,
}

impl<W: Write + Seek> NpzWriter<W> {
    /// Starts an archive.
    pub fn new(writer: W) -> Self {
        Self { archive: ZipWriter::new(writer) }
    }

    /// Adds an array of float64, or of float32 where that holds every value exactly.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn floats(&mut self, key: &str, shape: &[usize], values: &[f64]) -> io::Result<()> {
        if values.iter().all(|&value| f64::from(value as f32) == value) {
            self.array(key, "<f4", shape, values.iter().flat_map(|&value| (value as f32).to_le_bytes()))
        } else {
            self.array(key, "<f8", shape, values.iter().flat_map(|value| value.to_le_bytes()))
        }
    }

    /// Adds an array of uint32.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn integers(&mut self, key: &str, shape: &[usize], values: &[u32]) -> io::Result<()> {
        self.array(key, "<u4", shape, values.iter().flat_map(|value| value.to_le_bytes()))
    }

    /// Adds a scalar array of text.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn text(&mut self, key: &str, text: &str) -> io::Result<()> {
        let element = format!("<U{}", text.chars().count().max(1));
        let padding = if text.is_empty() { "\0" } else { "" };
        self.array(key, &element, &[], text.chars().chain(padding.chars()).flat_map(|c| u32::from(c).to_le_bytes()))
    }

    /// Ends the archive.
    ///
    /// # Errors
    /// What `writer` says.
    pub fn finish(self) -> io::Result<W> {
        self.archive.finish().map_err(io_error)
    }

    fn array(&mut self, key: &str, element: &str, shape: &[usize], bytes: impl Iterator<Item = u8>) -> io::Result<()> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).last_modified_time(DateTime::default());
        self.archive.start_file(format!("{key}.npy"), options).map_err(io_error)?;
        let sizes: String = shape.iter().map(|size| format!("{size}, ")).collect();
        let sizes = if shape.len() > 1 { sizes.trim_end_matches(", ") } else { sizes.trim_end() };
        let mut header = format!("{{'descr': '{element}', 'fortran_order': False, 'shape': ({sizes}), }}");
        let padding = 63 - (10 + header.len()) % 64; // the data begin at a multiple of 64
        header.extend(std::iter::repeat_n(' ', padding));
        header.push('\n');
        self.archive.write_all(b"\x93NUMPY\x01\x00")?;
        self.archive.write_all(&(header.len() as u16).to_le_bytes())?;
        self.archive.write_all(header.as_bytes())?;
        self.archive.write_all(&bytes.collect::<Vec<_>>())
    }
}

fn io_error(error: ZipError) -> io::Error {
    match error {
        ZipError::Io(error) => error,
        other => invalid(other.to_string()),
    }
}

fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}
