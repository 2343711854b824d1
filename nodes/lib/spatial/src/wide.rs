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
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::__m256d;

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
