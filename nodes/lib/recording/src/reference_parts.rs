//! A reference with pauses so long, or stamps so far off, that no motion is laid over them.

use cromosim_imu::SensorFrame;
use cromosim_spatial::Stamp;

use crate::RecordedPlacement;

/// Nothing is laid over a longer pause, s, as in a diagnosis.
const LONGEST_PAUSE_S: f64 = 600.0;
/// Fewer poses between two such pauses have stray stamps.
const LEAST_POSES: usize = 50;

/// The reference between its long pauses, each with the messages next to it and their places; none
/// where there is no such pause, or nothing was measured.
pub(crate) fn parts(placement: &RecordedPlacement) -> Option<Vec<(RecordedPlacement, Vec<usize>)>> {
    let frames = &placement.frames;
    let is_together = |a: &SensorFrame, b: &SensorFrame| b.stamp - a.stamp <= LONGEST_PAUSE_S;
    let mut stretches: Vec<&[SensorFrame]> = frames.chunk_by(is_together).collect();
    if stretches.len() < 2 || placement.measured.is_empty() {
        return None;
    }
    if stretches.iter().any(|poses| poses.len() >= LEAST_POSES) {
        stretches.retain(|poses| poses.len() >= LEAST_POSES);
    }
    let mut places = vec![Vec::new(); stretches.len()];
    for (place, stamp) in placement.measured_stamps().enumerate() {
        places[nearest(&stretches, stamp)].push(place);
    }
    let part = |(poses, places): (&[SensorFrame], Vec<usize>)| {
        let measured = places.iter().map(|place| &placement.measured[*place]);
        let part = RecordedPlacement {
            name: placement.name.clone(),
            frames: poses.to_vec(),
            measured: measured.cloned().collect(),
            notes: Vec::new(),
            set_back: Vec::new(),
            magnetic: Vec::new(),
        };
        (!places.is_empty()).then_some((part, places))
    };
    Some(stretches.into_iter().zip(places).filter_map(part).collect())
}

/// The stretch that a stamp lies in, or next to.
fn nearest(stretches: &[&[SensorFrame]], stamp: Stamp) -> usize {
    let beside_s = |place: usize| {
        let poses = stretches[place];
        (poses[0].stamp - stamp).max(stamp - poses[poses.len() - 1].stamp)
    };
    let next = stretches.partition_point(|poses| poses[poses.len() - 1].stamp < stamp);
    let last = next.saturating_sub(1);
    if next == stretches.len() || beside_s(last) < beside_s(next) {
        last
    } else {
        next
    }
}
