//! The spline scheme, live: a window with a fixed lag, smoothed as the frames so far ask for.

use cromosim_spatial::{
    PoseSmoothing, PoseSource, PoseSpline, PoseTimes, Smoothing, SplineSystem, Stamp, WeightSearch,
    position_channels, rotation_channels,
};
use nalgebra::Isometry3;

use crate::schemes::spline::{SplineVariance, sample};
use crate::{ImuError, KinematicSample, SensorFrame};

/// Frames between a sample and the frame that releases it.
pub(crate) const LAG_FRAMES: usize = 10;
/// Frames before the sample that the window reaches back.
const PAST_FRAMES: usize = 32;
/// Frames before the first search for weights, which is done at once.
const FIRST_SEARCH: usize = 16;
/// Later searches score one weight on every so many frames, so that no frame has to wait for a
/// whole one.
const FRAMES_PER_SCORE: usize = 4;

/// The weights of position and rotation, and the search for better ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct FixedLag {
    weights: Option<Weights>,
    search: Option<Search>,
    /// Frames of this series.
    frame_count: usize,
    /// Searches done.
    search_count: usize,
}

#[derive(Clone, Copy, Debug)]
struct Weights {
    position: f64,
    rotation: f64,
}

/// A search on a copy of past frames.
#[derive(Clone, Debug)]
struct Search {
    system: SplineSystem,
    positions: Vec<[f64; 3]>,
    rotations: Vec<[f64; 4]>,
    position: WeightSearch,
    rotation: WeightSearch,
}

impl FixedLag {
    /// Learns from the frames so far, newest last; called once a frame.
    pub(crate) fn learn(&mut self, frames: &[SensorFrame]) {
        self.frame_count += 1;
        if self.search.is_none() && self.frame_count >= FIRST_SEARCH {
            self.search = Search::on(frames);
        }
        let at_once = self.weights.is_none();
        while let Some(search) = &mut self.search {
            if !at_once && !self.frame_count.is_multiple_of(FRAMES_PER_SCORE) {
                return;
            }
            if search.step() {
                if !at_once {
                    return;
                }
            } else {
                let found = search.best();
                self.search = None;
                self.take(found);
                return;
            }
        }
    }

    /// Keeps the weights, but starts with new frames.
    pub(crate) fn forget_frames(&mut self) {
        self.search = None;
        self.frame_count = 0;
    }

    /// Samples at stamps within the window, by a spline over its last frames.
    pub(crate) fn sample(
        &self,
        window: &[SensorFrame],
        due: &[Stamp],
        samples: &mut Vec<KinematicSample>,
    ) -> Result<(), ImuError> {
        let (frames, stamps, poses) = last_frames(window, due, PAST_FRAMES);
        let smoothing = match self.weights {
            Some(Weights { position, rotation }) => PoseSmoothing {
                position: Smoothing::Weight(position),
                rotation: Smoothing::Weight(rotation),
            },
            None => PoseSmoothing {
                position: Smoothing::Interpolate,
                rotation: Smoothing::Interpolate,
            },
        };
        let times = PoseTimes::new(&stamps)?;
        let spline = PoseSpline::fit_on(&times, &poses, smoothing)?;
        let errors = SplineVariance::new(&times, &spline, frames)?;
        let variance = |stamp| {
            errors
                .as_ref()
                .map(|errors| errors.at(stamp))
                .unwrap_or_default()
        };
        samples.extend(due.iter().map(|&stamp| KinematicSample {
            variance: variance(stamp),
            ..sample(
                &spline,
                PoseSource::default(),
                (stamp, &times.locate(stamp)),
                None,
            )
        }));
        Ok(())
    }

    /// The first search saw few frames, so the second replaces it; from then on each counts half,
    /// the ones before it the other half.
    fn take(&mut self, found: Weights) {
        let mean = |old: f64, new: f64| (old * new).sqrt();
        self.weights = Some(match self.weights {
            Some(old) if self.search_count >= 2 => Weights {
                position: mean(old.position, found.position),
                rotation: mean(old.rotation, found.rotation),
            },
            _ => found,
        });
        self.search_count += 1;
    }
}

/// The frames of a window from `past` before the first stamp that is due on, their stamps and poses.
pub(crate) fn last_frames<'a>(
    window: &'a [SensorFrame],
    due: &[Stamp],
    past: usize,
) -> (&'a [SensorFrame], Vec<Stamp>, Vec<Isometry3<f64>>) {
    let first_due = due.first().copied().unwrap_or_default();
    let before = window.partition_point(|frame| frame.stamp <= first_due);
    let frames = &window[before.saturating_sub(past)..];
    let (stamps, poses) = frames
        .iter()
        .map(|frame| (frame.stamp, frame.world_from_sensor))
        .unzip();
    (frames, stamps, poses)
}

impl Search {
    fn on(frames: &[SensorFrame]) -> Option<Self> {
        let origin = frames.first()?.stamp;
        let seconds: Vec<f64> = frames.iter().map(|frame| frame.stamp - origin).collect();
        let centre = frames.first()?.world_from_sensor.translation.vector;
        let poses: Vec<Isometry3<f64>> = frames
            .iter()
            .map(|frame| {
                let pose = &frame.world_from_sensor;
                Isometry3::from_parts((pose.translation.vector - centre).into(), pose.rotation)
            })
            .collect();
        Some(Self {
            system: SplineSystem::new(&seconds).ok()?,
            positions: position_channels(&poses),
            rotations: rotation_channels(&poses),
            position: WeightSearch::new(),
            rotation: WeightSearch::new(),
        })
    }

    /// Scores one weight; false when both searches are over.
    fn step(&mut self) -> bool {
        if let Some(weight) = self.position.next_weight() {
            self.position.record(
                self.system
                    .score(&self.positions, weight)
                    .unwrap_or(f64::INFINITY),
            );
            return true;
        }
        if let Some(weight) = self.rotation.next_weight() {
            self.rotation.record(
                self.system
                    .score(&self.rotations, weight)
                    .unwrap_or(f64::INFINITY),
            );
            return true;
        }
        false
    }

    fn best(&self) -> Weights {
        Weights {
            position: self.position.best().unwrap_or(0.0),
            rotation: self.rotation.best().unwrap_or(0.0),
        }
    }
}
