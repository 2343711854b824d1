//! What a device says of its own orientation: sensor fusion over its readings.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use uf_ahrs::{AhrsWithDt, Madgwick, MadgwickParams, Mahony, MahonyParams};
use vqf_rs::VQF;

use crate::{ImuError, Reading};

/// Where the orientation of `imu/NAME/data` comes from.
///
/// The filters see what the messages say, biases and noise included, so that their tilt errs and their
/// heading drifts as a device's does. With a magnetometer the orientation is against east, magnetic north and
/// up (REP-145); without one the heading begins at an arbitrary angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OrientationSource {
    /// The simulated pose, with the device's `orientation_stddev`.
    #[default]
    Truth,
    /// VQF (Laidig and Seel 2023), with its published parameters.
    Vqf,
    /// Madgwick's gradient descent (2010), gain 0.05.
    Madgwick,
    /// Mahony's complementary filter (2008), gains 0.74 and 0.0012.
    Mahony,
    /// Not reported: the first element of its covariance is -1.
    None,
}

impl OrientationSource {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Truth,
        Self::Vqf,
        Self::Madgwick,
        Self::Mahony,
        Self::None,
    ];

    /// The name in files, parameters and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Vqf => "vqf",
            Self::Madgwick => "madgwick",
            Self::Mahony => "mahony",
            Self::None => "none",
        }
    }
}

impl fmt::Display for OrientationSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for OrientationSource {
    type Err = ImuError;

