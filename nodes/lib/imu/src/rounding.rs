//! How far rounded readings are from others, and from what they are in the mean.

use std::f64::consts::{FRAC_2_PI, PI, TAU};

/// Standard deviation of an error, in steps, below which it matters next to the border of two steps alone, and the series
/// would be long.
const SMALL: f64 = 0.05;
/// Terms of the series at most: exp(-2 pi^2 30^2 0.05^2) is 5e-20.
const MOST_TERMS: u32 = 30;
/// A term that small, in steps, ends the series.
const LEAST_TERM: f64 = 1e-12;

/// What rounding to whole steps l adds to the mean square difference of two values that are anywhere between two
/// steps and differ by a normal error e of variance s2:
/// ```text
/// E[l^2 f (1 - f)] = l^2 (1/6 - sum over n of exp(-2 pi^2 n^2 s2 / l^2) / (pi^2 n^2)),    f the fraction of |e| / l
/// ```
/// nothing without an error, `l sqrt(2 s2 / pi)` where it is small, l^2 / 6 where it is large: each of the two
/// is rounded.
pub fn rounding_difference(variance: f64, step: f64) -> f64 {
    if step <= 0.0 || variance <= 0.0 {
        return 0.0;
    }
    let squared = variance / (step * step);
    // Below a twentieth of a step its mean fraction is itself; the series would be long.
    if squared < 0.0025 {
        return step * step * ((FRAC_2_PI * squared).sqrt() - squared);
    }
    let term = |n: u32| {
        let order = f64::from(n * n) * PI * PI;
        (-2.0 * order * squared).exp() / order
    };
    // exp(-2 pi^2 30^2 / 400) is 5e-20.
    step * step * (1.0 / 6.0 - (1..=30).map(term).sum::<f64>())
}

/// Mean of a value that is rounded to whole steps l after a normal error of variance s2 was added to it:
/// ```text
/// E[round(x + e)] = x + l sum over n of (-1)^n / (pi n) exp(-2 pi^2 n^2 s2 / l^2) sin(2 pi n x / l)
/// ```
/// a staircase without an error, a straight line where the error is of the size of a step. Of all that can be said
/// of a rounded reading in advance it is the nearest; the staircase itself is off by l^2 / 12 once more.
pub fn expected_rounding(value: f64, step: f64, variance: f64) -> f64 {
    if step <= 0.0 {
        return value;
    }
    let steps = value / step;
    if variance <= 0.0 {
        return steps.round() * step;
    }
    let squared = variance / (step * step);
    // Of the fraction: the sine of a large number is less exact.
    let fraction = steps - steps.round();
    if squared < SMALL * SMALL {
        let beyond = (fraction.abs() - 0.5) / squared.sqrt();
        return step * (steps.round() + fraction.signum() * below(beyond));
    }
    let mut sum = 0.0;
    for n in 1..=MOST_TERMS {
        let order = f64::from(n);
        let size = (-2.0 * (PI * order).powi(2) * squared).exp() / (PI * order);
        if size < LEAST_TERM {
            break;
        }
        let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * size * (TAU * order * fraction).sin();
    }
    value + step * sum
}

/// Part of normal numbers that is below one, to 2e-4 (Hendrycks and Gimpel, Gaussian error linear units, 2016).
fn below(number: f64) -> f64 {
    0.5 + 0.5 * (FRAC_2_PI.sqrt() * (number + 0.044_715 * number.powi(3))).tanh()
}

/// What rounding adds to the mean square distance of a rounded value from [`expected_rounding`], where its error has
/// a variance s2 and it is anywhere between two steps:
/// ```text
/// l^2 (1/12 - sum over n of exp(-4 pi^2 n^2 s2 / l^2) / (2 pi^2 n^2))
/// ```
/// which is half of what two independently rounded values differ by: nothing without an error, l^2 / 12 where it is
/// large.
pub fn expected_rounding_adds(variance: f64, step: f64) -> f64 {
    0.5 * rounding_difference(2.0 * variance, step)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::random::{normal_pair, stream};

    #[test]
    fn two_roundings_differ_as_stated() {
        let step = 0.3;
        for error in [0.001, 0.01, 0.014, 0.016, 0.05, 0.2, 1.0] {
            let mut random = stream(5, "rounding", 0);
            let count = 200_000;
            let mut sum = 0.0;
            for _ in 0..count {
                // Of twelve uniform numbers.
                let normal: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
                let value = random.random_range(0.0..step);
                let rounded = |value: f64| step * (value / step).round();
                sum += (rounded(value + error * normal) - rounded(value)).powi(2);
            }
            let found = sum / f64::from(count);
            let stated = error * error + rounding_difference(error * error, step);
            assert!(
                (found / stated - 1.0).abs() < 0.06,
                "{error}: {found} {stated}"
            );
        }
        assert_eq!(rounding_difference(0.0, step), 0.0);
        assert_eq!(rounding_difference(0.01, 0.0), 0.0);
    }

    #[test]
    fn rounded_readings_are_there_in_the_mean_and_as_far_off_as_stated() {
        let step = 0.3;
        for error in [0.004, 0.02, 0.06, 0.1, 0.2, 1.0] {
            let mut random = stream(5, "expected rounding", 0);
            let (mut squares, mut of_staircase) = (0.0, 0.0);
            let count = 20_000;
            let draws = 40;
            for k in 0..count {
                let value = step * (f64::from(k) + random.random_range(0.0..1.0)) / 40.0;
                let expected = expected_rounding(value, step, error * error);
                let mut sum = 0.0;
                for _ in 0..draws / 2 {
                    let [a, b] = normal_pair(&mut random);
                    for normal in [a, b] {
                        let rounded = step * ((value + error * normal) / step).round();
                        sum += rounded;
                        squares += (rounded - expected).powi(2);
                        of_staircase += (rounded - step * (value / step).round()).powi(2);
                    }
                }
                let mean = sum / f64::from(draws);
                let scatter = (error * error + step * step / 4.0) / f64::from(draws);
                assert!(
                    (mean - expected).abs() < 5.0 * scatter.sqrt(),
                    "{error} {value}: {mean} {expected}"
                );
            }
            let found = squares / f64::from(count * draws);
            let stated = error * error + expected_rounding_adds(error * error, step);
            assert!(
                (found / stated - 1.0).abs() < 0.06,
                "{error}: {found} {stated}"
            );
            assert!(squares < 1.01 * of_staircase, "{error}");
        }
    }

    #[test]
    fn nothing_is_expected_of_what_is_not_rounded_and_a_staircase_without_an_error() {
        assert_eq!(expected_rounding(0.123, 0.0, 1.0), 0.123);
        assert_eq!(expected_rounding(0.46, 0.3, 0.0), 0.6);
        assert_eq!(expected_rounding_adds(0.0, 0.3), 0.0);
    }
}
