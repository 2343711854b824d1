//! Gauss-Newton fits of a magnetometer's parameters.

use cromosim_spatial::Stamp;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::samples::FieldSamples;
use crate::policy::magnetometer::{
    DELAY_PRIOR_S, DELAY_STEP_S, FIELD_PRIOR_T, HARD_IRON_PRIOR_T, MOST_STEPS, OUTLIER_SIGMAS,
    SOFT_IRON_PRIOR,
};

/// Median of the length of three standard normal numbers.
const MEDIAN_LENGTH: f64 = 1.538;
/// Values of a soft iron whose scale as a whole is the field's: its trace stays.
pub(super) const SOFT_VALUES: usize = 8;
/// No noise is smaller, T.
const LEAST_SIGMA_T: f64 = 1e-12;

/// Which of the effects a set has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Parts {
    pub hard: bool,
    pub soft: bool,
    pub delay: bool,
}

impl Parts {
    pub const ALL: Self = Self {
        hard: true,
        soft: true,
        delay: true,
    };

    /// All sets, the empty one first.
    pub fn sets() -> impl Iterator<Item = Self> {
        (0..8).map(|bits| Self {
            hard: bits & 1 > 0,
            soft: bits & 2 > 0,
            delay: bits & 4 > 0,
        })
    }

    /// Fitted values beside the fields.
    pub fn values(self) -> usize {
        3 * usize::from(self.hard) + SOFT_VALUES * usize::from(self.soft) + usize::from(self.delay)
    }

    /// Its effects.
    pub fn count(self) -> usize {
        usize::from(self.hard) + usize::from(self.soft) + usize::from(self.delay)
    }
}

/// `m = S A R_SW(t - delay) B + h`, T.
#[derive(Clone, Debug)]
pub(super) struct Values {
    /// B of each recording, T, world axes.
    pub fields: Vec<Vector3<f64>>,
    /// h.
    pub hard_iron: Vector3<f64>,
    /// S.
    pub soft_iron: Matrix3<f64>,
    /// A: the magnetometer's axes against the accelerometer's, a signed permutation.
    pub axes: Matrix3<f64>,
    /// s.
    pub delay: f64,
}

/// A fit with its uncertainty.
#[derive(Clone, Debug)]
pub(super) struct FieldFit {
    pub parts: Parts,
    pub values: Values,
    /// Of the fields, then h, the values of S, the delay, as far as they are fitted.
    pub covariance: DMatrix<f64>,
}

/// What is fitted to: all readings but those of one part of time.
#[derive(Clone, Copy)]
pub(super) struct Fitted<'a> {
    pub samples: &'a [FieldSamples<'a>],
    pub held_out: Option<usize>,
    /// Readings that go for one, as their residuals resemble those before.
    pub correlated: f64,
}

impl Fitted<'_> {
    /// From start values on, until steps bring nothing.
    pub fn fit(&self, parts: Parts, start: &Values) -> FieldFit {
        let mut values = start.clone();
        let mut best = self.linearised(parts, &values);
        for _ in 0..MOST_STEPS {
            let Some(step) = best
                .normal
                .clone()
                .cholesky()
                .map(|it| it.solve(&best.right))
            else {
                break;
            };
            let next = stepped(&values, parts, &step);
            let linear = self.linearised(parts, &next);
            let sigma_ratio = linear.sigma / best.sigma;
            if sigma_ratio > 1.5 {
                break;
            }
            (values, best) = (next, linear);
            if (sigma_ratio - 1.0).abs() < 1e-7 {
                break;
            }
        }
        let covariance = best.normal.clone().try_inverse();
        FieldFit {
            parts,
            values,
            covariance: covariance.unwrap_or_else(|| DMatrix::zeros(0, 0)),
        }
    }

    /// Normal equations at some values, weights of outliers lowered (Huber).
    fn linearised(&self, parts: Parts, values: &Values) -> Linearised {
        let residuals = residuals(self.samples, values);
        let sigma = sigma_of(self.samples, &residuals, self.held_out);
        let count = 3 * values.fields.len() + parts.values();
        let mut linear = Linearised {
            normal: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
            sigma,
        };
        let outlier = OUTLIER_SIGMAS * sigma;
        let mut row = vec![[0.0; 3]; count];
        for (number, samples) in self.samples.iter().enumerate() {
            let turns = samples.turns(values.delay);
            let moved = parts
                .delay
                .then(|| [0.5, -0.5].map(|step| samples.turns(values.delay + step * DELAY_STEP_S)));
            for k in 0..turns.len() {
                if self.held_out == Some(samples.folds[k]) {
                    continue;
                }
                let moved = moved
                    .as_ref()
                    .map(|[on, back]| (on[k] - back[k]) / DELAY_STEP_S);
                columns(&mut row, parts, values, number, (&turns[k], moved));
                let residual = residuals[number][k];
                let weight = (outlier / residual.norm().max(1e-300)).min(1.0)
                    / (sigma.powi(2) * self.correlated);
                linear.add(&row, &residual, weight);
            }
        }
        linear.add_priors(parts, values);
        linear
    }
}

