//! The MOTION section: number of frames, frame time, one line a frame.

use crate::MotionError;
use crate::text::{Cursor, Token};

/// Frame times that are believed, s: 100 kHz down to one frame in ten seconds.
const FRAME_TIMES_S: std::ops::RangeInclusive<f64> = 1e-5..=10.0;

/// After MOTION: frame time in seconds, and all values, frame-major.
pub(super) fn parse_motion(
    cursor: &mut Cursor<'_>,
    channel_count: usize,
) -> Result<(f64, Vec<f64>), MotionError> {
    let (frame_count, declared_at) = parse_frame_count(cursor)?;
    let frame_time_s = parse_frame_time(cursor)?;
    if channel_count == 0 {
        return Err(cursor.unexpected(
            "a joint with CHANNELS",
            Some(Token {
                text: "a skeleton without any",
                line: cursor.line(),
            }),
        ));
    }
    // A number takes two bytes at least: what the file declares does not decide how much memory is
    // taken.
    let mut values = Vec::with_capacity(
        frame_count
            .saturating_mul(channel_count)
            .min(cursor.remaining() / 2 + 1),
    );
    let mut found = 0;
    let mut last_line = cursor.line();
    while let Some(line) = cursor.next_line() {
        if found < frame_count {
            parse_frame(cursor, line, channel_count, &mut values)?;
        }
        // Where the frames end, or the first one that is too many.
        if found <= frame_count {
            last_line = line.line;
        }
        found += 1;
    }
    if found != frame_count {
        let name = cursor.name().to_owned();
        return Err(MotionError::FrameCount {
            name,
            line: last_line,
            expected: frame_count,
            found,
            declared_at,
        });
    }
    Ok((frame_time_s, values))
}

/// `Frames: 344`
fn parse_frame_count(cursor: &mut Cursor<'_>) -> Result<(usize, usize), MotionError> {
    let line = cursor.next_line();
    let count = line
        .and_then(|token| after_key(token.text, &["frames"]))
        .and_then(|text| text.parse::<usize>().ok());
    match (count, line) {
        (Some(count), Some(token)) if count > 0 => Ok((count, token.line)),
        _ => Err(cursor.unexpected("Frames: and their number, at least 1", line)),
    }
}

/// `Frame Time: 0.008333`
fn parse_frame_time(cursor: &mut Cursor<'_>) -> Result<f64, MotionError> {
    let line = cursor.next_line();
    let time_s = line
        .and_then(|token| after_key(token.text, &["frame", "time"]))
        .and_then(|text| text.parse::<f64>().ok());
    match time_s {
        Some(time_s) if FRAME_TIMES_S.contains(&time_s) => Ok(time_s),
        _ => {
            let expected = format!(
                "Frame Time: and seconds from {} to {}",
                FRAME_TIMES_S.start(),
                FRAME_TIMES_S.end()
            );
            Err(cursor.unexpected(&expected, line))
        }
    }
}

/// What follows `key words :` in any case and spacing.
fn after_key<'a>(line: &'a str, key: &[&str]) -> Option<&'a str> {
    let (before, after) = line.split_once(':')?;
    let same = before
        .split_whitespace()
        .map(str::to_ascii_lowercase)
        .eq(key.iter().copied());
    same.then(|| after.trim())
}

fn parse_frame(
    cursor: &Cursor<'_>,
    line: Token<'_>,
    channel_count: usize,
    values: &mut Vec<f64>,
) -> Result<(), MotionError> {
    let before = values.len();
    for (column, word) in line.text.split_whitespace().enumerate() {
        values.push(cursor.parse_number(
            Token {
                text: word,
                line: line.line,
            },
            "a number",
            column + 1,
        )?);
    }
    let found = values.len() - before;
    if found != channel_count {
        return Err(MotionError::ChannelCount {
            name: cursor.name().to_owned(),
            line: line.line,
            expected: channel_count,
            found,
        });
    }
    Ok(())
}
