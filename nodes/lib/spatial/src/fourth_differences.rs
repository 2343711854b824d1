//! White noise from fourth differences of neighbours: these leave hardly anything of motion, and
//! their median little of impacts.

/// `x0 - 4 x1 + 6 x2 - 4 x3 + x4` of white noise has this times its variance: 1 + 16 + 36 + 16 + 1.
pub const FOURTH_DIFFERENCE_GAIN: f64 = 70.0;
/// Median of the square of a standard normal number: the square of its third quartile.
pub const MEDIAN_OF_SQUARE: f64 = 0.674_489_75 * 0.674_489_75;
/// The same as the diagnosis has always had it: more digits would change the seventh of its results,
/// and nothing that it says.
pub const ROUNDED_MEDIAN_OF_SQUARE: f64 = 0.4549;

/// `|x0 - 4 x1 + 6 x2 - 4 x3 + x4|` of five neighbours.
pub fn fourth_difference([x0, x1, x2, x3, x4]: [f64; 5]) -> f64 {
    (x0 - 4.0 * x1 + 6.0 * x2 - 4.0 * x3 + x4).abs()
}

/// Variance of the white noise that leaves such [`fourth_difference`]s, by the median of their
/// squares; none where there are none. Reorders.
pub fn white_noise_variance(differences: &mut [f64], median_of_square: f64) -> Option<f64> {
    if differences.is_empty() {
        return None;
    }
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable_by(middle, f64::total_cmp).1;
    Some(median.powi(2) / (FOURTH_DIFFERENCE_GAIN * median_of_square))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    use super::*;

    #[test]
    fn the_noise_is_found_on_a_curve_with_impacts() {
        let mut random = ChaCha12Rng::seed_from_u64(1);
        // Irwin and Hall: the sum of twelve uniform numbers is as good as normal here.
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let series: Vec<f64> = (0..4000)
            .map(|k| {
                let t = f64::from(k) / 100.0;
                let impact = if k % 200 == 0 { 50.0 } else { 0.0 };
                10.0 * (6.0 * t).sin() + impact + 0.2 * normal()
            })
            .collect();
        let mut differences: Vec<f64> = series
            .array_windows::<5>()
            .map(|five| fourth_difference(*five))
            .collect();
        for constant in [MEDIAN_OF_SQUARE, ROUNDED_MEDIAN_OF_SQUARE] {
            let sigma = white_noise_variance(&mut differences, constant).map(f64::sqrt);
            assert!(
                sigma.is_some_and(|sigma| (sigma / 0.2 - 1.0).abs() < 0.1),
                "{sigma:?}"
            );
        }
        assert_eq!(white_noise_variance(&mut [], MEDIAN_OF_SQUARE), None);
    }
}
