//! Errors of simulated readings, summed over recordings.

use cromosim_imu::Reading;

/// Squared errors of the six channels: specific force x, y, z (m/s2)^2, angular velocity x, y, z
/// (rad/s)^2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SquaredErrors {
    squares: [f64; 6],
    count: f64,
}

impl SquaredErrors {
    /// Between simulated and measured readings, where something was measured.
    pub fn between(simulated: &[Reading], measured: &[Option<Reading>]) -> Self {
        let mut errors = Self::default();
        for (simulated, measured) in simulated.iter().zip(measured) {
            let Some(measured) = measured else { continue };
            let force = simulated.specific_force - measured.specific_force;
            let rate = simulated.angular_velocity - measured.angular_velocity;
            for (square, error) in errors
                .squares
                .iter_mut()
                .zip(force.iter().chain(rate.iter()))
            {
                *square += error * error;
            }
            errors.count += 1.0;
        }
        errors
    }

    /// Adds those of other recordings.
    pub fn add(&mut self, other: &Self) {
        self.squares
            .iter_mut()
            .zip(other.squares)
            .for_each(|(sum, other)| *sum += other);
        self.count += other.count;
    }

    /// Samples that were measured.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Root mean square of each channel: specific force x, y, z, m/s2, angular velocity x, y, z,
    /// rad/s.
    pub fn channels(&self) -> [f64; 6] {
        self.squares
            .map(|square| (square / self.count.max(1.0)).sqrt())
    }

    /// Root mean square per axis: specific force, m/s2, and angular velocity, rad/s.
    pub fn per_axis(&self) -> [f64; 2] {
        let mean =
            |squares: &[f64]| (squares.iter().sum::<f64>() / (3.0 * self.count.max(1.0))).sqrt();
        [mean(&self.squares[..3]), mean(&self.squares[3..])]
    }
}

/// Root mean square of readings about their mean, per axis: specific force, m/s2, and angular
/// velocity, rad/s.
pub(super) fn signal<'a>(readings: impl Iterator<Item = &'a Reading> + Clone) -> [f64; 2] {
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
        let errors = SquaredErrors::between(&simulated, &measured);
        assert_eq!(
            errors.channels(),
            [12.5f64.sqrt(), 0.0, 0.0, 0.0, 50f64.sqrt(), 0.0]
        );
        assert_eq!(
            errors.per_axis(),
            [(25.0f64 / 6.0).sqrt(), (100.0f64 / 6.0).sqrt()]
        );
    }
}
