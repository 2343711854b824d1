//! `warm_up`: biases that follow the device's temperature while it warms up after it was switched on,
//! ```text
//! T(t) = start + rise (1 - exp(-(t - t0) / time_constant))
//! bias = per_kelvin (T(t) - start)
//! ```
//! as a body of one heat capacity does that loses heat in proportion (Newton's law of cooling). What the
//! bias is at the start is the matter of the other effects.

use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet, Reading};
use crate::Channel;

/// A parameter that no search fits.
const fn given(
    name: &'static str,
    unit: &'static str,
    shape: Shape,
    neutral: &'static [f64],
    [lower, upper]: [f64; 2],
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        shape,
        neutral,
        is_optional: false,
        lower,
        upper,
        fit: None,
    }
}

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::WarmUp,
    name: "warm_up",
    stage: Stage::Linear,
    owner: Owner::Device,
    summary: "The device warms up and its biases go with the temperature: within one recording the residual's mean is a curve that levels off, which a diagnosis names accel_bias_drift and gyro_bias_drift.",
    remedy: "Let the device warm up before it is used, or compensate for temperature, which many devices report.",
    parameters: &[
        given("start", "degC", Shape::Scalar, &[25.0], [-60.0, 150.0]),
        given("rise", "K", Shape::Scalar, &[0.0], [-200.0, 200.0]),
        given("time_constant", "s", Shape::Scalar, &[300.0], [1e-3, 1e9]),
        given(
            "accel_per_kelvin",
            "m/s2/K",
            Shape::Vector3,
            &[0.0; 3],
            [-100.0, 100.0],
        ),
        given(
            "gyro_per_kelvin",
            "rad/s/K",
            Shape::Vector3,
            &[0.0; 3],
            [-100.0, 100.0],
        ),
    ],
    channels: &Channel::ALL,
    search: Search::Given,
};

/// The course of a device's temperature, and what its biases make of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WarmUp {
    start: f64,
    rise: f64,
    time_constant: f64,
    per_kelvin: Reading,
}

impl WarmUp {
    /// None where the effects state none.
    pub fn new(effects: &EffectSet) -> Option<Self> {
        let of = |effect: &Effect| Self {
            start: effect.scalar(0),
            rise: effect.scalar(1),
            time_constant: effect.scalar(2),
            per_kelvin: Reading {
                specific_force: effect.vector(3),
                angular_velocity: effect.vector(6),
            },
        };
        effects.get(EffectKind::WarmUp).map(of)
    }

    /// So many seconds after the epoch, before which the device is as cold as then, K.
    fn warmed(&self, seconds: f64) -> f64 {
        -self.rise * (-seconds.max(0.0) / self.time_constant).exp_m1()
    }

    /// degC.
    pub fn temperature(&self, seconds: f64) -> f64 {
        self.start + self.warmed(seconds)
    }

    /// What it adds to both channels.
    pub fn bias(&self, seconds: f64) -> Reading {
        let warmed = self.warmed(seconds);
        let added = |per_kelvin: Vector3<f64>| per_kelvin * warmed;
        Reading {
            specific_force: added(self.per_kelvin.specific_force),
            angular_velocity: added(self.per_kelvin.angular_velocity),
        }
    }
}

/// Says a device's temperature once a second.
#[derive(Clone, Debug)]
pub(crate) struct Thermometer {
    course: WarmUp,
    /// Of the first reading, and when the next value is due.
    since: Option<(Stamp, Stamp)>,
}

/// Devices tell their temperature more seldom than their readings, s.
const INTERVAL_S: f64 = 1.0;

impl Thermometer {
    /// None where the effects state no temperature.
    pub fn new(effects: &EffectSet) -> Option<Self> {
        let course = WarmUp::new(effects)?;
        Some(Self {
            course,
            since: None,
        })
    }

    /// Begins anew with the next reading.
    pub fn reset(&mut self) {
        self.since = None;
    }

    /// degC with the reading of this stamp; none before it is due.
    pub fn read(&mut self, stamp: Stamp) -> Option<f64> {
        let (epoch, due) = *self.since.get_or_insert((stamp, stamp));
        (stamp >= due).then(|| {
            let next = due.plus_seconds(INTERVAL_S);
            self.since = Some((epoch, next.max(stamp)));
            self.course.temperature(stamp - epoch)
        })
    }
}

#[cfg(test)]
#[path = "warm_up_tests.rs"]
mod tests;
