//! Splines of position and rotation.

use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use crate::adaptive::{Adaptation, ExpectedNoise, FEWEST_ADAPTIVE, STATED_AT_HZ};
use crate::adaptive_fit::AdaptiveFit;
use crate::basis::BasisValues;
use crate::beyond::{Beyond, Cutoffs, Posterior};
use crate::grid::relative_seconds;
use crate::so3::{QUATERNION_PER_ROTVEC, ROTVEC_PER_QUATERNION};
use crate::spline::At;
use crate::{
    Bandwidth, Derivative, Jitter, PoseSource, SampleVariance, Smoothing, SmoothingSpline,
    SpatialError, SplineSystem, Stamp, so3,
};

/// How a frame moves at one time, against the world and in the world's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Rotation world_from_body.
    pub rotation: UnitQuaternion<f64>,
    /// Origin of the body in the world, m.
    pub position: Vector3<f64>,
    /// Of the origin in world axes, m/s.
    pub velocity: Vector3<f64>,
    /// Of the origin in world axes, m/s2; zero at rest.
    pub acceleration: Vector3<f64>,
    /// Against the world in world axes, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Its time derivative, rad/s2.
    pub angular_acceleration: Vector3<f64>,
}

/// Smoothing of the two halves of a [`PoseSpline`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSmoothing {
    /// Of the position; default: chosen for the acceleration.
    pub position: Smoothing,
    /// Of the rotation; default: chosen for the angular velocity.
    pub rotation: Smoothing,
}

impl PoseSmoothing {
    /// A low-pass of zero phase at this frequency for both, Hz, see [`Smoothing::CutoffHz`].
    pub const fn cutoff_hz(cutoff_hz: f64) -> Self {
        Self {
            position: Smoothing::CutoffHz(cutoff_hz),
            rotation: Smoothing::CutoffHz(cutoff_hz),
        }
    }

    /// Each as much as the poses around each time ask for, and where they do not say, as their
    /// source lets expect.
    pub fn adaptive(source: PoseSource) -> Self {
        let [position, rotation] = source
            .expected()
            .map(|expected| Smoothing::Adaptive { expected });
        Self { position, rotation }
    }

    /// The noise that is expected of both, where both are adaptive.
    fn expected(self) -> Option<[ExpectedNoise; 2]> {
        match (self.position, self.rotation) {
            (
                Smoothing::Adaptive { expected: position },
                Smoothing::Adaptive { expected: rotation },
            ) => Some([position, rotation]),
            _ => None,
        }
    }
}

impl Default for PoseSmoothing {
    /// As much as the samples ask for, so that acceleration and angular velocity err least.
    fn default() -> Self {
        Self {
            position: Smoothing::AutomaticFor(Derivative::Second),
            rotation: Smoothing::AutomaticFor(Derivative::First),
        }
    }
}

/// How a frame moves at one time, and what is known about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionEstimate {
    /// The motion.
    pub motion: Motion,
    /// How far it may be off, given the noise that was learnt of the poses; none but for
    /// [`Smoothing::Adaptive`] of both.
    pub variance: Option<SampleVariance>,
    /// Up to which frequency it is resolved.
    pub bandwidth: Bandwidth,
    /// The poses' noise around it, as white noise; none where `variance` is none.
    pub jitter: Option<Jitter>,
}

/// Standard deviations of a pose's noise along and about each axis, m and rad: see [`PoseSpline::noise_of`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseStd {
    /// As white as it is learnt to be around the pose.
    pub around: [f64; 2],
    /// With its own spectrum, where it is not white.
    pub own: [f64; 2],
}

/// What [`PoseSpline::fit_following`] has learnt of the poses so far.
#[derive(Clone, Debug, Default)]
pub struct PoseAdaptation(Option<Adaptation<2>>);

/// Poses that a spline is fitted to, wherever they lie.
pub trait PosesInTime {
    /// How many.
    fn count(&self) -> usize;

    /// world_from_body, m, of a number below [`PosesInTime::count`].
    fn pose(&self, number: usize) -> &Isometry3<f64>;
}

impl PosesInTime for [Isometry3<f64>] {
    fn count(&self) -> usize {
        self.len()
    }

    fn pose(&self, number: usize) -> &Isometry3<f64> {
        &self[number]
    }
}

