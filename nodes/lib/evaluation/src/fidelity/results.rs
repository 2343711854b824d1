//! The results of a comparison, as results.json holds them.

use serde::{Deserialize, Serialize};

use super::cases::Case;
use super::errors::{SquaredErrors, signal};
use super::method::Method;
use super::protocol::{Protocol, Study};
use super::rigid::RigidStudyResults;
use super::truth_source::TruthSource;
use crate::bootstrap::intervals;

/// The errors of all simulators in all studies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FidelityResults {
    /// Format and its version.
    pub schema: String,
    /// Version of the suite that made it.
    pub version: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Whether each motion and site was drawn only once.
    pub quick: bool,
    /// The studies, in the protocol's order.
    pub studies: Vec<StudyResults>,
    /// The studies of rigid bodies, in the protocol's order.
    #[serde(default)]
    pub rigid: Vec<RigidStudyResults>,
    /// Studies that were left out, with the reason.
    #[serde(default)]
    pub skipped: Vec<String>,
}

/// One study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StudyResults {
    /// Its name.
    pub name: String,
    /// What its measured side is.
    pub measured: String,
    /// What that side rests on.
    pub truth: TruthSource,
    /// The networks' name.
    pub model: String,
    /// By position, and where there are several all together as `all`.
    pub positions: Vec<PositionResults>,
}

/// One position.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PositionResults {
    /// Its name.
    pub position: String,
    /// Recordings.
    pub recordings: usize,
    /// Their length where something was measured, s.
    pub seconds: f64,
    /// Root mean square of what was measured itself, about its mean, per axis: m/s2, rad/s.
    pub signal: [f64; 2],
    /// The simulators that apply.
    #[serde(rename = "simulators")]
    pub methods: Vec<MethodResults>,
}

/// One simulator at one position.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MethodResults {
    /// The simulator.
    #[serde(rename = "simulator")]
    pub method: Method,
    /// Root mean square errors of specific force x, y, z, m/s2, and angular velocity x, y, z,
    /// rad/s; sensor axes.
    pub channels: [f64; 6],
    /// Specific force, m/s2, and angular velocity, rad/s, per axis.
    pub rmse: [f64; 2],
    /// The same over that of the analytic simulator.
    pub ratio: [f64; 2],
    /// 95 % of the errors when recordings are drawn anew with replacement.
    pub rmse_interval: [[f64; 2]; 2],
    /// 95 % of the ratios likewise.
    pub ratio_interval: [[f64; 2]; 2],
}

impl FidelityResults {
    pub(super) fn new(protocol: &Protocol, quick: bool) -> Self {
        Self {
            schema: "cromosim/fidelity-results/1".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: protocol.seed,
            quick,
            studies: Vec::new(),
            rigid: Vec::new(),
            skipped: Vec::new(),
        }
    }

    /// Lists a study as left out.
    pub(super) fn skip(&mut self, study: &str, reason: &str) {
        self.skipped.push(format!("{study}: skipped: {reason}"));
    }
}

impl StudyResults {
    /// `errors`: one for each case and method.
    pub(super) fn new(
        study: &Study,
        cases: &[Case],
        errors: &[Vec<Option<SquaredErrors>>],
        seed: u64,
    ) -> Self {
        let mut names: Vec<&str> = cases.iter().map(Case::position).collect();
        names.sort_unstable();
        names.dedup();
        let scored = Scored {
            cases,
            errors,
            seed,
        };
        let mut positions: Vec<PositionResults> = names
            .iter()
            .map(|name| scored.position(name, |case| case.position() == *name))
            .collect();
        if names.len() > 1 {
            positions.push(scored.position("all", |_| true));
        }
        Self {
            name: study.name.clone(),
            measured: study.measured.clone(),
            truth: study.truth(),
            model: study.model.clone(),
            positions,
        }
    }
}

/// A study's cases with the errors of every method.
struct Scored<'a> {
    cases: &'a [Case],
    errors: &'a [Vec<Option<SquaredErrors>>],
    seed: u64,
}

impl Scored<'_> {
    fn position(&self, name: &str, keep: impl Fn(&Case) -> bool) -> PositionResults {
        let kept: Vec<usize> = (0..self.cases.len())
            .filter(|index| keep(&self.cases[*index]))
            .collect();
        let measured = kept
            .iter()
            .flat_map(|index| self.cases[*index].measured().iter().flatten());
        PositionResults {
            position: name.to_owned(),
            recordings: kept.len(),
            seconds: measured.clone().count() as f64 / cromosim_learned::NETWORK_RATE_HZ,
            signal: signal(measured),
            methods: Method::ALL
                .into_iter()
                .filter_map(|method| self.method(method, &kept))
                .collect(),
        }
    }

    /// A method's errors on the kept cases; none where it applies to none of them.
    fn method(&self, method: Method, kept: &[usize]) -> Option<MethodResults> {
        let pooled = self.pooled(kept, method);
        if pooled.count() == 0.0 {
            return None;
        }
        // Errors, then their ratios to those of the analytic simulator.
        let statistics = |draw: &[usize]| {
            let drawn: Vec<usize> = draw.iter().map(|index| kept[*index]).collect();
            let [force, rate] = self.pooled(&drawn, method).per_axis();
            let [analytic_force, analytic_rate] = self.pooled(&drawn, Method::Analytic).per_axis();
            [force, rate, force / analytic_force, rate / analytic_rate]
        };
        let all: Vec<usize> = (0..kept.len()).collect();
        let [.., force_ratio, rate_ratio] = statistics(&all);
        let [rmse_force, rmse_rate, ratio_force, ratio_rate] =
            intervals(kept.len(), self.seed, statistics);
        Some(MethodResults {
            method,
            channels: pooled.channels(),
            rmse: pooled.per_axis(),
            ratio: [force_ratio, rate_ratio],
            rmse_interval: [rmse_force, rmse_rate],
            ratio_interval: [ratio_force, ratio_rate],
        })
    }

    /// A method's errors, summed over cases.
    fn pooled(&self, cases: &[usize], method: Method) -> SquaredErrors {
        let mut all = SquaredErrors::default();
        cases
            .iter()
            .filter_map(|index| self.errors[*index][method as usize].as_ref())
            .for_each(|own| all.add(own));
        all
    }
}
