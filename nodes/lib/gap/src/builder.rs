//! Findings put into the numbers and words of diagnosis.json.

use cromosim_imu::{Effect, EffectSet, PerChannel, Reading};

use crate::diagnosis::{Cause, Gap, Metrics, PlacementDiagnosis, Unexplained};
use crate::evidence::{Evidence, collect};
use crate::findings::Findings;
use crate::identify::unidentifiable;
use crate::location::locate;
use crate::probability::probability_of;
use crate::shares::{Shares, shares};
use crate::simulations::Simulations;
use crate::unexplained::unexplained_variances;
use crate::words::{described, described_errors, unknown_cause, verdict};

/// Everything a diagnosis is made of.
pub(crate) struct DiagnosisBuilder<'a> {
    findings: &'a Findings<'a>,
    simulations: Simulations<'a>,
}

impl<'a> DiagnosisBuilder<'a> {
    /// `raw` are the readings in the device's units, `covered` the axes of each to be compared;
    /// `seed` is that of the simulated noise.
    pub fn new(
        findings: &'a Findings<'a>,
        raw: &'a [Reading],
        covered: &'a [[bool; 6]],
        seed: u64,
    ) -> Self {
        Self {
            findings,
            simulations: Simulations::new(findings, raw, covered, seed),
        }
    }

    /// Diagnosis, curves, and the variance that stays unexplained.
    pub fn build(&self) -> (PlacementDiagnosis, Evidence, PerChannel<f64>) {
        let simulations = &self.simulations;
        let reportable = &self.findings.reportable;
        let named: Vec<Effect> = reportable.iter().cloned().collect();
        let shares = shares(self.findings, simulations, &named);
        let nominal = EffectSet::new();
        let before_readings = simulations.simulate(&nominal);
        let before = simulations.metrics(&nominal, &before_readings);
        let mut causes = self.causes(&named, &shares);
        let after_readings = simulations.simulate(reportable);
        let after = simulations.cross_validated_metrics(&after_readings);
        if let Some(last) = causes.last_mut() {
            last.after = after;
        }
        // What is predictable of the rest belongs to `unknown`; what is not even that stays
        // unexplained.
        let unknown = self.findings.unknown.as_ref();
        let predictable = unknown.map_or(0.0, |unknown| unknown.predictable);
        if let Some(unknown) = unknown {
            let share = shares.unexplained * predictable;
            causes.push(unknown_cause(unknown, share, after));
            causes.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
        }
        let whitener = simulations.whitener(&nominal);
        let diagnosis = PlacementDiagnosis {
            verdict: verdict(&causes, &before, &after),
            gap: Gap { before, after },
            location: locate(
                &simulations.whitened(&whitener, &before_readings),
                &simulations.whole,
                &whitener,
            ),
            unidentifiable: unidentifiable(self.findings),
            unexplained: Unexplained {
                significant: unknown.is_some(),
                share: shares.unexplained * (1.0 - predictable),
                location: unknown
                    .map(|unknown| unknown.location.clone())
                    .unwrap_or_default(),
            },
            causes,
        };
        let comparison = &simulations.comparison;
        let evidence = collect(self.findings, comparison, &before_readings, &after_readings);
        let unexplained = unexplained_variances(self.findings, simulations, &after);
        (diagnosis, evidence, unexplained)
    }

    /// The named causes, the largest share first, each with what it and those above it leave.
    fn causes(&self, named: &[Effect], shares: &Shares) -> Vec<Cause> {
        let mut order: Vec<usize> = (0..named.len()).collect();
        order.sort_by(|&a, &b| shares.causes[b].total_cmp(&shares.causes[a]));
        let mut set = EffectSet::new();
        order
            .into_iter()
            .map(|index| {
                set.insert(named[index].clone());
                let after = self
                    .simulations
                    .metrics(&set, &self.simulations.simulate(&set));
                self.cause(&named[index], shares.causes[index], after)
            })
            .collect()
    }

    fn cause(&self, effect: &Effect, gap_share: f64, after: Metrics) -> Cause {
        let errors = self.findings.scored.fit.standard_errors(effect);
        let rate_hz = self.simulations.whole.rate_hz;
        Cause {
            effect: effect.kind().name().to_owned(),
            probability: probability_of(self.findings, effect),
            parameters: described(effect.kind(), effect.values()),
            standard_errors: described_errors(effect.kind(), &errors, rate_hz),
            gap_share,
            after,
        }
    }
}
