//! Findings put into numbers and words.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use cromosim_imu::{Effect, EffectKind, EffectSet, Reading, SensorModel, Shape};
use cromosim_spatial::KinematicTrack;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use serde_json::{Value, json};

use crate::diagnose::{DiagnoseOptions, Findings, ordinary_share, values_of};
use crate::metrics::Comparison;
use crate::problem::{FOLDS, Problem, axis_of};
use crate::unknown::Unknown;
use crate::whiten::{NoiseModel, Whitener};
use crate::{Cause, Evidence, Gap, Interval, Metrics, PlacementDiagnosis, Unexplained};

/// Everything an answer is made of.
pub(crate) struct Answer<'a> {
    findings: &'a Findings<'a>,
    comparison: Comparison<'a>,
    /// The problem with clipped readings compared as well.
    whole: Problem,
    /// The track of the poses as they are, where the analysis undoes a smoothing.
    plain: Option<KinematicTrack>,
    /// Of the fit, at every covered reading.
    residual: Vec<Vec<f64>>,
    /// By the noise-like effects that they know of.
    whiteners: RefCell<BTreeMap<Vec<EffectKind>, Rc<Whitener>>>,
    units: [f64; 2],
    seed: u64,
}

/// Effects whose presence changes the predicted noise.
const NOISE_LIKE: [EffectKind; 6] = [
    EffectKind::ReferenceNoise,
    EffectKind::ReferenceSmoothing,
    EffectKind::AccelNoise,
    EffectKind::GyroNoise,
    EffectKind::AccelQuantization,
    EffectKind::GyroQuantization,
];

impl<'a> Answer<'a> {
    pub fn new(
        findings: &'a Findings<'a>,
        problem: &'a Problem,
        raw: &'a [Reading],
        covered: &'a [[bool; 6]],
        options: &DiagnoseOptions,
    ) -> Self {
        let comparison = Comparison {
            problem,
            measured: raw,
            covered,
        };
        let whole = Problem {
            usable: covered.to_vec(),
            ..problem.clone()
        };
        let factor = |kind| values_of(&findings.named, kind).map_or(1.0, |values| values[0]);
        let units = [
            factor(EffectKind::AccelUnits),
            factor(EffectKind::GyroUnits),
        ];
        let plain = findings
            .context
            .basis
            .undone_hz
            .map(|_| whole.track(&whole.estimate));
        let residual = whole.residual(&findings.state.fit.prediction.readings);
        Self {
            findings,
            comparison,
            whole,
            plain,
            residual,
            whiteners: RefCell::default(),
            units,
            seed: options.seed,
        }
    }

    /// Diagnosis and curves.
    pub fn finish(&self) -> (PlacementDiagnosis, Evidence) {
        let named: Vec<Effect> = self.findings.named.iter().cloned().collect();
        let unknown = self.findings.unknown.clone();
        let shares = self.shares(&named);
        let mut order: Vec<usize> = (0..named.len()).collect();
        order.sort_by(|&a, &b| shares.of_effect[b].total_cmp(&shares.of_effect[a]));
        let before_readings = self.simulate(&EffectSet::new());
        let before = self.metrics(&EffectSet::new(), &before_readings);
        let mut causes = Vec::new();
        let mut set = EffectSet::new();
        for &index in &order {
            set.insert(named[index].clone());
            causes.push(self.cause(
                &named[index],
                shares.of_effect[index],
                self.metrics(&set, &self.simulate(&set)),
            ));
        }
        let after_readings = self.simulate(&self.findings.named);
        let after = self.promise(&after_readings);
        if let Some(last) = causes.last_mut() {
            last.after = after;
        }
        // What is predictable of the rest belongs to `unknown`; what is not even that stays
        // unexplained.
        let known_unknown = unknown.as_ref().map_or(0.0, |unknown| unknown.predictable);
        let unexplained_share = shares.unexplained * (1.0 - known_unknown);
        if let Some(unknown) = &unknown {
            causes.push(unknown_cause(
                unknown,
                shares.unexplained * known_unknown,
                after,
            ));
            causes.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
        }
        let nominal = self.whitener(&EffectSet::new());
        let place = crate::place::place(
            &self.whitened(&nominal, &before_readings),
            &self.whole,
            &nominal,
        );
        let diagnosis = PlacementDiagnosis {
            verdict: verdict(&causes, &before, &after),
            gap: Gap { before, after },
            place,
            unidentifiable: crate::identify::unidentifiable(self.findings),
            unexplained: Unexplained {
                significant: unknown.is_some(),
                share: unexplained_share,
                place: unknown.map(|unknown| unknown.place).unwrap_or_default(),
            },
            causes,
        };
        let evidence = crate::evidence::collect(
            self.findings,
            &self.comparison,
            &before_readings,
            &after_readings,
        );
        (diagnosis, evidence)
    }

