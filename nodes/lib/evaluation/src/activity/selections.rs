//! The conditions that tables and pictures show.

use super::condition::{TrainingData, Variant};
use super::results::{ActivityResults, ConditionResults};
use super::simulator::Simulator;

/// A variant that was tried: alone, and mixed with real windows.
pub(super) struct TriedVariant<'a> {
    pub variant: Variant,
    pub alone: Option<&'a ConditionResults>,
    pub mixed: Option<&'a ConditionResults>,
}

/// The variants that were tried, simulator by simulator.
pub(super) fn tried(results: &ActivityResults) -> Vec<TriedVariant<'_>> {
    let find = |training, variant| results.condition(training, Some(variant), 1.0);
    Simulator::ALL
        .into_iter()
        .flat_map(Variant::all_with)
        .map(|variant| TriedVariant {
            variant,
            alone: find(TrainingData::Virtual, variant),
            mixed: find(TrainingData::Mixed, variant),
        })
        .filter(|tried| tried.alone.or(tried.mixed).is_some())
        .collect()
}

/// A point of the learning curve: real windows alone, with turned copies, and mixed by the chosen
/// variant.
pub(super) struct CurvePoint<'a> {
    /// Share of the training subjects.
    pub share: f64,
    /// In the order of the curve's lines.
    pub conditions: [Option<&'a ConditionResults>; 3],
}

/// The learning curve, the smallest share first.
pub(super) fn learning_curve(results: &ActivityResults) -> impl Iterator<Item = CurvePoint<'_>> {
    results.settings.shares.iter().map(|share| CurvePoint {
        share: *share,
        conditions: [
            results.condition(TrainingData::Real, None, *share),
            results.condition(TrainingData::Turned, None, *share),
            results.mixed_as_chosen(*share),
        ],
    })
}

/// Conditions whose classes are compared, by their names.
pub(super) fn compared_by_class(
    results: &ActivityResults,
) -> Vec<(&'static str, &ConditionResults)> {
    let whole = |training, variant| results.condition(training, variant, 1.0);
    let plain = |simulator| whole(TrainingData::Virtual, Some(Variant::plain(simulator)));
    let conditions = [
        ("R2R", whole(TrainingData::Real, None)),
        ("Mix2R (chosen)", results.mixed_as_chosen(1.0)),
        ("V2R (analytic, plain)", plain(Simulator::Analytic)),
        ("V2R (learned, plain)", plain(Simulator::Learned)),
        (
            "V2R (learned, distribution mapping)",
            whole(
                TrainingData::Virtual,
                Some(Variant::mapped(Simulator::Learned)),
            ),
        ),
    ];
    conditions
        .into_iter()
        .filter_map(|(name, found)| Some((name, found?)))
        .collect()
}