impl PosesInTime for Vec<Isometry3<f64>> {
    fn count(&self) -> usize {
        self.len()
    }

    fn pose(&self, number: usize) -> &Isometry3<f64> {
        &self[number]
    }
}

/// Most series of poses that are fitted at once: position and rotation of two are four lanes, which fill a
/// register of AVX2. Of a clip of 870 poses each then takes 690 ns a pose rather than 920; four at once
/// take no less, and twice the memory, with AVX-512 too.
pub const POSES_AT_ONCE: usize = 2;

/// Number of channels of each lane, see [`pose_channels`].
fn channel_counts<const L: usize>() -> [usize; L] {
    std::array::from_fn(|lane| [3, 4][lane % 2])
}

/// The spline equations for a series of stamps; made once and shared by every series of poses on
/// them.
#[derive(Clone, Debug)]
pub struct PoseTimes {
    origin: Stamp,
    system: Arc<SplineSystem>,
}

impl PoseTimes {
    /// # Errors
    /// Fewer than two stamps, or stamps that do not increase.
    pub fn new(stamps: &[Stamp]) -> Result<Self, SpatialError> {
        let origin = stamps.first().copied().unwrap_or_default();
        let seconds = relative_seconds(stamps, origin);
        Ok(Self {
            origin,
            system: Arc::new(SplineSystem::new(&seconds)?),
        })
    }

    /// The same equations for other stamps, where these are as far apart; none where they are not.
    #[must_use]
    pub fn moved_to(&self, stamps: &[Stamp]) -> Option<Self> {
        let origin = *stamps.first()?;
        let seconds = relative_seconds(stamps, origin);
        self.system.is_at(&seconds).then(|| Self {
            origin,
            system: self.system.clone(),
        })
    }

    /// Where a stamp lies among the times; stamps outside them are moved to the nearest end.
    pub fn locate(&self, stamp: Stamp) -> Located {
        let seconds = stamp - self.origin;
        let (first, values) = self.system.equations.basis_at(seconds);
        Located {
            first,
            values,
            seconds,
            to_end_s: self.system.equations.to_nearer_end(seconds),
        }
    }

    /// The equations, with times in seconds since the first stamp.
    pub fn system(&self) -> &Arc<SplineSystem> {
        &self.system
    }
}

/// What every spline on the same times needs of a stamp: see [`PoseTimes::locate`].
#[derive(Clone, Copy, Debug)]
pub struct Located {
    /// The knot interval, and the first basis function over it.
    first: usize,
    values: BasisValues,
    /// Since the first sample, s.
    seconds: f64,
    /// To the nearer end of the samples, s.
    to_end_s: f64,
}

/// Position (3 channels) and rotation (the 4 components of the sign-continuous quaternion,
/// normalised afterwards) as smoothing quintic splines. With `s(t)` the quaternion spline: `R =
/// s/|s|`, `w = 2 vec(s' s*) / |s|^2`, world axes.
#[derive(Clone, Debug)]
pub struct PoseSpline {
    times: PoseTimes,
    position: SmoothingSpline<3>,
    rotation: SmoothingSpline<4>,
}

impl PoseSpline {
    /// Fits world_from_body poses.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`].
    pub fn fit(
        stamps: &[Stamp],
        world_from_body: &[Isometry3<f64>],
        smoothing: PoseSmoothing,
    ) -> Result<Self, SpatialError> {
        Self::fit_on(&PoseTimes::new(stamps)?, world_from_body, smoothing)
    }

    /// As [`PoseSpline::fit`], on times whose equations are made already.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`].
    pub fn fit_on(
        times: &PoseTimes,
        world_from_body: &[Isometry3<f64>],
        smoothing: PoseSmoothing,
    ) -> Result<Self, SpatialError> {
        if let Some(expected) = smoothing.expected()
            && world_from_body.len() >= FEWEST_ADAPTIVE
        {
            let [fitted] = Self::learn::<1, 2, 8, _>(times, [world_from_body], expected)?;
            return Ok(fitted);
        }
        let positions = position_channels(world_from_body);
        let rotations = rotation_channels(world_from_body);
        let position = SmoothingSpline::fit_on(&times.system, &positions, smoothing.position)?;
        let rotation = SmoothingSpline::fit_on(&times.system, &rotations, smoothing.rotation)?;
        Ok(Self {
            times: times.clone(),
            position,
            rotation,
        })
    }

