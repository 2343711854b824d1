//! Where fits of a magnetometer begin: its axes, its delay, the field.

use cromosim_imu::AXIS_ORDERS;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::fit::Values;
use super::samples::FieldSamples;
use crate::policy::magnetometer::{AXES_RESIDUAL, START_READINGS};

/// Delays that are tried, s: a fit finds its way from within 60 ms of the truth at 5 rad/s.
const DELAYS_S: [f64; 7] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4];

/// Field and hard iron by least squares for each way in which the axes may point, at several delays: the
/// values of the sensor's own axes without a delay, and the best of all.
pub(super) fn starts(samples: &[FieldSamples]) -> (Values, Values) {
    let nominal = solved(samples, &Matrix3::identity(), 0.0).1;
    let best_of = |axes: &Matrix3<f64>| {
        let tried = DELAYS_S.map(|delay| solved(samples, axes, delay));
        tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let own = best_of(&Matrix3::identity());
    let mut best = own.clone();
    for axes in turned_axes() {
        let tried = best_of(&axes);
        let is_better =
            |own: &(f64, Values), tried: &(f64, Values), part: f64| tried.0 < part * own.0;
        if let (Some(own), Some(last), Some(tried)) = (&own, &best, tried)
            && is_better(own, &tried, AXES_RESIDUAL)
            && is_better(last, &tried, 1.0)
        {
            best = Some(tried);
        }
    }
    let best = best.map_or_else(|| nominal.clone(), |(_, values)| values);
    (nominal, best)
}

/// The 23 signed permutations of determinant 1 beside the identity; of the others the field's sign makes
/// these.
fn turned_axes() -> Vec<Matrix3<f64>> {
    let mut all = Vec::new();
    for order in AXIS_ORDERS {
        for signs in 0..8 {
            let mut axes = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                axes[(row, column)] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            if axes.determinant() > 0.0 && axes != Matrix3::identity() {
                all.push(axes);
            }
        }
    }
    all
}

/// Mean square of the residual, T2, with the values that leave it.
fn solved(samples: &[FieldSamples], axes: &Matrix3<f64>, delay: f64) -> (f64, Values) {
    let mut values = Values {
        fields: Vec::new(),
        hard_iron: Vector3::zeros(),
        soft_iron: Matrix3::identity(),
        axes: *axes,
        delay,
    };
    let (mut sum, mut count, mut longest) = (0.0, 0.0, 0);
    for own in samples {
        let every = own.stamps.len().div_ceil(START_READINGS).max(1);
        let turns = own.turns(delay);
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        let pairs = || turns.iter().zip(&own.readings).step_by(every);
        for (turn, reading) in pairs() {
            let turn = axes * turn;
            let across = turn.transpose();
            for (at, block) in [
                ((0, 0), Matrix3::identity()),
                ((0, 3), across),
                ((3, 0), turn),
                ((3, 3), Matrix3::identity()),
            ] {
                let mut own = normal.fixed_view_mut::<3, 3>(at.0, at.1);
                own += block;
            }
            let back = across * reading;
            right += Vector6::new(back.x, back.y, back.z, reading.x, reading.y, reading.z);
        }
        // Where nothing turns, the field takes it all.
        for axis in 3..6 {
            normal[(axis, axis)] += 1e-6 * pairs().len() as f64;
        }
        let solution = normal
            .cholesky()
            .map(|it| it.solve(&right))
            .unwrap_or_default();
        let field = Vector3::new(solution[0], solution[1], solution[2]);
        let hard = Vector3::new(solution[3], solution[4], solution[5]);
        for (turn, reading) in pairs() {
            sum += (reading - axes * turn * field - hard).norm_squared();
            count += 1.0;
        }
        values.fields.push(field);
        if own.stamps.len() > longest {
            (longest, values.hard_iron) = (own.stamps.len(), hard);
        }
    }
    (sum / f64::max(count, 1.0), values)
}
