//! Parts of a reference whose clock was set.

use cromosim_spatial::Stamp;

use crate::clock_runs::{LEAST_MESSAGES, Run, meet};
use crate::diagnosis::ClockJump;
use crate::period::median_period;
use crate::record::PlacementRecord;

/// Spans of the reference that were reached without a jump and are gone on from.
const MOST_ANCHORS: usize = 16;
/// Share of a span's time for which there must be messages where it belongs.
const LEAST_MEASURED: f64 = 0.5;

/// A span of the reference that its clock put somewhere else.
pub(crate) struct Moved {
    pub jump: ClockJump,
    /// None of stray stamps.
    pub part: Option<MovedPart>,
}

/// What is diagnosed of a moved span.
pub(crate) struct MovedPart {
    /// With what is taken off the stamp of each, s.
    pub messages: Vec<(usize, f64)>,
    pub span: [Stamp; 2],
    /// To be taken off the span's stamps, s.
    pub jumped_s: f64,
}

/// A place where a span would be due.
#[derive(Clone, Copy)]
struct Due {
    /// The last stamp before the jump.
    at: Stamp,
    by_s: f64,
    /// What has to be taken off the span's stamps, s.
    jumped_s: f64,
}

/// Spans of the reference where no message is, though messages are where its clock would have gone
/// on; and stray stamps. Other spans without messages were not measured.
pub(crate) fn reference_jumps(
    record: &PlacementRecord,
    spans: &[[Stamp; 2]],
    runs: &[Run],
    period_s: f64,
) -> Vec<Moved> {
    let used = used(spans, runs);
    let anchors: Vec<[Stamp; 2]> = of(spans, &used, true).take(MOST_ANCHORS).collect();
    let poses = &record.reference.stamps;
    let pose_period_s = median_period(poses.iter().copied()).unwrap_or(0.0);
    let mut uncovered = uncovered(record, spans, runs);
    let mut found = Vec::new();
    for span in of(spans, &used, false) {
        let count = poses.partition_point(|stamp| *stamp <= span[1])
            - poses.partition_point(|stamp| *stamp < span[0]);
        let all = anchors
            .iter()
            .flat_map(|anchor| due_beside(*anchor, span, pose_period_s));
        let messages_at = |due: &Due| {
            let place = |stamp: Stamp| {
                let stamp = stamp.plus_seconds(-due.jumped_s);
                uncovered.partition_point(|(other, _)| *other < stamp)
            };
            place(span[0])..place(span[1])
        };
        if count < LEAST_MESSAGES {
            let nearest = all.min_by(|a, b| a.by_s.abs().total_cmp(&b.by_s.abs()));
            found.extend(nearest.map(|due| moved(due, count, None)));
            continue;
        }
        let Some(due) = all.rev().max_by_key(|due| messages_at(due).len()) else {
            continue;
        };
        let own = messages_at(&due);
        let least = LEAST_MEASURED * (span[1] - span[0]) / period_s;
        if own.len() >= LEAST_MESSAGES && own.len() as f64 >= least {
            let messages = uncovered.drain(own).map(|(_, message)| message).collect();
            let part = MovedPart {
                messages,
                span,
                jumped_s: due.jumped_s,
            };
            found.push(moved(due, count, Some(part)));
        }
    }
    found
}

fn moved(due: Due, poses: usize, part: Option<MovedPart>) -> Moved {
    let jump = ClockJump {
        clock: "reference".to_owned(),
        at: due.at.as_seconds(),
        by: due.by_s,
        messages: poses,
        diagnosed: part.is_some(),
        recording: String::new(),
    };
    Moved { jump, part }
}

/// After another span, or before it.
fn due_beside(anchor: [Stamp; 2], span: [Stamp; 2], pose_period_s: f64) -> [Due; 2] {
    let later_s = span[0] - anchor[1].plus_seconds(pose_period_s);
    let earlier_s = span[1] - anchor[0].plus_seconds(-pose_period_s);
    [
        Due {
            at: anchor[1],
            by_s: later_s,
            jumped_s: later_s,
        },
        Due {
            at: span[1],
            by_s: -earlier_s,
            jumped_s: earlier_s,
        },
    ]
}

/// The spans that are used, or those that are not.
fn of<'s>(
    spans: &'s [[Stamp; 2]],
    used: &'s [bool],
    wanted: bool,
) -> impl Iterator<Item = [Stamp; 2]> + 's {
    let pairs = spans.iter().zip(used);
    pairs
        .filter(move |(_, used)| **used == wanted)
        .map(|(span, _)| *span)
}

/// Which spans hold messages.
fn used(spans: &[[Stamp; 2]], runs: &[Run]) -> Vec<bool> {
    let mut used = vec![false; spans.len()];
    for run in runs {
        let Some(jumped_s) = run.jumped_s else {
            continue;
        };
        let own = run.undone(jumped_s);
        let first = spans.partition_point(|span| span[1] < own[0]);
        let met = |place: &usize| spans.get(*place).is_some_and(|span| meet(*span, own));
        (first..)
            .take_while(met)
            .for_each(|place| used[place] = true);
    }
    used
}

/// Messages outside all spans once jumps of their own clock are undone, by what their stamps are then;
/// each with its place and what is taken off.
fn uncovered(
    record: &PlacementRecord,
    spans: &[[Stamp; 2]],
    runs: &[Run],
) -> Vec<(Stamp, (usize, f64))> {
    let mut uncovered = Vec::new();
    for run in runs {
        let Some(jumped_s) = run.jumped_s else {
            continue;
        };
        for &message in &run.messages {
            let stamp = record.imu.stamps[message].plus_seconds(-jumped_s);
            let next = spans.partition_point(|span| span[1] < stamp);
            if spans.get(next).is_none_or(|span| stamp < span[0]) {
                uncovered.push((stamp, (message, jumped_s)));
            }
        }
    }
    uncovered.sort_unstable_by_key(|(stamp, (message, _))| (*stamp, *message));
    uncovered
}
