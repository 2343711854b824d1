//! The effects that a diagnosis may name: all that `cromosim_imu` knows, less those that the caller
//! takes out.

use cromosim_imu::{EffectKind, EffectSet, ReadOff, Search};

/// The effects that a diagnosis may name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Library {
    excluded: Vec<EffectKind>,
}

impl Library {
    /// All effects but these.
    pub fn without(excluded: &[EffectKind]) -> Self {
        Self {
            excluded: excluded.to_vec(),
        }
    }

    /// Effects that are fitted to residuals, in the order in which the search tries them.
    pub fn fitted(&self) -> Vec<EffectKind> {
        EffectKind::ALL
            .into_iter()
            .filter(|kind| matches!(kind.spec().search, Search::Fitted(_)) && self.allows(*kind))
            .collect()
    }

    /// Whether an effect may be named.
    pub fn allows(&self, kind: EffectKind) -> bool {
        !self.excluded.contains(&kind)
    }

    /// Whether what is read off in this way may be named.
    pub fn allows_read_off(&self, read_off: ReadOff) -> bool {
        EffectKind::read_off(read_off).is_some_and(|kind| self.allows(kind))
    }

    /// A set less the effects that may not be named.
    pub fn restrict(&self, set: &EffectSet) -> EffectSet {
        without_all(set, &self.excluded)
    }
}

/// A set less several effects.
pub(crate) fn without_all(set: &EffectSet, kinds: &[EffectKind]) -> EffectSet {
    set.filtered(|effect| !kinds.contains(&effect.kind()))
}
