//! How often the messages of a stream come.

use cromosim_spatial::Stamp;

/// Median of the positive intervals between stamps in order of time, s; none where there is no
/// such interval.
pub(crate) fn median_period(stamps: impl IntoIterator<Item = Stamp>) -> Option<f64> {
    let mut last: Option<Stamp> = None;
    let mut intervals: Vec<f64> = stamps
        .into_iter()
        .filter_map(|stamp| last.replace(stamp).map(|last| stamp - last))
        .filter(|interval| *interval > 0.0)
        .collect();
    if intervals.is_empty() {
        return None;
    }
    let middle = intervals.len() / 2;
    Some(*intervals.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_and_repetitions_do_not_move_it() {
        let at = |seconds: &[f64]| {
            let stamps: Vec<Stamp> = seconds.iter().map(|s| Stamp::from_seconds(*s)).collect();
            median_period(stamps)
        };
        let period = at(&[0.0, 0.1, 0.2, 0.2, 0.5, 0.6]);
        assert!(period.is_some_and(|period| (period - 0.1).abs() < 1e-6));
        assert_eq!(at(&[1.0, 1.0]), None);
        assert_eq!(at(&[]), None);
    }
}
