//! How much of a gap each cause explains: Shapley values of the log-likelihood.

use std::collections::BTreeMap;

use cromosim_imu::{Effect, EffectSet, ReadOff};

use crate::findings::Findings;
use crate::simulations::Simulations;

/// Causes up to which all orders of adding them are tried.
const ALL_ORDERS: usize = 4;

/// Shares of the gap; together they are 1.
pub(crate) struct Shares {
    /// Of each cause, in the order in which they were given.
    pub causes: Vec<f64>,
    pub unexplained: f64,
    /// What is to be explained, nats.
    pub total: f64,
}

/// Each effect's gain averaged over the orders in which the effects may be added, against what is
/// left at the end.
pub(crate) fn shares(findings: &Findings, simulations: &Simulations, causes: &[Effect]) -> Shares {
    let mut gains = mean_gains(simulations, causes);
    for (gain, effect) in gains.iter_mut().zip(causes) {
        if effect.kind().is_read_off(ReadOff::MissingMessages) {
            // A missing message counts like a message whose six values are off by the noise.
            let whole = &simulations.whole;
            *gain += 3.0 * whole.missing.fraction * whole.length as f64;
        }
        *gain = gain.max(0.0);
    }
    let reportable = &findings.reportable;
    let whitener = simulations.whitener(reportable);
    let squares = simulations.squares(&whitener, &simulations.simulate(reportable));
    let expected = whitener.count;
    let rest = (0.5 * (squares - expected.accelerometer - expected.gyroscope)).max(0.0);
    let total: f64 = gains.iter().sum::<f64>() + rest;
    let count = causes.len();
    if total <= 0.0 {
        return Shares {
            causes: vec![1.0 / count.max(1) as f64; count],
            unexplained: if count == 0 { 1.0 } else { 0.0 },
            total: 0.0,
        };
    }
    Shares {
        causes: gains.iter().map(|gain| gain / total).collect(),
        unexplained: rest / total,
        total,
    }
}

/// Gains in log-likelihood, nats, averaged over the orders.
fn mean_gains(simulations: &Simulations, causes: &[Effect]) -> Vec<f64> {
    let count = causes.len();
    let mut known: BTreeMap<u64, f64> = BTreeMap::new();
    let mut value = |members: u64| -> f64 {
        *known.entry(members).or_insert_with(|| {
            let mut set = EffectSet::new();
            (0..count)
                .filter(|k| members & (1 << k) != 0)
                .for_each(|k| {
                    set.insert(causes[k].clone());
                });
            // What rounding adds is in the prediction of the noise.
            let simulated = simulations.simulate_unrounded(&set);
            simulations.likelihood(&simulations.whitener(&set), &simulated)
        })
    };
    let mut gains = vec![0.0; count];
    let orders = orders(count);
    for order in &orders {
        let mut members = 0;
        for &k in order {
            let with = members | (1 << k);
            gains[k] += (value(with) - value(members)) / orders.len() as f64;
            members = with;
        }
    }
    gains
}

/// All orders of up to [`ALL_ORDERS`]; of more, each member in each position once in both directions.
fn orders(count: usize) -> Vec<Vec<usize>> {
    if count <= ALL_ORDERS {
        let mut all = vec![Vec::new()];
        for k in 0..count {
            all = all
                .into_iter()
                .flat_map(|order: Vec<usize>| {
                    (0..=order.len()).map(move |at| {
                        let mut next = order.clone();
                        next.insert(at, k);
                        next
                    })
                })
                .collect();
        }
        return all;
    }
    let forward =
        (0..count).map(|shift| (0..count).map(|k| (k + shift) % count).collect::<Vec<_>>());
    forward
        .clone()
        .chain(forward.map(|order| order.into_iter().rev().collect()))
        .collect()
}
