//! How much of the readings' turning the reference keeps, by axis and frequency, whatever its noise is.
//!
//! A gyroscope's noise is small beside motion where that of differences of poses is not. So the turning X that poses show, unfiltered,
//! is regressed on the turning Y that was measured, rather than the other way round: `sum Re(X Y*) / sum |Y|^2` over windows is what
//! the reference keeps of the motion, and its noise only scatters it.

use std::f64::consts::TAU;

use cromosim_imu::{Channel, EffectKind, EffectSet, SensorModel};
use cromosim_spatial::{Complex64, FourierPair, KinematicTrack, Stamp};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::fit::FitModel;
use crate::policy::attenuation::{
    FASTEST_PART, FEWEST_WINDOWS, LATEST_S, LEAST_KNOWN, QUIETEST, STANDS_OUT,
};
use crate::prepared::{Prediction, PreparedPlacement, bridge};

/// Edges of the bands, Hz.
const EDGES_HZ: [f64; 28] = [
    0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.25, 3.75, 4.25, 4.75, 5.25, 5.75, 6.25, 6.75, 7.25, 7.75,
    8.25, 8.75, 9.25, 9.75, 10.25, 11.25, 12.25, 13.5, 15.0, 18.0, 22.0, 28.0,
];
const BANDS: usize = EDGES_HZ.len() - 1;
/// Length of a window, s; neighbours overlap by half.
const WINDOW_S: f64 = 6.0;
/// Delays between none and the largest that are tried.
const DELAYS: i32 = 40;
/// Effects that are not applied to what poses show: noise in that lowers the scale of an axis that hardly moves.
const NOT_APPLIED: [EffectKind; 1] = [EffectKind::GyroScale];
/// What readings have that is no turning.
const NO_TURNING: [EffectKind; 4] = [
    EffectKind::GyroBias,
    EffectKind::GyroBiasDrift,
    EffectKind::GyroGSensitivity,
    EffectKind::Vibration,
];

/// What the reference keeps of the motion about one axis of the sensor in a band.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptInBand {
    /// Of the gyroscope's three.
    pub axis: usize,
    /// Mean over the readings' power.
    pub hz: f64,
    /// Part that is kept.
    pub kept: f64,
    /// Its standard error.
    pub error: f64,
}

/// What the reference keeps under a set of effects in the bands in which the readings hold motion, by axis.
pub(crate) fn kept_motion(model: &FitModel, set: &EffectSet) -> Vec<KeptInBand> {
    let prepared = model.prepared;
    let estimate = prepared.estimate.with_unfiltered_rotation();
    let turning = turning(prepared, set, &prepared.track(&estimate));
    let windows = in_time(windows(prepared, &turning));
    if windows.len() < FEWEST_WINDOWS {
        return Vec::new();
    }
    let fastest_hz = FASTEST_PART * estimate.rate_hz().min(prepared.rate_hz);
    let bands = (0..BANDS).take_while(|band| middle_hz(*band) < fastest_hz);
    let places: Vec<(usize, usize)> = bands
        .flat_map(|band| [0, 1, 2].map(|axis| (axis, band)))
        .collect();
    let amplitudes: Vec<f64> = places
        .iter()
        .map(|(axis, band)| amplitude(&windows, *axis, *band))
        .collect();
    let mut sorted = amplitudes.clone();
    sorted.sort_by(f64::total_cmp);
    let Some(quiet) = sorted.get(QUIETEST) else {
        return Vec::new();
    };
    let stands_out = |amplitude: &f64| *amplitude > STANDS_OUT * quiet;
    places
        .into_iter()
        .zip(&amplitudes)
        .filter(|(_, amplitude)| stands_out(amplitude))
        .map(|((axis, band), _)| kept(&windows, axis, band))
        .filter(|own| own.kept.is_finite() && own.error.is_finite())
        .collect()
}

fn middle_hz(band: usize) -> f64 {
    0.5 * (EDGES_HZ[band] + EDGES_HZ[band + 1])
}

/// Angular velocity about an axis over the sample grid.
struct Turning {
    shown: Vec<f64>,
    /// Where nothing is compared with straight lines over the difference, which is small beside either.
    measured: Vec<f64>,
}

/// As poses show it under a set and as it was measured, about each axis of the sensor.
fn turning(prepared: &PreparedPlacement, set: &EffectSet, track: &KinematicTrack) -> Vec<Turning> {
    let stamps = stamps_of_grid(prepared);
    let predict = |set: &EffectSet| {
        let model = SensorModel::new(set, prepared.epoch);
        Prediction::new(&model, track, &stamps).readings
    };
    let set = set.filtered(|effect| !NOT_APPLIED.contains(&effect.kind()));
    let with_all = predict(&set);
    let of_motion = predict(&set.filtered(|effect| !NO_TURNING.contains(&effect.kind())));
    let about = |axis: usize| {
        let shown: Vec<f64> = of_motion
            .iter()
            .map(|reading| value_on_axis(reading, axis))
            .collect();
        let mut measured = vec![0.0; prepared.length];
        let messages = prepared.grid_index.iter().zip(&prepared.usable);
        let known = messages.enumerate().filter(|(_, (_, usable))| usable[axis]);
        for (k, (entry, _)) in known.clone() {
            let own = value_on_axis(&prepared.measured[k], axis);
            measured[*entry] = own - value_on_axis(&with_all[*entry], axis);
        }
        bridge(&mut measured, known.map(|(_, (entry, _))| *entry));
        for (value, shown) in measured.iter_mut().zip(&shown) {
            *value += shown;
        }
        Turning { shown, measured }
    };
    axes_of_channel(Channel::Gyroscope).map(about).collect()
}

