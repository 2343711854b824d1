//! The results of a study of rigid bodies, as results.json holds them.

use serde::{Deserialize, Serialize};

use super::case::{CaseErrors, RigidCase};
use super::definition::RigidStudy;
use super::method::{JUDGED, RigidMethod};
use super::picture::PictureResults;
use super::stated::StatedErrors;
use crate::bootstrap::intervals;
use crate::fidelity::errors::{SquaredErrors, signal};
use crate::fidelity::truth_source::TruthSource;

/// One study of rigid bodies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RigidStudyResults {
    /// Its name.
    pub name: String,
    /// What its measured side is.
    pub measured: String,
    /// What that side rests on.
    pub truth: TruthSource,
    /// Motions or trials, which intervals draw anew.
    pub motions: usize,
    /// IMUs in all of them.
    pub bodies: usize,
    /// Their length, s.
    pub seconds: f64,
    /// Root mean square of what was measured itself, about its mean, per axis: m/s2, rad/s.
    pub signal: [f64; 2],
    /// Every method that the poses' rate allows.
    pub methods: Vec<RigidMethodResults>,
    /// The practice with the best of its cutoffs.
    pub practice: PracticeResults,
    /// Whether readings of `adaptive_spline` err as much as they state.
    pub stated: StatedResults,
    /// `adaptive_spline` by motion and by position.
    pub parts: Vec<RigidPartResults>,
    /// Where a method gave no readings, and why.
    pub failures: Vec<String>,
    /// Some seconds of one IMU, where the protocol asks for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PictureResults>,
}

/// One method in a study. Pairs of numbers are specific force (m/s2) and angular velocity (rad/s).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RigidMethodResults {
    /// Its name.
    pub method: String,
    /// Root mean square errors per axis.
    pub rmse: [f64; 2],
    /// The same of specific force x, y, z and angular velocity x, y, z; sensor axes.
    pub channels: [f64; 6],
    /// The same over that of the practice with the cutoff that is best in hindsight for the study and
    /// the channel.
    pub ratio: [f64; 2],
    /// 95 % of the ratios when motions are drawn anew with replacement and the cutoff chosen anew;
    /// none for one motion.
    pub ratio_interval: Option<[[f64; 2]; 2]>,
    /// Root mean square errors per axis within 0.1 s of the ends of the poses.
    pub ends_rmse: [f64; 2],
    /// IMUs for which it gave no readings; they are in none of its errors.
    pub failed: usize,
}

/// The practice in hindsight.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PracticeResults {
    /// The best cutoff for each channel, Hz.
    pub cutoff_hz: [f64; 2],
    /// Root mean square errors per axis with it.
    pub rmse: [f64; 2],
    /// The same within 0.1 s of the ends.
    pub ends_rmse: [f64; 2],
}

/// Means of squared errors over the variances that the readings' covariances state (and, of real IMUs, over
/// these and what data sheets allow such devices): 1 where they
/// state what they err. Specific force, angular velocity; none where nothing is stated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StatedResults {
    /// Farther than 0.1 s from the ends of the poses.
    pub middle: [Option<f64>; 2],
    /// Within 0.1 s of the ends.
    pub ends: [Option<f64>; 2],
    /// 95 % of both when motions are drawn anew; none for one motion.
    pub intervals: Option<[[[f64; 2]; 2]; 2]>,
}

/// `adaptive_spline` beside the practice in a part of a study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RigidPartResults {
    /// The motion or position.
    pub part: String,
    /// Root mean square errors per axis.
    pub rmse: [f64; 2],
    /// The same over those of the practice with the cutoff that is best for the whole study.
    pub ratio: [f64; 2],
    /// Squared errors over stated variances, farther than 0.1 s from the ends.
    pub stated: [Option<f64>; 2],
}

impl RigidStudyResults {
    /// `errors`: one for each case and method.
    pub(super) fn new(
        study: &RigidStudy,
        cases: &[RigidCase],
        methods: &[RigidMethod],
        errors: &[Vec<CaseErrors>],
        seed: u64,
    ) -> Self {
        let scored = Scored::new(cases, methods, errors, seed);
        let all: Vec<usize> = (0..scored.by_motion.len()).collect();
        let (rmse, best) = scored.best_practice(&all);
        let ends_rmse =
            [0, 1].map(|channel| scored.pooled(&all, best[channel])[1].per_axis()[channel]);
        let measured = errors.iter().flatten().flat_map(|own| &own.measured);
        let failures = errors
            .iter()
            .flatten()
            .filter_map(|own| own.failure.clone());
        let failed = |method: usize| {
            errors
                .iter()
                .filter(|own| own[method].failure.is_some())
                .count()
        };
        Self {
            name: study.name.clone(),
            measured: study.measured.clone(),
            truth: study.truth(),
            motions: all.len(),
            bodies: cases.len(),
            seconds: cases.iter().map(RigidCase::seconds).sum(),
            signal: signal(measured),
            methods: (0..methods.len())
                .map(|method| scored.method(method, &all, failed(method)))
                .collect(),
            practice: PracticeResults {
                cutoff_hz: best.map(|method| methods[method].cutoff_hz().unwrap_or_default()),
                rmse,
                ends_rmse,
            },
            stated: scored.stated(&all),
            parts: scored.parts(cases, errors, best),
            failures: failures.collect(),
            picture: None,
        }
    }
}

/// Errors of middle and ends.
type Places = [SquaredErrors; 2];

/// A motion's errors, summed over its bodies.
struct MotionErrors {
    /// By method.
    errors: Vec<Places>,
    stated: [StatedErrors; 2],
}

/// A study's errors by motion.
struct Scored<'a> {
    methods: &'a [RigidMethod],
    by_motion: Vec<MotionErrors>,
    /// The index of the judged method.
    judged: usize,
    seed: u64,
}

