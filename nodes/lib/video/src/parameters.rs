//! Camera parameters of one frame: `frame_NNNNNN.npz`.

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Limits, NpzReader};
use cromosim_spatial::so3;
use nalgebra::{Isometry3, Matrix3, Vector2, Vector3};

use crate::error::VideoError;
use crate::pinhole::{Camera, CameraAxes};

/// Names under which tools write the intrinsics.
const INTRINSICS: [&str; 4] = ["intrinsics", "intrinsic", "K", "cam_K"];
/// Names under which tools write world_from_camera.
const CAMERA_TO_WORLD: [&str; 6] = [
    "extrinsics",
    "camera_to_world",
    "cam_c2w",
    "c2w",
    "pose",
    "world_from_camera",
];
const LARGEST_PIXEL: f64 = 1e6;
/// A camera is a few dozen numbers.
const LIMITS: Limits = Limits {
    decoded_bytes: 1 << 20,
    opcodes: 10_000,
    depth: 10,
};

/// The camera of an npz: intrinsics as (fx, fy), (fx, fy, cx, cy) or a 3 x 3 matrix, under
/// `intrinsics`, `intrinsic`, `K` or `cam_K`; and world_from_camera as a 4 x 4 or 3 x 4 matrix
/// under `extrinsics`, `camera_to_world`, `cam_c2w`, `c2w`, `pose` or `world_from_camera`. The
/// principal point is the image's middle where absent. `image_px` is the size of the image that the
/// intrinsics are for.
///
/// # Errors
/// [`VideoError::Parameters`], [`VideoError::Arrays`] for a damaged archive or array.
pub fn parse_camera(
    bytes: &[u8],
    image_px: Vector2<f64>,
    axes: CameraAxes,
    name: &str,
) -> Result<Camera, VideoError> {
    let npz = NpzReader::with_limits(Cursor::new(bytes), Path::new(name), LIMITS)?;
    let mut file = CameraFile { npz, name };
    let (focal_px, principal_point_px) = file.intrinsics(image_px)?;
    let world_from_camera = axes.to_open_cv(file.world_from_camera()?);
    Ok(Camera {
        focal_px,
        principal_point_px,
        image_px,
        world_from_camera,
    })
}

struct CameraFile<'a> {
    npz: NpzReader<Cursor<&'a [u8]>>,
    name: &'a str,
}

