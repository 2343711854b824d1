//! Batches of windows out of pairs.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

use crate::train::{Batch, Batches};
use crate::{Input, LearnedError, Pair, Quantity, WINDOW, window_starts};

/// Samples at the start of a window that a causal network is not judged by: it has seen too little.
const WARM_UP: usize = 20;
/// A window needs targets for this part of its samples.
const LEAST_KNOWN: f64 = 0.5;

/// How windows are turned before a network sees them: the world's axes mean nothing to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Turns {
    /// Not at all.
    None,
    /// About the vertical.
    Heading,
    /// Every way.
    Any,
}

/// Which windows make up a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Windows {
    /// Drawn by seed and number, turned.
    Drawn {
        /// Of all draws.
        seed: u64,
        /// How they are turned.
        turns: Turns,
    },
    /// One after the other, unturned: for validation.
    InOrder,
}

/// Windows of pairs for one quantity.
pub struct PairBatches<'a> {
    pairs: &'a [Pair],
    /// Pair, and first sample.
    places: Vec<(usize, usize)>,
    input: Input,
    quantity: Quantity,
    sequences: usize,
    windows: Windows,
}

impl<'a> PairBatches<'a> {
    /// Batches of `sequences` windows.
    ///
    /// # Errors
    /// [`LearnedError::TooFew`] where no window has enough targets.
    pub fn new(
        pairs: &'a [Pair],
        input: Input,
        quantity: Quantity,
        sequences: usize,
        windows: Windows,
    ) -> Result<Self, LearnedError> {
        let mut places = Vec::new();
        for (index, pair) in pairs.iter().enumerate() {
            for start in window_starts(pair.motion.len()) {
                let end = (start + WINDOW).min(pair.motion.len());
                let known = pair.targets[start..end].iter().flatten().count();
                if known as f64 >= LEAST_KNOWN * WINDOW as f64 {
                    places.push((index, start));
                }
            }
        }
        if places.is_empty() || sequences == 0 {
            let found = pairs
                .iter()
                .map(|pair| pair.targets.iter().flatten().count())
                .max()
                .unwrap_or(0);
            let what = format!("windows of 2 s among {} pairs", pairs.len());
            return Err(LearnedError::TooFew {
                what,
                found,
                needed: (LEAST_KNOWN * WINDOW as f64) as usize,
            });
        }
        Ok(Self {
            pairs,
            places,
            input,
            quantity,
            sequences,
            windows,
        })
    }

    /// Batches that go through every window once.
    pub fn count(&self) -> u64 {
        self.places.len().div_ceil(self.sequences) as u64
    }

    /// Windows to choose from.
    pub fn windows(&self) -> usize {
        self.places.len()
    }

    fn window(&self, place: (usize, usize), turn: &UnitQuaternion<f64>, batch: &mut Batch) {
        let (pair, start) = (&self.pairs[place.0], place.1);
        self.input
            .fill(&pair.motion, start, WINDOW, turn, &mut batch.inputs);
        let warm_up = if self.input == Input::Streaming {
            WARM_UP
        } else {
            0
        };
        for step in 0..WINDOW {
            let target = pair.target(
                start + step,
                self.quantity,
                self.input.on_top_of_analytic(),
                turn,
            );
            batch.weights.push(if target.is_some() && step >= warm_up {
                1.0
            } else {
                0.0
            });
            batch.targets.extend(target.unwrap_or_default());
        }
        batch.sequences += 1;
    }
}

impl Batches for PairBatches<'_> {
    fn batch(&self, number: u64) -> Result<Batch, LearnedError> {
        let mut batch = Batch {
            inputs: Vec::new(),
            targets: Vec::new(),
            weights: Vec::new(),
            sequences: 0,
            steps: WINDOW,
        };
        match self.windows {
            Windows::Drawn { seed, turns } => {
                let mut random = ChaCha12Rng::seed_from_u64(seed);
                random.set_stream(number);
                for _ in 0..self.sequences {
                    let place = self.places[random.random_range(0..self.places.len())];
                    let turn = draw_turn(turns, &mut random);
                    self.window(place, &turn, &mut batch);
                }
            }
            Windows::InOrder => {
                let first = number as usize * self.sequences;
                for place in self.places.iter().skip(first).take(self.sequences) {
                    self.window(*place, &UnitQuaternion::identity(), &mut batch);
                }
            }
        }
        Ok(batch)
    }
}

