//! What is found in closed form before any fit: lag, units, axes and gravity, each to within what a
//! fit can go on from.

use std::ops::RangeInclusive;

use cromosim_imu::{
    Channel, Effect, EffectError, EffectKind, EffectSet, GravityMode, PerChannel, Reading,
    length_factors, nearest_signed_permutation, unit_factors,
};
use cromosim_spatial::{KinematicTrack, PoseNoise, so3};
use nalgebra::{Matrix3, UnitQuaternion};

use crate::exchanged_axes::exchanged_axes;
use crate::force_slopes::{ForceSlopes, Scales, known_factor};
use crate::lag::{Drift, drift_of_angular_speeds, lag_of_angular_speeds};
use crate::policy::report::REFERENCE_NOISE;
use crate::prepared::PreparedPlacement;
use crate::turns::{FOLLOWED, Turns};

/// Lags above this are certain, s.
const CERTAIN_LAG_S: f64 = 0.1;
/// From here on the search starts with the lag, too, and without it, s: a filter is as late as that; and steps from no lag
/// may not reach it, as motion of 4 Hz has turned round in 0.12 s.
const LEAST_LAG_S: f64 = 0.03;
/// Part of the angular velocity's square that may stay unexplained without a lag, and over that with the lag that
/// the speeds tell, where no lag is believed; no source. A lag of a twentieth of a period leaves a tenth.
const ON_TIME: f64 = 0.5;
const ON_TIME_LEAVES: f64 = 1.2;
/// Distance of a rotation (Frobenius norm over sqrt(2)) from the identity or from a signed
/// permutation below which it is left to the search.
const NEAR_AXES: f64 = 0.25;
/// Scales of the gyroscope that are no other units: noise and a lag take away half.
const NEARLY_ONE: RangeInclusive<f64> = 0.5..=2.0;
/// Part of a unit's factor that saturation or a filter may leave of a gyroscope's scale; no source.
const WEAKENED: f64 = 0.5;
/// Smallest over largest singular value below which readings have too little to do with the
/// reference to have axes.
const LEAST_LIKENESS: f64 = 0.3;

/// Time over which forces and turns are averaged for what is slow, s: below some 2 Hz. No source.
const SLOW_S: f64 = 0.25;
/// White noise of positions, "m", that is taken for millimetres where the rotation scatters as ordinarily, and
/// nothing moves: 50 m away, a cluster of markers of 50 mm would have it. No source.
const MILLIMETRES_NOISE: f64 = 0.05;

