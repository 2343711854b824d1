//! Smoothing that follows the motion: how much is learnt around each time.

use crate::SpatialError;
use crate::equations::{IntervalWeights, SplineEquations};
use crate::fourth_differences::{MEDIAN_OF_SQUARE, fourth_difference, white_noise_variance};
use crate::kernel::{Evidence, Kernel};
use crate::local_spline::{LocalSolution, Series, Statements};
use crate::low_passed::{LowPassed, LowPassedLanes, LowPassedSamples};
use crate::weight_search::LOWEST_LOG_WEIGHT;
use crate::wide::{Four, add_product, add_scaled, divided, formula, multiply, scaled, widest};

/// Time over which neighbours share one drive, standard deviation, s: shorter, a burst's own noise
/// decides; longer, a burst's start is smoothed away. Chosen among 0.05, 0.1, 0.15 and 0.25 s on
/// motions like those of `tests/bursts`, none of them among its own.
const SHARED_DRIVE_S: f64 = 0.1;
/// What the drive right around an interval says beside that, standard deviation in intervals, and
/// what the drive over [`SHARED_DRIVE_S`] counts beside it, in intervals that are free: an impact is
/// over within some frames. Chosen among 1.5 to 3 and 0.1 to 10 on draws of the physics' motions of
/// `bags/truth` and of bursts that no test and no study draws.
const NEAR_DRIVE_INTERVALS: f64 = 2.0;
const NEAR_DRIVE_COUNT: f64 = 1.0;
/// The same as [`SHARED_DRIVE_S`] of the noise, which changes more slowly: markers come and go. Longer,
/// a clip's ends change its middle (`tests/cuts.rs`: with 0.3 s by 2.5 % of the signal rather than 0.9).
/// Chosen among 0.12 to 0.5 s on joints of recorded walks and dances, the clips of that test among them.
const SHARED_NOISE_S: f64 = 0.15;
/// The noise over this standard deviation, in intervals, is what is shared, as the fourth power of
/// the mean of its fourth roots: the few frames of an impact, which no spline follows, are not taken
/// for noise of all that is around. Chosen among the powers 0.1 to 1 as [`NEAR_DRIVE_INTERVALS`].
const NEAR_NOISE_INTERVALS: f64 = 2.0;
/// The same of the vigour, s. Longer, cuts differ more from the whole (0.5 s: a specific force of 95 %
/// 0.025 rather than 0.012 in `tests/every_clip.rs`).
const SHARED_VIGOUR_S: f64 = 0.2;
/// Band that holds a body's accelerations, Hz: their mean square, spread over it, is their density at
/// low frequencies. Chosen among 1.5, 3, 5 and 8 Hz on the studies of `evaluate fidelity`: larger, the
/// ends are held too still.
const VIGOUR_BAND_HZ: f64 = 3.0;
/// Cutoff of the vigour that is expected beyond that, Hz: bodies at rest start to move. Chosen among
/// 1 to 6 Hz on the same studies: smaller, rests are stated to be far more certain than they are.
const LEAST_VIGOUR_CUTOFF_HZ: f64 = 4.0;
/// The same in intervals at least: fewer say too little. No source.
const LEAST_SHARED_INTERVALS: f64 = 5.0;
/// Cutoff of the motion that is expected where the samples say nothing, Hz, and what this counts
/// beside them, in intervals: bodies at rest sway, and those that move have most of their motion
/// below 6 Hz. Without it stretches at rest are taken for dead still, and the first samples of the
/// next burst lie far outside of what the estimate states. Chosen as [`SHARED_DRIVE_S`].
const EXPECTED_CUTOFF_HZ: f64 = 6.0;
const EXPECTED_COUNT: f64 = 0.01;
/// Cutoff from which the search starts, Hz. From below (6 Hz), bursts are first taken for noise and
/// some stay it; from 18 Hz it finds the same. Chosen on seeds 100 to 147 of `tests/bursts`, which
/// scores others.
const FIRST_CUTOFF_HZ: f64 = 12.0;
/// Rate at which a noise is stated, Hz: white noise of the same density has a variance that grows
/// with the rate.
pub(crate) const STATED_AT_HZ: f64 = 100.0;
/// Steps towards the greatest likelihood. More hardly change the error, and carry what a clip's ends
/// say farther inwards. Chosen among 3 to 40 as [`FIRST_CUTOFF_HZ`].
const STEPS: usize = 4;
/// After so many of them noise that was low-passed before is taken for what it is. From the first on, white
/// noise beside it is taken for motion above the corner and passed (0.3 mm at 120 Hz: six times the
/// practice's error), only in the last, a foot that chatters is not found. Chosen as `FLOOR` in `low_passed.rs`.
const STEPS_AS_WHITE: usize = 2;
/// With fewer samples noise and motion cannot be told apart; live, the first sample is due with the
/// eleventh frame.
pub(crate) const FEWEST_ADAPTIVE: usize = 8;
/// Least part of an observation that decides about the noise or the drive, against division by
/// nothing.
const LEAST_FREE: f64 = 1e-7;
/// Least standard deviation of the noise, as a part of the samples' range: rounding; and at all.
const LEAST_NOISE: f64 = 1e-11;
const LEAST_NOISE_AT_ALL: f64 = 1e-15;
/// Largest weight, a cutoff of a sixtieth of the samples' rate: where weights differ from interval to
/// interval, larger ones leave too few of the sixteen digits.
const LARGEST_WEIGHT: f64 = 1e10;

