//! Pairs without a real device: known motion, worn by a body and measured by a device that are
//! drawn at random.

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_imu::{
    KinematicSample, MountedSensor, Placement, Reading, Scheme, SensorFrame, SensorTrajectory,
    normal_pair, simulate_kinematics,
};
use cromosim_spatial::{Stamp, uniform_stamps};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

use crate::{
    DeviceRanges, LearnedError, NETWORK_RATE_HZ, Pair, PairNames, SiteMotion, SourceErrors,
};

/// The device's grid of true time, Hz.
const FINE_RATE_HZ: f64 = 400.0;
/// A joint that flips (uncleaned motion capture) accelerates like no limb, m/s2; nothing is learned
/// within [`AROUND`] samples of it.
const FASTEST: f64 = 60.0;
const AROUND: usize = 15;
/// Samples at each end.
const END: usize = 10;
/// Coefficients of shape that are drawn.
const SHAPES: usize = 10;
/// Coefficients of shape beyond so many standard deviations are nobody's.
const WIDEST_SHAPE: f64 = 2.5;

/// How drawn people differ from what a simulation is told of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WearerRanges {
    /// Devices and mounts.
    #[serde(default)]
    pub devices: DeviceRanges,
    /// Errors of the motion that the simulation is given.
    pub source: SourceErrors,
    /// Standard deviation of the true shape's coefficients.
    #[serde(default = "WearerRanges::usual_shape")]
    pub shape: f64,
    /// Standard deviation of the error of the coefficients that the simulation is given.
    #[serde(default = "WearerRanges::usual_shape_error")]
    pub shape_error: f64,
    /// The motion is played this many times as fast, uniform.
    #[serde(default = "WearerRanges::as_recorded")]
    pub speed: [f64; 2],
}

impl WearerRanges {
    /// A source with drawn devices and people.
    pub fn with_source(source: SourceErrors) -> Self {
        let (shape, shape_error, speed) = (
            Self::usual_shape(),
            Self::usual_shape_error(),
            Self::as_recorded(),
        );
        Self {
            devices: DeviceRanges::default(),
            source,
            shape,
            shape_error,
            speed,
        }
    }

    fn usual_shape() -> f64 {
        0.8
    }

    fn usual_shape_error() -> f64 {
        0.3
    }

    fn as_recorded() -> [f64; 2] {
        [1.0, 1.0]
    }

    /// A person and a device in a motion; each seed another person, device and errors of the
    /// source.
    ///
    /// # Errors
    /// Those of the site, of kinematics and of effects.
    pub fn draw(
        &self,
        model: &Arc<BodyModel>,
        motion: &KnownMotion<'_>,
        placement: &Placement,
        seed: u64,
    ) -> Result<DrawnWearer, LearnedError> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let speed = self.speed[0] + (self.speed[1] - self.speed[0]) * random.random::<f64>();
        let (poses, rate_hz) = (motion.poses, motion.rate_hz * speed);
        let shape = draw_shape(&mut random, model, self.shape);
        let told = ShapedBody::new(model.clone(), &betas(&mut random, &shape, self.shape_error))?;
        let worn = ShapedBody::new(model.clone(), &shape)?;
        let stamps = stamps(poses.len(), rate_hz);

        let trajectory = MountedSensor::new(&worn, placement)?.trajectory(&stamps, poses)?;
        let fine = uniform_stamps(trajectory.start(), trajectory.end(), FINE_RATE_HZ)?;
        let truth = simulate_kinematics(&trajectory, Scheme::Spline, &fine)?;
        let read_at = uniform_stamps(trajectory.start(), trajectory.end(), NETWORK_RATE_HZ)?;
        let readings =
            self.devices
                .draw(random.random())?
                .measure(&truth, FINE_RATE_HZ, &read_at)?;

