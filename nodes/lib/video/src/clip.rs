//! A camera-space estimate and what was seen beside it, as plain data.

use cromosim_body::{BodyPose, Gender};
use nalgebra::Vector2;

use crate::depth_map::DepthMap;
use crate::error::VideoError;
use crate::keypoints::PersonKeypoints;
use crate::pinhole::Camera;

/// One person's shot: per frame a pose in camera axes (x right, y down, z forward), as VIBE and its
/// kind give it, the keypoints, and the camera. All lists have the frames' length.
#[derive(Clone, Debug)]
pub struct CameraClip {
    /// Names the clip in errors.
    pub name: String,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// The body's gender; neutral where the estimator does not say.
    pub gender: Gender,
    /// camera_from_pelvis and the local rotations. The root position is not used: an in-place pose
    /// has none.
    pub poses: Vec<BodyPose>,
    /// How sure each pose is, 0 (none in this frame) to 1.
    pub pose_confidence: Vec<f64>,
    /// Shape coefficients of each frame, of the body that the trajectory is made for; no list at
    /// all for the mean shape.
    pub betas: Vec<Vec<f64>>,
    /// The followed person; `None` where they were not found.
    pub keypoints: Vec<Option<PersonKeypoints>>,
    /// Width and height of the image of the keypoints, px.
    pub keypoint_image_px: Vector2<f64>,
    /// `None` where the reconstruction has no camera.
    pub cameras: Vec<Option<Camera>>,
}

/// Where depth maps come from, one at a time.
pub trait DepthProvider {
    /// The map of a frame (0-based); `None` where there is none.
    ///
    /// # Errors
    /// What reading it says.
    fn depth(&mut self, frame: usize) -> Result<Option<DepthMap>, VideoError>;
}

impl<F: FnMut(usize) -> Result<Option<DepthMap>, VideoError>> DepthProvider for F {
    fn depth(&mut self, frame: usize) -> Result<Option<DepthMap>, VideoError> {
        self(frame)
    }
}

impl CameraClip {
    /// Lengths agree and numbers are finite.
    ///
    /// # Errors
    /// [`VideoError::Length`], [`VideoError::Value`].
    pub fn check(&self) -> Result<(), VideoError> {
        let expected = self.poses.len();
        let lists = [
            ("pose_confidence", self.pose_confidence.len()),
            ("keypoints", self.keypoints.len()),
            ("cameras", self.cameras.len()),
            (
                "betas",
                if self.betas.is_empty() {
                    expected
                } else {
                    self.betas.len()
                },
            ),
        ];
        if let Some((what, found)) = lists.into_iter().find(|(_, found)| *found != expected) {
            return Err(VideoError::Length {
                name: self.name.clone(),
                what,
                expected,
                found,
            });
        }
        self.positive("rate_hz", self.rate_hz)?;
        self.positive("keypoint_image_px", self.keypoint_image_px.min())?;
        for (frame, confidence) in self.pose_confidence.iter().enumerate() {
            if !(0.0..=1.0).contains(confidence) {
                return Err(self.value(format!("pose_confidence[{frame}]"), *confidence, "0 to 1"));
            }
        }
        for (frame, camera) in self.cameras.iter().enumerate() {
            let Some(camera) = camera else { continue };
            self.positive(&format!("cameras[{frame}].focal_px"), camera.focal_px.min())?;
            self.positive(&format!("cameras[{frame}].image_px"), camera.image_px.min())?;
            let numbers = camera
                .principal_point_px
                .iter()
                .chain(camera.world_from_camera.translation.vector.iter());
            let rotation = camera.world_from_camera.rotation.coords;
            if let Some(number) = numbers
                .chain(rotation.iter())
                .find(|number| !number.is_finite())
            {
                return Err(self.value(format!("cameras[{frame}]"), *number, "finite numbers"));
            }
        }
        for (frame, betas) in self.betas.iter().enumerate() {
            if let Some(beta) = betas.iter().find(|beta| !beta.is_finite()) {
                return Err(self.value(format!("betas[{frame}]"), *beta, "finite numbers"));
            }
        }
        Ok(())
    }

    fn positive(&self, what: &str, value: f64) -> Result<(), VideoError> {
        if value > 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(self.value(what.to_owned(), value, "a finite number above 0"))
        }
    }

    pub(crate) fn value(&self, what: String, value: f64, expected: &'static str) -> VideoError {
        VideoError::Value {
            name: self.name.clone(),
            what,
            value,
            expected,
        }
    }
}

/// Shape coefficients over the clip: the mean of the frames' weighted by their confidence. Shorter
/// lists count as filled up with 0; all weights 0 give the plain mean.
pub fn average_betas(betas: &[Vec<f64>], confidence: &[f64]) -> Vec<f64> {
    let count = betas.iter().map(Vec::len).max().unwrap_or(0);
    let known: f64 = confidence.iter().take(betas.len()).sum();
    let weight = |frame: usize| {
        if known > 0.0 {
            confidence.get(frame).copied().unwrap_or(0.0) / known
        } else {
            1.0 / betas.len() as f64
        }
    };
    (0..count)
        .map(|index| {
            betas
                .iter()
                .enumerate()
                .map(|(frame, betas)| weight(frame) * betas.get(index).copied().unwrap_or(0.0))
                .sum()
        })
        .collect()
}
