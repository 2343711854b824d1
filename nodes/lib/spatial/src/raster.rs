//! A uniform grid through samples that may have holes.

use std::ops::Range;

use crate::{SpatialError, Stamp};

/// A uniform grid through samples that may have holes.
pub(crate) struct Raster {
    pub start: Stamp,
    pub rate_hz: f64,
    pub count: usize,
    /// Position of each sample on the grid.
    places: Vec<f64>,
}

impl Raster {
    pub fn new(stamps: &[Stamp]) -> Result<Self, SpatialError> {
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let median = intervals[intervals.len() / 2];
        // The mean interval, holes counted by how many medians they span.
        let spans: f64 = stamps
            .windows(2)
            .map(|pair| ((pair[1] - pair[0]) / median).round().max(1.0))
            .sum();
        let mean = (stamps[stamps.len() - 1] - stamps[0]) / spans;
        let interval = if (mean / median - 1.0).abs() < 0.02 {
            mean
        } else {
            median
        };
        let places: Vec<f64> = stamps
            .iter()
            .map(|stamp| (*stamp - stamps[0]) / interval)
            .collect();
        let count = places[places.len() - 1].round() as usize + 1;
        if count > 20_000_000 {
            return Err(SpatialError::TooManyStamps {
                count: count as f64,
                limit: 2e7,
                rate_hz: 1.0 / interval,
            });
        }
        Ok(Self {
            start: stamps[0],
            rate_hz: 1.0 / interval,
            count,
            places,
        })
    }

    /// Runs of entries without a sample.
    pub fn holes(&self) -> Vec<Range<usize>> {
        let between = |pair: &[f64]| {
            (pair[0] + 0.5).ceil() as usize..(pair[1] - 0.5).ceil().max(0.0) as usize
        };
        self.places
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > 1.6)
            .map(between)
            .filter(|hole| !hole.is_empty())
            .collect()
    }

    pub fn gaps(&self) -> Vec<(Stamp, Stamp)> {
        let stamp = |place: f64| self.start.plus_seconds(place / self.rate_hz);
        self.places
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > 1.6)
            .map(|pair| (stamp(pair[0]), stamp(pair[1])))
            .collect()
    }

    /// Values at the grid's entries: the sample itself where one lies there, else a cubic through
    /// the four around it (no more than linear next to a hole, so that nothing overshoots).
    pub fn resample(&self, stamps: &[Stamp], of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut right = 0;
        (0..self.count)
            .map(|entry| {
                let place = entry as f64;
                while right + 1 < stamps.len() && self.places[right] < place {
                    right += 1;
                }
                let left = right.saturating_sub(1);
                let nearest =
                    if (self.places[left] - place).abs() < (self.places[right] - place).abs() {
                        left
                    } else {
                        right
                    };
                if (self.places[nearest] - place).abs() < 0.01 {
                    return of(nearest);
                }
                let from = left.saturating_sub(1);
                let to = (right + 1).min(stamps.len() - 1);
                if to - from == 3 && self.places[to] - self.places[from] < 4.0 {
                    return lagrange(&self.places[from..=to], |k| of(from + k), place);
                }
                let span = self.places[right] - self.places[left];
                let share = if span > 0.0 {
                    ((place - self.places[left]) / span).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                of(left) * (1.0 - share) + of(right) * share
            })
            .collect()
    }
}

fn lagrange(nodes: &[f64], of: impl Fn(usize) -> f64, place: f64) -> f64 {
    (0..nodes.len())
        .map(|k| {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
            of(k)
                * others
                    .map(|(_, node)| (place - node) / (nodes[k] - node))
                    .product::<f64>()
        })
        .sum()
}
