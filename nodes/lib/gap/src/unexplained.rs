//! How far readings are off beyond all that is known of.

use cromosim_imu::{
    Channel, Lateness, PerChannel, Reading, UnexplainedErrors, change_per_second,
    rounding_difference,
};
use nalgebra::{Matrix2, Vector2};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::diagnosis::Metrics;
use crate::findings::Findings;
use crate::policy::report::{LEAST_REFERENCE_EXCESS, MOST_REFERENCE_EXCESS, REFERENCE_SHARE};
use crate::simulations::Simulations;

/// Variance, mean over the axes and in SI units, that readings have on time that was not fitted to
/// (`after`), less the device's own noise and what errors of this reference leave: what a simulation
/// of another recording has to add to what it knows of that one. Where nothing is `unknown`
/// [`REFERENCE_SHARE`] of it is taken for motion that the reference's errors cover, and goes with these. Where it is
/// below zero these errors are smaller than their model has them (a pure sway has no motion beyond the band
/// that the reference resolves), and are taken for that much smaller.
pub(crate) fn unexplained_errors(
    findings: &Findings,
    simulations: &Simulations,
    after_readings: &[Reading],
    after: &Metrics,
) -> UnexplainedErrors {
    let [of_derivatives, of_orientation] = reference_variances(findings, simulations);
    let of_reference =
        PerChannel::from_fn(|channel| of_derivatives[channel] + of_orientation[channel]);
    let clocks = PerChannel::from_fn(|channel| lateness(simulations, after_readings, channel));
    let known = PerChannel::from_fn(|channel| {
        let units = findings.applied().unit_factor(channel);
        of_reference[channel] + clocks[channel].1 / units.powi(2)
    });
    let rest = rest_variances(findings, simulations, after, &known);
    let reference_excess = PerChannel::from_fn(|channel| {
        let part = rest[channel] / of_derivatives[channel].max(f64::MIN_POSITIVE);
        if part < 0.0 {
            return part.max(LEAST_REFERENCE_EXCESS);
        }
        match findings.unknown {
            Some(_) => 0.0,
            None => (REFERENCE_SHARE * part).min(MOST_REFERENCE_EXCESS),
        }
    });
    let left = |channel| rest[channel] - reference_excess[channel] * of_derivatives[channel];
    UnexplainedErrors {
        variance: PerChannel::from_fn(|channel| left(channel).max(0.0)),
        reference_excess,
        late: PerChannel::from_fn(|channel| clocks[channel].0),
    }
}

/// That variance less the device's noise and what is `known` beside it; below zero where these are stated too
/// large.
fn rest_variances(
    findings: &Findings,
    simulations: &Simulations,
    after: &Metrics,
    known: &PerChannel<f64>,
) -> PerChannel<f64> {
    let set = &findings.applied();
    PerChannel::from_fn(|channel| {
        let rmse = match channel {
            Channel::Accelerometer => after.accel_rmse,
            Channel::Gyroscope => after.gyro_rmse,
        };
        let found = (rmse / set.unit_factor(channel)).powi(2) / 3.0;
        let own = findings.simulated_sigma(channel).powi(2)
            + set.noise_density(channel).powi(2) * simulations.whole.rate_hz;
        let found = before_rounding(found, set.lsb(channel));
        found - own - known[channel]
    })
}

/// The mean square difference of two values that, rounded to steps, differ by `found`.
fn before_rounding(found: f64, step: f64) -> f64 {
    let (mut least, mut most) = (0.0, found);
    // 50 halvings leave 1e-15 of it.
    for _ in 0..50 {
        let middle = 0.5 * (least + most);
        if middle + rounding_difference(middle, step) < found {
            least = middle;
        } else {
            most = middle;
        }
    }
    most
}

/// How late a channel stays against the simulation, and the variance that this leaves, mean over the compared
/// readings and their axes, in units of the device.
///
/// Least squares of `measured - simulated = -(seconds + per_second t) d simulated / dt`, t from the first message.
/// Two values of thousands of readings: what they take of mere noise does not count.
fn lateness(simulations: &Simulations, simulated: &[Reading], channel: Channel) -> (Lateness, f64) {
    let (stamps, comparison) = (&simulations.whole.stamps, &simulations.comparison);
    let (mut normal, mut right, mut count) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for k in 0..simulated.len() {
        let Some(change) = change_per_second(k, stamps, simulated) else {
            continue;
        };
        let regressors = Vector2::new(1.0, stamps[k] - stamps[0]);
        for axis in axes_of_channel(channel).filter(|axis| comparison.covered[k][*axis]) {
            let of = |reading: &Reading| value_on_axis(reading, axis);
            let change = of(&change);
            let residual = of(&comparison.measured[k]) - of(&simulated[k]);
            normal += regressors * regressors.transpose() * change.powi(2);
            right -= regressors * change * residual;
            count += 1.0;
        }
    }
    let Some(values) = normal.cholesky().map(|factor| factor.solve(&right)) else {
        return Default::default();
    };
    let late = Lateness {
        seconds: values.x,
        per_second: values.y,
    };
    (late, values.dot(&(normal * values)) / count)
}

/// What errors of the reference's derivatives and of its orientation leave, mean over the compared
/// readings and their axes: an error of the orientation turns a vector, by two thirds of its square
/// over the axes.
fn reference_variances(findings: &Findings, simulations: &Simulations) -> [PerChannel<f64>; 2] {
    let (whole, set) = (&simulations.whole, findings.applied());
    let estimate = &findings.model.basis.estimate;
    let variances = set.reference_variances(estimate, 1.0, &whole.stamps);
    let of_sample = |channel: Channel, k: usize| {
        let (reading, variance) = (&whole.measured[k], &variances[k]);
        let (own, vector) = match channel {
            Channel::Accelerometer => (variance.acceleration, &reading.specific_force),
            Channel::Gyroscope => (variance.angular_velocity, &reading.angular_velocity),
        };
        [
            own,
            2.0 / 3.0 * variance.orientation * vector.norm_squared(),
        ]
    };
    [0, 1].map(|part| {
        PerChannel::from_fn(|channel| {
            let axis = axes_of_channel(channel).start;
            let compared = (0..variances.len()).filter(|k| whole.usable[*k][axis]);
            let all: Vec<f64> = compared.map(|k| of_sample(channel, k)[part]).collect();
            all.iter().sum::<f64>() / all.len().max(1) as f64
        })
    })
}
