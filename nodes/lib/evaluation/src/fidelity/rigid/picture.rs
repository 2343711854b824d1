//! Some seconds of one IMU of the physics, as each way from poses to readings sees them.

use std::ops::Range;

use cromosim_charts::{Chart, Line, LineChart, Point};
use cromosim_imu::{KinematicSample, Reading};
use cromosim_spatial::Stamp;
use serde::{Deserialize, Serialize};

use super::case::RigidCase;
use super::definition::RigidPicture;
use super::method::{JUDGED, RigidMethod};
use super::stated::stated_of_norms;
use crate::EvaluationError;
use crate::fidelity::imusim::imusim;

/// The band reaches so many stated standard deviations to each side.
const BAND: f64 = 2.0;

/// Norms at each sample: specific force, m/s2, and angular velocity, rad/s.
type Norms = [Vec<f64>; 2];

/// One IMU for some seconds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PictureResults {
    /// Its motion.
    pub motion: String,
    /// Where it is.
    pub position: String,
    /// Time of each sample, s.
    pub seconds: Vec<f64>,
    /// Norms of the exact specific force, m/s2, and angular velocity, rad/s.
    pub truth: [Vec<f64>; 2],
    /// What methods make of it, the judged one last.
    pub seen: Vec<SeenResults>,
}

/// What a method makes of an IMU. Pairs are specific force (m/s2) and angular velocity (rad/s).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SeenResults {
    /// The method, as it is for each of the pair.
    pub label: [String; 2],
    /// Norms at each sample.
    pub norms: [Vec<f64>; 2],
    /// Standard deviations that are stated of the norms; of the judged method alone.
    pub stated: Option<[Vec<Option<f64>>; 2]>,
}

impl PictureResults {
    /// None where the study has no such IMU. `cutoff_hz`: the practice's, best in hindsight for each
    /// channel.
    ///
    /// # Errors
    /// Those of the methods.
    pub(super) fn new(
        wanted: &RigidPicture,
        cases: &[RigidCase],
        cutoff_hz: [f64; 2],
    ) -> Result<Option<Self>, EvaluationError> {
        let is_wanted =
            |case: &&RigidCase| case.motion == wanted.motion && case.position == wanted.position;
        let Some(case) = cases.iter().find(is_wanted) else {
            return Ok(None);
        };
        let Some((trajectory, stamps, truth)) = case.known() else {
            return Ok(None);
        };
        let window = between(stamps, trajectory.start(), wanted.seconds);
        // A method sees the whole motion; its picture is a part.
        let see = |method: RigidMethod| -> Result<Vec<KinematicSample>, EvaluationError> {
            Ok(method.simulate(trajectory, stamps)?[window.clone()].to_vec())
        };
        let [force, rate] = cutoff_hz.map(|cutoff_hz| see(RigidMethod::Practice(cutoff_hz)));
        let ([force, _], [_, rate]) = (norms(&force?), norms(&rate?));
        let practice = SeenResults {
            label: cutoff_hz.map(|hz| format!("practice: low-pass at {hz} Hz, best in hindsight")),
            norms: [force, rate],
            stated: None,
        };
        let imusim = SeenResults {
            label: [0, 1].map(|_| "IMUSim-like: spline within 1 mm".to_owned()),
            norms: norms(&imusim(trajectory, stamps)?[window.clone()]),
            stated: None,
        };
        let judged = see(JUDGED)?;
        let title = JUDGED.title();
        let judged = SeenResults {
            label: [0, 1].map(|_| format!("{title}, ± {BAND} stated standard deviations")),
            norms: norms(&judged),
            stated: Some(pairs(judged.iter().map(stated_of_norms))),
        };
        let seconds = |stamp: &Stamp| *stamp - trajectory.start();
        Ok(Some(Self {
            motion: wanted.motion.clone(),
            position: wanted.position.clone(),
            seconds: stamps[window.clone()].iter().map(seconds).collect(),
            truth: pairs(truth[window].iter().map(norm)),
            seen: vec![practice, imusim, judged],
        }))
    }

