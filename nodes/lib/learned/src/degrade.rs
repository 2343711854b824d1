//! Motion as worse sources give it: errors of published size on a motion that is known.

use cromosim_body::{BodyPose, JOINT_COUNT, ShapedBody};
use cromosim_imu::normal_pair;
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

/// Slow errors forget themselves in this time, s.
const MEMORY: f64 = 0.7;
/// Amplitudes are fitted in as many rounds.
const ROUNDS: usize = 6;
/// Acceleration errors are published at this rate, Hz.
const PUBLISHED_RATE_HZ: f64 = 30.0;

/// Errors of a source, in the measures of its literature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceErrors {
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// Mean distance of the joints from the true ones with the pelvis laid on the true one, m
    /// (MPJPE).
    pub joints: f64,
    /// Mean length of the second difference of the same error at 30 Hz, m per frame^2.
    pub joint_acceleration: f64,
    /// Slow error of the root's position, standard deviation per axis, m.
    pub root: f64,
    /// Its scatter from frame to frame, standard deviation per axis, m.
    pub root_jitter: f64,
}

impl SourceErrors {
    /// VIBE on 3DPW (Kocabas et al. 2020, table 1: MPJPE 82.9 mm, acceleration error 23.4 mm per
    /// frame^2), placed in the world by depth.
    pub const VIBE: Self = Self {
        rate_hz: 30.0,
        joints: 0.0829,
        joint_acceleration: 0.0234,
        root: 0.15,
        root_jitter: 0.005,
    };
    /// WHAM on 3DPW (Shin et al. 2024, table 1: MPJPE 57.8 mm, 6.6 m/s2 = 7.3 mm per frame^2 at 30
    /// Hz).
    pub const WHAM: Self = Self {
        rate_hz: 30.0,
        joints: 0.0578,
        joint_acceleration: 0.0073,
        root: 0.10,
        root_jitter: 0.003,
    };
    /// Optical motion capture after a fit to markers: joints within some millimetres, little
    /// scatter.
    pub const MOCAP: Self = Self {
        rate_hz: 120.0,
        joints: 0.005,
        joint_acceleration: 0.0008,
        root: 0.001,
        root_jitter: 0.0002,
    };

    /// The motion with these errors, frame by frame (the rate of `poses` must be that of the
    /// source). Each joint's rotation is turned by a slow error (two first-order lags of 0.7 s
    /// behind white noise, so that it has a velocity) and by white scatter; the two amplitudes are
    /// the same for all joints and chosen so that both published figures come out on this very
    /// motion.
    pub fn degrade(&self, body: &ShapedBody, poses: &[BodyPose], seed: u64) -> Vec<BodyPose> {
        let noise = Noise::draw(poses.len(), self.rate_hz, seed);
        let (mut slow, mut jitter) = (0.05, 0.01);
        for _ in 0..ROUNDS {
            let (joints, acceleration) =
                self.measure(body, poses, &noise.turned(poses, slow, jitter));
            // The slow part carries the distance, the scatter the acceleration; each of them a
            // little of the other, hence the rounds.
            slow *= ratio(self.joints, joints);
            jitter *= ratio(self.joint_acceleration, acceleration);
        }
        let mut degraded = noise.turned(poses, slow, jitter);
        for (frame, pose) in degraded.iter_mut().enumerate() {
            pose.root_position += noise.slow[frame][JOINT_COUNT] * self.root
                + noise.white[frame][JOINT_COUNT] * self.root_jitter;
        }
        degraded
    }

    /// MPJPE, m, and the error's second difference at 30 Hz, m per frame^2.
    pub fn measure(
        &self,
        body: &ShapedBody,
        truth: &[BodyPose],
        degraded: &[BodyPose],
    ) -> (f64, f64) {
        let joints = |pose: &BodyPose| {
            let segments = body.world_from_segments(pose);
            segments.map(|segment| segment.translation.vector - segments[0].translation.vector)
        };
        let errors: Vec<[Vector3<f64>; JOINT_COUNT]> = truth
            .iter()
            .zip(degraded)
            .map(|(truth, degraded)| {
                let (truth, degraded) = (joints(truth), joints(degraded));
                std::array::from_fn(|joint| degraded[joint] - truth[joint])
            })
            .collect();
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) =
                values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let distance = mean(&mut errors.iter().flatten().map(Vector3::norm));
        let step = (self.rate_hz / PUBLISHED_RATE_HZ).round().max(1.0) as usize;
        let second = |window: &[[Vector3<f64>; JOINT_COUNT]]| -> [f64; JOINT_COUNT] {
            std::array::from_fn(|joint| {
                (window[0][joint] - 2.0 * window[step][joint] + window[2 * step][joint]).norm()
            })
        };
        (
            distance,
            mean(&mut errors.windows(2 * step + 1).flat_map(second)),
        )
    }
}