struct Linearised {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    sigma: f64,
}

impl Linearised {
    fn add(&mut self, row: &[[f64; 3]], residual: &Vector3<f64>, weight: f64) {
        for (i, a) in row.iter().enumerate() {
            let weighted = a.map(|value| value * weight);
            let dot = |b: &[f64]| weighted[0] * b[0] + weighted[1] * b[1] + weighted[2] * b[2];
            self.right[i] += dot(residual.as_slice());
            for (j, b) in row.iter().enumerate().skip(i) {
                self.normal[(i, j)] += dot(b);
            }
        }
    }

    /// Weak priors around a magnetometer without error, so that what the motion does not show stays
    /// there with a large standard error.
    fn add_priors(&mut self, parts: Parts, values: &Values) {
        let count = self.right.len();
        for i in 0..count {
            for j in 0..i {
                self.normal[(i, j)] = self.normal[(j, i)];
            }
        }
        let fields = values.fields.iter().flat_map(|field| field.iter().copied());
        let mut priors: Vec<(f64, f64)> = fields.map(|value| (value, FIELD_PRIOR_T)).collect();
        if parts.hard {
            let hard = values.hard_iron.iter();
            priors.extend(hard.map(|value| (*value, HARD_IRON_PRIOR_T)));
        }
        if parts.soft {
            let soft = soft_values(&(values.soft_iron - Matrix3::identity()));
            priors.extend(soft.map(|value| (value, SOFT_IRON_PRIOR)));
        }
        if parts.delay {
            priors.push((values.delay, DELAY_PRIOR_S));
        }
        for (i, (value, deviation)) in priors.into_iter().enumerate() {
            self.normal[(i, i)] += deviation.powi(-2);
            self.right[i] -= value * deviation.powi(-2);
        }
    }
}

/// Derivatives of a prediction by each fitted value.
fn columns(
    row: &mut [[f64; 3]],
    parts: Parts,
    values: &Values,
    recording: usize,
    (turn, moved): (&Matrix3<f64>, Option<Matrix3<f64>>),
) {
    row.fill([0.0; 3]);
    let field = &values.fields[recording];
    let by_field = values.soft_iron * values.axes * turn;
    for axis in 0..3 {
        row[3 * recording + axis] = by_field.column(axis).into_owned().into();
    }
    let mut next = 3 * values.fields.len();
    if parts.hard {
        for axis in 0..3 {
            row[next + axis][axis] = 1.0;
        }
        next += 3;
    }
    if parts.soft {
        let turned = values.axes * turn * field;
        for (index, direction) in soft_directions().iter().enumerate() {
            row[next + index] = (direction * turned).into();
        }
        next += SOFT_VALUES;
    }
    if let Some(moved) = moved {
        row[next] = (values.soft_iron * values.axes * moved * field).into();
    }
}

/// Directions in which a soft iron changes without changing its trace: the off-diagonal entries row by
/// row, then x against z and y against z.
pub(super) fn soft_directions() -> [Matrix3<f64>; SOFT_VALUES] {
    let entries = [
        (0, 1),
        (0, 2),
        (1, 0),
        (1, 2),
        (2, 0),
        (2, 1),
        (0, 0),
        (1, 1),
    ];
    entries.map(|(row, column)| {
        let mut direction = Matrix3::zeros();
        direction[(row, column)] = 1.0;
        if row == column {
            direction[(2, 2)] = -1.0;
        }
        direction
    })
}

