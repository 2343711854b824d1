//! What is checked in closed form before any fit: clock, units, axes, gravity, clipping, rounding.

use cromosim_imu::{
    Effect, EffectKind, EffectSet, GRAVITY_IN_WORLD, Reading, STANDARD_GRAVITY, lattice_spacing,
};
use cromosim_spatial::{Complex64, FourierPair, KinematicTrack, so3};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::problem::Problem;

/// Factors that units bring: g, mg, cm/s2, mm/s2, ft/s2, and the inverse mistakes.
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
/// Degrees, millidegrees, milliradians, revolutions per minute and per second, and the inverse
/// mistake.
const GYRO_FACTORS: [f64; 7] = [
    1.0,
    57.295_779_513_082_32,
    57_295.779_513_082_32,
    1000.0,
    9.549_296_585_513_72,
    0.159_154_943_091_895_35,
    0.017_453_292_519_943_295,
];
/// A lag near zero is preferred to a distant one that correlates better by less than this.
const NEAR_BONUS: f64 = 0.03;

/// What the closed forms say.
#[derive(Clone, Debug)]
pub(crate) struct Gross {
    /// IMU stamps late by this, s.
    pub lag_s: f64,
    /// Factor of the units: accelerometer, gyroscope.
    pub units: [f64; 2],
    /// Gravity as the device reports it: 1, 0 (removed), -1 (negated).
    pub gravity: i32,
    /// sensor_from_segment, a reflection where the determinant says so; none without enough
    /// rotation.
    pub axes: Option<Matrix3<f64>>,
}

impl Gross {
    pub fn find(problem: &Problem, track: &KinematicTrack) -> Self {
        let lag_s = lag(problem, track);
        let rows: Vec<(&Reading, usize)> = problem
            .measured
            .iter()
            .zip(&problem.stamps)
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
            units: [accel, gyro],
            gravity,
            axes,
        }
    }

    /// Sets of effects to start the search from: what is certain, with the axes as they are, as a
    /// signed permutation, or as a rotation.
    pub fn starts(&self) -> Vec<EffectSet> {
        let mut certain = EffectSet::new();
        if self.lag_s.abs() > 0.1 {
            insert(&mut certain, EffectKind::TimeOffset, vec![self.lag_s]);
        }
        if self.gravity != 1 {
            insert(
                &mut certain,
                EffectKind::GravityConvention,
                vec![gravity_value(self.gravity)],
            );
        }
        let Some(axes) = self.axes else {
            return vec![certain];
        };
        let permutation = signed_permutation(&axes);
        let near = |other: &Matrix3<f64>| (axes - other).norm() / 2.0_f64.sqrt() < 0.25;
        if near(&Matrix3::identity()) {
            return vec![certain];
        }
        let mut starts = Vec::new();
        if near(&permutation) || axes.determinant() < 0.0 {
            let mut set = certain.clone();
            insert(
                &mut set,
                EffectKind::AxisConvention,
                permutation.transpose().iter().copied().collect(),
            );
            starts.push(set);
        }
        if axes.determinant() > 0.0 {
            let rotvec = so3::log(&UnitQuaternion::from_matrix(&axes.transpose()));
            insert(
                &mut certain,
                EffectKind::MountRotation,
                rotvec.iter().copied().collect(),
            );
            starts.push(certain);
        }
        starts
    }
}

/// The library's number of a gravity convention.
pub(crate) fn gravity_value(gravity: i32) -> f64 {
    let word = if gravity == 0 { "removed" } else { "negated" };
    let choices = EffectKind::GravityConvention
        .spec()
        .parameters
        .first()
        .map(|parameter| parameter.shape);
    match choices {
        Some(cromosim_imu::Shape::Choice(words)) => {
            words.iter().position(|known| *known == word).unwrap_or(0) as f64
        }
        _ => 0.0,
    }
}

