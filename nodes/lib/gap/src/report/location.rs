//! Where a gap lies: small bars by channel, axis, frequency and time.

use std::fmt::Write;

use cromosim_charts::text::{decimals, escape, percent};

use super::markup::bar;
use super::text::axis_name;
use crate::diagnosis::{GapLocation, Interval};

/// Intervals of time beyond these are left out, the smallest shares first.
const MOST_INTERVALS: usize = 8;

/// Four groups; those without entries are left out.
pub(super) fn write_location(page: &mut String, location: &GapLocation) {
    if location.channels.is_empty()
        && location.axes.is_empty()
        && location.bands_hz.is_empty()
        && location.intervals_s.is_empty()
    {
        page.push_str(
            "<p class=\"note\">Nothing to tell: the residual is as small as the noise.</p>\n",
        );
        return;
    }
    page.push_str("<div class=\"where\">\n");
    let named = |shares: &std::collections::BTreeMap<String, f64>| {
        shares
            .iter()
            .map(|(name, share)| (escape(&axis_name(name)), *share))
            .collect::<Vec<_>>()
    };
    write_group(page, "By channel", &named(&location.channels));
    write_group(page, "By axis", &named(&location.axes));
    write_group(page, "By frequency", &ranges(&location.bands_hz, "Hz"));
    write_group(
        page,
        "By time",
        &ranges(&largest(&location.intervals_s), "s"),
    );
    page.push_str("</div>\n");
}

fn write_group(page: &mut String, title: &str, shares: &[(String, f64)]) {
    if shares.is_empty() {
        return;
    }
    let _ = writeln!(page, "<div><h4>{title}</h4>");
    for (name, share) in shares {
        let _ = writeln!(
            page,
            "<div class=\"share\"><span>{name}</span>{}<b>{}</b></div>",
            bar(*share),
            percent(*share)
        );
    }
    page.push_str("</div>\n");
}

fn ranges(intervals: &[Interval], unit: &str) -> Vec<(String, f64)> {
    let places = if intervals
        .iter()
        .all(|interval| interval.from.fract() == 0.0 && interval.to.fract() == 0.0)
    {
        0
    } else {
        1
    };
    let name = |interval: &Interval| {
        let to = if interval.to.is_finite() {
            decimals(interval.to, places)
        } else {
            "∞".to_owned()
        };
        format!("{} to {to} {unit}", decimals(interval.from, places))
    };
    intervals
        .iter()
        .map(|interval| (name(interval), interval.share))
        .collect()
}

/// The intervals with the largest shares, in order of time.
fn largest(intervals: &[Interval]) -> Vec<Interval> {
    let mut largest = intervals.to_vec();
    largest.sort_by(|one, other| other.share.total_cmp(&one.share));
    largest.truncate(MOST_INTERVALS);
    largest.sort_by(|one, other| one.from.total_cmp(&other.from));
    largest
}