        let [near, far] = [random.random(), random.random()];
        let mocap = SourceErrors {
            rate_hz,
            ..SourceErrors::MOCAP
        }
        .degrade(&told, poses, near);
        let best = placement.clone().with_scheme(Scheme::Spline);
        let reference = SiteMotion::on_body(&told, &best, &stamps, &mocap)?;
        let (stamps, poses) = if self.source.rate_hz < 0.9 * rate_hz {
            let sampled = sampled(poses, rate_hz, self.source.rate_hz);
            let degraded = self.source.degrade(&told, &sampled, far);
            (self::stamps(degraded.len(), self.source.rate_hz), degraded)
        } else {
            (
                stamps,
                SourceErrors {
                    rate_hz,
                    ..self.source
                }
                .degrade(&told, poses, near),
            )
        };
        let doubtful = doubtful(motion, rate_hz, &truth, &read_at);
        Ok(DrawnWearer {
            told,
            placement: placement.clone(),
            stamps,
            poses,
            reference,
            read_at,
            readings,
            doubtful,
        })
    }
}

/// A person's coefficients of shape, with this standard deviation, cut off where nobody is.
pub fn draw_shape(random: &mut ChaCha12Rng, model: &BodyModel, sigma: f64) -> Vec<f64> {
    betas(random, &vec![0.0; model.beta_count().min(SHAPES)], sigma)
}

/// Coefficients of shape around others, with this standard deviation.
fn betas(random: &mut ChaCha12Rng, around: &[f64], sigma: f64) -> Vec<f64> {
    let draw =
        |beta: &f64| (beta + sigma * normal_pair(random)[0]).clamp(-WIDEST_SHAPE, WIDEST_SHAPE);
    around.iter().map(draw).collect()
}

/// A motion that is known.
#[derive(Clone, Copy, Debug)]
pub struct KnownMotion<'a> {
    /// Its frames.
    pub poses: &'a [BodyPose],
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// Frames in which it is not a person's, such as joints that flip; empty where nothing is known
    /// of that.
    pub suspect: &'a [bool],
}

/// A drawn person with a drawn device in a motion, and what a simulation is told of it.
#[derive(Clone, Debug)]
pub struct DrawnWearer {
    told: ShapedBody,
    placement: Placement,
    /// The motion with the errors of its source.
    stamps: Vec<Stamp>,
    poses: Vec<BodyPose>,
    /// The best motion that is known.
    reference: SiteMotion,
    read_at: Vec<Stamp>,
    readings: Vec<Reading>,
    /// For each reading: whether the motion there is no person's.
    doubtful: Vec<bool>,
}

impl DrawnWearer {
    /// The motion as the source gives it, differentiated by a scheme.
    ///
    /// # Errors
    /// As [`SiteMotion::on_body`].
    pub fn motion(&self, scheme: Scheme) -> Result<SiteMotion, LearnedError> {
        SiteMotion::on_body(
            &self.told,
            &self.placement.clone().with_scheme(scheme),
            &self.stamps,
            &self.poses,
        )
    }

    /// The sensor's frames as the source gives them.
    ///
    /// # Errors
    /// As [`MountedSensor::trajectory`].
    pub fn trajectory(&self) -> Result<SensorTrajectory, LearnedError> {
        Ok(MountedSensor::new(&self.told, &self.placement)?
            .trajectory(&self.stamps, &self.poses)?)
    }

    /// The frames of the joint that carries the sensor, in the sensor's axes at rest: what a
    /// simulation without skin takes for the sensor.
    ///
    /// # Errors
    /// As [`MountedSensor::trajectory`].
    pub fn joint_trajectory(&self) -> Result<SensorTrajectory, LearnedError> {
        let mounted = MountedSensor::new(&self.told, &self.placement)?;
        let (joint, turn) = (
            mounted.joint().index(),
            mounted.segment_from_sensor().rotation,
        );
        let frame = |(stamp, pose): (&Stamp, &BodyPose)| {
            SensorFrame::new(*stamp, self.told.world_from_segments(pose)[joint] * turn)
        };
        Ok(SensorTrajectory::new(
            self.stamps.iter().zip(&self.poses).map(frame).collect(),
        )?)
    }

