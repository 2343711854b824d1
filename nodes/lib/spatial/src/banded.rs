//! Symmetric positive definite band matrices: factorisation, solution, determinant.

use crate::SpatialError;
use crate::wide::{
    Four, Plain, add_scaled, are_positive, divided, multiply, subtract_product,
    subtract_product_rows,
};

/// Bands stored beside the diagonal: a quintic B-spline overlaps five neighbours on each side.
pub(crate) const BANDWIDTH: usize = 5;

/// A symmetric band matrix by rows: `rows[i][k]` is entry (i, i - k).
#[derive(Clone, Debug, Default)]
pub(crate) struct Banded {
    pub(crate) rows: Vec<[f64; BANDWIDTH + 1]>,
}

impl Banded {
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            rows: vec![[0.0; BANDWIDTH + 1]; size],
        }
    }

    /// Adds `weight * row row^T`, the row's entries standing at `first` and after it.
    pub(crate) fn add_outer_product<const W: usize>(
        &mut self,
        first: usize,
        row: &[f64; W],
        weight: f64,
    ) {
        let mut rows = self.rows[first..].iter_mut();
        for (i, own) in row.iter().enumerate() {
            let Some(entries) = rows.next() else { return };
            for j in 0..=i {
                entries[i - j] += weight * own * row[j];
            }
        }
    }
}

/// A row of a band matrix in L lanes: one number a lane for each entry. Lanes are matrices of the same
/// size that know nothing of each other; they take the same steps at the same time, because one alone
/// waits for its own last row most of the time.
pub(crate) type Row<const L: usize> = [[f64; L]; BANDWIDTH + 1];

/// L and D of `M = L D L^T`, L unit lower triangular, in as many lanes as there are matrices.
#[derive(Clone, Debug)]
pub(crate) struct Factor<const L: usize = 1> {
    /// `rows[i][k]` is L's entry (i, i - k) for k > 0, `rows[i][0]` is 1 / D_i; [`PADDING`] rows of
    /// zeros follow. From [`Factor::invert`] on, row `i + 5` is the inverse's row i.
    rows: Vec<Row<L>>,
    size: usize,
    /// Of one lane alone.
    log_determinant: f64,
}

/// Rows below the last that inverting reads.
const PADDING: usize = 2 * BANDWIDTH;

impl<const L: usize> Default for Factor<L> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            size: 0,
            log_determinant: 0.0,
        }
    }
}

impl<const L: usize> Factor<L> {
    /// Factors matrices in O(N), reusing this factor's memory, and on the way down does the first
    /// half of [`Factor::solve`] to `right` (empty where nothing is to be solved).
    #[inline(always)]
    pub(crate) fn factor_and_solve_down<const C: usize>(
        &mut self,
        s: impl Four,
        size: usize,
        matrix_row: impl Fn(usize) -> Row<L>,
        right: &mut [[f64; C]],
    ) -> Result<(), SpatialError> {
        self.rows.clear();
        self.rows.reserve(size + PADDING);
        self.size = size;
        let (mut log_determinant, mut product) = (0.0, 1.0_f64);
        for i in 0..size {
            let given = matrix_row(i);
            let (mut row, diagonal) = match self.rows.last_chunk() {
                Some(above) => eliminate(s, above, &given),
                None => eliminate(s, &after_zeros(&self.rows), &given),
            };
            row[0] = divided(s, &[1.0; L], &diagonal);
            // The inverse of infinity is zero.
            if !(are_positive(s, &diagonal) & are_positive(s, &row[0])) {
                return Err(SpatialError::Singular { index: i });
            }
            self.rows.push(row);
            // Nobody asks for those of several.
            if L == 1 {
                product *= diagonal[0];
                if !(1e-100..1e100).contains(&product) {
                    log_determinant += product.ln();
                    product = 1.0;
                }
            }
            if i < right.len() {
                solve_row_down(s, &row, i, right);
            }
        }
        self.rows.resize(size + PADDING, [[0.0; L]; BANDWIDTH + 1]);
        self.log_determinant = log_determinant + product.ln();
        Ok(())
    }

