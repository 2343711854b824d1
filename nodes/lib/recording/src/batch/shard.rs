//! A part of the inputs, for one of several machines.

use std::fmt;
use std::str::FromStr;

/// The `index`th of `count` parts, from 1 on: inputs are dealt out in turn, so that files of one
/// folder, which are alike, go to different parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// Whether the input of this number, from 0 on, is in the part.
    pub const fn holds(self, number: usize) -> bool {
        number % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/');
        let parsed = parts.and_then(|(index, count)| {
            let (index, count) = (index.parse().ok()?, count.parse().ok()?);
            (index >= 1 && index <= count).then_some(Self { index, count })
        });
        parsed.ok_or_else(|| "expected I/N with I from 1 to N, such as 2/8".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn parts_are_disjoint_and_whole() {
        for count in 1..6 {
            let parts = (1..=count).map(|index| format!("{index}/{count}").parse().unwrap());
            let parts: Vec<Shard> = parts.collect();
            for number in 0..20 {
                assert_eq!(parts.iter().filter(|part| part.holds(number)).count(), 1);
            }
        }
        for text in ["", "1", "0/3", "4/3", "1/0", "-1/2", "1/2/3", "a/b"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
