//! Where a row's reading stands, and in which units.

use nalgebra::{UnitQuaternion, Vector3};

use super::about::{About, is_empty};
use crate::datasets::capture::{from_euler, specific_force};
use crate::rigid::RigidError;
use crate::rigid::table::Row;

/// Where a reading's parts stand.
pub(super) struct Columns {
    force: Force,
    rate: Rate,
    orientation: Option<Orientation>,
    has_field: bool,
}

enum Force {
    Measured([usize; 3]),
    Increment([usize; 3]),
    /// Needs an orientation.
    Free([usize; 3]),
}

enum Rate {
    /// Radians a unit.
    Measured([usize; 3], f64),
    /// w first.
    Increment([usize; 4]),
}

#[derive(Clone, Copy)]
enum Orientation {
    /// w first.
    Quaternion([usize; 4]),
    /// Degrees about x, y and z.
    Euler([usize; 3]),
}

/// One row.
pub(super) struct Reading {
    pub specific_force: Vector3<f64>,
    pub angular_velocity: Vector3<f64>,
    pub world_from_sensor: Option<UnitQuaternion<f64>>,
}

impl Columns {
    pub fn of(
        file: &About<'_>,
        first: &Row<'_>,
        (name, line): (&str, usize),
    ) -> Result<Self, RigidError> {
        let missing = |missing: &str| RigidError::Header {
            name: name.to_owned(),
            line,
            missing: missing.to_owned(),
            found: file
                .titles
                .iter()
                .map(|title| (*title).to_owned())
                .collect(),
        };
        let quaternions = [
            ["quatw", "quatx", "quaty", "quatz"],
            ["quatq0", "quatq1", "quatq2", "quatq3"],
        ];
        let quaternion = quaternions.iter().find_map(|names| file.find(*names));
        let angles = [["eulerx", "eulery", "eulerz"], ["roll", "pitch", "yaw"]];
        let angles = angles.iter().find_map(|names| file.find(*names));
        let orientation = quaternion.map(Orientation::Quaternion);
        let orientation = orientation
            .or(angles.map(Orientation::Euler))
            .filter(|orientation| !orientation.columns().iter().any(|at| is_empty(first, *at)));
        let velocity = [
            ["dvx", "dvy", "dvz"],
            ["dv1", "dv2", "dv3"],
            ["velincx", "velincy", "velincz"],
        ];
        let velocity = velocity.iter().find_map(|names| file.find(*names));
        let measured = file.find(["accx", "accy", "accz"]).map(Force::Measured);
        let free = file.find(["freeaccx", "freeaccy", "freeaccz"]);
        let force = measured
            .or(velocity.map(Force::Increment))
            .or(free.filter(|_| orientation.is_some()).map(Force::Free))
            .ok_or_else(|| {
                missing(
                    "specific force (Acc_X, Acc_Y, Acc_Z; or dv; or FreeAcc with an orientation)",
                )
            })?;
        let turns = [
            ["dqw", "dqx", "dqy", "dqz"],
            ["oriincq0", "oriincq1", "oriincq2", "oriincq3"],
        ];
        let turns = turns.iter().find_map(|names| file.find(*names));
        let radians = if file.is_mt { 1.0 } else { 1_f64.to_radians() };
        let measured = file.find(["gyrx", "gyry", "gyrz"]);
        let rate = measured
            .map(|columns| Rate::Measured(columns, radians))
            .or(turns.map(Rate::Increment))
            .ok_or_else(|| missing("angular velocity (Gyr_X, Gyr_Y, Gyr_Z; or dq)"))?;
        Ok(Self {
            force,
            rate,
            orientation,
            has_field: file.find(["magx", "magy", "magz"]).is_some(),
        })
    }

    pub fn needs_rate(&self) -> bool {
        matches!(self.force, Force::Increment(_)) || matches!(self.rate, Rate::Increment(_))
    }

    /// None where a cell is empty.
    pub fn reading(&self, row: &Row<'_>, rate_hz: f64) -> Result<Option<Reading>, RigidError> {
        let force: &[usize] = match &self.force {
            Force::Measured(columns) | Force::Increment(columns) | Force::Free(columns) => columns,
        };
        let rate: &[usize] = match &self.rate {
            Rate::Measured(columns, _) => columns,
            Rate::Increment(columns) => columns,
        };
        let oriented = self
            .orientation
            .as_ref()
            .map_or(&[][..], Orientation::columns);
        let mut columns = force.iter().chain(rate).chain(oriented);
        if columns.any(|column| is_empty(row, *column)) {
            return Ok(None);
        }
        let vector = |[x, y, z]: [usize; 3]| {
            Ok::<_, RigidError>(Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?))
        };
        let turn = |[w, x, y, z]: [usize; 4]| row.rotation([x, y, z, w]);
        let world_from_sensor = match self.orientation {
            None => None,
            Some(Orientation::Quaternion(columns)) => Some(turn(columns)?),
            Some(Orientation::Euler(columns)) => {
                let angles = vector(columns)?.map(f64::to_radians);
                Some(from_euler([2, 1, 0], angles))
            }
        };
        let specific_force = match (&self.force, world_from_sensor) {
            (Force::Measured(columns), _) => vector(*columns)?,
            (Force::Increment(columns), _) => vector(*columns)? * rate_hz,
            (Force::Free(columns), Some(world_from_sensor)) => {
                specific_force(world_from_sensor, vector(*columns)?)
            }
            (Force::Free(_), None) => return Ok(None),
        };
        let angular_velocity = match self.rate {
            Rate::Measured(columns, radians) => vector(columns)? * radians,
            Rate::Increment(columns) => turn(columns)?.scaled_axis() * rate_hz,
        };
        Ok(Some(Reading {
            specific_force,
            angular_velocity,
            world_from_sensor,
        }))
    }

    pub fn notes(&self, file: &About<'_>) -> Vec<String> {
        let unit = match (&self.rate, file.is_mt) {
            (Rate::Increment(_), _) => "angular velocity by the increments of orientation",
            (_, true) => "Gyr taken as rad/s, as MT Manager writes it",
            (_, false) => "Gyr taken as degrees a second, as Movella DOT writes it",
        };
        let force = match self.force {
            Force::Measured(_) => None,
            Force::Increment(_) => Some("specific force by the increments of velocity"),
            Force::Free(_) => Some("specific force by the free acceleration and the orientation"),
        };
        let field = self
            .has_field
            .then_some("the magnetic field, in units of its own, is left alone");
        let all = [Some(unit), force, field].into_iter().flatten();
        all.map(str::to_owned).collect()
    }
}

impl Orientation {
    fn columns(&self) -> &[usize] {
        match self {
            Self::Quaternion(columns) => columns,
            Self::Euler(columns) => columns,
        }
    }
}