    /// The pair of a motion of [`DrawnWearer::motion`]. The clock and mount of the device are fitted as a
    /// real one's would be, to the motion without the errors of a source worse than motion capture.
    ///
    /// # Errors
    /// As [`Pair::new`].
    pub fn pair(&self, names: PairNames, motion: SiteMotion) -> Result<Pair, LearnedError> {
        let mut pair = Pair::new(
            names,
            motion,
            &self.reference,
            &self.read_at,
            &self.readings,
        )?;
        pair.leave_out(|sample| self.doubtful.get(sample).is_none_or(|doubtful| *doubtful));
        Ok(pair)
    }
}

/// Which readings stand near a frame that is suspect, or where a limb accelerates like none, or so
/// near an end that the true motion is itself extrapolated.
fn doubtful(
    motion: &KnownMotion<'_>,
    rate_hz: f64,
    truth: &[KinematicSample],
    read_at: &[Stamp],
) -> Vec<bool> {
    let start = truth[0].stamp;
    let wild: Vec<bool> = read_at
        .iter()
        .map(|stamp| {
            let seconds = *stamp - start;
            let at = ((seconds * FINE_RATE_HZ).round() as usize).min(truth.len() - 1);
            let frame = (seconds * rate_hz).round() as usize;
            truth[at].acceleration_in_world.norm() > FASTEST
                || motion.suspect.get(frame).copied().unwrap_or(false)
        })
        .collect();
    let at_end = |sample: usize| sample < END || sample + END >= wild.len();
    let near = |sample: usize| {
        at_end(sample)
            || wild[sample.saturating_sub(AROUND)..(sample + AROUND + 1).min(wild.len())]
                .contains(&true)
    };
    (0..wild.len()).map(near).collect()
}

fn stamps(count: usize, rate_hz: f64) -> Vec<Stamp> {
    (0..count)
        .map(|frame| Stamp::from_seconds(frame as f64 / rate_hz))
        .collect()
}

/// The motion at a lower rate: spherical linear between the frames around.
fn sampled(poses: &[BodyPose], rate_hz: f64, lower_hz: f64) -> Vec<BodyPose> {
    let last = poses.len().saturating_sub(1);
    let count = (last as f64 / rate_hz * lower_hz).floor() as usize + 1;
    let at = |frame: usize| {
        let position = (frame as f64 / lower_hz * rate_hz).min(last as f64);
        let before = (position.floor() as usize).min(last);
        let (from, to) = (&poses[before], &poses[(before + 1).min(last)]);
        let part = position - before as f64;
        BodyPose {
            root_position: from.root_position.lerp(&to.root_position, part),
            local_rotations: std::array::from_fn(|joint| {
                let (a, b) = (from.local_rotations[joint], to.local_rotations[joint]);
                a.try_slerp(&b, part, 1e-9).unwrap_or(a)
            }),
        }
    };
    (0..count).map(at).collect()
}

impl Pair {
    /// Forgets the targets of samples; what was measured there stays out of scores too.
    pub fn leave_out(&mut self, wild: impl Fn(usize) -> bool) {
        for sample in (0..self.targets.len()).filter(|sample| wild(*sample)) {
            self.targets[sample] = None;
            self.measured[sample] = None;
        }
    }

    /// Largest acceleration among the targets, m/s2; 0 without any.
    pub fn largest_acceleration(&self) -> f64 {
        self.targets
            .iter()
            .flatten()
            .map(|target| target.acceleration.norm())
            .fold(0.0, f64::max)
    }

