//! How far readings are off beyond all that is known of.

use std::borrow::Cow;

use cromosim_imu::{
    Channel, Lateness, PerChannel, Reading, UnexplainedErrors, change_per_second,
    expected_rounding_adds,
};
use cromosim_spatial::{MotionResponse, SampleVariance};
use nalgebra::{Matrix2, Vector2};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::diagnosis::Metrics;
use crate::findings::Findings;
use crate::policy::report::{LEAST_REFERENCE_EXCESS, MOST_REFERENCE_EXCESS, REFERENCE_SHARE};
use crate::simulations::Simulations;
use crate::variance_split::{BLOCK_S, Split, StatedReading};

/// Variance, mean over the axes and in SI units, that readings have on time that was not fitted to
/// (`after`), less the device's own noise and what errors of this reference leave: what a simulation
/// of another recording has to add to what it knows of that one, split as [`Split`] says. Where it is
/// below zero these errors are smaller than their model has them (a pure sway has no motion beyond the band
/// that the reference resolves), and are taken for that much smaller.
pub(crate) fn unexplained_errors(
    findings: &Findings,
    simulations: &Simulations,
    after_readings: &[Reading],
    after: &Metrics,
    response: Option<&MotionResponse>,
) -> UnexplainedErrors {
    let set = findings.applied();
    let of_reference = ReferenceVariances::new(findings, simulations, response);
    let late = PerChannel::from_fn(|channel| lateness(simulations, after_readings, channel));
    let splits = PerChannel::from_fn(|channel| {
        let stated = Stated {
            findings,
            simulations,
            of_reference: &of_reference,
            after_readings,
            late: late[channel],
            channel,
        };
        let readings = stated.readings(after);
        if set.lsb(channel) > 0.0 {
            stated.split_of_rounded(&readings, after)
        } else {
            Split::of(&readings)
        }
    });
    UnexplainedErrors {
        variance: PerChannel::from_fn(|channel| splits[channel].variance),
        reference_excess: PerChannel::from_fn(|channel| splits[channel].reference_excess),
        late,
    }
}

/// What is known of one channel's readings.
struct Stated<'a> {
    findings: &'a Findings<'a>,
    simulations: &'a Simulations<'a>,
    of_reference: &'a ReferenceVariances<'a>,
    after_readings: &'a [Reading],
    late: Lateness,
    channel: Channel,
}

impl Stated<'_> {
    /// Compared readings with their squared differences, as large in the mean as on time that was not fitted to.
    fn readings(&self, after: &Metrics) -> Vec<StatedReading> {
        let (whole, channel) = (&self.simulations.whole, self.channel);
        let comparison = &self.simulations.comparison;
        let units = self.findings.applied().unit_factor(channel).powi(2);
        let own = self.own_variance();
        let axes = axes_of_channel(channel);
        let reading = |k: usize| {
            let difference = |axis: usize| {
                value_on_axis(&comparison.measured[k], axis)
                    - value_on_axis(&self.after_readings[k], axis)
            };
            let covered = axes.clone().filter(|axis| comparison.covered[k][*axis]);
            let squares: Vec<f64> = covered.map(|axis| difference(axis).powi(2)).collect();
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            let seconds = whole.stamps[k] - whole.stamps[0];
            let late = self.late.at(seconds).powi(2) * self.change_squared(k) / units;
            (!squares.is_empty()).then(|| StatedReading {
                block: (seconds / BLOCK_S) as usize,
                squared: mean / units,
                of_reference: self.of_reference.of_derivatives(channel, k),
                known: own + self.of_reference.of_orientation(channel, k) + late,
            })
        };
        let mut readings: Vec<StatedReading> =
            (0..whole.stamps.len()).filter_map(reading).collect();
        let mean = readings.iter().map(|one| one.squared).sum::<f64>() / readings.len() as f64;
        let held_out = self.held_out(after) / mean.max(f64::MIN_POSITIVE);
        readings.iter_mut().for_each(|one| one.squared *= held_out);
        readings
    }

    /// Mean square on time that was not fitted to.
    fn held_out(&self, after: &Metrics) -> f64 {
        let rmse = match self.channel {
            Channel::Accelerometer => after.accel_rmse,
            Channel::Gyroscope => after.gyro_rmse,
        };
        (rmse / self.findings.applied().unit_factor(self.channel)).powi(2) / 3.0
    }

    /// The device's own noise.
    fn own_variance(&self) -> f64 {
        self.findings.simulated_sigma(self.channel).powi(2)
            + self.findings.applied().noise_density(self.channel).powi(2)
                * self.simulations.whole.rate_hz
    }

    /// Of the simulated reading per second, mean over the axes.
    fn change_squared(&self, k: usize) -> f64 {
        change_per_second(k, &self.simulations.whole.stamps, self.after_readings)
            .map_or(0.0, |change| change[self.channel].norm_squared() / 3.0)
    }

    /// Where readings are rounded, whose steps say nothing of single ones: by means alone.
    fn split_of_rounded(&self, readings: &[StatedReading], after: &Metrics) -> Split {
        let mean = |of: fn(&StatedReading) -> f64| {
            readings.iter().map(of).sum::<f64>() / readings.len().max(1) as f64
        };
        let of_reference = mean(|one| one.of_reference);
        let step = self.findings.applied().lsb(self.channel);
        let found = before_rounding(self.held_out(after), step);
        let rest = found - mean(|one| one.known) - of_reference;
        let part = rest / of_reference.max(f64::MIN_POSITIVE);
        let reference_excess = if part < 0.0 {
            part.max(LEAST_REFERENCE_EXCESS)
        } else if self.findings.unknown.is_some() {
            0.0
        } else {
            (REFERENCE_SHARE * part).min(MOST_REFERENCE_EXCESS)
        };
        Split {
            reference_excess,
            variance: (rest - reference_excess * of_reference).max(0.0),
        }
    }
}

