//! Poses that were interpolated along straight chords between frames of a lower rate.

use std::f64::consts::TAU;

use crate::PoseSeries;
use crate::chords::Chords;
use crate::golden::greatest_near;
use crate::kinks::{Kinks, second_differences};

/// Poses per frame below which frames cannot be told from poses. No source.
const LEAST_POSES_PER_FRAME: f64 = 1.15;
/// How much better chords have to fit (natural logarithm of the two misfits' product) than those of
/// half their rate, whose frames are fewer. No source.
const BETTER: f64 = 0.2;
/// The same of a rate above half the poses', whose frames are nearly as many as these. No source.
const BETTER_HIDDEN: f64 = 0.06;
/// How much better chords have to fit than the same half an interval later. The least, and times the
/// number of poses: thirty nats are beyond chance. No source.
const BETTER_THAN_SHIFTED: f64 = 0.02;
const BETTER_THAN_SHIFTED_NATS: f64 = 30.0;
/// Mean squares off the chords that matter, as a part of those of second differences. No source.
const RELEVANT_PART: f64 = 1e-2;
/// How far the frames may be from where the kinks say that they are, in intervals, and how sharp they
/// are found. No source.
const NEAR_TURNS: f64 = 0.2;
const PRECISION_TURNS: f64 = 3e-3;
/// Poses that the frames' offset is found from: more only cost time.
const ENOUGH_POSES: usize = 3000;
/// Second differences within a chord that tell how noisy the poses are; with fewer nothing does.
const LEAST_WITHIN: usize = 50;
/// Most that poses are off their chords, as a multiple of the noise that they show within them; a curve
/// between the frames is farther off. No source.
const MOST_OFF: f64 = 2.0;
/// And as a part of all second differences, where there is hardly any noise. No source.
const MOST_OFF_PART: f64 = 0.02;

/// The times of the frames between which poses were interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameGrid {
    /// Frames per second.
    rate_hz: f64,
    /// Of the first frame after the first pose, since that pose, s.
    offset_s: f64,
}

impl FrameGrid {
    /// The frames that the poses show: between two of them second differences vanish but for noise,
    /// and at each they do not. None where the poses are frames themselves, or follow a curve.
    pub fn find(poses: &PoseSeries) -> Option<Self> {
        let kinks = Kinks::new(poses)?;
        let shown_hz = kinks.strongest_rate()?;
        let highest_hz = kinks.poses_hz() / LEAST_POSES_PER_FRAME;
        // A rate shows as itself or, above half the poses' rate, as what it lacks of that.
        let hidden_hz = kinks.poses_hz() - shown_hz;
        let (mut misfit, mut grid) = Self::through(&kinks, poses, shown_hz);
        if hidden_hz <= highest_hz {
            let (of_hidden, hidden) = Self::through(&kinks, poses, hidden_hz);
            if of_hidden < misfit - BETTER_HIDDEN {
                (misfit, grid) = (of_hidden, hidden);
            }
        }
        // Its double may stand out more than itself.
        let (of_half, half) = Self::through(&kinks, poses, grid.rate_hz / 2.0);
        let found = if of_half < misfit + BETTER {
            half
        } else {
            grid
        };
        Some(found).filter(|grid| grid.is_convincing(&kinks, poses))
    }

    /// The frames of a rate that is known already; none where the poses do not show them.
    pub fn at_rate(poses: &PoseSeries, rate_hz: f64) -> Option<Self> {
        let kinks = Kinks::new(poses)?;
        let is_possible = rate_hz * LEAST_POSES_PER_FRAME <= kinks.poses_hz();
        (is_possible && kinks.have_rate(rate_hz))
            .then(|| Self::through(&kinks, poses, kinks.sharpened(rate_hz)).1)
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The frames themselves, by least squares.
    pub fn frames(&self, poses: &PoseSeries) -> PoseSeries {
        Chords::fit(poses, self.rate_hz, self.offset_s).into_frames()
    }

    /// With frames where the kinks of this rate come, sharpened to where poses are least off the
    /// chords, and how far they are.
    fn through(kinks: &Kinks, poses: &PoseSeries, rate_hz: f64) -> (f64, Self) {
        let turns = -kinks.wave(rate_hz).arg() / TAU;
        let grid = |turns: f64| Self {
            rate_hz,
            offset_s: turns.rem_euclid(1.0) / rate_hz,
        };
        let part = middle(poses);
        let since = part.stamps[0] - poses.stamps[0];
        let misfit = |turns: f64| grid(turns - since * rate_hz).misfit(kinks, &part);
        let turns = greatest_near(|turns| -misfit(turns), turns, NEAR_TURNS, PRECISION_TURNS);
        (misfit(turns), grid(turns))
    }

    /// ln of how far poses are off the chords, both kinds of misfit together.
    fn misfit(&self, kinks: &Kinks, poses: &PoseSeries) -> f64 {
        let chords = Chords::fit(poses, self.rate_hz, self.offset_s);
        (0..2)
            .map(|of| chords.misfit[of] + RELEVANT_PART * kinks.mean_squares[of] + 1e-300)
            .map(f64::ln)
            .sum()
    }

    fn is_convincing(&self, kinks: &Kinks, poses: &PoseSeries) -> bool {
        let shifted = Self {
            offset_s: (self.offset_s + 0.5 / self.rate_hz) % (1.0 / self.rate_hz),
            ..*self
        };
        let chance = BETTER_THAN_SHIFTED_NATS / (1.5 * poses.stamps.len() as f64);
        let gain = shifted.misfit(kinks, poses) - self.misfit(kinks, poses);
        gain > chance.max(BETTER_THAN_SHIFTED) && self.is_straight(poses)
    }

    /// Whether the poses lie on the chords as well as their noise lets them, which their second
    /// differences within a chord tell: white noise has six times its variance there.
    fn is_straight(&self, poses: &PoseSeries) -> bool {
        let seconds = poses.seconds();
        let frame = |k: usize| ((seconds[k] - self.offset_s) * self.rate_hz).floor();
        let (mut within, mut all) = ([0.0; 2], [0.0; 2]);
        let (mut within_count, mut count) = (0, 0);
        for k in 1..seconds.len() - 1 {
            let Some(differences) = second_differences(poses, &seconds, k) else {
                continue;
            };
            let is_within = frame(k - 1) == frame(k + 1);
            within_count += usize::from(is_within);
            count += 1;
            for of in 0..2 {
                let square = differences[of].norm_squared() / 18.0;
                all[of] += square;
                within[of] += if is_within { square } else { 0.0 };
            }
        }
        if within_count < LEAST_WITHIN {
            return true;
        }
        let chords = Chords::fit(poses, self.rate_hz, self.offset_s);
        (0..2).all(|of| {
            let noise = within[of] / within_count as f64;
            chords.misfit[of] <= MOST_OFF * noise + MOST_OFF_PART * all[of] / count as f64
        })
    }
}

/// A stretch of poses that is long enough to place the frames by.
fn middle(poses: &PoseSeries) -> PoseSeries {
    let count = poses.stamps.len().min(ENOUGH_POSES);
    let first = (poses.stamps.len() - count) / 2;
    let own = first..first + count;
    PoseSeries {
        stamps: poses.stamps[own.clone()].to_vec(),
        positions: poses.positions[own.clone()].to_vec(),
        rotations: poses.rotations[own].to_vec(),
    }
}

#[cfg(test)]
#[path = "frame_grid_tests.rs"]
mod tests;
