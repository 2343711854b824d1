//! White noise, bias instability and bias walk by an Allan curve.

use nalgebra::{DMatrix, DVector};

use super::AllanPoint;
use crate::{Channel, Device, EffectKind};

/// How much the deviance has to fall for each further parameter. By chance 4 would do in one of 22
/// curves of independent points; with it a walk was taken for a process in one of 25.
const DEVIANCE_PER_PARAMETER: f64 = 6.0;
/// Standard normal quantile of both ends of a 95 % interval.
const Z: f64 = 1.96;
/// Minimum of a flicker floor over the bias instability, `sqrt(2 ln 2 / pi)` (IEEE Std 952, C.1.3).
const FLOOR: f64 = 0.664;
/// Octaves of an overlapping curve share their noise: taken as independent, 123 of 150 intervals of 95 %
/// held the truth of a generator. Variances are so many times what independent octaves would leave.
const SHARED: f64 = 2.0;
const STEPS: usize = 200;

/// What makes up the slow and fast noise of a channel, in its SI unit (m/s2 or rad/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoiseModel {
    /// White noise, unit/sqrt(Hz).
    pub white: f64,
    /// Deviation (unit) and time constant (s) of the Gauss-Markov process; (0, 0) for none.
    pub instability: (f64, f64),
    /// Random walk, (unit/s)/sqrt(Hz).
    pub walk: f64,
}

/// A model that was fitted, with 95 % intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFit {
    /// The values.
    pub model: NoiseModel,
    /// Of white noise, deviation, time constant and walk; none of what the curve does not show.
    pub intervals: [Option<(f64, f64)>; 4],
    /// The bias instability as data sheets have it: least deviation of the fitted curve over 0.664,
    /// and where. None where the curve still falls at its end.
    pub floor: Option<(f64, f64)>,
    /// Deviance over its degrees of freedom: 1 where the model has the curve's shape, less where its
    /// points share their noise.
    pub misfit: f64,
    /// From this averaging time on the model was fitted: below it a device's filter bends the curve.
    pub from_s: f64,
}

/// Logarithms of N^2, s^2, T and K^2, of which those not fitted are not there.
type Values = [Option<f64>; 4];

impl NoiseModel {
    /// Allan variance at an averaging time.
    pub fn variance(&self, tau_s: f64) -> f64 {
        parts(&self.values(), tau_s).iter().sum()
    }

    /// What a device file states of a channel.
    pub fn of_device(device: &Device, channel: Channel) -> Self {
        use EffectKind as Kind;
        let (declared, [noise, instability, walk]) = match channel {
            Channel::Accelerometer => (
                device.accel_density(),
                [
                    Kind::AccelNoise,
                    Kind::AccelBiasInstability,
                    Kind::AccelBiasWalk,
                ],
            ),
            Channel::Gyroscope => (
                device.gyro_density(),
                [
                    Kind::GyroNoise,
                    Kind::GyroBiasInstability,
                    Kind::GyroBiasWalk,
                ],
            ),
        };
        let value = |kind, k: usize| device.effects().get(kind).map_or(0.0, |it| it.values()[k]);
        Self {
            white: declared.hypot(value(noise, 0)),
            instability: (value(instability, 0), value(instability, 1)),
            walk: value(walk, 0),
        }
    }

    fn values(&self) -> Values {
        let log = |value: f64| (value > 0.0).then(|| value.ln());
        let (deviation, time_constant) = self.instability;
        [
            log(self.white * self.white),
            log(deviation * deviation),
            log(time_constant),
            log(self.walk * self.walk),
        ]
    }

    fn of(values: &Values) -> Self {
        let root = |value: Option<f64>| value.map_or(0.0, |log| (0.5 * log).exp());
        Self {
            white: root(values[0]),
            instability: (root(values[1]), values[2].map_or(0.0, f64::exp)),
            walk: root(values[3]),
        }
    }

    /// The model with the fewest parts that the curve does not contradict; none of a curve of fewer
    /// than six points or of readings that stand still. By likelihood, with the points of every octave:
    /// their variances are taken as independent.
    pub fn fit(curve: &[AllanPoint]) -> Option<NoiseFit> {
        let octaves: Vec<AllanPoint> = curve
            .iter()
            .filter(|point| {
                let factor = (point.tau_s / curve[0].tau_s).round() as u64;
                factor.is_power_of_two() && point.deviation > 0.0
            })
            .copied()
            .collect();
        if octaves.len() < 6 {
            return None;
        }
        let mut best: Option<NoiseFit> = None;
        for first in 0..=octaves.len() / 3 {
            let fitted = of_points(&octaves[first..])?;
            let fits = fitted.misfit < 1.0 + 3.0 * (2.0 / (octaves.len() - first) as f64).sqrt();
            if best.is_none_or(|best| fitted.misfit < best.misfit) {
                best = Some(fitted);
            }
            if fits {
                break;
            }
        }
        best
    }
}

/// Variance of each part at an averaging time.
fn parts(values: &Values, tau: f64) -> [f64; 3] {
    let white = values[0].map_or(0.0, |log| log.exp() / tau);
    let instability = values[1].zip(values[2]).map_or(0.0, |(variance, time)| {
        let x = tau / time.exp();
        // The bracket loses its digits for small x, where it is x^2 / 3 (1 - 3 x / 4 + 7 x^2 / 20).
        let bracket = if x < 1e-2 {
            x * x / 3.0 * (1.0 - 0.75 * x + 0.35 * x * x)
        } else {
            1.0 - (3.0 - 4.0 * (-x).exp() + (-2.0 * x).exp()) / (2.0 * x)
        };
        variance.exp() * 2.0 / x * bracket
    });
    let walk = values[3].map_or(0.0, |log| log.exp() * tau / 3.0);
    [white, instability, walk]
}

