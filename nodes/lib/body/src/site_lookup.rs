//! Sites of a body by name, by triangle and by the nearest point.

use cromosim_spatial::nearest_name;
use nalgebra::Vector3;

use crate::site::{Site, point_at};
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint, ShapedBody};

impl BodyModel {
    /// The names of the sites, sorted.
    pub fn site_names(&self) -> impl Iterator<Item = &str> {
        self.sites.iter().map(|named| named.name.as_str())
    }

    /// The site called `name`, such as `left_watch`. The embedded body has 68; on a body from a
    /// file they are carried over.
    ///
    /// # Errors
    /// [`BodyError::UnknownSite`] with the nearest name.
    pub fn site(&self, name: &str) -> Result<Site, BodyError> {
        if let Ok(index) = self
            .sites
            .binary_search_by(|named| named.name.as_str().cmp(name))
        {
            return Ok(self.sites[index].site);
        }
        let nearest = nearest_name(name, self.site_names())
            .unwrap_or("none")
            .to_owned();
        Err(BodyError::UnknownSite {
            body: self.id.clone(),
            name: name.to_owned(),
            nearest,
        })
    }

    /// The site at `barycentrics` of `triangle`. Barycentrics that sum to 1 within 1e-3 are scaled
    /// to do so exactly.
    ///
    /// # Errors
    /// [`BodyError::UnknownTriangle`], [`BodyError::Barycentrics`].
    pub fn site_at(&self, triangle: u32, barycentrics: [f64; 3]) -> Result<Site, BodyError> {
        let corners = self.corners(triangle)?;
        let sum: f64 = barycentrics.iter().sum();
        // Not `<`: it must also catch NaN.
        if !(barycentrics.iter().all(|weight| *weight >= -1e-6) && (sum - 1.0).abs() <= 1e-3) {
            return Err(BodyError::Barycentrics { barycentrics });
        }
        let clamped = barycentrics.map(|weight| weight.max(0.0));
        let sum: f64 = clamped.iter().sum();
        let barycentrics = clamped.map(|weight| weight / sum);
        Ok(Site {
            triangle,
            barycentrics,
            joint: self.owner(&corners, &barycentrics),
        })
    }

    /// The site nearest to `point` (model frame, T-pose, m) on the mean shape, so that the same
    /// point is the same place on everybody.
    ///
    /// # Errors
    /// [`BodyError::PointNotFinite`].
    pub fn nearest_site(&self, point: Vector3<f64>) -> Result<Site, BodyError> {
        let finite = point.iter().all(|coordinate| coordinate.is_finite());
        let site = if finite {
            nearest(self, &self.template, point, |_| true)
        } else {
            None
        };
        site.ok_or(BodyError::PointNotFinite {
            point: point.into(),
        })
    }

    /// How far `point` (model frame, T-pose, m) is from `site` on the mean shape, m.
    ///
    /// # Errors
    /// [`BodyError::UnknownTriangle`] for a site of another body.
    pub fn distance_to_site(&self, point: Vector3<f64>, site: &Site) -> Result<f64, BodyError> {
        let corners = self.corners(site.triangle)?;
        Ok((point_at(&corners, &site.barycentrics, &self.template) - point).norm())
    }

    /// The vertices of `site`'s triangle, counter-clockwise seen from outside.
    ///
    /// # Errors
    /// [`BodyError::UnknownTriangle`] for a site of another body.
    pub fn triangle(&self, site: &Site) -> Result<[u32; 3], BodyError> {
        self.corners(site.triangle)
    }

    fn corners(&self, triangle: u32) -> Result<[u32; 3], BodyError> {
        let unknown = || BodyError::UnknownTriangle {
            body: self.id.clone(),
            triangle,
            triangle_count: self.faces.len(),
        };
        self.faces
            .get(triangle as usize)
            .copied()
            .ok_or_else(unknown)
    }

    fn owner(&self, corners: &[u32; 3], barycentrics: &[f64; 3]) -> Joint {
        let mut sums = [0.0; JOINT_COUNT];
        for (&vertex, share) in corners.iter().zip(barycentrics) {
            for &(joint, weight) in self.skin_weights.row(vertex as usize) {
                sums[joint as usize] += weight * share;
            }
        }
        // The first of equals, so that the answer does not hang on the order of evaluation.
        Joint::ALL
            .into_iter()
            .rev()
            .max_by(|a, b| sums[a.index()].total_cmp(&sums[b.index()]))
            .unwrap_or(Joint::Pelvis)
    }

