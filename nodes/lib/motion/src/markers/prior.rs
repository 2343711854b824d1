//! What a pose is likely to be where markers do not say: near an easy stance, the joints that bend
//! little kept tighter.

use cromosim_body::{BodyPose, JOINT_COUNT, Joint};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A joint that bends one way only: elbows and knees.
pub(super) struct Hinge {
    pub joint: usize,
    /// The axis of the joint that it bends about, and the sign of bending.
    pub axis: usize,
    pub sign: f64,
}

/// How far a hinge may be overstretched before it costs, and the standard deviation beyond, rad.
const OVERSTRETCH: f64 = 0.1;
const OVERSTRETCH_SIGMA: f64 = 0.1;

impl Hinge {
    /// By how much the hinge is overstretched (negative, rad, 0 where it is not), how that changes
    /// with a turn of the joint in its own axes, and the precision.
    pub fn overstretch(&self, rotation: &UnitQuaternion<f64>) -> (f64, Vector3<f64>, f64) {
        let vector = rotation.scaled_axis();
        let over = (self.sign * vector[self.axis] + OVERSTRETCH).min(0.0);
        let row = if over < 0.0 {
            right_jacobian_inverse(vector).row(self.axis).transpose() * self.sign
        } else {
            Vector3::zeros()
        };
        (over, row, OVERSTRETCH_SIGMA.powi(-2))
    }
}

/// The hinges: elbows bend forwards (about y), knees backwards (about x).
pub(super) const HINGES: [Hinge; 4] = [
    Hinge {
        joint: Joint::LeftElbow.index(),
        axis: 1,
        sign: -1.0,
    },
    Hinge {
        joint: Joint::RightElbow.index(),
        axis: 1,
        sign: 1.0,
    },
    Hinge {
        joint: Joint::LeftKnee.index(),
        axis: 0,
        sign: 1.0,
    },
    Hinge {
        joint: Joint::RightKnee.index(),
        axis: 0,
        sign: 1.0,
    },
];

/// Independent normal distributions of the joints' rotation vectors about a mean pose.
pub(super) struct PosePrior {
    pub means: [UnitQuaternion<f64>; JOINT_COUNT],
    /// 1 / variance about each of the joint's axes, 1/rad^2; 0 for the pelvis.
    pub precisions: [Vector3<f64>; JOINT_COUNT],
}

impl PosePrior {
    /// Arms down and a little bent, knees nearly straight. Spine, hands and toes are held: a few
    /// markers say little about them.
    pub fn standing() -> Self {
        let mut prior = Self {
            means: [UnitQuaternion::identity(); JOINT_COUNT],
            precisions: [Vector3::zeros(); JOINT_COUNT],
        };
        for joint in Joint::ALL {
            let side = if joint.name().starts_with("left") {
                1.0
            } else {
                -1.0
            };
            // Mean rotation vector and standard deviations, rad: x left, y up, z forward in T-pose.
            let (mean, sigma) = match joint
                .name()
                .trim_start_matches("left_")
                .trim_start_matches("right_")
            {
                "pelvis" => continue,
                "hip" => ([-0.15, 0.0, 0.0], [0.7, 0.4, 0.35]),
                "knee" => ([0.3, 0.0, 0.0], [0.8, 0.15, 0.1]),
                "ankle" => ([0.0, 0.0, 0.0], [0.4, 0.25, 0.25]),
                "foot" => ([0.0, 0.0, 0.0], [0.2, 0.03, 0.03]),
                "neck" | "head" => ([0.0, 0.0, 0.0], [0.25, 0.25, 0.2]),
                "collar" => ([0.0, 0.0, 0.0], [0.05, 0.2, 0.2]),
                "shoulder" => ([0.0, 0.0, -0.9 * side], [0.7, 0.8, 0.9]),
                "elbow" => ([0.0, -0.4 * side, 0.0], [0.5, 0.9, 0.2]),
                "wrist" => ([0.0, 0.0, 0.0], [0.3, 0.3, 0.4]),
                "hand" => ([0.0, 0.0, 0.0], [0.02, 0.02, 0.02]),
                _ => ([0.0, 0.0, 0.0], [0.2, 0.15, 0.15]),
            };
            prior.means[joint.index()] = UnitQuaternion::from_scaled_axis(Vector3::from(mean));
            prior.precisions[joint.index()] = Vector3::from(sigma).map(|sigma: f64| sigma.powi(-2));
        }
        prior
    }

    /// The mean pose, the pelvis at the origin.
    pub fn mean_pose(&self) -> BodyPose {
        BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: self.means,
        }
    }
}

/// From a rotation vector f to the derivative of `log(exp(f) exp(d))` by d at 0: the inverse of
/// SO(3)'s right Jacobian.
pub(super) fn right_jacobian_inverse(f: Vector3<f64>) -> Matrix3<f64> {
    let (angle, skew) = (f.norm(), f.cross_matrix());
    // sin is small near 0 and near a full half turn; the series serves the first, and the second is
    // capped.
    let factor = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin().max(1e-6))
    };
    Matrix3::identity() + skew * 0.5 + skew * skew * factor
}