fn of_points(points: &[AllanPoint]) -> Option<NoiseFit> {
    let (first, last) = (points.first()?, points.last()?);
    let white = Some((first.deviation.powi(2) * first.tau_s).ln());
    let walk = Some((3.0 * last.deviation.powi(2) / last.tau_s).ln());
    let mut starts: Vec<Values> = vec![[white, None, None, None], [white, None, None, walk]];
    for point in &points[1..points.len() - 1] {
        // The process is highest at 1.89 time constants, with 0.382 of its variance.
        let process = [
            Some((point.deviation.powi(2) / 0.382).ln()),
            Some((point.tau_s / 1.89).ln()),
        ];
        starts.push([white, process[0], process[1], None]);
        starts.push([white, process[0], process[1], walk]);
    }
    let price = |values: &Values| DEVIANCE_PER_PARAMETER * values.iter().flatten().count() as f64;
    let (values, deviance) = starts
        .into_iter()
        .map(|start| maximise(points, start))
        .filter(|(values, _)| is_told(points, values))
        .min_by(|a, b| (a.1 + price(&a.0)).total_cmp(&(b.1 + price(&b.0))))?;
    let free: Vec<usize> = (0..4).filter(|k| values[*k].is_some()).collect();
    let covariance = information(points, &values, &free).0.try_inverse()?;
    let mut intervals = [None; 4];
    for (place, &k) in free.iter().enumerate() {
        let error = Z * (SHARED * covariance[(place, place)].max(0.0)).sqrt();
        let scale = if k == 2 { 1.0 } else { 0.5 };
        let at = |sign: f64| values[k].map_or(0.0, |log| (scale * (log + sign * error)).exp());
        intervals[k] = Some((at(-1.0), at(1.0)));
    }
    let model = NoiseModel::of(&values);
    let spare = points.len().saturating_sub(free.len()).max(1);
    Some(NoiseFit {
        model,
        intervals,
        floor: floor(&model, first.tau_s, last.tau_s),
        misfit: deviance / spare as f64,
        from_s: first.tau_s,
    })
}

/// Whether a time constant lies within the averaging times: outside them the process is white noise
/// or a walk.
fn is_told(points: &[AllanPoint], values: &Values) -> bool {
    let span = [points.first(), points.last()].map(|point| point.map_or(0.0, |it| it.tau_s));
    values[2].is_none_or(|log| (0.5 * span[0]..0.7 * span[1]).contains(&log.exp()))
}

/// Least of the fitted curve, over the floor's factor.
fn floor(model: &NoiseModel, from: f64, to: f64) -> Option<(f64, f64)> {
    let count = 400;
    let tau = |k: usize| from * (to / from).powf(k as f64 / count as f64);
    let (k, least) = (0..=count)
        .map(|k| (k, model.variance(tau(k)).sqrt()))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    (k > 0 && k < count).then(|| (least / FLOOR, tau(k)))
}

/// Fisher scoring with halved steps, from a start; the values and their deviance.
fn maximise(points: &[AllanPoint], start: Values) -> (Values, f64) {
    let free: Vec<usize> = (0..4).filter(|k| start[*k].is_some()).collect();
    let (mut values, mut best) = (start, deviance(points, &start));
    for _ in 0..STEPS {
        let (mut matrix, slope) = information(points, &values, &free);
        for k in 0..free.len() {
            matrix[(k, k)] += 1e-9 + 1e-6 * matrix[(k, k)];
        }
        let Some(step) = matrix.lu().solve(&slope) else {
            break;
        };
        let before = best;
        let mut length = (2.0 / step.amax().max(1e-12)).min(1.0);
        while length > 1e-4 {
            let mut tried = values;
            for (place, &k) in free.iter().enumerate() {
                tried[k] = tried[k].map(|log| log + length * step[place]);
            }
            let found = deviance(points, &tried);
            if found < best {
                (values, best) = (tried, found);
                break;
            }
            length *= 0.5;
        }
        if before - best < 1e-9 {
            break;
        }
    }
    (values, best)
}

/// `sum edf (v / m - 1 - ln(v / m))` of the estimates v and the model's m.
fn deviance(points: &[AllanPoint], values: &Values) -> f64 {
    let of = |point: &AllanPoint| {
        let ratio = point.deviation.powi(2) / parts(values, point.tau_s).iter().sum::<f64>();
        point.degrees_of_freedom * (ratio - 1.0 - ratio.ln())
    };
    let sum: f64 = points.iter().map(of).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Fisher's information on the free values, and the slope of the likelihood.
fn information(
    points: &[AllanPoint],
    values: &Values,
    free: &[usize],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = DMatrix::zeros(free.len(), free.len());
    let mut slope = DVector::zeros(free.len());
    for point in points {
        let own = parts(values, point.tau_s);
        let model: f64 = own.iter().sum();
        let share = DVector::from_iterator(
            free.len(),
            free.iter().map(|k| match k {
                0 => own[0] / model,
                1 => own[1] / model,
                2 => by_time_constant(values, point.tau_s) / model,
                _ => own[2] / model,
            }),
        );
        let weight = 0.5 * point.degrees_of_freedom;
        slope += &share * (weight * (point.deviation.powi(2) / model - 1.0));
        matrix += &share * share.transpose() * weight;
    }
    (matrix, slope)
}

/// Derivative of the process' variance by the logarithm of its time constant.
fn by_time_constant(values: &Values, tau: f64) -> f64 {
    const STEP: f64 = 1e-4;
    let at = |step: f64| {
        let mut moved = *values;
        moved[2] = moved[2].map(|log| log + step);
        parts(&moved, tau)[1]
    };
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}
