//! Standard errors of fitted values where noise is not the same at all times, and clocks drift.

use cromosim_imu::{Effect, EffectKind, EffectSet, PerChannel};
use nalgebra::{DMatrix, DVector};

use crate::axes::{axes_of_channel, channel_of_axis};
use crate::diagnosis::Metrics;
use crate::fit::{Fit, FitModel, slices};
use crate::gram::dot;
use crate::policy::report::ERROR_BLOCK_S;
use crate::simulations::Simulations;

/// Long enough before a recording that all of it is later, s.
const BEFORE_ALL_S: f64 = 1.0;

/// A fit's errors as the normal equations of its own recording have them, with what is ordinary beside
/// it.
struct Beside {
    /// The columns of what is beside it.
    extra: Vec<Vec<f64>>,
    covariance: DMatrix<f64>,
    /// 1 / variance of the prior of each value.
    prior: Vec<f64>,
}

impl FitModel<'_> {
    /// The covariance of a fit's values, of which `reported` are causes: that of the normal equations,
    /// each value's grown by as much as the residual of this recording says.
    ///
    /// The normal equations take the noise for stationary, with the spectrum that was predicted. A
    /// reference errs most where it moves most, which is where the values are learnt. With X the columns
    /// of a block of time, r its residual, C the inverse of the normal matrix and P the prior's, the
    /// values err by `C (P + sum X^T r r^T X) C` whatever the noise is, as long as blocks are
    /// independent. Less than by C is not believed.
    pub fn covariance_by_blocks(&self, fit: &Fit, reported: &EffectSet) -> DMatrix<f64> {
        let own = fit.gram.solve().covariance;
        let beside = self.beside_ordinary_drift(fit);
        let of_blocks = self.sum_over_blocks(fit, &beside);
        let growth = DVector::from_fn(own.nrows(), |k, _| {
            let stated = own[(k, k)].max(f64::MIN_POSITIVE);
            let found = of_blocks[(k, k)].max(beside.covariance[(k, k)]);
            (found / stated).max(1.0).sqrt()
        });
        let growth = DMatrix::from_diagonal(&growth);
        let stated = vibration_by_stamps(fit, reported, fit.linear.covariance.clone());
        &growth * stated * &growth
    }

    /// Beside an ordinary drift of the clocks, where none is in the set: it is there whether it shows
    /// or not, and an offset of the clocks moves with it.
    fn beside_ordinary_drift(&self, fit: &Fit) -> Beside {
        let kind = EffectKind::ClockDrift;
        let mut prior: Vec<f64> = fit.prior().collect();
        let extra = if fit.set.contains(kind) || !fit.set.contains(EffectKind::TimeOffset) {
            Vec::new()
        } else {
            let set = fit.set.clone().with(Effect::neutral(kind));
            self.columns(&set, &fit.prediction, kind)
        };
        let weights = vec![kind.error_of_reference().powi(-2); extra.len()];
        let gram = self.extended(fit, None, &slices(&extra), &weights);
        prior.extend(weights);
        Beside {
            covariance: gram.solve().covariance,
            extra,
            prior,
        }
    }

    /// `C (P + sum X^T r r^T X) C` over blocks of time, each channel in units of its own residual.
    fn sum_over_blocks(&self, fit: &Fit, beside: &Beside) -> DMatrix<f64> {
        let columns: Vec<_> = fit.columns.iter().chain(&beside.extra).collect();
        let length = self.prepared.length;
        let counts = self.whitener.count;
        let weights = PerChannel::from_fn(|channel| {
            let squares: f64 = axes_of_channel(channel)
                .map(|axis| &fit.residual[axis * length..(axis + 1) * length])
                .map(|series| dot(series, series))
                .sum();
            (squares / counts[channel].max(1.0)).max(1.0).recip()
        });
        let entries = ((ERROR_BLOCK_S * self.prepared.rate_hz) as usize).max(1);
        let mut sum = DMatrix::from_diagonal(&DVector::from_column_slice(&beside.prior));
        for from in (0..length).step_by(entries) {
            let to = (from + entries).min(length);
            let pull = DVector::from_iterator(
                columns.len(),
                columns.iter().map(|column| {
                    (0..6)
                        .map(|axis| {
                            let block = axis * length + from..axis * length + to;
                            weights[channel_of_axis(axis)]
                                * dot(&column[block.clone()], &fit.residual[block])
                        })
                        .sum::<f64>()
                }),
            );
            sum += &pull * pull.transpose();
        }
        &beside.covariance * sum * &beside.covariance
    }
}

/// Where a drift of the clocks is no cause, a vibration goes by the stamps
/// ([`EffectSet::take_values_of`]), and its values do not err with the clocks'.
fn vibration_by_stamps(fit: &Fit, reported: &EffectSet, covariance: DMatrix<f64>) -> DMatrix<f64> {
    let drift = EffectKind::ClockDrift;
    if !fit.set.contains(drift) || reported.contains(drift) {
        return covariance;
    }
    let places = |is: &dyn Fn(EffectKind) -> bool| -> Vec<usize> {
        let all = fit.layout.iter().enumerate();
        all.filter(|(_, (kind, _))| is(*kind))
            .map(|(place, _)| place)
            .collect()
    };
    let clocks = places(&|kind| {
        kind == drift || (kind == EffectKind::TimeOffset && !reported.contains(kind))
    });
    let waves = places(&|kind| kind == EffectKind::Vibration);
    let block =
        |rows: &[usize], columns: &[usize]| covariance.select_rows(rows).select_columns(columns);
    let Some(of_clocks) = block(&clocks, &clocks).cholesky() else {
        return covariance;
    };
    let across = block(&waves, &clocks);
    let taken = &across * of_clocks.solve(&across.transpose());
    let mut left = covariance.clone();
    for (i, &row) in waves.iter().enumerate() {
        for (j, &column) in waves.iter().enumerate() {
            left[(row, column)] -= taken[(i, j)];
        }
    }
    left
}

/// How far the time of a change may be off, s: so far that the readings which lie on its other side then
/// differ by their noise (`after` is what they are off by), and half a sample at least.
pub(crate) fn error_of_time(simulations: &Simulations, change: &Effect, after: &Metrics) -> f64 {
    let set = simulations.applied();
    let whole = &simulations.whole;
    let (stamps, at) = (&whole.stamps, change.values()[0]);
    let mut values = change.values().to_vec();
    values[0] = whole.epoch.as_seconds() - BEFORE_ALL_S;
    let Ok(from_the_start) = change.with_values(values) else {
        return 0.5 / whole.rate_hz;
    };
    let before = simulations.simulate(&set.without(change.kind()));
    let since = simulations.simulate(&set.with(from_the_start));
    let differs = |k: usize| {
        let force = (since[k].specific_force - before[k].specific_force).norm_squared();
        let rate = (since[k].angular_velocity - before[k].angular_velocity).norm_squared();
        3.0 * (force / after.accel_rmse.powi(2) + rate / after.gyro_rmse.powi(2))
    };
    let first = stamps.partition_point(|stamp| stamp.as_seconds() < at);
    let count = |readings: &mut dyn Iterator<Item = usize>| {
        let mut sum = 0.0;
        let beyond = readings.take_while(|k| {
            sum += differs(*k);
            sum < 1.0
        });
        beyond.count() as f64
    };
    let both = count(&mut (0..first).rev()) + count(&mut (first..stamps.len()));
    (0.5 * both).max(0.5) / whole.rate_hz
}
