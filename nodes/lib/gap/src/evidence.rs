//! The curves behind a diagnosis, for pictures.

use cromosim_imu::{Channel, PerChannel, Reading};
use cromosim_spatial::{Spectrum, Stamp, welch};

use crate::axes::{axes_of_channel, channel_of_axis, value_on_axis};
use crate::dependence_curves::{DependenceCurve, dependence_curves};
use crate::findings::Findings;
use crate::metrics::Comparison;

/// Windows of the residual's course, s.
const COURSE_S: f64 = 1.0;
/// Windows of the spectra, s.
const SPECTRUM_S: f64 = 4.0;

/// Curves of one placement. All series have one entry for each IMU message.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Of several recordings, the one that the curves are of: the one with the largest gap; else empty.
    pub recording: String,
    /// Stamp of each message.
    pub stamps: Vec<Stamp>,
    /// Whether the reading was compared: false next to gaps in the reference, outside it, at
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
    /// What the part that no effect explains depends on, the strongest first.
    pub dependences: Vec<DependenceCurve>,
    /// Of the magnetometer; empty without one.
    pub magnetic: MagneticCurves,
}

/// Residuals of a magnetometer, one entry for each reading that was compared.
#[derive(Clone, Debug, Default)]
pub struct MagneticCurves {
    /// Stamp of each.
    pub stamps: Vec<Stamp>,
    /// Without causes, T, sensor axes.
    pub before: Vec<[f64; 3]>,
    /// With them.
    pub after: Vec<[f64; 3]>,
}

/// One-sided densities on common frequencies, (unit)^2/Hz, each `[frequency][axis]`.
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
    /// Accelerometer, of the nominal simulation.
    pub accel_before: f64,
    /// Accelerometer, with all named causes.
    pub accel_after: f64,
    /// Gyroscope, of the nominal simulation.
    pub gyro_before: f64,
    /// Gyroscope, with all named causes.
    pub gyro_after: f64,
}

/// Curves of an analysed placement; `before` and `after` are simulated without noise.
pub(crate) fn collect(
    findings: &Findings,
    comparison: &Comparison,
    before: &[Reading],
    after: &[Reading],
) -> Evidence {
    let prepared = comparison.prepared;
    let six = |reading: &Reading| std::array::from_fn(|axis| value_on_axis(reading, axis));
    let all = |readings: &[Reading]| readings.iter().map(six).collect::<Vec<[f64; 6]>>();
    let curves = Curves {
        findings,
        comparison,
        units: PerChannel::from_fn(|channel| findings.reportable.unit_factor(channel)),
    };
    Evidence {
        recording: String::new(),
        stamps: prepared.stamps.clone(),
        used: prepared
            .usable
            .iter()
            .map(|usable| usable.iter().all(|axis| *axis))
            .collect(),
        measured: all(comparison.measured),
        before: all(before),
        after: all(after),
        spectra: curves.spectra(before, after),
        course: curves.course(before, after),
        dependences: dependence_curves(findings, comparison, after),
        magnetic: MagneticCurves::default(),
    }
}

/// What curves are drawn from.
struct Curves<'a> {
    findings: &'a Findings<'a>,
    comparison: &'a Comparison<'a>,
    /// Factors of the device's units.
    units: PerChannel<f64>,
}

impl Curves<'_> {
    /// Spectra of the six axes of values by message and axis.
    fn six_spectra(&self, value: impl Fn(usize, usize) -> f64) -> Vec<Spectrum> {
        let prepared = self.comparison.prepared;
        let window = ((SPECTRUM_S * prepared.rate_hz) as usize)
            .min(prepared.length / 2)
            .max(8);
        prepared
            .on_sample_grid(value)
            .iter()
            .map(|series| welch(series, prepared.rate_hz, window))
            .collect()
    }

    fn spectra(&self, before: &[Reading], after: &[Reading]) -> Spectra {
        let measured = self.comparison.measured;
        let of_measured = self.six_spectra(|k, axis| value_on_axis(&measured[k], axis));
        let of_residual = |simulated: &[Reading]| {
            self.six_spectra(|k, axis| {
                value_on_axis(&measured[k], axis) - value_on_axis(&simulated[k], axis)
            })
        };
        let bins = of_measured
            .first()
            .map_or(0, |spectrum| spectrum.density.len());
        let rows = |spectra: &[Spectrum]| {
            (0..bins)
                .map(|k| std::array::from_fn(|axis| spectra[axis].density[k]))
                .collect()
        };
        let frequencies: Vec<f64> = (0..bins).map(|k| of_measured[0].frequency(k)).collect();
        let predicted = frequencies
            .iter()
            .map(|&hz| std::array::from_fn(|axis| self.predicted(channel_of_axis(axis), hz)))
            .collect();
        Spectra {
            frequencies,
            measured: rows(&of_measured),
            residual_before: rows(&of_residual(before)),
            residual_after: rows(&of_residual(after)),
            predicted,
        }
    }

    /// Predicted density of a residual, in the device's units.
    fn predicted(&self, channel: Channel, hz: f64) -> f64 {
        let rate_hz = self.comparison.prepared.rate_hz;
        self.findings.model.noise.density(channel, hz, rate_hz) * self.units[channel].powi(2)
    }

    /// The whitened residual of simulated readings, flat.
    fn whitened(&self, simulated: &[Reading]) -> Vec<f64> {
        let measured = self.comparison.measured;
        let residual = self.comparison.prepared.on_sample_grid(|k, axis| {
            (value_on_axis(&measured[k], axis) - value_on_axis(&simulated[k], axis))
                / self.units[channel_of_axis(axis)]
        });
        self.findings.model.whitener.apply(&residual)
    }

    fn course(&self, before: &[Reading], after: &[Reading]) -> Vec<CoursePoint> {
        let prepared = self.comparison.prepared;
        let (before, after) = (self.whitened(before), self.whitened(after));
        let step = ((COURSE_S * prepared.rate_hz) as usize).max(1);
        (0..prepared.length / step)
            .map(|k| (k * step, (k + 1) * step))
            .map(|(from, to)| {
                let accelerometer = Channel::Accelerometer;
                let gyroscope = Channel::Gyroscope;
                CoursePoint {
                    seconds: 0.5 * (from + to) as f64 / prepared.rate_hz,
                    accel_before: self.mean_square(&before, accelerometer, from, to),
                    accel_after: self.mean_square(&after, accelerometer, from, to),
                    gyro_before: self.mean_square(&before, gyroscope, from, to),
                    gyro_after: self.mean_square(&after, gyroscope, from, to),
                }
            })
            .filter(|point| point.accel_before.is_finite() && point.gyro_before.is_finite())
            .collect()
    }

    /// Of a whitened residual, over entries of the sample grid; NaN where nothing is compared.
    fn mean_square(&self, whitened: &[f64], channel: Channel, from: usize, to: usize) -> f64 {
        let length = self.comparison.prepared.length;
        let (mut sum, mut weight) = (0.0, 0.0);
        for axis in axes_of_channel(channel) {
            sum += whitened[axis * length + from..axis * length + to]
                .iter()
                .map(|e| e * e)
                .sum::<f64>();
            weight += self.findings.model.whitener.weight[axis][from..to]
                .iter()
                .map(|w| w * w)
                .sum::<f64>();
        }
        if weight > 0.0 { sum / weight } else { f64::NAN }
    }
}
