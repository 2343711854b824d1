//! A pinhole camera: points to pixels and back, and how errors travel.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector2, Vector3};

/// Which way the camera's axes point in the source's matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraAxes {
    /// x right, y down, z forward: OpenCV, COLMAP, and all that is computed here.
    OpenCv,
    /// x right, y up, z backward: OpenGL, and Robust CVD's own cameras.
    OpenGl,
}

impl CameraAxes {
    /// world_from_camera with axes after OpenCV, from one with these axes.
    pub fn to_open_cv(self, world_from_camera: Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::OpenCv => world_from_camera,
            Self::OpenGl => {
                world_from_camera
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
            }
        }
    }
}

/// The camera of one frame. Axes: x right, y down, z forward. Pixels as in [`crate::Keypoint`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Focal lengths along u and v, px.
    pub focal_px: Vector2<f64>,
    /// Where the optical axis meets the image, px.
    pub principal_point_px: Vector2<f64>,
    /// Width and height of the image that the two above are for, px.
    pub image_px: Vector2<f64>,
    /// Where the camera is; lengths in the unit of the reconstruction.
    pub world_from_camera: Isometry3<f64>,
}

impl Camera {
    /// A camera with its principal point in the middle of the image.
    pub fn centred(
        focal_px: Vector2<f64>,
        image_px: Vector2<f64>,
        world_from_camera: Isometry3<f64>,
    ) -> Self {
        Self {
            focal_px,
            principal_point_px: image_px / 2.0,
            image_px,
            world_from_camera,
        }
    }

    /// The same camera for its image at another size.
    #[must_use]
    pub fn resized(&self, image_px: Vector2<f64>) -> Self {
        let ratio = image_px.component_div(&self.image_px);
        Self {
            focal_px: self.focal_px.component_mul(&ratio),
            principal_point_px: self.principal_point_px.component_mul(&ratio),
            image_px,
            ..*self
        }
    }

    /// Lengths of the reconstruction times `scale`: the camera's position in metres.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        let Isometry3 {
            rotation,
            translation,
        } = self.world_from_camera;
        Self {
            world_from_camera: Isometry3::from_parts(
                Translation3::from(translation.vector * scale),
                rotation,
            ),
            ..*self
        }
    }

    /// K^-1 (u, v, 1): the ray of a pixel in camera axes, with z = 1.
    pub fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        (pixel - self.principal_point_px)
            .component_div(&self.focal_px)
            .push(1.0)
    }

    /// X_c = d K^-1 (u, v, 1): the point at `depth` along the optical axis, in camera axes.
    pub fn back_project(&self, pixel: Vector2<f64>, depth: f64) -> Vector3<f64> {
        depth * self.ray(pixel)
    }

    /// Pixel of a point in camera axes; `None` behind the camera.
    pub fn project(&self, in_camera: &Vector3<f64>) -> Option<Vector2<f64>> {
        (in_camera.z > 0.0).then(|| {
            in_camera.xy().component_mul(&self.focal_px) / in_camera.z + self.principal_point_px
        })
    }

    /// Covariance of a back-projected point in camera axes, m2: J diag(s_u^2, s_v^2, s_d^2) J^T
    /// with the columns of J = dX_c/d(u, v, d) being (d/f_x, 0, 0), (0, d/f_y, 0) and the ray. Also
    /// returns the part of pixels and the part of depth, which sum to it.
    pub fn back_projection_covariance(
        &self,
        pixel: Vector2<f64>,
        depth: f64,
        pixel_std: f64,
        depth_std: f64,
    ) -> [Matrix3<f64>; 2] {
        let across = Vector2::repeat(depth * pixel_std).component_div(&self.focal_px);
        let along = self.ray(pixel) * depth_std;
        [
            Matrix3::from_diagonal(&across.component_mul(&across).push(0.0)),
            along * along.transpose(),
        ]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn projection_undoes_back_projection_at_every_image_size() {
        let camera = Camera::centred(
            Vector2::new(1500.0, 1480.0),
            Vector2::new(1920.0, 1080.0),
            Isometry3::identity(),
        );
        let pixel = Vector2::new(1203.0, 222.0);
        let point = camera.back_project(pixel, 3.7);
        assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-9);
        let small = camera.resized(Vector2::new(384.0, 216.0));
        assert!((small.project(&point).unwrap() - pixel / 5.0).norm() < 1e-9);
        assert_eq!(camera.project(&-point), None);
    }

    #[test]
    fn the_covariance_is_that_of_finite_differences() {
        let camera = Camera::centred(
            Vector2::new(1500.0, 1480.0),
            Vector2::new(1920.0, 1080.0),
            Isometry3::identity(),
        );
        let (pixel, depth, pixel_std, depth_std) = (Vector2::new(1203.0, 222.0), 3.7, 7.0, 0.2);
        let step = 1e-4;
        let column = |du: f64, dv: f64, dd: f64| {
            let moved = camera.back_project(pixel + Vector2::new(du, dv) * step, depth + dd * step);
            (moved - camera.back_project(pixel, depth)) / step
        };
        let columns = [
            column(1.0, 0.0, 0.0) * pixel_std,
            column(0.0, 1.0, 0.0) * pixel_std,
            column(0.0, 0.0, 1.0) * depth_std,
        ];
        let expected: Matrix3<f64> = columns
            .iter()
            .map(|column| column * column.transpose())
            .sum();
        let [of_pixels, of_depth] =
            camera.back_projection_covariance(pixel, depth, pixel_std, depth_std);
        assert!((of_pixels + of_depth - expected).norm() < 1e-6);
    }

    #[test]
    fn axes_of_opengl_turn_about_x() {
        let open_cv = CameraAxes::OpenGl.to_open_cv(Isometry3::identity());
        // OpenGL looks along -z, y up.
        assert!((open_cv.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
        assert!((open_cv.rotation * Vector3::y() + Vector3::y()).norm() < 1e-12);
        assert!((open_cv.rotation * Vector3::x() - Vector3::x()).norm() < 1e-12);
    }
}