    /// Turns into the entries of `M^-1` within the band, the last row first, in O(N) (Takahashi,
    /// Fagan and Chin 1973): from `Z = D^-1 L^-1 + (1 - L^T) Z`. On the way up finishes `x` where it
    /// has only been solved down, and visits each row of the inverse with those after it.
    #[inline(always)]
    pub(crate) fn invert<const C: usize>(
        &mut self,
        s: impl Four,
        x: &mut [[f64; C]],
        solved: Solved,
        mut visit: impl FnMut(usize, &[[f64; C]], &InverseBlock<L>),
    ) {
        for i in (0..self.size).rev() {
            if solved == Solved::Down {
                self.solve_row_up(s, i, x);
            }
            let Some(window) = self.rows[i..].first_chunk() else {
                return;
            };
            let row = inverse_row(s, window);
            self.rows[i + BANDWIDTH] = row;
            if let Some(block) = self.rows[i + BANDWIDTH..].first_chunk() {
                visit(i, x, block);
            }
        }
    }

    /// The band, after [`Factor::invert`].
    pub(crate) fn into_inverse(self) -> InverseBands {
        InverseBands {
            entries: self.rows.into_flattened().into_flattened(),
            lanes: L,
        }
    }

    /// Solves `M x = right` in place, all channels at once; channel c belongs to lane c modulo L.
    #[inline(always)]
    pub(crate) fn solve<const C: usize>(&self, s: impl Four, right: &mut [[f64; C]]) {
        for i in 0..right.len() {
            solve_row_down(s, &self.rows[i], i, right);
        }
        self.solve_up(s, right);
    }

    /// The second half of solving.
    #[inline(always)]
    pub(crate) fn solve_up<const C: usize>(&self, s: impl Four, right: &mut [[f64; C]]) {
        for i in (0..right.len()).rev() {
            self.solve_row_up(s, i, right);
        }
    }

    #[inline(always)]
    fn solve_row_up<const C: usize>(&self, s: impl Four, i: usize, right: &mut [[f64; C]]) {
        // L^T: row i scatters into the rows above it once it is final; dividing by D first.
        let (here, below) = right[i..].split_at_mut(1);
        let x = &mut here[0];
        for x in x.as_chunks_mut::<L>().0 {
            multiply(s, x, &self.rows[i][0]);
        }
        let rows = &self.rows[i + 1..];
        match (rows.first_chunk(), below.first_chunk()) {
            (Some([a, b, c, d, e]), Some(below)) => {
                let factors = [&a[1], &b[2], &c[3], &d[4], &e[5]];
                let below: &[_; BANDWIDTH] = below;
                subtract_product_rows(s, x, factors, below.each_ref());
            }
            _ => {
                for (k, (row, other)) in rows.iter().zip(below).take(BANDWIDTH).enumerate() {
                    subtract_product_rows(s, x, [&row[k + 1]], [other]);
                }
            }
        }
    }
}

/// How far a solution has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Solved {
    /// By [`Factor::factor_and_solve_down`].
    Down,
    /// To its end.
    Whole,
}

impl Factor {
    /// Factors `left + weight * right` in O(N), reusing this factor's memory.
    pub(crate) fn factor_sum(
        &mut self,
        left: &Banded,
        weight: f64,
        right: &Banded,
    ) -> Result<(), SpatialError> {
        self.factor_rows(left.rows.len(), |i| {
            std::array::from_fn(|k| [left.rows[i][k] + weight * right.rows[i][k]])
        })
    }

    /// Factors a matrix in O(N), reusing this factor's memory.
    pub(crate) fn factor_rows(
        &mut self,
        size: usize,
        matrix_row: impl Fn(usize) -> Row<1>,
    ) -> Result<(), SpatialError> {
        self.factor_and_solve_down::<0>(Plain, size, matrix_row, &mut [])
    }

