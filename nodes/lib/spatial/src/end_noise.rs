//! What part of a spline's stated variance noise makes near the ends of its samples.
//!
//! Amid its samples the noise's part of the variance of a derivative is a number ([`crate::beyond`]). At an end nothing holds the motion
//! from the other side: where accelerations are held to those around (fv near fc: a body at rest), most of what is stated of an
//! end is acceleration that the prior allows, not noise. The parts are those of splines of one weight, computed by the sum of
//! squared influences ([`crate::Influence`]) over the posterior variance, at 120 Hz with fc = 4.5 Hz; at 60 Hz and with 9 Hz
//! they differ by up to a quarter of it, where poses are few over a smoothing's width.

/// Distances from the end, in cutoffs: seconds times fc.
const DISTANCES: [f64; 10] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0];
/// fc / fv from one row to the next; the first row is of a spline without fv.
const RATIO_STEP: f64 = 0.25;
/// The noise's part at these distances over that amid the samples, of the first derivative.
const FIRST: [[f64; 10]; 7] = [
    [1.03, 1.16, 1.30, 1.37, 1.23, 1.00, 1.16, 1.24, 1.00, 1.08],
    [1.01, 1.14, 1.28, 1.36, 1.23, 1.00, 1.15, 1.22, 1.00, 1.07],
    [0.77, 0.92, 1.11, 1.25, 1.22, 0.97, 1.00, 1.08, 1.02, 1.03],
    [0.51, 0.72, 0.96, 1.14, 1.20, 1.08, 0.94, 0.94, 1.04, 0.99],
    [0.48, 0.72, 0.93, 1.09, 1.19, 1.24, 1.07, 0.93, 1.01, 0.99],
    [0.54, 0.76, 0.93, 1.08, 1.20, 1.36, 1.25, 1.04, 0.98, 1.02],
    [0.61, 0.81, 0.95, 1.09, 1.23, 1.44, 1.41, 1.23, 1.00, 1.00],
];
/// Of the second derivative.
const SECOND: [[f64; 10]; 7] = [
    [1.03, 1.14, 1.28, 1.44, 1.61, 1.65, 1.04, 1.10, 1.33, 1.06],
    [0.99, 1.11, 1.24, 1.40, 1.58, 1.63, 1.04, 1.09, 1.31, 1.05],
    [0.65, 0.75, 0.88, 1.05, 1.25, 1.44, 1.10, 1.01, 1.13, 1.04],
    [0.23, 0.31, 0.43, 0.62, 0.85, 1.19, 1.20, 1.08, 0.95, 1.04],
    [0.07, 0.12, 0.23, 0.43, 0.67, 1.03, 1.22, 1.21, 0.93, 1.02],
    [0.03, 0.05, 0.15, 0.34, 0.55, 0.89, 1.18, 1.27, 1.02, 0.99],
    [0.02, 0.03, 0.11, 0.27, 0.44, 0.78, 1.12, 1.28, 1.15, 0.99],
];

/// The noise's part so many cutoffs (seconds times fc) from the nearer end over that amid the samples, for fc / fv, of the
/// derivative of an order; straight between the tables' entries, and 1 farther away.
#[inline]
pub(crate) fn over_amid(order: i32, ratio: f64, cutoffs: f64) -> f64 {
    let last = DISTANCES.len() - 1;
    if cutoffs >= DISTANCES[last] {
        return 1.0;
    }
    let table = if order == 1 { &FIRST } else { &SECOND };
    let column = DISTANCES[1..last].partition_point(|&distance| distance <= cutoffs);
    let (near, far) = (DISTANCES[column], DISTANCES[column + 1]);
    let along = ((cutoffs - near) / (far - near)).max(0.0);
    let place = (ratio / RATIO_STEP).min((table.len() - 1) as f64);
    let first = (place as usize).min(table.len() - 2);
    let in_row = |row: &[f64; 10]| row[column] + along * (row[column + 1] - row[column]);
    let [own, next] = [first, first + 1].map(|k| in_row(&table[k]));
    own + (place - first as f64) * (next - own)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::sync::Arc;

    use super::*;
    use crate::basis::ORDER;
    use crate::equations::PenaltyWeights;
    use crate::{Influence, LocalWeight, SplineSystem, SplineWeight};

    /// Sum of squared influences over the posterior variance of the derivatives of first and second order, at a time.
    fn noise_parts(system: &Arc<SplineSystem>, weight: &SplineWeight, seconds: f64) -> [f64; 2] {
        let rows = Influence::new(system, weight).unwrap().at(seconds).rows;
        let factor = system.equations.factor(weight.of_penalty()).unwrap();
        let (first, values) = system.equations.basis_at(seconds);
        let right: [[f64; 3]; ORDER] = std::array::from_fn(|j| values.map(|row| row[j]));
        let (start, solution) = factor.solve_near(first, &right);
        [1, 2].map(|m| {
            let posterior: f64 = (0..ORDER)
                .map(|j| values[m][j] * solution[first + j - start][m])
                .sum();
            let through: f64 = rows.iter().map(|row| row[m] * row[m]).sum();
            through / posterior
        })
    }

    #[test]
    fn the_parts_are_those_of_splines() {
        for (rate_hz, cutoff_hz, tolerance) in
            [(120.0, 4.5, 0.08), (60.0, 4.5, 0.11), (60.0, 9.0, 0.26)]
        {
            let seconds: Vec<f64> = (0..400).map(|k| f64::from(k) / rate_hz).collect();
            let system = Arc::new(SplineSystem::new(&seconds).unwrap());
            let equations = &system.equations;
            for k in 1..FIRST.len() {
                let ratio = RATIO_STEP * k as f64;
                let weight = SplineWeight::Local(vec![
                    LocalWeight {
                        fifth: equations.weight_of_cutoff(cutoff_hz),
                        second: equations.second_weight_of_cutoff(cutoff_hz / ratio),
                    };
                    seconds.len() - 1
                ]);
                assert!(matches!(weight.of_penalty(), PenaltyWeights::Local(_)));
                let amid = noise_parts(&system, &weight, 12.0 / cutoff_hz);
                for cutoffs in DISTANCES {
                    let own = noise_parts(&system, &weight, cutoffs / cutoff_hz);
                    for order in [1, 2] {
                        let found = own[order - 1] / amid[order - 1];
                        let stated = over_amid(order as i32, ratio, cutoffs);
                        assert!(
                            (found - stated).abs() < tolerance,
                            "{rate_hz} Hz, {cutoff_hz} Hz, order {order}, ratio {ratio}, {cutoffs}: {found} {stated}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn it_is_straight_between_entries_and_1_far_from_the_ends() {
        let found = over_amid(2, 0.875, 0.075);
        assert!(
            (found - (0.31 + 0.43 + 0.12 + 0.23) / 4.0).abs() < 1e-12,
            "{found}"
        );
        assert_eq!(over_amid(2, 9.0, 0.0), SECOND[6][0]);
        assert_eq!(over_amid(1, 1.0, 1.0), 1.0);
    }
}
