//! What the analysis of a placement found, before it is put into numbers and words.

use cromosim_imu::{Channel, EffectKind, EffectSet, PerChannel};

use crate::diagnosis::GapLocation;
use crate::digital::Digital;
use crate::fit::FitModel;
use crate::library::Library;
use crate::search::ScoredEffectSet;

/// What the analysis found, before it is put into words.
pub(crate) struct Findings<'a> {
    pub model: FitModel<'a>,
    pub scored: ScoredEffectSet,
    pub digital: PerChannel<Digital>,
    /// White noise per sample that the residual shows, in SI units.
    pub found_noise: PerChannel<f64>,
    /// All named causes but `unknown`.
    pub reportable: EffectSet,
    pub library: Library,
    /// What none of them explains.
    pub unknown: Option<Unknown>,
    /// Whether little is unknown against what the found effects explain: then calibrations among
    /// these are not confounded with it.
    pub is_mostly_explained: bool,
}

/// Structure that no named effect explains.
#[derive(Clone, Debug)]
pub(crate) struct Unknown {
    pub location: GapLocation,
    pub channel: &'static str,
    pub axes: Vec<String>,
    pub depends_on: &'static str,
    pub probability: f64,
    /// Part of the rest that regressions predict on held-out time, or, without any, that stands out
    /// of the noise.
    pub predictable: f64,
    /// Fitted effects that only pass for it.
    pub confounded_effects: Vec<EffectKind>,
}

impl Findings<'_> {
    /// Brings the reported effects to the values of the fit.
    pub fn take_fitted_values(&mut self) {
        for effect in self.scored.fit.set.iter() {
            if self.reportable.contains(effect.kind()) {
                self.reportable.insert(effect.clone());
            }
        }
    }

    /// Declared white noise per sample in SI units; where unknown, the found one counts as
    /// declared.
    pub fn declared_sigma(&self, channel: Channel) -> f64 {
        self.model.prepared.declared[channel].unwrap_or(self.found_noise[channel])
    }
}
