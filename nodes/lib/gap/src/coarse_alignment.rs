//! What is found in closed form before any fit: lag, units, axes and gravity, each to within what a
//! fit can go on from.

use cromosim_imu::{
    Channel, Effect, EffectError, EffectSet, GRAVITY_IN_WORLD, GravityMode, PerChannel, Reading,
    length_factors, nearest_signed_permutation, unit_factors,
};
use cromosim_spatial::{KinematicTrack, so3};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::lag::lag_of_angular_speeds;
use crate::prepared::PreparedPlacement;

/// Lags below this are left to the search, s.
const LEAST_LAG_S: f64 = 0.1;
/// Part of the angular velocity's square that may stay unexplained without a lag, and over that with the lag that
/// the speeds tell, where no lag is believed; no source. A lag of a twentieth of a period leaves a tenth.
const ON_TIME: f64 = 0.5;
const ON_TIME_LEAVES: f64 = 1.2;
/// Distance of a rotation (Frobenius norm over sqrt(2)) from the identity or from a signed
/// permutation below which it is left to the search.
const NEAR_AXES: f64 = 0.25;
/// Part of the measured angular velocity's square that the reference's most turned axis has to explain, for their
/// ratio to be a unit's; no source. Noise that has nothing to do with it explains one part in as many as there
/// are readings.
const FOLLOWED: f64 = 0.2;
/// Mean square of the angular velocity about the least moved axis below which nothing is told of
/// the axes, rad2/s2: 0.05 rad/s.
const LEAST_SPREAD: f64 = 0.0025;
/// Smallest over largest singular value below which readings have too little to do with the
/// reference to have axes.
const LEAST_LIKENESS: f64 = 0.3;
/// Squared correlation of the accelerations below which nothing is told of the reference's units of
/// length: a turned mount or a poor reference halves a slope too, but not along with a good
/// correlation.
const LEAST_LIKENESS_FOR_LENGTH: f64 = 0.5;
/// The same where the reference is louder than the readings by [`MUCH_TOO_LOUD`]: nothing but its units does that.
const LEAST_LIKENESS_WHERE_LOUD: f64 = 0.1;
/// Natural logarithm of how much louder: a hundred times; no source.
const MUCH_TOO_LOUD: f64 = 4.6;
/// Scatter of the acceleration's slope, see [`slope_off`].
const SLOPE_SCATTER: f64 = 0.4;
/// Cost of a device with other units, and of one with other gravity, in units of a slope's squared
/// scatter.
const UNUSUAL_DEVICE: f64 = 1.0;
/// Cost of a reference that is not in metres: it is met less often.
const UNUSUAL_LENGTH: f64 = 1.5;
/// Scatter of the ratio of the measured and the predicted specific forces' root mean squares (natural
/// logarithm): a filter, a smoothing or a mass on a spring changes it by a factor of two, units of
/// either by ten and more.
const LOUDNESS_SCATTER: f64 = 0.7;
/// Scatter of gravity's slope, in units of gravity, where the reference explains the readings.
const GRAVITY_SCATTER: f64 = 0.15;
/// Squared correlation with gravity's direction that what the reference does not explain (an effect
/// beyond every formula, fast motion that a smoothing took away) may well have: it moves the slope.
const CHANCE_LIKENESS: f64 = 0.2;
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
    /// Units per metre of the reference's positions.
    pub length_units: f64,
    /// sensor_from_segment, a reflection where the determinant says so; none without enough
    /// rotation.
    pub axes: Option<Matrix3<f64>>,
}