/// Mean square of an error whose values differ, rounded to steps, by `found` from what they are in the mean.
fn before_rounding(found: f64, step: f64) -> f64 {
    let (mut least, mut most) = (0.0, found);
    // 50 halvings leave 1e-15 of it.
    for _ in 0..50 {
        let middle = 0.5 * (least + most);
        if middle + expected_rounding_adds(middle, step) < found {
            least = middle;
        } else {
            most = middle;
        }
    }
    most
}

/// How late a channel stays against the simulation.
///
/// Least squares of `measured - simulated = -(seconds + per_second t) d simulated / dt`, t from the first message.
/// Two values of thousands of readings: what they take of mere noise does not count.
fn lateness(simulations: &Simulations, simulated: &[Reading], channel: Channel) -> Lateness {
    let (stamps, comparison) = (&simulations.whole.stamps, &simulations.comparison);
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
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
        }
    }
    let Some(values) = normal.cholesky().map(|factor| factor.solve(&right)) else {
        return Default::default();
    };
    Lateness {
        seconds: values.x,
        per_second: values.y,
    }
}

/// What errors of the reference leave in each reading, per axis, in SI units.
struct ReferenceVariances<'a> {
    of_samples: Vec<SampleVariance>,
    measured: &'a [Reading],
}

impl<'a> ReferenceVariances<'a> {
    fn new(
        findings: &Findings,
        simulations: &'a Simulations,
        response: Option<&MotionResponse>,
    ) -> Self {
        let (whole, set) = (&simulations.whole, findings.applied());
        let estimate = findings.model.basis.estimate.as_ref();
        let estimate = match response {
            Some(response) => Cow::Owned(estimate.with_response(response)),
            None => Cow::Borrowed(estimate),
        };
        Self {
            of_samples: set.reference_variances(&estimate, 1.0, &whole.stamps),
            measured: &whole.measured,
        }
    }

    /// By its derivatives.
    fn of_derivatives(&self, channel: Channel, k: usize) -> f64 {
        match channel {
            Channel::Accelerometer => self.of_samples[k].acceleration,
            Channel::Gyroscope => self.of_samples[k].angular_velocity,
        }
    }

    /// An error of the orientation turns a vector, by two thirds of its square over the axes.
    fn of_orientation(&self, channel: Channel, k: usize) -> f64 {
        2.0 / 3.0 * self.of_samples[k].orientation * self.measured[k][channel].norm_squared()
    }
}
