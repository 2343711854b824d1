//! How far readings are off beyond all that is known of.

use cromosim_imu::{Channel, PerChannel, UnexplainedErrors};

use crate::axes::axes_of_channel;
use crate::diagnosis::Metrics;
use crate::findings::Findings;
use crate::policy::report::{MOST_REFERENCE_EXCESS, REFERENCE_SHARE};
use crate::simulations::Simulations;

/// Variance, mean over the axes and in SI units, that readings have on time that was not fitted to
/// (`after`), less the device's own noise and what errors of this reference leave: what a simulation
/// of another recording has to add to what it knows of that one. Where nothing is `unknown`
/// [`REFERENCE_SHARE`] of it is taken for motion that the reference's errors cover, and goes with these.
pub(crate) fn unexplained_errors(
    findings: &Findings,
    simulations: &Simulations,
    after: &Metrics,
) -> UnexplainedErrors {
    let [of_derivatives, of_orientation] = reference_variances(findings, simulations);
    let of_reference =
        PerChannel::from_fn(|channel| of_derivatives[channel] + of_orientation[channel]);
    let rest = rest_variances(findings, simulations, after, &of_reference);
    let reference_excess = PerChannel::from_fn(|channel| match findings.unknown {
        Some(_) => 0.0,
        None => (REFERENCE_SHARE * rest[channel] / of_derivatives[channel].max(f64::MIN_POSITIVE))
            .min(MOST_REFERENCE_EXCESS),
    });
    let left = |channel| rest[channel] - reference_excess[channel] * of_derivatives[channel];
    UnexplainedErrors {
        variance: PerChannel::from_fn(|channel| left(channel).max(0.0)),
        reference_excess,
    }
}

/// The part of that variance which neither the device's noise nor the reference's errors explain.
fn rest_variances(
    findings: &Findings,
    simulations: &Simulations,
    after: &Metrics,
    of_reference: &PerChannel<f64>,
) -> PerChannel<f64> {
    let set = &findings.applied();
    PerChannel::from_fn(|channel| {
        let rmse = match channel {
            Channel::Accelerometer => after.accel_rmse,
            Channel::Gyroscope => after.gyro_rmse,
        };
        let found = (rmse / set.unit_factor(channel)).powi(2) / 3.0;
        let own = simulations.white_variance(set, channel) + set.lsb(channel).powi(2) / 12.0;
        (found - own - of_reference[channel]).max(0.0)
    })
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
