//! The curves behind a diagnosis, for pictures.

use cromosim_imu::{EffectKind, Reading};
use cromosim_spatial::Stamp;

use crate::diagnose::{Findings, values_of};
use crate::metrics::Comparison;
use crate::problem::axis_of;

/// Names of the six axes, in the order of every array here.
pub const AXES: [&str; 6] = [
    "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z",
];

/// Curves of one placement. All series have one entry for each IMU message.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Stamp of each message.
    pub stamps: Vec<Stamp>,
    /// Whether the reading was compared: false next to holes in the reference, outside it, at
    /// repeated or clipped values.
    pub used: Vec<bool>,
    /// Accelerometer [m/s2], gyroscope [rad/s], as recorded.
    pub measured: Vec<[f64; 6]>,
    /// The nominal simulation, without noise.
    pub before: Vec<[f64; 6]>,
    /// With all named causes, without noise.
    pub after: Vec<[f64; 6]>,
    /// Spectra of the six axes.
    pub spectra: Spectra,
    /// Whitened residual over time.
    pub course: Vec<CoursePoint>,
}

/// One-sided densities on common frequencies, (unit)^2/Hz, each [frequency][axis].
#[derive(Clone, Debug, Default)]
pub struct Spectra {
    /// Hz.
    pub frequencies: Vec<f64>,
    /// Of the measured readings.
    pub measured: Vec<[f64; 6]>,
    /// Of measured less nominal.
    pub residual_before: Vec<[f64; 6]>,
    /// Of measured less simulated with all named causes.
    pub residual_after: Vec<[f64; 6]>,
    /// Predicted for a residual without any cause: sensor noise and the reference's own error.
    pub predicted: Vec<[f64; 6]>,
}

/// Mean square of the whitened residual in a second or so: 1 is what noise alone leaves.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoursePoint {
    /// Middle, s since the first IMU message.
    pub seconds: f64,
    /// Accelerometer before, after; gyroscope before, after.
    pub accel_before: f64,
    /// With all named causes.
    pub accel_after: f64,
    /// Nominal.
    pub gyro_before: f64,
    /// With all named causes.
    pub gyro_after: f64,
}

/// Windows of the residual's course, s.
const COURSE_S: f64 = 1.0;

/// Curves of an analysed placement.
pub(crate) fn collect(
    findings: &Findings,
    comparison: &Comparison,
    before: &[Reading],
    after: &[Reading],
) -> Evidence {
    let problem = comparison.problem;
    let six = |reading: &Reading| std::array::from_fn(|axis| axis_of(reading, axis));
    let all = |readings: &[Reading]| readings.iter().map(six).collect::<Vec<[f64; 6]>>();
    let measured = comparison.measured;
    let context = &findings.context;
    let spectrum = |of: &dyn Fn(usize, usize) -> f64| -> Vec<cromosim_spatial::Spectrum> {
        let window = ((4.0 * problem.rate_hz) as usize)
            .min(problem.length / 2)
            .max(8);
        problem
            .raster(of)
            .iter()
            .map(|series| cromosim_spatial::welch(series, problem.rate_hz, window))
            .collect()
    };
    let of_measured = spectrum(&|k, axis| axis_of(&measured[k], axis));
    let of_before = spectrum(&|k, axis| axis_of(&measured[k], axis) - axis_of(&before[k], axis));
    let of_after = spectrum(&|k, axis| axis_of(&measured[k], axis) - axis_of(&after[k], axis));
    let bins = of_measured
        .first()
        .map_or(0, |spectrum| spectrum.density.len());
    let rows = |spectra: &[cromosim_spatial::Spectrum]| {
        (0..bins)
            .map(|k| std::array::from_fn(|axis| spectra[axis].density[k]))
            .collect()
    };
    let units = [EffectKind::AccelUnits, EffectKind::GyroUnits]
        .map(|kind| values_of(&findings.named, kind).map_or(1.0, |values| values[0]));
    let frequencies: Vec<f64> = (0..bins).map(|k| of_measured[0].frequency(k)).collect();
    let predicted = frequencies
        .iter()
        .map(|&hz| {
            std::array::from_fn(|axis| {
                context.noise.density(axis / 3, hz, problem.rate_hz) * units[axis / 3].powi(2)
            })
        })
        .collect();
    let spectra = Spectra {
        frequencies,
        measured: rows(&of_measured),
        residual_before: rows(&of_before),
        residual_after: rows(&of_after),
        predicted,
    };
    let white = |readings: &[Reading]| {
        context.whitener.apply(&problem.raster(|k, axis| {
            (axis_of(&measured[k], axis) - axis_of(&readings[k], axis)) / units[axis / 3]
        }))
    };
    let (white_before, white_after) = (white(before), white(after));
    let step = ((COURSE_S * problem.rate_hz) as usize).max(1);
    let mean_square = |white: &[f64], channel: usize, from: usize, to: usize| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for axis in 3 * channel..3 * channel + 3 {
            sum += white[axis * problem.length + from..axis * problem.length + to]
                .iter()
                .map(|e| e * e)
                .sum::<f64>();
            weight += context.whitener.weight[axis][from..to]
                .iter()
                .map(|w| w * w)
                .sum::<f64>();
        }
        if weight > 0.0 { sum / weight } else { f64::NAN }
    };
    let course = (0..problem.length / step)
        .map(|k| (k * step, (k + 1) * step))
        .map(|(from, to)| CoursePoint {
            seconds: 0.5 * (from + to) as f64 / problem.rate_hz,
            accel_before: mean_square(&white_before, 0, from, to),
            accel_after: mean_square(&white_after, 0, from, to),
            gyro_before: mean_square(&white_before, 1, from, to),
            gyro_after: mean_square(&white_after, 1, from, to),
        })
        .filter(|point| point.accel_before.is_finite() && point.gyro_before.is_finite())
        .collect();
    Evidence {
        stamps: problem.stamps.clone(),
        used: problem
            .usable
            .iter()
            .map(|usable| usable.iter().all(|axis| *axis))
            .collect(),
        measured: all(measured),
        before: all(before),
        after: all(after),
        spectra,
        course,
    }
}
