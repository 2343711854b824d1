//! Depth maps: Robust CVD's raw files, plain float32, numpy arrays, and PNG in millimetres.

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Kind, Limits, Value};

use crate::error::VideoError;

/// More pixels than this are no depth map.
pub const MAX_DEPTH_PIXELS: usize = 64 << 20;

/// What the numbers of a map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthEncoding {
    /// Distance along the optical axis.
    Depth,
    /// Its inverse; what Robust CVD's own `depth/frame_NNNNNN.raw` hold.
    Disparity,
}

/// Distances along the optical axis, row by row from the top left, in metres or in the
/// reconstruction's own unit. 0 where nothing is known.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    width: usize,
    height: usize,
    depths: Vec<f32>,
}

impl DepthMap {
    /// From `width` times `height` depths; what is not finite and positive becomes 0 (unknown).
    /// `None` where the count differs or is 0.
    pub fn new(width: usize, height: usize, mut depths: Vec<f32>) -> Option<Self> {
        if width == 0 || height == 0 || width.checked_mul(height) != Some(depths.len()) {
            return None;
        }
        depths
            .iter_mut()
            .filter(|depth| !(depth.is_finite() && **depth > 0.0))
            .for_each(|depth| *depth = 0.0);
        Some(Self {
            width,
            height,
            depths,
        })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The depth of a pixel; `None` outside and where unknown.
    pub fn at(&self, column: usize, row: usize) -> Option<f64> {
        let depth = *self
            .depths
            .get(row * self.width + column)
            .filter(|_| column < self.width)?;
        (depth > 0.0).then_some(f64::from(depth))
    }

    /// Depths, row by row; 0 where unknown.
    pub fn depths(&self) -> &[f32] {
        &self.depths
    }
}

const RAW_HEADER: usize = 20;
/// OpenCV's number of float32 with one channel.
const CV_32FC1: i32 = 5;

/// Robust CVD's (and Consistent Video Depth's) raw image: height, width, OpenCV's type (5: float32,
/// one channel; int32 each), bytes per pixel (uint64), all little-endian and without padding, 20
/// bytes together; then float32, row by row.
///
/// # Errors
/// [`VideoError::Depth`] with the byte.
pub fn parse_raw_depth(
    bytes: &[u8],
    encoding: DepthEncoding,
    name: &str,
) -> Result<DepthMap, VideoError> {
    let Some((header, content)) = bytes.split_first_chunk::<RAW_HEADER>() else {
        return Err(depth_error(
            name,
            bytes.len(),
            format!("the header of {RAW_HEADER} bytes is cut short"),
        ));
    };
    let int = |at: usize| {
        i32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
    };
    let (height, width, kind) = (int(0), int(4), int(8));
    let pixel_bytes = header[12..]
        .iter()
        .rev()
        .fold(0_u64, |value, byte| (value << 8) | u64::from(*byte));
    if kind != CV_32FC1 || pixel_bytes != 4 {
        let problem = format!(
            "expected OpenCV type {CV_32FC1} (float32, one channel) of 4 bytes, found type {kind} of {pixel_bytes} bytes"
        );
        return Err(depth_error(name, 8, problem));
    }
    match (usize::try_from(width), usize::try_from(height)) {
        (Ok(width), Ok(height)) => floats(content, RAW_HEADER, (width, height), encoding, name),
        _ => Err(depth_error(name, 0, format!("{width} x {height} pixels"))),
    }
}

/// Plain little-endian float32, row by row.
///
/// # Errors
/// [`VideoError::Depth`] where the size does not fit.
pub fn parse_plain_depth(
    bytes: &[u8],
    width: usize,
    height: usize,
    encoding: DepthEncoding,
    name: &str,
) -> Result<DepthMap, VideoError> {
    floats(bytes, 0, (width, height), encoding, name)
}

fn floats(
    bytes: &[u8],
    offset: usize,
    (width, height): (usize, usize),
    encoding: DepthEncoding,
    name: &str,
) -> Result<DepthMap, VideoError> {
    let pixels = checked_pixels(width, height, name)?;
    if bytes.len() != 4 * pixels {
        let problem = format!(
            "{width} x {height} pixels take {} bytes, found {}",
            4 * pixels,
            bytes.len()
        );
        return Err(depth_error(name, offset, problem));
    }
    let values = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|chunk| f32::from_le_bytes(*chunk));
    map(
        width,
        height,
        values.map(|value| decoded(value, encoding)).collect(),
        name,
    )
}