    pub(crate) fn triangle_owners(&self) -> Vec<Joint> {
        self.faces
            .iter()
            .map(|corners| self.owner(corners, &[1.0 / 3.0; 3]))
            .collect()
    }
}

impl ShapedBody {
    /// Where `site` is on the rest mesh, m, model frame.
    ///
    /// # Errors
    /// [`BodyError::UnknownTriangle`] for a site of another body.
    pub fn site_in_model(&self, site: &Site) -> Result<Vector3<f64>, BodyError> {
        Ok(point_at(
            &self.model().triangle(site)?,
            &site.barycentrics,
            self.rest_vertices(),
        ))
    }

    /// The outward unit normal of `site`'s triangle on the rest mesh, model frame; zero for a
    /// triangle without area.
    ///
    /// # Errors
    /// [`BodyError::UnknownTriangle`] for a site of another body.
    pub fn site_normal_in_model(&self, site: &Site) -> Result<Vector3<f64>, BodyError> {
        let [a, b, c] = self
            .model()
            .triangle(site)?
            .map(|vertex| self.rest_vertices()[vertex as usize]);
        Ok((b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros))
    }

    /// The site nearest to `point` (m, model frame) on this person's rest mesh.
    ///
    /// # Errors
    /// [`BodyError::PointNotFinite`].
    pub fn nearest_site(&self, point: Vector3<f64>) -> Result<Site, BodyError> {
        let finite = point.iter().all(|coordinate| coordinate.is_finite());
        let site = if finite {
            nearest(self.model(), self.rest_vertices(), point, |_| true)
        } else {
            None
        };
        site.ok_or(BodyError::PointNotFinite {
            point: point.into(),
        })
    }
}

/// The nearest point on the triangles that `allowed` lets pass; the first of equals.
pub(crate) fn nearest(
    body: &BodyModel,
    vertices: &[Vector3<f64>],
    point: Vector3<f64>,
    allowed: impl Fn(usize) -> bool,
) -> Option<Site> {
    let mut best: Option<(f64, usize, [f64; 3])> = None;
    for (triangle, corners) in body
        .faces
        .iter()
        .enumerate()
        .filter(|(triangle, _)| allowed(*triangle))
    {
        let barycentrics =
            nearest_barycentrics(point, corners.map(|vertex| vertices[vertex as usize]));
        let distance = (point_at(corners, &barycentrics, vertices) - point).norm_squared();
        if best.is_none_or(|(least, ..)| distance < least) {
            best = Some((distance, triangle, barycentrics));
        }
    }
    let (_, triangle, barycentrics) = best?;
    Some(Site {
        triangle: triangle as u32,
        barycentrics,
        joint: body.owner(&body.faces[triangle], &barycentrics),
    })
}

/// Barycentrics of the triangle's point nearest to `point`: the foot of the perpendicular if it
/// lies inside, else the nearest point of the three edges.
fn nearest_barycentrics(point: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> [f64; 3] {
    let area_vector = (b - a).cross(&(c - a));
    let double_area_squared = area_vector.norm_squared();
    if double_area_squared > 0.0 {
        let share = |from: Vector3<f64>, to: Vector3<f64>| {
            (to - from).cross(&(point - from)).dot(&area_vector) / double_area_squared
        };
        let inside = [share(b, c), share(c, a), share(a, b)];
        if inside.iter().all(|weight| *weight >= 0.0) {
            return inside;
        }
    }
    let on_edge = |from: Vector3<f64>, to: Vector3<f64>| {
        let edge = to - from;
        let length_squared = edge.norm_squared();
        let along = if length_squared > 0.0 {
            ((point - from).dot(&edge) / length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        ((from + edge * along - point).norm_squared(), along)
    };
    let (ab, bc, ca) = (on_edge(a, b), on_edge(b, c), on_edge(c, a));
    if ab.0 <= bc.0 && ab.0 <= ca.0 {
        [1.0 - ab.1, ab.1, 0.0]
    } else if bc.0 <= ca.0 {
        [0.0, 1.0 - bc.1, bc.1]
    } else {
        [ca.1, 0.0, 1.0 - ca.1]
    }
}
