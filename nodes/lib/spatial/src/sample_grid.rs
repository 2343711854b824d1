//! A uniform grid through samples that may have gaps.

use std::ops::Range;

use crate::grid::check_count;
use crate::{SpatialError, Stamp};

/// The mean interval averages the stamps' jitter out; it is taken where it lies within this part of
/// the median, for farther off it is not jitter that moves it. No source.
const MEAN_INTERVAL_TOLERANCE: f64 = 0.02;
/// Intervals between two samples beyond which samples are missing. No source.
const GAP_INTERVALS: f64 = 1.6;
/// A sample so near an entry, in intervals, is the entry's value. No source.
const ON_GRID: f64 = 0.01;
/// Four samples span three intervals; up to this many the cubic through them is taken. No source.
const CUBIC_SPAN: f64 = 4.0;

/// A uniform grid through samples that may have gaps.
pub(crate) struct SampleGrid {
    /// Time of the first entry, which is the first sample.
    pub start: Stamp,
    /// Entries per second.
    pub rate_hz: f64,
    /// Number of entries.
    pub count: usize,
    /// Position of each sample on the grid, in intervals since the start.
    positions: Vec<f64>,
}

impl SampleGrid {
    /// The grid through at least two increasing stamps.
    pub fn from_stamps(stamps: &[Stamp]) -> Result<Self, SpatialError> {
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let median = intervals[intervals.len() / 2];
        // The mean interval, gaps counted by how many medians they span.
        let spans: f64 = stamps
            .windows(2)
            .map(|pair| ((pair[1] - pair[0]) / median).round().max(1.0))
            .sum();
        let mean = (stamps[stamps.len() - 1] - stamps[0]) / spans;
        let interval = if (mean / median - 1.0).abs() < MEAN_INTERVAL_TOLERANCE {
            mean
        } else {
            median
        };
        let positions: Vec<f64> = stamps
            .iter()
            .map(|stamp| (*stamp - stamps[0]) / interval)
            .collect();
        let count = positions[positions.len() - 1].round() as usize + 1;
        check_count(count as f64, 1.0 / interval)?;
        Ok(Self {
            start: stamps[0],
            rate_hz: 1.0 / interval,
            count,
            positions,
        })
    }

    /// Runs of entries without a sample.
    pub fn gaps(&self) -> Vec<Range<usize>> {
        let between = |pair: &[f64]| {
            (pair[0] + 0.5).ceil() as usize..(pair[1] - 0.5).ceil().max(0.0) as usize
        };
        self.positions
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > GAP_INTERVALS)
            .map(between)
            .filter(|gap| !gap.is_empty())
            .collect()
    }

    /// The stamps of the samples before and after each gap.
    pub fn gap_stamps(&self) -> Vec<(Stamp, Stamp)> {
        let stamp = |position: f64| self.start.plus_seconds(position / self.rate_hz);
        self.positions
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > GAP_INTERVALS)
            .map(|pair| (stamp(pair[0]), stamp(pair[1])))
            .collect()
    }

    /// Values at the grid's entries: the sample itself where one lies there, else a cubic through
    /// the four around it (no more than linear next to a gap, so that nothing overshoots).
    pub fn resample(&self, stamps: &[Stamp], value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut right = 0;
        (0..self.count)
            .map(|entry| {
                let position = entry as f64;
                while right + 1 < stamps.len() && self.positions[right] < position {
                    right += 1;
                }
                let left = right.saturating_sub(1);
                let nearest = if (self.positions[left] - position).abs()
                    < (self.positions[right] - position).abs()
                {
                    left
                } else {
                    right
                };
                if (self.positions[nearest] - position).abs() < ON_GRID {
                    return value(nearest);
                }
                let from = left.saturating_sub(1);
                let to = (right + 1).min(stamps.len() - 1);
                if to - from == 3 && self.positions[to] - self.positions[from] < CUBIC_SPAN {
                    return lagrange(&self.positions[from..=to], |k| value(from + k), position);
                }
                let span = self.positions[right] - self.positions[left];
                let share = if span > 0.0 {
                    ((position - self.positions[left]) / span).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                value(left) * (1.0 - share) + value(right) * share
            })
            .collect()
    }
}

/// The polynomial through values at `nodes`, at a position between them.
fn lagrange(nodes: &[f64], value: impl Fn(usize) -> f64, position: f64) -> f64 {
    (0..nodes.len())
        .map(|k| {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
            value(k)
                * others
                    .map(|(_, node)| (position - node) / (nodes[k] - node))
                    .product::<f64>()
        })
        .sum()
}