/// A numpy array (.npy) of shape (height, width), float32 or float64. Infinities and NaN are
/// unknown depths.
///
/// # Errors
/// [`VideoError::Arrays`], [`VideoError::Depth`] for too many pixels and for elements that are no
/// floats.
pub fn parse_npy_depth(
    bytes: &[u8],
    encoding: DepthEncoding,
    name: &str,
) -> Result<DepthMap, VideoError> {
    let limits = Limits {
        decoded_bytes: bytes.len() as u64,
        opcodes: 0,
        depth: 0,
    };
    let array = Container::new(Cursor::new(bytes), Path::new(name), limits)?.root()?;
    if let Value::Array(array) = array.value()
        && array.dtype().kind != Kind::Float
    {
        // Whole numbers are mostly millimetres, but not all who write them agree.
        return Err(depth_error(
            name,
            0,
            format!(
                "expected float32 or float64 (<f4, <f8), found {}",
                array.dtype()
            ),
        ));
    }
    if let [height, width] = array.shape()?[..] {
        checked_pixels(width, height, name)?;
    }
    let array = array.floats_with_nan(&[None, None], "(height, width)")?;
    let values = array
        .values
        .into_iter()
        .map(|value| decoded(value as f32, encoding))
        .collect();
    map(array.shape[1], array.shape[0], values, name)
}

/// A grey PNG of 16 bits, in millimetres; 0 is unknown. Depths come out in metres.
///
/// # Errors
/// [`VideoError::Png`].
pub fn parse_png_depth(bytes: &[u8], name: &str) -> Result<DepthMap, VideoError> {
    let problem = |problem: String| VideoError::Png {
        name: name.to_owned(),
        problem,
    };
    let mut decoder = png::Decoder::new_with_limits(
        Cursor::new(bytes),
        png::Limits {
            bytes: 3 * MAX_DEPTH_PIXELS,
        },
    );
    let info = decoder
        .read_header_info()
        .map_err(|error| problem(error.to_string()))?;
    let (width, height) = (info.width as usize, info.height as usize);
    if (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err(problem(format!(
            "found {:?} of {:?} bits",
            info.color_type, info.bit_depth
        )));
    }
    let pixels = checked_pixels(width, height, name)?;
    // Deflate shrinks to a thousandth at most: a small file that declares many pixels is no map.
    if pixels / 2048 > bytes.len() {
        return Err(problem(format!(
            "{} bytes cannot hold {width} x {height} pixels",
            bytes.len()
        )));
    }
    let mut reader = decoder
        .read_info()
        .map_err(|error| problem(error.to_string()))?;
    let mut content = vec![0; 2 * pixels];
    reader
        .next_frame(&mut content)
        .map_err(|error| problem(error.to_string()))?;
    let depths = content
        .as_chunks::<2>()
        .0
        .iter()
        .map(|&pair| f32::from(u16::from_be_bytes(pair)) * 1e-3)
        .collect();
    map(width, height, depths, name)
}

/// A depth map of any of the forms with a header, told by its content.
///
/// # Errors
/// [`VideoError::Depth`], [`VideoError::Arrays`], [`VideoError::Png`].
pub fn parse_depth(
    bytes: &[u8],
    encoding: DepthEncoding,
    name: &str,
) -> Result<DepthMap, VideoError> {
    match bytes {
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => parse_npy_depth(bytes, encoding, name),
        [0x89, b'P', b'N', b'G', ..] => parse_png_depth(bytes, name),
        _ => parse_raw_depth(bytes, encoding, name),
    }
}

fn decoded(value: f32, encoding: DepthEncoding) -> f32 {
    match encoding {
        DepthEncoding::Depth => value,
        DepthEncoding::Disparity if value > 0.0 => value.recip(),
        DepthEncoding::Disparity => 0.0,
    }
}

fn checked_pixels(width: usize, height: usize, name: &str) -> Result<usize, VideoError> {
    width
        .checked_mul(height)
        .filter(|pixels| (1..=MAX_DEPTH_PIXELS).contains(pixels))
        .ok_or_else(|| {
            depth_error(
                name,
                0,
                format!("{width} x {height} pixels, expected 1 to {MAX_DEPTH_PIXELS}"),
            )
        })
}

fn map(width: usize, height: usize, depths: Vec<f32>, name: &str) -> Result<DepthMap, VideoError> {
    DepthMap::new(width, height, depths).ok_or_else(|| depth_error(name, 0, "no pixels".to_owned()))
}

fn depth_error(name: &str, offset: usize, problem: String) -> VideoError {
    VideoError::Depth {
        name: name.to_owned(),
        offset,
        problem,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
#[path = "depth_map_tests.rs"]
mod tests;
