//! Quantiles of the chi-squared distribution. Written out, as the suite needs nothing else of a
//! library of distributions.

/// Above so many degrees of freedom Wilson and Hilferty's cube root of 1931 is right to 1e-6.
const MANY: f64 = 2000.0;

/// The value that a chi-squared variable stays below with a probability whose standard normal
/// quantile is `z`, probability `p`.
pub(super) fn quantile(degrees: f64, p: f64, z: f64) -> f64 {
    let ninth = 2.0 / (9.0 * degrees);
    let cube_root = 1.0 - ninth + z * ninth.sqrt();
    if degrees > MANY {
        return degrees * cube_root.powi(3);
    }
    let (mut low, mut high) = (0.0, degrees + 12.0 * (2.0 * degrees).sqrt() + 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if lower_gamma(0.5 * degrees, 0.5 * middle) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The regularised lower incomplete gamma function (Abramowitz and Stegun, 6.5.29).
fn lower_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (mut term, mut sum, mut n) = (1.0, 1.0, a);
    while term > 1e-17 * sum {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    (sum.ln() + a * x.ln() - x - ln_gamma(a + 1.0)).exp()
}

/// Stirling's series (Abramowitz and Stegun, 6.1.41), carried up to where it is right to 1e-15.
fn ln_gamma(mut x: f64) -> f64 {
    let mut below = 0.0;
    while x < 15.0 {
        below += x.ln();
        x += 1.0;
    }
    let square = (x * x).recip();
    let series =
        (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.8: Q = 0.975 and 0.025.
        for (degrees, low, high) in [
            (1.0, 0.000_982_069, 5.023_89),
            (3.0, 0.215_795, 9.348_40),
            (10.0, 3.246_97, 20.483_1),
            (100.0, 74.221_9, 129.561),
        ] {
            let z = 1.959_963_984_540_054;
            let found = [quantile(degrees, 0.025, -z), quantile(degrees, 0.975, z)];
            assert!((found[0] / low - 1.0).abs() < 1e-5, "{degrees} {found:?}");
            assert!((found[1] / high - 1.0).abs() < 1e-5, "{degrees} {found:?}");
        }
        let [one, other] = [MANY - 1e-6, MANY + 1e-6].map(|many| quantile(many, 0.025, -1.959_964));
        assert!((one / other - 1.0).abs() < 1e-6);
    }
}
