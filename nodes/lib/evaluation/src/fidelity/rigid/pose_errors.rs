//! What sources make of the poses of rigid bodies.

use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_imu::{MountedSensor, Placement, SensorTrajectory, normal_pair};
use cromosim_learned::SourceErrors;
use cromosim_motion::embedded_walk;
use cromosim_spatial::{PoseSource, Stamp, so3};
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::Deserialize;

use super::truth::POSITIONS;
use crate::EvaluationError;
use crate::low_pass::ZeroPhaseLowPass;
use crate::seeds::mixed_seed;

/// The body's sites that stand for [`POSITIONS`].
const SITES: [&str; 6] = [
    "left_watch",
    "left_upper_arm",
    "sacrum",
    "left_thigh_lateral",
    "left_instep",
    "forehead",
];
/// Slow errors forget themselves in this time, s, as those of `cromosim_learned::SourceErrors`.
const MEMORY_S: f64 = 0.7;
/// The drift of an inertial suit's orientations, s: magnetometer and contact pull it back.
const DRIFT_MEMORY_S: f64 = 4.0;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Where poses come from, which decides how wrong they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseErrors {
    /// Optical markers on the body itself: white, 0.3 to 1 mm and 0.1 to 0.3 degrees.
    Markers,
    /// A skeleton fitted to markers and smoothed before it is handed out: errors of 0.5 to 1.5 mm
    /// and 0.2 to 0.5 degrees within 6 to 10 Hz (zero-phase Butterworth), upon slow ones of 2 to 5
    /// mm and 0.5 to 1.5 degrees.
    MarkerFit,
    /// A suit of IMUs: orientations drift by 1 to 3 degrees and scatter by 0.1 to 0.2, positions along
    /// the chain of segments by 10 to 20 mm and 0.5 to 1 mm.
    InertialSuit,
    /// Video by VIBE: the errors that `cromosim_learned::SourceErrors::VIBE` draws on the embedded
    /// walk at the same position.
    Vibe,
    /// Video by WHAM, likewise.
    Wham,
}

/// The error of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PoseError {
    /// Of the position, world axes, m.
    shift: Vector3<f64>,
    /// Of the rotation, sensor axes, rad.
    turn: Vector3<f64>,
}

impl PoseError {
    /// The pose with the error.
    pub fn apply(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(
            (pose.translation.vector + self.shift).into(),
            pose.rotation * so3::exp(&self.turn),
        )
    }
}

impl PoseErrors {
    /// What a simulation is told of where the poses come from.
    pub(super) fn source(self) -> PoseSource {
        match self {
            Self::Markers => PoseSource::Tracked,
            Self::MarkerFit => PoseSource::Fitted,
            Self::InertialSuit => PoseSource::InertialSuit,
            Self::Vibe | Self::Wham => PoseSource::Video,
        }
    }

    /// Whether they are those of a body's site, rather than of anything that is tracked by itself.
    pub(super) fn needs_body(self) -> bool {
        matches!(self, Self::Vibe | Self::Wham)
    }

    /// Errors of `frames` frames at each of [`POSITIONS`]; the same for the same seed.
    ///
    /// # Errors
    /// Those of the body that video's errors are drawn on.
    pub(super) fn draw(
        self,
        frames: usize,
        rate_hz: f64,
        seed: u64,
    ) -> Result<Vec<Vec<PoseError>>, EvaluationError> {
        let video = match self {
            Self::Vibe => SourceErrors::VIBE,
            Self::Wham => SourceErrors::WHAM,
            _ => {
                let one = |position: usize| {
                    self.of_body(frames, rate_hz, mixed_seed(&[seed, position as u64]))
                };
                return Ok((0..POSITIONS.len()).map(one).collect());
            }
        };
        of_video(SourceErrors { rate_hz, ..video }, frames, seed)
    }

