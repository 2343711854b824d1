//! What the analysis of a placement found, before it is put into numbers and words.

use cromosim_imu::{Channel, EffectKind, EffectSet, PerChannel};

use crate::diagnosis::GapLocation;
use crate::digital::Digital;
use crate::fit::{Fit, FitModel};
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
    /// A fit of the named causes' values as they are, and of the calibrations that a simulation takes
    /// over beside them; none where there are none.
    pub kept: Option<Fit>,
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
    /// The calibrations that are no causes, but are taken over all the same.
    pub fn kept_calibrations(&self) -> EffectSet {
        let fitted = self.kept.iter().flat_map(|fit| fit.set.iter());
        fitted
            .filter(|effect| !self.reportable.contains(effect.kind()))
            .fold(EffectSet::new(), |set, effect| set.with(effect.clone()))
    }

    /// All that a simulation takes over: causes and calibrations.
    pub fn applied(&self) -> EffectSet {
        let kept = self.kept_calibrations();
        kept.iter().fold(self.reportable.clone(), |set, effect| {
            set.with(effect.clone())
        })
    }

    /// The same with the values that a fit to all parts of time but one has.
    pub fn applied_excluding_fold(&self, fold: usize) -> EffectSet {
        let mut set = self.applied();
        let named = self.scored.fit.excluding_fold(fold);
        let kept = self.kept.as_ref().map(|fit| fit.excluding_fold(fold));
        for kind in EffectKind::ALL {
            if !set.contains(kind) {
                continue;
            }
            let values = if self.reportable.contains(kind) {
                named.get(kind)
            } else {
                kept.as_ref().and_then(|kept| kept.get(kind))
            };
            if let Some(effect) = values {
                set.insert(effect.clone());
            }
        }
        set
    }

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
