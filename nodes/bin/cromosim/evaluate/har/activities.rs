//! Which class an activity of a data set counts as.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, bail};

/// The classes that the virtual side knows, in their order.
pub const FIVE: [&str; 5] = [
    "SEATED",
    "STANDING_UP",
    "WALKING",
    "TURNING",
    "SITTING_DOWN",
];
/// Other data sets' names of them.
const ALIASES: [(&str, &str); 3] = [
    ("sitting", "SEATED"),
    ("walking", "WALKING"),
    ("nordic_walking", "WALKING"),
];

/// Classes by the data set's name of an activity.
#[derive(Clone, Debug, PartialEq)]
pub struct Activities {
    classes: Vec<String>,
    by_name: BTreeMap<String, u8>,
}

impl Activities {
    /// The five, by their own names and PAMAP2's and RealWorld's.
    pub fn five() -> Self {
        let names = FIVE.iter().map(|name| (*name, *name)).chain(ALIASES);
        Self::of(names.map(|(name, class)| (name.to_owned(), class.to_owned())))
    }

    /// A file's: a YAML map from the data set's names to classes, such as `{lying: LYING, sitting:
    /// SEATED}`. Classes beyond the five have no virtual side.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        let names: BTreeMap<String, String> =
            serde_norway::from_str(&text).with_context(|| path.display().to_string())?;
        let map = Self::of(names.into_iter());
        if !(2..=100).contains(&map.classes.len()) {
            bail!(
                "{}: {} classes, expected 2 to 100",
                path.display(),
                map.classes.len()
            );
        }
        Ok(map)
    }

    fn of(names: impl Iterator<Item = (String, String)>) -> Self {
        let names: Vec<(String, String)> = names.collect();
        let place = |class: &String| {
            FIVE.iter()
                .position(|known| known == class)
                .unwrap_or(FIVE.len())
        };
        let mut classes: Vec<String> = names.iter().map(|(_, class)| class.clone()).collect();
        classes.sort_by_key(|class| (place(class), class.clone()));
        classes.dedup();
        let number = |class: &String| {
            classes
                .iter()
                .position(|known| known == class)
                .unwrap_or_default() as u8
        };
        let by_name = names
            .iter()
            .map(|(name, class)| (name.clone(), number(class)))
            .collect();
        Self { classes, by_name }
    }

    /// The classes' names.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// The class that an activity counts as; none where it is left out.
    pub fn class(&self, activity: &str) -> Option<u8> {
        self.by_name.get(activity).copied()
    }

    /// The class of this very name.
    pub fn class_named(&self, name: &str) -> Option<u8> {
        self.classes
            .iter()
            .position(|class| class == name)
            .map(|class| class as u8)
    }

    /// Without the classes that nobody shows; `there`: whether each is there.
    pub fn without_absent(&self, there: &[bool]) -> Self {
        let kept = self
            .by_name
            .iter()
            .filter(|(_, class)| there[usize::from(**class)]);
        Self::of(
            kept.map(|(name, class)| (name.clone(), self.classes[usize::from(*class)].clone())),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn other_names_count_as_the_five_and_further_classes_come_behind() {
        let five = Activities::five();
        assert_eq!(five.classes(), FIVE);
        assert_eq!(
            (
                five.class("sitting"),
                five.class("WALKING"),
                five.class("hopping")
            ),
            (Some(0), Some(2), None)
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.yaml");
        std::fs::write(
            &path,
            "{lying: LYING, cycling: CYCLING, sitting: SEATED, walking: WALKING, running: WALKING}",
        )
        .unwrap();
        let own = Activities::read(&path).unwrap();
        assert_eq!(own.classes(), ["SEATED", "WALKING", "CYCLING", "LYING"]);
        assert_eq!(
            (
                own.class("running"),
                own.class("lying"),
                own.class("SEATED")
            ),
            (Some(1), Some(3), None)
        );
        assert_eq!(
            (own.class_named("SEATED"), own.class_named("sitting")),
            (Some(0), None)
        );
        assert_eq!(
            own.without_absent(&[true, false, true, true]).classes(),
            ["SEATED", "CYCLING", "LYING"]
        );
        std::fs::write(&path, "{lying: LYING}").unwrap();
        assert!(
            Activities::read(&path)
                .unwrap_err()
                .to_string()
                .contains("map.yaml: 1 classes")
        );
    }
}
