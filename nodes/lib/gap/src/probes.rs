//! Regressions of a residual on what it might depend on.

use cromosim_imu::Reading;
use nalgebra::Vector3;

use crate::diagnose::Findings;
use crate::fit::Fit;
use crate::gram::Linear;
use crate::problem::axis_of;

/// Root mean square of a regressor, in units of the white noise, below which it is left out.
const LEAST_MOTION: f64 = 0.02;

/// Standard deviation of a prediction, in units of the white noise, from which on a sensor moves.
const MOVING: f64 = 2.0;

/// A family of regressors, whitened.
#[derive(Clone, Debug)]
pub(crate) struct Probe {
    /// What the residual would depend on.
    pub depends_on: &'static str,
    pub channel: usize,
    pub columns: Vec<Vec<f64>>,
    /// Held-out gain beside the fit, nats, less two for each column.
    pub gain: f64,
}

/// A regressor: its axis and its value for each message.
type Column = (usize, Vec<f64>);

/// Every family, tried beside the fit.
pub(crate) fn probes(findings: &Findings) -> Vec<Probe> {
    let fit = &findings.state.fit;
    let mut list = Vec::new();
    for channel in 0..2 {
        for (depends_on, columns) in families(findings, channel) {
            // At rest nothing can depend on the motion, and time is all that passes.
            if depends_on != "time" && !(moves(findings, 0) && moves(findings, 1)) {
                continue;
            }
            let columns: Vec<Vec<f64>> = columns
                .iter()
                .map(|column| whitened(findings, column))
                .collect();
            let gain = with_probes(findings, fit, &[&columns]).held_out
                - fit.linear.held_out
                - 2.0 * columns.len() as f64;
            list.push(Probe {
                depends_on,
                channel,
                columns,
                gain,
            });
        }
    }
    list
}

/// Whether the prediction of a channel varies by more than its white noise.
fn moves(findings: &Findings, channel: usize) -> bool {
    let readings = &findings.state.fit.prediction.readings;
    let count = readings.len() as f64;
    let variance: f64 = (3 * channel..3 * channel + 3)
        .map(|axis| {
            let mean = readings
                .iter()
                .map(|reading| axis_of(reading, axis))
                .sum::<f64>()
                / count;
            readings
                .iter()
                .map(|reading| (axis_of(reading, axis) - mean).powi(2))
                .sum::<f64>()
                / count
        })
        .sum();
    variance > 3.0 * (MOVING * findings.context.basis.sigma[channel]).powi(2)
}

/// A fit's linear step with probes beside its own values.
pub(crate) fn with_probes(findings: &Findings, fit: &Fit, families: &[&Vec<Vec<f64>>]) -> Linear {
    let columns: Vec<Vec<f64>> = families
        .iter()
        .flat_map(|columns| columns.iter().cloned())
        .collect();
    let prior = vec![1e-6; columns.len()];
    findings
        .context
        .extended(fit, &fit.residual, &columns, &prior)
}

/// Scaled to a root mean square of the axis' white noise.
fn whitened(findings: &Findings, (axis, values): &Column) -> Vec<f64> {
    let context = &findings.context;
    let rms = (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64)
        .sqrt()
        .max(1e-12);
    let sigma = context.basis.sigma[axis / 3];
    // What hardly moves tells nothing, however much it is magnified.
    let factor = if rms > LEAST_MOTION * sigma {
        sigma / rms
    } else {
        0.0
    };
    context.whitener.apply(&context.problem.raster(|k, other| {
        if other == *axis {
            values[k] * factor
        } else {
            0.0
        }
    }))
}

fn families(findings: &Findings, channel: usize) -> Vec<(&'static str, Vec<Column>)> {
    let readings = &findings.state.fit.prediction.readings;
    let own = |reading: &Reading| {
        if channel == 0 {
            reading.specific_force
        } else {
            reading.angular_velocity
        }
    };
    let other = |reading: &Reading| {
        if channel == 0 {
            reading.angular_velocity
        } else {
            reading.specific_force
        }
    };
    let axes = 3 * channel..3 * channel + 3;
    let column = |axis: usize, of: &dyn Fn(&Reading) -> f64| -> Column {
        (axis, readings.iter().map(of).collect())
    };
    let constant = |axis: usize| column(axis, &|_| 1.0);
    let [own_name, other_name, other_squared] = if channel == 0 {
        ["specific force", "angular rate", "angular rate squared"]
    } else {
        ["angular rate", "specific force", "specific force squared"]
    };
    let mut crossed = Vec::new();
    let mut squared = Vec::new();
    let mut turned = Vec::new();
    for axis in axes.clone() {
        crossed.push(constant(axis));
        squared.push(constant(axis));
        for i in 0..3 {
            crossed.push(column(axis, &|reading| other(reading)[i]));
            turned.push(column(axis, &|reading| own(reading)[i]));
            (i..3).for_each(|j| {
                squared.push(column(axis, &|reading| {
                    other(reading)[i] * other(reading)[j]
                }))
            });
        }
    }
    vec![
        (own_name, curves(readings, axes.clone())),
        (other_name, crossed),
        (other_squared, squared),
        ("orientation", orientation(findings, axes.clone())),
        ("other axes", turned),
        ("rate of change", changes(findings, axes.clone())),
        ("time", over_time(findings, axes.clone(), &|_, _| 1.0)),
        (
            "gain over time",
            over_time(findings, axes.clone(), &|axis, k| {
                axis_of(&readings[k], axis)
            }),
        ),
        (
            "delay over time",
            over_time(findings, axes.clone(), &|axis, k| change(findings, axis, k)),
        ),
        ("mount over time", mount_over_time(findings, channel)),
    ]
}