    /// The readings in the device's units under a set of effects, without noise.
    fn simulate(&self, set: &EffectSet) -> Vec<Reading> {
        let track = match &self.plain {
            Some(plain) if !set.contains(EffectKind::ReferenceSmoothing) => plain,
            _ => &self.findings.context.track,
        };
        let mut readings = self.whole.predict(track, set).readings;
        SensorModel::new(set, self.whole.epoch).digital(&mut readings);
        readings
    }

    /// What a context predicts as noise under those effects of `set` that are noise.
    fn whitener(&self, set: &EffectSet) -> Rc<Whitener> {
        let kinds: Vec<EffectKind> = NOISE_LIKE
            .into_iter()
            .filter(|kind| set.contains(*kind))
            .collect();
        Rc::clone(
            self.whiteners
                .borrow_mut()
                .entry(kinds)
                .or_insert_with(|| Rc::new(self.new_whitener(set))),
        )
    }

    fn new_whitener(&self, set: &EffectSet) -> Whitener {
        let mut basis = self.findings.context.basis.clone();
        let has = |kind: EffectKind| set.contains(kind);
        let density = |kind| values_of(&self.findings.named, kind).map_or(0.0, |values| values[0]);
        for (c, (noise, step)) in [
            (EffectKind::AccelNoise, EffectKind::AccelQuantization),
            (EffectKind::GyroNoise, EffectKind::GyroQuantization),
        ]
        .into_iter()
        .enumerate()
        {
            let mut variance = self.findings.problem_sigma(c).powi(2);
            variance += if has(noise) {
                density(noise).powi(2) * self.whole.rate_hz
            } else {
                0.0
            };
            variance += if has(step) {
                density(step).powi(2) / 12.0
            } else {
                0.0
            };
            basis.sigma[c] = variance.sqrt();
        }
        if self.findings.named.contains(EffectKind::ReferenceNoise)
            && !has(EffectKind::ReferenceNoise)
        {
            basis.reference_share = ordinary_share(self.whole.estimate.noise());
        }
        if !has(EffectKind::ReferenceSmoothing) {
            basis.undone_hz = None;
            basis.estimate = Arc::new(self.whole.estimate.clone());
        }
        Whitener::new(
            &self.whole,
            &NoiseModel::new(&self.whole, &basis, &self.residual),
        )
    }

    /// Whitened measured less simulated, in SI units.
    fn whitened(&self, whitener: &Whitener, simulated: &[Reading]) -> Vec<f64> {
        let measured = self.comparison.measured;
        whitener.apply(&self.whole.raster(|k, axis| {
            (axis_of(&measured[k], axis) - axis_of(&simulated[k], axis)) / self.units[axis / 3]
        }))
    }

    /// Log-likelihood of the readings under a set, nats, less the constant of the normal density.
    fn likelihood(&self, whitener: &Whitener, simulated: &[Reading]) -> f64 {
        let squares: f64 = self
            .whitened(whitener, simulated)
            .iter()
            .map(|e| e * e)
            .sum();
        -0.5 * squares
            - (0..2)
                .map(|c| whitener.count[c] * whitener.log_scale[c])
                .sum::<f64>()
    }

    fn nll_per_sample(&self, set: &EffectSet, simulated: &[Reading]) -> f64 {
        let whitener = self.whitener(set);
        let samples = (whitener.count[0] + whitener.count[1]) / 6.0;
        let units: f64 = 3.0 * self.units.iter().map(|factor| factor.ln()).sum::<f64>();
        -self.likelihood(&whitener, simulated) / samples.max(1.0)
            + 3.0 * std::f64::consts::TAU.ln()
            + units
    }

