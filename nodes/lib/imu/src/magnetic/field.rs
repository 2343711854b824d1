//! The magnetic field around a body.

use std::path::Path;

use cromosim_spatial::in_plain_words;
use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;
use world_magnetic_model::GeomagneticField;
use world_magnetic_model::time::{Date, Month};
use world_magnetic_model::uom::si::angle::degree;
use world_magnetic_model::uom::si::f32::{Angle, Length};
use world_magnetic_model::uom::si::length::meter;
use world_magnetic_model::uom::si::magnetic_flux_density::tesla;

use crate::ImuError;

const SCHEMA: &str = "cromosim/magnetic_field/1";

/// mu_0 / (4 pi), T m/A: to eight digits that of the magnetic constant (CODATA 2018).
const MU_0_OVER_4_PI: f64 = 1.000_000_000_55e-7;

/// Nearer to a dipole than this its field is taken as there, m: no sensor sits inside a magnet.
const NEAREST_M: f64 = 0.05;

/// The strongest field that is taken, T: a hundred times the earth's, beyond the range of devices that
/// people wear.
const STRONGEST_T: f64 = 0.005;

/// Heading of the world's x axis where a file does not say it, degrees clockwise from true north: x is
/// east and y north, as REP-103 has them.
const X_AXIS_HEADING: f64 = 90.0;

