//! An effect with its values, and sets of them.

use nalgebra::{Matrix3, Vector3};

use super::EffectKind;

/// One effect with values for its parameters; valid from its making on.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    kind: EffectKind,
    values: Vec<f64>,
}

impl Effect {
    /// Of values that the kind's [`super::EffectSpec`] has checked.
    pub(super) fn from_checked(kind: EffectKind, values: Vec<f64>) -> Self {
        Self { kind, values }
    }

    /// Which effect.
    pub fn kind(&self) -> EffectKind {
        self.kind
    }

    /// All values, matrices row by row, in the order of the parameters.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value at a place among all values; 0 beyond them.
    pub(super) fn scalar(&self, index: usize) -> f64 {
        self.values.get(index).copied().unwrap_or_default()
    }

    /// The three values from a place on.
    pub(super) fn vector(&self, index: usize) -> Vector3<f64> {
        Vector3::new(
            self.scalar(index),
            self.scalar(index + 1),
            self.scalar(index + 2),
        )
    }

    /// The first nine values as a matrix.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.scalar(3 * row + column))
    }
}

/// Effects, at most one of each kind, in the order of [`EffectKind::ALL`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectSet(Vec<Effect>);

impl EffectSet {
    /// The empty set: the nominal simulation.
    pub fn new() -> Self {
        Self::default()
    }

    /// The effect of a kind.
    pub fn get(&self, kind: EffectKind) -> Option<&Effect> {
        self.0
            .binary_search_by_key(&kind, Effect::kind)
            .ok()
            .map(|index| &self.0[index])
    }

    /// Whether there is an effect of a kind.
    pub fn contains(&self, kind: EffectKind) -> bool {
        self.get(kind).is_some()
    }

    /// Adds an effect; returns the one of its kind that it replaces.
    pub fn insert(&mut self, effect: Effect) -> Option<Effect> {
        match self.0.binary_search_by_key(&effect.kind, Effect::kind) {
            Ok(index) => Some(std::mem::replace(&mut self.0[index], effect)),
            Err(index) => {
                self.0.insert(index, effect);
                None
            }
        }
    }

    /// Takes out the effect of a kind.
    pub fn remove(&mut self, kind: EffectKind) -> Option<Effect> {
        self.0
            .binary_search_by_key(&kind, Effect::kind)
            .ok()
            .map(|index| self.0.remove(index))
    }

    /// The set without what rounds the readings.
    #[must_use]
    pub fn unrounded(&self) -> Self {
        self.filtered(|effect| !effect.kind().rounds())
    }

    /// The set without a kind.
    #[must_use]
    pub fn without(&self, kind: EffectKind) -> Self {
        self.filtered(|effect| effect.kind != kind)
    }

    /// The effects for which a condition holds.
    #[must_use]
    pub fn filtered(&self, condition: impl Fn(&Effect) -> bool) -> Self {
        Self(
            self.0
                .iter()
                .filter(|effect| condition(effect))
                .cloned()
                .collect(),
        )
    }

    /// The set with an effect, which replaces that of its kind.
    #[must_use]
    pub fn with(mut self, effect: Effect) -> Self {
        self.insert(effect);
        self
    }

    /// The effects, in the order of [`EffectKind::ALL`].
    pub fn iter(&self) -> std::slice::Iter<'_, Effect> {
        self.0.iter()
    }

    /// Number of effects.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Each replaces the one of its kind.
impl<'a> Extend<&'a Effect> for EffectSet {
    fn extend<T: IntoIterator<Item = &'a Effect>>(&mut self, effects: T) {
        for effect in effects {
            self.insert(effect.clone());
        }
    }
}

impl<'a> IntoIterator for &'a EffectSet {
    type Item = &'a Effect;
    type IntoIter = std::slice::Iter<'a, Effect>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}
