//! The ways from poses of a rigid body to readings that are compared.

use cromosim_imu::{KinematicSample, Scheme, SensorTrajectory, simulate_kinematics};
use cromosim_spatial::Stamp;

use crate::EvaluationError;
use crate::fidelity::practice::{CUTOFFS_HZ, USUAL_CUTOFFS_HZ, is_below_half, practice};

/// A way from poses to readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RigidMethod {
    /// A scheme of ours, as `simulate --rigid --scheme` runs it.
    Scheme(Scheme),
    /// The practice with a cutoff, Hz.
    Practice(f64),
}

/// The scheme that is compared with the practice.
pub(super) const JUDGED: RigidMethod = RigidMethod::Scheme(Scheme::AdaptiveSpline);

impl RigidMethod {
    /// All that poses of a rate allow, in the order of the tables.
    pub fn all(rate_hz: f64) -> Vec<Self> {
        let schemes = [Scheme::Richardson, Scheme::Spline, Scheme::AdaptiveSpline];
        let practice = CUTOFFS_HZ
            .into_iter()
            .filter(|cutoff_hz| is_below_half(*cutoff_hz, rate_hz));
        schemes
            .map(Self::Scheme)
            .into_iter()
            .chain(practice.map(Self::Practice))
            .collect()
    }

    /// Those that the table of a glance has: all but cutoffs that are tried in hindsight alone.
    pub fn usual() -> Vec<Self> {
        let usual = |method: &Self| match method {
            Self::Scheme(_) => true,
            Self::Practice(cutoff_hz) => USUAL_CUTOFFS_HZ.contains(cutoff_hz),
        };
        Self::all(f64::INFINITY).into_iter().filter(usual).collect()
    }

    /// The name in tables.
    pub fn title(self) -> String {
        match self {
            Self::Scheme(scheme) => scheme.name().to_owned(),
            Self::Practice(cutoff_hz) => format!("practice, {cutoff_hz} Hz"),
        }
    }

    /// The cutoff of the practice, Hz.
    pub fn cutoff_hz(self) -> Option<f64> {
        match self {
            Self::Scheme(_) => None,
            Self::Practice(cutoff_hz) => Some(cutoff_hz),
        }
    }

    /// The motion at the stamps.
    ///
    /// # Errors
    /// Those of the scheme.
    pub fn simulate(
        self,
        trajectory: &SensorTrajectory,
        stamps: &[Stamp],
    ) -> Result<Vec<KinematicSample>, EvaluationError> {
        match self {
            Self::Scheme(scheme) => Ok(simulate_kinematics(trajectory, scheme, stamps)?),
            Self::Practice(cutoff_hz) => practice(trajectory, cutoff_hz, stamps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_poses_allow_low_cutoffs_alone() {
        let cutoffs = |rate_hz| -> Vec<f64> {
            let all = RigidMethod::all(rate_hz);
            all.into_iter().filter_map(RigidMethod::cutoff_hz).collect()
        };
        assert_eq!(cutoffs(30.0), [4.0, 6.0, 10.0]);
        assert_eq!(cutoffs(120.0).len(), CUTOFFS_HZ.len());
        assert_eq!(RigidMethod::usual().len(), 7);
    }
}
