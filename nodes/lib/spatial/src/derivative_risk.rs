//! A smoothing weight for a derivative, by cross-validation.

use std::ops::Range;

use crate::SpatialError;
use crate::basis::ORDER;
use crate::derivative::Derivative;
use crate::equations::{Scratch, SplineEquations};

/// Step of the walk from the weight of the greatest likelihood, decimal logarithm: the search's own
/// finest step.
const STEP: f64 = 0.5;
/// Most steps of the walk, four decades of the weight; no source.
const FARTHEST: i32 = 8;
/// How much less smoothing the other half's derivative has, decimal logarithm: so little that its
/// bias hardly counts. A tenth of the weight moves the cutoff by 10^(1/10), a quarter; no source.
const PILOT_STEP: f64 = -1.0;
/// Below this weight the response at the Nyquist frequency, 1 / (1 + weight pi^10), is above 0.01 and
/// nearly all below half of it passes: there is nothing to gain. No source.
const LEAST_WEIGHT: f64 = 1e-3;

/// Samples that are not compared at a cut, where the series goes on beyond the run: the run ends
/// there, the whole spline does not. No source.
const CUT_MARGIN: usize = 32;

/// One run of samples, split into every second sample and the others.
#[derive(Clone, Debug)]
pub(crate) struct SplitRun {
    range: Range<usize>,
    halves: [Half; 2],
}

#[derive(Clone, Debug)]
struct Half {
    equations: SplineEquations,
    /// For each sample that is compared: the first function over it, and the derivative's row.
    rows: Vec<(u32, [f64; ORDER])>,
}

/// Samples of one half, its coefficients at the pilot's weight, and memory.
struct Work<const C: usize> {
    values: Vec<[f64; C]>,
    pilot: Vec<[f64; C]>,
    scratch: Scratch<C>,
}

impl SplitRun {
    /// Splits the samples `range` at `times`.
    pub(crate) fn new(times: &[f64], range: Range<usize>, derivative: Derivative) -> Self {
        let run = &times[range.clone()];
        // The first and the last sample lie outside one of the halves.
        let margin = |cut: bool| if cut { CUT_MARGIN } else { 1 };
        let compared = margin(range.start > 0)..run.len() - margin(range.end < times.len());
        let half = |parity: usize| {
            let times: Vec<f64> = run[parity..].iter().step_by(2).copied().collect();
            let equations = SplineEquations::from_times(&times, 1.0, 0.0);
            let row = |t: &f64| {
                let first = equations.basis.interval_of(*t);
                (
                    first as u32,
                    equations.basis.derivatives(first, *t, derivative.order()),
                )
            };
            let rows = run[compared.clone()].iter().map(row).collect();
            Half { equations, rows }
        };
        Self {
            halves: [half(0), half(1)],
            range,
        }
    }
}

