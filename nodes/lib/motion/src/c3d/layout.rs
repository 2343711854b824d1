//! Where the frames of a file lie, by its header and its parameters.

use super::numbers::Bytes;
use super::parameters::Parameters;
use crate::MotionError;

/// Bytes of a block: sections begin at its multiples.
pub(super) const BLOCK: usize = 512;
/// The frame counts of 16 bits end here: longer recordings say this, and their data go on.
const MANY_FRAMES: usize = 65_535;

/// Where the numbers of a frame are.
pub(super) struct Layout {
    pub points: usize,
    /// Analog samples in a frame.
    pub analog: usize,
    pub frames: usize,
    /// Byte at which the first frame begins.
    pub data_start: usize,
    /// What integers are multiplied by, file units; `None` for floats.
    pub integer_scale: Option<f64>,
}

impl Layout {
    /// Reads counts and scale; parameters go before the header, whose numbers have 16 bits.
    pub fn read(
        file: Bytes<'_>,
        parameters: &Parameters<'_>,
        name: &str,
    ) -> Result<Self, MotionError> {
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
            let found = "none: the file has analog channels at most".to_owned();
            return Err(wrong(name, 2, "points", found));
        }
        let scale = parameters
            .number("POINT", "SCALE")
            .filter(|scale| *scale != 0.0)
            .or(file.float(12).map(f64::from))
            .unwrap_or(0.0);
        if scale == 0.0 || !scale.is_finite() {
            let expected = "a scale that is finite and not 0";
            return Err(wrong(name, 12, expected, scale.to_string()));
        }
        let first_block = positive("DATA_START").unwrap_or(word(9));
        let data_start = first_block.saturating_sub(1).saturating_mul(BLOCK);
        let integer_scale = (scale > 0.0).then_some(scale);
        let analog = word(3);
        let frame_bytes = points
            .saturating_mul(4)
            .saturating_add(analog)
            .saturating_mul(if integer_scale.is_some() { 2 } else { 4 });
        let available = file.bytes.len().saturating_sub(data_start) / frame_bytes;
        let in_header = (word(5) + 1).saturating_sub(word(4));
        let declared = parameters
            .trial_frames()
            .or(positive("LONG_FRAMES"))
            .or(positive("FRAMES"))
            .unwrap_or(in_header);
        let frames = if declared >= MANY_FRAMES {
            declared.min(available)
        } else {
            declared
        };
        if data_start < BLOCK || frames == 0 || frames > available {
            let expected = format!("{declared} frames (at least 1) of {frame_bytes} bytes");
            let found = format!("{available} frames up to the end of the file");
            return Err(wrong(name, data_start, &expected, found));
        }
        Ok(Self {
            points,
            analog,
            frames,
            data_start,
            integer_scale,
        })
    }
}

/// The error for what stands at a byte.
pub(super) fn wrong(name: &str, offset: usize, expected: &str, found: String) -> MotionError {
    MotionError::Bytes {
        name: name.to_owned(),
        offset,
        expected: expected.to_owned(),
        found,
    }
}