/// The stamp of each entry of the sample grid; between those of messages evenly spaced.
fn stamps_of_grid(prepared: &PreparedPlacement) -> Vec<Stamp> {
    let mut seconds = vec![0.0; prepared.length];
    for (entry, stamp) in prepared.grid_index.iter().zip(&prepared.stamps) {
        seconds[*entry] = *stamp - prepared.epoch;
    }
    bridge(&mut seconds, prepared.grid_index.iter().copied());
    let since = |seconds: f64| prepared.epoch.plus_seconds(seconds);
    let mut stamps: Vec<Stamp> = seconds.into_iter().map(since).collect();
    for (entry, stamp) in prepared.grid_index.iter().zip(&prepared.stamps) {
        stamps[*entry] = *stamp;
    }
    stamps
}

/// Sums over a window's entries, by band.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// X Y*.
    both: [Complex64; BANDS],
    /// |Y|^2.
    own: [f64; BANDS],
    /// The same times the frequency, Hz.
    moment: [f64; BANDS],
}

/// Hann windows most of whose readings are compared, by axis.
fn windows(prepared: &PreparedPlacement, turning: &[Turning]) -> Vec<[Sums; 3]> {
    let length = ((WINDOW_S * prepared.rate_hz).round() as usize).max(2);
    let transform = FourierPair::new(length);
    let spacing_hz = prepared.rate_hz / length as f64;
    let hann: Vec<f64> = (0..length)
        .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos())
        .collect();
    let mut is_known = vec![false; prepared.length];
    let axes = axes_of_channel(Channel::Gyroscope);
    for (entry, usable) in prepared.grid_index.iter().zip(&prepared.usable) {
        is_known[*entry] = axes.clone().all(|axis| usable[axis]);
    }
    let starts = (0..).map(|index| index * (length / 2).max(1));
    starts
        .map(|start| start..start + length)
        .take_while(|window| window.end <= prepared.length)
        .filter(|window| {
            let known = is_known[window.clone()].iter().filter(|own| **own).count();
            known as f64 >= LEAST_KNOWN * length as f64
        })
        .map(|window| {
            std::array::from_fn(|axis| {
                let own = &turning[axis];
                let [x, y] = [&own.shown, &own.measured].map(|series| &series[window.clone()]);
                sums(x, y, &hann, &transform, spacing_hz)
            })
        })
        .collect()
}

/// Of a window of both series, in one complex transform as its real and imaginary part.
fn sums(x: &[f64], y: &[f64], hann: &[f64], transform: &FourierPair, spacing_hz: f64) -> Sums {
    let length = hann.len();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / length as f64;
    let (x_mean, y_mean) = (mean(x), mean(y));
    let mut values: Vec<Complex64> = (0..length)
        .map(|k| Complex64::new(x[k] - x_mean, y[k] - y_mean) * hann[k])
        .collect();
    transform.forward(&mut values);
    let mut sums = Sums::default();
    for k in 1..length.div_ceil(2) {
        let hz = k as f64 * spacing_hz;
        let above = EDGES_HZ.partition_point(|edge| *edge <= hz);
        if !(1..=BANDS).contains(&above) {
            continue;
        }
        let (here, there) = (values[k], values[length - k].conj());
        let x = (here + there) * 0.5;
        let y = (here - there) * Complex64::new(0.0, -0.5);
        sums.both[above - 1] += x * y.conj();
        sums.own[above - 1] += y.norm_sqr();
        sums.moment[above - 1] += hz * y.norm_sqr();
    }
    sums
}

/// The same without the delay that the set has left, which lowers the real part alone.
fn in_time(mut windows: Vec<[Sums; 3]>) -> Vec<[Sums; 3]> {
    let all = windows.iter().flatten();
    let total: [Complex64; BANDS] =
        std::array::from_fn(|band| all.clone().map(|own| own.both[band]).sum());
    let turn =
        |band: usize, delay_s: f64| Complex64::from_polar(1.0, TAU * middle_hz(band) * delay_s);
    let height = |delay_s: &f64| -> f64 {
        (0..BANDS)
            .map(|band| (total[band] * turn(band, *delay_s)).re)
            .sum()
    };
    let delay_s = (-DELAYS..=DELAYS)
        .map(|k| LATEST_S * f64::from(k) / f64::from(DELAYS))
        .max_by(|a, b| height(a).total_cmp(&height(b)))
        .unwrap_or(0.0);
    for own in windows.iter_mut().flatten() {
        for (band, both) in own.both.iter_mut().enumerate() {
            *both *= turn(band, delay_s);
        }
    }
    windows
}

/// Of the readings, by the root of the band's width.
fn amplitude(windows: &[[Sums; 3]], axis: usize, band: usize) -> f64 {
    let power: f64 = windows.iter().map(|own| own[axis].own[band]).sum();
    (power / (EDGES_HZ[band + 1] - EDGES_HZ[band])).sqrt()
}

/// With the error by leaving out each window in turn.
fn kept(windows: &[[Sums; 3]], axis: usize, band: usize) -> KeptInBand {
    let all = windows.iter().map(|own| &own[axis]);
    let both: f64 = all.clone().map(|own| own.both[band].re).sum();
    let own: f64 = all.clone().map(|own| own.own[band]).sum();
    let without: Vec<f64> = all
        .clone()
        .map(|left_out| (both - left_out.both[band].re) / (own - left_out.own[band]))
        .collect();
    let count = without.len() as f64;
    let mean = without.iter().sum::<f64>() / count;
    let scatter: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    KeptInBand {
        axis,
        hz: all.map(|own| own.moment[band]).sum::<f64>() / own,
        kept: both / own,
        error: ((count - 1.0) / count * scatter).sqrt(),
    }
}