    /// Natural logarithm of the determinant.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// The part that counts of `M^-1 right`, for a right side that is zero but for the rows from
    /// `first` on: rows and their first index. The solution falls off geometrically on both sides;
    /// it is followed to `SMALL` of its largest entry, so that this costs its width and not N.
    pub(crate) fn solve_near<const C: usize>(
        &self,
        first: usize,
        right: &[[f64; C]],
    ) -> (usize, Vec<[f64; C]>) {
        let mut forward: Vec<[f64; C]> = Vec::new();
        let mut most = [0.0_f64; C];
        for i in first..self.size {
            let mut x = right.get(i - first).copied().unwrap_or([0.0; C]);
            for k in 1..=BANDWIDTH.min(i - first) {
                let ([l], other) = (self.rows[i][k], forward[i - k - first]);
                (0..C).for_each(|c| x[c] -= l * other[c]);
            }
            (0..C).for_each(|c| most[c] = most[c].max(x[c].abs()));
            forward.push(x);
            let fallen = |row: &[f64; C]| (0..C).all(|c| row[c].abs() <= SMALL * most[c]);
            if forward.len() > right.len() + BANDWIDTH
                && forward[forward.len() - BANDWIDTH..].iter().all(fallen)
            {
                break;
            }
        }
        let end = first + forward.len();
        // Newest first: row i stands at `end - 1 - i`.
        let mut solved: Vec<[f64; C]> = Vec::with_capacity(2 * forward.len());
        let mut most = [0.0_f64; C];
        for i in (0..end).rev() {
            let below = solved.len();
            let mut x = if i >= first {
                forward[i - first].map(|z| z * self.rows[i][0][0])
            } else {
                [0.0; C]
            };
            for k in 1..=BANDWIDTH.min(below) {
                let ([l], other) = (self.rows[i + k][k], solved[below - k]);
                (0..C).for_each(|c| x[c] -= l * other[c]);
            }
            (0..C).for_each(|c| most[c] = most[c].max(x[c].abs()));
            solved.push(x);
            let fallen = |row: &[f64; C]| (0..C).all(|c| row[c].abs() <= SMALL * most[c]);
            if i < first
                && solved[solved.len() - BANDWIDTH.min(solved.len())..]
                    .iter()
                    .all(fallen)
            {
                break;
            }
        }
        solved.reverse();
        (end - solved.len(), solved)
    }
}

/// Rows of an inverse, see [`Factor::invert`]: what the basis functions of one knot interval share.
pub(crate) type InverseBlock<const L: usize> = [Row<L>; BANDWIDTH + 1];

/// Inverses within the band, a lane each.
#[derive(Clone, Debug)]
pub(crate) struct InverseBands {
    /// Rows as in [`Factor`].
    entries: Vec<f64>,
    lanes: usize,
}

impl InverseBands {
    /// `row^T Z row` of one lane, the row's entries standing at `first` and after it.
    pub(crate) fn quadratic_form(
        &self,
        lane: usize,
        first: usize,
        row: &[f64; BANDWIDTH + 1],
    ) -> f64 {
        // Those of one and of two series of poses: their places are then known when this is compiled.
        match self.lanes {
            2 => self.form_amid(2, lane, first, row),
            4 => self.form_amid(4, lane, first, row),
            lanes => self.form_amid(lanes, lane, first, row),
        }
    }

    #[inline(always)]
    fn form_amid(
        &self,
        lanes: usize,
        lane: usize,
        first: usize,
        row: &[f64; BANDWIDTH + 1],
    ) -> f64 {
        let own = (first + BANDWIDTH) * (BANDWIDTH + 1) * lanes + lane;
        let block = &self.entries[own..=own + (BANDWIDTH + 1) * BANDWIDTH * lanes];
        let mut sum = 0.0;
        sum += part_of_form::<0>(block, lanes, row);
        sum += part_of_form::<1>(block, lanes, row);
        sum += part_of_form::<2>(block, lanes, row);
        sum += part_of_form::<3>(block, lanes, row);
        sum += part_of_form::<4>(block, lanes, row);
        sum += part_of_form::<5>(block, lanes, row);
        sum
    }
}

/// What row I of Z, up to its diagonal, adds to `row^T Z row`; entries are so many `lanes` apart.
#[inline(always)]
fn part_of_form<const I: usize>(block: &[f64], lanes: usize, row: &[f64; BANDWIDTH + 1]) -> f64 {
    let entry = |j: usize| block[(j * (BANDWIDTH + 1) + I - j) * lanes];
    // As sums of no number begin.
    let mut beside = -0.0;
    for (j, value) in row[..I].iter().enumerate() {
        beside += value * entry(j);
    }
    row[I] * (row[I] * entry(I) + 2.0 * beside)
}

/// `row^T Z row` in each lane, Z the block or, for rows of five, its upper left part.
#[inline(always)]
pub(crate) fn quadratic_form<const L: usize, const W: usize>(
    s: impl Four,
    block: &InverseBlock<L>,
    row: &[f64; W],
) -> [f64; L] {
    let mut form = [0.0; L];
    add_column::<L, W, 0>(s, &mut form, block, row);
    add_column::<L, W, 1>(s, &mut form, block, row);
    add_column::<L, W, 2>(s, &mut form, block, row);
    add_column::<L, W, 3>(s, &mut form, block, row);
    add_column::<L, W, 4>(s, &mut form, block, row);
    if W > BANDWIDTH {
        add_column::<L, W, 5>(s, &mut form, block, row);
    }
    form
}

