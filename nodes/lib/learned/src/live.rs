//! The streaming networks of the placements on one body, sample by sample.

use std::collections::VecDeque;

use cromosim_body::{BodyPose, ShapedBody, VertexSubset};
use cromosim_imu::{KinematicSample, MountedSite, Placement, Scheme, SiteFrame};
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::features::AHEAD;
use crate::site_motion::{Around, difference};
use crate::{Input, LearnedError, LearnedSimulator, NETWORK_RATE_HZ, PATCH_POINTS, Patch, Quantity, StreamingBatch};

/// Frames of the patches that are kept at least: more than any scheme's delay.
const KEPT: usize = 128;
/// Between samples.
const PERIOD: f64 = 1.0 / NETWORK_RATE_HZ;

/// The patches of several placements over the last frames, and their networks' states. Poses go in as they come, and the skeleton is computed
/// once for all; the samples of the schemes, which come later, are corrected in order, once the frames are there that the networks see ahead
/// of a sample ([`Self::delay_seconds`]). Placements of one scheme, whose samples come together, are one batch to the networks. The samples
/// have to come at [`NETWORK_RATE_HZ`].
pub struct LivePlacements {
    /// The points of every patch, one after the other.
    subset: VertexSubset,
    placements: usize,
    stamps: Vec<Stamp>,
    /// (frames, placements).
    points: Vec<[Vector3<f64>; PATCH_POINTS]>,
    /// Of the sensors, (frames, placements).
    frames: Vec<Isometry3<f64>>,
    positions: Vec<Vector3<f64>>,
    groups: Vec<Group>,
    /// Samples of each placement that wait for frames.
    waiting: Vec<VecDeque<KinematicSample>>,
    /// Frames further apart, s, belong to different series.
    longest_gap: f64,
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

impl LivePlacements {
    /// Placements before their first frame; frames more than `longest_gap` seconds apart belong to different series, as for the schemes.
    ///
    /// # Errors
    /// [`LearnedError::NotCausal`] for networks that need a window, [`LearnedError::WrongRate`] for a placement of another rate,
    /// [`LearnedError::NoPatch`].
    pub fn new(simulator: &LearnedSimulator, body: &ShapedBody, placements: &[Placement], longest_gap: f64) -> Result<Self, LearnedError> {
        if simulator.input() != Input::Streaming {
            return Err(LearnedError::NotCausal);
        }
        let mut vertices = Vec::with_capacity(placements.len() * PATCH_POINTS);
        let mut schemes: Vec<(Scheme, Vec<usize>)> = Vec::new();
        for (number, placement) in placements.iter().enumerate() {
            if placement.rate_hz() != NETWORK_RATE_HZ {
                return Err(LearnedError::WrongRate { placement: placement.name().to_owned(), rate_hz: placement.rate_hz() });
            }
            vertices.extend(Patch::new(body, MountedSite::new(body, placement)?.site())?.vertices());
            match schemes.iter_mut().find(|(scheme, _)| *scheme == placement.scheme()) {
                Some((_, members)) => members.push(number),
                None => schemes.push((placement.scheme(), vec![number])),
            }
        }
        Ok(Self {
            subset: body.subset(&vertices)?,
            placements: placements.len(),
            stamps: Vec::with_capacity(2 * KEPT),
            points: Vec::with_capacity(2 * KEPT * placements.len()),
            frames: Vec::with_capacity(2 * KEPT * placements.len()),
            positions: Vec::with_capacity(vertices.len()),
            groups: schemes.into_iter().map(|(_, members)| Group::new(simulator, members)).collect::<Result<_, _>>()?,
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
    pub fn push(&mut self, stamp: Stamp, pose: &BodyPose, frames: &[SiteFrame]) {
        assert_eq!(frames.len(), self.placements, "frames of {} placements", self.placements);
        if self.stamps.last().is_some_and(|last| stamp - *last > self.longest_gap) {
            self.forget_frames();
        }
        if self.stamps.len() == 2 * KEPT {
            self.stamps.drain(..KEPT);
            self.points.drain(..KEPT * self.placements);
            self.frames.drain(..KEPT * self.placements);
        }
        self.stamps.push(stamp);
        self.subset.positions_into(pose, &mut self.positions);
        self.points.extend_from_slice(self.positions.as_chunks::<PATCH_POINTS>().0);
        self.frames.extend(frames.iter().map(|frame| frame.world_from_sensor));
    }

    /// Takes samples of the placements' schemes, (placements, samples in order), and puts in their place those that can be corrected now, these
    /// or earlier ones, with what the networks say added.
    ///
    /// # Errors
    /// As [`StreamingBatch::step`].
    pub fn correct(&mut self, released: &mut [Vec<KinematicSample>]) -> Result<(), LearnedError> {
        for (waiting, released) in self.waiting.iter_mut().zip(released.iter_mut()) {
            waiting.extend(released.drain(..));
            while let Some(sample) = waiting.pop_front_if(|sample| sees_ahead(&self.stamps, sample.stamp)) {
                released.push(sample);
            }
        }
        let history = History { stamps: &self.stamps, points: &self.points, frames: &self.frames, placements: self.placements };
        for group in &mut self.groups {
            let count = |member: &usize| released.get(*member).map_or(0, Vec::len);
            let most = group.members.iter().map(count).max().unwrap_or(0);
            for index in 0..most {
                group.step(&history, released, index)?;
            }
        }
        Ok(())
    }

    /// A pause: what waits for the frames after it stays without them.
    fn forget_frames(&mut self) {
        self.stamps.clear();
        self.points.clear();
        self.frames.clear();
        self.waiting.iter_mut().for_each(VecDeque::clear);
    }

    /// Forgets everything: a series ends here, and another begins.
    pub fn reset(&mut self) {
        self.forget_frames();
        for group in &mut self.groups {
            group.recent.fill_with(Recent::default);
            group.networks.iter_mut().for_each(StreamingBatch::reset);
        }
    }
}

/// Whether the frames are there that make up the pose one sample after the differences, which the networks see ahead of a sample.
fn sees_ahead(stamps: &[Stamp], sample: Stamp) -> bool {
    let needed = sample.plus_seconds((AHEAD + 1) as f64 * PERIOD);
    let after = stamps.partition_point(|stamp| *stamp < needed);
    stamps.get(after).is_some_and(|stamp| *stamp == needed || after + 1 < stamps.len())
}

/// What is known of the patches.
struct History<'a> {
    stamps: &'a [Stamp],
    points: &'a [[Vector3<f64>; PATCH_POINTS]],
    frames: &'a [Isometry3<f64>],
    placements: usize,
}

/// Of one placement.
#[derive(Clone, Default)]
struct Recent {
    /// Stamp of the last sample.
    last: Option<Stamp>,
    /// The sensor at the three samples around the differences that the networks see with it.
    poses: [Isometry3<f64>; 3],
}

impl Group {
    fn new(simulator: &LearnedSimulator, members: Vec<usize>) -> Result<Self, LearnedError> {
        let [acceleration, angular_velocity] = simulator.networks();
        let count = members.len();
        Ok(Self {
            networks: [StreamingBatch::new(acceleration, count)?, StreamingBatch::new(angular_velocity, count)?],
            recent: vec![Recent::default(); count],
            features: Vec::with_capacity(count * Input::Streaming.channels()),
            advance: vec![false; count],
            members,
        })
    }

    /// Corrects the sample `index` of each member that has one.
    fn step(&mut self, history: &History, released: &mut [Vec<KinematicSample>], index: usize) -> Result<(), LearnedError> {
        self.fill_features(history, released, index);
        let mut added = [&[][..]; 2];
        for (added, network) in added.iter_mut().zip(&mut self.networks) {
            *added = network.step_some(&self.features, &self.advance)?;
        }
        for (row, member) in self.members.iter().enumerate() {
            let Some(sample) = released.get_mut(*member).and_then(|samples| samples.get_mut(index)) else { continue };
            let [acceleration, rate] = [0, 1].map(|which| {
                let output = &added[which][3 * row..][..3];
                Vector3::new(output[0], output[1], output[2]).map(f64::from) * Quantity::BOTH[which].scale()
            });
            sample.acceleration += acceleration;
            sample.angular_velocity += rate;
            sample.angular_acceleration = None;
        }
        Ok(())
    }

    fn fill_features(&mut self, history: &History, released: &[Vec<KinematicSample>], index: usize) {
        let (first, last) = (history.stamps[0], history.stamps[history.stamps.len() - 1]);
        let mut around: Option<(Stamp, Around)> = None;
        self.features.clear();
        for (row, member) in self.members.iter().enumerate() {
            let sample = released.get(*member).and_then(|samples| samples.get(index));
            self.advance[row] = sample.is_some();
            let Some(sample) = sample else {
                self.features.resize(self.features.len() + Input::Streaming.channels(), 0.0);
                continue;
            };
            // Most samples of a batch have the same stamp.
            let place = match around.take() {
                Some((stamp, place)) if stamp == sample.stamp => place,
                _ => Around::new(history.stamps, sample.stamp.clamp(first, last)),
            };
            let points = place.blend(|frame| &history.points[frame * history.placements + member]);
            let recent = &mut self.recent[row];
            let pose = |ahead: usize| {
                let stamp = sample.stamp.plus_seconds(ahead as f64 * PERIOD);
                Around::new(history.stamps, stamp).blend_pose(|frame| &history.frames[frame * history.placements + member])
            };
            match recent.last.replace(sample.stamp) {
                Some(last) if sample.stamp - last <= 1.5 * PERIOD => recent.poses = [recent.poses[1], recent.poses[2], pose(AHEAD + 1)],
                last => {
                    recent.poses = [AHEAD - 1, AHEAD, AHEAD + 1].map(pose);
                    // After a pause another series begins.
                    if last.is_some() {
                        self.networks.iter_mut().for_each(|network| network.reset_sequence(row));
                    }
                }
            }
            let (unsmoothed, origin) = (difference(&recent.poses), Vector3::zeros());
            Input::Streaming.sample(&points, sample, &unsmoothed, &origin, &UnitQuaternion::identity(), &mut self.features);
            around = Some((sample.stamp, place));
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;
    use cromosim_imu::{MountedSites, PlacementSet, StreamOptions, StreamingImu};
    use cromosim_spatial::uniform_stamps;

    use super::*;
    use crate::{Direction, Network, NetworkShape, SiteMotion};

    const STATES_HZ: f64 = 120.0;
    const GAP: f64 = 0.5;

    fn simulator(direction: Direction) -> Result<LearnedSimulator, LearnedError> {
        let shape = NetworkShape { inputs: 36, channels: 8, kernel: 5, convolutions: 3, hidden: 8, layers: 2, direction, outputs: 3 };
        LearnedSimulator::new(Input::Streaming, [Network::new(shape.clone(), 1)?, Network::new(shape, 2)?])
    }

    fn pose(stamp: &Stamp) -> BodyPose {
        let t = stamp.as_seconds();
        let mut turns = [Vector3::zeros(); 24];
        turns[18] = Vector3::new(0.0, (5.0 * t).sin(), 0.3 * t);
        turns[2] = Vector3::new(0.4 * (3.0 * t).cos(), 0.0, 0.0);
        BodyPose::from_axis_angles(Vector3::new(t, 0.0, 1.0), &turns)
    }

    fn stamps(from: f64, to: f64) -> Vec<Stamp> {
        uniform_stamps(Stamp::from_seconds(from), Stamp::from_seconds(to), STATES_HZ).unwrap()
    }

    /// What comes out of placements together, (placements, samples). `keep` says which samples of a frame get to the networks.
    fn run(placements: &[Placement], stamps: &[Stamp], keep: impl Fn(&str, usize) -> bool) -> Vec<Vec<KinematicSample>> {
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let sites = MountedSites::new(&body, placements).unwrap();
        let options = StreamOptions::resampled(STATES_HZ, 100.0);
        let mut streams: Vec<_> = placements.iter().map(|placement| StreamingImu::new(placement.scheme(), options).unwrap()).collect();
        let mut live = LivePlacements::new(&simulator(Direction::Forward).unwrap(), &body, placements, GAP).unwrap();
        let mut all = vec![Vec::new(); placements.len()];
        for (number, stamp) in stamps.iter().enumerate() {
            let pose = pose(stamp);
            let frames = sites.frames(&pose);
            live.push(*stamp, &pose, &frames);
            let mut released: Vec<_> =
                streams.iter_mut().zip(&frames).map(|(stream, frame)| stream.push_kinematics(frame.at(*stamp)).unwrap()).collect();
            for (placement, samples) in placements.iter().zip(&mut released) {
                samples.retain(|_| keep(placement.name(), number));
            }
            live.correct(&mut released).unwrap();
            all.iter_mut().zip(released).for_each(|(all, released)| all.extend(released));
        }
        all
    }

    #[test]
    fn live_is_what_the_whole_series_gives() {
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let placement = Placement::at_site("left_wrist", "left_watch", 100.0).unwrap().with_scheme(Scheme::Richardson);
        let stamps = stamps(1.0, 4.0);
        let poses: Vec<BodyPose> = stamps.iter().map(pose).collect();
        let motion = SiteMotion::on_body(&body, &placement, &stamps, &poses).unwrap();
        let whole = simulator(Direction::Forward).unwrap().simulate(&motion).unwrap();
        let samples = &run(&[placement], &stamps, |_, _| true)[0];
        assert!(samples.len() > 290);
        // The stream begins with a shorter stencil; the networks' state forgets that.
        for (one, all) in samples.iter().zip(&whole).skip(60) {
            assert_eq!(one.stamp, all.stamp);
            assert!((one.acceleration - all.acceleration).norm() < 1e-3, "{} {}", one.acceleration, all.acceleration);
            assert!((one.angular_velocity - all.angular_velocity).norm() < 1e-4);
        }
    }

    #[test]
    fn placements_together_are_what_each_is_alone() {
        let schemes = [Scheme::Spline, Scheme::Richardson, Scheme::Triangle, Scheme::Richardson];
        let placements: Vec<Placement> = PlacementSet::full17()
            .placements()
            .iter()
            .zip(schemes.iter().cycle())
            .map(|(placement, scheme)| placement.clone().with_scheme(*scheme))
            .collect();
        // A pause after which every series begins anew.
        let times = [stamps(1.0, 1.6), stamps(2.9, 4.1)].concat();
        // Two lose samples, each its own: their series too go on or begin anew without the others.
        let keep = |name: &str, number: usize| match name {
            "left_foot" => number % 7 != 3,
            "pelvis" => !(30..50).contains(&number),
            _ => true,
        };
        let together = run(&placements, &times, keep);
        for (placement, together) in placements.iter().zip(&together) {
            let alone = &run(std::slice::from_ref(placement), &times, keep)[0];
            assert!(alone.len() > 120, "{}: {}", placement.name(), alone.len());
            assert_eq!(together, alone, "{}", placement.name());
        }
    }

    #[test]
    fn what_cannot_run_live_is_refused() {
        assert!(simulator(Direction::Both).unwrap_err().to_string().contains("direction: forward"));
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let fast = Placement::at_site("left_wrist", "left_watch", 200.0).unwrap();
        let error = LivePlacements::new(&simulator(Direction::Forward).unwrap(), &body, &[fast], GAP).err().unwrap().to_string();
        assert!(error.contains("left_wrist") && error.contains("100"), "{error}");
    }
}
