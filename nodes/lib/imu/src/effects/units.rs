//! `accel_units`, `gyro_units`: units of a driver.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelUnits,
    name: "accel_units",
    stage: Stage::Digital,
    summary: "The accelerometer is reported in other units: every reading is the simulated one times a known factor.",
    remedy: "Convert the driver's output to m/s2.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        lower: 1e-9,
        upper: 1e9,
        step: 1e-6,
    }],
    random: false,
    continuous: false,
    starts: |view| starts(view, Channel::Accelerometer, &ACCEL_FACTORS),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroUnits,
    name: "gyro_units",
    stage: Stage::Digital,
    summary: "The gyroscope is reported in other units: every reading is the simulated one times a known factor.",
    remedy: "Convert the driver's output to rad/s.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        lower: 1e-9,
        upper: 1e9,
        step: 1e-6,
    }],
    random: false,
    continuous: false,
    starts: |view| starts(view, Channel::Gyroscope, &GYRO_FACTORS),
};

const G: f64 = crate::STANDARD_GRAVITY;
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// m/s2, g, mg, cm/s2, ft/s2, mm/s2, km/s2 and 1e6.
const ACCEL_FACTORS: [f64; 8] = [
    1.0,
    1.0 / G,
    1000.0 / G,
    100.0,
    1.0 / 0.3048,
    1000.0,
    1e-3,
    1e6,
];
/// rad/s, deg/s, mdeg/s, rpm, mrad/s, krad/s, revolutions/s and 1e6.
const GYRO_FACTORS: [f64; 8] = [
    1.0,
    DEGREES,
    1000.0 * DEGREES,
    DEGREES / 6.0,
    1000.0,
    1e-3,
    DEGREES / 360.0,
    1e6,
];

/// The known factors nearest to the slope of measured on simulated magnitudes, the best first:
/// within a factor of 1.3, as scales, biases and offsets of time move the slope; a known one and
/// its inverse alike.
fn starts(view: &ResidualView, channel: Channel, factors: &[f64]) -> Vec<Vec<f64>> {
    let products = view
        .pairs(channel)
        .map(|(m, s)| (m.norm() * s.norm(), s.norm_squared()));
    let (cross, square) = products.fold((0.0, 0.0), |(a, b), (cross, square)| {
        (a + cross, b + square)
    });
    let slope = cross / square;
    let distance = |factor: f64| (slope / factor).ln().abs();
    let both = factors.iter().flat_map(|factor| [*factor, factor.recip()]);
    let mut near: Vec<f64> = both
        .filter(|factor| distance(*factor) < 1.3f64.ln())
        .collect();
    near.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    near.dedup();
    if near.is_empty() {
        near.push(1.0);
    }
    near.into_iter().map(|factor| vec![factor]).collect()
}
