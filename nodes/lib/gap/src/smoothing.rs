//! Whether the reference was smoothed before it came here.

use std::sync::Arc;

use cromosim_imu::{EffectKind, EffectSet};

use crate::fit::Context;
use crate::search::{State, debug, kinds};
use crate::whiten::NoiseModel;

/// Cutoffs that are tried first, Hz.
const GRID_HZ: [f64; 9] = [1.5, 2.0, 2.6, 3.4, 4.4, 5.7, 7.4, 9.6, 12.5];
/// Mean square of a whitened residual from which on the reference is looked at.
const SUSPICIOUS: f64 = 1.3;

/// Held-out log-likelihood with the predicted noise's own volume: contexts with other noise become
/// comparable.
fn evidence(context: &Context, state: &State) -> f64 {
    state.score
        - (0..2)
            .map(|c| context.whitener.count[c] * context.whitener.log_scale[c])
            .sum::<f64>()
}

/// The context of a cutoff.
fn smoothed<'a>(context: &Context<'a>, set: &EffectSet, cutoff_hz: f64) -> Context<'a> {
    let estimate = context.problem.estimate.undoing(cutoff_hz);
    let track = context.problem.track(&estimate);
    let residual = context
        .problem
        .residual(&context.problem.predict(&track, set).readings);
    let mut basis = context.basis.clone();
    basis.estimate = Arc::new(estimate);
    basis.undone_hz = Some(cutoff_hz);
    let noise = NoiseModel::new(context.problem, &basis, &residual);
    Context::new(context.problem, track, basis, noise)
}

/// The better of `context` and contexts in which a smoothing of the reference is undone.
pub(crate) fn try_smoothing<'a>(
    context: Context<'a>,
    state: State,
    starts: &[EffectSet],
    library: &[EffectKind],
) -> (Context<'a>, State) {
    let ratio = state.fit.held_out_ratio();
    if ratio[0].max(ratio[1]) < SUSPICIOUS {
        return (context, state);
    }
    let plain = evidence(&context, &state);
    // Beside what was found without it, and alone.
    let mut sets: Vec<EffectSet> = starts.to_vec();
    if !starts.contains(&state.fit.set) {
        sets.push(state.fit.set.clone());
    }
    let best_start = |other: &Context<'a>| {
        let states = sets.iter().map(|set| other.state(set.clone()));
        states.max_by(|a, b| a.score.total_cmp(&b.score))
    };
    let worth = |cutoff_hz: f64| {
        let other = smoothed(&context, &starts[0], cutoff_hz);
        let found = best_start(&other)?;
        let evidence = evidence(&other, &found);
        debug(|| {
            eprintln!(
                "  smoothing {cutoff_hz:.2} Hz: {:.1} against {plain:.1} {:.2?}",
                evidence,
                found.fit.held_out_ratio()
            )
        });
        Some((evidence, cutoff_hz))
    };
    let coarse: Vec<(f64, f64)> = GRID_HZ.into_iter().filter_map(worth).collect();
    let Some(best) = coarse.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return (context, state);
    };
    // A cutoff that no motion reaches explains nothing; the search decides below whether something
    // beside it does.
    let mut best = best;
    let mut factor = 1.12;
    for _ in 0..4 {
        for cutoff_hz in [best.1 / factor, best.1 * factor] {
            if let Some(other) = worth(cutoff_hz)
                && other.0 > best.0
            {
                best = other;
            }
        }
        factor = f64::sqrt(factor);
    }
    let other = smoothed(&context, &starts[0], best.1);
    let searched = other.search(&sets, library, 2);
    debug(|| {
        eprintln!(
            "  smoothing {:.2} Hz with {:?}: {:.1}",
            best.1,
            kinds(&searched.fit.set),
            evidence(&other, &searched)
        )
    });
    if best.1 > GRID_HZ[GRID_HZ.len() - 1] {
        // At the grid's end nothing is undone but noise.
        return (context, state);
    }
    let better = evidence(&other, &searched) > plain + 30.0 + 0.05 * context.excess(&state.fit);
    if better && comes_closer(&context, &state, &searched) {
        (other, searched)
    } else {
        (context, state)
    }
}

/// Whether the simulation itself comes closer in one channel, and in none moves away: what is
/// undone must not cost more than it gives.
fn comes_closer(context: &Context, plain: &State, undone: &State) -> bool {
    let rms = |state: &State, channel: usize| {
        let residual = context.problem.residual(&state.fit.prediction.readings);
        residual[3 * channel..3 * channel + 3]
            .iter()
            .flatten()
            .map(|e| e * e)
            .sum::<f64>()
            .sqrt()
    };
    let ratio = [0, 1].map(|channel| rms(undone, channel) / rms(plain, channel).max(1e-30));
    ratio[0].min(ratio[1]) < 0.95 && ratio[0].max(ratio[1]) < 1.05
}
