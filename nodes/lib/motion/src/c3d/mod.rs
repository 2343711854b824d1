//! C3D: marker positions of an optical system, as the format's manual (c3d.org) describes it.
//!
//! A header block of 512 bytes points at the parameters, these at the frames. A frame is four
//! numbers a point (x, y, z and a word whose sign says whether the point was seen) and then the
//! analog samples, which are passed over. Numbers are 32-bit floats where the scale is negative,
//! else 16-bit integers to be multiplied by it; their bytes stand in the order of the processor
//! that wrote them.
//!
//! The crate c3dio (0.8.0, the newest) is not used: it panics on damaged files; a first byte of 0,
//! from which its parser subtracts 1 unchecked, is enough.

mod layout;
mod numbers;
mod parameters;

use nalgebra::Point3;

use crate::MotionError;
use crate::markers::{MarkerClip, checked_rate, unit_scale};
use crate::text::{MAX_VALUE, shortened};
use layout::{BLOCK, Layout, wrong};
use numbers::{Bytes, Processor};
use parameters::Parameters;

/// The second byte of every C3D file.
const KEY: u8 = 0x50;

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
    let (file, section) = parameter_section(bytes, name)?;
    let parameters = Parameters::read(file, section + 4);
    let layout = Layout::read(file, &parameters, name)?;
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
        unit_scale(&unit)
    };
    let Some(unit_scale_m) = unit_scale_m else {
        return Err(wrong(
            name,
            section,
            "POINT:UNITS of mm, cm, m, in or ft",
            format!("\"{}\"", shortened(&unit)),
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

/// The file with its processor, and the byte at which the parameter section begins.
fn parameter_section<'a>(bytes: &'a [u8], name: &str) -> Result<(Bytes<'a>, usize), MotionError> {
    if !has_key(bytes) {
        let found = format!(
            "{} bytes that begin with {:02x?}",
            bytes.len(),
            &bytes[..bytes.len().min(2)]
        );
        let expected = "a C3D header of 512 bytes (second byte 0x50)";
        return Err(wrong(name, 0, expected, found));
    }
    let section = (usize::from(bytes[0]) - 1) * BLOCK;
    let Some(&[_, _, _, processor]) = bytes.get(section..section + 4) else {
        let expected = "the parameter section that byte 0 points at";
        return Err(wrong(
            name,
            section,
            expected,
            "the end of the file".to_owned(),
        ));
    };
    let Some(processor) = Processor::from_code(processor) else {
        let expected = "processor 84 (Intel), 85 (DEC) or 86 (MIPS)";
        return Err(wrong(name, section + 3, expected, processor.to_string()));
    };
    Ok((Bytes { bytes, processor }, section))
}

/// One label for each point; points without one are called `*1`, `*2`, …
fn labels(parameters: &Parameters<'_>, points: usize) -> Vec<String> {
    let mut labels = parameters.strings("POINT", "LABELS");
    // A count has 8 bits: labels beyond 255 stand in LABELS2 and so on.
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

/// All points of all frames, m.
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
        let position = Point3::new(number(0)?, number(1)?, number(2)?);
        let usual = position.coords.amax() < MAX_VALUE
            && position.coords.iter().all(|value| value.is_finite())
            && position != Point3::origin();
        (seen && usual).then(|| position * unit_scale_m)
    };
    let frame = |index: usize| {
        let start = layout.data_start + index * frame_bytes;
        (0..layout.points)
            .map(|number| point(start + 4 * width * number))
            .collect()
    };
    (0..layout.frames).map(frame).collect()
}
