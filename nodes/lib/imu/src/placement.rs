//! Where a sensor sits: configured intent.

use cromosim_spatial::plausible::MOUNT_ANGLE;
use cromosim_spatial::so3;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{PlacementProblem, Scheme};

/// What a sensor's frame is fixed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Follow {
    /// To the triangle of the skin under it: it moves and turns with the soft tissue that the body
    /// model shows.
    #[default]
    Skin,
    /// To the segment, rigidly, where the site is at rest.
    Segment,
}

/// How a site is chosen.
#[derive(Clone, Debug, PartialEq)]
pub enum SiteChoice {
    /// By the body's name for it.
    Named(String),
    /// By triangle and barycentrics (sum 1).
    Triangle {
        /// Index into the body's faces.
        triangle: u32,
        /// Weights of its corners.
        barycentrics: [f64; 3],
    },
    /// By the skin nearest to a point of the mean body in T-pose, m, model frame (x left, y up, z
    /// forward).
    NearestTo(Vector3<f64>),
}

/// No IMU is read faster, Hz; higher rates are typing errors that would fill the memory.
pub const MAX_RATE_HZ: f64 = 1e5;

/// One sensor on a body; parsed, so valid: the name can stand in a ROS topic, the rate is positive,
/// the mount is a rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    pub(crate) name: String,
    pub(crate) site: SiteChoice,
    pub(crate) mount: UnitQuaternion<f64>,
    pub(crate) skin_distance: f64,
    pub(crate) follow: Follow,
    pub(crate) rate_hz: f64,
    pub(crate) scheme: Scheme,
    pub(crate) device: Option<String>,
}

impl Placement {
    /// A placement at a named site with the defaults: mounted as the site's frame, on the skin and
    /// following it, without noise.
    ///
    /// # Errors
    /// [`PlacementProblem`] for a name that is no ROS name, or a rate that is not positive; with
    /// the field's name.
    pub fn at_site(
        name: &str,
        site: &str,
        rate_hz: f64,
    ) -> Result<Self, (&'static str, PlacementProblem)> {
        RawPlacement {
            name: Some(name.to_owned()),
            site: Some(site.to_owned()),
            rate_hz: Some(rate_hz),
            ..RawPlacement::default()
        }
        .parse(&RawDefaults::default())
    }

    /// Name: of the topic `imu/NAME/data_raw` and the frame `NAME_imu`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The site.
    pub fn site(&self) -> &SiteChoice {
        &self.site
    }

    /// The mount, `site_from_sensor`: R_SB of the paper turns sensor axes into site axes. On a body
    /// of one shape it becomes [`crate::MountedSensor::segment_from_sensor`].
    pub fn mount(&self) -> UnitQuaternion<f64> {
        self.mount
    }

    /// Distance of the sensor from the skin along the outward normal, m.
    pub fn skin_distance(&self) -> f64 {
        self.skin_distance
    }

    /// What the frame is fixed to.
    pub fn follow(&self) -> Follow {
        self.follow
    }

    /// Output rate, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// How it is differentiated.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// The device, see [`crate::Device::resolve`]; `None` reads without error.
    pub fn device(&self) -> Option<&str> {
        self.device.as_deref()
    }

    /// The same placement read at another rate; the caller vouches that it is positive.
    #[must_use]
    pub fn with_rate_hz(self, rate_hz: f64) -> Self {
        Self { rate_hz, ..self }
    }

    /// The same placement turned otherwise: site_from_sensor.
    #[must_use]
    pub fn with_mount(self, mount: UnitQuaternion<f64>) -> Self {
        Self { mount, ..self }
    }

    /// The same placement with another device, see [`crate::Device::resolve`].
    #[must_use]
    pub fn with_device(self, device: &str) -> Self {
        Self {
            device: Some(device.to_owned()),
            ..self
        }
    }

    /// The same placement by another scheme.
    #[must_use]
    pub fn with_scheme(self, scheme: Scheme) -> Self {
        Self { scheme, ..self }
    }
}

/// A placement as a file has it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawPlacement {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub site: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangle: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub barycentrics: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mount: Option<RawRotation>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin_distance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follow: Option<Follow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scheme: Option<Scheme>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
}

/// Values for all placements of a file that do not say otherwise.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawDefaults {
    pub follow: Option<Follow>,
    pub rate_hz: Option<f64>,
    pub scheme: Option<Scheme>,
    pub device: Option<String>,
}

/// A rotation in one of three forms.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawRotation {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotvec: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quaternion_xyzw: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
}

/// How far a matrix in a file, written with a few digits, may be from a rotation.
const ROTATION_TOLERANCE: f64 = 1e-3;