    fn from_str(name: &str) -> Result<Self, ImuError> {
        let found = Self::ALL.into_iter().find(|known| known.name() == name);
        found.ok_or_else(|| ImuError::UnknownOrientation {
            name: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}

/// Standard deviations that are stated of a filter's orientation about the horizontal axes and about the
/// vertical one, rad, with a magnetometer. Measured: `cargo test --test complete_imu fusion -- --nocapture`, the root mean
/// square over five placements of the walk with consumer_mems, rounded up.
const STATED: [(OrientationSource, [f64; 2]); 3] = [
    (OrientationSource::Vqf, [0.04, 0.15]),
    (OrientationSource::Madgwick, [0.02, 0.10]),
    (OrientationSource::Mahony, [0.03, 0.09]),
];

/// Of a heading that nothing holds, rad: anything between -pi and pi.
const UNKNOWN_HEADING: f64 = 1.813_799_364_234_217_8;

/// After a longer pause a filter begins anew, s.
const LONGEST_STEP_S: f64 = 1.0;

/// A filter of one device; readings go in, in order of time.
pub(crate) struct OrientationFilter {
    source: OrientationSource,
    rate_hz: f64,
    filter: Option<Filter>,
    last: Option<Stamp>,
}

enum Filter {
    Vqf(Box<VQF>),
    /// With a magnetometer its world is north, west, up.
    Other(Box<dyn AhrsWithDt + Send + Sync>),
}

impl OrientationFilter {
    /// None for what no filter gives.
    pub fn new(source: OrientationSource, rate_hz: f64) -> Option<Self> {
        let is_filter = STATED.iter().any(|(known, _)| *known == source);
        is_filter.then_some(Self {
            source,
            rate_hz,
            filter: None,
            last: None,
        })
    }

    /// Begins anew with the next reading.
    pub fn reset(&mut self) {
        self.filter = None;
        self.last = None;
    }

    /// world_from_sensor after this reading; `magnetic_field` in any unit.
    pub fn update(
        &mut self,
        reading: &Reading,
        magnetic_field: Option<&Vector3<f64>>,
        stamp: Stamp,
    ) -> UnitQuaternion<f64> {
        let mut elapsed = self.last.map_or(0.0, |last| stamp - last);
        if !(0.0..=LONGEST_STEP_S).contains(&elapsed) {
            self.filter = None;
            elapsed = 0.0;
        }
        self.last = Some(stamp);
        let fresh = || Filter::new(self.source, self.rate_hz, reading, magnetic_field);
        match self.filter.get_or_insert_with(fresh) {
            Filter::Vqf(vqf) => step_vqf(vqf, reading, magnetic_field, elapsed),
            Filter::Other(filter) => {
                let single = |vector: &Vector3<f64>| vector.map(|value| value as f32);
                let step = Duration::from_secs_f64(elapsed);
                let (turn, force) = (
                    single(&reading.angular_velocity),
                    single(&reading.specific_force),
                );
                // Normalized here: tesla squared are nothing in single precision.
                let field = magnetic_field.and_then(|field| field.try_normalize(0.0));
                match field {
                    Some(field) => {
                        let estimate = filter.update_with_dt(step, turn, force, single(&field));
                        east_from_north() * in_double(estimate)
                    }
                    None => in_double(filter.update_imu_with_dt(step, turn, force)),
                }
            }
        }
    }

    /// Of its orientations, rad2, about the world's axes: row-major 3x3.
    pub fn covariance(&self, has_magnetometer: bool) -> [f64; 9] {
        let stated = STATED.iter().find(|(known, _)| *known == self.source);
        let [tilt, heading] = stated.map_or([0.0; 2], |(_, stated)| *stated);
        let heading = if has_magnetometer {
            heading
        } else {
            UNKNOWN_HEADING
        };
        let mut covariance = [0.0; 9];
        covariance[0] = tilt * tilt;
        covariance[4] = tilt * tilt;
        covariance[8] = heading * heading;
        covariance
    }
}

impl Filter {
    fn new(
        source: OrientationSource,
        rate_hz: f64,
        reading: &Reading,
        magnetic_field: Option<&Vector3<f64>>,
    ) -> Self {
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        let start = first_orientation(&reading.specific_force, magnetic_field).cast::<f32>();
        match source {
            OrientationSource::Madgwick => Self::Other(Box::new(Madgwick::new_with_orientation(
                period,
                MadgwickParams::default(),
                start,
            ))),
            OrientationSource::Mahony => Self::Other(Box::new(Mahony::new_with_orientation(
                period,
                MahonyParams::default(),
                start,
            ))),
            _ => Self::Vqf(Box::new(VQF::new(1.0 / rate_hz, None, None, None))),
        }
    }
}

fn step_vqf(
    vqf: &mut VQF,
    reading: &Reading,
    magnetic_field: Option<&Vector3<f64>>,
    elapsed: f64,
) -> UnitQuaternion<f64> {
    vqf.update_gyr_with_ts(reading.angular_velocity.into(), elapsed);
    vqf.update_acc(reading.specific_force.into());
    let estimate = match magnetic_field {
        Some(field) => {
            vqf.update_mag((*field).into());
            vqf.quat_9d()
        }
        None => vqf.quat_6d(),
    };
    let vqf_rs::Quaternion(w, x, y, z) = estimate;
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Of length 1 to the last digit of double precision.
fn in_double(estimate: UnitQuaternion<f32>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(estimate.into_inner().cast::<f64>())
}

/// East, north, up from north, west, up.
fn east_from_north() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2)
}

/// Level, as the specific force is at rest; with a magnetic field x is north, else the turn is the least.
fn first_orientation(
    specific_force: &Vector3<f64>,
    magnetic_field: Option<&Vector3<f64>>,
) -> UnitQuaternion<f64> {
    let up = specific_force.try_normalize(0.0).unwrap_or(Vector3::z());
    let level = magnetic_field.map(|field| field - up * field.dot(&up));
    if let Some(north) = level.and_then(|level| level.try_normalize(0.0)) {
        let rows = [north, up.cross(&north), up].map(|row| row.transpose());
        let world_from_sensor = Rotation3::from_matrix_unchecked(Matrix3::from_rows(&rows));
        return UnitQuaternion::from_rotation_matrix(&world_from_sensor);
    }
    UnitQuaternion::rotation_between(&up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

#[cfg(test)]
#[path = "orientation_tests.rs"]
mod tests;
