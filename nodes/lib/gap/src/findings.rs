//! What the analysis of a placement found, before it is put into numbers and words.

use cromosim_imu::{Channel, Dependence, EffectKind, EffectSet, PerChannel};

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
    /// The most of it that the residual leaves room for.
    pub most_noise: PerChannel<f64>,
    /// All named causes but `unknown`.
    pub reportable: EffectSet,
    /// Fitted effects that were taken out, as they might only pass for what is unknown.
    pub struck: Vec<EffectKind>,
    /// A fit of the named causes, most with their values as they are, and of what a simulation takes
    /// over beside them; none where that is nothing.
    pub kept: Option<Fit>,
    pub library: Library,
    /// What none of them explains.
    pub unknown: Option<Unknown>,
    /// Whether more is left than the noise that is expected, whatever it is.
    pub is_loud: bool,
    /// Whether little is unknown against what the found effects explain: then calibrations among
    /// these are not confounded with it.
    pub is_mostly_explained: bool,
    /// Whether the found effects explain little of the gap: then these may be a part of what is unknown.
    pub is_hardly_explained: bool,
}

/// Structure that no named effect explains.
#[derive(Clone, Debug)]
pub(crate) struct Unknown {
    pub location: GapLocation,
    pub channel: &'static str,
    pub axes: Vec<String>,
    pub depends_on: &'static str,
    /// What a regression predicts, the strongest first.
    pub dependences: Vec<ResidualDependence>,
    pub probability: f64,
    /// Part of the rest that regressions predict on held-out time, or, without any, that stands out
    /// of the noise.
    pub predictable: f64,
    /// Fitted effects that only pass for it.
    pub confounded_effects: Vec<EffectKind>,
    /// Those that stand beside it.
    pub sound_effects: Vec<EffectKind>,
}

/// What a channel's rest depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResidualDependence {
    pub dependence: Dependence,
    pub channel: Channel,
    /// Part of the rest that a regression on it predicts on held-out time.
    pub share: f64,
}

impl Findings<'_> {
    /// What is no cause, but taken over all the same.
    pub fn kept_calibrations(&self) -> EffectSet {
        self.kept.as_ref().map_or_else(EffectSet::new, |fit| {
            fit.set
                .filtered(|effect| !self.reportable.contains(effect.kind()))
        })
    }

    /// All that a simulation takes over: causes and calibrations.
    pub fn applied(&self) -> EffectSet {
        let mut set = self.reportable.clone();
        set.extend(&self.kept_calibrations());
        set
    }

    /// The same with the values that a fit to all parts of time but one has.
    pub fn applied_excluding_fold(&self, fold: usize) -> EffectSet {
        let mut set = self.reportable.clone();
        set.take_values_of(&self.scored.fit.excluding_fold(fold));
        if let Some(kept) = &self.kept {
            let is_its = |kind: EffectKind| !self.reportable.contains(kind) || kept.moves(kind);
            let values = kept.excluding_fold(fold);
            set.extend(&values.filtered(|effect| is_its(effect.kind())));
        }
        set
    }

    /// The fit that the values of a named cause are of.
    pub fn fit_of(&self, kind: EffectKind) -> &Fit {
        let kept = self.kept.as_ref().filter(|kept| kept.moves(kind));
        kept.unwrap_or(&self.scored.fit)
    }

    /// Brings the reported effects to the values of the fit.
    pub fn take_fitted_values(&mut self) {
        self.reportable.take_values_of(&self.scored.fit.set);
    }

    /// Declared white noise per sample in SI units; where unknown, the found one counts as
    /// declared.
    pub fn declared_sigma(&self, channel: Channel) -> f64 {
        self.model.prepared.declared[channel].unwrap_or(self.found_noise[channel])
    }

    /// White noise per sample that a simulation of the device has, in SI units: what it declares, or less where
    /// its readings scatter less. Steps hide how much they scatter; what was found of it where nothing is declared
    /// has their rounding (step^2 / 12) in it, which a simulation has of its own.
    pub fn simulated_sigma(&self, channel: Channel) -> f64 {
        let declared = self.declared_sigma(channel);
        let step = self.applied().lsb(channel);
        let is_declared = self.model.prepared.declared[channel].is_some();
        match self.digital[channel].lsb {
            Some(_) if is_declared => declared,
            Some(_) => (declared.powi(2) - step.powi(2) / 12.0).max(0.0).sqrt(),
            None => declared.min(self.most_noise[channel]),
        }
    }
}
