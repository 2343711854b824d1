//! How often the messages of a topic come.

use std::collections::BTreeMap;

use cromosim_spatial::Stamp;

use crate::error::BagError;
use crate::message::{Message, Selection};
use crate::reader::BagReader;
use crate::topic::Topic;

/// Intervals from which on something is missing, in median intervals.
const GAP: f64 = 1.6;
/// Part of the intervals that is within the jitter.
const JITTER_PART: f64 = 0.95;

/// The intervals between the messages of a topic: of their header's stamps where their type begins
/// with a `std_msgs/Header`, else of the times at which they were recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cadence {
    /// From the first stamp to the last, s.
    pub span_s: f64,
    /// Messages per second over the span without its gaps, Hz.
    pub rate_hz: f64,
    /// What 95 % of the intervals that are no gaps are off the median interval at most, s.
    pub jitter_s: f64,
    /// Intervals of more than 1.6 times the median.
    pub gaps: usize,
    /// The longest of them, s; 0 where there is none.
    pub longest_gap_s: f64,
}

impl Cadence {
    /// Of stamps in any order; none for fewer than three that differ.
    pub fn of(mut stamps: Vec<Stamp>) -> Option<Self> {
        stamps.sort_unstable();
        stamps.dedup();
        let (first, last) = (*stamps.first()?, *stamps.last()?);
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let median = *intervals.get(intervals.len() / 2)?;
        let regular = intervals.partition_point(|interval| *interval <= GAP * median);
        let (steady, gaps) = intervals.split_at(regular);
        let mut off: Vec<f64> = steady.iter().map(|step| (step - median).abs()).collect();
        off.sort_unstable_by(f64::total_cmp);
        let jitter = off.get((JITTER_PART * (off.len() - 1) as f64).round() as usize);
        (stamps.len() > 2).then(|| Self {
            span_s: last - first,
            rate_hz: steady.len() as f64 / steady.iter().sum::<f64>(),
            jitter_s: jitter.copied().unwrap_or(0.0),
            gaps: gaps.len(),
            longest_gap_s: gaps.last().copied().unwrap_or(0.0),
        })
    }
}

impl BagReader {
    /// The cadence of each topic that has three messages of different stamps or more, by name, from one
    /// pass over all messages. Memory: 8 bytes a message.
    ///
    /// # Errors
    /// [`BagError::Corrupt`], [`BagError::Io`].
    pub fn cadences(&self) -> Result<BTreeMap<String, Cadence>, BagError> {
        let mut stamps: BTreeMap<String, Vec<Stamp>> = BTreeMap::new();
        for message in self.messages(&Selection::default())? {
            let message = message?;
            let stamp = header_stamp(&message).unwrap_or(message.log_time);
            match stamps.get_mut(&message.topic.name) {
                Some(own) => own.push(stamp),
                None => {
                    stamps.insert(message.topic.name.clone(), vec![stamp]);
                }
            }
        }
        let cadences = stamps.into_iter();
        Ok(cadences
            .filter_map(|(name, stamps)| Some((name, Cadence::of(stamps)?)))
            .collect())
    }
}

/// The stamp in front of a message whose type begins with a header.
fn header_stamp(message: &Message) -> Option<Stamp> {
    begins_with_header(&message.topic).then_some(())?;
    let (encapsulation, content) = message.payload.split_at_checked(4)?;
    let word = |at: usize| -> Option<[u8; 4]> { content.get(at..at + 4)?.try_into().ok() };
    let is_little_endian = encapsulation[1] & 1 == 1;
    let (seconds, nanoseconds) = if is_little_endian {
        (i32::from_le_bytes(word(0)?), u32::from_le_bytes(word(4)?))
    } else {
        (i32::from_be_bytes(word(0)?), u32::from_be_bytes(word(4)?))
    };
    Some(Stamp::from_nanos(
        i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
    ))
}

fn begins_with_header(topic: &Topic) -> bool {
    let mut lines = topic.schema_text().lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    first.is_some_and(|line| {
        matches!(
            line.split_whitespace().next(),
            Some("std_msgs/Header" | "std_msgs/msg/Header")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(seconds: impl IntoIterator<Item = f64>) -> Option<Cadence> {
        Cadence::of(seconds.into_iter().map(Stamp::from_seconds).collect())
    }

    #[test]
    fn gaps_do_not_count_for_the_rate() {
        let stamps = (0..100).map(|k| 0.02 * f64::from(k) + if k < 40 { 0.0 } else { 3.0 });
        let cadence = of(stamps).expect("a hundred stamps");
        assert!((cadence.rate_hz - 50.0).abs() < 1e-3, "{cadence:?}");
        assert_eq!(cadence.gaps, 1);
        assert!((cadence.longest_gap_s - 3.02).abs() < 1e-6, "{cadence:?}");
        assert!((cadence.span_s - 4.98).abs() < 1e-6, "{cadence:?}");
        assert!(cadence.jitter_s < 1e-6, "{cadence:?}");
    }

    #[test]
    fn jitter_is_off_the_median_interval() {
        let stamps = (0..100).map(|k| 0.02 * f64::from(k) + 0.001 * f64::from(k % 2));
        let cadence = of(stamps).expect("a hundred stamps");
        assert!((cadence.jitter_s - 0.002).abs() < 1e-6, "{cadence:?}");
        assert_eq!(cadence.gaps, 0);
    }

    #[test]
    fn few_stamps_have_none() {
        assert_eq!(of([]), None);
        assert_eq!(of([1.0, 1.0, 2.0]), None);
    }
}
