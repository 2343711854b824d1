//! Units of an accelerometer and of a reference, and gravity, by how the measured specific force follows the
//! reference's acceleration and its gravity.

use cromosim_imu::{Channel, GRAVITY_IN_WORLD, GravityMode, Reading, unit_factors};
use cromosim_spatial::KinematicTrack;
use nalgebra::{Matrix3, Vector3};

/// Squared correlation of the accelerations below which nothing is told of the reference's units of
/// length: a turned mount or a poor reference halves a slope too, but not along with a good
/// correlation.
const LEAST_LIKENESS_FOR_LENGTH: f64 = 0.5;
/// The same where the reference is louder than the readings by [`MUCH_TOO_LOUD`]: nothing but its units does that.
const LEAST_LIKENESS_WHERE_LOUD: f64 = 0.1;
/// Natural logarithm of how much louder: a hundred times; no source.
const MUCH_TOO_LOUD: f64 = 4.6;
/// From this squared correlation on, a slope that is a unit's as near as [`SAME_UNITS`] tells units of length however small
/// accelerations are beside gravity: readings hold nearly all of them. No source.
const LIKENESS_THAT_TELLS: f64 = 0.95;
/// See [`LIKENESS_THAT_TELLS`]; natural logarithm. Slow motion of 0.1 m/s2 beside noise of as much had 0.037 in feet (a0e6530094 of
/// seed 1033 of the fourth generator).
const SAME_UNITS: f64 = 0.05;
/// Sum of the readings' squares from which on their white noise is taken out of it, in units of that noise; no source.
const MORE_THAN_NOISE: f64 = 4.0;
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
/// Part of the readings' square that axes which are 0.04 rad off leave unexplained.
const OF_AXES: f64 = 1.5e-3;
/// A scale is a known unit's factor when it is within 12 % of it (natural logarithm).
const FACTOR_TOLERANCE: f64 = 0.12;

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
pub(crate) struct Scales {
    pub accel: f64,
    pub gravity: GravityMode,
    pub length: f64,
}

/// The measured specific force y, the reference's acceleration `R^T a` and its gravity `-R^T g`, in a sensor's
/// axes.
fn forces(
    (reading, entry): &(&Reading, usize),
    track: &KinematicTrack,
    turn: &Matrix3<f64>,
) -> [Vector3<f64>; 3] {
    let gravity = track.world_from_segment[*entry].inverse() * -GRAVITY_IN_WORLD;
    let acceleration = track.acceleration_in_segment[*entry];
    [reading.specific_force, turn * acceleration, turn * gravity]
}

/// Inner products of the measured specific force y, the reference's acceleration `R^T a` and its
/// gravity `-R^T g`, for the slopes of `y = s_a R^T a + s_g (-R^T g)`.
#[derive(Default)]
pub(crate) struct ForceSlopes {
    aa: f64,
    ag: f64,
    gg: f64,
    ya: f64,
    yg: f64,
    yy: f64,
    sum: Vector3<f64>,
    count: f64,
    /// What the sensor's white noise has of `yy`.
    noise: f64,
}

impl ForceSlopes {
    pub fn new(rows: &[(&Reading, usize)], track: &KinematicTrack, turn: &Matrix3<f64>) -> Self {
        let of_rows = rows.iter().map(|row| forces(row, track, turn));
        Self::of_products(of_rows)
    }

    /// Of the means over so many rows each: what is slow alone.
    pub fn of_means(
        rows: &[(&Reading, usize)],
        track: &KinematicTrack,
        turn: &Matrix3<f64>,
        count: usize,
    ) -> Self {
        let means = rows.chunks_exact(count.max(1)).map(|several| {
            let sum = several.iter().fold([Vector3::zeros(); 3], |sum, row| {
                let own = forces(row, track, turn);
                std::array::from_fn(|k| sum[k] + own[k])
            });
            sum.map(|sum| sum / several.len() as f64)
        });
        Self::of_products(means)
    }

    /// Beside white noise of the readings, of so much variance on each axis of a row.
    #[must_use]
    pub fn with_noise(mut self, variance: f64) -> Self {
        self.noise = 3.0 * self.count * variance;
        self
    }

