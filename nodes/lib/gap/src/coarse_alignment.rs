//! What is found in closed form before any fit: lag, units, axes and gravity, each to within what a
//! fit can go on from.

use cromosim_imu::{
    Channel, Effect, EffectError, EffectSet, GRAVITY_IN_WORLD, GravityMode, PerChannel, Reading,
    nearest_signed_permutation, unit_factors,
};
use cromosim_spatial::{KinematicTrack, so3};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::lag::lag_of_angular_speeds;
use crate::prepared::PreparedPlacement;

/// Lags below this are left to the search, s.
const LEAST_LAG_S: f64 = 0.1;
/// Distance of a rotation (Frobenius norm over sqrt(2)) from the identity or from a signed
/// permutation below which it is left to the search.
const NEAR_AXES: f64 = 0.25;
/// Mean square of the angular velocity about the least moved axis below which nothing is told of
/// the axes, rad2/s2: 0.05 rad/s.
const LEAST_SPREAD: f64 = 0.0025;
/// Smallest over largest singular value below which readings have too little to do with the
/// reference to have axes.
const LEAST_LIKENESS: f64 = 0.3;
/// A scale is a known unit's factor when it is within 12 % of it (natural logarithm).
const FACTOR_TOLERANCE: f64 = 0.12;

/// What the closed forms say.
#[derive(Clone, Debug)]
pub(crate) struct CoarseAlignment {
    /// IMU stamps late by this, s.
    pub lag_s: f64,
    /// Factors of the units.
    pub units: PerChannel<f64>,
    pub gravity: GravityMode,
    /// sensor_from_segment, a reflection where the determinant says so; none without enough
    /// rotation.
    pub axes: Option<Matrix3<f64>>,
}

impl CoarseAlignment {
    pub fn find(prepared: &PreparedPlacement, track: &KinematicTrack) -> Self {
        let lag_s = lag_of_angular_speeds(prepared, track);
        let rows: Vec<(&Reading, usize)> = prepared
            .measured
            .iter()
            .zip(&prepared.stamps)
            .filter_map(|(reading, stamp)| {
                let entry = ((*stamp - track.start) - lag_s) * track.rate_hz;
                (entry >= 0.0 && entry < (track.len() - 1) as f64)
                    .then_some((reading, entry.round() as usize))
            })
            .collect();
        let (axes, gyro) = gyro_axes(&rows, track);
        let turn = axes.unwrap_or_else(Matrix3::identity);
        let (accel, gravity) = accel_units(&rows, track, &turn);
        Self {
            lag_s,
            units: PerChannel {
                accelerometer: accel,
                gyroscope: gyro,
            },
            gravity,
            axes,
        }
    }

    /// Sets of effects to start the search from: what is certain, with the axes as they are, as a
    /// signed permutation, or as a rotation.
    pub fn starts(&self) -> Vec<EffectSet> {
        let mut certain = EffectSet::new();
        if self.lag_s.abs() > LEAST_LAG_S {
            insert_valid(&mut certain, Effect::time_offset(self.lag_s));
        }
        if self.gravity != GravityMode::Kept {
            insert_valid(&mut certain, Effect::gravity_convention(self.gravity));
        }
        let Some(axes) = self.axes else {
            return vec![certain];
        };
        let permutation = nearest_signed_permutation(&axes);
        let near = |other: &Matrix3<f64>| (axes - other).norm() / 2.0_f64.sqrt() < NEAR_AXES;
        if near(&Matrix3::identity()) {
            return vec![certain];
        }
        let mut starts = Vec::new();
        if near(&permutation) || axes.determinant() < 0.0 {
            let mut set = certain.clone();
            insert_valid(&mut set, Effect::axis_convention(&permutation));
            starts.push(set);
        }
        if axes.determinant() > 0.0 {
            let rotvec = so3::log(&UnitQuaternion::from_matrix(&axes.transpose()));
            insert_valid(&mut certain, Effect::mount_rotation(&rotvec));
            starts.push(certain);
        }
        starts
    }
}

/// Inserts an effect where its values are within its bounds.
fn insert_valid(set: &mut EffectSet, effect: Result<Effect, EffectError>) {
    if let Ok(effect) = effect {
        set.insert(effect);
    }
}