    /// As [`PoseSpline::fit_on`] of several series of poses, each as if it were alone, to the last
    /// bit: up to [`POSES_AT_ONCE`] adaptive fits take their steps at the same time.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`], of any of them.
    pub fn fit_all_on<S: PosesInTime>(
        times: &PoseTimes,
        series: &[S],
        smoothing: PoseSmoothing,
    ) -> Result<Vec<Self>, SpatialError> {
        let long = series.iter().all(|poses| poses.count() >= FEWEST_ADAPTIVE);
        let Some(expected) = smoothing.expected().filter(|_| long) else {
            let poses =
                |series: &S| -> Vec<_> { (0..series.count()).map(|k| *series.pose(k)).collect() };
            let alone = |series: &S| Self::fit_on(times, &poses(series), smoothing);
            return series.iter().map(alone).collect();
        };
        let mut fitted = Vec::with_capacity(series.len());
        for series in series.chunks(POSES_AT_ONCE) {
            match series {
                [one, other] => {
                    fitted.extend(Self::learn::<2, 4, 16, _>(times, [one, other], expected)?)
                }
                alone => {
                    for poses in alone {
                        fitted.extend(Self::learn::<1, 2, 8, _>(times, [poses], expected)?);
                    }
                }
            }
        }
        Ok(fitted)
    }

    /// Adaptive fits of P series in L lanes, C channels in all.
    fn learn<const P: usize, const L: usize, const C: usize, S: PosesInTime + ?Sized>(
        times: &PoseTimes,
        series: [&S; P],
        expected: [ExpectedNoise; 2],
    ) -> Result<[Self; P], SpatialError> {
        let fit = AdaptiveFit::<C, L>::learn(
            &times.system.equations,
            pose_channels(series),
            channel_counts(),
            std::array::from_fn(|lane| expected[lane % 2]),
        )?;
        Ok(std::array::from_fn(|k| {
            let mut own = Self::of_lanes(times, &fit, k);
            if expected.iter().all(|it| it.low_passed.is_none()) {
                own.learn_colours(series[k]);
            }
            own
        }))
    }

    /// What the noise of the poses that this was fitted to is like.
    fn learn_colours(&mut self, poses: &(impl PosesInTime + ?Sized)) {
        self.position
            .learn_colour(|number, _| poses.pose(number).translation.vector.into());
        self.rotation.learn_colour(|number, near| {
            let quaternion: [f64; 4] = poses.pose(number).rotation.coords.into();
            let along: f64 = quaternion.iter().zip(near).map(|(a, b)| a * b).sum();
            quaternion.map(|component| component * along.signum())
        });
    }

    /// As [`PoseSpline::fit_on`] with [`PoseSmoothing::adaptive`], over a window of poses that moves
    /// on: what was learnt of a pose goes on with it, so that a move costs a fraction of a fit.
    /// `dropped` poses have left the window at its front since the last call.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`].
    pub fn fit_following(
        times: &PoseTimes,
        world_from_body: &[Isometry3<f64>],
        source: PoseSource,
        (adaptation, dropped): (&mut PoseAdaptation, usize),
    ) -> Result<Self, SpatialError> {
        let PoseAdaptation(learnt) = adaptation;
        if world_from_body.len() < FEWEST_ADAPTIVE {
            *learnt = None;
            return Self::fit_on(times, world_from_body, PoseSmoothing::adaptive(source));
        }
        let fit = AdaptiveFit::follow(
            &times.system.equations,
            pose_channels::<8, 1, _>([world_from_body]),
            channel_counts::<2>(),
            source.expected(),
            (learnt, dropped),
        )?;
        Ok(Self::of_lanes(times, &fit, 0))
    }

