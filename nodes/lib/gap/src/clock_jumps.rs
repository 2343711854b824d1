//! Clocks that were set while they recorded: the parts of a recording between, and what is said of
//! the jumps.

use cromosim_spatial::Stamp;

use crate::clock_runs::{Run, runs, set_between, undo_jumps};
use crate::diagnosis::ClockJump;
use crate::period::median_period;
use crate::record::{MeasuredField, MeasuredImu, PlacementRecord, PoseSeries};
use crate::reference_jumps::{Moved, reference_jumps};

/// Nothing is laid over a longer pause, s: its two sides are parts of their own, so that what is
/// diagnosed takes memory for what was measured alone.
const LONGEST_PAUSE_S: f64 = 600.0;
/// Poses on either side of a part's messages that belong to it, s: what clocks and fits may differ by.
const BESIDE_S: f64 = 30.0;
/// The longest so many parts are diagnosed: each costs a search's time.
const MOST_PARTS: usize = 16;

/// A record in parts, each with one clock, and what was found between them.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// None where the record is one part as it is.
    pub parts: Option<Vec<PlacementRecord>>,
    pub jumps: Vec<ClockJump>,
}

/// What a part is made of.
struct Pieces {
    /// Messages, and what is taken off the stamp of each, s.
    messages: Vec<(usize, f64)>,
    /// The reference from one stamp to another, and what is taken off them, s.
    reference: ([Stamp; 2], f64),
}

/// Takes a record apart where a clock jumps.
pub(crate) fn parts(record: &PlacementRecord) -> Parts {
    let stamps = &record.imu.stamps;
    let Some(period_s) = median_period(stamps.iter().copied()) else {
        return Parts::default();
    };
    let spans = reference_spans(&record.reference.stamps);
    let mut runs = runs(stamps);
    if runs.len() < 2 && spans.len() < 2 {
        return Parts::default();
    }
    undo_jumps(record, &mut runs, &spans, period_s);
    let kept = together(&runs, period_s);
    let mut moved = reference_jumps(record, &spans, &runs, period_s);
    moved.truncate(MOST_PARTS);
    let is_whole = runs.iter().all(|run| run.jumped_s.is_some());
    if kept.is_empty() || (kept.len() == 1 && is_whole && spans.len() < 2) {
        return Parts::default();
    }
    let mut is_kept = vec![false; runs.len()];
    kept.iter().flatten().for_each(|&run| is_kept[run] = true);
    let restored = restored(&runs, &is_kept, stamps, period_s);
    let mut jumps = imu_jumps(&runs, &is_kept, &restored, stamps, period_s);
    let of_runs = |part: &Vec<usize>| pieces_of(part, &runs, &restored);
    let mut pieces: Vec<Pieces> = kept.iter().map(of_runs).collect();
    for Moved { jump, part } in moved {
        jumps.push(jump);
        pieces.extend(part.map(|part| Pieces {
            messages: part.messages,
            reference: (part.span, part.jumped_s),
        }));
    }
    let count = pieces.len();
    let part = |(index, pieces): (usize, &Pieces)| {
        let name = match count {
            1 => record.name.clone(),
            _ => format!("{}, part {}", record.name, index + 1),
        };
        cut_out(record, name, pieces)
    };
    Parts {
        parts: Some(pieces.iter().enumerate().map(part).collect()),
        jumps,
    }
}

/// First and last stamp of the reference between its long pauses.
fn reference_spans(stamps: &[Stamp]) -> Vec<[Stamp; 2]> {
    let mut spans: Vec<[Stamp; 2]> = Vec::new();
    for &stamp in stamps {
        match spans.last_mut() {
            Some(span) if stamp - span[1] <= LONGEST_PAUSE_S => span[1] = stamp,
            _ => spans.push([stamp; 2]),
        }
    }
    spans
}

/// The runs that are diagnosed, those of one clock together that no long pause parts.
fn together(runs: &[Run], period_s: f64) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        if run.jumped_s.is_none() {
            continue;
        }
        let goes_on = |before: &usize| {
            let pause_s = run.first - runs[*before].last;
            runs[*before].jumped_s == run.jumped_s && (0.0..=LONGEST_PAUSE_S).contains(&pause_s)
        };
        match parts.last_mut() {
            Some(part) if part.last().is_some_and(goes_on) => part.push(index),
            _ => parts.push(vec![index]),
        }
    }
    parts.retain(|part| part.iter().any(|run| runs[*run].is_part(period_s)));
    let messages = |part: &Vec<usize>| part.iter().map(|run| runs[*run].messages.len()).sum();
    let mut lengths: Vec<usize> = parts.iter().map(messages).collect();
    lengths.sort_unstable_by(|a, b| b.cmp(a));
    if let Some(&least) = lengths.get(MOST_PARTS - 1) {
        parts.retain(|part| messages(part) >= least);
        parts.truncate(MOST_PARTS);
    }
    parts
}

