//! What this motion cannot tell.

use cromosim_imu::{Effect, EffectKind, Identifiability, Search};

use crate::diagnosis::Unidentifiable;
use crate::findings::Findings;
use crate::fit::{prior_weights, slices};
use crate::screen::is_change;

/// Effects of a size that would matter which stay within two standard errors here, or which cannot
/// be told from what was named.
pub(crate) fn unidentifiable(findings: &Findings) -> Vec<Unidentifiable> {
    let mut kinds = EffectKind::ALL.to_vec();
    // A change of another effect's values comes after all values.
    kinds.sort_by_key(|kind| is_change(*kind));
    kinds
        .into_iter()
        .filter_map(|kind| {
            let Search::Fitted(search) = kind.spec().search else {
                return None;
            };
            let test = search.identifiability?;
            let error = largest_error(findings, kind, &test)?;
            (2.0 * error > test.relevant_size).then(|| Unidentifiable {
                effect: kind.name().to_owned(),
                would_tell: test.would_tell.to_owned(),
            })
        })
        .collect()
}

/// Largest standard error of an effect's values, of those that were fitted or as they would be
/// beside the fit; none of a change that was not found, as its time is not known.
fn largest_error(findings: &Findings, kind: EffectKind, test: &Identifiability) -> Option<f64> {
    let (model, fit) = (&findings.model, &findings.scored.fit);
    if let Some(effect) = fit.set.get(kind) {
        return Some(fit.standard_errors(effect).into_iter().fold(0.0, f64::max));
    }
    if is_change(kind) {
        return None;
    }
    let set = fit.set.clone().with(Effect::neutral(kind));
    let columns = model.columns(&set, &fit.prediction, kind);
    let linear = model
        .extended(fit, None, &slices(&columns), &prior_weights(kind))
        .solve();
    let first = fit.layout.len();
    Some(
        (first..first + test.values)
            .map(|k| linear.covariance[(k, k)].max(0.0).sqrt())
            .fold(0.0, f64::max),
    )
}
