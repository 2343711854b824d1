//! Arithmetic over lanes, four numbers at once where the processor has registers for them (AVX2).
//!
//! Written out because the compiler finds such registers by itself for two lanes, and for more leaves
//! most operations to one number at a time: a pose then took as long in eight lanes as in two. No
//! multiplication is fused with its addition, so that every processor gives the same bytes.

/// Four numbers, an operation on all of them at once.
pub(crate) trait Four: Copy {
    type Numbers: Copy;
    fn load(self, numbers: &[f64; 4]) -> Self::Numbers;
    fn store(self, numbers: Self::Numbers) -> [f64; 4];
    fn splat(self, number: f64) -> Self::Numbers;
    fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn subtract(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn multiply(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn divide(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn square_root(self, a: Self::Numbers) -> Self::Numbers;
    /// `a` where it is greater than `b`, else `b`: also where one is no number.
    fn greater(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// `a` where it is less than `b`, else `b`.
    fn less(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// Whether all are greater than zero.
    fn are_positive(self, a: Self::Numbers) -> bool;
}

/// As the compiler has it for any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

impl Four for Plain {
    type Numbers = [f64; 4];

    #[inline(always)]
    fn load(self, numbers: &[f64; 4]) -> [f64; 4] {
        *numbers
    }

    #[inline(always)]
    fn store(self, numbers: [f64; 4]) -> [f64; 4] {
        numbers
    }

    #[inline(always)]
    fn splat(self, number: f64) -> [f64; 4] {
        [number; 4]
    }

    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }

    #[inline(always)]
    fn subtract(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
    }

    #[inline(always)]
    fn multiply(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
    }

    #[inline(always)]
    fn divide(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] / b[0], a[1] / b[1], a[2] / b[2], a[3] / b[3]]
    }

    #[inline(always)]
    fn square_root(self, a: [f64; 4]) -> [f64; 4] {
        [a[0].sqrt(), a[1].sqrt(), a[2].sqrt(), a[3].sqrt()]
    }

    #[inline(always)]
    fn greater(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
    }

    #[inline(always)]
    fn less(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }

    #[inline(always)]
    fn are_positive(self, a: [f64; 4]) -> bool {
        (a[0] > 0.0) & (a[1] > 0.0) & (a[2] > 0.0) & (a[3] > 0.0)
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{__m256d, _CMP_GT_OQ};

    use pulp::bytemuck::cast;
    use pulp::x86::V3;

    use super::Four;

    impl Four for V3 {
        type Numbers = __m256d;

        #[inline(always)]
        fn load(self, numbers: &[f64; 4]) -> __m256d {
            cast(*numbers)
        }

        #[inline(always)]
        fn store(self, numbers: __m256d) -> [f64; 4] {
            cast(numbers)
        }

        #[inline(always)]
        fn splat(self, number: f64) -> __m256d {
            self.avx._mm256_set1_pd(number)
        }

        #[inline(always)]
        fn add(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_add_pd(a, b)
        }

        #[inline(always)]
        fn subtract(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_sub_pd(a, b)
        }

        #[inline(always)]
        fn multiply(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_mul_pd(a, b)
        }

        #[inline(always)]
        fn divide(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_div_pd(a, b)
        }

        #[inline(always)]
        fn square_root(self, a: __m256d) -> __m256d {
            self.avx._mm256_sqrt_pd(a)
        }

        #[inline(always)]
        fn greater(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_max_pd(a, b)
        }

        #[inline(always)]
        fn less(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_min_pd(a, b)
        }

        #[inline(always)]
        fn are_positive(self, a: __m256d) -> bool {
            let zero = self.avx._mm256_setzero_pd();
            let positive = self.avx._mm256_cmp_pd::<_CMP_GT_OQ>(a, zero);
            self.avx._mm256_movemask_pd(positive) == 0b1111
        }
    }
}

/// What is gone with its first use: a closure that uses it up can run once only. One that could run again
/// would be called through a function of the compiler's, which is not inlined.
pub(crate) struct Once;

impl Once {
    #[inline(always)]
    pub(crate) fn use_up(self) {}
}

/// Runs an expression, in which a name stands for the [`Four`] that this processor has; compiled once for
/// each kind. What the expression calls has to be inlined into it.
macro_rules! widest {
    ($four:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        let done = match pulp::x86::V3::try_new() {
            Some($four) => {
                let once = crate::wide::Once;
                pulp::Simd::vectorize(
                    $four,
                    #[inline(always)]
                    || {
                        once.use_up();
                        $work
                    },
                )
            }
            None => {
                let $four = crate::wide::Plain;
                $work
            }
        };
        #[cfg(not(target_arch = "x86_64"))]
        let done = {
            let $four = crate::wide::Plain;
            $work
        };
        done
    }};
}
pub(crate) use widest;

/// Sets each lane: to an expression in vectors of four, and those that are left over to the same in numbers.
/// No closures, which would not always be inlined.
macro_rules! lane_by_lane {
    ($s:ident, $x:ident, $($input:ident),*; $of_four:expr; $of_one:expr) => {
        let (whole, rest) = $x.as_chunks_mut::<4>();
        for (_k, own) in whole.iter_mut().enumerate() {
            let $x = $s.load(own);
            $(let $input = $s.load(&$input.as_chunks::<4>().0[_k]);)*
            *own = $s.store($of_four);
        }
        for (_k, own) in rest.iter_mut().enumerate() {
            let $x = *own;
            $(let $input = $input.as_chunks::<4>().1[_k];)*
            *own = $of_one;
        }
    };
}

/// `x += a b`, lane by lane.
#[inline(always)]
pub(crate) fn add_product<const L: usize>(
    s: impl Four,
    x: &mut [f64; L],
    a: &[f64; L],
    b: &[f64; L],
) {
    lane_by_lane!(s, x, a, b; s.add(x, s.multiply(a, b)); x + a * b);
}

/// `x -= a b`, lane by lane.
#[inline(always)]
pub(crate) fn subtract_product<const L: usize>(
    s: impl Four,
    x: &mut [f64; L],
    a: &[f64; L],
    b: &[f64; L],
) {
    lane_by_lane!(s, x, a, b; s.subtract(x, s.multiply(a, b)); x - a * b);
}

/// `x += factor a`, lane by lane.
#[inline(always)]
pub(crate) fn add_scaled<const L: usize>(
    s: impl Four,
    x: &mut [f64; L],
    factor: f64,
    a: &[f64; L],
) {
    let factors = s.splat(factor);
    lane_by_lane!(s, x, a; s.add(x, s.multiply(factors, a)); x + factor * a);
}

/// `x -= factor a`, lane by lane.
#[inline(always)]
pub(crate) fn subtract_scaled<const L: usize>(
    s: impl Four,
    x: &mut [f64; L],
    factor: f64,
    a: &[f64; L],
) {
    let factors = s.splat(factor);
    lane_by_lane!(s, x, a; s.subtract(x, s.multiply(factors, a)); x - factor * a);
}

/// `x *= a`, lane by lane.
#[inline(always)]
pub(crate) fn multiply<const L: usize>(s: impl Four, x: &mut [f64; L], a: &[f64; L]) {
    lane_by_lane!(s, x, a; s.multiply(x, a); x * a);
}

/// `x *= factor`, lane by lane.
#[inline(always)]
pub(crate) fn scale<const L: usize>(s: impl Four, x: &mut [f64; L], factor: f64) {
    let factors = s.splat(factor);
    lane_by_lane!(s, x,; s.multiply(x, factors); x * factor);
}

/// `x += a`, lane by lane.
#[inline(always)]
pub(crate) fn add<const L: usize>(s: impl Four, x: &mut [f64; L], a: &[f64; L]) {
    lane_by_lane!(s, x, a; s.add(x, a); x + a);
}

/// `factor a`, lane by lane.
#[inline(always)]
pub(crate) fn scaled<const L: usize>(s: impl Four, a: &[f64; L], factor: f64) -> [f64; L] {
    let mut x = *a;
    scale(s, &mut x, factor);
    x
}

/// `a / divisor`, lane by lane.
#[inline(always)]
pub(crate) fn divided<const L: usize>(s: impl Four, a: &[f64; L], divisor: &[f64; L]) -> [f64; L] {
    let mut quotient = *a;
    let x = &mut quotient;
    lane_by_lane!(s, x, divisor; s.divide(x, divisor); x / divisor);
    quotient
}

/// `x += sum_k factors_k rows_k`, lane by lane, the first row first. A lane stays in its register meanwhile,
/// which it does not where [`add_scaled`] is called for each row.
#[inline(always)]
pub(crate) fn add_scaled_rows<const L: usize, const W: usize>(
    s: impl Four,
    x: &mut [f64; L],
    factors: &[f64; W],
    rows: &[[f64; L]; W],
) {
    let (whole, rest) = x.as_chunks_mut::<4>();
    for (k, own) in whole.iter_mut().enumerate() {
        let mut sum = s.load(own);
        for (factor, row) in factors.iter().zip(rows) {
            let row = s.load(&row.as_chunks::<4>().0[k]);
            sum = s.add(sum, s.multiply(s.splat(*factor), row));
        }
        *own = s.store(sum);
    }
    for (k, own) in rest.iter_mut().enumerate() {
        for (factor, row) in factors.iter().zip(rows) {
            *own += factor * row.as_chunks::<4>().1[k];
        }
    }
}

/// `x -= sum_k factors_k rows_k`, the first row first, for channels of which number c has the factors of lane
/// c modulo L.
#[inline(always)]
pub(crate) fn subtract_product_rows<const L: usize, const C: usize, const W: usize>(
    s: impl Four,
    x: &mut [f64; C],
    factors: [&[f64; L]; W],
    rows: [&[f64; C]; W],
) {
    if L == 2 && C.is_multiple_of(4) {
        // Two channels of each lane at a time.
        let twice = factors.map(|own| [own[0], own[1], own[0], own[1]]);
        for (k, own) in x.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let mut left = s.load(own);
            for (factor, row) in twice.iter().zip(rows) {
                let row = s.load(&row.as_chunks::<4>().0[k]);
                left = s.subtract(left, s.multiply(s.load(factor), row));
            }
            *own = s.store(left);
        }
        return;
    }
    for (channel, x) in x.as_chunks_mut::<L>().0.iter_mut().enumerate() {
        let (whole, rest) = x.as_chunks_mut::<4>();
        for (k, own) in whole.iter_mut().enumerate() {
            let mut left = s.load(own);
            for (factor, row) in factors.iter().zip(rows) {
                let factor = s.load(&factor.as_chunks::<4>().0[k]);
                let row = s.load(&row.as_chunks::<L>().0[channel].as_chunks::<4>().0[k]);
                left = s.subtract(left, s.multiply(factor, row));
            }
            *own = s.store(left);
        }
        for (k, own) in rest.iter_mut().enumerate() {
            for (factor, row) in factors.iter().zip(rows) {
                let row = row.as_chunks::<L>().0[channel].as_chunks::<4>().1[k];
                *own -= factor.as_chunks::<4>().1[k] * row;
            }
        }
    }
}

/// A formula of lanes, of four at once; what is left of them is filled up with ones. It has to be inlined.
#[inline(always)]
pub(crate) fn formula<S: Four, const L: usize, const N: usize>(
    s: S,
    inputs: [&[f64; L]; N],
    of_four: impl Fn([S::Numbers; N]) -> S::Numbers,
) -> [f64; L] {
    let mut made = [0.0; L];
    let (whole, rest) = made.as_chunks_mut::<4>();
    for (k, own) in whole.iter_mut().enumerate() {
        let mut fours = [s.splat(1.0); N];
        for (four, input) in fours.iter_mut().zip(inputs) {
            *four = s.load(&input.as_chunks::<4>().0[k]);
        }
        *own = s.store(of_four(fours));
    }
    if !rest.is_empty() {
        let mut fours = [s.splat(1.0); N];
        for (four, input) in fours.iter_mut().zip(inputs) {
            let mut filled = [1.0; 4];
            for (filled, own) in filled.iter_mut().zip(input.as_chunks::<4>().1) {
                *filled = *own;
            }
            *four = s.load(&filled);
        }
        let made = s.store(of_four(fours));
        for (own, made) in rest.iter_mut().zip(made) {
            *own = made;
        }
    }
    made
}

/// Whether all lanes are greater than zero.
#[inline(always)]
pub(crate) fn are_positive<const L: usize>(s: impl Four, a: &[f64; L]) -> bool {
    let (whole, rest) = a.as_chunks::<4>();
    let mut all = true;
    for four in whole {
        all &= s.are_positive(s.load(four));
    }
    for one in rest {
        all &= *one > 0.0;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    fn some_formula<S: Four>(s: S, a: &[f64; 5], b: &[f64; 5]) -> [f64; 5] {
        formula(
            s,
            [a, b],
            #[inline(always)]
            |[a, b]| {
                let root = s.square_root(s.divide(a, b));
                s.less(s.splat(1.4), s.greater(root, s.splat(0.9)))
            },
        )
    }

    #[test]
    fn a_formula_is_the_same_in_all_lanes_and_on_all_processors() {
        let (a, b) = ([1.0, 2.0, 3.0, -1.0, 0.81], [1.1, 0.5, 2.0, 1.0, 0.9]);
        let root = |k: usize| f64::sqrt(a[k] / b[k]);
        // What is no number gives way to the other in `greater`.
        let expected = [root(0), 1.4, root(2), 0.9, root(4)];
        assert_eq!(some_formula(Plain, &a, &b), expected);
        let found = widest!(s => some_formula(s, &a, &b));
        assert_eq!(found, expected);
    }

    #[test]
    fn all_lanes_have_to_be_positive() {
        for (lane, other) in [
            (0, 0.0),
            (2, f64::NAN),
            (3, -1.0),
            (4, -0.0),
            (1, f64::INFINITY),
        ] {
            let mut numbers = [1.0, 5e-324, 1e300, 2.0, 3.0];
            assert!(are_positive(Plain, &numbers) && widest!(s => are_positive(s, &numbers)));
            numbers[lane] = other;
            let positive = other > 0.0;
            assert_eq!(are_positive(Plain, &numbers), positive);
            assert_eq!(widest!(s => are_positive(s, &numbers)), positive);
        }
    }
}
