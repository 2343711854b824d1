//! Three triangles of the skin around a site.

use cromosim_body::{BodyPose, ShapedBody, Site, VertexSubset};
use nalgebra::{Isometry3, Vector3};

use crate::LearnedError;

/// Points of a patch: three triangles of three corners.
pub const PATCH_POINTS: usize = 9;

/// Triangles whose normals differ by more than this (cosine) from the site's lie on another side of
/// the limb.
const SAME_SIDE: f64 = 0.5;
/// Half the edge of the patch that stands for the skin on a rigid body, m.
const RIGID_HALF_WIDTH: f64 = 0.03;

/// The site's triangle and the two nearest that share no corner with it or each other, on the same
/// side of the limb where there are such.
#[derive(Clone, Debug)]
pub struct Patch {
    subset: VertexSubset,
}

impl Patch {
    /// The patch around a site.
    ///
    /// # Errors
    /// [`LearnedError::Body`] for a site of another body, [`LearnedError::NoPatch`] for a mesh of
    /// too few triangles.
    pub fn new(body: &ShapedBody, site: &Site) -> Result<Self, LearnedError> {
        let own = body.model().triangle(site)?;
        let centre = body.site_in_model(site)?;
        let normal = body.site_normal_in_model(site)?;
        let rest = body.rest_vertices();
        let corners = |face: &[u32; 3]| face.map(|vertex| rest[vertex as usize]);
        let mut faces: Vec<(f64, [u32; 3])> = body
            .model()
            .faces()
            .iter()
            .map(|face| {
                let [a, b, c] = corners(face);
                let side = (b - a)
                    .cross(&(c - a))
                    .try_normalize(0.0)
                    .map_or(0.0, |other| other.dot(&normal));
                let far = if side < SAME_SIDE { 1e3 } else { 0.0 };
                (((a + b + c) / 3.0 - centre).norm() + far, *face)
            })
            .collect();
        // Stable: of equals the first.
        faces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut chosen = own.to_vec();
        for (_, face) in faces {
            if chosen.len() < PATCH_POINTS && face.iter().all(|vertex| !chosen.contains(vertex)) {
                chosen.extend(face);
            }
        }
        if chosen.len() < PATCH_POINTS {
            return Err(LearnedError::NoPatch {
                body: body.model().id().to_owned(),
                triangle: site.triangle,
            });
        }
        Ok(Self {
            subset: body.subset(&chosen)?,
        })
    }

    /// The nine corners' vertices.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.subset.vertices()
    }

    /// The nine points for one pose, m, world.
    pub fn points(&self, pose: &BodyPose) -> [Vector3<f64>; PATCH_POINTS] {
        let positions = self.subset.positions(pose);
        std::array::from_fn(|point| positions[point])
    }

    /// Nine points that stand for the skin under a sensor on a rigid body: corners of three
    /// triangles in its xy plane.
    pub fn rigid(world_from_sensor: &Isometry3<f64>) -> [Vector3<f64>; PATCH_POINTS] {
        let h = RIGID_HALF_WIDTH;
        let corner = |x: f64, y: f64| world_from_sensor * nalgebra::Point3::new(x * h, y * h, 0.0);
        [
            (0.4, 0.0),
            (-0.2, 0.35),
            (-0.2, -0.35),
            (1.0, 0.0),
            (1.0, 1.0),
            (0.3, 1.0),
            (-1.0, 0.0),
            (-1.0, -1.0),
            (-0.3, -1.0),
        ]
        .map(|(x, y)| corner(x, y).coords)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;

    use super::*;

    #[test]
    fn a_patch_lies_around_its_site_on_every_named_site() {
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let pose = BodyPose::rest(Vector3::zeros());
        let shift = body.joints_in_model()[0];
        for name in body.model().site_names() {
            let site = body.model().site(name).unwrap();
            let patch = Patch::new(&body, &site).unwrap();
            let points = patch.points(&pose);
            let centre = body.site_in_model(&site).unwrap() - shift;
            let farthest = points
                .iter()
                .map(|point| (point - centre).norm())
                .fold(0.0, f64::max);
            assert!(farthest < 0.12, "{name}: {farthest:.3} m away");
            for (index, point) in points.iter().enumerate() {
                assert!(
                    points[..index]
                        .iter()
                        .all(|other| (other - point).norm() > 1e-4),
                    "{name}: a point stands twice"
                );
            }
        }
    }

    #[test]
    fn a_rigid_patch_moves_with_its_body() {
        let moved = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, -0.4, 0.9));
        let at_rest = Patch::rigid(&Isometry3::identity());
        for (before, after) in at_rest.iter().zip(Patch::rigid(&moved)) {
            approx_eq(moved * nalgebra::Point3::from(*before), after.into());
        }
    }

    fn approx_eq(a: nalgebra::Point3<f64>, b: nalgebra::Point3<f64>) {
        assert!((a - b).norm() < 1e-12);
    }
}
