//! Causal smoothing where a source is rough (video), off by default.

use cromosim_body::BodyPose;

/// First-order low-pass of position and rotations: y += (1 - exp(-2 pi f dt)) (x - y), rotations
/// along the shortest arc. Delays slow motion by 1 / (2 pi f).
pub struct Smoother {
    cutoff_hz: f64,
    last: Option<(i64, BodyPose)>,
}

impl Smoother {
    /// `cutoff_hz` = 0 turns smoothing off.
    pub fn new(cutoff_hz: f64) -> Self {
        Self {
            cutoff_hz,
            last: None,
        }
    }

    /// Forgets the last pose, so that the next one passes unchanged.
    pub fn restart(&mut self) {
        self.last = None;
    }

    /// The smoothed pose at the time `nanos`, ns.
    pub fn smooth(&mut self, nanos: i64, mut body: BodyPose) -> BodyPose {
        if self.cutoff_hz == 0.0 {
            return body;
        }
        if let Some((before, held)) = &self.last {
            let seconds = (nanos - before) as f64 * 1e-9;
            let gain = -(-std::f64::consts::TAU * self.cutoff_hz * seconds).exp_m1();
            body.root_position = held.root_position.lerp(&body.root_position, gain);
            for (new, old) in body.local_rotations.iter_mut().zip(&held.local_rotations) {
                // Half a turn between two poses has no shortest arc: then the new one is taken.
                *new = old.try_slerp(new, gain, 1e-9).unwrap_or(*new);
            }
        }
        self.last = Some((nanos, body.clone()));
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn off_is_identity_and_on_follows_a_step_as_the_formula_says() {
        let rest = BodyPose::rest(Vector3::zeros());
        let mut moved = BodyPose::rest(Vector3::new(1.0, 0.0, 0.0));
        moved.local_rotations[5] = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 1.0, 0.0));
        assert_eq!(Smoother::new(0.0).smooth(0, moved.clone()), moved);
        let mut smoother = Smoother::new(2.0);
        smoother.smooth(0, rest);
        let after = smoother.smooth(10_000_000, moved);
        let gain = 1.0 - (-std::f64::consts::TAU * 2.0 * 0.01_f64).exp();
        assert!((after.root_position.x - gain).abs() < 1e-12);
        assert!((after.local_rotations[5].angle() - gain).abs() < 1e-9);
    }
}
