//! C3D: marker positions of an optical system, as the format's manual (c3d.org) describes it.
//!
//! A header block of 512 bytes points at the parameters, these at the frames. A frame is four
//! numbers a point (x, y, z and a word whose sign says whether the point was seen) and then the
//! analog samples, which are passed over. Numbers are 32-bit floats where the scale is negative,
//! else 16-bit integers to be multiplied by it; their bytes stand in the order of the processor
//! that wrote them.

mod numbers;
mod parameters;

use nalgebra::Point3;

use crate::markers::{MarkerClip, checked_rate};
use crate::{MAX_VALUE, MotionError};
use numbers::{Bytes, Processor};
use parameters::Parameters;

const BLOCK: usize = 512;
/// The second byte of every C3D file.
const KEY: u8 = 0x50;
/// The frame counts of 16 bits end here: longer recordings say this, and their data go on.
const MANY_FRAMES: usize = 65_535;

/// Whether the bytes begin like a C3D file: the key, and a known processor in the parameter section
/// (nearly always the second block).
pub(crate) fn is_c3d(bytes: &[u8]) -> bool {
    has_key(bytes)
        && bytes
            .get((usize::from(bytes[0]) - 1) * BLOCK + 3)
            .is_some_and(|&code| Processor::from_code(code).is_some())
}

fn has_key(bytes: &[u8]) -> bool {
    bytes.len() >= BLOCK && bytes[1] == KEY && bytes[0] >= 2
}

/// Where the numbers of a frame are.
struct Layout {
    points: usize,
    /// Analog samples in a frame.
    analog: usize,
    frames: usize,
    data_start: usize,
    /// `None` for floats.
    integer_scale: Option<f64>,
}

/// Parses the bytes of a C3D file; `name` stands in the errors. No file is touched.
///
/// A point that was not seen (negative fourth word), is not finite or stands exactly at the origin
/// is `None`. Files of Intel, DEC and MIPS processors are read. `POINT:UNITS` may be mm, cm, m, in
/// or ft; millimetres where it is empty.
///
/// # Errors
/// [`MotionError::Bytes`] with the place, [`MotionError::Setting`] for an absurd rate. Memory stays
/// proportional to the file: a point takes at least eight of its bytes, whatever counts it
/// declares.
pub fn parse_c3d(bytes: &[u8], name: &str) -> Result<MarkerClip, MotionError> {
    let wrong = |offset: usize, expected: &str, found: String| MotionError::Bytes {
        name: name.to_owned(),
        offset,
        expected: expected.to_owned(),
        found,
    };
    if !has_key(bytes) {
        let found = format!(
            "{} bytes that begin with {:02x?}",
            bytes.len(),
            &bytes[..bytes.len().min(2)]
        );
        return Err(wrong(
            0,
            "a C3D header of 512 bytes (second byte 0x50)",
            found,
        ));
    }
    let section = (usize::from(bytes[0]) - 1) * BLOCK;
    let Some(&[_, _, _, processor]) = bytes.get(section..section + 4) else {
        return Err(wrong(
            section,
            "the parameter section that byte 0 points at",
            "the end of the file".to_owned(),
        ));
    };
    let Some(processor) = Processor::from_code(processor) else {
        return Err(wrong(
            section + 3,
            "processor 84 (Intel), 85 (DEC) or 86 (MIPS)",
            processor.to_string(),
        ));
    };
    let file = Bytes { bytes, processor };
    let parameters = Parameters::read(file, section + 4);
    let layout = layout(file, &parameters, name)?;
    let header_rate = file.float(20).map_or(0.0, f64::from);
    let rate_hz = checked_rate(
        name,
        parameters
            .number("POINT", "RATE")
            .filter(|rate| *rate > 0.0)
            .unwrap_or(header_rate),
    )?;
    let unit = parameters
        .strings("POINT", "UNITS")
        .into_iter()
        .next()
        .unwrap_or_default();
    let unit_scale_m = if unit.is_empty() {
        Some(0.001)
    } else {
        crate::markers::unit_scale(&unit)
    };
    let Some(unit_scale_m) = unit_scale_m else {
        return Err(wrong(
            section,
            "POINT:UNITS of mm, cm, m, in or ft",
            format!("\"{}\"", crate::bvh::shortened(&unit)),
        ));
    };
    Ok(MarkerClip {
        name: name.to_owned(),
        rate_hz,
        unit_scale_m,
        labels: labels(&parameters, layout.points),
        frames: frames(file, &layout, unit_scale_m),
    })
}