/// Inserts an effect whose values are within its bounds.
pub(crate) fn insert(set: &mut EffectSet, kind: EffectKind, values: Vec<f64>) {
    if let Ok(effect) = Effect::new(kind, values) {
        set.insert(effect);
    }
}

/// Lag at which the angular speeds correlate best, s: no axes, units or gravity enter.
fn lag(problem: &Problem, track: &KinematicTrack) -> f64 {
    let rate_hz = problem.rate_hz;
    let measured: Vec<f64> = problem
        .raster(|k, axis| {
            if axis == 3 {
                problem.measured[k].angular_velocity.norm()
            } else {
                0.0
            }
        })
        .swap_remove(3);
    let seconds = (track.len() - 1) as f64 / track.rate_hz;
    let reference: Vec<f64> = (0..(seconds * rate_hz) as usize)
        .map(|k| {
            track.angular_velocity_in_segment
                [((k as f64 / rate_hz * track.rate_hz) as usize).min(track.len() - 1)]
            .norm()
        })
        .collect();
    // Entry k of the measured raster is at the reference's entry k + shift when nothing is late.
    let shift = (problem.epoch - track.start) * rate_hz;
    let length = FourierPair::good_length(measured.len() + reference.len());
    let transform = FourierPair::new(length);
    let spectrum = |series: &[f64]| {
        let mean = series.iter().sum::<f64>() / series.len() as f64;
        let mut values: Vec<Complex64> = series
            .iter()
            .map(|value| Complex64::new(value - mean, 0.0))
            .collect();
        values.resize(length, Complex64::default());
        transform.forward(&mut values);
        values
    };
    let mut product: Vec<Complex64> = spectrum(&reference)
        .iter()
        .zip(spectrum(&measured))
        .map(|(a, b)| a.conj() * b)
        .collect();
    transform.inverse(&mut product);
    let (energy_m, energy_r) = (cumulated(&measured), cumulated(&reference));
    let least = measured.len().min(reference.len()) / 2;
    // measured[k] ~ reference[k - offset]
    let score = |offset: i64| {
        let from = offset.max(0);
        let to = (measured.len() as i64).min(reference.len() as i64 + offset);
        if to - from < least as i64 {
            return f64::NEG_INFINITY;
        }
        let of = |energy: &[f64], a: i64, b: i64| energy[b as usize] - energy[a as usize];
        let scale = (of(&energy_m, from, to) * of(&energy_r, from - offset, to - offset)).sqrt();
        if scale > 0.0 {
            product[offset.rem_euclid(length as i64) as usize].re / scale
        } else {
            f64::NEG_INFINITY
        }
    };
    let lag_of = |offset: f64| (offset + shift) / rate_hz;
    let bonus = |offset: i64| {
        if lag_of(offset as f64).abs() < 0.3 {
            NEAR_BONUS
        } else {
            0.0
        }
    };
    let range = -(reference.len() as i64) + 1..measured.len() as i64;
    let Some(best) = range.max_by(|&a, &b| (score(a) + bonus(a)).total_cmp(&(score(b) + bonus(b))))
    else {
        return 0.0;
    };
    if score(best) < 0.3 {
        return 0.0;
    }
    let (before, here, after) = (score(best - 1), score(best), score(best + 1));
    let bend = before - 2.0 * here + after;
    let fraction = if bend < 0.0 && bend.is_finite() {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    lag_of(best as f64 + fraction)
}

fn cumulated(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(series.iter().map(|value| {
            sum += (value - mean).powi(2);
            sum
        }))
        .collect()
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
    // 0.05 rad/s about the least moved axis: less tells nothing of the axes.
    if spread.min() < 0.0025 {
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
                canonical(ratio, &GYRO_FACTORS)
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
    // Readings that have little to do with the reference have no axes to speak of.
    if svd.singular_values.min() < 0.3 * svd.singular_values.max() {
        return (None, 1.0);
    }
    (Some(u * v_t), canonical(scale, &GYRO_FACTORS))
}

/// The factor within 12 %, else 1.
fn canonical(scale: f64, factors: &[f64]) -> f64 {
    factors
        .iter()
        .copied()
        .find(|factor| (scale / factor).ln().abs() < 0.12)
        .unwrap_or(1.0)
}

/// Units and gravity from `y = s_a R^T a + s_g (-R^T g)`.
fn accel_units(
    rows: &[(&Reading, usize)],
    track: &KinematicTrack,
    turn: &Matrix3<f64>,
) -> (f64, i32) {
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
        return (
            canonical(slope.abs(), &ACCEL_FACTORS),
            if slope < 0.0 { -1 } else { 1 },
        );
    }
    let (of_a, of_g) = (
        (ya * gg - yg * ag) / determinant,
        (yg * aa - ya * ag) / determinant,
    );
    let mut best = (f64::INFINITY, 1.0, 1);
    for factor in ACCEL_FACTORS {
        for gravity in [1, 0, -1] {
            let usual = if factor == 1.0 && gravity == 1 {
                0.0
            } else {
                1.0
            };
            // An acceleration that is small in the reference weighs little.
            let weight = (aa / gg * 50.0).min(1.0);
            let cost = ((of_g / factor - f64::from(gravity)) / 0.15).powi(2)
                + weight * ((of_a / factor - 1.0) / 0.4).powi(2)
                + usual;
            if cost < best.0 {
                best = (cost, factor, gravity);
            }
        }
    }
    (best.1, best.2)
}

/// The nearest signed permutation, by the assignment of axes with the greatest sum.
pub(crate) fn signed_permutation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let sum = |order: &[usize; 3]| {
        (0..3)
            .map(|row| matrix[(row, order[row])].abs())
            .sum::<f64>()
    };
    let best = orders
        .into_iter()
        .max_by(|a, b| sum(a).total_cmp(&sum(b)))
        .unwrap_or([0, 1, 2]);
    let mut result = Matrix3::zeros();
    for row in 0..3 {
        result[(row, best[row])] = if matrix[(row, best[row])] < 0.0 {
            -1.0
        } else {
            1.0
        };
    }
    result
}