impl CoarseAlignment {
    pub fn find(prepared: &PreparedPlacement, track: &KinematicTrack) -> Self {
        let rows_at = |lag_s: f64| -> Vec<(&Reading, usize)> {
            let rows = prepared.measured.iter().zip(&prepared.stamps);
            rows.filter_map(|(reading, stamp)| {
                let entry = ((*stamp - track.start) - lag_s) * track.rate_hz;
                (entry >= 0.0 && entry < (track.len() - 1) as f64)
                    .then_some((reading, entry.round() as usize))
            })
            .collect()
        };
        let mut lag_s = lag_of_angular_speeds(prepared, track);
        let mut rows = rows_at(lag_s);
        let mut turns = Turns::new(&rows, track);
        // What sways has the same speed half a period and a period later: the clocks' own word holds where it
        // explains as much.
        let on_time = rows_at(0.0);
        let turns_on_time = Turns::new(&on_time, track);
        let unexplained = turns_on_time.unexplained();
        if unexplained < ON_TIME && unexplained <= ON_TIME_LEAVES * turns.unexplained() {
            (lag_s, rows, turns) = (0.0, on_time, turns_on_time);
        }
        let (axes, gyro) = gyro_axes(&turns);
        let slopes = |turn: &Matrix3<f64>| ForceSlopes::new(&rows, track, turn);
        let as_it_is = slopes(&Matrix3::identity());
        // Angular velocities about one axis tell axes badly: what leaves less of the force unexplained holds.
        let scales = axes
            .map(|axes| slopes(&axes))
            .filter(|turned| turned.unexplained() <= as_it_is.unexplained())
            .unwrap_or(as_it_is)
            .scales();
        Self {
            lag_s,
            units: PerChannel {
                accelerometer: scales.accel,
                gyroscope: gyro,
            },
            gravity: scales.gravity,
            length_units: scales.length,
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

/// Sums over rows of products of the measured angular velocity y and the reference's w, means taken out, for the
/// matrix of `y = A w + b` by least squares.
struct Turns {
    count: f64,
    yw: Matrix3<f64>,
    ww: Matrix3<f64>,
    yy: f64,
    /// With the means.
    squares: [f64; 2],
}

impl Turns {
    fn new(rows: &[(&Reading, usize)], track: &KinematicTrack) -> Self {
        let count = rows.len().max(1) as f64;
        let measured = |row: &(&Reading, usize)| row.0.angular_velocity;
        let predicted = |row: &(&Reading, usize)| track.angular_velocity_in_segment[row.1];
        let mean_of = |of: &dyn Fn(&(&Reading, usize)) -> Vector3<f64>| {
            rows.iter().map(of).sum::<Vector3<f64>>() / count
        };
        let (mean_y, mean_w) = (mean_of(&measured), mean_of(&predicted));
        let mut sums = Self {
            count,
            yw: Matrix3::zeros(),
            ww: Matrix3::zeros(),
            yy: 0.0,
            squares: [0.0; 2],
        };
        for row in rows {
            let (y, w) = (measured(row), predicted(row));
            sums.squares[0] += y.norm_squared();
            sums.squares[1] += w.norm_squared();
            let (y, w) = (y - mean_y, w - mean_w);
            sums.yw += y * w.transpose();
            sums.ww += w * w.transpose();
            sums.yy += y.norm_squared();
        }
        sums
    }

    /// Whether the readings turn when the reference does about its most turned axis: what rests has the noise of
    /// both, whose ratio is anything.
    fn are_followed(&self) -> bool {
        let turned = self.ww.symmetric_eigen();
        let (most, square) = turned.eigenvalues.argmax();
        let along = self.yw * turned.eigenvectors.column(most);
        along.norm_squared() > FOLLOWED * square * self.yy
    }

    /// Part of the measured angular velocity's square that no matrix explains; all of it where the reference
    /// does not turn about all axes.
    fn unexplained(&self) -> f64 {
        let explained = self.ww.try_inverse().map_or(0.0, |inverse| {
            (self.yw * inverse * self.yw.transpose()).trace()
        });
        1.0 - explained / self.yy.max(f64::MIN_POSITIVE)
    }
}

/// Axes and units of the gyroscope from the matrix of [`Turns`]: its polar factor and the
/// cube root of its determinant.
fn gyro_axes(turns: &Turns) -> (Option<Matrix3<f64>>, f64) {
    let spread = turns.ww.symmetric_eigenvalues() / turns.count;
    if spread.min() < LEAST_SPREAD {
        let [measured, predicted] = turns.squares;
        let ratio = (measured / predicted.max(1e-12)).sqrt();
        let factor = if (0.05..=5.0).contains(&ratio) || !turns.are_followed() {
            1.0
        } else {
            known_factor(ratio, Channel::Gyroscope)
        };
        return (None, factor);
    }
    let Some(inverse) = turns.ww.try_inverse() else {
        return (None, 1.0);
    };
    let matrix = turns.yw * inverse;
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

/// How far a slope of the acceleration is off 1: noise and turned axes make it less in proportion; a smoothed
/// reference makes it more, by factors.
fn slope_off(slope: f64) -> f64 {
    if slope > 1.0 { slope.ln() } else { slope - 1.0 }
}

/// What many units to one of the SI cost: the scatter of gravity's slope is a part of the unit, so that in fine
/// units almost any slope would be near one of the three that gravity can have. Its logarithm, twice, as of a normal
/// density's width.
fn fine_units(factor: f64) -> f64 {
    2.0 * factor.max(1.0).ln()
}

/// The known factor of a unit that a scale is, else 1.
pub(crate) fn known_factor(scale: f64, channel: Channel) -> f64 {
    unit_factors(channel)
        .iter()
        .copied()
        .find(|factor| (scale / factor).ln().abs() < FACTOR_TOLERANCE)
        .unwrap_or(1.0)
}

/// Factors of the accelerometer's units, gravity, and units per metre of the reference.
struct Scales {
    accel: f64,
    gravity: GravityMode,
    length: f64,
}

/// Inner products of the measured specific force y, the reference's acceleration `R^T a` and its
/// gravity `-R^T g`, for the slopes of `y = s_a R^T a + s_g (-R^T g)`.
#[derive(Default)]
struct ForceSlopes {
    aa: f64,
    ag: f64,
    gg: f64,
    ya: f64,
    yg: f64,
    yy: f64,
}

impl ForceSlopes {
    fn new(rows: &[(&Reading, usize)], track: &KinematicTrack, turn: &Matrix3<f64>) -> Self {
        let mut sums = Self::default();
        for (reading, entry) in rows {
            let a = turn * track.acceleration_in_segment[*entry];
            let g = turn * (track.world_from_segment[*entry].inverse() * -GRAVITY_IN_WORLD);
            let y = reading.specific_force;
            sums.aa += a.dot(&a);
            sums.ag += a.dot(&g);
            sums.gg += g.dot(&g);
            sums.ya += y.dot(&a);
            sums.yg += y.dot(&g);
            sums.yy += y.dot(&y);
        }
        sums
    }

    /// The slopes `s_a`, `s_g`; none at rest.
    fn slopes(&self) -> Option<(f64, f64)> {
        let Self {
            aa, ag, gg, ya, yg, ..
        } = *self;
        let determinant = aa * gg - ag * ag;
        (gg > 0.0 && determinant > 1e-9 * gg * gg).then(|| {
            (
                (ya * gg - yg * ag) / determinant,
                (yg * aa - ya * ag) / determinant,
            )
        })
    }

    /// Sum of squares of the measured specific force that no slopes explain.
    fn unexplained(&self) -> f64 {
        let explained = |(of_a, of_g): (f64, f64)| of_a * self.ya + of_g * self.yg;
        (self.yy - self.slopes().map_or(0.0, explained)).max(0.0)
    }

    /// The known factors that the slopes are nearest to.
    fn scales(&self) -> Scales {
        let Self { aa, gg, .. } = *self;
        let Some((of_a, of_g)) = self.slopes() else {
            return self.at_rest();
        };
        let likeness = self.likeness();
        // Of what is measured, in units of gravity's power.
        let unexplained = self.unexplained() / gg;
        let too_loud = self.loudness(1.0, GravityMode::Kept, 1.0) < -MUCH_TOO_LOUD;
        let least_likeness = if too_loud {
            LEAST_LIKENESS_WHERE_LOUD
        } else {
            LEAST_LIKENESS_FOR_LENGTH
        };
        let lengths = if likeness > least_likeness {
            length_factors()
        } else {
            &length_factors()[..1]
        };
        let mut best = f64::INFINITY;
        let mut scales = self.at_rest();
        for &length in lengths {
            // An acceleration that is small in the reference weighs little, and so does one that is
            // not found again in the readings.
            let in_metres = aa / length.powi(2);
            for &accel in unit_factors(Channel::Accelerometer) {
                // In other units as much of it has to be in the readings as the slope says.
                let in_readings = if length == 1.0 {
                    0.0
                } else {
                    aa * (of_a / accel).powi(2)
                };
                let weight = likeness * (in_metres.max(in_readings) / gg * 50.0).min(1.0);
                let scatter =
                    GRAVITY_SCATTER.powi(2) + CHANCE_LIKENESS * unexplained / accel.powi(2);
                for gravity in GravityMode::ALL {
                    let unusual = [
                        (accel != 1.0, UNUSUAL_DEVICE),
                        (gravity != GravityMode::Kept, UNUSUAL_DEVICE),
                        (length != 1.0, UNUSUAL_LENGTH),
                    ];
                    let unusual: f64 = unusual
                        .iter()
                        .filter(|(is, _)| *is)
                        .map(|(_, cost)| cost)
                        .sum();
                    let off = slope_off(of_a * length / accel) / SLOPE_SCATTER;
                    let cost = (of_g / accel - gravity.factor()).powi(2) / scatter
                        + weight * off.powi(2)
                        + (self.loudness(accel, gravity, length) / LOUDNESS_SCATTER).powi(2)
                        + unusual
                        + fine_units(accel);
                    if cost < best {
                        best = cost;
                        scales = Scales {
                            accel,
                            gravity,
                            length,
                        };
                    }
                }
            }
        }
        scales
    }

    /// Natural logarithm of the ratio of the measured and the predicted root mean square.
    fn loudness(&self, accel: f64, gravity: GravityMode, length: f64) -> f64 {
        let (of_a, of_g) = (accel / length, accel * gravity.factor());
        let predicted = of_a * of_a * self.aa + 2.0 * of_a * of_g * self.ag + of_g * of_g * self.gg;
        0.5 * (self.yy.max(f64::MIN_POSITIVE) / predicted.max(f64::MIN_POSITIVE)).ln()
    }

    /// Without acceleration: gravity alone tells.
    fn at_rest(&self) -> Scales {
        let slope = if self.gg > 0.0 {
            self.yg / self.gg
        } else {
            1.0
        };
        Scales {
            accel: known_factor(slope.abs(), Channel::Accelerometer),
            gravity: if slope < 0.0 {
                GravityMode::Negated
            } else {
                GravityMode::Kept
            },
            length: 1.0,
        }
    }

    /// Squared correlation of what is measured with the reference's acceleration, gravity taken out
    /// of both.
    fn likeness(&self) -> f64 {
        let y = self.yy - self.yg * self.yg / self.gg;
        let a = self.aa - self.ag * self.ag / self.gg;
        (self.ya - self.yg * self.ag / self.gg).powi(2) / (y * a).max(f64::MIN_POSITIVE)
    }
}
