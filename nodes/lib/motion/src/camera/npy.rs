//! numpy's `.npy` arrays of float32 and float64.

/// An array's header.
pub(crate) struct NpyHeader<'a> {
    /// numpy's element description: `<f4`.
    pub element: &'a str,
    /// Its dimensions.
    pub shape: Vec<usize>,
    /// Whether the last dimension is fastest.
    pub c_order: bool,
    /// Where the elements begin, bytes.
    pub start: usize,
}

impl<'a> NpyHeader<'a> {
    /// The header at the start of a file; what is wrong with it otherwise.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, &'static str> {
        if bytes.len() < 12 || !bytes.starts_with(b"\x93NUMPY") {
            return Err("not a numpy array");
        }
        let (length, start): (usize, usize) = match bytes[6] {
            1 => (usize::from(u16::from_le_bytes([bytes[8], bytes[9]])), 10),
            2 | 3 => (u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize, 12),
            _ => return Err("numpy format version is none of 1 to 3"),
        };
        let header = bytes.get(start..start.saturating_add(length)).ok_or("the numpy header is cut short")?;
        let header = std::str::from_utf8(header).map_err(|_| "the numpy header is no text")?;
        let element = between(header, "'descr':", '\'', '\'').ok_or("the numpy header has no descr")?;
        let shape = between(header, "'shape':", '(', ')').ok_or("the numpy header has no shape")?;
        let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
        let shape = sizes.map(|size| size.parse().map_err(|_| "the numpy shape is not of sizes")).collect::<Result<_, _>>()?;
        let c_order = header.split_once("'fortran_order':").is_some_and(|(_, rest)| rest.trim_start().starts_with("False"));
        Ok(Self { element, shape, c_order, start: start + length })
    }

    /// The elements in C order, NaN included; what is wrong with them otherwise. They take no more
    /// memory than four times the file.
    pub fn floats(&self, bytes: &[u8]) -> Result<Vec<f64>, String> {
        let content = bytes.get(self.start..).unwrap_or_default();
        let size = match self.element {
            "<f4" => 4,
            "<f8" => 8,
            other => return Err(format!("expected float32 or float64 (<f4, <f8), found {other}")),
        };
        let expected = self.shape.iter().try_fold(size, |product: usize, next| product.checked_mul(*next));
        if expected != Some(content.len()) {
            return Err(format!("shape {:?} of {} does not fit the {} bytes of data", self.shape, self.element, content.len()));
        }
        let values: Vec<f64> = if size == 4 {
            content.as_chunks::<4>().0.iter().map(|chunk| f64::from(f32::from_le_bytes(*chunk))).collect()
        } else {
            content.as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect()
        };
        match self.shape[..] {
            [rows, columns] if !self.c_order => {
                Ok((0..rows * columns).map(|index| values[index % columns * rows + index / columns]).collect())
            }
            [_] | [] => Ok(values),
            _ if self.c_order => Ok(values),
            _ => Err("the array is in Fortran order; save numpy.ascontiguousarray of it".to_owned()),
        }
    }
}

fn between<'a>(text: &'a str, key: &str, open: char, close: char) -> Option<&'a str> {
    let (_, rest) = text.split_once(key)?;
    Some(rest.trim_start().strip_prefix(open)?.split_once(close)?.0)
}