    /// Root mean square of what a simulation of the targets leaves, per axis: acceleration m/s2,
    /// angular velocity rad/s; `of` says what is simulated at a sample, world axes. None without
    /// targets.
    pub fn rms(&self, of: impl Fn(usize) -> (Vector3<f64>, Vector3<f64>)) -> Option<[f64; 2]> {
        let (mut sums, mut count) = ([0.0; 2], 0.0);
        for (sample, target) in self.targets.iter().enumerate() {
            let Some(target) = target else { continue };
            let (acceleration, angular_velocity) = of(sample);
            sums[0] += (acceleration - target.acceleration).norm_squared();
            sums[1] += (angular_velocity - target.angular_velocity).norm_squared();
            count += 3.0;
        }
        (count > 0.0).then(|| sums.map(|sum| (sum / count).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Arms that swing, a body that walks.
    fn poses(rate_hz: f64, seconds: f64) -> Vec<BodyPose> {
        let pose = |k: usize| {
            let t = k as f64 / rate_hz;
            let mut turns = [Vector3::zeros(); 24];
            turns[16] = Vector3::new(0.6 * (5.0 * t).sin(), 0.0, -1.2 + 0.2 * (2.3 * t).sin());
            turns[18] = Vector3::new(0.0, -0.5 - 0.4 * (5.0 * t).cos(), 0.0);
            BodyPose::from_axis_angles(Vector3::new(t, 0.0, 1.0), &turns)
        };
        (0..(rate_hz * seconds) as usize).map(pose).collect()
    }

    fn known(poses: &[BodyPose]) -> KnownMotion<'_> {
        KnownMotion {
            poses,
            rate_hz: 120.0,
            suspect: &[],
        }
    }

    fn names() -> PairNames {
        PairNames {
            name: "test".to_owned(),
            subject: "s".to_owned(),
            position: "left_wrist".to_owned(),
        }
    }

    #[test]
    fn motion_capture_explains_most_and_video_little() {
        let (model, poses) = (BodyModel::embedded(), poses(120.0, 6.0));
        let placement = Placement::at_site("left_wrist", "left_watch", 100.0).unwrap();
        let analytic = |source, scheme| {
            let worn = WearerRanges::with_source(source)
                .draw(&model, &known(&poses), &placement, 7)
                .unwrap();
            let pair = worn.pair(names(), worn.motion(scheme).unwrap()).unwrap();
            assert_eq!(
                (pair.targets.len(), pair.measured.len()),
                (pair.motion.len(), pair.motion.len())
            );
            let none = pair.rms(|_| (Vector3::zeros(), Vector3::zeros())).unwrap();
            let kinematics = &pair.motion.kinematics;
            let left = pair
                .rms(|sample| {
                    (
                        kinematics[sample].acceleration_in_world,
                        kinematics[sample].angular_velocity_in_world,
                    )
                })
                .unwrap();
            [left[0] / none[0], left[1] / none[1]]
        };
        let mocap = analytic(SourceErrors::MOCAP, Scheme::Spline);
        assert!(mocap[0] < 0.5 && mocap[1] < 0.2, "{mocap:?}");
        let video = analytic(SourceErrors::VIBE, Scheme::Richardson);
        assert!(video[0] > 1.5 && video[1] > 0.4, "{video:?}");
    }

    #[test]
    fn a_seed_gives_the_same_pair_and_another_another() {
        let (model, poses) = (BodyModel::embedded(), poses(120.0, 3.0));
        let placement = Placement::at_site("left_wrist", "left_watch", 100.0).unwrap();
        let wearing = WearerRanges {
            speed: [0.8, 1.25],
            ..WearerRanges::with_source(SourceErrors::WHAM)
        };
        let pair = |seed| {
            let worn = wearing
                .draw(&model, &known(&poses), &placement, seed)
                .unwrap();
            worn.pair(names(), worn.motion(Scheme::Spline).unwrap())
                .unwrap()
        };
        let (one, again, other) = (pair(1), pair(1), pair(2));
        assert_eq!(one.targets, again.targets);
        assert_eq!(one.motion.points, again.motion.points);
        assert_ne!(one.targets.len(), other.targets.len());
    }
}
