//! Poses that were interpolated along straight chords between frames of a lower rate.

use std::f64::consts::TAU;

use crate::chord_images;
use crate::chords::Chords;
use crate::golden::greatest_near;
use crate::kinks::{Kinks, LEAST_HZ, second_differences};
use crate::{PoseNoise, PoseSeries};

/// Poses over which second differences are taken, in turn until kinks show: those of slow frames drown in the noise
/// between neighbours. Eight are half of a chord of the slowest frames (8 Hz) in poses of 128 Hz. No source.
const STRIDES: [usize; 4] = [1, 2, 4, 8];
/// Poses per frame below which frames cannot be told from poses. No source.
const LEAST_POSES_PER_FRAME: f64 = 1.5;
/// Poses per frame from which on the frames are told well enough to stand for the poses: below, least
/// squares make more noise than the chords cost. Found on a motion of CMU at 100 Hz with frames at 59 Hz.
const LEAST_TO_RESTORE: f64 = 2.0;
/// Multiples of a rate that may stand out more than itself. No source.
const HIGHEST_MULTIPLE: u32 = 8;
/// Height of the rate's own line then, over the median of its surroundings: of white noise one in 4000
/// reaches it. No source.
const LEAST_FUNDAMENTAL: f64 = 12.0;
/// How much better chords have to fit (natural logarithm of the two misfits' product) than those of a
/// part of their rate, whose frames are fewer. No source.
const BETTER: f64 = 0.2;
/// The same of any other lower rate. No source.
const BETTER_HIDDEN: f64 = 0.06;
/// How much better chords have to fit than the same half an interval later. The least, and times the
/// number of poses: thirty nats are beyond chance. No source.
const BETTER_THAN_SHIFTED: f64 = 0.1;
const BETTER_THAN_SHIFTED_NATS: f64 = 30.0;
/// The same in nats alone where noise covers nearly all of the kinks: as much as there is to gain is little then. Ten times
/// the thirty; two that had gone unseen (tests/withheld, seed 1032) had 600 and 850.
const BETTER_IN_NOISE_NATS: f64 = 300.0;
/// And how far poses may be off their chords then, as a multiple of the noise within these. Theirs are 0.98 to 1.00.
const OFF_IN_NOISE: f64 = 1.03;
/// Mean squares off the chords that matter, as a part of those of second differences. No source.
const RELEVANT_PART: f64 = 1e-2;
/// How far the frames may be from where the kinks say that they are, in intervals, and how sharp they
/// are found. No source.
const NEAR_TURNS: f64 = 0.2;
const PRECISION_TURNS: f64 = 3e-3;
/// The same once rate and offset are found that sharply. No source.
const SHARP_TURNS: f64 = 0.03;
const SHARPEST_TURNS: f64 = 1e-4;
/// Poses that the frames' offset is found from: more only cost time.
const ENOUGH_POSES: usize = 3000;
/// Second differences within a chord that tell how noisy the poses are; with fewer nothing does.
const LEAST_WITHIN: usize = 50;
/// Most that poses are off their chords, as a multiple of the noise that they show within them; a curve
/// between the frames is farther off. No source.
const MOST_OFF: f64 = 2.0;
/// The same where kinks drown between neighbours: true chords had 1.00 to 1.03 (tests/withheld/other_origin.py, seed 11), a
/// gait under much noise 1.3 (tests/withheld, seed 75). Made pulses had less, which their repetition tells.
const MOST_OFF_IN_NOISE: f64 = 1.15;
/// Of second differences over two poses, over those of neighbours, between which noise has a memory: white noise has 1, and one
/// whose memory does not end 2; a curve has 16. No source for the margins.
const LEAST_OF_MEMORY: f64 = 1.2;
const MOST_OF_MEMORY: f64 = 2.1;
/// What of an error is left in the next at most.
const LONGEST_MEMORY: f64 = 0.95;
/// Poses on a chord of which the noise is reckoned, at most: more only cost time.
const MOST_ON_CHORD: usize = 32;
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
        let strides = STRIDES.into_iter();
        strides
            .filter_map(|stride| Kinks::new(poses, stride))
            .find_map(|kinks| Self::from_kinks(&kinks, poses))
    }

    fn from_kinks(kinks: &Kinks, poses: &PoseSeries) -> Option<Self> {
        let shown_hz = kinks.strongest_rate()?;
        let mut best: Option<(f64, Self)> = None;
        for hz in candidates(kinks, shown_hz) {
            let (misfit, grid) = Self::through(kinks, poses, hz);
            let is_better = best.as_ref().is_none_or(|(least, best)| {
                let ratio = grid.rate_hz / best.rate_hz;
                let is_multiple = (ratio - ratio.round()).abs() < 1e-2;
                misfit < least - if is_multiple { BETTER } else { BETTER_HIDDEN }
            });
            if is_better {
                best = Some((misfit, grid));
            }
        }
        let found = best
            .map(|(_, grid)| grid.sharpened(poses))
            .filter(|grid| grid.is_convincing(kinks, poses))?;
        Some(found.with_fewer_frames(kinks, poses).unwrap_or(found))
    }

    /// The slowest part of the rate that stands out too and has chords that poses are off by hardly more: narrow kinks
    /// have many multiples, and a high one of them may stand out most. Or by more, where its own kinks stand out as well as any
    /// and the next multiple, most of whose frames are elsewhere, fits better still: noise with a memory lies near chords that are
    /// short.
    fn with_fewer_frames(&self, kinks: &Kinks, poses: &PoseSeries) -> Option<Self> {
        let parts = (2..=(self.rate_hz / LEAST_HZ) as u32).rev();
        parts
            .map(|part| (self.rate_hz / f64::from(part), part))
            .filter(|(hz, _)| kinks.height(*hz) > LEAST_FUNDAMENTAL)
            .map(|(hz, part)| (Self::through(kinks, poses, hz).1.sharpened(poses), part))
            .find(|(grid, part)| {
                let own = self.misfit(kinks, poses);
                let is_as_near = || grid.misfit(kinks, poses) < own + BETTER;
                let is_not_nearer = || {
                    // The frames of this multiple are not among those of the next.
                    let next = Self {
                        rate_hz: grid.rate_hz * f64::from(part + 1),
                        offset_s: grid.offset_s % (grid.rate_hz * f64::from(part + 1)).recip(),
                    };
                    let can_be = next.rate_hz * LEAST_POSES_PER_FRAME < kinks.poses_hz();
                    kinks.have_rate(grid.rate_hz) && can_be && next.misfit(kinks, poses) < own
                };
                (is_as_near() || is_not_nearer()) && grid.is_convincing(kinks, poses)
            })
            .map(|(grid, _)| grid)
    }

    /// The frames of a rate that is known already; none where the poses do not show them.
    pub fn at_rate(poses: &PoseSeries, rate_hz: f64) -> Option<Self> {
        let of_strides = STRIDES.into_iter();
        let kinks = of_strides
            .filter_map(|stride| Kinks::new(poses, stride))
            .take_while(|kinks| rate_hz * LEAST_POSES_PER_FRAME <= kinks.poses_hz())
            .find(|kinks| kinks.have_rate(rate_hz))?;
        let (_, grid) = Self::through(&kinks, poses, kinks.sharpened(rate_hz));
        Some(grid.sharpened(poses))
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The frames themselves, by least squares; where these are so many that they would be noisier than
    /// the poses, the poses moved from the chords to a curve through the frames.
    pub fn frames(&self, poses: &PoseSeries) -> PoseSeries {
        let seconds = poses.seconds();
        let span = seconds.last().copied().unwrap_or(0.0);
        let chords = Chords::fit(poses, self.rate_hz, self.offset_s);
        if (seconds.len() as f64) < LEAST_TO_RESTORE * self.rate_hz * span {
            chords.onto_curve(poses)
        } else {
            chords.into_frames()
        }
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

    /// With the rate and the offset at which the first and the last poses are least off the chords. Kinks
    /// tell of them to a sample's fraction; a thousandth of an interval moves poses without noise by more
    /// than all else does.
    fn sharpened(self, poses: &PoseSeries) -> Self {
        let count = poses.stamps.len().min(ENOUGH_POSES);
        let last = poses.stamps.len() - count;
        let late = |first: usize| {
            let part = part(poses, first, count);
            let since = part.stamps[0] - poses.stamps[0];
            let off = |turns: f64| {
                let offset_s = self.offset_s - since + turns / self.rate_hz;
                let offset_s = offset_s.rem_euclid(1.0 / self.rate_hz);
                let [place, turn] = Chords::fit(&part, self.rate_hz, offset_s).misfit;
                -(place + f64::MIN_POSITIVE).ln() - (turn + f64::MIN_POSITIVE).ln()
            };
            let turns = greatest_near(off, 0.0, SHARP_TURNS, SHARPEST_TURNS);
            let middle = since + 0.5 * (part.stamps[count - 1] - part.stamps[0]);
            (middle, turns / self.rate_hz)
        };
        let (at_first, first) = late(0);
        let slope = if last > 0 {
            let (at_last, last) = late(last);
            (last - first) / (at_last - at_first)
        } else {
            0.0
        };
        let rate_hz = self.rate_hz / (1.0 + slope);
        let offset_s = self.offset_s + first + slope * (self.offset_s - at_first);
        Self {
            rate_hz,
            offset_s: offset_s.rem_euclid(1.0 / rate_hz),
        }
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
        let scatter = self.scatter(poses);
        let chords = Chords::fit(poses, self.rate_hz, self.offset_s);
        let off = chords.misfit;
        let of_nats = |nats: f64| nats / (1.5 * poses.stamps.len() as f64);
        let needed = if kinks.is_of_neighbours() || !scatter.covers(off) {
            BETTER_THAN_SHIFTED.max(of_nats(BETTER_THAN_SHIFTED_NATS))
        } else {
            of_nats(BETTER_IN_NOISE_NATS).min(BETTER_THAN_SHIFTED)
        };
        shifted.misfit(kinks, poses) - self.misfit(kinks, poses) > needed
            && kinks.are_marked(self.rate_hz)
            && (kinks.is_of_neighbours() || !kinks.is_harmonic(self.rate_hz))
            && scatter.lets_be_straight(off, kinks.is_of_neighbours())
            && !chord_images::are_missing(poses, self.rate_hz, self.offset_s)
    }

    /// White noise of poses between two frames, which their second differences within a chord tell: what
    /// was added behind the interpolation. None where too few are within one.
    pub fn noise_within(&self, poses: &PoseSeries) -> Option<PoseNoise> {
        let [position, rotation] = self.scatter(poses).within?.map(f64::sqrt);
        Some(PoseNoise { position, rotation })
    }

    /// White noise has six times its variance in second differences, along or about each of three axes.
    fn scatter(&self, poses: &PoseSeries) -> Scatter {
        let seconds = poses.seconds();
        let frame = |k: usize| ((seconds[k] - self.offset_s) * self.rate_hz).floor();
        // Of neighbours, and of every second one.
        let (mut within, mut all) = ([[0.0; 2]; 2], [0.0; 2]);
        let (mut within_count, mut count) = ([0; 2], 0);
        for (which, stride) in [1, 2].into_iter().enumerate() {
            for k in stride..seconds.len().saturating_sub(stride) {
                let Some(differences) = second_differences(poses, &seconds, k, stride) else {
                    continue;
                };
                let is_within = frame(k - stride) == frame(k + stride);
                within_count[which] += usize::from(is_within);
                count += usize::from(stride == 1);
                for (of, difference) in differences.iter().enumerate() {
                    let square = difference.norm_squared() / 18.0;
                    all[of] += if stride == 1 { square } else { 0.0 };
                    within[which][of] += if is_within { square } else { 0.0 };
                }
            }
        }
        let mean = |which: usize| {
            let count = within_count[which];
            (count >= LEAST_WITHIN).then(|| within[which].map(|sum| sum / count as f64))
        };
        let span = seconds.last().copied().unwrap_or(0.0);
        let poses_per_frame = (seconds.len() - 1) as f64 / (span * self.rate_hz);
        Scatter {
            within: mean(0),
            about_chords: mean(0).map(|own| {
                let wider = mean(1).unwrap_or(own);
                std::array::from_fn(|of| about_chord([own[of], wider[of]], poses_per_frame))
            }),
            all: all.map(|sum| sum / count.max(1) as f64),
        }
    }
}

/// Variance about a chord over so many poses of noise whose second differences, of neighbours and of every second pose, are
/// those of white noise of two variances. With a memory m of the first order these are `V (1 - m) (3 - m) / 3` and
/// `V (1 - m^2) (3 - m^2) / 3` of its own variance V: the longer it lasts, the less of it neighbours show. The rest of white noise
/// about a line through n poses is `1 - 2 / n` of it, which is left out, as in what poses are off by.
fn about_chord([own, wider]: [f64; 2], poses: f64) -> f64 {
    let ratio = wider / own;
    if !(LEAST_OF_MEMORY..MOST_OF_MEMORY).contains(&ratio) {
        return own;
    }
    let of_memory = |m: f64| (1.0 + m) * (3.0 - m * m) / (3.0 - m);
    let (mut low, mut high) = (0.0, LONGEST_MEMORY);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if of_memory(middle) < ratio {
            low = middle;
        } else {
            high = middle;
        }
    }
    let variance = own * 3.0 / ((1.0 - low) * (3.0 - low));
    let n = (poses.round() as usize).clamp(3, MOST_ON_CHORD);
    variance * about_line(low, n) / about_line(0.0, n)
}