fn ratio(wanted: f64, found: f64) -> f64 {
    if found > 0.0 {
        (wanted / found).clamp(0.1, 10.0)
    } else {
        1.0
    }
}

/// Standard normal numbers: one vector for each joint, and one for the root's position.
struct Noise {
    slow: Vec<[Vector3<f64>; JOINT_COUNT + 1]>,
    white: Vec<[Vector3<f64>; JOINT_COUNT + 1]>,
}

impl Noise {
    fn draw(frames: usize, rate_hz: f64, seed: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut vectors = || -> [Vector3<f64>; JOINT_COUNT + 1] {
            std::array::from_fn(|_| {
                let ([x, y], [z, _]) = (normal_pair(&mut random), normal_pair(&mut random));
                Vector3::new(x, y, z)
            })
        };
        let keep = (-1.0 / (MEMORY * rate_hz)).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        // The second lag's standard deviation behind a first of 1.
        let size = (1.0 + keep * keep).sqrt() / (1.0 + keep);
        let (mut first, mut second) = (vectors(), [Vector3::zeros(); JOINT_COUNT + 1]);
        let mut step = |vectors: &mut dyn FnMut() -> [Vector3<f64>; JOINT_COUNT + 1]| {
            let new = vectors();
            first = std::array::from_fn(|joint| first[joint] * keep + new[joint] * fresh);
            second =
                std::array::from_fn(|joint| second[joint] * keep + first[joint] * (1.0 - keep));
            second.map(|value| value / size)
        };
        // Until it has forgotten where it began.
        for _ in 0..(6.0 * MEMORY * rate_hz) as usize {
            step(&mut vectors);
        }
        let (mut slow, mut white) = (Vec::with_capacity(frames), Vec::with_capacity(frames));
        for _ in 0..frames {
            slow.push(step(&mut vectors));
            white.push(vectors());
        }
        Self { slow, white }
    }

    fn turned(&self, poses: &[BodyPose], slow: f64, jitter: f64) -> Vec<BodyPose> {
        let turn = |(frame, pose): (usize, &BodyPose)| BodyPose {
            root_position: pose.root_position,
            local_rotations: std::array::from_fn(|joint| {
                let error = self.slow[frame][joint] * slow + self.white[frame][joint] * jitter;
                pose.local_rotations[joint] * UnitQuaternion::from_scaled_axis(error)
            }),
        };
        poses.iter().enumerate().map(turn).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;

    use super::*;

    fn walk(rate_hz: f64) -> (ShapedBody, Vec<BodyPose>) {
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let pose = |k: u32| {
            let t = f64::from(k) / rate_hz;
            let swing = |joint: usize| {
                Vector3::new((3.0 * t + joint as f64).sin(), (2.0 * t).cos(), 0.3) * 0.4
            };
            BodyPose::from_axis_angles(Vector3::new(t, 0.0, 1.0), &std::array::from_fn(swing))
        };
        (body, (0..(4.0 * rate_hz) as u32).map(pose).collect())
    }

    #[test]
    fn errors_have_the_published_size() {
        for errors in [SourceErrors::VIBE, SourceErrors::WHAM, SourceErrors::MOCAP] {
            let (body, poses) = walk(errors.rate_hz);
            let degraded = errors.degrade(&body, &poses, 3);
            let (joints, acceleration) = errors.measure(&body, &poses, &degraded);
            assert!(
                (joints / errors.joints - 1.0).abs() < 0.05,
                "{joints} for {}",
                errors.joints
            );
            assert!(
                (acceleration / errors.joint_acceleration - 1.0).abs() < 0.05,
                "{acceleration} for {}",
                errors.joint_acceleration
            );
            let away = poses
                .iter()
                .zip(&degraded)
                .map(|(a, b)| (a.root_position - b.root_position).norm_squared())
                .sum::<f64>();
            let root = (away / (3.0 * poses.len() as f64)).sqrt();
            assert!(
                root > 0.2 * errors.root && root < 3.0 * errors.root,
                "{root}"
            );
            assert_eq!(degraded, errors.degrade(&body, &poses, 3));
        }
    }
}