    fn metrics(&self, set: &EffectSet, simulated: &[Reading]) -> Metrics {
        let noisy = self.noisy(set, simulated);
        self.comparison
            .metrics(simulated, &noisy, self.nll_per_sample(set, simulated))
    }

    fn noisy(&self, set: &EffectSet, simulated: &[Reading]) -> Vec<Reading> {
        let mut random = ChaCha12Rng::seed_from_u64(self.seed);
        let density = |kind| values_of(set, kind).map_or(0.0, |values| values[0]);
        let sigma = [(0, EffectKind::AccelNoise), (1, EffectKind::GyroNoise)].map(|(c, kind)| {
            self.units[c]
                * (self.findings.problem_sigma(c).powi(2)
                    + density(kind).powi(2) * self.whole.rate_hz)
                    .sqrt()
        });
        simulated
            .iter()
            .map(|reading| {
                let mut noisy = *reading;
                for axis in 0..3 {
                    let [a, b] = cromosim_imu::normal_pair(&mut random);
                    noisy.specific_force[axis] += sigma[0] * a;
                    noisy.angular_velocity[axis] += sigma[1] * b;
                }
                noisy
            })
            .collect()
    }

    /// The metrics that another recording of the device should show: every part of time is
    /// simulated with values fitted to the others.
    fn promise(&self, after: &[Reading]) -> Metrics {
        let mut held_out = after.to_vec();
        for fold in 0..FOLDS {
            let mut set = self.findings.named.clone();
            for effect in self.findings.state.fit.without_fold(fold).iter() {
                if set.contains(effect.kind()) {
                    set.insert(effect.clone());
                }
            }
            let readings = self.simulate(&set);
            for (k, &place) in self.whole.places.iter().enumerate() {
                if self.whole.fold(place) == fold {
                    held_out[k] = readings[k];
                }
            }
        }
        self.metrics(&self.findings.named, &held_out)
    }

    fn cause(&self, effect: &Effect, gap_share: f64, after: Metrics) -> Cause {
        let errors = self.findings.state.fit.standard_errors(effect);
        let mut errors_named = if errors.iter().any(|error| *error > 0.0) {
            described(effect.kind(), &errors)
        } else {
            BTreeMap::new()
        };
        if effect.kind() == EffectKind::MountSlip {
            errors_named.insert("at".to_owned(), json!(0.5 / self.whole.rate_hz));
        }
        Cause {
            effect: effect.kind().name().to_owned(),
            probability: crate::probability::of(self.findings, effect),
            parameters: described(effect.kind(), effect.values()),
            standard_errors: errors_named,
            gap_share,
            after,
        }
    }

