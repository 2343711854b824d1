//! How far readings are off beyond all that is known of.

use cromosim_imu::{Channel, PerChannel, SampleVariance};

use crate::diagnosis::Metrics;
use crate::findings::Findings;
use crate::simulations::Simulations;

/// Variance, mean over the axes and in SI units, that readings have on time that was not fitted to
/// (`after`), less the device's own noise and what errors of this reference leave: what a simulation
/// of another recording has to add to what it knows of that one.
pub(crate) fn unexplained_variances(
    findings: &Findings,
    simulations: &Simulations,
    after: &Metrics,
) -> PerChannel<f64> {
    let set = &findings.applied();
    let of_reference = reference_variances(findings, simulations);
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

/// What errors of the reference leave, mean over the compared readings and their axes: an error of
/// the orientation turns a vector, by two thirds of its square over the axes.
fn reference_variances(findings: &Findings, simulations: &Simulations) -> PerChannel<f64> {
    let (whole, set) = (&simulations.whole, findings.applied());
    let estimate = &findings.model.basis.estimate;
    let variances = set.reference_variances(estimate, 1.0, &whole.stamps);
    PerChannel::from_fn(|channel| {
        let of_sample = |(k, variance): (usize, &SampleVariance)| -> Option<f64> {
            whole.usable[k][crate::axes::axes_of_channel(channel).start].then(|| {
                let reading = &whole.measured[k];
                let (own, vector) = match channel {
                    Channel::Accelerometer => (variance.acceleration, &reading.specific_force),
                    Channel::Gyroscope => (variance.angular_velocity, &reading.angular_velocity),
                };
                own + 2.0 / 3.0 * variance.orientation * vector.norm_squared()
            })
        };
        let all: Vec<f64> = variances.iter().enumerate().filter_map(of_sample).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    })
}
