//! Whether a lever arm moves the accelerometer with what the gyroscope reads.
//!
//! The reference's rotation is off by `e`, which tilts gravity by `g e` and, through a lever arm l along it, moves the
//! accelerometer by `l e''`: an l of `g / (2 pi f)^2` takes the error around f out of the prediction, and no sensor is
//! there. The gyroscope holds none of that error.

use cromosim_imu::{Channel, EffectKind, Reading};
use nalgebra::{Matrix3, Vector3};

use crate::axes::axes_of_channel;
use crate::fit::{Fit, FitModel};
use crate::policy::lever_arm::{LEAST_OF_READINGS, STANDARD_ERRORS};
use crate::trace::trace;

/// Whether a lever arm of the set, if there is one, does in the residual what it does with the gyroscope's readings in place of
/// the reference's rotation, as far as these tell: with `m` what it makes of the readings, `p` what it makes of the reference
/// and `r` the residual without it, `<m, r> / <m, p>` is 1 of a true one, however loud the readings are, and 0 of an error's.
pub(crate) fn is_in_readings(model: &FitModel, fit: &Fit) -> bool {
    if !fit.set.contains(EffectKind::LeverArm) {
        return true;
    }
    let prepared = model.prepared;
    let predicted = &fit.prediction.readings;
    let excluded = prepared.predict(&model.track, &fit.set.without(EffectKind::LeverArm));
    let force = |reading: &Reading| reading[Channel::Accelerometer];
    let own: Vec<Vector3<f64>> = predicted
        .iter()
        .zip(&excluded.readings)
        .map(|(with, without)| force(with) - force(without))
        .collect();
    let first = prepared.stamps[0];
    let seconds: Vec<f64> = prepared.stamps.iter().map(|stamp| *stamp - first).collect();
    let Some(offset) = offset_of(&own, &rotations(predicted, &seconds)) else {
        return true;
    };
    let read = rotations(&prepared.measured, &seconds);
    let whitener = model.whitener_behind_reference();
    let whitened = |value: &dyn Fn(usize) -> Vector3<f64>| {
        let mut axes = [false; 6];
        axes[axes_of_channel(Channel::Accelerometer)].fill(true);
        let first = axes_of_channel(Channel::Accelerometer).start;
        whitener.apply(&prepared.scattered(axes, |k, axis| value(k)[axis - first]))
    };
    let by_readings = whitened(&|k| read[k] * offset);
    let by_reference = whitened(&|k| own[k]);
    let left = whitened(&|k| force(&prepared.measured[k]) - force(&excluded.readings[k]));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let expected = product(&by_readings, &by_reference);
    let found = product(&by_readings, &left);
    let error = product(&by_readings, &by_readings).sqrt();
    trace(|| {
        eprintln!(
            "  lever arm {offset:.3?}: {:.2} of it by readings, {:.1} standard errors less",
            found / expected,
            (expected - found) / error
        )
    });
    found > LEAST_OF_READINGS * expected || expected - found < STANDARD_ERRORS * error
}

/// `[w']x + [w]x [w]x` for each reading, 1/s2: what it does to a lever arm.
fn rotations(readings: &[Reading], seconds: &[f64]) -> Vec<Matrix3<f64>> {
    let last = readings.len() - 1;
    let rate = |k: usize| readings[k][Channel::Gyroscope];
    (0..=last)
        .map(|k| {
            let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
            let change = (rate(to) - rate(from)) / (seconds[to] - seconds[from]);
            let spin = rate(k).cross_matrix();
            change.cross_matrix() + spin * spin
        })
        .collect()
}

/// The lever arm in the sensor's axes, m, by least squares from what it does.
fn offset_of(own: &[Vector3<f64>], rotations: &[Matrix3<f64>]) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (value, rotation) in own.iter().zip(rotations) {
        normal += rotation.tr_mul(rotation);
        right += rotation.tr_mul(value);
    }
    normal.cholesky().map(|factor| factor.solve(&right))
}