fn soft_values(change: &Matrix3<f64>) -> [f64; SOFT_VALUES] {
    let c = change;
    [
        c[(0, 1)],
        c[(0, 2)],
        c[(1, 0)],
        c[(1, 2)],
        c[(2, 0)],
        c[(2, 1)],
        c[(0, 0)],
        c[(1, 1)],
    ]
}

/// A soft iron some way along its directions.
pub(super) fn moved_soft_iron(soft_iron: &Matrix3<f64>, change: &[f64]) -> Matrix3<f64> {
    let directions = soft_directions();
    let moved = directions.iter().zip(change);
    moved.fold(*soft_iron, |sum, (direction, value)| {
        sum + direction * *value
    })
}

fn stepped(values: &Values, parts: Parts, step: &DVector<f64>) -> Values {
    let mut next = values.clone();
    let three = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
    for (number, field) in next.fields.iter_mut().enumerate() {
        *field += three(3 * number);
    }
    let mut at = 3 * values.fields.len();
    if parts.hard {
        next.hard_iron += three(at);
        at += 3;
    }
    if parts.soft {
        let change = &step.as_slice()[at..at + SOFT_VALUES];
        next.soft_iron = moved_soft_iron(&next.soft_iron, change);
        at += SOFT_VALUES;
    }
    if parts.delay {
        next.delay = (next.delay + step[at]).clamp(-DELAY_PRIOR_S, 1.0);
    }
    next
}

/// Measured less predicted, T, by recording.
pub(super) fn residuals(samples: &[FieldSamples], values: &Values) -> Vec<Vec<Vector3<f64>>> {
    let of = |(own, field): (&FieldSamples, &Vector3<f64>)| {
        let turns = own.turns(values.delay);
        let pairs = own.readings.iter().zip(turns);
        pairs
            .map(|(reading, turn)| {
                reading - values.hard_iron - values.soft_iron * values.axes * turn * field
            })
            .collect()
    };
    samples.iter().zip(&values.fields).map(of).collect()
}

/// Noise per axis by the median length of residuals that are not held out.
pub(super) fn sigma_of(
    samples: &[FieldSamples],
    residuals: &[Vec<Vector3<f64>>],
    held_out: Option<usize>,
) -> f64 {
    let mut lengths: Vec<f64> = samples
        .iter()
        .zip(residuals)
        .flat_map(|(own, residuals)| own.folds.iter().zip(residuals))
        .filter(|(fold, _)| held_out != Some(**fold))
        .map(|(_, residual)| residual.norm())
        .collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() {
        return LEAST_SIGMA_T;
    }
    let median = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
    (median / MEDIAN_LENGTH).max(LEAST_SIGMA_T)
}

/// Readings that go for one: 1 + 2 sum of the autocorrelation up to where it falls below 0.05, at most a
/// block of time that is held out.
pub(super) fn correlated_readings(
    samples: &[FieldSamples],
    residuals: &[Vec<Vector3<f64>>],
    longest_s: f64,
) -> f64 {
    let lag_product = |lag: usize| -> f64 {
        let pairs = residuals
            .iter()
            .flat_map(|own| own.iter().zip(own.iter().skip(lag)));
        pairs.map(|(a, b)| a.dot(b)).sum()
    };
    let period_s = |stamps: &[Stamp]| {
        let spans = stamps.len().saturating_sub(1).max(1) as f64;
        (stamps[stamps.len() - 1] - stamps[0]) / spans
    };
    let period_s = samples.first().map_or(1.0, |own| period_s(&own.stamps));
    let most = (longest_s / period_s.max(1e-6)) as usize;
    let power = lag_product(0).max(1e-300);
    let correlations = (1..=most).map(|lag| lag_product(lag) / power);
    1.0 + 2.0 * correlations.take_while(|it| *it > 0.05).sum::<f64>()
}