    /// Those of a body that is tracked by itself.
    fn of_body(self, frames: usize, rate_hz: f64, seed: u64) -> Vec<PoseError> {
        let mut draws = Draws {
            random: ChaCha12Rng::seed_from_u64(seed),
            frames,
            rate_hz,
        };
        let (fast, slow) = match self {
            Self::Markers => {
                let white = [draws.size(0.3e-3, 1e-3), draws.size(0.1, 0.3) * DEGREE];
                (white.map(|size| draws.white(size)), None)
            }
            Self::MarkerFit => {
                let cutoff_hz = draws.size(6.0, 10.0);
                let sizes = [draws.size(0.5e-3, 1.5e-3), draws.size(0.2, 0.5) * DEGREE];
                let slow = [draws.size(2e-3, 5e-3), draws.size(0.5, 1.5) * DEGREE];
                let fast = sizes.map(|size| draws.low_passed(size, cutoff_hz));
                (fast, Some(slow.map(|size| draws.slow(size, MEMORY_S))))
            }
            _ => {
                let white = [draws.size(0.5e-3, 1e-3), draws.size(0.1, 0.2) * DEGREE];
                let (place, turn) = (draws.size(10e-3, 20e-3), draws.size(1.0, 3.0) * DEGREE);
                let slow = [
                    draws.slow(place, MEMORY_S),
                    draws.slow(turn, DRIFT_MEMORY_S),
                ];
                (white.map(|size| draws.white(size)), Some(slow))
            }
        };
        let sum = |quantity: usize, frame: usize| {
            let slow = slow.as_ref().map(|slow| slow[quantity][frame]);
            fast[quantity][frame] + slow.unwrap_or_default()
        };
        (0..frames)
            .map(|frame| PoseError {
                shift: sum(0, frame),
                turn: sum(1, frame),
            })
            .collect()
    }
}

/// Random numbers for one body.
struct Draws {
    random: ChaCha12Rng,
    frames: usize,
    rate_hz: f64,
}

impl Draws {
    /// A size within a range; its logarithm is uniform.
    fn size(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.random.random::<f64>())
    }

    fn normal(&mut self) -> Vector3<f64> {
        let ([x, y], [z, _]) = (normal_pair(&mut self.random), normal_pair(&mut self.random));
        Vector3::new(x, y, z)
    }

    /// Independent from frame to frame; standard deviation per axis.
    fn white(&mut self, size: f64) -> Vec<Vector3<f64>> {
        (0..self.frames).map(|_| self.normal() * size).collect()
    }

    /// White noise through a low-pass; root mean square per axis behind it.
    fn low_passed(&mut self, size: f64, cutoff_hz: f64) -> Vec<Vector3<f64>> {
        let filter = ZeroPhaseLowPass::new(cutoff_hz, self.rate_hz);
        let mut values = self.white(1.0);
        for axis in 0..3 {
            let mut series: Vec<f64> = values.iter().map(|value| value[axis]).collect();
            filter.both_ways(&mut series);
            let square = series.iter().map(|value| value * value).sum::<f64>();
            let scale = size / (square / series.len() as f64).sqrt();
            values
                .iter_mut()
                .zip(series)
                .for_each(|(value, own)| value[axis] = own * scale);
        }
        values
    }

    /// Two first-order lags behind white noise, so that it has a velocity; standard deviation per
    /// axis.
    fn slow(&mut self, size: f64, memory_s: f64) -> Vec<Vector3<f64>> {
        let keep = (-1.0 / (memory_s * self.rate_hz)).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        // The second lag's standard deviation behind a first of 1.
        let scale = size * (1.0 + keep) / (1.0 + keep * keep).sqrt();
        let (mut first, mut second) = (self.normal(), Vector3::zeros());
        // Until it has forgotten where it began.
        let before = (6.0 * memory_s * self.rate_hz) as usize;
        let mut all = Vec::with_capacity(self.frames);
        for step in 0..before + self.frames {
            first = first * keep + self.normal() * fresh;
            second = second * keep + first * (1.0 - keep);
            if step >= before {
                all.push(second * scale);
            }
        }
        all
    }
}

