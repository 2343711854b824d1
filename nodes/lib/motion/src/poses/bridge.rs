//! Which part of a track is played, and how the frames that it lacks are bridged.

use std::ops::Range;

/// Longer gaps are not bridged, s: a person may do anything meanwhile.
pub(super) const LONGEST_GAP_S: f64 = 1.0;
/// Gaps of more frames are not bridged either, whatever the rate.
const LONGEST_GAP_FRAMES: f64 = 240.0;

/// The part of a track that is played: the longest one without a gap that is too long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Played {
    /// Frames of the track.
    pub frames: Range<usize>,
    /// Frames of the motion, those that bridge gaps included.
    pub length: usize,
}

impl Played {
    /// The longest such part of `count` frames numbered by `ids`, which rise.
    pub fn longest_part(ids: Option<&[i64]>, count: usize, rate_hz: f64) -> Self {
        let Some(ids) = ids else {
            return Self {
                frames: 0..count,
                length: count,
            };
        };
        let longest = (LONGEST_GAP_S * rate_hz)
            .round()
            .clamp(1.0, LONGEST_GAP_FRAMES) as i64
            + 1;
        let mut best = Self {
            frames: 0..0,
            length: 0,
        };
        let mut current = Self {
            frames: 0..1,
            length: 1,
        };
        for (index, pair) in ids.windows(2).enumerate() {
            let step = pair[1].saturating_sub(pair[0]);
            if step > longest {
                if current.frames.len() > best.frames.len() {
                    best = current;
                }
                current = Self {
                    frames: index + 1..index + 2,
                    length: 1,
                };
            } else {
                current.frames.end = index + 2;
                current.length += usize::try_from(step).unwrap_or(1);
            }
        }
        if current.frames.len() > best.frames.len() {
            current
        } else {
            best
        }
    }

    /// For each frame of the motion the track's frame at or before it, and how far it is from there
    /// to the next one, in [0, 1).
    pub fn sources(&self, ids: Option<&[i64]>) -> Vec<(usize, f64)> {
        let mut sources = Vec::with_capacity(self.length);
        for index in self.frames.clone() {
            let step = match ids {
                Some(ids) if index + 1 < self.frames.end => ids[index + 1] - ids[index],
                _ => 1,
            };
            sources.extend((0..step).map(|part| (index, part as f64 / step as f64)));
        }
        sources
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_gaps_are_bridged_and_long_ones_split() {
        let whole = Played::longest_part(None, 5, 30.0);
        assert_eq!(
            (whole.clone(), whole.sources(None)[4]),
            (
                Played {
                    frames: 0..5,
                    length: 5
                },
                (4, 0.0)
            )
        );
        let ids = [3, 4, 8, 100, 101];
        let played = Played::longest_part(Some(&ids), 5, 30.0);
        assert_eq!(
            played,
            Played {
                frames: 0..3,
                length: 6
            }
        );
        assert_eq!(
            played.sources(Some(&ids)),
            [(0, 0.0), (1, 0.0), (1, 0.25), (1, 0.5), (1, 0.75), (2, 0.0)]
        );
        assert_eq!(Played::longest_part(Some(&[0, 31]), 2, 30.0).length, 32);
        assert_eq!(Played::longest_part(Some(&[0, 32]), 2, 30.0).length, 1);
        assert_eq!(
            Played::longest_part(Some(&[i64::MIN, 0, 1, i64::MAX]), 4, 30.0).frames,
            1..3
        );
        assert_eq!(
            Played::longest_part(Some(&[0, 241, 500]), 3, 1e4).length,
            242
        );
    }
}