    /// Each pose's noise, as [`PoseSmoothing::adaptive`] learns it; none of too few poses. Standard deviations are those of white
    /// noise that leaves as much behind a low-pass of this bandwidth, Hz, in acceleration and angular velocity.
    ///
    /// # Errors
    /// As [`SmoothingSpline::fit`].
    pub fn noise_of(
        times: &PoseTimes,
        world_from_body: &[Isometry3<f64>],
        source: PoseSource,
        bandwidth_hz: f64,
    ) -> Result<Option<Vec<NoiseStd>>, SpatialError> {
        if world_from_body.len() < FEWEST_ADAPTIVE {
            return Ok(None);
        }
        let expected = source.expected();
        let [fitted] = Self::learn::<1, 2, 8, _>(times, [world_from_body], expected)?;
        let [position, rotation] = expected;
        let passed = |expected: ExpectedNoise, order: i32| {
            let low_passed = expected.low_passed;
            low_passed.map_or(1.0, |own| own.passed(order, bandwidth_hz).sqrt())
        };
        let (places, turns) = (passed(position, 2), passed(rotation, 1));
        let of_sample = |sample: usize| -> Option<NoiseStd> {
            let position = fitted.position.noise_behind(sample, 2, bandwidth_hz)?;
            let rotation = fitted.rotation.noise_behind(sample, 1, bandwidth_hz)?;
            let [around, own] = [0, 1].map(|which| {
                [
                    position[which].sqrt() * places,
                    rotation[which].sqrt() / QUATERNION_PER_ROTVEC * turns,
                ]
            });
            Some(NoiseStd { around, own })
        };
        Ok((0..world_from_body.len()).map(of_sample).collect())
    }

    /// Of series k of those that were fitted.
    fn of_lanes<const C: usize, const L: usize>(
        times: &PoseTimes,
        fit: &AdaptiveFit<C, L>,
        k: usize,
    ) -> Self {
        Self {
            times: times.clone(),
            position: SmoothingSpline::of_lane(&times.system, fit, 2 * k),
            rotation: SmoothingSpline::of_lane(&times.system, fit, 2 * k + 1),
        }
    }

    /// The motion at a stamp; stamps outside the samples are moved to the nearest end.
    pub fn evaluate(&self, stamp: Stamp) -> Motion {
        let Located { first, values, .. } = self.times.locate(stamp);
        self.motion(first, &values)
    }

    /// As [`PoseSpline::evaluate`], with what is known about it.
    pub fn estimate(&self, stamp: Stamp) -> MotionEstimate {
        self.estimate_at(&self.times.locate(stamp))
    }

    /// As [`PoseSpline::estimate`], at a stamp that the spline's times have located. It is compiled with what
    /// takes the estimate: its numbers would go through memory otherwise, which costs as much as they do.
    #[inline]
    pub fn estimate_at(&self, located: &Located) -> MotionEstimate {
        let (first, values) = (located.first, &located.values);
        let highest_hz = 0.5 / self.times.system.equations.interval;
        let cutoffs_hz = [
            self.position.cutoff_over(first),
            self.rotation.cutoff_over(first),
        ];
        let [acceleration_hz, angular_velocity_hz] = [0, 1].map(|k| {
            let shown_hz = [self.position.shown_hz(), self.rotation.shown_hz()][k];
            cutoffs_hz[k].min(highest_hz).min(shown_hz)
        });
        MotionEstimate {
            motion: self.motion(first, values),
            variance: self.variance(located, cutoffs_hz),
            bandwidth: Bandwidth {
                acceleration_hz,
                angular_velocity_hz,
            },
            jitter: self.jitter(first),
        }
    }

    #[inline]
    fn jitter(&self, first: usize) -> Option<Jitter> {
        let density = self.times.system.equations.interval * STATED_AT_HZ;
        Some(Jitter {
            position: density * self.position.noise_over(first)?,
            rotation: density * ROTVEC_PER_QUATERNION * self.rotation.noise_over(first)?,
        })
    }

    #[inline]
    fn motion(&self, first: usize, values: &BasisValues) -> Motion {
        let [position, velocity, acceleration] =
            self.position.combine(first, values).map(Vector3::from);
        let [s, s_dot, s_ddot] = self.rotation.combine(first, values).map(Quaternion::from);
        Motion {
            rotation: UnitQuaternion::new_normalize(s),
            position,
            velocity,
            acceleration,
            angular_velocity: so3::angular_velocity_in_world(&s, &s_dot),
            angular_acceleration: so3::angular_acceleration_in_world(&s, &s_dot, &s_ddot),
        }
    }