/// What video's errors do to the sites of a body: those of the embedded walk, over and over.
fn of_video(
    errors: SourceErrors,
    frames: usize,
    seed: u64,
) -> Result<Vec<Vec<PoseError>>, EvaluationError> {
    let walk = embedded_walk();
    let body = ShapedBody::new(BodyModel::embedded(), &walk.betas)?;
    let step = walk.rate_hz / errors.rate_hz;
    let pose = |k: usize| -> &BodyPose {
        &walk.frames[(k as f64 * step).round() as usize % walk.frames.len()]
    };
    let poses: Vec<BodyPose> = (0..frames).map(|k| pose(k).clone()).collect();
    let stamps: Vec<Stamp> = (0..frames)
        .map(|k| Stamp::from_seconds(k as f64 / errors.rate_hz))
        .collect();
    let degraded = errors.degrade(&body, &poses, seed);
    let at_site = |site: &&str| {
        let placement =
            Placement::at_site(site, site, errors.rate_hz).map_err(|(field, problem)| {
                EvaluationError::Site {
                    site: (*site).to_owned(),
                    field,
                    problem: problem.to_string(),
                }
            })?;
        let mounted = MountedSensor::new(&body, &placement)?;
        let true_frames = mounted.trajectory(&stamps, &poses)?;
        let seen = mounted.trajectory(&stamps, &degraded)?;
        Ok(differences(&true_frames, &seen))
    };
    SITES.iter().map(at_site).collect()
}

fn differences(true_frames: &SensorTrajectory, seen: &SensorTrajectory) -> Vec<PoseError> {
    let pairs = true_frames.frames().iter().zip(seen.frames());
    pairs
        .map(|(own, seen)| {
            let (own, seen) = (own.world_from_sensor, seen.world_from_sensor);
            PoseError {
                shift: seen.translation.vector - own.translation.vector,
                turn: so3::log(&(own.rotation.inverse() * seen.rotation)),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn rms(errors: &[PoseError], of: impl Fn(&PoseError) -> Vector3<f64>) -> f64 {
        let sum: f64 = errors.iter().map(|error| of(error).norm_squared()).sum();
        (sum / (3.0 * errors.len() as f64)).sqrt()
    }

    #[test]
    fn errors_have_their_size_and_come_again() {
        for (kind, rate_hz, place, turn) in [
            (PoseErrors::Markers, 120.0, [0.28e-3, 1.05e-3], [0.09, 0.32]),
            (PoseErrors::MarkerFit, 120.0, [1e-3, 8e-3], [0.3, 2.5]),
            (PoseErrors::InertialSuit, 60.0, [5e-3, 30e-3], [0.4, 6.0]),
            (PoseErrors::Vibe, 30.0, [0.03, 0.4], [1.0, 20.0]),
            (PoseErrors::Wham, 30.0, [0.02, 0.3], [0.5, 15.0]),
        ] {
            let drawn = kind.draw(900, rate_hz, 4).unwrap();
            assert_eq!((drawn.len(), drawn[0].len()), (6, 900));
            for errors in &drawn {
                let found = [
                    rms(errors, |error| error.shift),
                    rms(errors, |error| error.turn) / DEGREE,
                ];
                assert!(
                    (place[0]..place[1]).contains(&found[0])
                        && (turn[0]..turn[1]).contains(&found[1]),
                    "{kind:?}: {found:?}"
                );
            }
            assert_eq!(drawn, kind.draw(900, rate_hz, 4).unwrap());
            assert_ne!(drawn, kind.draw(900, rate_hz, 5).unwrap());
        }
    }

    #[test]
    fn an_error_shifts_in_the_world_and_turns_in_the_sensor() {
        let pose = Isometry3::new(Vector3::x(), Vector3::z() * 1.5);
        let error = PoseError {
            shift: Vector3::y() * 0.1,
            turn: Vector3::x() * 0.2,
        };
        let found = error.apply(&pose);
        assert!((found.translation.vector - Vector3::new(1.0, 0.1, 0.0)).norm() < 1e-12);
        let turned = so3::log(&(pose.rotation.inverse() * found.rotation));
        assert!((turned - error.turn).norm() < 1e-12);
        assert_eq!(PoseError::default().apply(&pose), pose);
    }
}
