//! What a diagnosis has to know of an effect to find it.

use super::residual_view::ResidualView;
use super::{Effect, EffectKind, EffectSet};
use crate::Channel;

/// How a diagnosis finds an effect.
#[derive(Clone, Copy, Debug)]
pub enum Search {
    /// Its values are fitted to the residual, and it has to earn its place on held-out time.
    Fitted(FittedSearch),
    /// One of a few choices, found in closed form; it has to earn its place like a fitted one.
    Choice,
    /// Read off what is recorded, in closed form.
    ReadOff(ReadOffSearch),
    /// Not at all: device files state it, and what shows of it in one recording has a name of its
    /// own.
    Given,
}

/// What the search for the smallest set of effects needs to know of a fitted effect.
#[derive(Clone, Copy, Debug)]
pub struct FittedSearch {
    /// Where its fit begins.
    pub first_guess: FirstGuess,
    /// Another effect that it is also tried together with, from neutral values: alone neither may
    /// help.
    pub companion: Option<EffectKind>,
    /// Whether fitted values are what such an effect has; else it stands in for something else. The
    /// set holds the effect and those fitted beside it.
    pub is_plausible: fn(&Effect, &EffectSet) -> bool,
    /// What every recording has of it: quartz and stamps are no better, mounts and calibrations
    /// neither. Up to there it is fitted, so that it does not pass for another, but it is no cause.
    /// None where any of it is a cause.
    pub ordinary: Option<Ordinary>,
    /// How coarse rounding shows as this effect; none where it does not.
    pub rounding: Option<Rounding>,
    /// Where a simulation takes it over although it is no cause.
    pub kept: Kept,
    /// What a residual may depend on (in the effect's channels) of which this effect is a special
    /// case: it says no more than such a dependence.
    pub special_case_of: &'static [Dependence],
    /// Whether a motion can tell it; none where no motion is known that would.
    pub identifiability: Option<Identifiability>,
}

/// Where the fit of an effect begins.
#[derive(Clone, Copy, Debug)]
pub enum FirstGuess {
    /// At its neutral values.
    Neutral,
    /// At the best of these (flat values), as there is no gradient at the neutral ones.
    FromResidual(fn(&ResidualView) -> Vec<Vec<f64>>),
    /// At the time at which changing the three values of another effect helps most; its values are
    /// that time and the change.
    ChangeOf(EffectKind),
}

/// Where a simulation takes an effect over that is no cause, if it lowers the gap on time that it was not fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// Everywhere: each sensor has to be calibrated for it.
    AsCalibration,
    /// Beside something unknown that it might pass for: it is the same at all times and for every motion, so that it does
    /// in another recording what it does in this one, whatever is behind it.
    BesideUnknown,
    /// Nowhere.
    Never,
}

/// What every recording has of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ordinary {
    /// No value is farther than this from its neutral one.
    EachValue(f64),
    /// The values after the time of a change have a norm below this.
    Change(f64),
}

/// How coarse rounding of slow motion, which dwells on one side of a step, shows as an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// The effect's values are an offset.
    Offset,
    /// The effect's values are an offset per second.
    Ramp,
}

/// What a residual may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dependence {
    /// On what its axis reads, along a curve.
    OwnReading,
    /// On what the other channel reads, linearly.
    OtherChannel,
    /// On the products of what the other channel reads.
    OtherChannelSquared,
    /// On where up is in sensor axes.
    Orientation,
    /// On what all axes of its channel read, linearly.
    OtherAxes,
    /// On first and second differences over time of what its axis reads: delays and filters.
    RateOfChange,
    /// On time alone.
    Time,
    /// On what its axis reads, by a gain that changes slowly.
    GainOverTime,
    /// On the first difference of what its axis reads, by a delay that changes slowly.
    DelayOverTime,
    /// On what the other axes of its channel read, by turns that change slowly.
    MountOverTime,
}

impl Dependence {
    /// All of them, in the order in which they are tried.
    pub const ALL: [Self; 10] = [
        Self::OwnReading,
        Self::OtherChannel,
        Self::OtherChannelSquared,
        Self::Orientation,
        Self::OtherAxes,
        Self::RateOfChange,
        Self::Time,
        Self::GainOverTime,
        Self::DelayOverTime,
        Self::MountOverTime,
    ];
}

/// Whether a motion can tell an effect.
#[derive(Clone, Copy, Debug)]
pub struct Identifiability {
    /// A size of its values that would matter: with standard errors of more than half of it, the
    /// effect is said to be unidentifiable.
    pub relevant_size: f64,
    /// So many of its first values are looked at.
    pub values: usize,
    /// The motion or recording that would tell.
    pub would_tell: &'static str,
}

/// What an effect is read off, and how surely.
#[derive(Clone, Copy, Debug)]
pub struct ReadOffSearch {
    /// What it is read off.
    pub from: ReadOff,
    /// Probability that it is there when it is found.
    pub probability: f64,
}

/// What an effect is read off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadOff {
    /// Readings that pile up at one value: the limit.
    ClippedReadings(Channel),
    /// The lattice on which all readings lie: the spacing.
    Lattice(Channel),
    /// White noise of the residual beyond the declared: its density.
    ExcessNoise(Channel),
    /// Slope of measured on simulated readings: a known factor of units.
    UnitFactor(Channel),
    /// Slope of the reference's accelerations on measured ones: a known factor of units of length.
    ReferenceLength,
    /// Stamps that are missing between others: fraction and mean burst.
    MissingMessages,
    /// Scatter of the reported poses: standard deviations of position and rotation.
    ReferenceScatter,
    /// What the reported poses lack at high frequencies: a cutoff.
    ReferenceSpectrum,
    /// Kinks of the reported poses that come back at a steady rate.
    ReferenceFrames,
}

/// For [`FittedSearch::is_plausible`]: all values within the bounds are.
pub(super) fn always(_: &Effect, _: &EffectSet) -> bool {
    true
}