/// Mean square about the least-squares line through n entries of unit noise with a memory.
fn about_line(memory: f64, n: usize) -> f64 {
    let centre = 0.5 * (n as f64 - 1.0);
    let from_centre = |k: usize| k as f64 - centre;
    let spread: f64 = (0..n).map(|k| from_centre(k).powi(2)).sum();
    let on_line = |i: usize, j: usize| {
        let part = 1.0 / n as f64 + from_centre(i) * from_centre(j) / spread;
        part * memory.powi(i.abs_diff(j) as i32)
    };
    let all: f64 = (0..n)
        .flat_map(|i| (0..n).map(move |j| on_line(i, j)))
        .sum();
    1.0 - all / n as f64
}

/// Variances that second differences show as if they were those of white noise: m2, rad2.
struct Scatter {
    /// Of those within a chord; none where these are few.
    within: Option<[f64; 2]>,
    /// And what they leave about chords, with what memory they show.
    about_chords: Option<[f64; 2]>,
    all: [f64; 2],
}

impl Scatter {
    /// Whether poses that are so far off their chords lie on them as well as their noise lets them.
    fn lets_be_straight(&self, off: [f64; 2], shows_between_neighbours: bool) -> bool {
        let most = if shows_between_neighbours {
            MOST_OFF
        } else {
            MOST_OFF_IN_NOISE
        };
        self.about_chords.is_none_or(|noise| {
            (0..2).all(|of| off[of] <= most * noise[of] + MOST_OFF_PART * self.all[of])
        })
    }

