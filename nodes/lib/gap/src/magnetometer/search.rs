//! The smallest set of a magnetometer's effects that earns its place.

use std::collections::BTreeMap;

use cromosim_imu::Magnetometer;
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde_json::{Value, json};

use super::fit::{
    FieldFit, Fitted, Parts, SOFT_VALUES, Values, correlated_readings, moved_soft_iron, residuals,
    sigma_of,
};
use super::samples::FieldSamples;
use super::starts::starts;
use crate::diagnosis::{MagneticCause, MagneticGap, MagnetometerDiagnosis, Unidentifiable};
use crate::evidence::MagneticCurves;
use crate::findings::Findings;
use crate::policy::magnetometer as policy;
use crate::policy::price::{CHOICE_NATS, EFFECT_NATS, VALUE_NATS};
use crate::prepared::FOLDS;
use crate::record::MeasuredField;

/// A recording's findings and what its magnetometer read.
pub(crate) struct MagneticRecording<'a> {
    pub findings: &'a Findings<'a>,
    pub measured: &'a MeasuredField,
}

/// What was found, and what a simulation takes of it.
pub(crate) struct MagneticAnswer {
    pub diagnosis: MagnetometerDiagnosis,
    /// None where nothing could be compared.
    pub simulated: Option<(Magnetometer, Vector3<f64>)>,
    pub curves: MagneticCurves,
}

/// Diagnoses the magnetometer of a placement, from all recordings that hold its readings; none where none
/// does. The field is each recording's own, all else the device's.
pub(crate) fn diagnose_magnetometer(recordings: &[MagneticRecording]) -> Option<MagneticAnswer> {
    let measured: usize = recordings.iter().map(|own| own.measured.stamps.len()).sum();
    if measured == 0 {
        return None;
    }
    let sampled = recordings.iter();
    let samples: Vec<FieldSamples> = sampled
        .filter_map(|own| FieldSamples::new(own.findings, own.measured))
        .filter(|own| own.stamps.len() >= policy::LEAST_READINGS)
        .collect();
    if let Some(problem) = problem(&samples) {
        return Some(MagneticAnswer {
            diagnosis: MagnetometerDiagnosis {
                verdict: problem,
                ..MagnetometerDiagnosis::default()
            },
            simulated: None,
            curves: MagneticCurves::default(),
        });
    }
    Some(Search::new(&samples).answer())
}

/// Why nothing can be compared.
fn problem(samples: &[FieldSamples]) -> Option<String> {
    let mut strengths: Vec<f64> = samples
        .iter()
        .flat_map(|own| own.readings.iter().map(Vector3::norm))
        .collect();
    if strengths.is_empty() {
        return Some(format!(
            "not diagnosed: fewer than {} readings with a reference beside them",
            policy::LEAST_READINGS
        ));
    }
    strengths.sort_unstable_by(f64::total_cmp);
    let median = strengths[strengths.len() / 2];
    (!(policy::WEAKEST_T..=policy::STRONGEST_T).contains(&median)).then(|| {
        format!(
            "not diagnosed: its readings are {median:.3e} T strong, the earth's field is 2e-5 to 7e-5 T; are they in tesla (1 uT is 1e-6 T)?"
        )
    })
}

/// A set that was fitted and judged.
struct Scored {
    fit: FieldFit,
    /// Huber's loss on held-out time, nats.
    loss: f64,
    /// Mean square of the residual vector on held-out time, T2.
    mean_square: f64,
}

struct Search<'a> {
    samples: &'a [FieldSamples<'a>],
    nominal: Scored,
    /// One for each of [`Parts::sets`], at the axes that were found.
    scored: Vec<Scored>,
    axes_are_turned: bool,
}

