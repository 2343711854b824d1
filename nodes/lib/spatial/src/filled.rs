//! Coordinates of poses where there are none: in gaps and beyond the ends.

use std::ops::Range;

use crate::gaps::{FillErrors, Filling, fill_gaps};
use crate::noise_floor::NoiseFloor;
use crate::sample_grid::SampleGrid;
use crate::{FourierPair, Stamp};

/// Stands for what has no other end, s.
const FAR_S: f64 = 1e6;
/// From one pose to the next, s: within so little a filter of motion takes the mean of many poses, and some more or
/// less make no difference.
const SHORT_S: f64 = 0.025;
/// Zeros after a series in its transforms, s, so that its ends do not meet. No source.
const PADDING_S: f64 = 4.0;

/// A stretch without poses, and how far position and rotation that are filled in may be off there.
#[derive(Clone, Debug)]
pub(crate) struct Filled {
    /// The last pose before, and the first one after; far off at the ends.
    pub from: Stamp,
    pub to: Stamp,
    pub errors: [FillErrors; 2],
}

/// The gaps that matter and what is beyond the ends, in order.
pub(crate) fn all_filled(
    grid: &SampleGrid,
    gaps: &[(Stamp, Stamp)],
    of_gaps: [Vec<FillErrors>; 2],
    of_ends: [Vec<FillErrors>; 2],
) -> Vec<Filled> {
    let end = grid
        .start
        .plus_seconds((grid.count - 1) as f64 / grid.rate_hz);
    let far = |from: Stamp, seconds: f64| from.plus_seconds(seconds);
    let beyond = [
        (far(grid.start, -FAR_S), grid.start),
        (end, far(end, FAR_S)),
    ];
    let with = |stamps: &[(Stamp, Stamp)], [positions, rotations]: [Vec<FillErrors>; 2]| {
        let both = positions.into_iter().zip(rotations);
        let filled = stamps.iter().zip(both).map(|((from, to), (p, r))| Filled {
            from: *from,
            to: *to,
            errors: [p, r],
        });
        filled.collect::<Vec<_>>()
    };
    let mut all = with(&beyond, of_ends);
    let last = all.pop();
    let of_gaps = with(gaps, of_gaps).into_iter();
    all.extend(of_gaps.filter(|gap| gap.to - gap.from > SHORT_S));
    all.extend(last);
    all
}

/// Continues series by `lead` entries at both ends, oddly.
pub(crate) fn lengthen(series: &mut [Vec<f64>], lead: usize) {
    let count = series[0].len();
    for values in series.iter_mut() {
        let last = count - 1;
        let before = (1..=lead)
            .rev()
            .map(|k| 2.0 * values[0] - values[k.min(last)]);
        let after = (1..=lead).map(|k| 2.0 * values[last] - values[last - k.min(last)]);
        *values = before.chain(values.iter().copied()).chain(after).collect();
    }
}

/// Fills the gaps of positions and quaternions by what is likeliest under their spectra.
pub(crate) fn fill(
    coordinates: &mut [Vec<f64>],
    gaps: &[Range<usize>],
    floors: &[NoiseFloor; 2],
    rate_hz: f64,
) -> [Vec<FillErrors>; 2] {
    let transform = &FourierPair::new(FourierPair::good_length(
        coordinates[0].len() + (PADDING_S * rate_hz) as usize,
    ));
    let (positions, quaternions) = coordinates.split_at_mut(3);
    let filled = |series: &mut [Vec<f64>], floor: &NoiseFloor| {
        let filling = Filling {
            spectrum: floor.spectrum(),
            noise: floor.shape.level,
            transform,
            rate_hz,
        };
        fill_gaps(series, gaps, &filling)
    };
    [
        filled(positions, &floors[0]),
        filled(quaternions, &floors[1]),
    ]
}

#[cfg(test)]
#[path = "filled_tests.rs"]
mod tests;