    #[inline]
    fn variance(
        &self,
        located: &Located,
        [position_hz, rotation_hz]: [f64; 2],
    ) -> Option<SampleVariance> {
        let Located {
            first,
            values: [value, slope, second],
            to_end_s,
            seconds,
        } = located;
        let (first, to_end_s) = (*first, *to_end_s);
        let at = |row, order, cutoff_hz| At {
            first,
            row,
            order,
            cutoff_hz,
            to_end_s,
        };
        let position = self.position.posterior(&at(second, 2, position_hz))?;
        let rotation = self.rotation.posterior(&at(slope, 1, rotation_hz))?;
        let orientation = self.rotation.posterior(&at(value, 0, rotation_hz))?;
        let (bends, turns) = (
            Cutoffs {
                smooth_hz: asked_hz(&position, position_hz),
                vigour_hz: self.position.vigour_cutoff_over(first),
            },
            Cutoffs {
                smooth_hz: asked_hz(&rotation, rotation_hz),
                vigour_hz: self.rotation.vigour_cutoff_over(first),
            },
        );
        let (bends_hz, turns_hz) = (bends.smooth_hz, turns.smooth_hz);
        let smoothed_off = [
            self.position.smoothed_off(Derivative::Second, *seconds),
            self.rotation.smoothed_off(Derivative::First, *seconds),
        ];
        let acceleration = Beyond::ACCELERATION.stated(position, bends) + smoothed_off[0];
        let angular_velocity = ROTVEC_PER_QUATERNION
            * (Beyond::ANGULAR_VELOCITY.stated(rotation, turns) + smoothed_off[1]);
        Some(SampleVariance {
            acceleration,
            angular_velocity,
            unseen: [
                acceleration - position.learnt(2, bends_hz),
                angular_velocity - ROTVEC_PER_QUATERNION * rotation.learnt(1, turns_hz),
            ],
            orientation: ROTVEC_PER_QUATERNION * orientation.of_noise(0, turns_hz),
        })
    }

    /// The spline of the position, m.
    pub fn position(&self) -> &SmoothingSpline<3> {
        &self.position
    }

    /// The spline of the quaternion (channels i, j, k, w; not normalised).
    pub fn rotation(&self) -> &SmoothingSpline<4> {
        &self.rotation
    }
}

/// The cutoff that says how much motion is beyond it, Hz, given that of the weight. Where noise was low-passed
/// before, weights soon ask for more than half the rate, and how much more says what of the motion no sample shows.
fn asked_hz(posterior: &Posterior, cutoff_hz: f64) -> f64 {
    match posterior.low_passed {
        Some(_) => cutoff_hz,
        None => cutoff_hz.min(0.5 / posterior.interval),
    }
}

/// The three channels of a pose series' position, m.
pub fn position_channels(world_from_body: &[Isometry3<f64>]) -> Vec<[f64; 3]> {
    world_from_body
        .iter()
        .map(|isometry| isometry.translation.vector.into())
        .collect()
}

/// The four channels (i, j, k, w) of a pose series' sign-continuous quaternion.
pub fn rotation_channels(world_from_body: &[Isometry3<f64>]) -> Vec<[f64; 4]> {
    let rotations = world_from_body.iter().map(|isometry| isometry.rotation);
    so3::with_continuous_signs(rotations)
        .map(|q| q.coords.into())
        .collect()
}

/// Both of each series in turn: its position and its rotation are a lane each. Of one series: x, i, y,
/// j, z, k, 0, w.
fn pose_channels<const C: usize, const P: usize, S: PosesInTime + ?Sized>(
    series: [&S; P],
) -> Vec<[f64; C]> {
    let count = series.iter().map(|poses| poses.count()).max().unwrap_or(0);
    let mut channels = vec![[0.0; C]; count];
    for (k, poses) in series.into_iter().enumerate() {
        let poses = (0..poses.count()).map(|number| poses.pose(number));
        let rotations = so3::with_continuous_signs(poses.clone().map(|pose| pose.rotation));
        for ((row, pose), rotation) in channels.iter_mut().zip(poses).zip(rotations) {
            let position: [f64; 3] = pose.translation.vector.into();
            for (axis, own) in position.into_iter().enumerate() {
                row[2 * P * axis + 2 * k] = own;
            }
            let rotation: [f64; 4] = rotation.coords.into();
            for (component, own) in rotation.into_iter().enumerate() {
                row[2 * P * component + 2 * k + 1] = own;
            }
        }
    }
    channels
}

#[cfg(test)]
#[path = "pose_spline_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "pose_spline_fitted_tests.rs"]
mod fitted_tests;
