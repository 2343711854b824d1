//! The effects that the monitor tries, and what each explains.

use nalgebra::{Matrix3, Vector3};

use super::pairs::Pairs;
use super::{ImuReading, columns};

/// Standard gravity, m/s2.
const GRAVITY: f64 = 9.80665;
/// How fast the estimate of the vertical forgets accelerations, s.
const VERTICAL_TIME_S: f64 = 1.0;
/// Readings at the very same limit before it counts as one.
const LEAST_CLIPPED: usize = 5;
/// Units other than SI that accelerometers come in (g, mg, milli) and gyroscopes (degrees, milli).
const FACTORS: [&[f64]; 2] = [
    &[1.0 / GRAVITY, 1000.0 / GRAVITY, 1e3, 1e-3],
    &[57.295_779_513, 57_295.779_513, 1e3, 1e-3],
];
/// A slope this close to a known factor, relatively, is that factor.
const FACTOR_TOLERANCE: f64 = 0.1;

/// What a window offers to the candidates.
pub(super) struct Scene<'a> {
    pub measured: &'a [ImuReading],
    pub simulated: &'a [ImuReading],
    pub pairs: &'a Pairs,
    /// Whitening, m/s2 and rad/s.
    pub sigmas: [f64; 2],
    /// White noise found in the measured stream.
    pub found: [f64; 2],
    /// White noise declared for it.
    pub declared: [f64; 2],
    pub largest_lag_s: f64,
}

/// How late the measured stamps are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    pub seconds: f64,
    /// Whitened squared residual once it is taken out, for as many pairs as there are without.
    pub rest: f64,
}

/// One effect tried alone.
pub(super) struct Tried {
    pub effect: &'static str,
    /// Of the whitened squared residual.
    pub reduction: f64,
    pub parameters: usize,
}

fn tried(effect: &'static str, parameters: usize, reduction: f64) -> Tried {
    Tried {
        effect,
        reduction,
        parameters,
    }
}

