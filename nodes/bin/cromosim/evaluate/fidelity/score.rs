//! Errors, summed over recordings.

use cromosim_imu::Reading;
use serde::{Deserialize, Serialize};

use super::cases::{Case, Simulator};
use super::protocol::{Protocol, Study};
use crate::evaluate::bootstrap::intervals;

/// Squared errors of the six channels: specific force x, y, z (m/s2)^2, angular velocity x, y, z
/// (rad/s)^2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    squares: [f64; 6],
    count: f64,
}

impl Sums {
    /// Of readings where something was measured.
    pub fn of(simulated: &[Reading], measured: &[Option<Reading>]) -> Self {
        let mut sums = Self::default();
        for (simulated, measured) in simulated.iter().zip(measured) {
            let Some(measured) = measured else { continue };
            let (force, rate) = (
                simulated.specific_force - measured.specific_force,
                simulated.angular_velocity - measured.angular_velocity,
            );
            for (square, error) in sums.squares.iter_mut().zip(force.iter().chain(rate.iter())) {
                *square += error * error;
            }
            sums.count += 1.0;
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.squares
            .iter_mut()
            .zip(other.squares)
            .for_each(|(sum, other)| *sum += other);
        self.count += other.count;
    }

    fn channels(&self) -> [f64; 6] {
        self.squares
            .map(|square| (square / self.count.max(1.0)).sqrt())
    }

    /// Root mean square per axis: specific force, m/s2, and angular velocity, rad/s.
    fn both(&self) -> [f64; 2] {
        let mean =
            |squares: &[f64]| (squares.iter().sum::<f64>() / (3.0 * self.count.max(1.0))).sqrt();
        [mean(&self.squares[..3]), mean(&self.squares[3..])]
    }
}

/// Everything that was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Results {
    /// Format.
    pub schema: String,
    /// Version that made it.
    pub version: String,
    /// Of all draws.
    pub seed: u64,
    /// Whether each motion and site was drawn only once.
    pub quick: bool,
    /// In the protocol's order.
    pub studies: Vec<StudyResults>,
}

/// One study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StudyResults {
    /// Its name.
    pub name: String,
    /// What its measured side is.
    pub measured: String,
    /// The networks' name.
    pub model: String,
    /// By position, and where there are several all together as `all`.
    pub positions: Vec<PositionResults>,
}

/// One position.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PositionResults {
    /// Its name.
    pub position: String,
    /// Recordings.
    pub recordings: usize,
    /// Their length where something was measured, s.
    pub seconds: f64,
    /// Root mean square of what was measured itself, about its mean, per axis: m/s2, rad/s.
    pub signal: [f64; 2],
    /// Those that apply.
    pub simulators: Vec<SimulatorResults>,
}

/// One simulator.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SimulatorResults {
    /// Which.
    pub simulator: Simulator,
    /// Root mean square errors of specific force x, y, z, m/s2, and angular velocity x, y, z,
    /// rad/s; sensor axes.
    pub channels: [f64; 6],
    /// Specific force, m/s2, and angular velocity, rad/s, per axis.
    pub rmse: [f64; 2],
    /// The same over that of the analytic simulator.
    pub ratio: [f64; 2],
    /// 95 % of the errors when recordings are drawn anew with replacement.
    pub rmse_interval: [[f64; 2]; 2],
    /// 95 % of the ratios likewise.
    pub ratio_interval: [[f64; 2]; 2],
}

impl Results {
    /// Of studies.
    pub fn new(protocol: &Protocol, quick: bool, studies: Vec<StudyResults>) -> Self {
        let (schema, version) = (
            "cromosim/fidelity-results/1".to_owned(),
            env!("CARGO_PKG_VERSION").to_owned(),
        );
        Self {
            schema,
            version,
            seed: protocol.seed,
            quick,
            studies,
        }
    }
}

