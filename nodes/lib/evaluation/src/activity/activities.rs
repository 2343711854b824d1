//! The class that an activity of a data set counts as.

use std::collections::BTreeMap;
use std::path::Path;

use crate::EvaluationError;
use cromosim_spatial::in_plain_words;

/// The classes that the virtual side knows, in their order.
pub const FIVE: [&str; 5] = [
    "SEATED",
    "STANDING_UP",
    "WALKING",
    "TURNING",
    "SITTING_DOWN",
];
/// The names that PAMAP2 and RealWorld have for them.
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
        Self::from_names(names.map(|(name, class)| (name.to_owned(), class.to_owned())))
    }

    /// A file's: a YAML map from the data set's names to classes, such as `{lying: LYING, sitting:
    /// SEATED}`. Classes beyond the five have no virtual side.
    ///
    /// # Errors
    /// A file that cannot be read, and [`EvaluationError::ClassCount`].
    pub fn read(path: &Path) -> Result<Self, EvaluationError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| EvaluationError::Read {
            path: path.to_owned(),
            source,
        })?;
        let names: BTreeMap<String, String> =
            serde_norway::from_str(&text).map_err(|error| EvaluationError::Yaml {
                file: path.display().to_string(),
                problem: in_plain_words(error),
            })?;
        let map = Self::from_names(names.into_iter());
        if !(2..=100).contains(&map.classes.len()) {
            return Err(EvaluationError::ClassCount {
                path: path.to_owned(),
                found: map.classes.len(),
            });
        }
        Ok(map)
    }

    fn from_names(names: impl Iterator<Item = (String, String)>) -> Self {
        let names: Vec<(String, String)> = names.collect();
        let rank = |class: &String| {
            FIVE.iter()
                .position(|known| known == class)
                .unwrap_or(FIVE.len())
        };
        let mut classes: Vec<String> = names.iter().map(|(_, class)| class.clone()).collect();
        classes.sort_by_key(|class| (rank(class), class.clone()));
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

    /// The classes' names; a class's number is its index here.
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

    /// Without the classes that nobody shows; `shown` says of each whether somebody does.
    pub fn without_absent(&self, shown: &[bool]) -> Self {
        let kept = self
            .by_name
            .iter()
            .filter(|(_, class)| shown[usize::from(**class)]);
        Self::from_names(
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