impl<'a> Scored<'a> {
    fn new(
        cases: &[RigidCase],
        methods: &'a [RigidMethod],
        errors: &[Vec<CaseErrors>],
        seed: u64,
    ) -> Self {
        let judged = methods.iter().position(|method| *method == JUDGED);
        let judged = judged.unwrap_or_default();
        let by_motion = names(cases, |case| &case.motion)
            .into_iter()
            .map(|name| summed(cases, errors, judged, |case| case.motion == name))
            .collect();
        Self {
            methods,
            by_motion,
            judged,
            seed,
        }
    }

    /// A method's errors, summed over motions.
    fn pooled(&self, motions: &[usize], method: usize) -> Places {
        let mut sum = Places::default();
        for motion in motions {
            let own = &self.by_motion[*motion].errors[method];
            (0..2).for_each(|place| sum[place].add(&own[place]));
        }
        sum
    }

    /// Errors per axis, the ends included.
    fn rmse(&self, motions: &[usize], method: usize) -> [f64; 2] {
        whole(&self.pooled(motions, method)).per_axis()
    }

    /// Least errors of the practice by channel, and the methods that have them.
    fn best_practice(&self, motions: &[usize]) -> ([f64; 2], [usize; 2]) {
        let (mut least, mut best) = ([f64::INFINITY; 2], [0; 2]);
        for (index, method) in self.methods.iter().enumerate() {
            if method.cutoff_hz().is_none() {
                continue;
            }
            let rmse = self.rmse(motions, index);
            for channel in 0..2 {
                if rmse[channel] < least[channel] {
                    (least[channel], best[channel]) = (rmse[channel], index);
                }
            }
        }
        (least, best)
    }

    fn method(&self, method: usize, all: &[usize], failed: usize) -> RigidMethodResults {
        let ratio = |motions: &[usize]| {
            let (own, (practice, _)) = (self.rmse(motions, method), self.best_practice(motions));
            [own[0] / practice[0], own[1] / practice[1]]
        };
        let pooled = self.pooled(all, method);
        RigidMethodResults {
            method: self.methods[method].title(),
            rmse: whole(&pooled).per_axis(),
            channels: whole(&pooled).channels(),
            ratio: ratio(all),
            ratio_interval: (all.len() > 1).then(|| intervals(all.len(), self.seed, ratio)),
            ends_rmse: pooled[1].per_axis(),
            failed,
        }
    }

    fn stated(&self, all: &[usize]) -> StatedResults {
        let means = |motions: &[usize]| {
            let mut sums = [StatedErrors::default(); 2];
            for motion in motions {
                let own = &self.by_motion[*motion].stated;
                (0..2).for_each(|place| sums[place].add(&own[place]));
            }
            sums.map(|sum| sum.means())
        };
        let [middle, ends] = means(all).map(known);
        let drawn = |motions: &[usize]| {
            let [[a, b], [c, d]] = means(motions);
            [a, b, c, d]
        };
        let drawn = (all.len() > 1).then(|| intervals(all.len(), self.seed, drawn));
        StatedResults {
            middle,
            ends,
            intervals: drawn.map(|[a, b, c, d]| [[a, b], [c, d]]),
        }
    }

    /// By motion, then by position, where there are several.
    fn parts(
        &self,
        cases: &[RigidCase],
        errors: &[Vec<CaseErrors>],
        best: [usize; 2],
    ) -> Vec<RigidPartResults> {
        let part = |part: &str, keep: &dyn Fn(&RigidCase) -> bool| {
            let own = summed(cases, errors, self.judged, keep);
            let rmse = whole(&own.errors[self.judged]).per_axis();
            let ratio = [0, 1].map(|channel| {
                rmse[channel] / whole(&own.errors[best[channel]]).per_axis()[channel]
            });
            RigidPartResults {
                part: part.to_owned(),
                rmse,
                ratio,
                stated: known(own.stated[0].means()),
            }
        };
        let (motions, positions) = (
            names(cases, |case| &case.motion),
            names(cases, |case| &case.position),
        );
        let mut parts = Vec::new();
        if motions.len() > 1 {
            parts.extend(
                motions
                    .iter()
                    .map(|name| part(name, &|case| case.motion == *name)),
            );
        }
        if positions.len() > 1 {
            parts.extend(
                positions
                    .iter()
                    .map(|name| part(name, &|case| case.position == *name)),
            );
        }
        parts
    }
}

/// Different names, in the order of their first cases.
fn names<'a>(cases: &'a [RigidCase], of: impl Fn(&'a RigidCase) -> &'a String) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for case in cases {
        let name = of(case).as_str();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Errors of all methods, summed over cases.
fn summed(
    cases: &[RigidCase],
    errors: &[Vec<CaseErrors>],
    judged: usize,
    keep: impl Fn(&RigidCase) -> bool,
) -> MotionErrors {
    let methods = errors.first().map_or(0, Vec::len);
    let mut sum = MotionErrors {
        errors: vec![Places::default(); methods],
        stated: Default::default(),
    };
    for (_, own) in cases.iter().zip(errors).filter(|(case, _)| keep(case)) {
        for place in 0..2 {
            for (sum, own) in sum.errors.iter_mut().zip(own) {
                sum[place].add(&own.errors[place]);
            }
            sum.stated[place].add(&own[judged].stated[place]);
        }
    }
    sum
}

/// Middle and ends together.
fn whole(places: &Places) -> SquaredErrors {
    let mut sum = places[0];
    sum.add(&places[1]);
    sum
}

fn known(means: [f64; 2]) -> [Option<f64>; 2] {
    means.map(|mean| Some(mean).filter(|mean| mean.is_finite()))
}
