//! `accel_units`, `gyro_units`: units of a driver.

use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::{Channel, PerChannel, STANDARD_GRAVITY};

/// The effect of each channel.
const KINDS: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelUnits,
    gyroscope: EffectKind::GyroUnits,
};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelUnits,
    name: "accel_units",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer is reported in other units: every reading is the simulated one times a known factor.",
    remedy: "Convert the driver's output to m/s2.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::UnitFactor(Channel::Accelerometer),
        probability: 0.98,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroUnits,
    name: "gyro_units",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope is reported in other units: every reading is the simulated one times a known factor.",
    remedy: "Convert the driver's output to rad/s.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::UnitFactor(Channel::Gyroscope),
        probability: 0.98,
    }),
};

/// Factors that units of the accelerometer bring: m/s2, g, mg, cm/s2, mm/s2, ft/s2, and the inverse
/// mistakes of g and cm/s2.
const ACCEL_FACTORS: [f64; 8] = [
    1.0,
    1.0 / STANDARD_GRAVITY,
    1000.0 / STANDARD_GRAVITY,
    100.0,
    1000.0,
    3.280_839_895,
    STANDARD_GRAVITY,
    0.01,
];
/// Factors that units of the gyroscope bring: rad/s, deg/s, mdeg/s, mrad/s, revolutions per minute
/// and per second, and the inverse mistake of deg/s.
const GYRO_FACTORS: [f64; 7] = [
    1.0,
    57.295_779_513_082_32,
    57_295.779_513_082_32,
    1000.0,
    9.549_296_585_513_72,
    0.159_154_943_091_895_35,
    0.017_453_292_519_943_295,
];

/// Known factors of a channel's units, 1 first.
pub fn unit_factors(channel: Channel) -> &'static [f64] {
    match channel {
        Channel::Accelerometer => &ACCEL_FACTORS,
        Channel::Gyroscope => &GYRO_FACTORS,
    }
}

impl EffectSet {
    /// Factor of a channel's units; 1 without the effect.
    pub fn unit_factor(&self, channel: Channel) -> f64 {
        self.get(KINDS[channel])
            .map_or(1.0, |effect| effect.scalar(0))
    }
}