    fn of_products(forces: impl Iterator<Item = [Vector3<f64>; 3]>) -> Self {
        let mut sums = Self::default();
        for [y, a, g] in forces {
            sums.aa += a.dot(&a);
            sums.ag += a.dot(&g);
            sums.gg += g.dot(&g);
            sums.ya += y.dot(&a);
            sums.yg += y.dot(&g);
            sums.yy += y.dot(&y);
            sums.sum += y;
            sums.count += 1.0;
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

    /// Whether these axes leave no more unexplained than others of the same readings, but for small errors of the
    /// axes: all three as they are leave nothing of what has them reversed, by slopes below zero.
    pub fn explains_as_much_as(&self, others: &Self) -> bool {
        self.unexplained() <= others.unexplained() + OF_AXES * self.yy
    }

    /// Sum of squares that no slopes explain over that about the mean, of which all stays where the readings go against the reference's
    /// acceleration.
    pub fn unexplained_part(&self) -> f64 {
        let about_mean = self.yy - self.sum.norm_squared() / self.count.max(1.0);
        let goes_along = self.slopes().is_some_and(|(of_a, _)| of_a > 0.0);
        let unexplained = self.unexplained() / about_mean.max(f64::MIN_POSITIVE);
        if goes_along {
            unexplained
        } else {
            unexplained.max(1.0)
        }
    }

    /// Sum of squares of the measured specific force that no slopes explain.
    fn unexplained(&self) -> f64 {
        let explained = |(of_a, of_g): (f64, f64)| of_a * self.ya + of_g * self.yg;
        (self.yy - self.slopes().map_or(0.0, explained)).max(0.0)
    }

    /// The known factors that the slopes are nearest to, where the reference has one of these units of length.
    pub fn scales(&self, lengths: &[f64]) -> Scales {
        let Some((of_a, of_g)) = self.slopes() else {
            return self.at_rest();
        };
        let likeness = self.likeness();
        let is_of_length =
            |length: &f64| *length != 1.0 && (of_a / of_g.abs() * length).ln().abs() < SAME_UNITS;
        let is_told =
            self.likeness_but_for_noise() > LIKENESS_THAT_TELLS && lengths.iter().any(is_of_length);
        let mut best = f64::INFINITY;
        let mut scales = self.at_rest();
        for &length in lengths {
            for &accel in unit_factors(Channel::Accelerometer) {
                for gravity in GravityMode::ALL {
                    let of = Scales {
                        accel,
                        gravity,
                        length,
                    };
                    let cost = self.cost((of_a, of_g), likeness, is_told, &of);
                    if cost < best {
                        (best, scales) = (cost, of);
                    }
                }
            }
        }
        scales
    }

    /// Whether the readings move enough with the reference to tell its units of length.
    pub fn tells_length(&self) -> bool {
        let too_loud = self.loudness(1.0, GravityMode::Kept, 1.0) < -MUCH_TOO_LOUD;
        let least_likeness = if too_loud {
            LEAST_LIKENESS_WHERE_LOUD
        } else {
            LEAST_LIKENESS_FOR_LENGTH
        };
        self.slopes().is_some() && self.likeness() > least_likeness
    }

    /// How unlikely such units are, in squared scatters.
    fn cost(&self, (of_a, of_g): (f64, f64), likeness: f64, is_told: bool, of: &Scales) -> f64 {
        let Scales {
            accel,
            gravity,
            length,
        } = *of;
        let Self { aa, gg, .. } = *self;
        // An acceleration that is small in the reference weighs little, and so does one that is not found
        // again in the readings. In other units as much of it has to be in the readings as the slope says.
        let in_metres = aa / length.powi(2);
        let in_readings = if length == 1.0 {
            0.0
        } else {
            aa * (of_a / accel).powi(2)
        };
        let weight = if is_told {
            likeness
        } else {
            likeness * (in_metres.max(in_readings) / gg * 50.0).min(1.0)
        };
        // Of what is measured, in units of gravity's power.
        let unexplained = self.unexplained() / gg;
        let scatter = GRAVITY_SCATTER.powi(2) + CHANCE_LIKENESS * unexplained / accel.powi(2);
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
        (of_g / accel - gravity.factor()).powi(2) / scatter
            + weight * off.powi(2)
            + (self.loudness(accel, gravity, length) / LOUDNESS_SCATTER).powi(2)
            + unusual
            + fine_units(accel)
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
        self.likeness_to(self.yy - self.yg * self.yg / self.gg)
    }

    /// The same of what is measured without white noise.
    fn likeness_but_for_noise(&self) -> f64 {
        let y = self.yy - self.yg * self.yg / self.gg;
        let without_noise = if y > MORE_THAN_NOISE * self.noise {
            y - self.noise
        } else {
            y
        };
        self.likeness_to(without_noise)
    }

    fn likeness_to(&self, y: f64) -> f64 {
        let a = self.aa - self.ag * self.ag / self.gg;
        (self.ya - self.yg * self.ag / self.gg).powi(2) / (y * a).max(f64::MIN_POSITIVE)
    }
}