/// The magnetic field by position in the world: that of the earth, the same everywhere, and what things
/// in the room add to it.
///
/// A dipole of moment m (A m2) adds at r (m) from it
/// ```text
/// B = mu_0 / (4 pi) (3 (m . r) r / |r|^2 - m) / |r|^3
/// ```
///
/// ```yaml
/// schema: cromosim/magnetic_field/1
/// place: {latitude: 52.52, longitude: 13.41, altitude: 34, date: 2026-11-24}   # or field_in_world: [0, 1.9e-5, -4.5e-5]
/// x_axis_heading: 90        # of the world's x axis, degrees clockwise from true north; 90: east (REP-103)
/// disturbances:
///   - {at: [0.5, 0.0, 0.7], moment: [0.0, 0.0, 2.0]}   # m in the world, A m2
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AmbientField {
    earth_in_world: Vector3<f64>,
    disturbances: Vec<Dipole>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Dipole {
    position_in_world: Vector3<f64>,
    moment_in_world: Vector3<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawField {
    schema: String,
    field_in_world: Option<[f64; 3]>,
    place: Option<RawPlace>,
    x_axis_heading: Option<f64>,
    #[serde(default)]
    disturbances: Vec<RawDipole>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlace {
    latitude: f64,
    longitude: f64,
    #[serde(default)]
    altitude: f64,
    date: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDipole {
    at: [f64; 3],
    moment: [f64; 3],
}

impl AmbientField {
    /// The same field everywhere, T in world axes.
    pub fn uniform(earth_in_world: Vector3<f64>) -> Self {
        Self {
            earth_in_world,
            disturbances: Vec::new(),
        }
    }

    /// The earth's field by the World Magnetic Model (WMM2020 or WMM2025, by the date): latitude and
    /// longitude in degrees (WGS 84), altitude above the ellipsoid in m, date as `YYYY-MM-DD`; and the
    /// heading of the world's x axis, degrees clockwise from true north.
    ///
    /// # Errors
    /// What is out of the model's range, in words.
    pub fn of_place(
        [latitude, longitude, altitude]: [f64; 3],
        date: &str,
        x_axis_heading: f64,
    ) -> Result<Self, String> {
        let day = parse_date(date).ok_or_else(|| {
            format!("date: `{date}`: expected a day as YYYY-MM-DD, such as 2026-06-30")
        })?;
        if !x_axis_heading.is_finite() {
            return Err(format!(
                "x_axis_heading: {x_axis_heading}: expected degrees clockwise from true north"
            ));
        }
        let angle = |degrees: f64| Angle::new::<degree>(degrees as f32);
        let height = Length::new::<meter>(altitude as f32);
        let model = GeomagneticField::new(height, angle(latitude), angle(longitude), day).map_err(
            |problem| format!("{latitude}, {longitude}, {altitude} m, {date}: {problem}"),
        )?;
        let north_east_down =
            [model.x(), model.y(), model.z()].map(|it| f64::from(it.get::<tesla>()));
        let [north, east, down] = north_east_down;
        let east_north_up = Vector3::new(east, north, -down);
        // Seen from above the x axis is turned by 90 degrees less its heading against east.
        let turn = (90.0 - x_axis_heading).to_radians();
        let world_from_east_north_up = Rotation3::from_axis_angle(&Vector3::z_axis(), -turn);
        Ok(Self::uniform(world_from_east_north_up * east_north_up))
    }

    /// What a parameter or an option says: a YAML file, a vector as `X,Y,Z` (T, world axes), or a place and
    /// a day as `52.52N,13.41E,2026-11-24`, in a world whose x axis is east.
    ///
    /// # Errors
    /// [`ImuError::Field`] with what was expected; as [`AmbientField::parse`].
    pub fn resolve(text: &str) -> Result<Self, ImuError> {
        if text.ends_with(".yaml") || text.ends_with(".yml") {
            let path = Path::new(text);
            let content =
                cromosim_spatial::read_text(path).map_err(|source| ImuError::Unreadable {
                    file: path.to_owned(),
                    source,
                })?;
            return Self::parse(&content, text);
        }
        let refuse = |problem: String| ImuError::Field {
            from: text.to_owned(),
            problem,
        };
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let [first, second, third] = parts[..] else {
            return Err(refuse(EXPECTED.to_owned()));
        };
        if let (Some(latitude), Some(longitude)) =
            (degrees(first, ['N', 'S']), degrees(second, ['E', 'W']))
        {
            return Self::of_place([latitude, longitude, 0.0], third, X_AXIS_HEADING)
                .map_err(refuse);
        }
        let numbers = [first, second, third].map(str::parse::<f64>);
        let [Ok(x), Ok(y), Ok(z)] = numbers else {
            return Err(refuse(EXPECTED.to_owned()));
        };
        let field = Vector3::new(x, y, z);
        check_strength(&field).map_err(refuse)?;
        Ok(Self::uniform(field))
    }

    /// Parses a file's text; `file` names it in errors.
    ///
    /// # Errors
    /// [`ImuError::Yaml`], [`ImuError::Schema`], [`ImuError::Field`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ImuError> {
        let raw: RawField = serde_norway::from_str(text).map_err(|error| ImuError::Yaml {
            file: file.to_owned(),
            problem: in_plain_words(error),
        })?;
        if raw.schema != SCHEMA {
            return Err(ImuError::Schema {
                file: file.to_owned(),
                expected: SCHEMA,
                found: raw.schema,
            });
        }
        raw.build().map_err(|problem| ImuError::Field {
            from: file.to_owned(),
            problem,
        })
    }

    /// At a point of the world (m), T in world axes.
    pub fn at(&self, position_in_world: &Vector3<f64>) -> Vector3<f64> {
        let added = |dipole: &Dipole| dipole.at(position_in_world);
        self.earth_in_world + self.disturbances.iter().map(added).sum::<Vector3<f64>>()
    }

    /// The earth's part, T in world axes.
    pub fn earth_in_world(&self) -> Vector3<f64> {
        self.earth_in_world
    }
}

const EXPECTED: &str = "expected a vector in T and world axes as 0,1.9e-5,-4.5e-5, a place and a day as 52.52N,13.41E,2026-11-24, or a .yaml file";

impl RawField {
    fn build(self) -> Result<AmbientField, String> {
        let field = match (self.field_in_world, self.place) {
            (Some(field), None) => {
                if self.x_axis_heading.is_some() {
                    return Err("x_axis_heading goes with place; field_in_world is in world axes already: take it out".to_owned());
                }
                AmbientField::uniform(field.into())
            }
            (None, Some(place)) => AmbientField::of_place(
                [place.latitude, place.longitude, place.altitude],
                &place.date,
                self.x_axis_heading.unwrap_or(X_AXIS_HEADING),
            )?,
            _ => return Err("expected one of field_in_world and place".to_owned()),
        };
        check_strength(&field.earth_in_world)?;
        let disturbances = self.disturbances.iter().enumerate().map(|(number, raw)| {
            let dipole = Dipole {
                position_in_world: raw.at.into(),
                moment_in_world: raw.moment.into(),
            };
            let values = raw.at.iter().chain(&raw.moment);
            if values.clone().all(|value| value.is_finite()) {
                Ok(dipole)
            } else {
                Err(format!(
                    "disturbances, entry {}: a value is not finite",
                    number + 1
                ))
            }
        });
        Ok(AmbientField {
            disturbances: disturbances.collect::<Result<_, _>>()?,
            ..field
        })
    }
}

impl Dipole {
    fn at(&self, position_in_world: &Vector3<f64>) -> Vector3<f64> {
        let from_dipole = position_in_world - self.position_in_world;
        let distance = from_dipole.norm();
        // In the middle of a magnet every direction is as good.
        let direction = from_dipole.try_normalize(1e-9).unwrap_or(Vector3::z());
        let along = direction * self.moment_in_world.dot(&direction);
        (along * 3.0 - self.moment_in_world) * (MU_0_OVER_4_PI / distance.max(NEAREST_M).powi(3))
    }
}

fn check_strength(field: &Vector3<f64>) -> Result<(), String> {
    let strength = field.norm();
    if strength.is_finite() && strength <= STRONGEST_T {
        return Ok(());
    }
    Err(format!(
        "a field of {strength} T; the earth's is 2e-5 to 7e-5 T: expected tesla (1 uT is 1e-6 T, 1 G is 1e-4 T)"
    ))
}

/// `52.5N` or `13.4W` in degrees; the second letter is the negative side.
fn degrees(text: &str, [positive, negative]: [char; 2]) -> Option<f64> {
    let side = text.chars().last()?.to_ascii_uppercase();
    let sign = match side {
        _ if side == positive => 1.0,
        _ if side == negative => -1.0,
        _ => return None,
    };
    let value: f64 = text[..text.len() - 1].trim().parse().ok()?;
    (value >= 0.0).then_some(sign * value)
}

fn parse_date(text: &str) -> Option<Date> {
    let mut parts = text.splitn(3, '-');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    let month = Month::try_from(month.parse::<u8>().ok()?).ok()?;
    Date::from_calendar_date(year.parse().ok()?, month, day.parse().ok()?).ok()
}

#[cfg(test)]
#[path = "field_tests.rs"]
mod tests;