fn layout(file: Bytes<'_>, parameters: &Parameters<'_>, name: &str) -> Result<Layout, MotionError> {
    let wrong = |offset: usize, expected: &str, found: String| MotionError::Bytes {
        name: name.to_owned(),
        offset,
        expected: expected.to_owned(),
        found,
    };
    // Sixteen-bit numbers of the header, which is there in full.
    let word = |index: usize| usize::from(file.unsigned(2 * (index - 1)).unwrap_or(0));
    let positive = |parameter: &str| {
        parameters
            .number("POINT", parameter)
            .filter(|number| *number >= 1.0)
            .map(|number| number as usize)
    };
    let points = positive("USED").unwrap_or(word(2));
    if points == 0 {
        return Err(wrong(
            2,
            "points",
            "none: the file has analog channels at most".to_owned(),
        ));
    }
    let scale = parameters
        .number("POINT", "SCALE")
        .filter(|scale| *scale != 0.0)
        .or(file.float(12).map(f64::from))
        .unwrap_or(0.0);
    if scale == 0.0 || !scale.is_finite() {
        return Err(wrong(
            12,
            "a scale that is finite and not 0",
            scale.to_string(),
        ));
    }
    let data_start = (positive("DATA_START").unwrap_or(word(9)))
        .saturating_sub(1)
        .saturating_mul(BLOCK);
    let integer_scale = (scale > 0.0).then_some(scale);
    let analog = word(3);
    let frame_bytes = points
        .saturating_mul(4)
        .saturating_add(analog)
        .saturating_mul(if integer_scale.is_some() { 2 } else { 4 });
    let available = file.bytes.len().saturating_sub(data_start) / frame_bytes;
    let of_header = (word(5) + 1).saturating_sub(word(4));
    let declared = parameters
        .trial_frames()
        .or(positive("LONG_FRAMES"))
        .or(positive("FRAMES"))
        .unwrap_or(of_header);
    let frames = if declared >= MANY_FRAMES {
        declared.min(available)
    } else {
        declared
    };
    if data_start < BLOCK || frames == 0 || frames > available {
        let expected = format!("{declared} frames (at least 1) of {frame_bytes} bytes");
        return Err(wrong(
            data_start,
            &expected,
            format!("{available} frames up to the end of the file"),
        ));
    }
    Ok(Layout {
        points,
        analog,
        frames,
        data_start,
        integer_scale,
    })
}

/// One label a point; points without one are called `*1`, `*2`, …
fn labels(parameters: &Parameters<'_>, points: usize) -> Vec<String> {
    let mut labels = parameters.strings("POINT", "LABELS");
    // Counts of 8 bits: what is beyond 255 labels stands in LABELS2 and so on.
    for part in 2..=(points / 255 + 1) {
        labels.extend(parameters.strings("POINT", &format!("LABELS{part}")));
    }
    labels.resize(points, String::new());
    for (index, label) in labels
        .iter_mut()
        .enumerate()
        .filter(|(_, label)| label.is_empty())
    {
        *label = format!("*{}", index + 1);
    }
    labels
}

fn frames(file: Bytes<'_>, layout: &Layout, unit_scale_m: f64) -> Vec<Vec<Option<Point3<f64>>>> {
    let width = if layout.integer_scale.is_some() { 2 } else { 4 };
    let frame_bytes = (4 * layout.points + layout.analog) * width;
    let point = |offset: usize| -> Option<Point3<f64>> {
        let number = |index: usize| match layout.integer_scale {
            Some(scale) => file
                .integer(offset + 2 * index)
                .map(|number| f64::from(number) * scale),
            None => file.float(offset + 4 * index).map(f64::from),
        };
        let seen = match layout.integer_scale {
            Some(_) => file.integer(offset + 6)? >= 0,
            None => file.float(offset + 12)? >= 0.0,
        };
        let place = Point3::new(number(0)?, number(1)?, number(2)?);
        let usual = place.coords.amax() < MAX_VALUE
            && place.coords.iter().all(|value| value.is_finite())
            && place != Point3::origin();
        (seen && usual).then(|| place * unit_scale_m)
    };
    let frame = |index: usize| {
        let start = layout.data_start + index * frame_bytes;
        (0..layout.points)
            .map(|number| point(start + 4 * width * number))
            .collect()
    };
    (0..layout.frames).map(frame).collect()
}