/// Noise that is expected of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExpectedNoise {
    /// Standard deviation at 100 Hz (at other rates of the same density, as the root of the rate), in
    /// the samples' unit; 0 where nothing is expected.
    pub std: f64,
    /// What it counts beside the samples around each time, in samples: little where they show their
    /// noise, more where it was filtered before.
    pub count: f64,
    /// What a low-pass has made of it; none where it is white. The standard deviation is then that of
    /// white noise as dense at low frequencies.
    pub low_passed: Option<LowPassed>,
}

/// What is learnt of a series: how strongly the motion is driven around each time, and how large
/// the noise is there.
///
/// Model: the samples are `y = f + n`, n white of variance r(t), and the fifth derivative of f is
/// white noise of density s(t); with one r and s for all times f is the smoothing spline of weight r
/// / s (Wahba 1978). All channels share both. One step is a step of expectation and maximisation in
/// MacKay's form: with f the spline under the present r and s, and V its variance,
/// ```text
/// s(t) = sum_k K(t - t_k) |f5_k|^2      / sum_k K(t - t_k) (1 - V(f5_k) / s_k)        f5_k the fifth derivative over interval k
/// r(t) = sum_k K(t - t_k) |y_k - f_k|^2 / sum_k K(t - t_k) (1 - V(f_k) / r_k)
/// ```
/// Beside it the second derivative of f is held to be no larger than around: white noise of density
/// `v(t) = sum_k K(t - t_k) |f2_k|^2 / sum_k K(t - t_k) / (2 b)`, b the band of a body's accelerations.
/// This keeps a clip's ends, which have samples on one side only, from taking noise for motion.
///
/// To each sum what is expected is added with its count, see the constants above. An impact drives
/// the motion for some frames alone, and leaves residuals that are no noise. So s(t) is the mean of
/// what the nearest intervals say and of s(t) as above, which counts [`NEAR_DRIVE_COUNT`]; and r(t) is
/// the mean over K of the fourth roots of such sums over the nearest samples, to the fourth power.
/// K is a symmetric kernel, so that what is learnt at t depends on the samples near t alone: the
/// same seconds of a longer series give the same estimate.
///
/// Several series on the same times are learnt at once, a lane each; none knows of the others.
#[derive(Clone, Debug)]
pub(crate) struct Adaptation<const L: usize> {
    /// Density of the fifth derivative over each knot interval, unit^2 per interval^9.
    drive: Vec<[f64; L]>,
    /// Density of the second derivative at low frequencies over each knot interval, unit^2 per
    /// interval^3.
    vigour: Vec<[f64; L]>,
    /// What is expected beyond it, in units of the noise's variance.
    least_vigour: f64,
    /// Variance of each sample's noise, unit^2.
    noise: Vec<[f64; L]>,
    least_noise: [f64; L],
    /// Variance that is expected of the noise, unit^2, and what it counts, in samples.
    expected_noise: [[f64; 2]; L],
    /// Where noise was low-passed before; r is then its variance as white noise of the density that it
    /// has at low frequencies.
    low_passed: [Option<LowPassedSamples>; L],
}