    /// Whether they are off by no more than that noise.
    fn covers(&self, off: [f64; 2]) -> bool {
        self.within
            .is_some_and(|within| (0..2).all(|of| off[of] <= OFF_IN_NOISE * within[of]))
    }
}

/// Rates of kinks that show as a line, the lowest first: as itself or, above half the poses' rate, as
/// what it lacks of that; or a multiple of a rate that shows too, as narrow kinks have many.
fn candidates(kinks: &Kinks, shown_hz: f64) -> Vec<f64> {
    let poses_hz = kinks.poses_hz();
    let highest_hz = poses_hz / LEAST_POSES_PER_FRAME;
    let lines = [shown_hz, poses_hz - shown_hz, poses_hz + shown_hz];
    let mut candidates: Vec<f64> = (1..=HIGHEST_MULTIPLE)
        .flat_map(|multiple| lines.map(|hz| (hz / f64::from(multiple), multiple)))
        .filter(|(hz, multiple)| {
            *hz <= highest_hz && (*multiple == 1 || kinks.height(*hz) > LEAST_FUNDAMENTAL)
        })
        .map(|(hz, _)| hz)
        .collect();
    candidates.sort_unstable_by(f64::total_cmp);
    candidates
}

/// A stretch of poses that is long enough to place the frames by.
fn middle(poses: &PoseSeries) -> PoseSeries {
    let count = poses.stamps.len().min(ENOUGH_POSES);
    part(poses, (poses.stamps.len() - count) / 2, count)
}

fn part(poses: &PoseSeries, first: usize, count: usize) -> PoseSeries {
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
