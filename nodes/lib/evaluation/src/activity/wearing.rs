//! Where virtual devices sit for a data set's placement, and how they are turned there.

use cromosim_body::Joint;
use cromosim_imu::normal_pair;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

/// Where people wear a device that a data set calls by one placement's name, and how.
pub(crate) struct DeviceWearing {
    /// The data set's name of the placement.
    pub placement: &'static str,
    /// Sites of the skin, and the joint nearest to each; one is drawn.
    pub sites: &'static [(&'static str, Joint)],
    orientation: DeviceOrientation,
}

/// How a device may lie on the skin; the site's x axis points along the bone away from the trunk, z
/// outward.
#[derive(Clone, Copy)]
enum DeviceOrientation {
    /// A phone along the thigh: screen outward or inward, its top up or down.
    Phone,
    /// A watch on the left wrist, screen outward, its right towards the hand.
    Watch,
    /// Face out or in, turned by any quarter about the normal.
    Any,
}

/// Standard deviation of a phone's turn about the thigh, rad: 25 degrees.
const PHONE_ABOUT_THIGH: f64 = 0.44;
/// Standard deviation of a phone's turn in the pocket's plane, rad: 15 degrees.
const PHONE_IN_PLANE: f64 = 0.26;
/// Standard deviation of every other turn, about each axis, rad: 10 degrees.
const OTHER_TURN: f64 = 0.17;

const KNOWN: [DeviceWearing; 10] = [
    DeviceWearing {
        placement: "pocket",
        sites: &[
            ("left_pocket", Joint::LeftHip),
            ("right_pocket", Joint::RightHip),
            ("left_pocket_side", Joint::LeftHip),
            ("right_pocket_side", Joint::RightHip),
        ],
        orientation: DeviceOrientation::Phone,
    },
    DeviceWearing {
        placement: "wrist",
        sites: &[("left_watch", Joint::LeftWrist)],
        orientation: DeviceOrientation::Watch,
    },
    DeviceWearing {
        placement: "hand",
        sites: &[("right_wrist", Joint::RightWrist)],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "chest",
        sites: &[("sternum", Joint::Spine3)],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "ankle",
        sites: &[
            ("left_ankle_lateral", Joint::LeftAnkle),
            ("right_ankle_lateral", Joint::RightAnkle),
        ],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "thigh",
        sites: &[
            ("left_thigh_front", Joint::LeftKnee),
            ("right_thigh_front", Joint::RightKnee),
        ],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "forearm",
        sites: &[
            ("left_forearm", Joint::LeftElbow),
            ("right_forearm", Joint::RightElbow),
        ],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "head",
        sites: &[("head_back", Joint::Head)],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "shin",
        sites: &[
            ("left_shank_front", Joint::LeftKnee),
            ("right_shank_front", Joint::RightKnee),
        ],
        orientation: DeviceOrientation::Any,
    },
    DeviceWearing {
        placement: "waist",
        sites: &[("belt_front", Joint::Pelvis)],
        orientation: DeviceOrientation::Any,
    },
];

/// A device on a drawn person.
pub(crate) struct WornDevice {
    /// The site's name.
    pub site: &'static str,
    /// The joint nearest to the site.
    pub joint: Joint,
    /// site_from_sensor.
    pub mount: UnitQuaternion<f64>,
}

impl DeviceWearing {
    /// How a placement's devices are worn; none for an unknown placement.
    pub fn for_placement(placement: &str) -> Option<&'static Self> {
        KNOWN.iter().find(|wearing| wearing.placement == placement)
    }

    /// Of each placement that is known.
    pub fn for_placements(placements: &[String]) -> Vec<&'static Self> {
        placements
            .iter()
            .filter_map(|name| Self::for_placement(name))
            .collect()
    }

    /// The names of all placements, separated by commas.
    pub fn known_placements() -> String {
        KNOWN.each_ref().map(|wearing| wearing.placement).join(", ")
    }

    /// How a drawn person wears it.
    pub fn draw(&self, random: &mut ChaCha12Rng) -> WornDevice {
        let (site, joint) = self.sites[random.random_range(0..self.sites.len())];
        let [first, second] = normal_pair(random);
        let [third, _] = normal_pair(random);
        let (lying, turn) = match self.orientation {
            DeviceOrientation::Phone => {
                let (screen, top) = (sign(random), sign(random));
                // The phone's y axis, to its top, lies along the thigh, z out of its screen.
                let turn = Vector3::new(
                    0.5 * OTHER_TURN * first,
                    PHONE_ABOUT_THIGH * second,
                    PHONE_IN_PLANE * third,
                );
                (from_axes(Vector3::x() * top, Vector3::z() * screen), turn)
            }
            DeviceOrientation::Watch => (
                UnitQuaternion::identity(),
                OTHER_TURN * Vector3::new(first, second, third),
            ),
            DeviceOrientation::Any => {
                let quarter = std::f64::consts::FRAC_PI_2 * f64::from(random.random_range(0..4_u8));
                let y = Vector3::new(-quarter.sin(), quarter.cos(), 0.0);
                (
                    from_axes(y, Vector3::z() * sign(random)),
                    OTHER_TURN * Vector3::new(first, second, third),
                )
            }
        };
        WornDevice {
            site,
            joint,
            mount: lying * UnitQuaternion::from_scaled_axis(turn),
        }
    }

    /// From one drawn way of wearing it to another: other_sensor_from_sensor.
    pub fn draw_turn(&self, random: &mut ChaCha12Rng) -> UnitQuaternion<f64> {
        let [one, other] = [self.draw(random), self.draw(random)];
        other.mount.inverse() * one.mount
    }
}

fn sign(random: &mut ChaCha12Rng) -> f64 {
    if random.random::<bool>() { 1.0 } else { -1.0 }
}

/// The rotation that takes a device's y and z axes to these, which are at right angles.
fn from_axes(y: Vector3<f64>, z: Vector3<f64>) -> UnitQuaternion<f64> {
    let matrix = Matrix3::from_columns(&[y.cross(&z), y, z]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn every_site_is_on_the_body() {
        let model = BodyModel::embedded();
        for (site, _) in KNOWN.iter().flat_map(|wearing| wearing.sites) {
            assert!(model.site(site).is_ok(), "{site}");
        }
    }

    #[test]
    fn phones_lie_along_the_thigh_in_all_four_ways() {
        let (phone, mut random) = (
            DeviceWearing::for_placement("pocket").unwrap(),
            ChaCha12Rng::seed_from_u64(1),
        );
        let mut ways = [0; 4];
        for _ in 0..400 {
            let worn = phone.draw(&mut random);
            let (top, screen) = (worn.mount * Vector3::y(), worn.mount * Vector3::z());
            assert!(top.x.abs() > 0.6, "{top}");
            ways[usize::from(top.x > 0.0) + 2 * usize::from(screen.z > 0.0)] += 1;
        }
        assert!(
            ways.iter().all(|count| (60..140).contains(count)),
            "{ways:?}"
        );
    }

    #[test]
    fn a_watch_shows_its_face() {
        let (watch, mut random) = (
            DeviceWearing::for_placement("wrist").unwrap(),
            ChaCha12Rng::seed_from_u64(2),
        );
        assert!((0..100).all(|_| (watch.draw(&mut random).mount * Vector3::z()).z > 0.7));
        assert!((0..100).all(|_| (watch.draw_turn(&mut random) * Vector3::z()).z > 0.4));
        assert!(
            DeviceWearing::for_placement("nose").is_none()
                && DeviceWearing::known_placements().contains("pocket")
        );
    }
}