impl<const L: usize> Adaptation<L> {
    /// The start: noise as fourth differences show it, and one motion at all times.
    fn start<const C: usize>(
        equations: &SplineEquations,
        series: &Series<C, L>,
        expected: [ExpectedNoise; L],
    ) -> Self {
        let least_noise =
            ranges(series).map(|range| (LEAST_NOISE * range).max(LEAST_NOISE_AT_ALL).powi(2));
        let shown = fourth_difference_variances(series);
        let noise: [f64; L] = std::array::from_fn(|lane| shown[lane].max(least_noise[lane]));
        let drive = noise.map(|noise| noise / equations.weight_of_cutoff(FIRST_CUTOFF_HZ));
        Self {
            drive: vec![drive; equations.interval_count()],
            vigour: vec![[f64::INFINITY; L]; equations.interval_count()],
            least_vigour: equations
                .second_weight_of_cutoff(LEAST_VIGOUR_CUTOFF_HZ)
                .recip(),
            noise: vec![noise; series.values.len()],
            least_noise,
            expected_noise: expected.map(|expected| {
                let variance = expected.std.powi(2) / (STATED_AT_HZ * equations.interval);
                [variance, if variance > 0.0 { expected.count } else { 0.0 }]
            }),
            low_passed: [None; L],
        }
    }

    /// Learns from whole series; `expected` is that of each lane. With the weights of what was learnt; what
    /// `solution` holds afterwards is of no use.
    pub(crate) fn learn<const C: usize>(
        equations: &SplineEquations,
        series: &Series<C, L>,
        expected: [ExpectedNoise; L],
        solution: &mut LocalSolution<C, L>,
    ) -> Result<(Self, Vec<IntervalWeights<L>>), SpatialError> {
        let mut adaptation = Self::start(equations, series, expected);
        let (mut weighing, mut statements) = (Weighing::default(), Statements::default());
        for step in 0..STEPS {
            if step == STEPS_AS_WHITE {
                adaptation.low_passed =
                    expected.map(|it| it.low_passed.map(|own| own.among(equations)));
            }
            adaptation.weigh(&mut weighing);
            // Not refined: squares are all that is wanted of it.
            solution.solve_and_state(equations, series, &weighing.weights, &mut statements)?;
            adaptation.step(equations, &weighing, &mut statements, Stride::Whole);
        }
        adaptation.weigh(&mut weighing);
        Ok((adaptation, weighing.weights))
    }

    /// Moves on with a window: `dropped` samples have left it at its front, others have come at its
    /// end, to `count`. False where nothing is left of what was learnt.
    pub(crate) fn move_on(&mut self, count: usize, dropped: usize) -> bool {
        let kept = self.noise.len().saturating_sub(dropped);
        if kept < 2 || kept > count {
            return false;
        }
        self.noise.drain(..dropped);
        self.drive.drain(..dropped);
        self.vigour.drain(..dropped);
        let (noise, drive) = (self.noise[kept - 1], self.drive[kept - 2]);
        self.vigour.resize(count - 1, self.vigour[kept - 2]);
        self.noise.resize(count, noise);
        self.drive.resize(count - 1, drive);
        true
    }

    /// Learns from what splines of [`Adaptation::weigh`]'s weights say. Half a step, so that it does not
    /// swing from window to window.
    pub(crate) fn learn_from(
        &mut self,
        equations: &SplineEquations,
        weighing: &Weighing<L>,
        statements: &mut Statements<L>,
    ) {
        self.step(equations, weighing, statements, Stride::Half);
    }

    fn step(
        &mut self,
        equations: &SplineEquations,
        weighing: &Weighing<L>,
        statements: &mut Statements<L>,
        stride: Stride,
    ) {
        widest!(s => {
            self.take_evidence(s, equations, weighing, statements);
            self.update(s, equations, statements, stride);
        });
    }

    /// Variance of each sample's noise, unit^2.
    pub(crate) fn into_noise(self) -> Vec<[f64; L]> {
        self.noise
    }

