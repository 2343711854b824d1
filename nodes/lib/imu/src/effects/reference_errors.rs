//! What errors of a reference leave in the readings of a sensor.

use cromosim_spatial::{ErrorPath, PoseEstimate, Stamp};

use super::{Effect, EffectKind, EffectSet, low_pass};
use crate::SampleVariance;

impl EffectSet {
    /// Variances that errors of a reference leave at the stamps, in order, behind lever arm, soft tissue
    /// and low-pass; its positions are in units of which a metre has so many.
    pub fn reference_variances(
        &self,
        estimate: &PoseEstimate,
        units_per_metre: f64,
        stamps: &[Stamp],
    ) -> Vec<SampleVariance> {
        let (low_pass, tissue) = (
            self.get(EffectKind::LowPass),
            self.get(EffectKind::SoftTissue),
        );
        let passed = |hz: f64| {
            let device = low_pass.map_or(1.0, |effect| {
                low_pass::response(effect.scalar(0), hz).0.powi(2)
            });
            [
                device,
                device * tissue.map_or(1.0, |effect| tissue_power(effect, hz)),
            ]
        };
        let path = ErrorPath {
            units_per_metre,
            lever_arm_m: self.lever_arm().norm(),
            passed: &passed,
        };
        estimate.variances(stamps, &path)
    }
}

/// Part of a force's power at a frequency that comes through soft tissue:
/// `(1 + (2 z r)^2) / ((1 - r^2)^2 + (2 z r)^2)`, r the frequency over the natural one.
fn tissue_power(tissue: &Effect, hz: f64) -> f64 {
    let ratio = hz / tissue.scalar(0);
    let damping = (2.0 * tissue.scalar(1) * ratio).powi(2);
    (1.0 + damping) / ((1.0 - ratio * ratio).powi(2) + damping)
}
