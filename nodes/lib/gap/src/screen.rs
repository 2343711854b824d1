//! Candidates beside a fit: one linear step for each, so that only the promising ones are fitted.

use cromosim_imu::{Effect, EffectKind, EffectSet};

use crate::fit::{Context, Fit, free_values, prior_deviation};
use crate::gram::{Linear, dot};

/// Effects of the motion, the mount, the clock and the sensor that are fitted to residuals.
pub(crate) const FITTED: [EffectKind; 19] = [
    EffectKind::ReferenceTilt,
    EffectKind::ReferenceScale,
    EffectKind::MountRotation,
    EffectKind::LeverArm,
    EffectKind::MountSlip,
    EffectKind::SoftTissue,
    EffectKind::TimeOffset,
    EffectKind::ClockDrift,
    EffectKind::AccelBias,
    EffectKind::GyroBias,
    EffectKind::AccelScale,
    EffectKind::GyroScale,
    EffectKind::AccelMisalignment,
    EffectKind::GyroMisalignment,
    EffectKind::AccelBiasDrift,
    EffectKind::GyroBiasDrift,
    EffectKind::LowPass,
    EffectKind::GyroGSensitivity,
    EffectKind::Vibration,
];

/// Slowest vibration, Hz.
const LEAST_VIBRATION_HZ: f64 = 4.0;

/// A set to be fitted, with what one linear step promises of it.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub set: EffectSet,
    pub promise: f64,
}

impl Context<'_> {
    /// The best start of one effect beside `fit`: its set and the held-out log-likelihood after one
    /// linear step.
    pub fn screen(&self, fit: &Fit, kind: EffectKind) -> Option<Candidate> {
        if kind == EffectKind::MountSlip {
            return self.screen_slip(fit);
        }
        let starts = self.starts(fit, kind);
        let candidates = starts.into_iter().filter_map(|values| {
            let mut set = fit.set.clone();
            set.insert(Effect::new(kind, values).ok()?);
            let neutral = set.get(kind)?.values() == kind.spec().neutral();
            let linear = if neutral {
                let columns = self.columns(&set, &fit.prediction, kind);
                self.extended(fit, &fit.residual, &columns, &prior(kind))
            } else {
                let prediction = self.problem.predict(&self.track, &set);
                let columns = self.columns(&set, &prediction, kind);
                self.extended(
                    fit,
                    &self.residual(&prediction.readings),
                    &columns,
                    &prior(kind),
                )
            };
            Some(Candidate {
                set: self.stepped(&set, fit, kind, &linear),
                promise: linear.held_out,
            })
        });
        candidates.max_by(|a, b| a.promise.total_cmp(&b.promise))
    }

    /// `set` after the linear step of the fit's own values and the candidate's.
    fn stepped(&self, set: &EffectSet, fit: &Fit, kind: EffectKind, linear: &Linear) -> EffectSet {
        let layout = fit
            .layout
            .iter()
            .copied()
            .chain(free_values(kind).into_iter().map(|index| (kind, index)));
        let mut next = set.clone();
        for ((kind, index), change) in layout.zip(linear.step.iter()) {
            if let Some(changed) = crate::fit::changed(&next, kind, &[(index, *change)]) {
                next = changed;
            }
        }
        next
    }

    fn starts(&self, fit: &Fit, kind: EffectKind) -> Vec<Vec<f64>> {
        match kind {
            // Without a gradient at their neutral values.
            EffectKind::SoftTissue | EffectKind::LowPass | EffectKind::Vibration => {
                (kind.spec().starts)(&self.problem.view(&self.basis, &fit.prediction.readings))
            }
            _ => vec![kind.spec().neutral()],
        }
    }

    /// The time after which turning the mount helps most: all times are tried, by sums of the mount
    /// rotation's columns from there on.
    fn screen_slip(&self, fit: &Fit) -> Option<Candidate> {
        let problem = self.problem;
        let mut set = fit.set.clone();
        let kind = EffectKind::MountRotation;
        if set.get(kind).is_none() {
            set.insert(Effect::neutral(kind));
        }
        let columns = self.columns(&set, &fit.prediction, kind);
        let length = problem.length;
        let size = fit.columns.len();
        let ratio = fit.held_out_ratio();
        let weight = [ratio[0].max(1.0).recip(), ratio[1].max(1.0).recip()];
        let mut inner = nalgebra::DMatrix::zeros(size, size);
        for i in 0..size {
            for j in 0..=i {
                inner[(i, j)] = weighted(&fit.columns[i], &fit.columns[j], weight);
                inner[(j, i)] = inner[(i, j)];
            }
            inner[(i, i)] *= 1.0 + 1e-9;
        }
        let factor = if size > 0 {
            Some(inner.cholesky()?)
        } else {
            None
        };
        // Sums over the raster from the end: C'C, C'e, C'J.
        let mut own = nalgebra::Matrix3::<f64>::zeros();
        let mut right = nalgebra::Vector3::<f64>::zeros();
        let mut mixed = nalgebra::DMatrix::<f64>::zeros(size, 3);
        let mut best = (0.0, 0, nalgebra::Vector3::zeros());
        let margin = length / 8;
        for place in (0..length).rev() {
            for axis in 0..6 {
                let at = axis * length + place;
                let c = nalgebra::Vector3::new(columns[0][at], columns[1][at], columns[2][at])
                    * weight[axis / 3];
                let plain = nalgebra::Vector3::new(columns[0][at], columns[1][at], columns[2][at]);
                own += c * plain.transpose();
                right += c * fit.residual[at];
                for i in 0..size {
                    for j in 0..3 {
                        mixed[(i, j)] += fit.columns[i][at] * c[j];
                    }
                }
            }
            if place < margin || place > length - margin {
                continue;
            }
            let schur = match &factor {
                Some(factor) => {
                    own - nalgebra::Matrix3::from_iterator(
                        (mixed.transpose() * factor.solve(&mixed)).iter().copied(),
                    )
                }
                None => own,
            };
            if let Some(factor) = (schur + nalgebra::Matrix3::identity()).cholesky() {
                let turn = factor.solve(&right);
                let gain = turn.dot(&right);
                if gain > best.0 {
                    best = (gain, place, turn);
                }
            }
        }
        if best.0 <= 0.0 {
            return None;
        }
        let at = problem
            .epoch
            .plus_seconds((best.1 as f64 - 0.5) / problem.rate_hz);
        let lag_s = fit
            .set
            .get(EffectKind::TimeOffset)
            .and_then(|effect| effect.values().first().copied())
            .unwrap_or(0.0);
        let mut with_slip = fit.set.clone();
        crate::gross::insert(
            &mut with_slip,
            EffectKind::MountSlip,
            vec![at.as_seconds() - lag_s, best.2.x, best.2.y, best.2.z],
        );
        let prediction = problem.predict(&self.track, &with_slip);
        let own_columns = self.columns(&with_slip, &prediction, EffectKind::MountSlip);
        let linear = self.extended(
            fit,
            &self.residual(&prediction.readings),
            &own_columns,
            &prior(EffectKind::MountSlip),
        );
        Some(Candidate {
            set: self.stepped(&with_slip, fit, EffectKind::MountSlip, &linear),
            promise: linear.held_out,
        })
    }

    /// The time of a slip to the sample: whichever of the times around leaves least.
    pub fn sharpen_slip(&self, fit: Fit) -> Fit {
        let Some(slip) = fit.set.get(EffectKind::MountSlip).cloned() else {
            return fit;
        };
        let score = |at: f64| {
            let mut set = fit.set.clone();
            let mut values = slip.values().to_vec();
            values[0] = at;
            crate::gross::insert(&mut set, EffectKind::MountSlip, values);
            let residual = self.residual(&self.problem.predict(&self.track, &set).readings);
            let ratio = fit.held_out_ratio();
            (
                weighted(
                    &residual,
                    &residual,
                    [ratio[0].max(1.0).recip(), ratio[1].max(1.0).recip()],
                ),
                set,
            )
        };
        let period = 1.0 / self.problem.rate_hz;
        let mut best = (score(slip.values()[0]).0, fit.set.clone(), slip.values()[0]);
        for step in [8.0 * period, 2.0 * period, 0.5 * period] {
            let centre = best.2;
            for k in -4..=4 {
                let at = centre + f64::from(k) * step;
                let (squares, set) = score(at);
                if squares < best.0 {
                    best = (squares, set, at);
                }
            }
        }
        if best.1 == fit.set {
            fit
        } else {
            self.fit(best.1)
        }
    }
}

