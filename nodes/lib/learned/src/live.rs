//! The streaming networks of the placements on one body, sample by sample.

use std::collections::VecDeque;

use cromosim_body::{BodyPose, ShapedBody, VertexSubset};
use cromosim_imu::{
    KinematicSample, MotionCorrection, MountedSensor, Placement, Scheme, SensorPose,
};
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::features::AHEAD;
use crate::site_motion::{Around, difference};
use crate::{
    Input, LearnedError, LearnedSimulator, NETWORK_RATE_HZ, PATCH_POINTS, Patch, Quantity,
    StreamingBatch,
};

/// Frames that are kept at least: more than any scheme's delay.
const KEPT: usize = 128;
/// Between samples.
const PERIOD: f64 = 1.0 / NETWORK_RATE_HZ;

/// The patches of several placements over the last frames, and their networks' states. Poses go in
/// as they come, and the skeleton is computed once for all; the samples of the schemes, which come
/// later, are corrected in order, once the frames are there that the networks see ahead of a sample
/// ([`Self::delay_seconds`]). Placements of one scheme, whose samples come together, are one batch
/// to the networks. The samples have to come at [`NETWORK_RATE_HZ`].
pub struct LivePlacements {
    /// The points of every patch, one after the other.
    subset: VertexSubset,
    positions: Vec<Vector3<f64>>,
    frames: Frames,
    /// Before a pause, until its last samples have come.
    ended: Option<Frames>,
    groups: Vec<Group>,
    /// Samples of each placement that wait for frames.
    waiting: Vec<VecDeque<KinematicSample>>,
    /// Frames further apart, s, belong to different series.
    longest_gap: f64,
}

impl LivePlacements {
    /// Placements before their first frame; frames more than `longest_gap` seconds apart belong to
    /// different series, as for the schemes.
    ///
    /// # Errors
    /// [`LearnedError::NotCausal`] for networks that need a window, [`LearnedError::WrongRate`] for
    /// a placement of another rate, [`LearnedError::NoPatch`].
    pub fn new(
        simulator: &LearnedSimulator,
        body: &ShapedBody,
        placements: &[Placement],
        longest_gap: f64,
    ) -> Result<Self, LearnedError> {
        if simulator.input() != Input::Streaming {
            return Err(LearnedError::NotCausal);
        }
        let mut vertices = Vec::with_capacity(placements.len() * PATCH_POINTS);
        let mut schemes: Vec<(Scheme, Vec<usize>)> = Vec::new();
        for (number, placement) in placements.iter().enumerate() {
            if placement.rate_hz() != NETWORK_RATE_HZ {
                return Err(LearnedError::WrongRate {
                    placement: placement.name().to_owned(),
                    rate_hz: placement.rate_hz(),
                });
            }
            vertices
                .extend(Patch::new(body, MountedSensor::new(body, placement)?.site())?.vertices());
            match schemes
                .iter_mut()
                .find(|(scheme, _)| *scheme == placement.scheme())
            {
                Some((_, members)) => members.push(number),
                None => schemes.push((placement.scheme(), vec![number])),
            }
        }
        Ok(Self {
            subset: body.subset(&vertices)?,
            positions: Vec::with_capacity(vertices.len()),
            frames: Frames::new(placements.len()),
            ended: None,
            groups: schemes
                .into_iter()
                .map(|(_, members)| Group::new(simulator, members))
                .collect::<Result<_, _>>()?,
            waiting: vec![VecDeque::new(); placements.len()],
            longest_gap,
        })
    }

    /// At most so long after its stamp a sample is corrected, s, where its scheme is no slower.
    pub fn delay_seconds(state_rate_hz: f64) -> f64 {
        (AHEAD + 1) as f64 * PERIOD + 2.0 / state_rate_hz
    }

    /// Takes the body's pose of a time, and the frame of each placement then.
    ///
    /// # Panics
    /// For another number of frames than placements.
    pub fn push(&mut self, stamp: Stamp, pose: &BodyPose, frames: &[SensorPose]) {
        let placements = self.frames.placements;
        assert_eq!(
            frames.len(),
            placements,
            "frames of {placements} placements"
        );
        if self
            .frames
            .stamps
            .last()
            .is_some_and(|last| stamp - *last > self.longest_gap)
        {
            self.ended = Some(std::mem::replace(&mut self.frames, Frames::new(placements)));
        }
        self.subset.positions_into(pose, &mut self.positions);
        self.frames
            .push(stamp, self.positions.as_chunks::<PATCH_POINTS>().0, frames);
    }