/// Curves of the channel's own prediction: hats between its quantiles.
fn curves(readings: &[Reading], axes: std::ops::Range<usize>) -> Vec<Column> {
    let mut columns = Vec::new();
    for axis in axes {
        let mut sorted: Vec<f64> = readings
            .iter()
            .map(|reading| axis_of(reading, axis))
            .collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let quantile = |q: &f64| sorted[(q * (sorted.len() - 1) as f64) as usize];
        let knots: Vec<f64> = [0.01, 0.15, 0.35, 0.5, 0.65, 0.85, 0.99]
            .iter()
            .map(quantile)
            .collect();
        for k in 0..knots.len() {
            columns.push((
                axis,
                readings
                    .iter()
                    .map(|reading| hat(&knots, k, axis_of(reading, axis)))
                    .collect(),
            ));
        }
    }
    columns
}

/// Up as the sensor sees it.
fn orientation(findings: &Findings, axes: std::ops::Range<usize>) -> Vec<Column> {
    let problem = findings.context.problem;
    let track = &findings.context.track;
    let up: Vec<Vector3<f64>> = problem
        .stamps
        .iter()
        .map(|stamp| {
            let entry = ((*stamp - track.start) * track.rate_hz)
                .clamp(0.0, (track.len() - 1) as f64)
                .round() as usize;
            track.world_from_segment[entry].inverse() * Vector3::z()
        })
        .collect();
    let of = |axis: usize, i: usize| (axis, up.iter().map(|up| up[i]).collect());
    axes.flat_map(|axis| (0..3).map(move |i| (axis, i)))
        .map(|(axis, i)| of(axis, i))
        .collect()
}

/// First and second differences of the prediction: delays and filters.
fn changes(findings: &Findings, axes: std::ops::Range<usize>) -> Vec<Column> {
    let readings = &findings.state.fit.prediction.readings;
    let second = |axis: usize, k: usize| {
        let at = |k: usize| axis_of(&readings[k.min(readings.len() - 1)], axis);
        at(k + 1) - 2.0 * at(k) + at(k.saturating_sub(1))
    };
    let count = readings.len();
    axes.flat_map(|axis| {
        [
            (
                axis,
                (0..count).map(|k| change(findings, axis, k)).collect(),
            ),
            (axis, (0..count).map(|k| second(axis, k)).collect()),
        ]
    })
    .collect()
}

/// Central difference of the prediction.
fn change(findings: &Findings, axis: usize, k: usize) -> f64 {
    let readings = &findings.state.fit.prediction.readings;
    axis_of(&readings[(k + 1).min(readings.len() - 1)], axis)
        - axis_of(&readings[k.saturating_sub(1)], axis)
}

fn knots_over_time(count: usize) -> Vec<f64> {
    (0..9).map(|k| (k * (count - 1)) as f64 / 8.0).collect()
}

/// Slow changes of the strength of something: hats over time.
fn over_time(
    findings: &Findings,
    axes: std::ops::Range<usize>,
    of: &dyn Fn(usize, usize) -> f64,
) -> Vec<Column> {
    let count = findings.context.problem.stamps.len();
    let knots = knots_over_time(count);
    let mut columns = Vec::new();
    for axis in axes {
        let values: Vec<f64> = (0..count).map(|k| of(axis, k)).collect();
        for knot in 0..knots.len() {
            columns.push((
                axis,
                values
                    .iter()
                    .enumerate()
                    .map(|(k, value)| value * hat(&knots, knot, k as f64))
                    .collect(),
            ));
        }
    }
    columns
}

/// Small turns of the channel that change over time: what each axis would see of the two others.
fn mount_over_time(findings: &Findings, channel: usize) -> Vec<Column> {
    let readings = &findings.state.fit.prediction.readings;
    let knots = knots_over_time(readings.len());
    let mut columns = Vec::new();
    for i in 0..3 {
        for j in (0..3).filter(|j| *j != i) {
            for knot in (0..knots.len()).step_by(2) {
                let wide: Vec<f64> = knots.iter().step_by(2).copied().collect();
                let value = |k: usize, reading: &Reading| {
                    axis_of(reading, 3 * channel + j) * hat(&wide, knot / 2, k as f64)
                };
                columns.push((
                    3 * channel + i,
                    readings
                        .iter()
                        .enumerate()
                        .map(|(k, reading)| value(k, reading))
                        .collect(),
                ));
            }
        }
    }
    columns
}

/// Piecewise linear: 1 at its knot, 0 at its neighbours; the outermost go on level.
fn hat(knots: &[f64], k: usize, x: f64) -> f64 {
    if k > 0 && x < knots[k] {
        let width = knots[k] - knots[k - 1];
        return if width > 0.0 {
            (1.0 - (knots[k] - x) / width).max(0.0)
        } else {
            0.0
        };
    }
    if k + 1 < knots.len() && x > knots[k] {
        let width = knots[k + 1] - knots[k];
        return if width > 0.0 {
            (1.0 - (x - knots[k]) / width).max(0.0)
        } else {
            0.0
        };
    }
    1.0
}