impl<'a> Search<'a> {
    fn new(samples: &'a [FieldSamples<'a>]) -> Self {
        let (nominal, best) = starts(samples);
        let plain = Fitted {
            samples,
            held_out: None,
            correlated: 1.0,
        };
        let full = plain.fit(Parts::ALL, &best);
        let rest = residuals(samples, &full.values);
        let sigma = sigma_of(samples, &rest, None);
        let correlated = correlated_readings(samples, &rest, policy::BLOCK_S);
        let judge = Judge {
            samples,
            sigma,
            correlated,
        };
        let axes_are_turned = best.axes != Matrix3::identity();
        let start = |parts: Parts, from: &Values| Values {
            hard_iron: if parts.hard {
                from.hard_iron
            } else {
                Vector3::zeros()
            },
            delay: if parts.delay { from.delay } else { 0.0 },
            ..from.clone()
        };
        Self {
            samples,
            nominal: judge.scored(Parts::default(), &start(Parts::default(), &nominal)),
            scored: Parts::sets()
                .map(|parts| judge.scored(parts, &start(parts, &best)))
                .collect(),
            axes_are_turned,
        }
    }

    fn of(&self, parts: Parts) -> &Scored {
        let own = self.scored.iter().find(|own| own.fit.parts == parts);
        own.unwrap_or(&self.nominal)
    }

    /// What a set gains on held-out time over the nominal magnetometer, less its price, nats.
    fn net_gain(&self, scored: &Scored) -> f64 {
        let axes = if self.axes_are_turned {
            EFFECT_NATS + CHOICE_NATS
        } else {
            0.0
        };
        self.nominal.loss - scored.loss - price(scored.fit.parts) - axes
    }

    /// The best set whose members are of a size that matters.
    fn chosen(&self) -> (&Scored, bool) {
        let matter = self.scored.iter().filter(|own| is_worth_naming(&own.fit));
        let best = matter.max_by(|a, b| self.net_gain(a).total_cmp(&self.net_gain(b)));
        match best {
            Some(best) if self.net_gain(best) > 0.0 => (best, self.axes_are_turned),
            _ => (&self.nominal, false),
        }
    }

    fn answer(&self) -> MagneticAnswer {
        let (chosen, turned) = self.chosen();
        let (values, scale) = normalised(&chosen.fit.values);
        let causes = self.causes(chosen, turned);
        let field = values.fields.last().copied().unwrap_or_default();
        let white: f64 = self
            .samples
            .iter()
            .map(|own| own.white_sigma.powi(2))
            .sum::<f64>()
            / self.samples.len() as f64;
        let rate_hz = self.samples.last().map_or(1.0, |own| own.rate_hz);
        let density = (white / rate_hz).sqrt();
        let before = self.nominal.mean_square.sqrt();
        let after = chosen.mean_square.sqrt();
        let errors = three_errors(&chosen.fit.covariance, 3 * (values.fields.len() - 1));
        let diagnosis = MagnetometerDiagnosis {
            verdict: verdict(&causes, before, after),
            gap: Some(MagneticGap { before, after }),
            unidentifiable: self.unidentifiable(chosen),
            field_in_world: Some(field.into()),
            field_standard_errors: Some(errors.map(|error| error * scale.abs())),
            noise_density: density,
            beyond_noise: (chosen.mean_square - 3.0 * white).max(0.0).sqrt(),
            causes,
        };
        let magnetometer = Magnetometer {
            noise_density: density,
            hard_iron: values.hard_iron,
            soft_iron: values.soft_iron * values.axes,
            delay: values.delay,
            ..Magnetometer::default()
        };
        MagneticAnswer {
            curves: self.curves(&chosen.fit.values),
            diagnosis,
            simulated: Some((magnetometer, field)),
        }
    }

    /// The effects of a set by their shares; that of the axes is what they bring alone.
    fn causes(&self, chosen: &Scored, turned: bool) -> Vec<MagneticCause> {
        let parts = chosen.fit.parts;
        let mut found: Vec<(&'static str, &Scored, Described)> = Vec::new();
        let described = Described::all(&chosen.fit);
        if parts.hard {
            let rest = self.of(Parts {
                hard: false,
                ..parts
            });
            found.push(("hard_iron", rest, described.hard));
        }
        if parts.soft {
            let rest = self.of(Parts {
                soft: false,
                ..parts
            });
            found.push(("soft_iron", rest, described.soft));
        }
        if parts.delay {
            let rest = self.of(Parts {
                delay: false,
                ..parts
            });
            found.push(("delay", rest, described.delay));
        }
        if turned {
            found.push(("axes", &self.nominal, described.axes));
        }
        let before = self.nominal.mean_square;
        let explained = (1.0 - chosen.mean_square / before).clamp(0.0, 1.0);
        let lost = |rest: &Scored| (rest.mean_square - chosen.mean_square).max(0.0);
        let all: f64 = found.iter().map(|(_, rest, _)| lost(rest)).sum();
        let mut causes: Vec<MagneticCause> = found
            .into_iter()
            .map(|(effect, rest, of)| MagneticCause {
                effect: effect.to_owned(),
                gain_nats: rest.loss - chosen.loss,
                gap_share: explained * lost(rest) / all.max(1e-300),
                parameters: BTreeMap::from([(effect.to_owned(), of.value)]),
                standard_errors: of
                    .error
                    .map(|error| BTreeMap::from([(effect.to_owned(), error)]))
                    .unwrap_or_default(),
            })
            .collect();
        causes.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
        causes
    }

    /// Effects whose values this motion leaves open, beside the chosen set.
    fn unidentifiable(&self, chosen: &Scored) -> Vec<Unidentifiable> {
        let parts = chosen.fit.parts;
        let first = 3 * self.samples.len();
        let largest = |with: Parts, at: usize, count: usize| {
            let covariance = &self.of(with).fit.covariance;
            let variance = |k: usize| covariance.get((k, k)).copied().unwrap_or(f64::MAX);
            let largest = (at..at + count).map(variance).fold(0.0, f64::max);
            largest.max(0.0).sqrt()
        };
        let hard = largest(
            Parts {
                hard: true,
                ..parts
            },
            first,
            3,
        );
        let after_hard = first + 3 * usize::from(parts.hard);
        let soft = largest(
            Parts {
                soft: true,
                ..parts
            },
            after_hard,
            SOFT_VALUES,
        );
        let after_soft = after_hard + SOFT_VALUES * usize::from(parts.soft);
        let delay = largest(
            Parts {
                delay: true,
                ..parts
            },
            after_soft,
            1,
        );
        let tests = [
            (
                "hard_iron",
                hard,
                policy::RELEVANT_HARD_IRON_T,
                policy::TURN_ABOUT_TWO,
            ),
            (
                "soft_iron",
                soft,
                policy::RELEVANT_SOFT_IRON,
                policy::TURN_ABOUT_ALL,
            ),
            ("delay", delay, policy::RELEVANT_DELAY_S, policy::TURN_FAST),
        ];
        tests
            .into_iter()
            .filter(|(_, error, relevant, _)| 2.0 * error > *relevant)
            .map(|(effect, _, _, would_tell)| Unidentifiable {
                effect: effect.to_owned(),
                would_tell: would_tell.to_owned(),
            })
            .collect()
    }

    /// Residuals of the last recording.
    fn curves(&self, chosen: &Values) -> MagneticCurves {
        let last = |values: &Values| residuals(self.samples, values).pop().unwrap_or_default();
        let three = |list: Vec<Vector3<f64>>| list.into_iter().map(Into::into).collect();
        let stamps = self.samples.last().map(|own| own.stamps.clone());
        MagneticCurves {
            stamps: stamps.unwrap_or_default(),
            before: three(last(&self.nominal.fit.values)),
            after: three(last(chosen)),
        }
    }
}