    /// Forgets everything: a series ends here, and another begins.
    pub fn reset(&mut self) {
        self.frames = Frames::new(self.frames.placements);
        self.ended = None;
        self.waiting.iter_mut().for_each(VecDeque::clear);
        for group in &mut self.groups {
            group.recent.fill_with(Recent::default);
            group.networks.iter_mut().for_each(StreamingBatch::reset);
        }
    }
}

impl MotionCorrection for LivePlacements {
    type Error = LearnedError;

    /// Takes samples of the placements' schemes, (placements, samples in order), and puts in their
    /// place those that can be corrected now, these or earlier ones, with what the networks say
    /// added.
    ///
    /// # Errors
    /// As [`StreamingBatch::step`].
    fn correct(&mut self, released: &mut [Vec<KinematicSample>]) -> Result<(), LearnedError> {
        let Self {
            frames,
            ended,
            groups,
            waiting,
            ..
        } = self;
        for (waiting, released) in waiting.iter_mut().zip(released.iter_mut()) {
            waiting.extend(released.drain(..));
        }
        // What waited for frames when the pause began gets none.
        if let Some(ended) = ended.take() {
            let belongs = |sample: &KinematicSample| {
                ended
                    .stamps
                    .last()
                    .is_some_and(|last| sample.stamp <= *last)
            };
            correct_those((groups, waiting), &ended, released, belongs)?;
        }
        correct_those((groups, waiting), frames, released, |sample| {
            frames.reach(sample.stamp)
        })
    }
}

/// Corrects the first of those that wait, as far as they may, and appends them to what is released.
fn correct_those(
    (groups, waiting): (&mut [Group], &mut [VecDeque<KinematicSample>]),
    frames: &Frames,
    released: &mut [Vec<KinematicSample>],
    may: impl Fn(&KinematicSample) -> bool,
) -> Result<(), LearnedError> {
    let begin: Vec<usize> = released.iter().map(Vec::len).collect();
    for (waiting, released) in waiting.iter_mut().zip(released.iter_mut()) {
        while let Some(sample) = waiting.pop_front_if(|sample| may(sample)) {
            released.push(sample);
        }
    }
    for group in groups {
        let count = |member: &usize| {
            released
                .get(*member)
                .map_or(0, |own| own.len() - begin[*member])
        };
        let most = group.members.iter().map(count).max().unwrap_or(0);
        for index in 0..most {
            group.step(frames, released, &begin, index)?;
        }
    }
    Ok(())
}

/// The last frames of a series.
struct Frames {
    placements: usize,
    stamps: Vec<Stamp>,
    /// Of the patches, (frames, placements).
    points: Vec<[Vector3<f64>; PATCH_POINTS]>,
    /// Of the sensors, (frames, placements).
    poses: Vec<Isometry3<f64>>,
}

impl Frames {
    fn new(placements: usize) -> Self {
        Self {
            placements,
            stamps: Vec::new(),
            points: Vec::new(),
            poses: Vec::new(),
        }
    }

    fn push(
        &mut self,
        stamp: Stamp,
        points: &[[Vector3<f64>; PATCH_POINTS]],
        frames: &[SensorPose],
    ) {
        if self.stamps.len() == 2 * KEPT {
            self.stamps.drain(..KEPT);
            self.points.drain(..KEPT * self.placements);
            self.poses.drain(..KEPT * self.placements);
        }
        self.stamps.push(stamp);
        self.points.extend_from_slice(points);
        self.poses
            .extend(frames.iter().map(|frame| frame.world_from_sensor));
    }

    /// Whether the frames are there that make up the pose one sample after the differences, which
    /// the networks see ahead of a sample.
    fn reach(&self, sample: Stamp) -> bool {
        let needed = sample.plus_seconds((AHEAD + 1) as f64 * PERIOD);
        let after = self.stamps.partition_point(|stamp| *stamp < needed);
        self.stamps
            .get(after)
            .is_some_and(|stamp| *stamp == needed || after + 1 < self.stamps.len())
    }

    /// Around a stamp, or around the end that is nearer to it.
    fn around(&self, stamp: Stamp) -> Around {
        Around::new(
            &self.stamps,
            stamp.clamp(self.stamps[0], self.stamps[self.stamps.len() - 1]),
        )
    }

    fn points(&self, around: &Around, placement: usize) -> [Vector3<f64>; PATCH_POINTS] {
        around.blend(|frame| &self.points[frame * self.placements + placement])
    }

    fn pose(&self, stamp: Stamp, placement: usize) -> Isometry3<f64> {
        self.around(stamp)
            .blend_pose(|frame| &self.poses[frame * self.placements + placement])
    }
}