    /// The penalty's weight over each knot interval: the noise changes so little over a spline's
    /// width that its quotient with the drive may stand for both.
    pub(crate) fn weigh(&self, weighing: &mut Weighing<L>) {
        let count = self.drive.len();
        weighing.weights.resize(count, [[0.0; L]; 2]);
        weighing.noise.resize(count, [0.0; L]);
        if self.low_passed.iter().any(Option::is_some) {
            weighing.density.resize(count, [0.0; L]);
            widest!(s => self.weigh_low_passed(s, weighing));
        } else {
            widest!(s => self.weigh_white(s, weighing));
        }
    }

    #[inline(always)]
    fn weigh_white(&self, s: impl Four, weighing: &mut Weighing<L>) {
        let weights = weighing.weights.iter_mut().zip(&mut weighing.noise);
        for (k, ([fifth, second], noise)) in weights.enumerate() {
            *noise = self.noise_over(s, k);
            *fifth = within_bounds(s, &divided(s, noise, &self.drive[k]));
            *second = self.second_weight(s, k, noise);
        }
    }

    /// The same where the noise of some lanes, or of all, is behind a low-pass.
    #[inline(always)]
    fn weigh_low_passed(&self, s: impl Four, weighing: &mut Weighing<L>) {
        let lowest = s.splat(10f64.powf(LOWEST_LOG_WEIGHT));
        let low_passed = LowPassedLanes::new(self.low_passed);
        let all = self.low_passed.iter().all(Option::is_some);
        let weights = weighing.weights.iter_mut().zip(&mut weighing.noise);
        let weights = weights.zip(&mut weighing.density).enumerate();
        for (k, (([fifth, second], noise), density)) in weights {
            *noise = self.noise_over(s, k);
            let for_white = divided(s, noise, &self.drive[k]);
            let white = within_bounds(s, &for_white);
            *density = low_passed.density(s, &for_white);
            let mut at_cutoff = *density;
            if white != for_white {
                at_cutoff = low_passed.density(s, &white);
            }
            at_cutoff = low_passed.with_floor(s, &at_cutoff);
            *fifth = formula(
                s,
                [&white, &at_cutoff],
                #[inline(always)]
                |[weight, at_cutoff]| s.greater(s.multiply(weight, at_cutoff), lowest),
            );
            let mut own = *noise;
            multiply(s, &mut own, &at_cutoff);
            *second = self.second_weight(s, k, &own);
            if !all {
                let white = [white, self.second_weight(s, k, noise)];
                self.take_white(fifth, &white[0]);
                self.take_white(second, &white[1]);
            }
        }
    }

    /// That of the second derivative, for noise of this variance over a knot interval.
    #[inline(always)]
    fn second_weight(&self, s: impl Four, interval: usize, noise: &[f64; L]) -> [f64; L] {
        let least = s.splat(self.least_vigour);
        formula(
            s,
            [noise, &self.vigour[interval]],
            #[inline(always)]
            |[noise, vigour]| s.divide(noise, s.add(vigour, s.multiply(noise, least))),
        )
    }

    /// Of lanes whose noise is white, these values.
    #[inline(always)]
    fn take_white(&self, values: &mut [f64; L], of_white: &[f64; L]) {
        for lane in 0..L {
            if self.low_passed[lane].is_none() {
                values[lane] = of_white[lane];
            }
        }
    }

    /// Variance of the noise over a knot interval.
    #[inline(always)]
    fn noise_over(&self, s: impl Four, interval: usize) -> [f64; L] {
        formula(
            s,
            [&self.noise[interval], &self.noise[interval + 1]],
            #[inline(always)]
            |[a, b]| s.square_root(s.multiply(a, b)),
        )
    }