/// Uniform among the turns (Shoemake 1992 for all of them).
fn draw_turn(turns: Turns, random: &mut ChaCha12Rng) -> UnitQuaternion<f64> {
    let [u, v, w]: [f64; 3] = [random.random(), random.random(), random.random()];
    let angle = |part: f64| std::f64::consts::TAU * part;
    match turns {
        Turns::None => UnitQuaternion::identity(),
        Turns::Heading => UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle(u)),
        Turns::Any => {
            let ((a, b), (c, d)) = (angle(v).sin_cos(), angle(w).sin_cos());
            let (left, right) = ((1.0 - u).sqrt(), u.sqrt());
            UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
                right * d,
                left * a,
                left * b,
                right * c,
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::{Reading, Scheme, SensorFrame, SensorTrajectory};
    use cromosim_spatial::Stamp;
    use nalgebra::Isometry3;

    use super::*;
    use crate::{PairNames, SiteMotion};

    /// A motion whose device reads what is ideal, but for a gap.
    pub fn pair(seconds: f64) -> Pair {
        let frame = |k: u32| {
            let t = f64::from(k) / 120.0;
            let at = Vector3::new(
                0.3 * (3.0 * t).sin(),
                0.2 * (2.0 * t).cos(),
                1.0 + 0.1 * (5.0 * t).sin(),
            );
            SensorFrame::new(
                Stamp::from_seconds(t),
                Isometry3::new(at, Vector3::new((2.0 * t).sin(), (1.3 * t).cos(), 0.4)),
            )
        };
        let trajectory =
            SensorTrajectory::new((0..(seconds * 120.0) as u32).map(frame).collect()).unwrap();
        let motion = SiteMotion::rigid(&trajectory, Scheme::Spline).unwrap();
        let stamps: Vec<Stamp> = motion
            .kinematics
            .iter()
            .map(|sample| sample.stamp)
            .collect();
        let ideal = motion.kinematics.iter().map(|sample| sample.imu());
        let readings: Vec<Reading> = ideal.map(|imu| imu.reading()).collect();
        let names = PairNames {
            name: "test".to_owned(),
            subject: "s".to_owned(),
            position: "p".to_owned(),
        };
        let mut pair = Pair::new(names, motion.clone(), &motion, &stamps, &readings).unwrap();
        pair.leave_out(|sample| (150..170).contains(&sample));
        pair
    }

    #[test]
    fn batches_are_their_numbers_and_gaps_do_not_count() {
        let pairs = [pair(6.0), pair(1.6)];
        let windows = Windows::Drawn {
            seed: 4,
            turns: Turns::Any,
        };
        let batches =
            PairBatches::new(&pairs, Input::Residual, Quantity::Acceleration, 8, windows).unwrap();
        let one = batches.batch(3).unwrap();
        assert_eq!(one, batches.batch(3).unwrap());
        assert_ne!(one, batches.batch(4).unwrap());
        assert_eq!(
            (one.sequences, one.steps, one.inputs.len()),
            (8, WINDOW, 8 * WINDOW * 33)
        );
        assert!(one.weights.contains(&0.0) && one.inputs.iter().all(|value| value.is_finite()));
        // The device reads what is ideal: nothing is left to learn on top of the analytic value.
        let left = one
            .targets
            .iter()
            .fold(0.0_f32, |most, value| most.max(value.abs()));
        assert!(left < 0.02, "{left}");
    }

    #[test]
    fn in_order_every_window_comes_once() {
        let pairs = [pair(6.0), pair(2.0)];
        let batches = PairBatches::new(
            &pairs,
            Input::Points,
            Quantity::AngularVelocity,
            3,
            Windows::InOrder,
        )
        .unwrap();
        let sequences: usize = (0..batches.count())
            .map(|number| batches.batch(number).unwrap().sequences)
            .sum();
        assert_eq!(sequences, batches.windows());
        let targets = batches.batch(0).unwrap().targets;
        let expected = pairs[0]
            .target(
                5,
                Quantity::AngularVelocity,
                false,
                &UnitQuaternion::identity(),
            )
            .unwrap();
        assert_eq!(targets[15..18], expected);
    }

    #[test]
    fn turns_are_uniform() {
        let mut random = ChaCha12Rng::seed_from_u64(1);
        let mut mean = |turns| {
            (0..4000)
                .map(|_| draw_turn(turns, &mut random) * Vector3::new(1.0, 2.0, 3.0))
                .sum::<Vector3<f64>>()
                / 4000.0
        };
        assert!(mean(Turns::Any).norm() < 0.2);
        assert!((mean(Turns::Heading) - Vector3::new(0.0, 0.0, 3.0)).norm() < 0.2);
        assert!((mean(Turns::None) - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-9);
    }
}