/// The weight, near that of greatest `likelihood`, with the least error of the derivative.
///
/// Likelihood trusts the prior; a derivative asks for more smoothing where the motion is smoother
/// than the prior, for less where it is rougher. Each half of the samples is smoothed with a
/// candidate, and its derivative compared with that of the other half, hardly smoothed: the noise
/// of the halves is independent, so the mean square difference is bias^2 + variance of the
/// candidate plus a constant. A half has twice the variance of the whole: once the variance that
/// `noise` (of a sample and channel) leaves is taken off.
pub(crate) fn refine<const C: usize>(
    runs: &[SplitRun],
    values: &[[f64; C]],
    likelihood: f64,
    noise: f64,
    derivative: Derivative,
) -> f64 {
    if likelihood < LEAST_WEIGHT {
        return likelihood;
    }
    let Ok(mut works) = prepare(runs, values, likelihood * 10f64.powf(PILOT_STEP)) else {
        return likelihood;
    };
    let count: usize = runs.iter().map(|run| 2 * run.halves[0].rows.len()).sum();
    let mut risk = |steps: i32| {
        let weight = likelihood * 10f64.powf(STEP * f64::from(steps));
        let difference: Result<f64, SpatialError> = runs
            .iter()
            .zip(&mut works)
            .map(|(run, work)| difference(run, work, weight))
            .sum();
        difference.map_or(f64::INFINITY, |sum| {
            sum / count as f64 - C as f64 * noise * derivative.variance(weight)
        })
    };
    // Downhill from the middle: left, here and right of the best so far.
    let mut steps: i32 = 0;
    let mut around = [risk(-1), risk(0), risk(1)];
    while steps.abs() < FARTHEST && (around[0] < around[1] || around[2] < around[1]) {
        if around[2] < around[0] {
            steps += 1;
            around = [around[1], around[2], risk(steps + 1)];
        } else {
            steps -= 1;
            around = [risk(steps - 1), around[0], around[1]];
        }
    }
    let [left, here, right] = around;
    let bend = left - 2.0 * here + right;
    let shift = if bend > 0.0 && bend.is_finite() {
        (0.5 * (left - right) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    likelihood * 10f64.powf(STEP * (f64::from(steps) + shift))
}

fn prepare<const C: usize>(
    runs: &[SplitRun],
    values: &[[f64; C]],
    pilot_weight: f64,
) -> Result<Vec<[Work<C>; 2]>, SpatialError> {
    let work = |run: &SplitRun, parity: usize| {
        let values: Vec<[f64; C]> = values[run.range.clone()]
            .iter()
            .skip(parity)
            .step_by(2)
            .copied()
            .collect();
        let mut scratch = Scratch::default();
        run.halves[parity]
            .equations
            .solve(&values, halved(pilot_weight), &mut scratch)?;
        Ok(Work {
            values,
            pilot: scratch.coefficients.clone(),
            scratch,
        })
    };
    runs.iter()
        .map(|run| Ok([work(run, 0)?, work(run, 1)?]))
        .collect()
}

/// Sum over a run of the square differences between each half's derivative and the other's pilot.
fn difference<const C: usize>(
    run: &SplitRun,
    works: &mut [Work<C>; 2],
    weight: f64,
) -> Result<f64, SpatialError> {
    for (half, work) in run.halves.iter().zip(works.iter_mut()) {
        half.equations
            .solve(&work.values, halved(weight), &mut work.scratch)?;
    }
    let mut sum = 0.0;
    for parity in 0..2 {
        let (own, other) = (&run.halves[parity], &run.halves[1 - parity]);
        let (smooth, pilot) = (
            &works[parity].scratch.coefficients,
            &works[1 - parity].pilot,
        );
        for (own_row, other_row) in own.rows.iter().zip(&other.rows) {
            let (a, b) = (apply(own_row, smooth), apply(other_row, pilot));
            sum += (0..C).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
        }
    }
    Ok(sum)
}

/// With half the samples in the same time, half the weight cuts off at the same frequency.
fn halved(weight: f64) -> f64 {
    0.5 * weight
}

fn apply<const C: usize>(
    (first, row): &(u32, [f64; ORDER]),
    coefficients: &[[f64; C]],
) -> [f64; C] {
    let mut value = [0.0; C];
    for (coefficient, b) in coefficients[*first as usize..].iter().zip(row) {
        for c in 0..C {
            value[c] += b * coefficient[c];
        }
    }
    value
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::TAU;

    use crate::{Derivative, Smoothing, SmoothingSpline};

    /// Like normal noise, the same on every run.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 99_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..count)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect()
    }

    /// Root mean square error of a derivative of a jittered sum of tones (`smooth`), or of a jittered row
    /// of sharp bumps.
    fn error(smooth: bool, order: usize, smoothing: Smoothing) -> f64 {
        let signal = |t: f64| {
            if smooth {
                let (w, v) = (TAU * 1.3, TAU * 2.9);
                return [
                    w * (w * t).cos() + 0.3 * v * (v * t).cos(),
                    -w * w * (w * t).sin() - 0.3 * v * v * (v * t).sin(),
                ][order - 1];
            }
            let x = (t.fract() - 0.5) / 0.03;
            [-x / 0.03, (x * x - 1.0) / 0.0009][order - 1] * (-0.5 * x * x).exp()
        };
        let value = |t: f64| {
            let x = (t.fract() - 0.5) / 0.03;
            if smooth {
                (TAU * 1.3 * t).sin() + 0.3 * (TAU * 2.9 * t).sin()
            } else {
                (-0.5 * x * x).exp()
            }
        };
        let seconds: Vec<f64> = (0..1500).map(|k| 0.01 * f64::from(k)).collect();
        let samples: Vec<[f64; 1]> = seconds
            .iter()
            .zip(noise(1500))
            .map(|(t, n)| [value(*t) + 0.01 * n])
            .collect();
        let spline = SmoothingSpline::fit(&seconds, &samples, smoothing).unwrap();
        let inside = &seconds[50..1450];
        (inside
            .iter()
            .map(|t| (spline.evaluate(*t)[order][0] - signal(*t)).powi(2))
            .sum::<f64>()
            / 1400.0)
            .sqrt()
    }

    #[test]
    fn derivatives_are_within_a_tenth_of_the_best_that_any_weight_can_do() {
        for (smooth, derivative, order) in [
            (true, Derivative::First, 1),
            (true, Derivative::Second, 2),
            (false, Derivative::First, 1),
            (false, Derivative::Second, 2),
        ] {
            let weights = (-24..=40).map(|e| Smoothing::Weight(10f64.powf(f64::from(e) * 0.25)));
            let best = weights
                .map(|weight| error(smooth, order, weight))
                .fold(f64::INFINITY, f64::min);
            let (likely, chosen) = (
                error(smooth, order, Smoothing::Automatic),
                error(smooth, order, Smoothing::AutomaticFor(derivative)),
            );
            println!(
                "smooth {smooth}, derivative {order}: best {best:.4}, likelihood {likely:.4}, chosen {chosen:.4}"
            );
            assert!(
                chosen < 1.1 * best && chosen < 1.05 * likely,
                "{smooth} {order}"
            );
        }
    }
}
