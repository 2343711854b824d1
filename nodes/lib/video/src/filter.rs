//! Kalman filter and Rauch-Tung-Striebel smoother of the root's position.
//!
//! State x = (position, velocity, acceleration, cycle), 11 numbers; the jerk is white with density
//! q [m2/s5], so that over dt each axis has `F = [1 dt dt^2/2; 0 1 dt; 0 0 1]` and `Q = q [dt^5/20
//! dt^4/8 dt^3/6; . dt^3/3 dt^2/2; . . dt]` (Bar-Shalom, Li and Kirubarajan 2001, section 6.2.3,
//! extended to white jerk), q with one value along the vertical and one across it. On top of it the
//! body bounces at every step: a stochastic cycle (c, s) along the vertical (Harvey 1989, section
//! 2.3.4), turned by `2 pi f dt` and damped by `exp(-dt / 2 s)` from frame to frame, with standard
//! deviation b. A frame measures `position + n c` with its own full 3 x 3 covariance.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

const STATES: usize = 11;
type State = SVector<f64, STATES>;
type Covariance = SMatrix<f64, STATES, STATES>;
/// Three numbers from a state.
type Projection = SMatrix<f64, 3, STATES>;
/// For how long the bounce keeps its phase, s: some four steps.
const COHERENCE_S: f64 = 2.0;

/// One frame's position and the two parts of its covariance, m and m2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Of the root in the world, m.
    pub position: Vector3<f64>,
    /// From the pixel's error, m2.
    pub covariance_of_pixel: Matrix3<f64>,
    /// From the depth's error, m2.
    pub covariance_of_depth: Matrix3<f64>,
}

/// What the filter has to know; learnt by `learn_noise`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterNoise {
    /// Up or down, in the measurements' world; of length 1. Some degrees off do no harm.
    pub vertical: Vector3<f64>,
    /// Density of the white jerk across the vertical, per axis, m2/s5.
    pub horizontal_jerk: f64,
    /// Density of the white jerk along the vertical, m2/s5.
    pub vertical_jerk: f64,
    /// Standard deviation of the bounce along the vertical, m.
    pub bounce_std: f64,
    /// Its frequency, Hz: steps per second.
    pub bounce_hz: f64,
    /// Factor on the standard deviation that pixels are said to have.
    pub pixel_factor: f64,
    /// Factor on the standard deviation that depths are said to have.
    pub depth_factor: f64,
}

impl FilterNoise {
    /// Covariance of a measurement with the factors, m2.
    pub fn covariance(&self, measurement: &Measurement) -> Matrix3<f64> {
        // A micrometre of its own keeps it invertible where an axis has no error at all.
        measurement.covariance_of_pixel * self.pixel_factor.powi(2)
            + measurement.covariance_of_depth * self.depth_factor.powi(2)
            + Matrix3::identity() * 1e-12
    }
}

/// Position, velocity, acceleration in one frame, and how sure they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RootState {
    /// m.
    pub position: Vector3<f64>,
    /// m/s.
    pub velocity: Vector3<f64>,
    /// m/s2.
    pub acceleration: Vector3<f64>,
    /// Of the position, m2.
    pub position_covariance: Matrix3<f64>,
    /// Of the velocity, m2/s2.
    pub velocity_covariance: Matrix3<f64>,
}

/// Squared Mahalanobis distance beyond which a position is an outlier: chi-square of 3 degrees of
/// freedom at 99.9 %.
pub const GATE: f64 = 16.266;
/// Standard deviations at the start: about the median of the first measurements, and of people who
/// walk; m, m/s, m/s2.
const START_STD: [f64; 3] = [0.5, 2.0, 4.0];
/// Where nothing was measured at all, m.
const UNKNOWN_STD: f64 = 10.0;
/// How many measurements tell where the track starts: so many that an outlier among them does not
/// decide.
const START_MEASUREMENTS: usize = 9;

/// The states of all frames.
#[derive(Clone, Debug)]
pub struct FilterRun {
    noise: FilterNoise,
    estimates: Vec<Estimate>,
    /// For each frame, whether its measurement was used.
    pub accepted: Vec<bool>,
    /// Log-likelihood of the used measurements; outliers count as spread evenly over
    /// `outlier_volume_m3`.
    pub log_likelihood: f64,
}

#[derive(Clone, Debug)]
struct Estimate {
    predicted: State,
    predicted_covariance: Covariance,
    filtered: State,
    filtered_covariance: Covariance,
}

/// How measurements are chosen.
#[derive(Clone, Copy, Debug)]
pub enum Gate<'a> {
    /// By the Mahalanobis distance to the prediction.
    Mahalanobis,
    /// As decided before; one flag a frame.
    Fixed(&'a [bool]),
}