/// Placements of one scheme.
struct Group {
    /// Their numbers.
    members: Vec<usize>,
    networks: [StreamingBatch; 2],
    recent: Vec<Recent>,
    features: Vec<f32>,
    /// Which of them have a sample now.
    advance: Vec<bool>,
}

/// Of one placement.
#[derive(Clone, Default)]
struct Recent {
    /// Stamp of the last sample.
    last: Option<Stamp>,
    /// The sensor at the three samples around the differences that the networks see with it.
    poses: [Isometry3<f64>; 3],
}

impl Recent {
    /// Whether the sample goes on with the series, or begins one; and the differences that the
    /// networks see with it.
    fn advance(
        &mut self,
        sample: Stamp,
        end: Stamp,
        pose: impl Fn(Stamp) -> Isometry3<f64>,
    ) -> (bool, [Vector3<f64>; 2]) {
        let goes_on = self.last.is_some_and(|last| sample - last <= 1.5 * PERIOD);
        self.last = Some(sample);
        let next = sample.plus_seconds((AHEAD + 1) as f64 * PERIOD);
        // A series that ends keeps its last differences.
        if goes_on && next <= end {
            self.poses = [self.poses[1], self.poses[2], pose(next)];
        } else if !goes_on {
            self.poses =
                [2.0, 1.0, 0.0].map(|back| pose(next.min(end).plus_seconds(-back * PERIOD)));
        }
        (goes_on, difference(&self.poses))
    }
}

impl Group {
    fn new(simulator: &LearnedSimulator, members: Vec<usize>) -> Result<Self, LearnedError> {
        let [acceleration, angular_velocity] = simulator.networks();
        let count = members.len();
        Ok(Self {
            networks: [
                StreamingBatch::new(acceleration, count)?,
                StreamingBatch::new(angular_velocity, count)?,
            ],
            recent: vec![Recent::default(); count],
            features: Vec::with_capacity(count * Input::Streaming.channels()),
            advance: vec![false; count],
            members,
        })
    }

    /// Corrects the sample `index` of each member that has one, counted from where each begins.
    fn step(
        &mut self,
        frames: &Frames,
        released: &mut [Vec<KinematicSample>],
        begin: &[usize],
        index: usize,
    ) -> Result<(), LearnedError> {
        self.fill_features(frames, released, begin, index);
        let mut added = [&[][..]; 2];
        for (added, network) in added.iter_mut().zip(&mut self.networks) {
            *added = network.step_some(&self.features, &self.advance)?;
        }
        for (row, member) in self.members.iter().enumerate() {
            let Some(sample) = released
                .get_mut(*member)
                .and_then(|samples| samples.get_mut(begin[*member] + index))
            else {
                continue;
            };
            let [acceleration, rate] = [0, 1].map(|which| {
                let output = &added[which][3 * row..][..3];
                Vector3::new(output[0], output[1], output[2]).map(f64::from)
                    * Quantity::BOTH[which].scale()
            });
            sample.acceleration_in_world += acceleration;
            sample.angular_velocity_in_world += rate;
            sample.angular_acceleration_in_world = None;
        }
        Ok(())
    }

    fn fill_features(
        &mut self,
        frames: &Frames,
        released: &[Vec<KinematicSample>],
        begin: &[usize],
        index: usize,
    ) {
        let mut around: Option<(Stamp, Around)> = None;
        self.features.clear();
        for (row, member) in self.members.iter().enumerate() {
            let sample = released
                .get(*member)
                .and_then(|samples| samples.get(begin[*member] + index));
            self.advance[row] = sample.is_some();
            let Some(sample) = sample else {
                self.features
                    .resize(self.features.len() + Input::Streaming.channels(), 0.0);
                continue;
            };
            // Most samples of a batch have the same stamp.
            let place = match around.take() {
                Some((stamp, place)) if stamp == sample.stamp => place,
                _ => frames.around(sample.stamp),
            };
            let end = frames.stamps[frames.stamps.len() - 1];
            let (goes_on, unsmoothed) =
                self.recent[row].advance(sample.stamp, end, |stamp| frames.pose(stamp, *member));
            if !goes_on {
                self.networks
                    .iter_mut()
                    .for_each(|network| network.reset_sequence(row));
            }
            let (points, origin) = (frames.points(&place, *member), Vector3::zeros());
            Input::Streaming.sample(
                &points,
                sample,
                &unsmoothed,
                &origin,
                &UnitQuaternion::identity(),
                &mut self.features,
            );
            around = Some((sample.stamp, place));
        }
    }
}

#[cfg(test)]
#[path = "live_tests.rs"]
mod tests;
