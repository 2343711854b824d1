//! From frame to frame, with the person known.
//!
//! Frames are cut into chunks of a fixed length, which run in parallel: each begins on its own and
//! goes on from frame to frame, with some frames of its neighbours on both sides, so that its first
//! and last frame have a past and a future. Sweeps back and forth then improve every frame with
//! both of its neighbours; a last pass over all frames smooths the seams. What comes out depends on
//! the frames alone, not on the number of threads.

use cromosim_body::{BodyPose, JOINT_COUNT};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::frame::{Expected, Terms, solve};
use super::prior::PosePrior;
use super::skin::ShapedSkin;
use super::start::{cold_start, placed};
use crate::motion::slerp;

/// Frames of a chunk.
const CHUNK: usize = 240;
/// Frames before and after a chunk that only lead into it.
const MARGIN: usize = 24;
/// Steps of a frame that follows another one, and in the second pass.
const STEPS: usize = 6;
const STEPS_AGAIN: usize = 2;
const PRIOR_WEIGHT: f64 = 0.25;
const HUBER_M: f64 = 0.003;
/// Share of a joint's turn from frame to frame that the next frame is expected to have.
const PERSISTENCE: f64 = 0.9;
/// How far the root departs from what its past promises within a frame of 120 Hz, rad and m.
const TURN_SIGMA: f64 = 0.05;
const POSITION_SIGMA_M: f64 = 0.005;
/// The same of the other joints, as a share of the prior's standard deviation.
const TURN_SHARE: f64 = 0.1;
/// Frames with fewer markers stand between their neighbours, and a body that was lost is found
/// again by as many.
const FEWEST_MARKERS: usize = 6;

/// Everything that is the same for all frames.
pub(super) struct Tracker<'a> {
    pub skin: &'a ShapedSkin<'a>,
    pub prior: &'a PosePrior,
    pub trunk: &'a [bool],
    pub rate_hz: f64,
    /// Poses of the keyframes.
    pub known: &'a [BodyPose],
}