    /// A step towards the greatest likelihood.
    #[inline(always)]
    fn update(
        &mut self,
        s: impl Four,
        equations: &SplineEquations,
        Statements {
            drives,
            accelerations,
            residuals,
            room: [near, room],
        }: &mut Statements<L>,
        stride: Stride,
    ) {
        room.resize(residuals.len(), [[0.0; L]; 2]);
        near.clear();
        near.reserve(residuals.len());
        near.extend_from_slice(drives);
        Kernel::new(NEAR_DRIVE_INTERVALS).smooth(s, near, room);
        smooth_shared(s, drives, SHARED_DRIVE_S / equations.interval, room);
        for ((drive, near), around) in self.drive.iter_mut().zip(&*near).zip(&*drives) {
            let found = with_expected(s, near, &mean(s, around), NEAR_DRIVE_COUNT);
            *drive = match stride {
                Stride::Whole => found,
                Stride::Half => std::array::from_fn(|lane| (drive[lane] * found[lane]).sqrt()),
            };
        }
        // White up to half the samples' rate, the same square would be less dense.
        let denser = 0.5 / (equations.interval * VIGOUR_BAND_HZ);
        let shared = SHARED_VIGOUR_S / equations.interval;
        smooth_shared(s, accelerations, shared, room);
        for (vigour, found) in self.vigour.iter_mut().zip(&*accelerations) {
            *vigour = scaled(s, &mean(s, found), denser);
        }
        take_fourth_roots(s, residuals, near, room);
        smooth_shared(s, residuals, SHARED_NOISE_S / equations.interval, room);
        for (noise, found) in self.noise.iter_mut().zip(&*residuals) {
            *noise = formula(
                s,
                [&mean(s, found), &self.least_noise],
                #[inline(always)]
                |[root, least]| {
                    let square = s.multiply(root, root);
                    s.greater(s.multiply(square, square), least)
                },
            );
        }
    }

    /// Turns what each knot interval says about the drive, and each sample about the noise, into
    /// sums of squares and what they count.
    #[inline(always)]
    fn take_evidence(
        &self,
        s: impl Four,
        equations: &SplineEquations,
        weighing: &Weighing<L>,
        Statements {
            drives, residuals, ..
        }: &mut Statements<L>,
    ) {
        let expected = EXPECTED_COUNT / equations.weight_of_cutoff(EXPECTED_CUTOFF_HZ);
        let weights = weighing.weights.iter().zip(&weighing.noise);
        for ([square, variance], ([fifth, _], noise)) in drives.iter_mut().zip(weights) {
            add_scaled(s, square, expected, noise);
            multiply(s, variance, fifth);
            *variance = free_with(s, variance, &[EXPECTED_COUNT; L]);
        }
        if self.low_passed.iter().any(Option::is_some) {
            self.leave_low_passed(s, &weighing.density, residuals);
        }
        let expected: [f64; L] = self.expected_noise.map(|[expected, _]| expected);
        let count: [f64; L] = self.expected_noise.map(|[_, count]| count);
        for [square, variance] in residuals {
            add_product(s, square, &count, &expected);
            *variance = free_with(s, variance, &count);
        }
    }

    /// The share of the residuals that is not free, of noise behind a low-pass.
    #[inline(always)]
    fn leave_low_passed(&self, s: impl Four, density: &[[f64; L]], residuals: &mut [Evidence<L>]) {
        let last = density.len() - 1;
        let low_passed = LowPassedLanes::new(self.low_passed);
        let all = self.low_passed.iter().all(Option::is_some);
        for (k, [_, share]) in residuals.iter_mut().enumerate() {
            let white = *share;
            let left = low_passed.left_over(s, &density[k.min(last)], &one_less(s, share));
            *share = one_less(s, &left);
            if !all {
                self.take_white(share, &white);
            }
        }
    }
}

/// Weights, and what was needed for them on the way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Weighing<const L: usize> {
    /// Of the penalty over each knot interval.
    pub(crate) weights: Vec<IntervalWeights<L>>,
    /// Variance of the noise over it, unit^2.
    noise: Vec<[f64; L]>,
    /// Where noise was low-passed before, its density at the cutoff for white noise, over that at low frequencies.
    density: Vec<[f64; L]>,
}

/// How far a step goes, in the logarithm of the drive.
#[derive(Clone, Copy)]
enum Stride {
    Whole,
    Half,
}

/// Sums around each entry, by a kernel of this standard deviation; `room` as in [`Kernel::smooth`].
#[inline(always)]
fn smooth_shared<const L: usize>(
    s: impl Four,
    evidence: &mut [Evidence<L>],
    intervals: f64,
    room: &mut [Evidence<L>],
) {
    Kernel::new(intervals.max(LEAST_SHARED_INTERVALS)).smooth(s, evidence, room);
}

