//! OpenPose's `*_keypoints.json`.

use cromosim_spatial::in_plain_words;
use serde::Deserialize;

use crate::error::VideoError;
use crate::keypoints::{BODY_25_COUNT, Keypoint, PersonKeypoints};

/// Larger files are refused; a person takes about 1 kB.
const MAX_BYTES: usize = 16 << 20;
/// A coordinate beyond this is no pixel.
const MAX_PIXEL: f64 = 1e6;

#[derive(Deserialize)]
struct File {
    people: Vec<Person>,
}

#[derive(Deserialize)]
struct Person {
    pose_keypoints_2d: Vec<f64>,
}

/// The people of one frame: `people[].pose_keypoints_2d` holds x, y (px) and confidence of the 25
/// points of BODY_25. Points that were not found have confidence 0. Confidences above 1, which
/// OpenPose gives now and then, become 1.
///
/// # Errors
/// [`VideoError::Json`] with line and column, [`VideoError::Keypoints`],
/// [`VideoError::TooLarge`].
pub fn parse_openpose(bytes: &[u8], name: &str) -> Result<Vec<PersonKeypoints>, VideoError> {
    if bytes.len() > MAX_BYTES {
        return Err(VideoError::TooLarge {
            name: name.to_owned(),
            bytes: bytes.len() as u64,
            limit: MAX_BYTES as u64,
        });
    }
    let file: File = serde_json::from_slice(bytes).map_err(|error| VideoError::Json {
        name: name.to_owned(),
        problem: in_plain_words(error),
    })?;
    file.people
        .iter()
        .enumerate()
        .map(|(index, person)| keypoints(&person.pose_keypoints_2d, index, name))
        .collect()
}

fn keypoints(values: &[f64], person: usize, name: &str) -> Result<PersonKeypoints, VideoError> {
    let problem = |problem: String| VideoError::Keypoints {
        name: name.to_owned(),
        person,
        problem,
    };
    if values.len() != 3 * BODY_25_COUNT {
        return Err(problem(format!(
            "expected {} numbers (25 points), found {}",
            3 * BODY_25_COUNT,
            values.len()
        )));
    }
    let mut points = [Keypoint::default(); BODY_25_COUNT];
    for (index, (point, value)) in points.iter_mut().zip(values.as_chunks::<3>().0).enumerate() {
        let [u, v, confidence] = *value;
        let sound = u.abs() < MAX_PIXEL && v.abs() < MAX_PIXEL && (0.0..=2.0).contains(&confidence);
        if !sound {
            return Err(problem(format!(
                "point {index} is ({u}, {v}) with confidence {confidence}, expected pixels and 0 to 1"
            )));
        }
        *point = Keypoint {
            u,
            v,
            confidence: confidence.min(1.0),
        };
    }
    Ok(points)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn keypoints_come_back_and_errors_name_the_place() {
        let mut person = [Keypoint::default(); BODY_25_COUNT];
        person[8] = Keypoint {
            u: 960.125,
            v: 540.3,
            confidence: 0.87,
        };
        let numbers = person.map(|point| [point.u, point.v, point.confidence]);
        let people = [numbers.as_flattened(), &[0.0; 3 * BODY_25_COUNT]]
            .map(|numbers| serde_json::json!({"person_id": [-1], "pose_keypoints_2d": numbers}));
        let text = serde_json::json!({"version": 1.3, "people": people}).to_string();
        let people = parse_openpose(text.as_bytes(), "a.json").unwrap();
        assert_eq!((people.len(), people[0]), (2, person));
        assert_eq!(
            parse_openpose(br#"{"version":1.3,"people":[]}"#, "a.json")
                .unwrap()
                .len(),
            0
        );

        let message = |text: &str| {
            parse_openpose(text.as_bytes(), "a.json")
                .unwrap_err()
                .to_string()
        };
        assert!(
            message("{\"people\":\n [3]}").contains("line 2"),
            "{}",
            message("{\"people\":\n [3]}")
        );
        let coco = message(r#"{"people":[{"pose_keypoints_2d":[1,2,0.5]}]}"#);
        assert!(
            coco.contains("a.json: people[0]")
                && coco.contains("found 3")
                && coco.contains("BODY_25"),
            "{coco}"
        );
        let numbers = vec!["1e9"; 75].join(",");
        assert!(
            message(&format!(
                "{{\"people\":[{{\"pose_keypoints_2d\":[{numbers}]}}]}}"
            ))
            .contains("point 0")
        );
        assert!(
            message(&"[".repeat(1000)).contains("a.json"),
            "no deep recursion"
        );
    }
}