impl Context<'_> {
    /// Whether a vibration in the set is more than motion that the reference does not resolve:
    /// stronger than a tenth of the white noise, alone in the accelerometer, and one sinusoid that
    /// takes most of the line away.
    pub fn true_vibration(&self, fit: &Fit) -> bool {
        let kind = EffectKind::Vibration;
        let Some(vibration) = fit.set.get(kind) else {
            return true;
        };
        let values = vibration.values();
        let power: f64 = values[1..4]
            .iter()
            .map(|amplitude| 0.5 * amplitude * amplitude)
            .sum();
        // Slow lines are gait.
        if power < 0.3 * self.basis.sigma[0].powi(2) || values[0] < LEAST_VIBRATION_HZ {
            return false;
        }
        let without = self.problem.predict(&self.track, &fit.set.without(kind));
        let (before, after) = (
            self.problem.residual(&without.readings),
            self.problem.residual(&fit.prediction.readings),
        );
        let line = |series: &[Vec<f64>], channel: usize| {
            let spectrum = self.problem.channel_spectrum(series, channel);
            let around = spectrum
                .median(values[0] - 4.0, values[0] + 4.0)
                .unwrap_or(0.0)
                .max(1e-30);
            let band = spectrum.band(values[0] - 0.75, values[0] + 1.0);
            (
                band.iter().copied().fold(0.0, f64::max) / around,
                band.iter().sum::<f64>() - around * band.len() as f64,
            )
        };
        let (height, power_before) = line(&before, 0);
        let (_, power_after) = line(&after, 0);
        let (turning, _) = line(&after, 1);
        height > 20.0 && turning < 8.0 && power_after < 0.3 * power_before
    }
}

fn prior(kind: EffectKind) -> Vec<f64> {
    free_values(kind)
        .into_iter()
        .map(|index| prior_deviation(kind, index).powi(-2))
        .collect()
}

/// Inner product of flat whitened series, each channel with its weight.
pub(crate) fn weighted(a: &[f64], b: &[f64], weight: [f64; 2]) -> f64 {
    let half = a.len() / 2;
    weight[0] * dot(&a[..half], &b[..half]) + weight[1] * dot(&a[half..], &b[half..])
}
