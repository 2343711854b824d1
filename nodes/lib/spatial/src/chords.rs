//! Frames from poses that lie on the straight chords between them, by least squares.

use nalgebra::{UnitQuaternion, Vector3};

use crate::{PoseSeries, Stamp, so3};

/// Gauss-Newton steps: a chord of rotations is nearly linear in its ends.
const STEPS: usize = 2;
/// Added to the normal matrix's diagonal: frames between few poses stay near the straight line through
/// these, where they begin. No source for the number.
const RIDGE: f64 = 1e-6;
/// Weight of poses, in whole ones, below which a frame is left out as missing. No source.
const LEAST_SUPPORT: f64 = 0.3;

/// Frames at a steady rate, fitted to poses.
pub(crate) struct Chords {
    /// All of them, from the first pose to the last.
    frames: PoseSeries,
    /// Sum of the squared weights of the poses on each.
    support: Vec<f64>,
    /// Of the poses.
    places: Vec<Place>,
    /// Mean squares that the poses are off the chords, per axis and less what the frames take up: m2,
    /// rad2.
    pub misfit: [f64; 2],
}

/// Where a pose lies: the frame before it, and its share of the way to the next.
#[derive(Clone, Copy)]
struct Place {
    frame: usize,
    share: f64,
}

/// A frame's change: of the position, and of the rotation vector in its own axes.
type Change = [Vector3<f64>; 2];

impl Chords {
    /// Frames at `offset_s` (from 0 up to one interval) since the first pose, and every `1 / rate_hz`
    /// from there, one before it among them.
    pub fn fit(poses: &PoseSeries, rate_hz: f64, offset_s: f64) -> Self {
        let seconds = poses.seconds();
        let first = offset_s - 1.0 / rate_hz;
        let place = |seconds: &f64| {
            let position = ((seconds - first) * rate_hz).max(0.0);
            Place {
                frame: position as usize,
                share: position.fract(),
            }
        };
        let places: Vec<Place> = seconds.iter().map(place).collect();
        let count = places.last().map_or(0, |place| place.frame) + 2;
        let times: Vec<f64> = (0..count).map(|k| first + k as f64 / rate_hz).collect();
        let mut chords = Self {
            frames: between(poses, &seconds, &times),
            support: support(&places, count),
            places: places.clone(),
            misfit: [0.0; 2],
        };
        for _ in 0..STEPS {
            chords.improve(poses, &places);
        }
        let values = 3.0 * (poses.stamps.len().saturating_sub(count)).max(1) as f64;
        chords.misfit = [0, 1].map(|of| {
            let squares =
                |(k, place): (usize, &Place)| chords.off(poses, k, place)[of].norm_squared();
            places.iter().enumerate().map(squares).sum::<f64>() / values
        });
        chords
    }

    /// The frames that poses tell of.
    pub fn into_frames(self) -> PoseSeries {
        let kept = |k: &usize| self.support[*k] > LEAST_SUPPORT;
        let kept: Vec<usize> = (0..self.support.len()).filter(kept).collect();
        PoseSeries {
            stamps: kept.iter().map(|&k| self.frames.stamps[k]).collect(),
            positions: kept.iter().map(|&k| self.frames.positions[k]).collect(),
            rotations: kept.iter().map(|&k| self.frames.rotations[k]).collect(),
        }
    }

    /// The poses, each moved from its chord to the cubic through the four frames around:
    /// `- u (1 - u) (d_0 / 3 + d_1 / 6 + u (d_1 - d_0) / 6)`, with u the pose's share of the way and d the
    /// frames' second differences.
    pub fn onto_curve(&self, poses: &PoseSeries) -> PoseSeries {
        let mut curved = poses.clone();
        for (k, place) in self.places.iter().enumerate() {
            let [from, to] = [place.frame, place.frame + 1].map(|frame| self.bend(frame));
            let u = place.share;
            let moved = |of: usize| {
                let change = from[of] / 3.0 + to[of] / 6.0 + (to[of] - from[of]) * (u / 6.0);
                change * (-u * (1.0 - u))
            };
            curved.positions[k] += moved(0);
            curved.rotations[k] *= so3::exp(&moved(1));
        }
        curved
    }

