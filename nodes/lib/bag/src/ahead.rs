//! What is read ahead of its time.

use std::cmp::Ordering;

/// Something that is ordered by its time and its place in the file alone.
pub(crate) struct Ahead<O, V> {
    pub(crate) order: O,
    pub(crate) value: V,
}

impl<O: Eq, V> PartialEq for Ahead<O, V> {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}
impl<O: Eq, V> Eq for Ahead<O, V> {}
impl<O: Ord, V> PartialOrd for Ahead<O, V> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl<O: Ord, V> Ord for Ahead<O, V> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.order.cmp(&other.order)
    }
}
