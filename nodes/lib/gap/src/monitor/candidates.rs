//! The effects that the monitor tries, and what each explains.

use cromosim_imu::{
    Channel, EffectKind, GravityMode, PerChannel, ReadOff, STANDARD_GRAVITY,
    nearest_signed_permutation,
};
use nalgebra::{Matrix3, Vector3};

use super::columns;
use super::lag::Lag;
use super::scene::Scene;
use crate::force_slopes::known_factor;

/// Effects of one channel that have columns.
const BIAS: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelBias,
    gyroscope: EffectKind::GyroBias,
};
const SCALE: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelScale,
    gyroscope: EffectKind::GyroScale,
};
const MISALIGNMENT: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelMisalignment,
    gyroscope: EffectKind::GyroMisalignment,
};

/// How fast the estimate of the vertical forgets accelerations, s.
const VERTICAL_TIME_S: f64 = 1.0;
/// Distance (Frobenius norm) of a turn from a signed permutation below which it is one.
const NEAR_AXES: f64 = 0.25;
/// Smallest over largest singular value below which the third direction of a turn is a guess.
const LEAST_LIKENESS: f64 = 1e-4;
/// A slope on the vertical this close to that of a convention is that convention.
const SLOPE_TOLERANCE: f64 = 0.15;
/// Readings at the very same limit before it counts as one.
const LEAST_CLIPPED: usize = 5;

/// One effect tried alone.
pub(super) struct Candidate {
    pub effect: EffectKind,
    /// Of the whitened squared residual.
    pub reduction: f64,
}

fn candidate(effect: EffectKind, reduction: f64) -> Candidate {
    Candidate { effect, reduction }
}

/// Everything that can be tried on a window.
pub(super) fn candidates(scene: &Scene, lag: Option<Lag>) -> Vec<Candidate> {
    let total = scene.whitened(scene.pairs);
    let mut all = with_columns(scene);
    all.extend(lag.map(|lag| candidate(EffectKind::TimeOffset, total - lag.rest)));
    all.extend(turns(scene, total));
    for of_channel in [units, saturation, noise] {
        all.extend(
            Channel::ALL
                .into_iter()
                .filter_map(|channel| of_channel(scene, channel)),
        );
    }
    all.extend(gravity(scene));
    all
}

/// The effects that are linear in their values.
fn with_columns(scene: &Scene) -> Vec<Candidate> {
    let (pairs, sigmas) = (scene.pairs, scene.sigmas);
    let at = |index: usize| &pairs.simulated[index];
    let mut all = Vec::new();
    for channel in Channel::ALL {
        let bias = columns::explained(pairs, sigmas, |_| columns::bias(channel));
        let scale = columns::explained(pairs, sigmas, |index| columns::scale(at(index), channel));
        let misalignment = columns::explained(pairs, sigmas, |index| {
            columns::misalignment(at(index), channel)
        });
        all.extend([
            candidate(BIAS[channel], bias),
            candidate(SCALE[channel], scale),
            candidate(MISALIGNMENT[channel], misalignment),
        ]);
    }
    let lever_arm = columns::explained(pairs, sigmas, |index| {
        let angular_acceleration = pairs.simulated_slope(index).gyroscope;
        columns::lever_arm(&at(index).angular_velocity, &angular_acceleration)
    });
    let g_sensitivity = columns::explained(pairs, sigmas, |index| {
        columns::g_sensitivity(&at(index).specific_force)
    });
    all.extend([
        candidate(EffectKind::LeverArm, lever_arm),
        candidate(EffectKind::GyroGSensitivity, g_sensitivity),
    ]);
    all
}

/// The rotation that turns simulated into measured best (Kabsch 1976), and the signed permutation
/// next to the orthogonal matrix that does.
fn turns(scene: &Scene, total: f64) -> Vec<Candidate> {
    let (mut products, mut power) = (Matrix3::zeros(), 0.0);
    for (measured, simulated) in scene.pairs.measured.iter().zip(&scene.pairs.simulated) {
        for channel in Channel::ALL {
            let (m, s) = (measured[channel], simulated[channel]);
            let weight = scene.sigmas[channel].powi(-2);
            products += m * s.transpose() * weight;
            power += weight * (m.norm_squared() + s.norm_squared());
        }
    }
    let svd = products.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return Vec::new();
    };
    let rest = |turn: &Matrix3<f64>| power - 2.0 * turn.component_mul(&products).sum();
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant().signum()));
    let mut all = vec![candidate(
        EffectKind::MountRotation,
        total - rest(&(u * flip * v)),
    )];
    let permutation = nearest_signed_permutation(&(u * v));
    let is_near = (permutation - u * v).norm() < NEAR_AXES;
    // Without motion about all axes the third direction is a guess.
    let is_told = svd.singular_values.min() > LEAST_LIKENESS * svd.singular_values.max();
    if is_near && is_told && permutation != Matrix3::identity() {
        all.push(candidate(
            EffectKind::AxisConvention,
            total - rest(&permutation),
        ));
    }
    all
}