type Field<T> = Result<T, (&'static str, PlacementProblem)>;

impl RawPlacement {
    /// Parses the placement; errors say which field.
    pub(crate) fn parse(self, defaults: &RawDefaults) -> Field<Placement> {
        let site = self.parse_site()?;
        let name = self.name.unwrap_or_default();
        if !is_ros_name(&name) {
            return Err(("name", PlacementProblem::BadName { name }));
        }
        let rate_hz = self
            .rate_hz
            .or(defaults.rate_hz)
            .ok_or(("rate_hz", PlacementProblem::Missing))?;
        if !(rate_hz > 0.0 && rate_hz <= MAX_RATE_HZ) {
            return Err((
                "rate_hz",
                PlacementProblem::OutOfRange {
                    value: rate_hz,
                    range: "it must be positive, at most 100000",
                },
            ));
        }
        let skin_distance = self.skin_distance.unwrap_or(0.0);
        if !(-0.2..=0.2).contains(&skin_distance) {
            return Err((
                "skin_distance",
                PlacementProblem::OutOfRange {
                    value: skin_distance,
                    range: "metres, from -0.2 to 0.2",
                },
            ));
        }
        Ok(Placement {
            name,
            site,
            mount: self
                .mount
                .map_or(Ok(UnitQuaternion::identity()), RawRotation::parse)?,
            skin_distance,
            follow: self.follow.or(defaults.follow).unwrap_or_default(),
            rate_hz,
            scheme: self.scheme.or(defaults.scheme).unwrap_or_default(),
            device: self.device.or_else(|| defaults.device.clone()),
        })
    }

    fn parse_site(&self) -> Field<SiteChoice> {
        let by_triangle = self.triangle.is_some() || self.barycentrics.is_some();
        let given = usize::from(self.site.is_some())
            + usize::from(by_triangle)
            + usize::from(self.point.is_some());
        match (&self.site, self.triangle, self.barycentrics, self.point) {
            _ if given != 1 => Err(("site", PlacementProblem::OneSite { given })),
            (Some(name), ..) => Ok(SiteChoice::Named(name.clone())),
            (_, _, _, Some(point)) => match point.iter().find(|x| !x.is_finite()) {
                Some(&value) => Err((
                    "point",
                    PlacementProblem::OutOfRange {
                        value,
                        range: "metres, finite",
                    },
                )),
                None => Ok(SiteChoice::NearestTo(point.into())),
            },
            (_, Some(triangle), Some(barycentrics), _) => Ok(SiteChoice::Triangle {
                triangle,
                barycentrics,
            }),
            (_, None, ..) => Err(("triangle", PlacementProblem::Missing)),
            (_, _, None, _) => Err(("barycentrics", PlacementProblem::Missing)),
        }
    }
}

impl RawRotation {
    fn parse(self) -> Field<UnitQuaternion<f64>> {
        let given = [
            self.rotvec.is_some(),
            self.quaternion_xyzw.is_some(),
            self.matrix.is_some(),
        ]
        .into_iter()
        .filter(|g| *g)
        .count();
        if given != 1 {
            return Err(("mount", PlacementProblem::OneRotation { given }));
        }
        if let Some(matrix) = self.matrix {
            let matrix = Matrix3::from_fn(|row, column| matrix[row][column]);
            return so3::rotation_from_matrix(&matrix, ROTATION_TOLERANCE)
                .map_err(|error| ("mount.matrix", PlacementProblem::NotARotation(error)));
        }
        if let Some([x, y, z, w]) = self.quaternion_xyzw {
            let quaternion = Quaternion::new(w, x, y, z);
            let norm = quaternion.norm();
            if norm.is_nan() || (norm - 1.0).abs() > ROTATION_TOLERANCE {
                return Err((
                    "mount.quaternion_xyzw",
                    PlacementProblem::OutOfRange {
                        value: norm,
                        range: "the norm must be 1",
                    },
                ));
            }
            return Ok(UnitQuaternion::new_normalize(quaternion));
        }
        let rotvec = Vector3::from(self.rotvec.unwrap_or_default());
        if !rotvec.norm().is_finite() {
            return Err((
                "mount.rotvec",
                PlacementProblem::OutOfRange {
                    value: rotvec.norm(),
                    range: "radians, finite",
                },
            ));
        }
        match MOUNT_ANGLE.judge(rotvec.norm(), "") {
            Some(oddity) => Err(("mount.rotvec", PlacementProblem::Impossible(oddity))),
            None => Ok(so3::exp(&rotvec)),
        }
    }
}

impl From<&Placement> for RawPlacement {
    fn from(placement: &Placement) -> Self {
        let mut raw = Self {
            mount: Some(RawRotation {
                quaternion_xyzw: Some(placement.mount.coords.into()),
                ..RawRotation::default()
            }),
            skin_distance: Some(placement.skin_distance),
            follow: Some(placement.follow),
            rate_hz: Some(placement.rate_hz),
            scheme: Some(placement.scheme),
            device: placement.device.clone(),
            ..Self::default()
        };
        match &placement.site {
            SiteChoice::Named(name) => raw.site = Some(name.clone()),
            SiteChoice::Triangle {
                triangle,
                barycentrics,
            } => (raw.triangle, raw.barycentrics) = (Some(*triangle), Some(*barycentrics)),
            SiteChoice::NearestTo(point) => raw.point = Some((*point).into()),
        }
        raw
    }
}

/// A token of a ROS 2 topic name: letters, digits and single underscores, not starting with a
/// digit.
fn is_ros_name(name: &str) -> bool {
    let starts_well = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    starts_well
        && !name.contains("__")
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
