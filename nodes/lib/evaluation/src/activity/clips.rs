//! The motions of the virtual people, and how often each is played.

use std::path::PathBuf;
use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::activities::Activities;
use super::settings::Settings;
use super::windows::WindowGrid;
use crate::EvaluationError;
use crate::seeds::mixed_seed;
use crate::training_data::{LabelledMotion, MotionClip, read_labelled_motion};

/// No class needs so many rounds through all clips, unless a clip gives it no window.
const MOST_ROUNDS: u64 = 500;

/// A motion with what its frames show.
pub(super) struct ActivityClip {
    /// One pose a frame.
    pub poses: Vec<BodyPose>,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// One class a frame.
    pub labels: Vec<Option<u8>>,
}

/// Reads labelled clips; those that are named atypical only where they are asked for. Gives the
/// names of those left out, too.
pub(super) fn read_clips(
    files: &[PathBuf],
    model: &Arc<BodyModel>,
    activities: &Activities,
    atypical: bool,
) -> Result<(Vec<ActivityClip>, Vec<String>), EvaluationError> {
    let (mut clips, mut left_out) = (Vec::new(), Vec::new());
    for path in files {
        let LabelledMotion {
            motion:
                MotionClip {
                    name,
                    poses,
                    rate_hz,
                    ..
                },
            labels,
            atypical: why,
        } = read_labelled_motion(path, model)?;
        if labels.is_empty() {
            return Err(EvaluationError::NoLabels { path: path.clone() });
        }
        if !atypical && !why.is_empty() {
            left_out.push(name);
            continue;
        }
        let labels = labels
            .iter()
            .map(|label| {
                label
                    .as_ref()
                    .and_then(|label| activities.class_named(label))
            })
            .collect();
        clips.push(ActivityClip {
            poses,
            rate_hz,
            labels,
        });
    }
    Ok((clips, left_out))
}

/// A clip played once by a drawn person.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ClipDraw {
    /// The clip's index.
    pub clip: usize,
    /// Seed of the person and of how devices are worn.
    pub seed: u64,
    /// How many times as fast as recorded it is played.
    pub speed: f64,
    /// Samples on the windows' grid.
    pub samples: usize,
    /// The windows that are taken: first sample and class.
    pub windows: Vec<(usize, u8)>,
}

/// Draws until every class that the clips show has its windows: each round plays every clip that
/// shows a class which still lacks some, in drawn order. Scarce classes come from more draws of the
/// same clips.
pub(super) fn draw_clips(
    clips: &[ActivityClip],
    classes: usize,
    settings: &Settings,
    seed: u64,
) -> Vec<ClipDraw> {
    let mut lacking: Vec<usize> = (0..classes)
        .map(|class| {
            if clips.iter().any(|clip| shows(clip, class)) {
                settings.virtual_windows
            } else {
                0
            }
        })
        .collect();
    let mut random = ChaCha12Rng::seed_from_u64(mixed_seed(&[seed, 1]));
    let mut draws = Vec::new();
    for round in 0..MOST_ROUNDS {
        let mut order: Vec<usize> = (0..clips.len()).collect();
        for last in (1..order.len()).rev() {
            order.swap(last, random.random_range(0..=last));
        }
        for clip in order {
            let [low, high] = settings.speed;
            let speed = low + (high - low) * random.random::<f64>();
            let phase = random.random_range(0..settings.hop);
            if !(0..classes).any(|class| lacking[class] > 0 && shows(&clips[clip], class)) {
                continue;
            }
            let (samples, mut windows) = windows(&clips[clip], speed, phase, &settings.grid());
            windows.retain(|(_, label)| {
                let lacking = &mut lacking[usize::from(*label)];
                let taken = *lacking > 0;
                *lacking -= usize::from(taken);
                taken
            });
            if !windows.is_empty() {
                draws.push(ClipDraw {
                    clip,
                    seed: mixed_seed(&[seed, 2, round, clip as u64]),
                    speed,
                    samples,
                    windows,
                });
            }
        }
        if lacking.iter().all(|count| *count == 0) {
            break;
        }
    }
    draws
}

fn shows(clip: &ActivityClip, class: usize) -> bool {
    clip.labels
        .iter()
        .flatten()
        .any(|label| usize::from(*label) == class)
}

fn windows(
    clip: &ActivityClip,
    speed: f64,
    phase: usize,
    grid: &WindowGrid,
) -> (usize, Vec<(usize, u8)>) {
    let rate_hz = clip.rate_hz * speed;
    let last = clip.labels.len().saturating_sub(1);
    let samples = grid.samples(last as f64 / rate_hz);
    let label = |sample: usize| {
        clip.labels
            .get(((sample as f64 / grid.rate_hz as f64 * rate_hz).round() as usize).min(last))
            .copied()
            .flatten()
    };
    let labels: Vec<Option<u8>> = (0..samples).map(label).collect();
    (samples, grid.windows(&labels, phase))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn clip(labels: &[(Option<u8>, usize)]) -> ActivityClip {
        let labels: Vec<Option<u8>> = labels
            .iter()
            .flat_map(|(label, frames)| std::iter::repeat_n(*label, *frames))
            .collect();
        ActivityClip {
            poses: vec![BodyPose::rest(Vector3::zeros()); labels.len()],
            rate_hz: 120.0,
            labels,
        }
    }

    #[test]
    fn scarce_classes_are_drawn_more_often() {
        let clips = [
            clip(&[(Some(0), 3600)]),
            clip(&[(Some(0), 600), (Some(1), 180), (None, 300)]),
            clip(&[(None, 600)]),
        ];
        let settings = Settings {
            virtual_windows: 50,
            ..Settings::full(1)
        };
        let draws = draw_clips(&clips, 3, &settings, 7);
        let count = |class: u8| {
            draws
                .iter()
                .flat_map(|draw| &draw.windows)
                .filter(|(_, label)| *label == class)
                .count()
        };
        assert_eq!([count(0), count(1), count(2)], [50, 50, 0]);
        let drawn = |clip: usize| draws.iter().filter(|draw| draw.clip == clip).count();
        assert!(
            drawn(0) <= 2 && drawn(1) > 10 && drawn(2) == 0,
            "{} {}",
            drawn(0),
            drawn(1)
        );
        // People differ, the same seed gives the same, and windows lie within their samples.
        assert!(draws.windows(2).all(|pair| pair[0].seed != pair[1].seed));
        assert_eq!(draws, draw_clips(&clips, 3, &settings, 7));
        assert_ne!(draws, draw_clips(&clips, 3, &settings, 8));
        assert!(draws.iter().all(|draw| {
            draw.windows
                .iter()
                .all(|(start, _)| start + settings.window <= draw.samples)
        }));
    }

    #[test]
    fn a_faster_person_has_fewer_windows() {
        let (clip, grid) = (clip(&[(Some(2), 1200)]), Settings::full(1).grid());
        let (slow, fast) = (
            windows(&clip, 0.8, 0, &grid),
            windows(&clip, 1.25, 0, &grid),
        );
        assert_eq!(
            (slow.0, fast.0),
            (grid.samples(1199.0 / 96.0), grid.samples(1199.0 / 150.0))
        );
        assert!(slow.1.len() > fast.1.len() && fast.1.iter().all(|(_, label)| *label == 2));
    }
}