impl Scene<'_> {
    fn whitened(&self, pairs: &Pairs) -> f64 {
        let sums = pairs.squared_residuals();
        sums[0] / self.sigmas[0].powi(2) + sums[1] / self.sigmas[1].powi(2)
    }

    /// Everything that can be tried on this window.
    pub(super) fn reductions(&self, lag: Option<Lag>) -> Vec<Tried> {
        let (pairs, sigmas) = (self.pairs, self.sigmas);
        let at = |index: usize| &pairs.simulated[index];
        let names = [
            ["accel_bias", "accel_scale", "accel_misalignment"],
            ["gyro_bias", "gyro_scale", "gyro_misalignment"],
        ];
        let mut all = Vec::new();
        for (channel, [bias, scale, misalignment]) in names.into_iter().enumerate() {
            all.push(tried(
                bias,
                3,
                columns::explained(pairs, sigmas, |_| columns::bias(channel)),
            ));
            all.push(tried(
                scale,
                3,
                columns::explained(pairs, sigmas, |index| columns::scale(at(index), channel)),
            ));
            all.push(tried(
                misalignment,
                3,
                columns::explained(pairs, sigmas, |index| {
                    columns::misalignment(at(index), channel)
                }),
            ));
        }
        let lever =
            |index: usize| columns::lever_arm(&at(index)[1], &pairs.simulated_slope(index)[1]);
        all.push(tried(
            "lever_arm",
            3,
            columns::explained(pairs, sigmas, lever),
        ));
        all.push(tried(
            "gyro_g_sensitivity",
            9,
            columns::explained(pairs, sigmas, |index| columns::g_sensitivity(&at(index)[0])),
        ));
        let total = self.whitened(pairs);
        all.extend(lag.map(|lag| tried("time_offset", 1, total - lag.rest)));
        all.extend(self.rotations(total));
        all.extend((0..2).filter_map(|channel| self.units(channel)));
        all.extend((0..2).filter_map(|channel| self.saturation(channel)));
        all.extend((0..2).filter_map(|channel| self.noise(channel)));
        all.extend(self.gravity());
        all
    }

    /// The lag that leaves the least, from that of the rates' norms and from none; none where the
    /// sensor hardly turns.
    pub(super) fn lag(&self) -> Option<Lag> {
        let correlated = self.correlated_lag()?;
        let steps = [0.0, correlated]
            .into_iter()
            .filter_map(|start| self.lag_step(start));
        steps.min_by(|one, other| one.rest.total_cmp(&other.rest))
    }

    /// The lag with the greatest correlation of |w|, refined by a parabola: it does not mind how
    /// the sensor is mounted.
    fn correlated_lag(&self) -> Option<f64> {
        let pairs = self.pairs;
        let series = |values: &[[Vector3<f64>; 2]]| {
            let norms: Vec<f64> = values.iter().map(|both| both[1].norm()).collect();
            let mean = norms.iter().sum::<f64>() / norms.len() as f64;
            norms
                .into_iter()
                .map(|norm| norm - mean)
                .collect::<Vec<f64>>()
        };
        let (measured, simulated) = (series(&pairs.measured), series(&pairs.simulated));
        let power = |series: &[f64]| {
            series.iter().map(|value| value * value).sum::<f64>() / series.len() as f64
        };
        if power(&simulated) < (5.0 * self.sigmas[1]).powi(2)
            || power(&measured) < (5.0 * self.sigmas[1]).powi(2)
        {
            return None;
        }
        let most = ((self.largest_lag_s / pairs.period) as usize).min(pairs.len() / 3) as isize;
        let correlation = |lag: isize| {
            let (first, last) = (lag.max(0), pairs.len() as isize + lag.min(0));
            let (mut product, mut one, mut other) = (0.0, 0.0, 0.0);
            for index in first..last {
                let (m, s) = (measured[index as usize], simulated[(index - lag) as usize]);
                (product, one, other) = (product + m * s, one + m * m, other + s * s);
            }
            product / (one * other).sqrt().max(f64::MIN_POSITIVE)
        };
        let values: Vec<f64> = (-most..=most).map(correlation).collect();
        let best =
            (0..values.len()).max_by(|&one, &other| values[one].total_cmp(&values[other]))?;
        let shift = match (
            best.checked_sub(1).and_then(|left| values.get(left)),
            values.get(best + 1),
        ) {
            (Some(left), Some(right)) if left + right < 2.0 * values[best] => {
                0.5 * (left - right) / (left + right - 2.0 * values[best])
            }
            _ => 0.0,
        };
        Some((best as f64 - most as f64 + shift) * pairs.period)
    }

    /// One Gauss-Newton step on the lag, and what it really leaves.
    fn lag_step(&self, start: f64) -> Option<Lag> {
        let here = Pairs::at_lag(self.measured, self.simulated, start)?;
        let (mut slope_power, mut product) = (0.0, 0.0);
        for index in 0..here.len() {
            let (columns, residual) = (
                columns::delay(&here.simulated_slope(index)),
                here.residual(index),
            );
            for channel in 0..2 {
                let weight = self.sigmas[channel].powi(-2);
                slope_power += weight * columns[channel].norm_squared();
                product += weight * columns[channel].dot(&residual[channel]);
            }
        }
        // A step beyond two periods is outside of what the slope tells.
        let step = if slope_power > 0.0 {
            (product / slope_power).clamp(-2.0 * here.period, 2.0 * here.period)
        } else {
            0.0
        };
        let rest = |pairs: &Pairs| {
            self.whitened(pairs) * self.pairs.len() as f64 / pairs.len().max(1) as f64
        };
        let there = Pairs::at_lag(self.measured, self.simulated, start + step)?;
        let enough = |pairs: &Pairs| pairs.len() * 2 > self.pairs.len();
        let candidates = [(start, &here), (start + step, &there)]
            .into_iter()
            .filter(|(_, pairs)| enough(pairs));
        candidates
            .map(|(seconds, pairs)| Lag {
                seconds,
                rest: rest(pairs),
            })
            .min_by(|one, other| one.rest.total_cmp(&other.rest))
    }

    /// The orthogonal matrix that turns simulated into measured best (Kabsch 1976), and the signed
    /// permutation next to it.
    fn rotations(&self, total: f64) -> Vec<Tried> {
        let (mut products, mut power) = (Matrix3::zeros(), 0.0);
        for (measured, simulated) in self.pairs.measured.iter().zip(&self.pairs.simulated) {
            for channel in 0..2 {
                let weight = self.sigmas[channel].powi(-2);
                products += measured[channel] * simulated[channel].transpose() * weight;
                power +=
                    weight * (measured[channel].norm_squared() + simulated[channel].norm_squared());
            }
        }
        let svd = products.svd(true, true);
        let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
            return Vec::new();
        };
        let rest = |turn: &Matrix3<f64>| power - 2.0 * turn.component_mul(&products).sum();
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant().signum()));
        let mut all = vec![tried("mount_rotation", 3, total - rest(&(u * flip * v)))];
        let permutation = (u * v).map(f64::round);
        let is_permutation =
            (permutation * permutation.transpose() - Matrix3::identity()).norm() < 1e-9;
        let is_near = (permutation - u * v).norm() < 0.25;
        // Without motion about all axes the third direction is a guess.
        let is_told = svd.singular_values.min() > 1e-4 * svd.singular_values.max();
        if is_permutation && is_near && is_told && permutation != Matrix3::identity() {
            all.push(tried("axis_convention", 1, total - rest(&permutation)));
        }
        all
    }

    /// A slope of measured on simulated that is a known factor.
    fn units(&self, channel: usize) -> Option<Tried> {
        let both = self
            .pairs
            .measured
            .iter()
            .zip(&self.pairs.simulated)
            .map(|(m, s)| (m[channel], s[channel]));
        let (product, power) = both.clone().fold((0.0, 0.0), |(product, power), (m, s)| {
            (product + m.dot(&s), power + s.norm_squared())
        });
        let slope = product / power.max(f64::MIN_POSITIVE);
        let close = |factor: &&f64| (slope / **factor - 1.0).abs() < FACTOR_TOLERANCE;
        let factor = *FACTORS[channel].iter().find(close)?;
        let reduction: f64 = both
            .map(|(m, s)| (m - s).norm_squared() - (m - s * factor).norm_squared())
            .sum();
        Some(tried(
            ["accel_units", "gyro_units"][channel],
            1,
            reduction / self.sigmas[channel].powi(2),
        ))
    }

    /// Readings that stand at one limit while the simulation goes beyond.
    fn saturation(&self, channel: usize) -> Option<Tried> {
        let limit = self
            .pairs
            .measured
            .iter()
            .map(|both| both[channel].amax())
            .fold(0.0, f64::max);
        let (mut clipped, mut reduction) = (0, 0.0);
        for (measured, simulated) in self.pairs.measured.iter().zip(&self.pairs.simulated) {
            for axis in 0..3 {
                let (m, s) = (measured[channel][axis], simulated[channel][axis]);
                if m.abs() >= limit * (1.0 - 1e-6) && s * m.signum() > limit {
                    clipped += 1;
                    reduction += (m - s).powi(2) / self.sigmas[channel].powi(2);
                }
            }
        }
        (clipped >= LEAST_CLIPPED).then(|| {
            tried(
                ["accel_saturation", "gyro_saturation"][channel],
                1,
                reduction,
            )
        })
    }

    /// White noise beyond the declared; fourth differences see nothing but noise, so nothing else
    /// can explain it.
    fn noise(&self, channel: usize) -> Option<Tried> {
        let excess = self.found[channel].powi(2) - self.declared[channel].powi(2);
        let reduction = 3.0 * self.pairs.len() as f64 * excess / self.sigmas[channel].powi(2);
        (excess > 0.0).then(|| tried(["accel_noise", "gyro_noise"][channel], 1, reduction))
    }

    /// Gravity left out of the measured readings, or of the other sign: the residual follows the
    /// vertical with a slope of -1 or -2.
    fn gravity(&self) -> Option<Tried> {
        let up = self.vertical();
        let forces = |index: usize| self.pairs.residual(index)[0];
        let product: f64 = up
            .iter()
            .enumerate()
            .map(|(index, up)| forces(index).dot(up))
            .sum();
        let power: f64 = up.iter().map(Vector3::norm_squared).sum();
        let slope = product / power.max(f64::MIN_POSITIVE);
        let factor = [-1.0, -2.0]
            .into_iter()
            .find(|factor| (slope - factor).abs() < 0.15)?;
        let change = |(index, up): (usize, &Vector3<f64>)| {
            forces(index).norm_squared() - (forces(index) - up * factor).norm_squared()
        };
        let reduction: f64 = up.iter().enumerate().map(change).sum();
        Some(tried(
            "gravity_convention",
            1,
            reduction / self.sigmas[0].powi(2),
        ))
    }

    /// Gravity's reaction in sensor axes, m/s2: the simulated force, carried along by the simulated
    /// rate and averaged over a second, in both directions of time.
    fn vertical(&self) -> Vec<Vector3<f64>> {
        let pass = |order: &mut dyn Iterator<Item = usize>| {
            let mut up = vec![Vector3::zeros(); self.pairs.len()];
            let mut last: Option<usize> = None;
            for index in order {
                let [force, rate] = self.pairs.simulated[index];
                up[index] = last.map_or(force, |last| {
                    let step = self.pairs.seconds[index] - self.pairs.seconds[last];
                    let carried = up[last] - rate.cross(&up[last]) * step;
                    carried + (force - carried) * (step.abs() / VERTICAL_TIME_S).min(1.0)
                });
                last = Some(index);
            }
            up
        };
        let (forwards, backwards) = (
            pass(&mut (0..self.pairs.len())),
            pass(&mut (0..self.pairs.len()).rev()),
        );
        let mean = |(one, other): (Vector3<f64>, Vector3<f64>)| {
            (one + other).try_normalize(1e-9).unwrap_or_default() * GRAVITY
        };
        forwards.into_iter().zip(backwards).map(mean).collect()
    }
}