/// Share of frames that are outliers beforehand, for the likelihood.
const OUTLIER_SHARE: f64 = 0.02;
/// Where outliers may be, m3: a room.
const OUTLIER_VOLUME_M3: f64 = 100.0;

/// Runs the filter over frames `dt` seconds apart; frames without a measurement, and those beyond
/// the gate, are bridged by the prediction, whose covariance grows. Starts at the median of the
/// first nine measurements, at rest within what people do.
pub fn kalman_filter(
    measurements: &[Option<Measurement>],
    dt: f64,
    noise: &FilterNoise,
    gate: Gate<'_>,
) -> FilterRun {
    let (transition, process, seen) = (
        transition(dt, noise),
        process_noise(dt, noise),
        noise.projection(0),
    );
    let mut run = FilterRun {
        noise: *noise,
        estimates: Vec::with_capacity(measurements.len()),
        accepted: Vec::new(),
        log_likelihood: 0.0,
    };
    let (mut state, mut covariance) = start(measurements, noise);
    for (frame, measurement) in measurements.iter().enumerate() {
        if frame > 0 {
            state = transition * state;
            covariance = transition * covariance * transition.transpose() + process;
        }
        let (predicted, predicted_covariance) = (state, covariance);
        let mut used = false;
        if let Some(measurement) = measurement {
            let allowed = match gate {
                Gate::Mahalanobis => true,
                Gate::Fixed(accepted) => accepted.get(frame).copied().unwrap_or(false),
            };
            let updated =
                update(&state, &covariance, measurement, noise, &seen).filter(|updated| {
                    allowed && (matches!(gate, Gate::Fixed(_)) || updated.distance < GATE)
                });
            match updated {
                Some(updated) => {
                    (state, covariance, used) = (updated.state, updated.covariance, true);
                    run.log_likelihood += updated.log_density + (1.0 - OUTLIER_SHARE).ln();
                }
                None => run.log_likelihood += (OUTLIER_SHARE / OUTLIER_VOLUME_M3).ln(),
            }
        }
        run.accepted.push(used);
        run.estimates.push(Estimate {
            predicted,
            predicted_covariance,
            filtered: state,
            filtered_covariance: covariance,
        });
    }
    run
}

fn start(measurements: &[Option<Measurement>], noise: &FilterNoise) -> (State, Covariance) {
    let first: Vec<Vector3<f64>> = measurements
        .iter()
        .flatten()
        .take(START_MEASUREMENTS)
        .map(|measurement| measurement.position)
        .collect();
    let mut state = State::zeros();
    for axis in 0..3 {
        let mut values: Vec<f64> = first.iter().map(|position| position[axis]).collect();
        values.sort_by(f64::total_cmp);
        state[axis] = values.get(values.len() / 2).copied().unwrap_or(0.0);
    }
    let std = |order: usize| match order {
        0 if first.is_empty() => UNKNOWN_STD,
        0..3 => START_STD[order],
        _ => noise.bounce_std,
    };
    (
        state,
        Covariance::from_fn(|row, column| {
            if row == column {
                std(row / 3).powi(2)
            } else {
                0.0
            }
        }),
    )
}

struct Update {
    state: State,
    covariance: Covariance,
    distance: f64,
    log_density: f64,
}

/// Joseph's form, which keeps the covariance symmetric and positive. `None` where the innovation's
/// covariance is not positive.
fn update(
    state: &State,
    covariance: &Covariance,
    measurement: &Measurement,
    noise: &FilterNoise,
    seen: &Projection,
) -> Option<Update> {
    let own = noise.covariance(measurement);
    let innovation: Vector3<f64> = measurement.position - seen * state;
    let across: Projection = seen * covariance;
    let spread: Matrix3<f64> = across * seen.transpose() + own;
    let factor = spread.cholesky()?;
    let distance = innovation.dot(&factor.solve(&innovation));
    let log_determinant = 2.0
        * factor
            .l()
            .diagonal()
            .iter()
            .map(|value| value.ln())
            .sum::<f64>();
    let gain = factor.solve(&across).transpose();
    let kept = Covariance::identity() - gain * seen;
    let covariance = kept * covariance * kept.transpose() + gain * own * gain.transpose();
    let log_density = -0.5 * (distance + log_determinant + 3.0 * std::f64::consts::TAU.ln());
    Some(Update {
        state: state + gain * innovation,
        covariance: symmetric(&covariance),
        distance,
        log_density,
    })
    .filter(|update| update.distance.is_finite() && update.log_density.is_finite())
}

