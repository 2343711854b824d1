//! What stays unexplained, split into a part of the reference's errors and a variance of its own.

use crate::policy::report::{
    LEAST_REFERENCE_EXCESS, LEAST_SPLIT_NATS, MOST_REFERENCE_EXCESS, REFERENCE_SHARE,
};

/// Length of the blocks of time whose readings tell no more than one does, s: what errors of a reference's
/// derivatives resemble each other.
pub(crate) const BLOCK_S: f64 = 0.2;
/// Shares of the reference's errors that are compared.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Halvings of a variance until it is found.
const HALVINGS: usize = 60;

/// Variances of one reading, mean over its axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StatedReading {
    /// Block of time.
    pub block: usize,
    /// Its squared difference from the simulation.
    pub squared: f64,
    /// What the errors of the reference's derivatives leave.
    pub of_reference: f64,
    /// All else that is known of.
    pub known: f64,
}

/// `variance = known + (1 + reference_excess) of_reference + variance`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Split {
    pub reference_excess: f64,
    pub variance: f64,
}

impl Split {
    /// With which squared differences over variances average 1, as far as that is not below the reference's least:
    /// the likelier of some splits, given normal errors that are independent between blocks, and
    /// [`REFERENCE_SHARE`] where none is by [`LEAST_SPLIT_NATS`].
    pub fn of(readings: &[StatedReading]) -> Self {
        let mean = readings.iter().map(|one| one.of_reference).sum::<f64>();
        let mean = mean / readings.len().max(1) as f64;
        if readings.is_empty() || mean <= 0.0 {
            return Self::default();
        }
        if Self::default().ratio(readings) < 1.0 {
            return Self::below(readings);
        }
        let usual = Self::above(readings, mean, REFERENCE_SHARE);
        let best = SHARES
            .map(|share| Self::above(readings, mean, share))
            .map(|split| (split.log_likelihood(readings), split))
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|(nats, _)| *nats > usual.log_likelihood(readings) + LEAST_SPLIT_NATS)
            .map_or(usual, |(_, split)| split)
    }

    /// Where less is left than the reference's errors should leave.
    fn below(readings: &[StatedReading]) -> Self {
        let at = |reference_excess: f64| Self {
            reference_excess,
            variance: 0.0,
        };
        Self::where_they_average_one(readings, at, [LEAST_REFERENCE_EXCESS, 0.0])
    }

    /// Where more is, of which a share goes with these errors, whose mean is `mean`.
    fn above(readings: &[StatedReading], mean: f64, share: f64) -> Self {
        let at = |rest: f64| {
            let wanted = share * rest / mean;
            let reference_excess = wanted.min(MOST_REFERENCE_EXCESS);
            Self {
                reference_excess,
                variance: (1.0 - share) * rest + (wanted - reference_excess) * mean,
            }
        };
        let mut most = readings.iter().map(|one| one.squared).sum::<f64>();
        while at(most).ratio(readings) > 1.0 {
            most *= 2.0;
        }
        Self::where_they_average_one(readings, at, [0.0, most])
    }

    /// Of splits that state the more, the larger a value, the one between two values with which squared differences
    /// over variances average 1.
    fn where_they_average_one(
        readings: &[StatedReading],
        at: impl Fn(f64) -> Self,
        [mut least, mut most]: [f64; 2],
    ) -> Self {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            if at(middle).ratio(readings) > 1.0 {
                least = middle;
            } else {
                most = middle;
            }
        }
        at(most)
    }

    fn variance_of(self, one: &StatedReading) -> f64 {
        let stated = one.known + (1.0 + self.reference_excess) * one.of_reference + self.variance;
        stated.max(f64::MIN_POSITIVE)
    }

    /// Mean of the squared differences over the variances.
    fn ratio(self, readings: &[StatedReading]) -> f64 {
        let sum: f64 = readings
            .iter()
            .map(|one| one.squared / self.variance_of(one))
            .sum();
        sum / readings.len() as f64
    }

    /// Of three axes in each block, nats.
    fn log_likelihood(self, readings: &[StatedReading]) -> f64 {
        readings
            .chunk_by(|a, b| a.block == b.block)
            .map(|block| {
                let variance = block.iter().map(|one| self.variance_of(one));
                let logarithm = variance.map(f64::ln).sum::<f64>() / block.len() as f64;
                -1.5 * (self.ratio(block) + logarithm)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    use super::*;

    /// Ten minutes at 50 Hz, every other second of which moves.
    fn drawn(variance: impl Fn(f64) -> f64) -> Vec<StatedReading> {
        let mut random = ChaCha12Rng::seed_from_u64(5);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let reading = |k: usize| {
            let of_reference = if (k / 50).is_multiple_of(2) { 4.0 } else { 0.1 };
            let squares = (0..3).map(|_| normal().powi(2)).sum::<f64>() / 3.0;
            StatedReading {
                block: k / 10,
                squared: variance(of_reference) * squares,
                of_reference,
                known: 0.3,
            }
        };
        (0..30_000).map(reading).collect()
    }

    #[test]
    fn what_goes_with_the_motion_is_told_from_what_does_not() {
        let with_motion = Split::of(&drawn(|of_reference| 0.3 + 2.5 * of_reference));
        assert!(
            (with_motion.reference_excess - 1.5).abs() < 0.15 && with_motion.variance < 0.1,
            "{with_motion:?}"
        );
        let steady = Split::of(&drawn(|of_reference| 0.3 + of_reference + 0.8));
        assert!(
            steady.reference_excess < 0.05 && (steady.variance - 0.8).abs() < 0.1,
            "{steady:?}"
        );
        let less = Split::of(&drawn(|of_reference| 0.3 + 0.4 * of_reference));
        assert!(
            (less.reference_excess + 0.6).abs() < 0.05 && less.variance == 0.0,
            "{less:?}"
        );
    }

    #[test]
    fn squared_differences_over_variances_average_one() {
        for scale in [0.5, 1.0, 3.0, 40.0] {
            let readings = drawn(|of_reference| scale * (0.3 + of_reference));
            let ratio = Split::of(&readings).ratio(&readings);
            assert!((ratio - 1.0).abs() < 1e-6, "{scale}: {ratio}");
        }
        assert_eq!(Split::of(&[]), Split::default());
    }
}
