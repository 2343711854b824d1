//! Sums of evidence around each entry of a series.

use crate::wide::{Four, add, scale};

/// A sum of squares, and what it counts, of each lane.
pub(crate) type Evidence<const L: usize> = [[f64; L]; 2];

/// What smoothed evidence says on average around each entry.
#[inline(always)]
pub(crate) fn means<const L: usize>(evidence: &[Evidence<L>]) -> impl Iterator<Item = [f64; L]> {
    evidence.iter().map(|[square, count]| {
        std::array::from_fn(|lane| (square[lane] / count[lane]).max(f64::MIN_POSITIVE))
    })
}

/// `a^|k|` convolved with itself, a so chosen that the standard deviation is as wanted: two
/// recursions each way.
pub(crate) struct Kernel {
    decay: f64,
}

impl Kernel {
    /// Of this standard deviation, in entries. One pass has the variance `2 a / (1 - a)^2`.
    pub(crate) fn new(std: f64) -> Self {
        let variance = 0.5 * std * std;
        let decay = (1.0 + variance - (1.0 + 2.0 * variance).sqrt()) / variance;
        Self { decay }
    }

    /// Weighted sums in place, of as many entries in each series; a quotient of two of them is a weighted
    /// mean. All at once, as each waits for its own last sum; `scratch` is memory to reuse.
    #[inline(always)]
    pub(crate) fn smooth_together<const L: usize, const N: usize>(
        s: impl Four,
        series: [(Self, &mut [Evidence<L>]); N],
        scratch: &mut [Vec<Evidence<L>>; N],
    ) {
        let decays = series.each_ref().map(|(kernel, _)| kernel.decay);
        let values = series.map(|(_, values)| values);
        let count = values.iter().map(|own| own.len()).min().unwrap_or(0);
        let before = scratch.each_mut().map(|scratch| {
            scratch.resize(count, [[0.0; L]; 2]);
            scratch.as_mut_slice()
        });
        for _ in 0..2 {
            let mut sums = [[[0.0; L]; 2]; N];
            for k in 0..count {
                for n in 0..N {
                    for (sum, own) in sums[n].iter_mut().zip(&values[n][k]) {
                        scale(s, sum, decays[n]);
                        add(s, sum, own);
                    }
                    before[n][k] = sums[n];
                }
            }
            let mut after = [[[0.0; L]; 2]; N];
            for k in (0..count).rev() {
                for n in 0..N {
                    let own = values[n][k]
                        .iter_mut()
                        .zip(&before[n][k])
                        .zip(&mut after[n]);
                    for ((value, before), after) in own {
                        let mut next = *after;
                        add(s, &mut next, value);
                        scale(s, &mut next, decays[n]);
                        *value = *before;
                        add(s, value, after);
                        *after = next;
                    }
                }
            }
        }
    }
}