/// Some runs, with the reference beside them, and messages with stray stamps between theirs.
fn pieces_of(part: &[usize], runs: &[Run], restored: &[Restored]) -> Pieces {
    let own = || part.iter().map(|run| &runs[*run]);
    let jumped_s = own().find_map(|run| run.jumped_s).unwrap_or(0.0);
    let undone = || own().flat_map(|run| run.undone(jumped_s));
    let first = undone().min().unwrap_or_default();
    let last = undone().max().unwrap_or_default();
    let messages = own().flat_map(|run| run.messages.iter().map(|message| (*message, jumped_s)));
    let stray = restored.iter().filter(|stray| part.contains(&stray.run));
    let stray = stray.map(|stray| (stray.message, stray.off_s + jumped_s));
    Pieces {
        messages: messages.chain(stray).collect(),
        reference: (
            [first.plus_seconds(-BESIDE_S), last.plus_seconds(BESIDE_S)],
            0.0,
        ),
    }
}

fn cut_out(record: &PlacementRecord, name: String, pieces: &Pieces) -> PlacementRecord {
    let poses = &record.reference;
    let ([first, last], jumped_s) = pieces.reference;
    let from = poses.stamps.partition_point(|stamp| *stamp < first);
    let to = poses.stamps.partition_point(|stamp| *stamp <= last);
    let undone =
        |(message, jumped_s): &(usize, f64)| record.imu.stamps[*message].plus_seconds(-jumped_s);
    let messages = pieces.messages.iter();
    PlacementRecord {
        name,
        reference: PoseSeries {
            stamps: poses.stamps[from..to]
                .iter()
                .map(|stamp| stamp.plus_seconds(-jumped_s))
                .collect(),
            positions: poses.positions[from..to].to_vec(),
            rotations: poses.rotations[from..to].to_vec(),
        },
        imu: MeasuredImu {
            stamps: messages.clone().map(undone).collect(),
            readings: messages
                .map(|(message, _)| record.imu.readings[*message])
                .collect(),
            declared: record.imu.declared,
        },
        set_back: Vec::new(),
        field: MeasuredField::default(),
    }
}

/// A message with a stray stamp that came between two of a run which are as far apart as if it had
/// its place there.
struct Restored {
    message: usize,
    run: usize,
    /// What its stamp is off, by the run's clock, s.
    off_s: f64,
}

/// What came between messages of runs that are diagnosed.
fn restored(runs: &[Run], is_kept: &[bool], stamps: &[Stamp], period_s: f64) -> Vec<Restored> {
    let mut stray = vec![true; stamps.len()];
    let kept = || (0..runs.len()).filter(|run| is_kept[*run]);
    let of_kept = kept().flat_map(|run| &runs[run].messages);
    of_kept.for_each(|message| stray[*message] = false);
    let mut restored = Vec::new();
    for run in kept() {
        for pair in runs[run].messages.windows(2) {
            let (before, next) = (pair[0], pair[1]);
            let steps = (stamps[next] - stamps[before]) / period_s;
            let between = before + 1..next;
            let fits = (steps - (next - before) as f64).abs() < 0.5;
            if !between.is_empty() && fits && stray[between.clone()].iter().all(|stray| *stray) {
                let step_s = (stamps[next] - stamps[before]) / (next - before) as f64;
                restored.extend(between.map(|message| {
                    let due = stamps[before].plus_seconds(step_s * (message - before) as f64);
                    Restored {
                        message,
                        run,
                        off_s: stamps[message] - due,
                    }
                }));
            }
        }
    }
    restored
}

/// The jumps between runs: of those that are diagnosed how far their clock was set, of stray stamps
/// between them how far the first of these lies off.
fn imu_jumps(
    runs: &[Run],
    is_kept: &[bool],
    restored: &[Restored],
    stamps: &[Stamp],
    period_s: f64,
) -> Vec<ClockJump> {
    let mut is_restored = vec![false; stamps.len()];
    let strays = restored.iter();
    strays.for_each(|stray| is_restored[stray.message] = true);
    let mut jumps: Vec<ClockJump> = Vec::new();
    let mut last: Option<&Run> = None;
    let mut strays: Option<ClockJump> = None;
    let first_kept = runs.iter().zip(is_kept).find(|(_, kept)| **kept);
    let first_kept = first_kept.map(|(run, _)| run);
    for (run, &is_kept) in runs.iter().zip(is_kept) {
        let by = match (last, run.jumped_s, first_kept) {
            (Some(last), Some(own), _) => own - last.jumped_s.unwrap_or(0.0),
            (Some(last), None, _) => set_between(last, run, stamps, period_s),
            (None, _, Some(next)) if !is_kept => -set_between(run, next, stamps, period_s),
            _ => 0.0,
        };
        let jump = ClockJump {
            clock: "imu".to_owned(),
            at: last.map_or(run.first, |last| last.last).as_seconds(),
            by,
            messages: run.messages.len(),
            diagnosed: run.messages.iter().all(|m| is_kept || is_restored[*m]),
            recording: String::new(),
        };
        if is_kept {
            jumps.extend(strays.take());
            if by.abs() > period_s {
                jumps.push(jump);
            }
            // A stray run of the same clock stands where it was.
            last = Some(run);
        } else if let Some(strays) = &mut strays {
            strays.messages += jump.messages;
            strays.diagnosed &= jump.diagnosed;
        } else {
            strays = Some(jump);
        }
    }
    jumps.extend(strays);
    jumps
}

#[cfg(test)]
#[path = "clock_jumps_tests.rs"]
mod tests;