    /// Second differences at a frame; zero at the ends and beside frames that no pose tells of.
    fn bend(&self, frame: usize) -> Change {
        let is_told = |k: usize| self.support.get(k).is_some_and(|own| *own > LEAST_SUPPORT);
        if frame == 0 || !(frame - 1..=frame + 1).all(is_told) {
            return [Vector3::zeros(); 2];
        }
        let PoseSeries {
            positions,
            rotations,
            ..
        } = &self.frames;
        let turn = |k: usize| so3::log(&(rotations[k].inverse() * rotations[k + 1]));
        [
            positions[frame - 1] - positions[frame] * 2.0 + positions[frame + 1],
            turn(frame) - turn(frame - 1),
        ]
    }

    /// How far a pose is off its chord.
    fn off(&self, poses: &PoseSeries, k: usize, place: &Place) -> Change {
        let (a, b) = (place.frame, place.frame + 1);
        let Self { frames, .. } = self;
        let position =
            frames.positions[a] * (1.0 - place.share) + frames.positions[b] * place.share;
        let rotation = slerp(&frames.rotations[a], &frames.rotations[b], place.share);
        [
            poses.positions[k] - position,
            so3::log(&(rotation.inverse() * poses.rotations[k])),
        ]
    }

    /// One step: `(H^T H + ridge) change = H^T off`, tridiagonal, with H the poses' shares.
    fn improve(&mut self, poses: &PoseSeries, places: &[Place]) {
        let count = self.support.len();
        let mut diagonal: Vec<f64> = self.support.iter().map(|own| own + RIDGE).collect();
        let mut beside = vec![0.0; count];
        let mut changes: Vec<Change> = vec![[Vector3::zeros(); 2]; count];
        for (k, place) in places.iter().enumerate() {
            let off = self.off(poses, k, place);
            beside[place.frame] += place.share * (1.0 - place.share);
            for (of, off) in off.iter().enumerate() {
                changes[place.frame][of] += off * (1.0 - place.share);
                changes[place.frame + 1][of] += off * place.share;
            }
        }
        // Thomas' algorithm.
        for k in 1..count {
            let factor = beside[k - 1] / diagonal[k - 1];
            diagonal[k] -= factor * beside[k - 1];
            let before = changes[k - 1];
            for (own, before) in changes[k].iter_mut().zip(before) {
                *own -= before * factor;
            }
        }
        for k in (0..count).rev() {
            let after = changes.get(k + 1).copied().unwrap_or_default();
            for (own, after) in changes[k].iter_mut().zip(after) {
                *own = (*own - after * beside[k]) / diagonal[k];
            }
        }
        for (k, [step, turn]) in changes.iter().enumerate() {
            self.frames.positions[k] += step;
            self.frames.rotations[k] *= so3::exp(turn);
        }
    }
}

fn support(places: &[Place], count: usize) -> Vec<f64> {
    let mut support = vec![0.0; count];
    for place in places {
        support[place.frame] += (1.0 - place.share).powi(2);
        support[place.frame + 1] += place.share.powi(2);
    }
    support
}

/// Poses at other times, on the straight lines between those that are there; held at the ends.
fn between(poses: &PoseSeries, seconds: &[f64], times: &[f64]) -> PoseSeries {
    let last = seconds.len() - 1;
    let mut frames = PoseSeries::default();
    for &time in times {
        let after = seconds.partition_point(|own| *own < time).clamp(1, last);
        let (from, to) = (seconds[after - 1], seconds[after]);
        let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
        let [a, b] = [after - 1, after].map(|k| (poses.positions[k], poses.rotations[k]));
        let start: Stamp = poses.stamps[0];
        frames.stamps.push(start.plus_seconds(time));
        frames.positions.push(a.0 * (1.0 - share) + b.0 * share);
        frames.rotations.push(slerp(&a.1, &b.1, share));
    }
    frames
}

/// `a exp(share log(a^-1 b))`.
fn slerp(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    a * so3::exp(&(so3::log(&(a.inverse() * b)) * share))
}
