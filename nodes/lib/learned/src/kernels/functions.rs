//! Sigmoid and hyperbolic tangent over vector lanes.
//!
//! exp(x) = 2^n exp(r) with n the nearest integer of x / ln 2 and |r| <= ln(2) / 2; exp(r) - 1 is
//! its Taylor polynomial of degree 7, whose remainder is below 2e-8 of r. Without a library's exp,
//! every processor gives the same bits.

use pulp::{Arch, Simd, WithSimd};

/// Added to a number below 2^22, leaves the nearest integer plus 127 in the low bits: shifted by
/// 23, they are 2^n.
const ROUND: f32 = 12_582_912.0 + 127.0;
/// ln 2 in two parts, the first with so few bits that its product with n is exact.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;
/// Beyond, the sigmoid is 0 or 1 to f32's precision in effect.
const SIGMOID_LIMIT: f32 = 80.0;
/// Beyond, tanh rounds to 1.
const TANH_LIMIT: f32 = 9.02;
/// 1 / 2!, 1 / 3!, ... 1 / 7!
const TAYLOR: [f32; 6] = [
    0.5,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
];

/// (2^n, exp(r) - 1) with exp(x) = 2^n exp(r).
#[inline(always)]
fn split_exponential<S: Simd>(simd: S, x: S::f32s) -> (S::f32s, S::f32s) {
    let shifted = simd.mul_add_f32s(
        x,
        simd.splat_f32s(std::f32::consts::LOG2_E),
        simd.splat_f32s(ROUND),
    );
    let power = simd.transmute_f32s_u32s(
        simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(23)),
    );
    let minus_n = simd.sub_f32s(simd.splat_f32s(ROUND), shifted);
    let rest = simd.mul_add_f32s(minus_n, simd.splat_f32s(LN_2_HIGH), x);
    let rest = simd.mul_add_f32s(minus_n, simd.splat_f32s(LN_2_LOW), rest);
    let mut polynomial = simd.splat_f32s(TAYLOR[5]);
    for coefficient in TAYLOR[..5].iter().rev() {
        polynomial = simd.mul_add_f32s(polynomial, rest, simd.splat_f32s(*coefficient));
    }
    (
        power,
        simd.mul_add_f32s(simd.mul_f32s(rest, rest), polynomial, rest),
    )
}

/// Held between -limit and limit; NaN stays NaN on every processor.
#[inline(always)]
fn clamp<S: Simd>(simd: S, x: S::f32s, limit: f32) -> S::f32s {
    let (low, high) = (simd.splat_f32s(-limit), simd.splat_f32s(limit));
    let x = simd.select_f32s(simd.less_than_f32s(x, low), low, x);
    simd.select_f32s(simd.less_than_f32s(high, x), high, x)
}

/// 1 / (1 + exp(-x)), lane by lane; relative error below 3e-7 for |x| < 80.
#[inline(always)]
pub(super) fn sigmoid_lanes<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    let (power, rest) = split_exponential(simd, clamp(simd, simd.neg_f32s(x), SIGMOID_LIMIT));
    simd.div_f32s(
        one,
        simd.add_f32s(one, simd.mul_add_f32s(power, rest, power)),
    )
}

/// m / (m + 2) with m = exp(2 x) - 1, lane by lane; relative error below 4e-7, near 0 too.
#[inline(always)]
pub(super) fn tanh_lanes<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let x = clamp(simd, x, TANH_LIMIT);
    let (power, rest) = split_exponential(simd, simd.add_f32s(x, x));
    let exponential_less_one =
        simd.mul_add_f32s(power, rest, simd.sub_f32s(power, simd.splat_f32s(1.0)));
    simd.div_f32s(
        exponential_less_one,
        simd.add_f32s(exponential_less_one, simd.splat_f32s(2.0)),
    )
}

struct Each<'a, const TANH: bool>(&'a mut [f32]);

impl<const TANH: bool> WithSimd for Each<'_, TANH> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (lanes, rest) = S::as_mut_simd_f32s(self.0);
        for x in lanes {
            *x = if TANH {
                tanh_lanes(simd, *x)
            } else {
                sigmoid_lanes(simd, *x)
            };
        }
        for x in rest {
            *x = if TANH {
                tanh_lanes(pulp::Scalar, *x)
            } else {
                sigmoid_lanes(pulp::Scalar, *x)
            };
        }
    }
}

/// x becomes 1 / (1 + exp(-x)); relative error below 3e-7 for |x| < 80.
pub fn sigmoid(values: &mut [f32]) {
    Arch::new().dispatch(Each::<false>(values));
}

/// x becomes tanh(x); relative error below 4e-7.
pub fn tanh(values: &mut [f32]) {
    Arch::new().dispatch(Each::<true>(values));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Vec<f32> {
        let even = (-40_000..=40_000).map(|step| step as f32 * 2e-3);
        let small =
            (-60..=-1).flat_map(|exponent| [0.5_f32.powi(-exponent), -(0.5_f32.powi(-exponent))]);
        even.chain(small).filter(|x| x.abs() < 80.0).collect()
    }

    fn worst(found: &[f32], expected: impl Fn(f64) -> f64) -> f64 {
        let error = |(x, found): (&f32, &f32)| {
            let expected = expected(f64::from(*x));
            (f64::from(*found) - expected).abs() / expected.abs().max(1e-37)
        };
        grid().iter().zip(found).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn errors_stay_within_what_is_stated() {
        let (mut of_sigmoid, mut of_tanh) = (grid(), grid());
        sigmoid(&mut of_sigmoid);
        tanh(&mut of_tanh);
        let worst_sigmoid = worst(&of_sigmoid, |x| 1.0 / (1.0 + (-x).exp()));
        let worst_tanh = worst(&of_tanh, f64::tanh);
        assert!(worst_sigmoid < 3e-7, "{worst_sigmoid}");
        assert!(worst_tanh < 4e-7, "{worst_tanh}");
    }

    #[test]
    fn limits_and_nan() {
        let mut values = [
            f32::NEG_INFINITY,
            -200.0,
            200.0,
            f32::INFINITY,
            f32::NAN,
            0.0,
            -0.0,
            1.0,
            f32::NAN,
        ];
        sigmoid(&mut values);
        assert!(
            values[0] < 1e-34 && values[1] < 1e-34 && values[4].is_nan() && values[8].is_nan(),
            "{values:?}"
        );
        assert_eq!((values[2], values[3], values[5]), (1.0, 1.0, 0.5));
        let mut values = [
            f32::NEG_INFINITY,
            -200.0,
            200.0,
            f32::INFINITY,
            f32::NAN,
            0.0,
            -0.0,
            1e-30,
            f32::NAN,
        ];
        tanh(&mut values);
        assert!(values[4].is_nan() && values[8].is_nan());
        assert_eq!(
            (
                values[0], values[1], values[2], values[3], values[5], values[7]
            ),
            (-1.0, -1.0, 1.0, 1.0, 0.0, 1e-30)
        );
    }

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let (mut widest, mut scalar) = (grid(), grid());
        tanh(&mut widest);
        Each::<true>(&mut scalar).with_simd(pulp::Scalar);
        assert_eq!(widest, scalar);
        sigmoid(&mut widest);
        Each::<false>(&mut scalar).with_simd(pulp::Scalar);
        assert_eq!(widest, scalar);
    }
}
