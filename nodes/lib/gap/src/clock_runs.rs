//! Runs of messages whose stamps follow each other, and what was added to the clock of each.
//!
//! A message's stamp follows the one before it within moments. Where it does not, either nothing was
//! sent meanwhile (a pause), or the clock was set. The reference tells: stamps that lie beside it,
//! but within it once the jump is undone, are those of a clock that was set; where both lie within,
//! the motion tells ([`SameMotion`]).

use cromosim_spatial::Stamp;

use crate::record::PlacementRecord;
use crate::same_motion::SameMotion;

/// Stamps that go on so much later are looked at, s: buffers and radios hold messages back for less.
const FORWARD_S: f64 = 10.0;
/// Stamps that go on so much earlier, s: messages overtake each other by less.
const BACKWARD_S: f64 = 1.0;
/// Fewer messages are no part: stray stamps.
pub(crate) const LEAST_MESSAGES: usize = 50;
/// A stamp belongs to one of so many runs that were last gone on with: stray stamps between those of
/// a clock do not end its run, and memory stays bounded whatever the stamps are.
const OPEN_RUNS: usize = 8;
/// Messages of a run that has less of the time that they take are stamped by no clock.
const LEAST_TIME: f64 = 0.25;

/// Messages whose stamps follow each other.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Their places, in the order in which they came; at least one.
    pub messages: Vec<usize>,
    /// To be taken off the stamps, s; none where the run lies beside the reference whatever is done.
    pub jumped_s: Option<f64>,
    /// By stamps.
    pub first: Stamp,
    pub last: Stamp,
}

impl Run {
    /// From the first message to the last by the clock of the others.
    pub fn undone(&self, jumped_s: f64) -> [Stamp; 2] {
        [self.first, self.last].map(|stamp| stamp.plus_seconds(-jumped_s))
    }

    /// Whether a clock went on in it for long enough to be diagnosed.
    pub fn is_part(&self, period_s: f64) -> bool {
        let count = self.messages.len();
        count >= LEAST_MESSAGES && self.last - self.first >= LEAST_TIME * period_s * count as f64
    }
}

/// Where stamps follow each other, in the order in which the first message of each came.
pub(crate) fn runs(stamps: &[Stamp]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    // The last one that was gone on with stands last.
    let mut open: Vec<usize> = Vec::new();
    for (message, &stamp) in stamps.iter().enumerate() {
        let goes_on = |run: &usize| {
            let on_s = stamp - runs[*run].last;
            (-BACKWARD_S..=FORWARD_S).contains(&on_s)
        };
        if let Some(place) = open.iter().rposition(goes_on) {
            let own = open.remove(place);
            let run = &mut runs[own];
            run.messages.push(message);
            run.first = run.first.min(stamp);
            run.last = run.last.max(stamp);
            open.push(own);
            continue;
        }
        if open.len() == OPEN_RUNS {
            open.remove(0);
        }
        open.push(runs.len());
        runs.push(Run {
            messages: vec![message],
            jumped_s: None,
            first: stamp,
            last: stamp,
        });
    }
    runs
}

/// Whether two spans of time meet.
pub(crate) fn meet(one: [Stamp; 2], other: [Stamp; 2]) -> bool {
    one[0] <= other[1] && other[0] <= one[1]
}

/// How much further the clock of `later` is than that of `earlier`, s, whose first message came
/// before: each message between them took a period.
pub(crate) fn set_between(earlier: &Run, later: &Run, stamps: &[Stamp], period_s: f64) -> f64 {
    let next = later.messages[0];
    let place = earlier.messages.partition_point(|message| *message < next);
    let before = earlier.messages[place.max(1) - 1];
    stamps[next] - stamps[before].plus_seconds(period_s * next.saturating_sub(before) as f64)
}

/// Finds what was added to the clock of each run, from the longest that reads what the reference
/// does at its stamps onwards and backwards. `spans` are those of the reference, in the order of time.
pub(crate) fn undo_jumps(
    record: &PlacementRecord,
    runs: &mut [Run],
    spans: &[[Stamp; 2]],
    period_s: f64,
) {
    let within = |own: [Stamp; 2]| {
        let next = spans.partition_point(|span| span[1] < own[0]);
        spans.get(next).is_some_and(|span| meet(*span, own))
    };
    let motion = SameMotion::new(record);
    let anchors = (0..runs.len())
        .filter(|&index| runs[index].is_part(period_s) && within(runs[index].undone(0.0)));
    let anchor = anchors.rev().max_by_key(|&index| {
        let messages = &runs[index].messages;
        (motion.is_seen(messages), messages.len())
    });
    let Some(anchor) = anchor else { return };
    runs[anchor].jumped_s = Some(0.0);
    let stamps = &record.imu.stamps;
    let orders: [Vec<usize>; 2] = [
        (anchor + 1..runs.len()).collect(),
        (0..anchor).rev().collect(),
    ];
    for (order, is_later) in orders.into_iter().zip([true, false]) {
        let mut beside = anchor;
        for index in order {
            let (run, other) = (&runs[index], &runs[beside]);
            let set_s = other.jumped_s.unwrap_or(0.0);
            let on_s = if is_later {
                set_s + set_between(other, run, stamps, period_s)
            } else {
                set_s - set_between(run, other, stamps, period_s)
            };
            let [begin, end] = other.undone(set_s);
            let follows = |jumped_s: f64| {
                let [first, last] = run.undone(jumped_s);
                if is_later { first > end } else { last < begin }
            };
            // The same clock after a pause, the reference's, or one that was set.
            let mut candidates: Vec<f64> = Vec::new();
            let is_part = run.is_part(period_s);
            for (jumped_s, can_be) in [
                (set_s, follows(set_s)),
                (0.0, follows(0.0)),
                (on_s, is_part),
            ] {
                let is_new = |other: &f64| (jumped_s - other).abs() > 2.0 * period_s;
                if can_be && within(run.undone(jumped_s)) && candidates.iter().all(is_new) {
                    candidates.push(jumped_s);
                }
            }
            runs[index].jumped_s = motion.best(&runs[index].messages, &candidates);
            if is_part && runs[index].jumped_s.is_some() {
                beside = index;
            }
        }
    }
}