/// A slope of measured on simulated that is a known factor.
fn units(scene: &Scene, channel: Channel) -> Option<Candidate> {
    let both = scene
        .pairs
        .measured
        .iter()
        .zip(&scene.pairs.simulated)
        .map(|(m, s)| (m[channel], s[channel]));
    let (product, power) = both.clone().fold((0.0, 0.0), |(product, power), (m, s)| {
        (product + m.dot(&s), power + s.norm_squared())
    });
    let slope = product / power.max(f64::MIN_POSITIVE);
    let factor = known_factor(slope, channel);
    if factor == 1.0 {
        return None;
    }
    let reduction: f64 = both
        .map(|(m, s)| (m - s).norm_squared() - (m - s * factor).norm_squared())
        .sum();
    Some(candidate(
        EffectKind::read_off(ReadOff::UnitFactor(channel))?,
        reduction / scene.sigmas[channel].powi(2),
    ))
}

/// Readings that stand at one limit while the simulation goes beyond.
fn saturation(scene: &Scene, channel: Channel) -> Option<Candidate> {
    let pairs = scene.pairs;
    let limit = pairs
        .measured
        .iter()
        .map(|reading| reading[channel].amax())
        .fold(0.0, f64::max);
    let (mut clipped, mut reduction) = (0, 0.0);
    for (measured, simulated) in pairs.measured.iter().zip(&pairs.simulated) {
        for axis in 0..3 {
            let (m, s) = (measured[channel][axis], simulated[channel][axis]);
            if m.abs() >= limit * (1.0 - 1e-6) && s * m.signum() > limit {
                clipped += 1;
                reduction += (m - s).powi(2) / scene.sigmas[channel].powi(2);
            }
        }
    }
    let effect = EffectKind::read_off(ReadOff::ClippedReadings(channel))?;
    (clipped >= LEAST_CLIPPED).then(|| candidate(effect, reduction))
}

/// White noise beyond the declared; fourth differences see nothing but noise, so nothing else can
/// explain it.
fn noise(scene: &Scene, channel: Channel) -> Option<Candidate> {
    let excess = scene.found[channel].powi(2) - scene.declared[channel].powi(2);
    let reduction = 3.0 * scene.pairs.len() as f64 * excess / scene.sigmas[channel].powi(2);
    let effect = EffectKind::read_off(ReadOff::ExcessNoise(channel))?;
    (excess > 0.0).then(|| candidate(effect, reduction))
}

/// Gravity left out of the measured readings, or of the other sign: the residual follows the
/// vertical with a slope of -1 or -2.
fn gravity(scene: &Scene) -> Option<Candidate> {
    let up = vertical(scene);
    let residual = |index: usize| scene.pairs.residual(index).accelerometer;
    let product: f64 = up
        .iter()
        .enumerate()
        .map(|(index, up)| residual(index).dot(up))
        .sum();
    let power: f64 = up.iter().map(Vector3::norm_squared).sum();
    let slope = product / power.max(f64::MIN_POSITIVE);
    let factor = GravityMode::ALL
        .into_iter()
        .filter(|mode| *mode != GravityMode::Kept)
        .map(|mode| mode.factor() - GravityMode::Kept.factor())
        .find(|factor| (slope - factor).abs() < SLOPE_TOLERANCE)?;
    let change = |(index, up): (usize, &Vector3<f64>)| {
        residual(index).norm_squared() - (residual(index) - up * factor).norm_squared()
    };
    let reduction: f64 = up.iter().enumerate().map(change).sum();
    Some(candidate(
        EffectKind::GravityConvention,
        reduction / scene.sigmas.accelerometer.powi(2),
    ))
}

/// Gravity's reaction in sensor axes, m/s2: the simulated specific force, carried along by the
/// simulated angular velocity and averaged over a second, in both directions of time.
fn vertical(scene: &Scene) -> Vec<Vector3<f64>> {
    let pairs = scene.pairs;
    let pass = |order: &mut dyn Iterator<Item = usize>| {
        let mut up = vec![Vector3::zeros(); pairs.len()];
        let mut last: Option<usize> = None;
        for index in order {
            let reading = &pairs.simulated[index];
            up[index] = last.map_or(reading.specific_force, |last| {
                let step = pairs.seconds[index] - pairs.seconds[last];
                let carried = up[last] - reading.angular_velocity.cross(&up[last]) * step;
                let weight = (step.abs() / VERTICAL_TIME_S).min(1.0);
                carried + (reading.specific_force - carried) * weight
            });
            last = Some(index);
        }
        up
    };
    let (forwards, backwards) = (
        pass(&mut (0..pairs.len())),
        pass(&mut (0..pairs.len()).rev()),
    );
    let mean = |(one, other): (Vector3<f64>, Vector3<f64>)| {
        (one + other).try_normalize(1e-9).unwrap_or_default() * STANDARD_GRAVITY
    };
    forwards.into_iter().zip(backwards).map(mean).collect()
}
