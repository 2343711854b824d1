//! People as 25 points of an image, and which of the people of a shot is followed.

/// Number of points of OpenPose's BODY_25 model.
pub const BODY_25_COUNT: usize = 25;

/// Indices of BODY_25 that are used here; left and right are the subject's.
pub(crate) mod body_25 {
    pub const NECK: usize = 1;
    pub const RIGHT_SHOULDER: usize = 2;
    pub const LEFT_SHOULDER: usize = 5;
    pub const MID_HIP: usize = 8;
    pub const RIGHT_HIP: usize = 9;
    pub const LEFT_HIP: usize = 12;
    pub const TORSO: [usize; 6] = [
        NECK,
        RIGHT_SHOULDER,
        LEFT_SHOULDER,
        MID_HIP,
        RIGHT_HIP,
        LEFT_HIP,
    ];
}

/// A point of an image. Pixel centres lie at whole numbers plus one half: the image spans 0 to its
/// width and 0 to its height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Keypoint {
    /// To the right, px.
    pub u: f64,
    /// Down, px.
    pub v: f64,
    /// 0 (not found) to 1.
    pub confidence: f64,
}

/// One person in one frame, in the order of BODY_25: nose, neck, right shoulder, elbow, wrist, left
/// shoulder, elbow, wrist, mid hip, right hip, knee, ankle, left hip, knee, ankle, eyes, ears, left
/// toes and heel, right toes and heel.
pub type PersonKeypoints = [Keypoint; BODY_25_COUNT];

/// An upright rectangle around the torso, px.
#[derive(Clone, Copy, Debug)]
struct TorsoBox {
    low: [f64; 2],
    high: [f64; 2],
    /// Mean confidence of the points inside.
    confidence: f64,
}

impl TorsoBox {
    /// Around the torso's points above `least_confidence`; at least three, and never thinner than a
    /// third of its length, since a torso seen from the side has a width, too.
    fn around_torso(person: &PersonKeypoints, least_confidence: f64) -> Option<Self> {
        let seen: Vec<&Keypoint> = body_25::TORSO
            .iter()
            .map(|&index| &person[index])
            .filter(|point| point.confidence >= least_confidence)
            .collect();
        if seen.len() < 3 {
            return None;
        }
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for point in &seen {
            for (axis, value) in [point.u, point.v].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let length = (high[0] - low[0]).max(high[1] - low[1]);
        for axis in 0..2 {
            let missing = (length / 3.0 - (high[axis] - low[axis])).max(0.0) / 2.0;
            low[axis] -= missing;
            high[axis] += missing;
        }
        let confidence = seen.iter().map(|point| point.confidence).sum::<f64>() / seen.len() as f64;
        Some(Self {
            low,
            high,
            confidence,
        })
    }

    fn area(&self) -> f64 {
        (self.high[0] - self.low[0]) * (self.high[1] - self.low[1])
    }

    /// Area of the intersection by that of the union, 0 to 1.
    fn overlap(&self, other: &Self) -> f64 {
        let side = |axis: usize| {
            (self.high[axis].min(other.high[axis]) - self.low[axis].max(other.low[axis])).max(0.0)
        };
        let common = side(0) * side(1);
        let union = self.area() + other.area() - common;
        if union > 0.0 { common / union } else { 0.0 }
    }
}

/// Least overlap by which a torso is the same as in the frame before.
const SAME_TORSO: f64 = 0.2;
/// How much less overlap suffices after each frame without the person: they walk on unseen.
const OVERLAP_PER_MISSING_FRAME: f64 = 0.02;

/// Follows one person through the frames: from where a torso is largest and surest (area times mean
/// confidence), forwards and backwards to the torso that overlaps the last one most. For each frame
/// the index among its people; `None` where none overlaps.
pub fn track_person(frames: &[Vec<PersonKeypoints>], least_confidence: f64) -> Vec<Option<usize>> {
    let boxes: Vec<Vec<Option<TorsoBox>>> = frames
        .iter()
        .map(|people| {
            people
                .iter()
                .map(|person| TorsoBox::around_torso(person, least_confidence))
                .collect()
        })
        .collect();
    let mut chosen = vec![None; frames.len()];
    let mut best: Option<(usize, usize, TorsoBox)> = None;
    let weight = |torso: &TorsoBox| torso.area() * torso.confidence;
    for (frame, people) in boxes.iter().enumerate() {
        for (person, torso) in people.iter().enumerate() {
            if let Some(torso) = torso
                && best
                    .as_ref()
                    .is_none_or(|(_, _, so_far)| weight(torso) > weight(so_far))
            {
                best = Some((frame, person, *torso));
            }
        }
    }
    let Some((start, person, torso)) = best else {
        return chosen;
    };
    chosen[start] = Some(person);
    follow(&boxes, start + 1..frames.len(), torso, &mut chosen);
    follow(&boxes, (0..start).rev(), torso, &mut chosen);
    chosen
}

fn follow(
    boxes: &[Vec<Option<TorsoBox>>],
    frames: impl Iterator<Item = usize>,
    mut last: TorsoBox,
    chosen: &mut [Option<usize>],
) {
    let mut least = SAME_TORSO;
    for frame in frames {
        let overlaps = boxes[frame]
            .iter()
            .enumerate()
            .filter_map(|(person, torso)| Some((person, torso.as_ref()?)));
        let nearest = overlaps
            .map(|(person, torso)| (person, *torso, torso.overlap(&last)))
            .max_by(|a, b| a.2.total_cmp(&b.2));
        match nearest.filter(|(_, _, overlap)| *overlap >= least && *overlap > 0.0) {
            Some((person, torso, _)) => {
                (chosen[frame], last, least) = (Some(person), torso, SAME_TORSO);
            }
            None => least = (least - OVERLAP_PER_MISSING_FRAME).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person(u: f64, size: f64) -> PersonKeypoints {
        let mut points = [Keypoint::default(); BODY_25_COUNT];
        for (index, dx, dy) in [
            (1, 0.0, -1.0),
            (2, -0.3, -1.0),
            (5, 0.3, -1.0),
            (8, 0.0, 0.0),
            (9, -0.2, 0.0),
            (12, 0.2, 0.0),
        ] {
            points[index] = Keypoint {
                u: u + dx * size,
                v: 500.0 + dy * size,
                confidence: 0.8,
            };
        }
        points
    }

    #[test]
    fn the_followed_person_is_the_same_through_crossings_of_the_list_and_gaps() {
        // Two people walk past each other's place in the list, the large one is missing for three
        // frames.
        let frames: Vec<Vec<PersonKeypoints>> = (0..40)
            .map(|frame| {
                let (large, small) = (
                    person(300.0 + 6.0 * frame as f64, 200.0),
                    person(900.0 - 6.0 * frame as f64, 120.0),
                );
                match frame {
                    10..13 => vec![small],
                    frame if frame % 2 == 0 => vec![large, small],
                    _ => vec![small, large],
                }
            })
            .collect();
        let chosen = track_person(&frames, 0.1);
        for (frame, chosen) in chosen.iter().enumerate() {
            let expected = match frame {
                10..13 => None,
                frame if frame % 2 == 0 => Some(0),
                _ => Some(1),
            };
            assert_eq!(*chosen, expected, "frame {frame}");
        }
        assert_eq!(track_person(&[Vec::new(), Vec::new()], 0.1), [None, None]);
    }
}