/// Judges sets on time that they were not fitted to, all with the same noise.
struct Judge<'a> {
    samples: &'a [FieldSamples<'a>],
    sigma: f64,
    correlated: f64,
}

impl Judge<'_> {
    fn scored(&self, parts: Parts, start: &Values) -> Scored {
        let fitted = Fitted {
            samples: self.samples,
            held_out: None,
            correlated: self.correlated,
        };
        let fit = fitted.fit(parts, start);
        let (mut loss, mut squares, mut count) = (0.0, 0.0, 0.0);
        for fold in 0..FOLDS {
            let fitted = Fitted {
                held_out: Some(fold),
                ..fitted
            };
            let of_fold = fitted.fit(parts, &fit.values);
            let rest = residuals(self.samples, &of_fold.values);
            for (own, rest) in self.samples.iter().zip(&rest) {
                let held_out = own.folds.iter().zip(rest).filter(|(own, _)| **own == fold);
                for (_, residual) in held_out {
                    loss += self.loss(residual) / self.correlated;
                    squares += residual.norm_squared();
                    count += 1.0;
                }
            }
        }
        Scored {
            fit,
            loss,
            mean_square: squares / f64::max(count, 1.0),
        }
    }

    /// Huber's, in units of the noise, nats.
    fn loss(&self, residual: &Vector3<f64>) -> f64 {
        let (length, outlier) = (residual.norm() / self.sigma, policy::OUTLIER_SIGMAS);
        if length <= outlier {
            0.5 * length.powi(2)
        } else {
            outlier * (length - 0.5 * outlier)
        }
    }
}