    /// Shapley values of the log-likelihood: each effect's gain averaged over the orders in which
    /// they may be added.
    fn shares(&self, named: &[Effect]) -> Shares {
        let count = named.len();
        let mut known: BTreeMap<u64, f64> = BTreeMap::new();
        let mut value = |members: u64| -> f64 {
            *known.entry(members).or_insert_with(|| {
                let mut set = EffectSet::new();
                (0..count)
                    .filter(|k| members & (1 << k) != 0)
                    .for_each(|k| {
                        set.insert(named[k].clone());
                    });
                // Rounding the simulation adds error of its own; here its noise is in the
                // prediction.
                let unrounded = set
                    .without(EffectKind::AccelQuantization)
                    .without(EffectKind::GyroQuantization);
                self.likelihood(&self.whitener(&set), &self.simulate(&unrounded))
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
        for (gain, effect) in gains.iter_mut().zip(named) {
            if effect.kind() == EffectKind::DroppedSamples {
                // A missing message counts like a message whose six values are off by the noise.
                *gain += 3.0 * self.whole.dropped.0 * self.whole.length as f64;
            }
            *gain = gain.max(0.0);
        }
        let whitener = self.whitener(&self.findings.named);
        let squares: f64 = self
            .whitened(&whitener, &self.simulate(&self.findings.named))
            .iter()
            .map(|e| e * e)
            .sum();
        let rest = (0.5 * (squares - whitener.count[0] - whitener.count[1])).max(0.0);
        let total: f64 = gains.iter().sum::<f64>() + rest;
        if total <= 0.0 {
            return Shares {
                of_effect: vec![1.0 / count.max(1) as f64; count],
                unexplained: if count == 0 { 1.0 } else { 0.0 },
            };
        }
        Shares {
            of_effect: gains.iter().map(|gain| gain / total).collect(),
            unexplained: rest / total,
        }
    }
}

struct Shares {
    of_effect: Vec<f64>,
    unexplained: f64,
}

/// All orders of up to four; of more, each member in each position once in both directions.
fn orders(count: usize) -> Vec<Vec<usize>> {
    if count <= 4 {
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

/// Values by the names of their parameters, in the form of diagnosis.json.
pub(crate) fn described(kind: EffectKind, values: &[f64]) -> BTreeMap<String, Value> {
    let mut named = BTreeMap::new();
    let mut first = 0;
    for parameter in kind.spec().parameters {
        let own = &values[first..first + parameter.shape.len()];
        first += parameter.shape.len();
        let value = match parameter.shape {
            Shape::Scalar | Shape::Time => json!(own[0]),
            Shape::Vector3 => json!(own),
            Shape::Matrix3 => json!(own.chunks(3).collect::<Vec<_>>()),
            Shape::Choice(words) => json!(words.get(own[0] as usize).copied().unwrap_or_default()),
        };
        named.insert(parameter.name.to_owned(), value);
    }
    named
}

fn unknown_cause(unknown: &Unknown, gap_share: f64, after: Metrics) -> Cause {
    let bands: Vec<&Interval> = unknown
        .place
        .bands_hz
        .iter()
        .filter(|band| band.share > 0.1)
        .collect();
    let band = match (bands.first(), bands.last()) {
        (Some(first), Some(last)) => [first.from, last.to],
        _ => [0.0, 0.0],
    };
    // Half as much again as its due of an even spread.
    let even = 1.0 / unknown.place.intervals_s.len().max(1) as f64;
    let mut intervals: Vec<[f64; 2]> = Vec::new();
    for interval in unknown
        .place
        .intervals_s
        .iter()
        .filter(|interval| interval.share > 1.5 * even)
    {
        match intervals.last_mut() {
            Some(last) if (last[1] - interval.from).abs() < 1e-9 => last[1] = interval.to,
            _ => intervals.push([interval.from, interval.to]),
        }
    }
    if intervals.is_empty() {
        let ends = (
            unknown.place.intervals_s.first(),
            unknown.place.intervals_s.last(),
        );
        intervals.extend(
            ends.0
                .zip(ends.1)
                .map(|(first, last)| [first.from, last.to]),
        );
    }
    let parameters = BTreeMap::from([
        ("channel".to_owned(), json!(unknown.channel)),
        ("axes".to_owned(), json!(unknown.axes)),
        ("band_hz".to_owned(), json!(band)),
        ("intervals_s".to_owned(), json!(intervals)),
        ("depends_on".to_owned(), json!(unknown.depends_on)),
    ]);
    Cause {
        effect: "unknown".to_owned(),
        probability: unknown.probability,
        parameters,
        standard_errors: BTreeMap::new(),
        gap_share,
        after,
    }
}

fn verdict(causes: &[Cause], before: &Metrics, after: &Metrics) -> String {
    let Some(first) = causes.first() else {
        return format!(
            "No cause: the residual ({:.3} m/s2, {:.4} rad/s) is what the sensor's noise and the reference's own error leave.",
            before.accel_rmse, before.gyro_rmse
        );
    };
    let percent = |share: f64| (100.0 * share).round();
    let share = |cause: &Cause| {
        if cause.gap_share < 0.005 {
            "below 1 %".to_owned()
        } else {
            format!("{} %", percent(cause.gap_share))
        }
    };
    let first_words = if first.effect == "unknown" {
        "Something outside the library (unknown)"
    } else {
        &first.effect
    };
    let mut text = format!("{first_words} explains {} of the gap", share(first));
    for cause in &causes[1..] {
        let words = if cause.effect == "unknown" {
            "something outside the library (unknown)"
        } else {
            &cause.effect
        };
        text += &format!(", {words} {}", share(cause));
    }
    format!(
        "{text}; the accelerometer's falls from {:.3} to {:.3} m/s2, the gyroscope's from {:.4} to {:.4} rad/s.",
        before.accel_rmse, after.accel_rmse, before.gyro_rmse, after.gyro_rmse
    )
}