/// A value at which a channel clips, and the common distance of its values.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Digital {
    pub limit: Option<f64>,
    pub lsb: Option<f64>,
    /// Whether there is rounding that may not be named.
    pub denied: bool,
}

/// Reads clipping and rounding off a channel (0 accelerometer, 1 gyroscope) of the measured
/// readings.
pub(crate) fn digital(measured: &[Reading], channel: usize) -> Digital {
    let values: Vec<f64> = measured
        .iter()
        .flat_map(|reading| {
            if channel == 0 {
                reading.specific_force
            } else {
                reading.angular_velocity
            }
            .iter()
            .copied()
            .collect::<Vec<_>>()
        })
        .collect();
    let lsb = lattice_spacing(&mut values.clone());
    let largest = values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    let clipped = |value: &f64| value.abs() >= largest * (1.0 - 1e-9);
    let below = lsb.map_or(0, |lsb| {
        values
            .iter()
            .filter(|value| (value.abs() - largest + lsb).abs() < 0.5 * lsb)
            .count()
    });
    // On a lattice the tail thins out from step to step, and a slow peak dwells on one: clipping
    // piles up more than that, and at several times.
    let at: Vec<usize> = values
        .iter()
        .enumerate()
        .filter(|(_, value)| clipped(value))
        .map(|(at, _)| at)
        .collect();
    let episodes = 1 + at.windows(2).filter(|pair| pair[1] > pair[0] + 60).count();
    let repeats = at.len();
    let piled = if lsb.is_some() {
        repeats >= 12 && repeats > 3 * below && episodes >= 3
    } else {
        repeats >= 4
    };
    let limit = (piled && largest > 0.0).then_some(largest);
    Digital {
        limit,
        lsb,
        denied: false,
    }
}