/// What a set has to gain, nats.
fn price(parts: Parts) -> f64 {
    EFFECT_NATS * parts.count() as f64 + VALUE_NATS * parts.values() as f64
}

/// Whether each member is beyond what every device has.
fn is_worth_naming(fit: &FieldFit) -> bool {
    let (values, _) = normalised(&fit.values);
    let soft = (values.soft_iron - Matrix3::identity()).amax();
    (!fit.parts.hard || values.hard_iron.norm() >= policy::ORDINARY_HARD_IRON_T)
        && (!fit.parts.soft || soft >= policy::ORDINARY_SOFT_IRON)
        && (!fit.parts.delay || values.delay.abs() >= policy::ORDINARY_DELAY_S)
}

/// With a soft iron of determinant 1, and the scale that its fields took over.
fn normalised(values: &Values) -> (Values, f64) {
    let scale = values.soft_iron.determinant().cbrt();
    if scale.abs() < 1e-9 {
        return (values.clone(), 1.0);
    }
    let normalised = Values {
        fields: values.fields.iter().map(|field| field * scale).collect(),
        soft_iron: values.soft_iron / scale,
        ..values.clone()
    };
    (normalised, scale)
}

/// A value and its standard error as diagnosis.json has them.
struct Described {
    value: Value,
    error: Option<Value>,
}

struct AllDescribed {
    hard: Described,
    soft: Described,
    delay: Described,
    axes: Described,
}

impl Described {
    fn all(fit: &FieldFit) -> AllDescribed {
        let (values, _) = normalised(&fit.values);
        let first = 3 * values.fields.len();
        let after_hard = first + 3 * usize::from(fit.parts.hard);
        let after_soft = after_hard + SOFT_VALUES * usize::from(fit.parts.soft);
        let rows =
            |of: &Matrix3<f64>| json!(of.transpose().as_slice().chunks(3).collect::<Vec<_>>());
        let variance = |k: usize| fit.covariance.get((k, k)).copied().unwrap_or_default();
        AllDescribed {
            hard: Described {
                value: json!(values.hard_iron.as_slice()),
                error: Some(json!(three_errors(&fit.covariance, first))),
            },
            soft: Described {
                value: rows(&values.soft_iron),
                error: Some(rows(&soft_errors(fit, after_hard))),
            },
            delay: Described {
                value: json!(values.delay),
                error: Some(json!(variance(after_soft).max(0.0).sqrt())),
            },
            axes: Described {
                value: rows(&values.axes),
                error: None,
            },
        }
    }
}

fn three_errors(covariance: &DMatrix<f64>, first: usize) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let place = (first + axis, first + axis);
        covariance
            .get(place)
            .copied()
            .unwrap_or_default()
            .max(0.0)
            .sqrt()
    })
}

/// Standard errors of the entries of the normalised soft iron, by differences along its fitted values.
fn soft_errors(fit: &FieldFit, first: usize) -> Matrix3<f64> {
    const STEP: f64 = 1e-5;
    if !fit.parts.soft || fit.covariance.nrows() < first + SOFT_VALUES {
        return Matrix3::zeros();
    }
    let at = |index: usize, step: f64| {
        let mut change = [0.0; SOFT_VALUES];
        change[index] = step;
        let moved = moved_soft_iron(&fit.values.soft_iron, &change);
        moved / moved.determinant().cbrt()
    };
    let slopes: Vec<Matrix3<f64>> = (0..SOFT_VALUES)
        .map(|index| (at(index, STEP) - at(index, -STEP)) / (2.0 * STEP))
        .collect();
    Matrix3::from_fn(|row, column| {
        let mut variance = 0.0;
        for (i, a) in slopes.iter().enumerate() {
            for (j, b) in slopes.iter().enumerate() {
                let shared = fit.covariance[(first + i, first + j)];
                variance += a[(row, column)] * b[(row, column)] * shared;
            }
        }
        variance.max(0.0).sqrt()
    })
}

fn verdict(causes: &[MagneticCause], before: f64, after: f64) -> String {
    let [before, after] = [before, after].map(|rmse| format!("{:.3} uT", 1e6 * rmse));
    if causes.is_empty() {
        return format!("no magnetometer error beyond the ordinary; {before} are left");
    }
    let named: Vec<String> = causes
        .iter()
        .map(|cause| format!("{} ({:.0} %)", cause.effect, 100.0 * cause.gap_share))
        .collect();
    format!("{}; {before} -> {after}", named.join(", "))
}
