//! Weighted sums around each entry of a series, by recursions.

use crate::wide::{Four, add, scale};

/// A sum of squares, and what it counts, of each lane.
pub(crate) type Evidence<const L: usize> = [[f64; L]; 2];

/// `a^|k|` convolved with itself, a so chosen that the standard deviation is as wanted: two
/// recursions each way.
pub(crate) struct Kernel {
    decay: f64,
}

impl Kernel {
    /// Of this standard deviation, in entries. One pass has the variance `2 a / (1 - a)^2`.
    pub(crate) fn new(std: f64) -> Self {
        let variance = 0.5 * std * std;
        let decay = (1.0 + variance - (1.0 + 2.0 * variance).sqrt()) / variance;
        Self { decay }
    }

    /// Weighted sums in place; a quotient of two of them is a weighted mean. `room`, for as many entries
    /// or more, is overwritten.
    #[inline(always)]
    pub(crate) fn smooth<const L: usize>(
        &self,
        s: impl Four,
        values: &mut [Evidence<L>],
        room: &mut [Evidence<L>],
    ) {
        for _ in 0..2 {
            self.pass(s, values, &mut room[..values.len()]);
        }
    }

    /// Both recursions at a time, from either end: one alone waits for its own last entry. Where they have
    /// not met yet, what they say waits in `room` for the other.
    #[inline(always)]
    fn pass<const L: usize>(
        &self,
        s: impl Four,
        values: &mut [Evidence<L>],
        room: &mut [Evidence<L>],
    ) {
        let (mut before, mut after) = ([[0.0; L]; 2], [[0.0; L]; 2]);
        let half = values.len() / 2;
        let (front, back) = values.split_at_mut(half);
        let (front_room, back_room) = room.split_at_mut(half);
        let (middle, back) = back.split_at_mut(back.len() - half);
        let back_room = &mut back_room[middle.len()..];
        for (((own, room), other), other_room) in front
            .iter()
            .zip(front_room.iter_mut())
            .zip(back.iter().rev())
            .zip(back_room.iter_mut().rev())
        {
            self.go_on(s, &mut before, own);
            *room = before;
            *other_room = after;
            self.go_back(s, &mut after, other);
        }
        for value in middle {
            let own = *value;
            self.go_on(s, &mut before, &own);
            *value = before;
            add_both(s, value, &after);
            self.go_back(s, &mut after, &own);
        }
        for (((own, room), other), other_room) in back
            .iter_mut()
            .zip(&*back_room)
            .zip(front.iter_mut().rev())
            .zip(front_room.iter().rev())
        {
            self.go_on(s, &mut before, own);
            *own = before;
            add_both(s, own, room);
            let value = *other;
            *other = *other_room;
            add_both(s, other, &after);
            self.go_back(s, &mut after, &value);
        }
    }

    /// From the sum up to the entry before to that up to this entry.
    #[inline(always)]
    fn go_on<const L: usize>(&self, s: impl Four, before: &mut Evidence<L>, own: &Evidence<L>) {
        for (before, own) in before.iter_mut().zip(own) {
            scale(s, before, self.decay);
            add(s, before, own);
        }
    }

    /// From what is after this entry to what is after the one before.
    #[inline(always)]
    fn go_back<const L: usize>(&self, s: impl Four, after: &mut Evidence<L>, own: &Evidence<L>) {
        for (after, own) in after.iter_mut().zip(own) {
            add(s, after, own);
            scale(s, after, self.decay);
        }
    }
}

#[inline(always)]
fn add_both<const L: usize>(s: impl Four, sum: &mut Evidence<L>, other: &Evidence<L>) {
    for (sum, other) in sum.iter_mut().zip(other) {
        add(s, sum, other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::widest;

    /// One way after the other.
    fn one_by_one(kernel: &Kernel, values: &mut [Evidence<1>]) {
        for _ in 0..2 {
            let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
            let mut up_to: Vec<[f64; 2]> = Vec::new();
            for value in &*values {
                before = std::array::from_fn(|k| before[k] * kernel.decay + value[k][0]);
                up_to.push(before);
            }
            for (value, up_to) in values.iter_mut().zip(up_to).rev() {
                let next = std::array::from_fn(|k| (after[k] + value[k][0]) * kernel.decay);
                *value = std::array::from_fn(|k| [up_to[k] + after[k]]);
                after = next;
            }
        }
    }

    #[test]
    fn from_both_ends_comes_out_what_one_way_after_the_other_does() {
        for (count, std) in [
            (0, 2.0),
            (1, 2.0),
            (2, 10.0),
            (3, 5.0),
            (40, 2.0),
            (41, 15.0),
        ] {
            let kernel = Kernel::new(std);
            let number = |k: usize| 1.0 + (k as f64 * 1.7).sin();
            let values = |k: usize| [[number(k)], [number(k + 100)]];
            let mut expected: Vec<Evidence<1>> = (0..count).map(values).collect();
            let four = |[[a], [b]]: Evidence<1>| [[a, b, b, a], [b, a, a, b]];
            let mut found: Vec<Evidence<4>> = expected.iter().copied().map(four).collect();
            one_by_one(&kernel, &mut expected);
            let mut room = vec![[[0.0; 4]; 2]; count + 1];
            widest!(s => kernel.smooth(s, &mut found, &mut room));
            let expected: Vec<Evidence<4>> = expected.into_iter().map(four).collect();
            assert_eq!(found, expected, "{count} entries");
        }
    }
}
