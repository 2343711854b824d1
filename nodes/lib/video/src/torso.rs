//! From torso keypoints to the pixel of the middle of the hips.

use nalgebra::Vector2;

use crate::keypoints::{PersonKeypoints, body_25};

/// Distance between the hip joints by that between the shoulder joints: 0.175 m by 0.335 m of the
/// embedded body.
const HIPS_BY_SHOULDERS: f64 = 0.52;
/// Length of the torso (mid hip to neck) by the distance of the shoulder joints.
const TORSO_BY_SHOULDERS: f64 = 1.45;

/// Which keypoints gave the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PelvisSource {
    /// BODY_25's mid hip.
    MidHip,
    /// The mean of both hips.
    Hips,
    /// One hip, moved by half the hips' distance along the line of the shoulders.
    OneHip,
}

/// The middle of the hip joints in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PelvisPixel {
    /// Where, px.
    pub pixel: Vector2<f64>,
    /// Confidence of the keypoints that gave it, 0 to 1.
    pub confidence: f64,
    /// How much less exact than a keypoint it is: factor on a keypoint's standard deviation.
    pub spread: f64,
    /// Length of the torso as it would look upright, px: how large the person is in the image.
    pub torso_px: f64,
    /// Where it comes from.
    pub source: PelvisSource,
}

/// The middle of the hips: BODY_25's mid hip; where its confidence is below `least_confidence` the
/// mean of both hips; where one of these is missing, too, the other one plus half the hips'
/// distance along the line of the shoulders. The torso's length is the larger of
/// |neck - mid hip| and 1.45 |shoulders|, since one of them always faces the camera. `None` where the torso is not seen.
pub fn pelvis_pixel(person: &PersonKeypoints, least_confidence: f64) -> Option<PelvisPixel> {
    let seen = |index: usize| {
        let point = &person[index];
        (point.confidence >= least_confidence && point.confidence > 0.0)
            .then(|| (Vector2::new(point.u, point.v), point.confidence))
    };
    let shoulders = seen(body_25::RIGHT_SHOULDER).zip(seen(body_25::LEFT_SHOULDER));
    let across = shoulders.map(|((right, _), (left, _))| left - right);
    let neck = seen(body_25::NECK)
        .or_else(|| shoulders.map(|((right, a), (left, b))| ((right + left) / 2.0, a.min(b))));
    let hips = (seen(body_25::RIGHT_HIP), seen(body_25::LEFT_HIP));
    let one_hip = |hip: (Vector2<f64>, f64), side: f64, across: Vector2<f64>| {
        (
            hip.0 + across * (side * HIPS_BY_SHOULDERS / 2.0),
            hip.1,
            2.0,
            PelvisSource::OneHip,
        )
    };
    let (pixel, confidence, spread, source) = match (seen(body_25::MID_HIP), hips, across) {
        (Some((pixel, confidence)), _, _) => (pixel, confidence, 1.0, PelvisSource::MidHip),
        (None, (Some(right), Some(left)), _) => (
            (right.0 + left.0) / 2.0,
            right.1.min(left.1),
            1.0,
            PelvisSource::Hips,
        ),
        (None, (Some(right), None), Some(across)) => one_hip(right, 1.0, across),
        (None, (None, Some(left)), Some(across)) => one_hip(left, -1.0, across),
        _ => return None,
    };
    let length = neck.map_or(0.0, |(neck, _)| (neck - pixel).norm());
    let torso_px = across
        .map_or(0.0, |across| across.norm() * TORSO_BY_SHOULDERS)
        .max(length);
    (torso_px > 1.0).then_some(PelvisPixel {
        pixel,
        confidence,
        spread,
        torso_px,
        source,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::keypoints::{BODY_25_COUNT, Keypoint};

    #[test]
    fn the_mid_hip_is_found_from_what_is_seen() {
        let mut person = [Keypoint::default(); BODY_25_COUNT];
        let point = |u: f64, v: f64| Keypoint {
            u,
            v,
            confidence: 0.8,
        };
        for (index, u, v) in [
            (1, 100.0, 100.0),
            (2, 50.0, 100.0),
            (5, 150.0, 100.0),
            (8, 100.0, 300.0),
            (9, 74.0, 300.0),
            (12, 126.0, 300.0),
        ] {
            person[index] = point(u, v);
        }
        let found = pelvis_pixel(&person, 0.3).unwrap();
        assert_eq!(
            (found.pixel, found.torso_px, found.source),
            (Vector2::new(100.0, 300.0), 200.0, PelvisSource::MidHip)
        );
        person[8].confidence = 0.2;
        assert_eq!(
            pelvis_pixel(&person, 0.3).unwrap().source,
            PelvisSource::Hips
        );
        person[12].confidence = 0.0;
        let one = pelvis_pixel(&person, 0.3).unwrap();
        assert_eq!(
            (one.pixel, one.source, one.spread),
            (Vector2::new(100.0, 300.0), PelvisSource::OneHip, 2.0)
        );
        person[5].confidence = 0.0;
        assert_eq!(
            pelvis_pixel(&person, 0.3),
            None,
            "one hip and no line of shoulders"
        );
    }
}