/// Axes and units of the gyroscope from `y = A w + b` by least squares: A's polar factor and the
/// cube root of its determinant.
fn gyro_axes(rows: &[(&Reading, usize)], track: &KinematicTrack) -> (Option<Matrix3<f64>>, f64) {
    let count = rows.len().max(1) as f64;
    let mean = |of: &dyn Fn(&(&Reading, usize)) -> Vector3<f64>| {
        rows.iter().map(of).sum::<Vector3<f64>>() / count
    };
    let measured = |row: &(&Reading, usize)| row.0.angular_velocity;
    let predicted = |row: &(&Reading, usize)| track.angular_velocity_in_segment[row.1];
    let (mean_m, mean_p) = (mean(&measured), mean(&predicted));
    let (mut cross, mut own) = (Matrix3::zeros(), Matrix3::zeros());
    for row in rows {
        let (m, p) = (measured(row) - mean_m, predicted(row) - mean_p);
        cross += m * p.transpose();
        own += p * p.transpose();
    }
    let spread = own.symmetric_eigenvalues() / count;
    if spread.min() < LEAST_SPREAD {
        let ratio = (rows
            .iter()
            .map(|row| measured(row).norm_squared())
            .sum::<f64>()
            / rows
                .iter()
                .map(|row| predicted(row).norm_squared())
                .sum::<f64>()
                .max(1e-12))
        .sqrt();
        return (
            None,
            if !(0.05..=5.0).contains(&ratio) {
                known_factor(ratio, Channel::Gyroscope)
            } else {
                1.0
            },
        );
    }
    let Some(inverse) = own.try_inverse() else {
        return (None, 1.0);
    };
    let matrix = cross * inverse;
    let scale = matrix.determinant().abs().cbrt();
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return (None, 1.0);
    };
    if svd.singular_values.min() < LEAST_LIKENESS * svd.singular_values.max() {
        return (None, 1.0);
    }
    (Some(u * v_t), known_factor(scale, Channel::Gyroscope))
}

/// The known factor of a unit that a scale is, else 1.
pub(crate) fn known_factor(scale: f64, channel: Channel) -> f64 {
    unit_factors(channel)
        .iter()
        .copied()
        .find(|factor| (scale / factor).ln().abs() < FACTOR_TOLERANCE)
        .unwrap_or(1.0)
}

/// Units and gravity from `y = s_a R^T a + s_g (-R^T g)`.
fn accel_units(
    rows: &[(&Reading, usize)],
    track: &KinematicTrack,
    turn: &Matrix3<f64>,
) -> (f64, GravityMode) {
    let (mut aa, mut ag, mut gg, mut ya, mut yg) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (reading, entry) in rows {
        let a = turn * track.acceleration_in_segment[*entry];
        let g = turn * (track.world_from_segment[*entry].inverse() * -GRAVITY_IN_WORLD);
        aa += a.dot(&a);
        ag += a.dot(&g);
        gg += g.dot(&g);
        ya += reading.specific_force.dot(&a);
        yg += reading.specific_force.dot(&g);
    }
    let determinant = aa * gg - ag * ag;
    if gg <= 0.0 || determinant <= 1e-9 * gg * gg {
        // At rest gravity alone tells.
        let slope = if gg > 0.0 { yg / gg } else { 1.0 };
        let mode = if slope < 0.0 {
            GravityMode::Negated
        } else {
            GravityMode::Kept
        };
        return (known_factor(slope.abs(), Channel::Accelerometer), mode);
    }
    let (of_a, of_g) = (
        (ya * gg - yg * ag) / determinant,
        (yg * aa - ya * ag) / determinant,
    );
    // An acceleration that is small in the reference weighs little.
    let weight = (aa / gg * 50.0).min(1.0);
    let mut best = (f64::INFINITY, 1.0, GravityMode::Kept);
    for &factor in unit_factors(Channel::Accelerometer) {
        for mode in GravityMode::ALL {
            let unusual = if factor == 1.0 && mode == GravityMode::Kept {
                0.0
            } else {
                1.0
            };
            // Scatter of the slopes: 0.15 of gravity's, 0.4 of the acceleration's.
            let cost = ((of_g / factor - mode.factor()) / 0.15).powi(2)
                + weight * ((of_a / factor - 1.0) / 0.4).powi(2)
                + unusual;
            if cost < best.0 {
                best = (cost, factor, mode);
            }
        }
    }
    (best.1, best.2)
}