/// What the closed forms say.
#[derive(Clone, Debug)]
pub(crate) struct CoarseAlignment {
    /// IMU stamps late by this, s.
    pub lag_s: f64,
    /// How that grows, where it does by more than a fit finds; `lag_s` is that of the first message then.
    pub drift: Option<Drift>,
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
        let rows_along = |drift: Drift| -> Vec<(&Reading, usize)> {
            let rows = prepared.measured.iter().zip(&prepared.stamps);
            rows.filter_map(|(reading, stamp)| {
                let lag_s = drift.lag_s + drift.per_second * (*stamp - prepared.epoch);
                let entry = ((*stamp - track.start) - lag_s) * track.rate_hz;
                (entry >= 0.0 && entry < (track.len() - 1) as f64)
                    .then_some((reading, entry.round() as usize))
            })
            .collect()
        };
        let rows_at = |lag_s: f64| {
            let per_second = 0.0;
            rows_along(Drift { lag_s, per_second })
        };
        let mut lag_s = lag_of_angular_speeds(prepared, track);
        let drift = drift_of_angular_speeds(prepared, track, lag_s);
        let mut rows = rows_at(lag_s);
        if let Some(drift) = drift {
            lag_s = drift.lag_s;
            rows = rows_along(drift);
        }
        let mut turns = Turns::new(&rows, track);
        // What sways has the same speed half a period and a period later: the clocks' own word holds where it
        // explains as much.
        let on_time = rows_at(0.0);
        let turns_on_time = Turns::new(&on_time, track);
        let unexplained = turns_on_time.unexplained();
        let is_on_time =
            unexplained < ON_TIME && unexplained <= ON_TIME_LEAVES * turns.unexplained();
        if drift.is_none() && is_on_time {
            (lag_s, rows, turns) = (0.0, on_time, turns_on_time);
        }
        let count = (SLOW_S * prepared.rate_hz).round() as usize;
        let (axes, gyro) = gyro_axes(&turns, &Turns::of_means(&rows, track, count));
        let slopes = |turn: &Matrix3<f64>| ForceSlopes::new(&rows, track, turn);
        let axes = axes.or_else(|| exchanged_axes(&turns, slopes));
        let (turn, slopes) = axes_of_forces(axes, slopes);
        let variance = prepared.declared[Channel::Accelerometer].map_or(0.0, |sigma| sigma.powi(2));
        let slow = ForceSlopes::of_means(&rows, track, &turn, count)
            .with_noise(variance / count.max(1) as f64);
        let scales = scales(&slopes, &slow, prepared.estimate.noise());
        Self {
            lag_s,
            drift,
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
    /// signed permutation, or as a rotation; without a lag first where that is not certain.
    pub fn starts(&self) -> Vec<EffectSet> {
        let mut late = EffectSet::new();
        insert_valid(&mut late, Effect::time_offset(self.lag_s));
        if let Some(drift) = self.drift {
            let ppm = vec![1e6 * drift.per_second];
            insert_valid(&mut late, Effect::new(EffectKind::ClockDrift, ppm));
            return self.starts_with(late);
        }
        match self.lag_s.abs() {
            lag_s if lag_s > CERTAIN_LAG_S => self.starts_with(late),
            lag_s if lag_s > LEAST_LAG_S => {
                let mut starts = self.starts_with(EffectSet::new());
                starts.extend(self.starts_with(late));
                starts
            }
            _ => self.starts_with(EffectSet::new()),
        }
    }

    fn starts_with(&self, mut certain: EffectSet) -> Vec<EffectSet> {
        if self.gravity != GravityMode::Kept {
            insert_valid(&mut certain, Effect::gravity_convention(self.gravity));
        }
        let Some(axes) = self.axes else {
            return vec![certain];
        };
        if is_near(&axes, &Matrix3::identity()) {
            return vec![certain];
        }
        let mut starts = Vec::new();
        if near_permutation(&axes).is_some() || axes.determinant() < 0.0 {
            let mut set = certain.clone();
            let permutation = nearest_signed_permutation(&axes);
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

/// The axes by which forces are compared, with the forces' slopes in them. Angular velocities about one axis, or a gyroscope's
/// misalignment, tell axes badly: what leaves less of the force unexplained holds, of exchanged axes these themselves.
fn axes_of_forces(
    axes: Option<Matrix3<f64>>,
    slopes: impl Fn(&Matrix3<f64>) -> ForceSlopes,
) -> (Matrix3<f64>, ForceSlopes) {
    let as_it_is = slopes(&Matrix3::identity());
    axes.into_iter()
        .flat_map(|axes| [Some(axes), near_permutation(&axes)])
        .flatten()
        .map(|axes| (axes, slopes(&axes)))
        .find(|(_, turned)| turned.explains_as_much_as(&as_it_is))
        .unwrap_or((Matrix3::identity(), as_it_is))
}

/// Units of the accelerometer, gravity, and units per metre of the reference: by what of its motion is slow (a filter
/// of the device weakens what is fast, by as much as feet do), by all of it, or at rest by its noise.
fn scales(slopes: &ForceSlopes, slow: &ForceSlopes, noise: PoseNoise) -> Scales {
    let telling = [slow, slopes].into_iter().find(|it| it.tells_length());
    let length = telling.map_or_else(
        || length_units_at_rest(noise),
        |it| it.scales(length_factors()).length,
    );
    slopes.scales(&[length])
}

/// Units per metre of a reference at rest, by its noise alone.
fn length_units_at_rest(noise: PoseNoise) -> f64 {
    let is_in_millimetres =
        noise.position > MILLIMETRES_NOISE && noise.rotation < REFERENCE_NOISE.rotation;
    if is_in_millimetres { 1000.0 } else { 1.0 }
}

/// Whether axes are others but for what is left to the search.
fn is_near(axes: &Matrix3<f64>, others: &Matrix3<f64>) -> bool {
    (axes - others).norm() / 2.0_f64.sqrt() < NEAR_AXES
}

/// The signed permutation that axes are near to.
fn near_permutation(axes: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    Some(nearest_signed_permutation(axes)).filter(|permutation| is_near(axes, permutation))
}

/// Inserts an effect where its values are within its bounds.
fn insert_valid(set: &mut EffectSet, effect: Result<Effect, EffectError>) {
    if let Ok(effect) = effect {
        set.insert(effect);
    }
}

/// The factor of the gyroscope's units where noise hides how the reference turns about other axes.
fn factor_about_one_axis(turns: &Turns) -> f64 {
    let ratio = turns.ratio();
    if (0.05..=5.0).contains(&ratio) || !turns.are_followed() {
        1.0
    } else {
        gyro_factor(ratio)
    }
}

/// The unit's factor that a gyroscope's scale has: up to half of a fine unit's is lost where readings saturate or are
/// filtered; coarse ones may be what noise of the reference leaves of none, and have to be near. Else 1.
fn gyro_factor(scale: f64) -> f64 {
    let factors = unit_factors(Channel::Gyroscope).iter().copied();
    let is_weakened = |factor: &f64| *factor > 1.0 && (WEAKENED..1.0).contains(&(scale / factor));
    match known_factor(scale, Channel::Gyroscope) {
        1.0 => factors.into_iter().find(is_weakened).unwrap_or(1.0),
        known => known,
    }
}

/// Axes and units of the gyroscope from the matrix of [`Turns`]: its polar factor and the
/// cube root of its determinant; units also from what is slow of them.
fn gyro_axes(turns: &Turns, slow: &Turns) -> (Option<Matrix3<f64>>, f64) {
    let of_all_axes = turns.matrix().and_then(|matrix| {
        let svd = matrix.svd(true, true);
        let is_alike = svd.singular_values.min() >= LEAST_LIKENESS * svd.singular_values.max();
        let axes = svd.u? * svd.v_t?;
        is_alike.then(|| (axes, matrix.determinant().abs().cbrt()))
    });
    match of_all_axes {
        // Noise of the reference makes the axes that it turns least about count for less; smoothed, it turns less
        // than the readings, but for what is slow of them.
        Some((axes, scale)) if !NEARLY_ONE.contains(&scale) => {
            let all = (scale, 1.0 - turns.unexplained());
            let slow = Some(slow.about_most_turned_axis()).filter(|(slope, _)| *slope < scale);
            let slopes = [all, turns.about_most_turned_axis()]
                .into_iter()
                .chain(slow);
            let known = slopes
                .filter(|(_, explained)| *explained > FOLLOWED)
                .map(|(slope, _)| gyro_factor(slope))
                .find(|factor| *factor != 1.0);
            (Some(axes), known.unwrap_or(1.0))
        }
        Some((axes, _)) => (Some(axes), 1.0),
        None => (None, factor_about_one_axis(turns)),
    }
}

#[cfg(test)]
mod tests {
    use cromosim_imu::normal_pair;
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha12Rng;

    use super::*;

    /// At 50 Hz, what a reference and a gyroscope turn.
    fn turned(
        seen: impl Fn(f64) -> Vector3<f64>,
        read: impl Fn(f64) -> Vector3<f64>,
    ) -> (KinematicTrack, Vec<Reading>) {
        let times = || (0..2000).map(|k| 0.02 * f64::from(k));
        let track = KinematicTrack {
            angular_velocity_in_segment: times().map(seen).collect(),
            ..KinematicTrack::default()
        };
        let reading = |t: f64| Reading {
            angular_velocity: read(t),
            ..Reading::default()
        };
        (track, times().map(reading).collect())
    }

    fn sines(t: f64, of: [f64; 3]) -> Vector3<f64> {
        Vector3::from(of.map(|radians| (radians * t).sin()))
    }

    #[test]
    fn noise_about_axes_that_hardly_turn_hides_no_units() {
        // Turns of 1 rad/s about one axis and 0.08 rad/s about the others, where the reference's own errors are nearly
        // as large: slopes of one and of 0.57.
        let turns =
            |t: f64| sines(t, [3.0, 4.1, 5.3]).component_mul(&Vector3::new(1.0, 0.08, 0.08));
        let errors = |t: f64| sines(t, [17.0, 19.3, 23.7]) * 0.07;
        let (track, readings) = turned(|t| turns(t) + errors(t), |t| turns(t).map(f64::to_degrees));
        let rows: Vec<(&Reading, usize)> = readings.iter().zip(0..).collect();
        let turns = Turns::new(&rows, &track);
        let attenuated = turns
            .matrix()
            .map_or(0.0, |matrix| matrix.determinant().cbrt());
        assert!((30.0..50.0).contains(&attenuated), "{attenuated}");
        let (axes, factor) = gyro_axes(&turns, &turns);
        assert!(axes.is_some());
        assert_eq!(factor, 1.0_f64.to_degrees());
    }

    #[test]
    fn readings_that_do_not_follow_are_in_no_other_units() {
        // Those of a drifting clock: by chance something is left of their slope, here 0.159 about one axis.
        let seen = |t: f64| sines(t, [7.0, 8.0, 9.0]).component_mul(&Vector3::new(2.0, 1.0, 1.0));
        let left = Vector3::new(0.159, 0.45, 0.45);
        let (track, readings) = turned(seen, |t| {
            seen(t).component_mul(&left) + sines(t, [11.0; 3]) * 3.0
        });
        let rows: Vec<(&Reading, usize)> = readings.iter().zip(0..).collect();
        let turns = Turns::new(&rows, &track);
        let (slope, explained) = turns.about_most_turned_axis();
        assert_eq!(gyro_factor(slope), 0.159_154_943_091_895_35);
        assert!(explained < 0.05, "{explained}");
        let (axes, factor) = gyro_axes(&turns, &turns);
        assert!(axes.is_some());
        assert_eq!(factor, 1.0);
    }

    #[test]
    fn a_smoothed_reference_hides_no_units_of_the_gyroscope() {
        // Of turns at 4 Hz and more the reference holds a tenth: the slope of all is four times the unit's.
        let slow = |t: f64| sines(t, [1.9, 2.3, 2.9]);
        let fast = |t: f64| sines(t, [26.0, 52.0, 78.0]) * 8.0;
        for factor in [1.0, 1.0_f64.to_degrees()] {
            let (track, readings) = turned(
                |t| slow(t) + fast(t) * 0.1,
                |t| (slow(t) + fast(t)) * factor,
            );
            let rows: Vec<(&Reading, usize)> = readings.iter().zip(0..).collect();
            let turns = Turns::new(&rows, &track);
            let slope = turns.about_most_turned_axis().0;
            assert!((3.0..6.0).contains(&(slope / factor)), "{slope}");
            assert_eq!(gyro_axes(&turns, &turns).1, 1.0);
            let (axes, found) = gyro_axes(&turns, &Turns::of_means(&rows, &track, 12));
            assert!(axes.is_some());
            assert_eq!(found, factor);
        }
    }

    /// A tool's acceleration along x, m/s2: slow, and of 30 Hz.
    fn acceleration(t: f64) -> [f64; 2] {
        [2.0 * (1.7 * t).sin(), 20.0 * (190.0 * t).sin()]
    }

    /// At 200 Hz, of a reference in such units, readings that hold so much of what is fast, with gravity along an axis.
    fn forces(units: f64, of_fast: f64, up: Vector3<f64>) -> (KinematicTrack, Vec<Reading>) {
        let mut track = KinematicTrack::default();
        let mut readings = Vec::new();
        for k in 0..4000 {
            let [slow, fast] = acceleration(0.005 * f64::from(k));
            track
                .acceleration_in_segment
                .push(Vector3::x() * (units * (slow + fast)));
            track.world_from_segment.push(UnitQuaternion::identity());
            readings.push(Reading {
                specific_force: Vector3::x() * (slow + of_fast * fast) + up * 9.80665,
                ..Reading::default()
            });
        }
        (track, readings)
    }

    fn scales_of(seen: &(KinematicTrack, Vec<Reading>), noise: f64) -> [f64; 2] {
        scales_beside(seen, noise, 0.0)
    }

    /// The same beside a sensor's noise that has such a variance.
    fn scales_beside(
        (track, readings): &(KinematicTrack, Vec<Reading>),
        noise: f64,
        variance: f64,
    ) -> [f64; 2] {
        let rows: Vec<(&Reading, usize)> = readings.iter().zip(0..).collect();
        let as_it_is = Matrix3::identity();
        let slow = ForceSlopes::of_means(&rows, track, &as_it_is, 50).with_noise(variance / 50.0);
        let noise = PoseNoise {
            position: noise,
            rotation: 1e-3,
        };
        let scales = scales(&ForceSlopes::new(&rows, track, &as_it_is), &slow, noise);
        [scales.accel, scales.length]
    }

    #[test]
    fn a_filter_neither_hides_feet_nor_passes_for_them() {
        let feet = 1.0 / 0.3048;
        let found = scales_of(&forces(feet, 0.02, Vector3::z()), 1e-4);
        assert_eq!(found, [1.0, feet]);
        let found = scales_of(&forces(1.0, 0.3, Vector3::z()), 1e-4);
        assert_eq!(found, [1.0, 1.0]);
    }

    #[test]
    fn feet_are_told_where_little_moves_and_readings_hold_nearly_all_of_it() {
        let (little, gravity) = (0.03, Vector3::z() * 9.80665);
        for (units, told) in [(1.0 / 0.3048, 1.0 / 0.3048), (1.0, 1.0), (2.9, 1.0)] {
            let (mut track, mut readings) = forces(units, 1.0, Vector3::z());
            for acceleration in &mut track.acceleration_in_segment {
                *acceleration *= little;
            }
            for reading in &mut readings {
                let moved = reading.specific_force - gravity;
                reading.specific_force = gravity + moved * little;
            }
            assert_eq!(scales_of(&(track, readings), 1e-4), [1.0, told]);
        }
    }

    #[test]
    fn feet_are_told_where_readings_hold_nearly_all_but_for_their_noise() {
        let (little, gravity, sigma) = (0.03, Vector3::z() * 9.80665, 0.08);
        let mut random = ChaCha12Rng::seed_from_u64(5);
        let mut noise = || normal_pair(&mut random)[0] * sigma;
        for (units, told) in [(1.0 / 0.3048, 1.0 / 0.3048), (1.0, 1.0), (2.8, 1.0)] {
            let (mut track, mut readings) = forces(units, 1.0, Vector3::z());
            for acceleration in &mut track.acceleration_in_segment {
                *acceleration *= little;
            }
            for reading in &mut readings {
                let moved = reading.specific_force - gravity;
                let noise = Vector3::new(noise(), noise(), noise());
                reading.specific_force = gravity + moved * little + noise;
            }
            let seen = (track, readings);
            assert_eq!(scales_beside(&seen, 1e-4, sigma * sigma), [1.0, told]);
        }
    }

    #[test]
    fn millimetres_of_who_rests_are_no_units_of_the_accelerometer() {
        // Other axes hide the acceleration, the positions' noise tells their units.
        let found = scales_of(&forces(1000.0, 1.0, Vector3::y()), 0.2);
        assert_eq!(found, [1.0, 1000.0]);
    }

    #[test]
    fn saturation_hides_no_units_of_the_gyroscope() {
        for (scale, factor) in [
            (40.0, 1.0_f64.to_degrees()),
            (57.0, 1.0_f64.to_degrees()),
            (0.3, 1.0),
            (3.0, 1.0),
        ] {
            assert_eq!(gyro_factor(scale), factor, "{scale}");
        }
    }
}