/// A weight that leaves enough of the sixteen digits.
#[inline(always)]
fn within_bounds<const L: usize>(s: impl Four, weight: &[f64; L]) -> [f64; L] {
    let lowest = s.splat(10f64.powf(LOWEST_LOG_WEIGHT));
    let largest = s.splat(LARGEST_WEIGHT);
    formula(
        s,
        [weight],
        #[inline(always)]
        |[weight]| s.less(largest, s.greater(lowest, weight)),
    )
}

/// `1 - share`.
#[inline(always)]
fn one_less<const L: usize>(s: impl Four, share: &[f64; L]) -> [f64; L] {
    formula(
        s,
        [share],
        #[inline(always)]
        |[share]| s.subtract(s.splat(1.0), share),
    )
}

/// What of an observation is free, given the share that is not, and what is expected beside it.
#[inline(always)]
fn free_with<const L: usize>(s: impl Four, share: &[f64; L], count: &[f64; L]) -> [f64; L] {
    formula(
        s,
        [share, count],
        #[inline(always)]
        |[share, count]| {
            let free = s.subtract(s.splat(1.0), share);
            s.add(s.greater(free, s.splat(LEAST_FREE)), count)
        },
    )
}

/// The mean that evidence gives.
#[inline(always)]
fn mean<const L: usize>(s: impl Four, [square, count]: &Evidence<L>) -> [f64; L] {
    formula(
        s,
        [square, count],
        #[inline(always)]
        |[square, count]| s.greater(s.divide(square, count), s.splat(f64::MIN_POSITIVE)),
    )
}

/// The mean that evidence gives together with what is expected, which counts so much.
#[inline(always)]
fn with_expected<const L: usize>(
    s: impl Four,
    [square, count]: &Evidence<L>,
    expected: &[f64; L],
    expected_count: f64,
) -> [f64; L] {
    let counts = s.splat(expected_count);
    formula(
        s,
        [square, count, expected],
        #[inline(always)]
        |[square, count, expected]| {
            let sum = s.add(square, s.multiply(counts, expected));
            let mean = s.divide(sum, s.add(count, counts));
            s.greater(mean, s.splat(f64::MIN_POSITIVE))
        },
    )
}

/// In place of each sum of squares the fourth root of the mean over the nearest entries, times what
/// the entry counts; `near` is memory for as many.
#[inline(always)]
fn take_fourth_roots<const L: usize>(
    s: impl Four,
    evidence: &mut [Evidence<L>],
    near: &mut Vec<Evidence<L>>,
    room: &mut [Evidence<L>],
) {
    near.clear();
    near.extend_from_slice(evidence);
    Kernel::new(NEAR_NOISE_INTERVALS).smooth(s, near, room);
    for ([square, count], near) in evidence.iter_mut().zip(&*near) {
        *square = formula(
            s,
            [count, &mean(s, near)],
            #[inline(always)]
            |[count, mean]| s.multiply(count, s.square_root(s.square_root(mean))),
        );
    }
}

/// Largest distance of a sample from the first, over all channels of each lane.
fn ranges<const C: usize, const L: usize>(series: &Series<C, L>) -> [f64; L] {
    let mut most = [0.0_f64; C];
    for value in &series.values {
        for (most, own) in most.iter_mut().zip(value) {
            *most = most.max(own.abs());
        }
    }
    let of_lane = |lane| series.channels_of(lane).map(|c| most[c]);
    std::array::from_fn(|lane| of_lane(lane).fold(0.0, f64::max))
}

/// Variance of white noise from the fourth differences of all channels, of each lane.
fn fourth_difference_variances<const C: usize, const L: usize>(series: &Series<C, L>) -> [f64; L] {
    let count = series.values.len().saturating_sub(4);
    let mut lanes: [Vec<f64>; L] = series
        .channels
        .map(|channels| Vec::with_capacity(count * channels));
    for [v, w, x, y, z] in series.values.array_windows() {
        let mut differences = [0.0; C];
        for (c, difference) in differences.iter_mut().enumerate() {
            *difference = fourth_difference([v[c], w[c], x[c], y[c], z[c]]);
        }
        for (channel, differences) in differences.as_chunks::<L>().0.iter().enumerate() {
            for lane in 0..L {
                if channel < series.channels[lane] {
                    lanes[lane].push(differences[lane]);
                }
            }
        }
    }
    lanes.map(|mut own| white_noise_variance(&mut own, MEDIAN_OF_SQUARE).unwrap_or(0.0))
}
