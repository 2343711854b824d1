//! A recording as the search looks at it: readings at a high rate are thinned.

use std::sync::Arc;

use cromosim_spatial::Stamp;

use crate::policy::search::SEARCH_HZ;
use crate::prepared::PreparedPlacement;
use crate::session::Session;

/// Every so many entries of the sample grid that at least [`SEARCH_HZ`] are left.
fn stride(rate_hz: f64) -> usize {
    (rate_hz / SEARCH_HZ) as usize
}

/// The recording with every k-th entry of its sample grid; none where that is every one.
///
/// What the readings hold above half of the lower rate folds onto what is below: noise stays noise
/// of the same variance per sample, a vibration becomes another one.
pub(crate) fn thinned(session: &Session) -> Option<Session> {
    let stride = stride(session.prepared.rate_hz);
    (stride > 1).then(|| {
        let all = &session.prepared;
        let kept: Vec<usize> = (0..all.stamps.len())
            .filter(|&k| all.grid_index[k].is_multiple_of(stride))
            .collect();
        let prepared = PreparedPlacement {
            stamps: kept.iter().map(|&k| all.stamps[k]).collect::<Vec<Stamp>>(),
            measured: kept.iter().map(|&k| all.measured[k]).collect(),
            usable: kept.iter().map(|&k| all.usable[k]).collect(),
            grid_index: kept.iter().map(|&k| all.grid_index[k] / stride).collect(),
            length: (all.length - 1) / stride + 1,
            rate_hz: all.rate_hz / stride as f64,
            name: all.name.clone(),
            estimate: all.estimate.clone(),
            interpolated: all.interpolated.clone(),
            noise_behind_frames: all.noise_behind_frames,
            ..*all
        };
        Session {
            track: Arc::new(prepared.track(&prepared.estimate)),
            raw: kept.iter().map(|&k| session.raw[k]).collect(),
            covered: kept.iter().map(|&k| session.covered[k]).collect(),
            prepared,
            starts: session.starts.clone(),
            ..*session
        }
    })
}

/// Whether a line at a frequency is a line of another frequency in the thinned recording.
pub(crate) fn is_folded(session: &Session, line_hz: f64) -> bool {
    let rate_hz = session.prepared.rate_hz;
    line_hz > 0.5 * rate_hz / stride(rate_hz).max(1) as f64
}
