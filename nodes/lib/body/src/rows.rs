//! Rows of different lengths in one allocation.

/// Rows of different lengths in one allocation.
#[derive(Debug, Clone)]
pub(crate) struct Rows<T> {
    ends: Vec<u32>,
    items: Vec<T>,
}

impl<T> Rows<T> {
    pub fn new(rows: impl IntoIterator<Item = impl IntoIterator<Item = T>>) -> Self {
        let (mut ends, mut items) = (Vec::new(), Vec::new());
        for row in rows {
            items.extend(row);
            ends.push(items.len() as u32);
        }
        Self { ends, items }
    }

    pub fn row(&self, index: usize) -> &[T] {
        let start = if index == 0 {
            0
        } else {
            self.ends[index - 1] as usize
        };
        &self.items[start..self.ends[index] as usize]
    }

    pub fn rows(&self) -> impl Iterator<Item = &[T]> {
        (0..self.ends.len()).map(|index| self.row(index))
    }
}