impl FilterRun {
    /// The filter's own states: each frame knows its past only.
    pub fn filtered(&self) -> Vec<RootState> {
        self.estimates
            .iter()
            .map(|estimate| {
                self.noise
                    .root_state(&estimate.filtered, &estimate.filtered_covariance)
            })
            .collect()
    }

    /// Rauch, Tung and Striebel (1965): backwards, `x_s = x + C (x_s,next - x_predicted,next)` with
    /// `C = P F^T P_predicted,next^-1`, so that each frame knows all others.
    pub fn smoothed(&self, dt: f64) -> Vec<RootState> {
        let transition = transition(dt, &self.noise);
        let Some(last) = self.estimates.last() else {
            return Vec::new();
        };
        let (mut state, mut covariance) = (last.filtered, last.filtered_covariance);
        let mut states = vec![self.noise.root_state(&state, &covariance)];
        for pair in self.estimates.windows(2).rev() {
            let (here, next) = (&pair[0], &pair[1]);
            // Positive by construction; without its factor the filter's own state is the best there
            // is.
            let gain = next.predicted_covariance.cholesky().map(|factor| {
                factor
                    .solve(&(transition * here.filtered_covariance))
                    .transpose()
            });
            (state, covariance) = match gain {
                Some(gain) => (
                    here.filtered + gain * (state - next.predicted),
                    symmetric(
                        &(here.filtered_covariance
                            + gain * (covariance - next.predicted_covariance) * gain.transpose()),
                    ),
                ),
                None => (here.filtered, here.filtered_covariance),
            };
            states.push(self.noise.root_state(&state, &covariance));
        }
        states.reverse();
        states
    }
}

impl FilterNoise {
    /// Position (order 0), velocity (1) or acceleration (2) from a state: `p + n c`, `v + n w s`,
    /// `a - n w^2 c` with `w = 2 pi f`.
    fn projection(&self, order: usize) -> Projection {
        let turn = std::f64::consts::TAU * self.bounce_hz;
        let (column, factor) = [(9, 1.0), (10, turn), (9, -turn * turn)][order];
        let mut projection = Projection::zeros();
        projection
            .fixed_columns_mut::<3>(3 * order)
            .fill_with_identity();
        projection.set_column(column, &(self.vertical * factor));
        projection
    }

    fn root_state(&self, state: &State, covariance: &Covariance) -> RootState {
        let [position, velocity, acceleration] = [0, 1, 2].map(|order| self.projection(order));
        RootState {
            position: position * state,
            velocity: velocity * state,
            acceleration: acceleration * state,
            position_covariance: position * covariance * position.transpose(),
            velocity_covariance: velocity * covariance * velocity.transpose(),
        }
    }
}

fn symmetric(matrix: &Covariance) -> Covariance {
    (matrix + matrix.transpose()) * 0.5
}

fn transition(dt: f64, noise: &FilterNoise) -> Covariance {
    let of_axis = [[1.0, dt, dt * dt / 2.0], [0.0, 1.0, dt], [0.0, 0.0, 1.0]];
    let (sine, cosine) = (std::f64::consts::TAU * noise.bounce_hz * dt).sin_cos();
    let turn = Matrix2::new(cosine, sine, -sine, cosine) * (-dt / COHERENCE_S).exp();
    Covariance::from_fn(|row, column| match (row, column) {
        (9.., 9..) => turn[(row - 9, column - 9)],
        (9.., _) | (_, 9..) => 0.0,
        _ if row % 3 == column % 3 => of_axis[row / 3][column / 3],
        _ => 0.0,
    })
}

fn process_noise(dt: f64, noise: &FilterNoise) -> Covariance {
    let power = |exponent: i32| dt.powi(exponent);
    let of_time = [
        [power(5) / 20.0, power(4) / 8.0, power(3) / 6.0],
        [power(4) / 8.0, power(3) / 3.0, power(2) / 2.0],
        [power(3) / 6.0, power(2) / 2.0, power(1)],
    ];
    let along = noise.vertical * noise.vertical.transpose();
    let density =
        along * noise.vertical_jerk + (Matrix3::identity() - along) * noise.horizontal_jerk;
    // What the damping takes off comes in anew.
    let of_cycle = noise.bounce_std.powi(2) * (1.0 - (-2.0 * dt / COHERENCE_S).exp());
    Covariance::from_fn(|row, column| match (row, column) {
        (9.., 9..) if row == column => of_cycle,
        (9.., _) | (_, 9..) => 0.0,
        _ => density[(row % 3, column % 3)] * of_time[row / 3][column / 3],
    })
}

#[cfg(test)]
#[path = "filter_tests.rs"]
mod tests;
