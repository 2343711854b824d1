//! The streaming networks of one placement, sample by sample.

use std::collections::VecDeque;

use cromosim_body::{BodyPose, ShapedBody};
use cromosim_imu::{KinematicSample, MountedSite, Placement};
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use crate::site_motion::points_at;
use crate::{Input, LearnedError, LearnedSimulator, NETWORK_RATE_HZ, PATCH_POINTS, Patch, Quantity, StreamingNetwork};

/// Frames of the patch that are kept: more than any scheme's delay.
const KEPT: usize = 128;

/// A placement's patch over the last frames, and its networks' state. Frames go in as they come; the samples of a scheme, which come later,
/// are corrected in order. The samples have to come at [`NETWORK_RATE_HZ`].
pub struct LivePlacement {
    patch: Patch,
    stamps: VecDeque<Stamp>,
    points: VecDeque<[Vector3<f64>; PATCH_POINTS]>,
    networks: [StreamingNetwork; 2],
    last: Option<Stamp>,
    features: Vec<f32>,
}

impl LivePlacement {
    /// A placement before its first frame.
    ///
    /// # Errors
    /// [`LearnedError::NotCausal`] for networks that need a window, [`LearnedError::WrongRate`] for a placement of another rate,
    /// [`LearnedError::NoPatch`].
    pub fn new(simulator: &LearnedSimulator, body: &ShapedBody, placement: &Placement) -> Result<Self, LearnedError> {
        if simulator.input() != Input::Streaming {
            return Err(LearnedError::NotCausal);
        }
        if placement.rate_hz() != NETWORK_RATE_HZ {
            return Err(LearnedError::WrongRate { placement: placement.name().to_owned(), rate_hz: placement.rate_hz() });
        }
        let [acceleration, angular_velocity] = simulator.networks();
        Ok(Self {
            patch: Patch::new(body, MountedSite::new(body, placement)?.site())?,
            stamps: VecDeque::with_capacity(KEPT),
            points: VecDeque::with_capacity(KEPT),
            networks: [StreamingNetwork::new(acceleration)?, StreamingNetwork::new(angular_velocity)?],
            last: None,
            features: Vec::new(),
        })
    }

    /// Takes the body's pose of a time.
    pub fn push(&mut self, stamp: Stamp, pose: &BodyPose) {
        if self.stamps.len() == KEPT {
            self.stamps.pop_front();
            self.points.pop_front();
        }
        self.stamps.push_back(stamp);
        self.points.push_back(self.patch.points(pose));
    }

    /// A sample of the placement's scheme with what the networks add; unchanged before the first frame.
    ///
    /// # Errors
    /// As [`StreamingNetwork::step`].
    pub fn correct(&mut self, sample: &KinematicSample) -> Result<KinematicSample, LearnedError> {
        if self.stamps.is_empty() {
            return Ok(*sample);
        }
        // After a pause another series begins.
        if self.last.replace(sample.stamp).is_some_and(|last| sample.stamp - last > 1.5 / NETWORK_RATE_HZ) {
            self.networks.iter_mut().for_each(StreamingNetwork::reset);
        }
        let (stamps, points) = (self.stamps.make_contiguous(), self.points.make_contiguous());
        let points = points_at(stamps, points, sample.stamp.clamp(stamps[0], stamps[stamps.len() - 1]));
        self.features.clear();
        Input::Streaming.sample(&points, sample, &Vector3::zeros(), &UnitQuaternion::identity(), &mut self.features);
        let mut added = [Vector3::zeros(); 2];
        for ((added, network), quantity) in added.iter_mut().zip(&mut self.networks).zip(Quantity::BOTH) {
            let output = network.step(&self.features)?;
            *added = Vector3::new(output[0], output[1], output[2]).map(f64::from) * quantity.scale();
        }
        Ok(KinematicSample {
            acceleration: sample.acceleration + added[0],
            angular_velocity: sample.angular_velocity + added[1],
            angular_acceleration: None,
            ..*sample
        })
    }

    /// Forgets everything: a series ends here, and another begins.
    pub fn reset(&mut self) {
        self.stamps.clear();
        self.points.clear();
        self.last = None;
        self.networks.iter_mut().for_each(StreamingNetwork::reset);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;
    use cromosim_imu::{Scheme, StreamOptions, StreamingImu};
    use cromosim_spatial::uniform_stamps;

    use super::*;
    use crate::{Direction, Network, NetworkShape, SiteMotion};

    fn simulator(direction: Direction) -> Result<LearnedSimulator, LearnedError> {
        let shape = NetworkShape { inputs: 30, channels: 8, kernel: 5, convolutions: 3, hidden: 8, layers: 2, direction, outputs: 3 };
        LearnedSimulator::new(Input::Streaming, [Network::new(shape.clone(), 1)?, Network::new(shape, 2)?])
    }

    #[test]
    fn live_is_what_the_whole_series_gives() {
        let simulator = simulator(Direction::Forward).unwrap();
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let placement = Placement::at_site("left_wrist", "left_watch", 100.0).unwrap().with_scheme(Scheme::Richardson);
        let stamps = uniform_stamps(Stamp::from_seconds(1.0), Stamp::from_seconds(4.0), 120.0).unwrap();
        let pose = |stamp: &Stamp| {
            let t = stamp.as_seconds();
            let mut turns = [Vector3::zeros(); 24];
            turns[18] = Vector3::new(0.0, (5.0 * t).sin(), 0.3 * t);
            BodyPose::from_axis_angles(Vector3::new(t, 0.0, 1.0), &turns)
        };
        let poses: Vec<BodyPose> = stamps.iter().map(pose).collect();
        let whole = simulator.simulate(&SiteMotion::on_body(&body, &placement, &stamps, &poses).unwrap()).unwrap();

        let mounted = MountedSite::new(&body, &placement).unwrap();
        let mut stream = StreamingImu::new(Scheme::Richardson, StreamOptions::resampled(120.0, 100.0)).unwrap();
        let mut live = LivePlacement::new(&simulator, &body, &placement).unwrap();
        let mut samples = Vec::new();
        for (stamp, pose) in stamps.iter().zip(&poses) {
            live.push(*stamp, pose);
            for sample in stream.push_kinematics(mounted.frame(pose).at(*stamp)).unwrap() {
                samples.push(live.correct(&sample).unwrap());
            }
        }
        assert!(samples.len() > 290);
        // The stream begins with a shorter stencil; the networks' state forgets that.
        for (one, all) in samples.iter().zip(&whole).skip(60) {
            assert_eq!(one.stamp, all.stamp);
            assert!((one.acceleration - all.acceleration).norm() < 1e-3, "{} {}", one.acceleration, all.acceleration);
            assert!((one.angular_velocity - all.angular_velocity).norm() < 1e-4);
        }
    }

    #[test]
    fn what_cannot_run_live_is_refused() {
        assert!(simulator(Direction::Both).unwrap_err().to_string().contains("direction: forward"));
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let fast = Placement::at_site("left_wrist", "left_watch", 200.0).unwrap();
        let error = LivePlacement::new(&simulator(Direction::Forward).unwrap(), &body, &fast).err().unwrap().to_string();
        assert!(error.contains("left_wrist") && error.contains("100"), "{error}");
    }
}
