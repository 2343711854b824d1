//! What a motion is good for: which of its ends are too uncertain, up to which frequency it is known.

use std::ops::RangeInclusive;

use cromosim_spatial::Stamp;

use crate::{Bandwidth, KinematicSample};

/// Variance that was learnt from the poses, over the median of the clip and that of the stretch behind the end, from which samples
/// at an end are left out. Chosen among 3, 5 and 10 on the clips of `mocap_cmu`, by how often the
/// largest specific force stands at an end; `tests/every_clip.rs` has others.
const UNCERTAIN: f64 = 3.0;
/// The most that [`Trim::Uncertain`] takes off an end, s. No source.
pub const LONGEST_TRIM_S: f64 = 0.25;
/// And as a part of the motion.
const LARGEST_PART: f64 = 0.1;
/// Where the stretch behind an end ends, s from it.
const BEHIND_S: f64 = 1.0;

/// What is left out at the ends of a motion, where there are poses on one side only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trim {
    /// The samples at either end whose acceleration or angular velocity is far more uncertain than
    /// the median of the motion's, and of those behind them, up to [`LONGEST_TRIM_S`] and
    /// a tenth of the motion.
    #[default]
    Uncertain,
    /// This time at either end, s; 0 leaves nothing out.
    Seconds(f64),
}

impl Trim {
    /// From the first to the last stamp that are left of a motion; none where nothing is, as of one
    /// without samples. The stamps of `motion` increase.
    pub fn span(self, motion: &[KinematicSample]) -> Option<RangeInclusive<Stamp>> {
        let (start, end) = (motion.first()?.stamp, motion.last()?.stamp);
        let (from, to) = match self {
            Self::Seconds(seconds) => (start.plus_seconds(seconds), end.plus_seconds(-seconds)),
            Self::Uncertain => {
                let both = |sample| (acceleration(sample), angular_velocity(sample));
                let of_all = medians(motion.iter().map(both));
                let first = first_certain(motion.iter(), of_all).unwrap_or(start);
                let last = first_certain(motion.iter().rev(), of_all).unwrap_or(end);
                let most_s = LONGEST_TRIM_S.min(LARGEST_PART * (end - start));
                (
                    first.min(start.plus_seconds(most_s)),
                    last.max(end.plus_seconds(-most_s)),
                )
            }
        };
        (from <= to).then_some(from..=to)
    }
}

/// Median over the motion; none where a sample has none.
pub fn median_bandwidth(motion: &[KinematicSample]) -> Option<Bandwidth> {
    let mut known = true;
    let both = motion.iter().map(|sample| match sample.bandwidth {
        Some(bandwidth) => (bandwidth.acceleration_hz, bandwidth.angular_velocity_hz),
        None => {
            known = false;
            (0.0, 0.0)
        }
    });
    let [acceleration_hz, angular_velocity_hz] = medians(both);
    (known && !motion.is_empty()).then_some(Bandwidth {
        acceleration_hz,
        angular_velocity_hz,
    })
}

/// The first sample from an end on that is as certain as the others, whose medians are given.
fn first_certain<'a>(
    mut from_end: impl Iterator<Item = &'a KinematicSample> + Clone,
    [acceleration_of_all, angular_velocity_of_all]: [f64; 2],
) -> Option<Stamp> {
    let end = from_end.clone().next()?.stamp;
    let distance = |sample: &&KinematicSample| (sample.stamp - end).abs();
    let behind = from_end
        .clone()
        .skip_while(|sample| distance(sample) < LONGEST_TRIM_S)
        .take_while(|sample| distance(sample) < BEHIND_S);
    let limit = |of_all: f64, variance: fn(&KinematicSample) -> f64| {
        UNCERTAIN * of_all.max(median(behind.clone().map(variance)))
    };
    let most_acceleration = limit(acceleration_of_all, acceleration);
    let most_angular_velocity = limit(angular_velocity_of_all, angular_velocity);
    let certain = |sample: &&KinematicSample| {
        acceleration(sample) <= most_acceleration
            && angular_velocity(sample) <= most_angular_velocity
    };
    from_end.find(certain).map(|sample| sample.stamp)
}

/// 0 of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    middle(values.map(in_order).collect())
}

/// Those of each, from one walk: samples fill more than the caches.
fn medians(values: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    let (one, other) = values.map(|(a, b)| (in_order(a), in_order(b))).unzip();
    [one, other].map(middle)
}

fn middle(mut ordered: Vec<i64>) -> f64 {
    let middle = ordered.len() / 2;
    if ordered.is_empty() {
        return 0.0;
    }
    let key = *ordered.select_nth_unstable(middle).1;
    f64::from_bits(in_order(f64::from_bits(key as u64)) as u64)
}

/// The bits as a number that is in the order of [`f64::total_cmp`], and back: such numbers are compared in one
/// step.
fn in_order(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

fn acceleration(sample: &KinematicSample) -> f64 {
    sample.variance.acceleration - sample.variance.unseen[0]
}

fn angular_velocity(sample: &KinematicSample) -> f64 {
    sample.variance.angular_velocity - sample.variance.unseen[1]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::test_motions::{START, wrist};

    /// One sample every 10 ms with these variances of acceleration.
    fn motion(variances: &[f64]) -> Vec<KinematicSample> {
        let sample = |(k, variance): (usize, &f64)| {
            let mut sample = wrist(k as f64 * 0.01);
            sample.variance.acceleration = *variance;
            sample
        };
        variances.iter().enumerate().map(sample).collect()
    }

    fn seconds(span: &RangeInclusive<Stamp>) -> [f64; 2] {
        [span.start(), span.end()].map(|stamp| ((*stamp - START) * 100.0).round() / 100.0)
    }

    #[test]
    fn uncertain_ends_go_and_uncertain_middles_stay() {
        let mut variances = vec![1.0; 200];
        variances[..3].fill(50.0);
        variances[100] = 1000.0;
        variances[198..].fill(11.0);
        let span = Trim::Uncertain.span(&motion(&variances)).unwrap();
        assert_eq!(seconds(&span), [0.03, 1.97]);
    }

    #[test]
    fn at_most_a_quarter_of_a_second_goes() {
        let mut variances = vec![1.0; 300];
        variances[..25].fill(f64::INFINITY);
        let span = Trim::Uncertain.span(&motion(&variances)).unwrap();
        assert_eq!(seconds(&span), [0.25, 2.99]);
        let span = Trim::Uncertain.span(&motion(&variances[..100])).unwrap();
        assert_eq!(seconds(&span), [0.1, 0.99]);
    }

    #[test]
    fn a_motion_that_ends_in_a_burst_keeps_it() {
        let mut variances = vec![1.0; 300];
        variances[200..].fill(100.0);
        let span = Trim::Uncertain.span(&motion(&variances)).unwrap();
        assert_eq!(seconds(&span), [0.0, 2.99]);
    }

    #[test]
    fn nothing_goes_where_nothing_is_known_and_what_is_asked_for_goes() {
        let motion = motion(&[0.0; 100]);
        let span = Trim::Uncertain.span(&motion).unwrap();
        assert_eq!(seconds(&span), [0.0, 0.99]);
        let span = Trim::Seconds(0.2).span(&motion).unwrap();
        assert_eq!(seconds(&span), [0.2, 0.79]);
        assert_eq!(Trim::Seconds(0.5).span(&motion), None);
        assert_eq!(Trim::Uncertain.span(&[]), None);
    }
}
