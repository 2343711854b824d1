//! How late the measured stamps are.

use cromosim_imu::{Channel, Reading};

use super::columns;
use super::pairs::Pairs;
use super::scene::Scene;
use crate::correlation::Correlations;

/// Root mean square of the angular speed about its mean, in units of the noise, below which the
/// sensor hardly turns.
const LEAST_TURNING: f64 = 5.0;
/// A step beyond so many periods is outside of what the slope tells.
const LONGEST_STEP_PERIODS: f64 = 2.0;

/// How late the measured stamps are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    pub seconds: f64,
    /// Whitened squared residual once it is taken out, for as many pairs as there are without.
    pub rest: f64,
}

impl Lag {
    /// The lag that leaves the least, from that of the angular speeds and from none; none where the
    /// sensor hardly turns.
    pub(super) fn find(scene: &Scene) -> Option<Self> {
        let correlated = correlated_lag(scene)?;
        let steps = [0.0, correlated]
            .into_iter()
            .filter_map(|start| Self::step(scene, start));
        steps.min_by(|one, other| one.rest.total_cmp(&other.rest))
    }

    /// One Gauss-Newton step on the lag, and what it really leaves.
    fn step(scene: &Scene, start: f64) -> Option<Self> {
        let here = Pairs::at_lag(scene.measured, scene.simulated, start)?;
        let (mut slope_power, mut product) = (0.0, 0.0);
        for index in 0..here.len() {
            let columns = columns::delay(&here.simulated_slope(index));
            let residual = here.residual(index);
            for channel in Channel::ALL {
                let weight = scene.sigmas[channel].powi(-2);
                slope_power += weight * columns[channel].norm_squared();
                product += weight * columns[channel].dot(&residual[channel]);
            }
        }
        let longest = LONGEST_STEP_PERIODS * here.period;
        let step = if slope_power > 0.0 {
            (product / slope_power).clamp(-longest, longest)
        } else {
            0.0
        };
        let there = Pairs::at_lag(scene.measured, scene.simulated, start + step)?;
        let all = scene.pairs.len();
        let enough = |pairs: &Pairs| pairs.len() * 2 > all;
        let rest = |pairs: &Pairs| scene.whitened(pairs) * all as f64 / pairs.len().max(1) as f64;
        [(start, &here), (start + step, &there)]
            .into_iter()
            .filter(|(_, pairs)| enough(pairs))
            .map(|(seconds, pairs)| Self {
                seconds,
                rest: rest(pairs),
            })
            .min_by(|one, other| one.rest.total_cmp(&other.rest))
    }
}

/// The lag with the greatest correlation of the angular speeds, s: it does not mind how the sensor
/// is mounted.
fn correlated_lag(scene: &Scene) -> Option<f64> {
    let pairs = scene.pairs;
    let speeds = |readings: &[Reading]| -> Vec<f64> {
        let norms = readings
            .iter()
            .map(|reading| reading.angular_velocity.norm());
        norms.collect()
    };
    let (measured, simulated) = (speeds(&pairs.measured), speeds(&pairs.simulated));
    let least = (LEAST_TURNING * scene.sigmas.gyroscope).powi(2);
    if variance(&simulated) < least || variance(&measured) < least {
        return None;
    }
    let most = ((scene.largest_lag_s / pairs.period) as usize).min(pairs.len() / 3) as i64;
    let peak = Correlations::new(&measured, &simulated).peak(-most..most + 1, |_| 0.0)?;
    Some(peak.offset * pairs.period)
}

fn variance(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / count
}
