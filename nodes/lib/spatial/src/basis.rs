//! Quintic B-splines with knots at the samples' own times.

/// Degree of the splines.
pub(crate) const DEGREE: usize = 5;

/// Basis functions that overlap one point.
pub(crate) const ORDER: usize = DEGREE + 1;

/// Basis functions that overlap a knot: the last of those over the interval after it begins there.
pub(crate) const AT_KNOT: usize = DEGREE;

/// Values, first and second derivatives of the basis functions at one point.
pub(crate) type BasisValues = [[f64; ORDER]; 3];

/// A quintic B-spline basis with a knot at every sample, six at each end: four functions more than
/// samples.
#[derive(Clone, Debug)]
pub(crate) struct Basis {
    knots: Vec<f64>,
}

impl Basis {
    /// `times`: strictly increasing, at least two.
    pub(crate) fn new(times: &[f64]) -> Self {
        let (start, end) = (times[0], times[times.len() - 1]);
        let mut knots = Vec::with_capacity(times.len() + 2 * DEGREE);
        knots.extend([start; DEGREE]);
        knots.extend_from_slice(times);
        knots.extend([end; DEGREE]);
        Self { knots }
    }

    /// Number of functions.
    pub(crate) fn count(&self) -> usize {
        self.knots.len() - ORDER
    }

    /// Number of knot intervals; interval k lies under the functions `k ..= k + 5`.
    pub(crate) fn interval_count(&self) -> usize {
        self.count() - DEGREE
    }

    /// The ends of interval `first`.
    pub(crate) fn interval(&self, first: usize) -> (f64, f64) {
        (self.knots[first + DEGREE], self.knots[first + DEGREE + 1])
    }

    /// The interval that holds `t`, the first or last for times outside: also the first function
    /// over `t`.
    pub(crate) fn interval_of(&self, t: f64) -> usize {
        let inner = &self.knots[ORDER..self.count()];
        // Samples at a steady rate are one unit apart in most callers' time: looking there is soon done.
        let near = (t as usize).min(inner.len());
        let begins = near.checked_sub(1).is_none_or(|before| inner[before] <= t);
        if begins && inner.get(near).is_none_or(|&after| t < after) {
            return near;
        }
        inner.partition_point(|&k| k <= t)
    }

    /// The `order`-th derivatives at `t`, in interval `first`, of the functions `first ..= first +
    /// 5`; `order` at most five.
    pub(crate) fn derivatives(&self, first: usize, t: f64, order: usize) -> [f64; ORDER] {
        let mut values = [0.0; ORDER];
        values[0] = 1.0;
        let window = self.window(first);
        for q in 1..=DEGREE - order {
            raise_value(&mut values, window, q, t);
        }
        for q in DEGREE - order + 1..=DEGREE {
            raise_derivative(&mut values, window, q);
        }
        values
    }

    /// The values at knot k, from 0 on, of the functions `k ..= k + 4`.
    pub(crate) fn at_knot(&self, k: usize) -> [f64; AT_KNOT] {
        let first = k.min(self.interval_count() - 1);
        let values = self.derivatives(first, self.knots[k + DEGREE], 0);
        std::array::from_fn(|j| values[k - first + j])
    }

    /// Value, first and second derivatives at `t` of the functions from `first` on. All degrees are written
    /// out, so that they are known when this is compiled.
    pub(crate) fn values(&self, first: usize, t: f64) -> BasisValues {
        let window = self.window(first);
        let mut value = [0.0; ORDER];
        value[0] = 1.0;
        raise_value(&mut value, window, 1, t);
        raise_value(&mut value, window, 2, t);
        raise_value(&mut value, window, 3, t);
        let mut second = value;
        raise_derivative(&mut second, window, DEGREE - 1);
        raise_derivative(&mut second, window, DEGREE);
        raise_value(&mut value, window, DEGREE - 1, t);
        let mut slope = value;
        raise_derivative(&mut slope, window, DEGREE);
        raise_value(&mut value, window, DEGREE, t);
        [value, slope, second]
    }

    /// The ten knots that the functions over interval `first` depend on; the interval lies between
    /// the fifth and the sixth.
    fn window(&self, first: usize) -> &[f64] {
        &self.knots[first + 1..first + 1 + 2 * DEGREE]
    }
}

/// Turns the values of the degree `q - 1` functions into those of degree `q` (Cox and de Boor).
#[inline(always)]
fn raise_value(values: &mut [f64; ORDER], window: &[f64], q: usize, t: f64) {
    let mut carried = 0.0;
    for j in 0..q {
        let (low, high) = (window[DEGREE + j - q], window[DEGREE + j]);
        let share = values[j] / (high - low);
        values[j] = carried + (high - t) * share;
        carried = (t - low) * share;
    }
    values[q] = carried;
}

/// Turns any derivative of the degree `q - 1` functions into the next derivative of those of degree
/// `q`: `B'_i,q = q (B_i,q-1 / (k_i+q - k_i) - B_i+1,q-1 / (k_i+q+1 - k_i+1))`.
#[inline(always)]
fn raise_derivative(values: &mut [f64; ORDER], window: &[f64], q: usize) {
    let mut carried = 0.0;
    for j in 0..q {
        let (low, high) = (window[DEGREE + j - q], window[DEGREE + j]);
        let share = q as f64 * values[j] / (high - low);
        values[j] = carried - share;
        carried = share;
    }
    values[q] = carried;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven(count: usize) -> Vec<f64> {
        (0..count)
            .map(|k| k as f64 + 0.3 * (k as f64 * 1.7).sin())
            .collect()
    }

    #[test]
    fn functions_sum_to_one_and_derivatives_to_zero() {
        for count in [2, 3, 7, 30] {
            let times = uneven(count);
            let basis = Basis::new(&times);
            assert_eq!(
                (basis.count(), basis.interval_count()),
                (count + 4, count - 1)
            );
            for k in 0..=100 {
                let t = times[0] + (times[count - 1] - times[0]) * f64::from(k) / 100.0;
                let first = basis.interval_of(t);
                let (start, end) = basis.interval(first);
                assert!(start <= t && (t < end || first == count - 2));
                let [value, slope, second] = basis.values(first, t);
                assert!((value.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                assert!(
                    slope.iter().sum::<f64>().abs() < 1e-11
                        && second.iter().sum::<f64>().abs() < 1e-10
                );
                for (order, expected) in [value, slope, second].iter().enumerate() {
                    let direct = basis.derivatives(first, t, order);
                    assert!(
                        direct
                            .iter()
                            .zip(expected)
                            .all(|(a, b)| (a - b).abs() < 1e-12)
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let basis = Basis::new(&uneven(20));
        let (t, h) = (7.4, 1e-5);
        let first = basis.interval_of(t);
        for order in 0..5 {
            let (before, after) = (
                basis.derivatives(first, t - h, order),
                basis.derivatives(first, t + h, order),
            );
            let next = basis.derivatives(first, t, order + 1);
            assert!(
                (0..ORDER).all(|j| ((after[j] - before[j]) / (2.0 * h) - next[j]).abs() < 1e-6),
                "order {order}"
            );
        }
    }
}
