//! Which frames the shape is fitted to: well seen, and unlike each other.

use nalgebra::Vector3;

use super::start::fit_rigid;

/// Frames that are looked at.
const CANDIDATES: usize = 400;

/// At most `count` frame indices, ascending. Of evenly spread frames those are kept that lack at
/// most a tenth more of the markers than the best; then, beginning with the best seen, the frame is
/// taken that is least like all taken before (farthest-point choice; the distance is the root mean
/// square over common markers after a rigid fit).
pub(super) fn choose(frames: &[Vec<Option<Vector3<f64>>>], count: usize) -> Vec<usize> {
    let step = frames.len().div_ceil(CANDIDATES).max(1);
    let seen = |frame: &[Option<Vector3<f64>>]| frame.iter().flatten().count();
    let most = frames
        .iter()
        .step_by(step)
        .map(|frame| seen(frame))
        .max()
        .unwrap_or(0);
    let mut candidates: Vec<usize> = (0..frames.len())
        .step_by(step)
        .filter(|&index| seen(&frames[index]) * 10 >= most * 9)
        .collect();
    // The first of equals.
    let Some(first) = candidates
        .iter()
        .copied()
        .max_by_key(|&index| (seen(&frames[index]), usize::MAX - index))
    else {
        return Vec::new();
    };
    let mut chosen = vec![first];
    let mut nearest: Vec<f64> = vec![f64::MAX; candidates.len()];
    candidates.retain(|&index| index != first);
    nearest.truncate(candidates.len());
    let mut latest = first;
    while chosen.len() < count && !candidates.is_empty() {
        for (distance, &index) in nearest.iter_mut().zip(&candidates) {
            *distance = distance.min(unlikeness(&frames[index], &frames[latest]));
        }
        let Some(farthest) =
            (0..candidates.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]))
        else {
            break;
        };
        latest = candidates.swap_remove(farthest);
        nearest.swap_remove(farthest);
        chosen.push(latest);
    }
    chosen.sort_unstable();
    chosen
}

/// Root mean square distance of the common markers after a rigid fit, m; 0 where it cannot be told.
fn unlikeness(left: &[Option<Vector3<f64>>], right: &[Option<Vector3<f64>>]) -> f64 {
    let pairs: Vec<_> = left
        .iter()
        .zip(right)
        .filter_map(|(a, b)| a.zip(*b))
        .collect();
    if pairs.len() < 3 {
        return 0.0;
    }
    let Some((turn, shift)) = fit_rigid(&pairs) else {
        return 0.0;
    };
    let squares: f64 = pairs
        .iter()
        .map(|(a, b)| (turn * a + shift - b).norm_squared())
        .sum();
    (squares / pairs.len() as f64).sqrt()
}
