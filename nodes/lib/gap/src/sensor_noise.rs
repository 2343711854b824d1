//! What a sensor adds by itself: white noise, clipping, rounding.

use cromosim_imu::EffectKind;

use crate::DiagnoseOptions;
use crate::gross::Digital;
use crate::problem::Problem;

/// The declared noise in SI units. Whether a device in other units declares its covariances in them
/// is nowhere said: what is nearer to the noise of the readings holds.
pub(crate) fn declared_in_si(problem: &Problem, units: [f64; 2]) -> [Option<f64>; 2] {
    let series = problem.raster(|k, axis| crate::problem::axis_of(&problem.measured[k], axis));
    [0, 1].map(|c| {
        let declared = problem.declared[c]?;
        let found = fourth_differences(problem, &series, c)
            .unwrap_or(0.0)
            .sqrt()
            .max(1e-12);
        let off = |sigma: f64| (sigma / found).ln().abs();
        Some(if off(declared / units[c]) < off(declared) {
            declared / units[c]
        } else {
            declared
        })
    })
}

/// What is denied to the library stays in the readings, to be found as something unknown.
pub(crate) fn allowed_digital(
    found: Digital,
    channel: usize,
    options: &DiagnoseOptions,
) -> Digital {
    let [saturation, quantization] = [
        [EffectKind::AccelSaturation, EffectKind::AccelQuantization],
        [EffectKind::GyroSaturation, EffectKind::GyroQuantization],
    ][channel];
    let allowed = |kind: EffectKind| !options.without.contains(&kind);
    Digital {
        limit: found.limit.filter(|_| allowed(saturation)),
        lsb: found.lsb.filter(|_| allowed(quantization)),
        denied: found.lsb.is_some() && !allowed(quantization),
    }
}

/// White noise per sample that residuals are divided by: what is found, unless the cause of more
/// than the declared is denied.
pub(crate) fn white_noise(
    problem: &Problem,
    found: [f64; 2],
    digital: &[Digital; 2],
    without: &[EffectKind],
) -> [f64; 2] {
    [EffectKind::AccelNoise, EffectKind::GyroNoise].map(|kind| {
        let c = usize::from(kind == EffectKind::GyroNoise);
        match problem.declared[c] {
            None => found[c],
            Some(declared) if without.contains(&kind) || digital[c].denied => declared,
            Some(declared) => declared.max(found[c]),
        }
    })
}

/// Clipped values tell only that the true one lies beyond.
pub(crate) fn mask_clipped(problem: &mut Problem, channel: usize, digital: &Digital) {
    let Some(limit) = digital.limit else { return };
    for (k, reading) in problem.measured.iter().enumerate() {
        for axis in 0..3 {
            let value = if channel == 0 {
                reading.specific_force[axis]
            } else {
                reading.angular_velocity[axis]
            };
            if value.abs() >= limit * (1.0 - 1e-9) {
                problem.usable[k][3 * channel + axis] = false;
            }
        }
    }
}

/// White noise per sample of each channel: the least of four bands in the upper half of the
/// residual's spectrum and of fourth differences of neighbours; whatever else is there only adds to
/// each.
pub(crate) fn found_noise(problem: &Problem, residual: &[Vec<f64>]) -> [f64; 2] {
    [0, 1].map(|channel| {
        let spectrum = problem.channel_spectrum(residual, channel);
        let nyquist_hz = problem.rate_hz / 2.0;
        let bands = [(0.5, 0.62), (0.62, 0.74), (0.74, 0.86), (0.86, 0.97)];
        let least = bands
            .iter()
            .filter_map(|(a, b)| spectrum.median(a * nyquist_hz, b * nyquist_hz))
            .fold(f64::INFINITY, f64::min);
        let variance = least * problem.rate_hz / 2.0;
        fourth_differences(problem, residual, channel)
            .map_or(variance, |other| variance.min(other))
            .sqrt()
    })
}

/// Whether the top of a channel's spectrum is level: motion that the reference does not resolve
/// falls steeply there.
pub(crate) fn is_white(problem: &Problem, residual: &[Vec<f64>]) -> [bool; 2] {
    [0, 1].map(|channel| {
        let spectrum = problem.channel_spectrum(residual, channel);
        let level = |from: f64, to: f64| {
            spectrum
                .median(from * problem.rate_hz / 2.0, to * problem.rate_hz / 2.0)
                .unwrap_or(0.0)
        };
        level(0.70, 0.83) < 1.5 * level(0.84, 0.97)
    })
}

/// Variance of white noise from `x0 - 4 x1 + 6 x2 - 4 x3 + x4` (variance 70) of five neighbours
/// that are all there, by the median of its squares.
pub(crate) fn fourth_differences(
    problem: &Problem,
    residual: &[Vec<f64>],
    channel: usize,
) -> Option<f64> {
    let mut squares = Vec::new();
    for (axis, series) in residual.iter().enumerate().skip(3 * channel).take(3) {
        for first in 0..problem.places.len().saturating_sub(4) {
            let whole = problem.places[first + 4] == problem.places[first] + 4
                && (first..first + 5).all(|k| problem.usable[k][axis]);
            if whole {
                let x = &series[problem.places[first]..];
                squares.push((x[0] - 4.0 * x[1] + 6.0 * x[2] - 4.0 * x[3] + x[4]).powi(2));
            }
        }
    }
    if squares.len() < 300 {
        return None;
    }
    let middle = squares.len() / 2;
    // The median of a squared standard normal number is 0.4549.
    Some(*squares.select_nth_unstable_by(middle, f64::total_cmp).1 / (70.0 * 0.4549))
}