impl StudyResults {
    /// `sums`: one for each case and simulator.
    pub fn new(study: &Study, cases: &[Case], sums: &[Vec<Option<Sums>>], seed: u64) -> Self {
        let mut names: Vec<&str> = cases.iter().map(Case::position).collect();
        names.sort_unstable();
        names.dedup();
        let of = |name: &str, keep: &dyn Fn(&Case) -> bool| {
            let kept: Vec<usize> = (0..cases.len())
                .filter(|index| keep(&cases[*index]))
                .collect();
            PositionResults::new(name, &kept, cases, sums, seed)
        };
        let mut positions: Vec<PositionResults> = names
            .iter()
            .map(|name| of(name, &|case| case.position() == *name))
            .collect();
        if names.len() > 1 {
            positions.push(of("all", &|_| true));
        }
        Self {
            name: study.name.clone(),
            measured: study.measured.clone(),
            model: study.model.clone(),
            positions,
        }
    }
}

impl PositionResults {
    fn new(
        name: &str,
        kept: &[usize],
        cases: &[Case],
        sums: &[Vec<Option<Sums>>],
        seed: u64,
    ) -> Self {
        let analytic = Simulator::ALL
            .iter()
            .position(|simulator| *simulator == Simulator::Analytic)
            .unwrap_or(0);
        let pooled = |draw: &[usize], simulator: usize| {
            let mut all = Sums::default();
            draw.iter()
                .filter_map(|index| sums[*index][simulator].as_ref())
                .for_each(|own| all.add(own));
            all
        };
        let results = |(index, simulator): (usize, &Simulator)| {
            let own = pooled(kept, index);
            (own.count > 0.0).then(|| {
                // Errors, then their ratios.
                let values = |draw: &[usize]| {
                    let kept: Vec<usize> = draw.iter().map(|place| kept[*place]).collect();
                    let ([a, b], [c, d]) =
                        (pooled(&kept, index).both(), pooled(&kept, analytic).both());
                    [a, b, a / c, b / d]
                };
                let all: Vec<usize> = (0..kept.len()).collect();
                let [.., first, second] = values(&all);
                let [rmse_first, rmse_second, ratio_first, ratio_second] =
                    intervals(kept.len(), seed, values);
                SimulatorResults {
                    simulator: *simulator,
                    channels: own.channels(),
                    rmse: own.both(),
                    ratio: [first, second],
                    rmse_interval: [rmse_first, rmse_second],
                    ratio_interval: [ratio_first, ratio_second],
                }
            })
        };
        let simulators = Simulator::ALL
            .iter()
            .enumerate()
            .filter_map(results)
            .collect();
        let measured = kept
            .iter()
            .flat_map(|index| cases[*index].measured().iter().flatten());
        let seconds = measured.clone().count() as f64 / cromosim_learned::NETWORK_RATE_HZ;
        Self {
            position: name.to_owned(),
            recordings: kept.len(),
            seconds,
            signal: signal(measured),
            simulators,
        }
    }
}

/// Spread of readings about their mean.
fn signal<'a>(readings: impl Iterator<Item = &'a Reading> + Clone) -> [f64; 2] {
    let count = readings.clone().count().max(1) as f64;
    let force = readings
        .clone()
        .map(|reading| reading.specific_force)
        .sum::<nalgebra::Vector3<f64>>()
        / count;
    let rate = readings
        .clone()
        .map(|reading| reading.angular_velocity)
        .sum::<nalgebra::Vector3<f64>>()
        / count;
    let mut sums = [0.0; 2];
    for reading in readings {
        sums[0] += (reading.specific_force - force).norm_squared();
        sums[1] += (reading.angular_velocity - rate).norm_squared();
    }
    sums.map(|sum: f64| (sum / (3.0 * count)).sqrt())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn reading(x: f64) -> Reading {
        Reading {
            specific_force: Vector3::new(x, 0.0, 9.0),
            angular_velocity: Vector3::new(0.0, 2.0 * x, 0.0),
        }
    }

    #[test]
    fn errors_are_root_mean_squares_where_something_was_measured() {
        let simulated = [reading(3.0), reading(4.0), reading(100.0)];
        let measured = [Some(reading(0.0)), Some(reading(0.0)), None];
        let sums = Sums::of(&simulated, &measured);
        assert_eq!(
            sums.channels(),
            [12.5f64.sqrt(), 0.0, 0.0, 0.0, 50f64.sqrt(), 0.0]
        );
        assert_eq!(
            sums.both(),
            [(25.0f64 / 6.0).sqrt(), (100.0f64 / 6.0).sqrt()]
        );
    }
}
