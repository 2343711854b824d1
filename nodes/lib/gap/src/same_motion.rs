//! Which of several times readings belong to, by how fast the reference turned: no axes, units or
//! gravity enter.

use cromosim_spatial::Stamp;

use crate::record::PlacementRecord;

/// Angular speeds are means over so long, s: what clocks and filters are ordinarily late by is less.
const BIN_S: f64 = 0.25;
/// Fewer of them tell nothing.
const LEAST_BINS: usize = 20;
/// Two times are told apart where the correlation of one is higher by this.
const LEAST_LEAD: f64 = 0.1;
/// The same motion correlates better.
const SEEN: f64 = 0.5;

/// The angular speeds of readings and reference.
pub(crate) struct SameMotion<'r> {
    record: &'r PlacementRecord,
}

impl<'r> SameMotion<'r> {
    pub fn new(record: &'r PlacementRecord) -> Self {
        Self { record }
    }

    /// Whether the reference turns as some messages say, at their stamps.
    pub fn is_seen(&self, messages: &[usize]) -> bool {
        let correlation = self.correlation(&self.measured_bins(messages), 0.0);
        correlation.is_some_and(|correlation| correlation >= SEEN)
    }

    /// What has to be taken off the stamps of some messages, s: of several candidates the one under
    /// which the reference turns as they say; the first where the motion does not tell.
    pub fn best(&self, messages: &[usize], candidates: &[f64]) -> Option<f64> {
        let first = *candidates.first()?;
        if candidates.len() == 1 {
            return Some(first);
        }
        let bins = self.measured_bins(messages);
        let correlation = |jumped_s: f64| self.correlation(&bins, jumped_s).unwrap_or(0.0);
        let mut best = (first, correlation(first));
        for &other in &candidates[1..] {
            let own = correlation(other);
            if own > best.1.max(0.0) + LEAST_LEAD {
                best = (other, own);
            }
        }
        Some(best.0)
    }

    /// Begin of each bin by the clock of the messages, and the mean angular speed that was measured.
    fn measured_bins(&self, messages: &[usize]) -> Vec<(Stamp, f64)> {
        let mut bins: Vec<(Stamp, f64, usize)> = Vec::new();
        for &message in messages {
            let stamp = self.record.imu.stamps[message];
            let speed = self.record.imu.readings[message].angular_velocity.norm();
            if !speed.is_finite() {
                continue;
            }
            match bins.last_mut() {
                Some((begin, sum, count)) if (0.0..BIN_S).contains(&(stamp - *begin)) => {
                    *sum += speed;
                    *count += 1;
                }
                _ => bins.push((stamp, speed, 1)),
            }
        }
        let mean =
            |(begin, sum, count)| (begin, sum / f64::from(u32::try_from(count).unwrap_or(1)));
        bins.into_iter().map(mean).collect()
    }

    /// How fast the reference turned from a time on; none where it has no poses.
    fn reference_speed(&self, begin: Stamp) -> Option<f64> {
        let reference = &self.record.reference;
        let at = |stamp: Stamp| reference.stamps.partition_point(|other| *other < stamp);
        let (from, to) = (at(begin), at(begin.plus_seconds(BIN_S)));
        let (first, last) = (reference.stamps.get(from)?, reference.stamps.get(to)?);
        let seconds = *last - *first;
        let is_whole =
            *first - begin < 0.5 * BIN_S && (0.5 * BIN_S..1.5 * BIN_S).contains(&seconds);
        let angle = reference.rotations[from].angle_to(&reference.rotations[to]);
        is_whole.then(|| angle / seconds)
    }

    fn correlation(&self, bins: &[(Stamp, f64)], jumped_s: f64) -> Option<f64> {
        let pairs: Vec<[f64; 2]> = bins
            .iter()
            .filter_map(|(begin, speed)| {
                Some([*speed, self.reference_speed(begin.plus_seconds(-jumped_s))?])
            })
            .collect();
        if pairs.len() < LEAST_BINS {
            return None;
        }
        let mean =
            |of: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        let means = [mean(&|pair| pair[0]), mean(&|pair| pair[1])];
        let product =
            |a: usize, b: usize| mean(&|pair| (pair[a] - means[a]) * (pair[b] - means[b]));
        let scale = (product(0, 0) * product(1, 1)).sqrt();
        (scale > 0.0).then(|| product(0, 1) / scale)
    }
}
