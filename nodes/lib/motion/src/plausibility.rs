//! Whether people can move so: the quantities of a motion against the bounds of
//! [`cromosim_spatial::plausible`].

use cromosim_body::{BodyPose, Joint};
use cromosim_spatial::plausible::{
    BETA, Bound, JOINT_SPEED, LASTING_JOINT_SPEED, LASTING_PELVIS_ACCELERATION,
    LASTING_PELVIS_SPEED, Oddity, PELVIS_HEIGHT, PELVIS_SPEED,
};
use nalgebra::Vector3;

use crate::{MotionError, SmplMotion};

/// Shorter clips say nothing about what lasts, s.
const LASTING_S: f64 = 1.0;

/// The greatest of some values, with the frame before it.
fn greatest(values: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    let in_order = values.enumerate();
    in_order.max_by(|(_, one), (_, other)| one.total_cmp(other))
}

/// What half of them exceed; 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl SmplMotion {
    /// What is odd about it: each quantity at most once, where it is oddest.
    pub fn oddities(&self) -> Vec<Oddity> {
        let mut oddities = self.of_pelvis();
        oddities.extend(self.of_joints());
        // The file's own as well, where another body took their place.
        let of_file = self.poses.iter().flat_map(|report| &report.source_betas);
        let sizes = self.betas.iter().chain(of_file).map(|beta| beta.abs());
        let largest = greatest(sizes);
        oddities.extend(largest.and_then(|(_, size)| BETA.judge(size, "")));
        oddities
    }

    /// The motion, where a person can move so.
    ///
    /// # Errors
    /// [`MotionError::Impossible`], with the oddest place.
    pub(crate) fn possible(self) -> Result<Self, MotionError> {
        match self.oddities().into_iter().find(Oddity::is_impossible) {
            Some(oddity) => Err(MotionError::Impossible {
                name: self.name,
                oddity: Box::new(oddity),
            }),
            None => Ok(self),
        }
    }

    fn of_pelvis(&self) -> Vec<Oddity> {
        let positions: Vec<Vector3<f64>> =
            self.frames.iter().map(|pose| pose.root_position).collect();
        let speed = |pair: &[Vector3<f64>]| (pair[1] - pair[0]).norm() * self.rate_hz;
        let acceleration = |three: &[Vector3<f64>]| {
            (three[2] - 2.0 * three[1] + three[0]).norm() * self.rate_hz.powi(2)
        };
        let speeds = || positions.windows(2).map(speed);
        let fastest = greatest(speeds());
        let highest = greatest(positions.iter().map(|position| position.z));
        let lasts = self.duration_s() >= LASTING_S;
        let accelerations = positions.windows(3).map(acceleration);
        let judged = [
            fastest.and_then(|(frame, speed)| PELVIS_SPEED.judge(speed, between(frame))),
            lasts
                .then(|| median(speeds()))
                .and_then(|speed| LASTING_PELVIS_SPEED.judge(speed, "")),
            lasts
                .then(|| median(accelerations))
                .and_then(|median| LASTING_PELVIS_ACCELERATION.judge(median, "")),
            highest.and_then(|(frame, z)| PELVIS_HEIGHT.judge(z, format!("frame {frame}"))),
        ];
        judged.into_iter().flatten().collect()
    }

    fn of_joints(&self) -> Vec<Oddity> {
        // Of half the angle between neighbours the sine's square, which takes no more than products and
        // stands in the angles' order.
        let turned = |joint: usize, pair: &[BodyPose]| {
            let [from, to] = [0, 1].map(|frame| pair[frame].local_rotations[joint]);
            (from.inverse() * to).imag().norm_squared()
        };
        let speed = |turned: f64| 2.0 * turned.sqrt().min(1.0).asin() * self.rate_hz;
        let lasts = self.duration_s() >= LASTING_S;
        let (mut peaks, mut lasting) = (Vec::new(), Vec::new());
        for joint in Joint::ALL {
            let pairs = self.frames.windows(2);
            let turns: Vec<f64> = pairs.map(|pair| turned(joint.index(), pair)).collect();
            if let Some((frame, turn)) = greatest(turns.iter().copied()) {
                peaks.push((format!("{}, {}", joint.name(), between(frame)), speed(turn)));
            }
            if lasts {
                let median = speed(median(turns.into_iter()));
                lasting.push((joint.name().to_owned(), median));
            }
        }
        let worst = |bound: &'static Bound, values: Vec<(String, f64)>| {
            let oddest = values
                .into_iter()
                .max_by(|(_, one), (_, other)| one.total_cmp(other));
            oddest.and_then(|(place, value)| bound.judge(value, place))
        };
        let judged = [
            worst(&JOINT_SPEED, peaks),
            worst(&LASTING_JOINT_SPEED, lasting),
        ];
        judged.into_iter().flatten().collect()
    }
}

fn between(frame: usize) -> String {
    format!("frames {frame} and {}", frame + 1)
}