#[inline(always)]
fn add_column<const L: usize, const W: usize, const J: usize>(
    s: impl Four,
    form: &mut [f64; L],
    block: &InverseBlock<L>,
    row: &[f64; W],
) {
    let mut product = [0.0; L];
    for i in 0..W {
        let entry = &block[i.min(J)][i.abs_diff(J)];
        add_scaled(s, &mut product, row[i], entry);
    }
    add_scaled(s, form, row[J], &product);
}

/// Fewer rows than the band is wide, after rows of zeros, which change nothing.
fn after_zeros<const L: usize>(rows: &[Row<L>]) -> [Row<L>; BANDWIDTH] {
    let mut all = [[[0.0; L]; BANDWIDTH + 1]; BANDWIDTH];
    all[BANDWIDTH - rows.len()..].copy_from_slice(rows);
    all
}

/// A row of L, its diagonal left out, and the row's entry of D, from the rows above it (the nearest
/// last) and the matrix' own row.
#[inline(always)]
fn eliminate<const L: usize>(
    s: impl Four,
    above: &[Row<L>; BANDWIDTH],
    given: &Row<L>,
) -> (Row<L>, [f64; L]) {
    let mut made = Eliminated {
        scaled: *given,
        row: [[0.0; L]; BANDWIDTH + 1],
        diagonal: given[0],
    };
    // Each by its own name: all places are then known when this is compiled.
    made.column::<5>(s, above);
    made.column::<4>(s, above);
    made.column::<3>(s, above);
    made.column::<2>(s, above);
    made.column::<1>(s, above);
    (made.row, made.diagonal)
}

/// A row on its way from the matrix to its factor, from the far column to the near one.
struct Eliminated<const L: usize> {
    /// `scaled[k]` is L(i, i - k) D(i - k).
    scaled: Row<L>,
    row: Row<L>,
    diagonal: [f64; L],
}

impl<const L: usize> Eliminated<L> {
    #[inline(always)]
    fn column<const K: usize>(&mut self, s: impl Four, above: &[Row<L>; BANDWIDTH]) {
        let other = &above[BANDWIDTH - K];
        let mut own = self.scaled[K];
        for n in K + 1..=BANDWIDTH {
            subtract_product(s, &mut own, &self.scaled[n], &other[n - K]);
        }
        self.scaled[K] = own;
        self.row[K] = own;
        multiply(s, &mut self.row[K], &other[0]);
        subtract_product(s, &mut self.diagonal, &own, &self.row[K]);
    }
}

/// The first half of solving, row i after those above it.
#[inline(always)]
fn solve_row_down<const L: usize, const C: usize>(
    s: impl Four,
    row: &Row<L>,
    i: usize,
    right: &mut [[f64; C]],
) {
    let (above, here) = right.split_at_mut(i);
    let x = &mut here[0];
    let [_, row @ ..] = row;
    match above.last_chunk::<BANDWIDTH>() {
        Some([e, d, c, b, a]) => subtract_product_rows(s, x, row.each_ref(), [a, b, c, d, e]),
        None => {
            for (l, other) in row.iter().zip(above.iter().rev()) {
                subtract_product_rows(s, x, [l], [other]);
            }
        }
    }
}

/// A row of the inverse from L's own row and the five below it, and the inverse's five rows below.
#[inline(always)]
fn inverse_row<const L: usize>(s: impl Four, window: &[Row<L>; 1 + PADDING]) -> Row<L> {
    let mut row = [
        window[0][0],
        inverse_entry::<L, 1>(s, window),
        inverse_entry::<L, 2>(s, window),
        inverse_entry::<L, 3>(s, window),
        inverse_entry::<L, 4>(s, window),
        inverse_entry::<L, 5>(s, window),
    ];
    let mut diagonal = row[0];
    for k in 1..=BANDWIDTH {
        subtract_product(s, &mut diagonal, &window[k][k], &row[k]);
    }
    row[0] = diagonal;
    row
}

#[inline(always)]
fn inverse_entry<const L: usize, const J: usize>(
    s: impl Four,
    window: &[Row<L>; 1 + PADDING],
) -> [f64; L] {
    let mut entry = [0.0; L];
    for k in 1..=BANDWIDTH {
        let (l, z) = (&window[k][k], &window[BANDWIDTH + k.min(J)][k.abs_diff(J)]);
        subtract_product(s, &mut entry, l, z);
    }
    entry
}

/// Where a solution is cut off, as a part of its largest entry.
const SMALL: f64 = 1e-7;

#[cfg(test)]
#[path = "banded_tests.rs"]
mod tests;