    /// The pictures by their file's names: specific force and angular velocity.
    pub(super) fn charts(&self, study: &str) -> [(String, Chart); 2] {
        let position = self.position.replace('_', " ");
        let quantities = [("specific force", "m/s²"), ("angular velocity", "rad/s")];
        [0, 1].map(|which| {
            let (quantity, unit) = quantities[which];
            let seen = |seen: &SeenResults| Line {
                label: seen.label[which].clone(),
                points: self.points(&seen.norms[which], seen.stated.as_ref().map(|s| &s[which])),
                is_reference: false,
            };
            let truth = Line {
                label: "truth".to_owned(),
                points: self.points(&self.truth[which], None),
                is_reference: true,
            };
            let chart = LineChart {
                title: format!("{}, {position} ({study}): {quantity}", self.motion),
                x_label: "time, s".to_owned(),
                y_label: format!("norm of {quantity}, {unit}"),
                logarithmic_x: false,
                logarithmic_y: false,
                lines: self.seen.iter().map(seen).chain([truth]).collect(),
                level: None,
            };
            let name = format!("{study}_{}_{position}_{quantity}.png", self.motion);
            (name.replace([' ', ','], "_"), Chart::Lines(chart))
        })
    }

    fn points(&self, norms: &[f64], stated: Option<&Vec<Option<f64>>>) -> Vec<Point> {
        let point = |k: usize| {
            let y = norms[k];
            let half = stated.and_then(|stated| Some(BAND * stated[k]?));
            Point {
                x: self.seconds[k],
                y,
                // No norm is below 0.
                interval: half.map(|half| ((y - half).max(0.0), y + half)),
            }
        };
        (0..norms.len()).map(point).collect()
    }
}

/// The samples from one time to another, s after the start.
fn between(stamps: &[Stamp], start: Stamp, seconds: [f64; 2]) -> Range<usize> {
    let [from, to] = seconds.map(|seconds| start.plus_seconds(seconds));
    let first = stamps.partition_point(|stamp| *stamp < from);
    first..stamps.partition_point(|stamp| *stamp <= to).max(first)
}

fn norms(samples: &[KinematicSample]) -> Norms {
    let norm = |sample: &KinematicSample| {
        let own = sample.imu();
        [own.specific_force.norm(), own.angular_velocity.norm()]
    };
    pairs(samples.iter().map(norm))
}

fn norm(reading: &Reading) -> [f64; 2] {
    [
        reading.specific_force.norm(),
        reading.angular_velocity.norm(),
    ]
}

fn pairs<T>(values: impl Iterator<Item = [T; 2]>) -> [Vec<T>; 2] {
    let (forces, rates) = values.map(|[force, rate]| (force, rate)).unzip();
    [forces, rates]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::case::{Seen, physics_cases};
    use super::super::pose_errors::PoseErrors;
    use super::*;

    #[test]
    fn a_picture_is_a_part_of_what_was_seen_with_a_band() {
        let seen = Seen {
            errors: PoseErrors::Markers,
            rate_hz: 60.0,
            repeats: 1,
            seed: 3,
            quick: true,
        };
        let cases = physics_cases(seen).unwrap();
        let wanted = |position: &str| RigidPicture {
            motion: "jump".to_owned(),
            position: position.to_owned(),
            seconds: [2.1, 3.3],
        };
        let of = |position| PictureResults::new(&wanted(position), &cases, [15.0, 10.0]).unwrap();
        let picture = of("pelvis").unwrap();
        assert_eq!((picture.seconds.len(), picture.seen.len()), (289, 3));
        let greatest = |norms: &Norms| norms[0].iter().copied().fold(0.0, f64::max);
        let [.., imusim, judged] = &picture.seen[..] else {
            return;
        };
        // The push-off is where a fixed smoothing loses most.
        assert!(greatest(&imusim.norms) < 0.9 * greatest(&picture.truth));
        assert!((greatest(&judged.norms) / greatest(&picture.truth) - 1.0).abs() < 0.1);
        let [(name, chart), _] = picture.charts("physics, 60 Hz");
        assert_eq!(name, "physics__60_Hz_jump_pelvis_specific_force.png");
        assert!(chart.svg().contains("class=\"band"));
        // `quick` takes one position of each motion.
        assert!(of("thigh").is_none());
    }
}