impl Tracker<'_> {
    /// A pose for every frame.
    pub fn track(&self, frames: &[Vec<Option<Vector3<f64>>>]) -> Vec<BodyPose> {
        let chunk = |number: usize| {
            let (first, end) = (number * CHUNK, ((number + 1) * CHUNK).min(frames.len()));
            let (lead, tail) = (
                first.saturating_sub(MARGIN),
                (end + MARGIN).min(frames.len()),
            );
            let mut poses = self.chunk(&frames[lead..tail]);
            bridge(&mut poses, |index| {
                seen(&frames[lead + index]) < FEWEST_MARKERS
            });
            for backwards in [true, false] {
                self.sweep(&frames[lead..tail], &mut poses, backwards);
            }
            poses.truncate(end - lead);
            poses.split_off(first - lead)
        };
        let mut poses: Vec<BodyPose> = (0..frames.len().div_ceil(CHUNK))
            .into_par_iter()
            .flat_map_iter(chunk)
            .collect();
        bridge(&mut poses, |index| seen(&frames[index]) < FEWEST_MARKERS);
        (0..frames.len())
            .into_par_iter()
            .map(|index| self.again(frames, &poses, index))
            .collect()
    }

    /// Every frame anew, with both of its neighbours as they are by then: what comes later in the
    /// sweep's direction is told to all before.
    fn sweep(&self, frames: &[Vec<Option<Vector3<f64>>>], poses: &mut [BodyPose], backwards: bool) {
        for step in 0..frames.len() {
            let index = if backwards {
                frames.len() - 1 - step
            } else {
                step
            };
            poses[index] = self.again(frames, poses, index);
        }
    }

    /// Begins at the best seen of the first frames, and goes from there to both ends.
    fn chunk(&self, frames: &[Vec<Option<Vector3<f64>>>]) -> Vec<BodyPose> {
        // The first of equals.
        let start = (0..frames.len().min(MARGIN))
            .max_by_key(|&index| (seen(&frames[index]), usize::MAX - index))
            .unwrap_or(0);
        let observed = frames.get(start).map_or(&[][..], |frame| frame);
        let fallback = || {
            self.known
                .first()
                .cloned()
                .unwrap_or_else(|| self.prior.mean_pose())
        };
        let pose = cold_start(self.skin, observed, self.trunk, self.prior, self.known)
            .unwrap_or_else(fallback);
        let mut poses = vec![pose; frames.len()];
        self.follow(frames, &mut poses, start + 1..frames.len(), false);
        self.follow(frames, &mut poses, 0..start, true);
        poses
    }

    /// From the frame before the range (after it, where backwards) through the range, each frame
    /// from those before it.
    fn follow(
        &self,
        frames: &[Vec<Option<Vector3<f64>>>],
        poses: &mut [BodyPose],
        range: std::ops::Range<usize>,
        backwards: bool,
    ) {
        let indices: Vec<usize> = if backwards {
            range.clone().rev().collect()
        } else {
            range.clone().collect()
        };
        for (step, &index) in indices.iter().enumerate() {
            let back = |count: usize| {
                if backwards {
                    index + count
                } else {
                    index - count
                }
            };
            let (last, frame) = (back(1), &frames[index]);
            let before = if step > 0 {
                Some(&poses[back(2)])
            } else {
                None
            };
            // A body that was lost is looked for anew once it can be seen again.
            let lost = seen(&frames[last]) < 3 && seen(frame) >= FEWEST_MARKERS;
            let found = if lost {
                placed(self.skin, frame, self.trunk, &poses[last])
            } else {
                None
            };
            poses[index] = match found {
                Some(pose) => solve(self.skin, frame, &self.terms(None), pose, STEPS).0,
                None => {
                    let expected = self.expected(extrapolated(&poses[last], before), 1.0);
                    solve(
                        self.skin,
                        frame,
                        &self.terms(Some(&expected)),
                        expected.pose.clone(),
                        STEPS,
                    )
                    .0
                }
            };
        }
    }

    fn terms<'a>(&'a self, expected: Option<&'a Expected>) -> Terms<'a> {
        Terms {
            prior: self.prior,
            prior_weight: PRIOR_WEIGHT,
            huber_m: HUBER_M,
            expected,
        }
    }

    fn expected(&self, pose: BodyPose, share: f64) -> Expected {
        // Departures are accelerations: they grow with the square of the time between frames.
        let slower = (120.0 / self.rate_hz).powi(2);
        Expected {
            pose,
            turn_precisions: std::array::from_fn(|joint| {
                // A joint that bends little turns slowly, too; the root turns as it likes.
                let usual = if joint == 0 {
                    Vector3::repeat(TURN_SIGMA.powi(-2))
                } else {
                    self.prior.precisions[joint] / (TURN_SHARE * TURN_SHARE)
                };
                usual / (share * slower).powi(2).clamp(1e-3, 1e3)
            }),
            position_sigma_m: (share * POSITION_SIGMA_M * slower).clamp(1e-4, 1.0),
        }
    }

    /// The second pass: what both neighbours promise, half as far off as what one does.
    fn again(
        &self,
        frames: &[Vec<Option<Vector3<f64>>>],
        poses: &[BodyPose],
        index: usize,
    ) -> BodyPose {
        let own = poses[index].clone();
        let Some((before, after)) = index
            .checked_sub(1)
            .and_then(|before| Some((&poses[before], poses.get(index + 1)?)))
        else {
            return own;
        };
        let middle = BodyPose {
            root_position: (before.root_position + after.root_position) / 2.0,
            local_rotations: std::array::from_fn(|joint| {
                slerp(
                    &before.local_rotations[joint],
                    &after.local_rotations[joint],
                    0.5,
                )
            }),
        };
        solve(
            self.skin,
            &frames[index],
            &self.terms(Some(&self.expected(middle, 0.5))),
            own,
            STEPS_AGAIN,
        )
        .0
    }
}

/// Frames that are `unknown` go evenly from the last known one to the next; at either end they stay
/// at the nearest.
fn bridge(poses: &mut [BodyPose], unknown: impl Fn(usize) -> bool) {
    let known: Vec<usize> = (0..poses.len()).filter(|&index| !unknown(index)).collect();
    for index in (0..poses.len()).filter(|&index| unknown(index)) {
        let next = known.partition_point(|&other| other < index);
        let before = next.checked_sub(1).and_then(|place| known.get(place));
        let (Some(&from), Some(&to)) = (before.or(known.first()), known.get(next).or(known.last()))
        else {
            return;
        };
        let share = if from == to {
            0.0
        } else {
            (index - from) as f64 / (to - from) as f64
        };
        poses[index] = BodyPose {
            root_position: poses[from]
                .root_position
                .lerp(&poses[to].root_position, share),
            local_rotations: std::array::from_fn(|joint| {
                slerp(
                    &poses[from].local_rotations[joint],
                    &poses[to].local_rotations[joint],
                    share,
                )
            }),
        };
    }
}

/// Markers seen in a frame.
fn seen(frame: &[Option<Vector3<f64>>]) -> usize {
    frame.iter().flatten().count()
}

/// The pose after `pose` if it goes on as it came from `before`, a little slower.
fn extrapolated(pose: &BodyPose, before: Option<&BodyPose>) -> BodyPose {
    let Some(before) = before else {
        return pose.clone();
    };
    let rotation = |joint: usize| {
        let way = (before.local_rotations[joint].inverse() * pose.local_rotations[joint])
            .scaled_axis()
            * PERSISTENCE;
        pose.local_rotations[joint] * UnitQuaternion::from_scaled_axis(way)
    };
    BodyPose {
        root_position: pose.root_position
            + (pose.root_position - before.root_position) * PERSISTENCE,
        local_rotations: std::array::from_fn::<_, JOINT_COUNT, _>(rotation),
    }
}