impl CameraFile<'_> {
    fn problem(&self, key: &str, problem: String) -> VideoError {
        VideoError::Parameters {
            name: self.name.to_owned(),
            key: key.to_owned(),
            problem,
        }
    }

    /// The first of the names that the file has.
    fn find(&self, names: &[&'static str]) -> Result<&'static str, VideoError> {
        let keys = self.npz.keys();
        let found = names
            .iter()
            .copied()
            .find(|name| keys.iter().any(|key| key == name));
        found.ok_or_else(|| {
            let others = names[1..].join(", ");
            self.problem(names[0], format!("absent, as is any of {others}"))
        })
    }

    /// Focal lengths and principal point, px.
    fn intrinsics(
        &mut self,
        image_px: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Vector2<f64>), VideoError> {
        let key = self.find(&INTRINSICS)?;
        let (focal_px, principal_point_px) = match &self.array(key)?[..] {
            [fx, fy] => (Vector2::new(*fx, *fy), image_px / 2.0),
            [fx, fy, cx, cy] => (Vector2::new(*fx, *fy), Vector2::new(*cx, *cy)),
            [fx, _, cx, _, fy, cy, _, _, _] => (Vector2::new(*fx, *fy), Vector2::new(*cx, *cy)),
            other => {
                let found = format!(
                    "expected (fx, fy), (fx, fy, cx, cy) or 3 x 3, found {} numbers",
                    other.len()
                );
                return Err(self.problem(key, found));
            }
        };
        if focal_px.min() > 0.0
            && focal_px.max() < LARGEST_PIXEL
            && principal_point_px.amax() < LARGEST_PIXEL
        {
            return Ok((focal_px, principal_point_px));
        }
        let found = format!(
            "focal lengths {} and {}, expected pixels above 0",
            focal_px.x, focal_px.y
        );
        Err(self.problem(key, found))
    }

    /// The camera's pose, in the file's own axes and unit.
    fn world_from_camera(&mut self) -> Result<Isometry3<f64>, VideoError> {
        let key = self.find(&CAMERA_TO_WORLD)?;
        let values = self.array(key)?;
        if values.len() != 16 && values.len() != 12 {
            let found = format!(
                "expected a 4 x 4 or 3 x 4 matrix, found {} numbers",
                values.len()
            );
            return Err(self.problem(key, found));
        }
        let rotation = Matrix3::from_fn(|row, column| values[4 * row + column]);
        let position = Vector3::from_fn(|row, _| values[4 * row + 3]);
        let rotation = so3::rotation_from_matrix(&rotation, 1e-2)
            .map_err(|error| self.problem(key, error.to_string()))?;
        Ok(Isometry3::from_parts(position.into(), rotation))
    }

    /// The numbers of a small array of any of the shapes that cameras come in: a vector, a matrix,
    /// or a stack of one matrix.
    fn array(&mut self, key: &str) -> Result<Vec<f64>, VideoError> {
        let entry = self.npz.at(key)?;
        let shape: &[Option<usize>] = match entry.shape()?.len() {
            1 => &[None],
            3 => &[Some(1), None, None],
            _ => &[None, None],
        };
        Ok(entry.floats(shape, "a vector or a matrix")?.values)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use cromosim_arrays::NpzWriter;

    use super::*;

    fn npz(arrays: &[(&str, &[usize], &[f64])]) -> Vec<u8> {
        let mut writer = NpzWriter::new(Cursor::new(Vec::new()));
        for (key, shape, values) in arrays {
            writer.floats(key, shape, values).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    #[test]
    fn cameras_are_read_in_the_forms_that_occur() {
        let size = Vector2::new(384.0, 216.0);
        let pose = [
            1.0, 0.0, 0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0, 0.0, -1.0, 2.5, 0.0, 0.0, 0.0, 1.0,
        ];
        let first = parse_camera(
            &npz(&[
                ("intrinsics", &[2], &[300.0, 310.0]),
                ("extrinsics", &[4, 4], &pose),
            ]),
            size,
            CameraAxes::OpenCv,
            "a.npz",
        )
        .unwrap();
        assert_eq!(
            (first.focal_px, first.principal_point_px),
            (Vector2::new(300.0, 310.0), Vector2::new(192.0, 108.0))
        );
        assert_eq!(
            first.world_from_camera.translation.vector,
            Vector3::new(0.5, 1.5, 2.5)
        );
        let k = [300.0, 0.0, 190.0, 0.0, 310.0, 100.0, 0.0, 0.0, 1.0];
        let second = parse_camera(
            &npz(&[("K", &[3, 3], &k), ("c2w", &[3, 4], &pose[..12])]),
            size,
            CameraAxes::OpenGl,
            "a.npz",
        )
        .unwrap();
        assert_eq!(second.principal_point_px, Vector2::new(190.0, 100.0));
        assert!(
            (second.world_from_camera.rotation.angle()) < 1e-9,
            "OpenGL's half turn undoes the matrix's"
        );

        let message = |bytes: &[u8]| {
            parse_camera(bytes, size, CameraAxes::OpenCv, "a.npz")
                .unwrap_err()
                .to_string()
        };
        assert!(
            message(&npz(&[("K", &[2], &[300.0, 310.0])]))
                .contains("a.npz: key extrinsics: absent")
        );
        assert!(message(&npz(&[("K", &[3], &[1.0, 2.0, 3.0])])).contains("found 3 numbers"));
        assert!(message(&npz(&[("K", &[2], &[0.0, 3.0])])).contains("focal"));
        assert!(
            message(&npz(&[
                ("K", &[2], &[300.0, 310.0]),
                ("c2w", &[4, 4], &[0.0; 16])
            ]))
            .contains("c2w")
        );
        assert!(message(b"PK\x03\x04 nothing").contains("a.npz"));
    }
}
