//! A value and where it stands, so that whatever does not suit is named by file and key.

use std::path::Path;
use std::sync::Arc;

use crate::ArraysError;
use crate::value::{ArrayData, Value};

/// A value with its file and its key path, such as `smpl_params_global.body_pose`. Cloning is
/// cheap.
#[derive(Clone, Debug)]
pub struct Entry {
    pub(crate) path: Arc<Path>,
    pub(crate) key: String,
    pub(crate) value: Value,
}

impl Entry {
    /// A value of `path` under `key`; the root's key is empty.
    pub fn new(path: &Path, key: impl Into<String>, value: Value) -> Self {
        Self {
            path: Arc::from(path),
            key: key.into(),
            value,
        }
    }

    /// The value; a dictionary that `numpy.save` wrapped into an array without dimensions is taken
    /// out of it.
    pub fn value(&self) -> &Value {
        self.value.unwrapped()
    }

    /// Where the value stands: keys joined by dots, items of lists in brackets; empty for the root.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The file that the value came in, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What a dictionary has under `name`; `None` where it has nothing or `None`, or where this is
    /// no dictionary.
    pub fn get(&self, name: &str) -> Option<Self> {
        match self.value() {
            Value::Dict(dict) => dict
                .get(name)
                .filter(|value| !matches!(value.unwrapped(), Value::None))
                .map(|value| self.child(name, value)),
            _ => None,
        }
    }

    /// What a dictionary has under `name`.
    ///
    /// # Errors
    /// [`ArraysError::Type`] where this is no dictionary, [`ArraysError::MissingKey`] with the keys
    /// that there are.
    pub fn at(&self, name: &str) -> Result<Self, ArraysError> {
        let missing = |known| ArraysError::MissingKey {
            path: self.path.to_path_buf(),
            key: self.joined(name),
            known,
        };
        match self.value() {
            Value::Dict(_) => self.get(name).ok_or_else(|| missing(self.known_keys())),
            _ => Err(self.wrong_type("a dictionary")),
        }
    }

    /// Keys and entries of a dictionary, in the file's order.
    ///
    /// # Errors
    /// [`ArraysError::Type`].
    pub fn pairs(&self) -> Result<Vec<(Value, Self)>, ArraysError> {
        let Value::Dict(dict) = self.value() else {
            return Err(self.wrong_type("a dictionary"));
        };
        Ok(dict
            .pairs()
            .iter()
            .map(|(key, value)| (key.clone(), self.child(&key_text(key), value)))
            .collect())
    }

    /// The items of a list, a tuple or an array of objects.
    ///
    /// # Errors
    /// [`ArraysError::Type`].
    pub fn items(&self) -> Result<Vec<Self>, ArraysError> {
        let items = match self.value() {
            Value::List(items) | Value::Tuple(items) => items.as_slice(),
            Value::Array(array) if array.object_elements().len() == array.element_count() => {
                array.object_elements()
            }
            _ => return Err(self.wrong_type("a list")),
        };
        let item = |(index, value): (usize, &Value)| Self {
            path: self.path.clone(),
            key: format!("{}[{index}]", self.key),
            value: value.clone(),
        };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// A single text: `str`, `bytes`, or an array of one text.
    ///
    /// # Errors
    /// [`ArraysError::Type`].
    pub fn text(&self) -> Result<String, ArraysError> {
        let wrong = || self.wrong_type("text");
        match self.value() {
            Value::Array(array) if array.element_count() == 1 => {
                let first = array.as_texts().and_then(|texts| texts.into_iter().next());
                first
                    .or_else(|| {
                        array
                            .object_elements()
                            .first()?
                            .text()
                            .map(|text| text.to_string())
                    })
                    .ok_or_else(wrong)
            }
            value => value.text().map(|text| text.to_string()).ok_or_else(wrong),
        }
    }

    /// Texts: a list of them, or an array of `U`, `S` or objects.
    ///
    /// # Errors
    /// [`ArraysError::Type`].
    pub fn texts(&self) -> Result<Vec<String>, ArraysError> {
        if let Value::Array(array) = self.value()
            && let Some(texts) = array.as_texts()
        {
            return Ok(texts);
        }
        self.items()?.iter().map(Self::text).collect()
    }

    fn child(&self, name: &str, value: &Value) -> Self {
        Self {
            path: self.path.clone(),
            key: self.joined(name),
            value: value.clone(),
        }
    }

    fn joined(&self, name: &str) -> String {
        if self.key.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.key)
        }
    }

    fn known_keys(&self) -> String {
        let Value::Dict(dict) = self.value() else {
            return String::new();
        };
        let mut names: Vec<_> = dict
            .pairs()
            .iter()
            .take(20)
            .map(|(key, _)| key_text(key))
            .collect();
        if dict.pairs().len() > names.len() {
            names.push(format!("and {} more", dict.pairs().len() - names.len()));
        }
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    }

    pub(crate) fn wrong_shape(&self, found: Vec<u64>, expected: String) -> ArraysError {
        ArraysError::Shape {
            path: self.path.to_path_buf(),
            key: self.key.clone(),
            found,
            expected,
        }
    }

    pub(crate) fn wrong_elements(&self, array: &ArrayData, expected: &'static str) -> ArraysError {
        ArraysError::ElementType {
            path: self.path.to_path_buf(),
            key: self.key.clone(),
            found: array.dtype().to_string(),
            expected,
        }
    }

    pub(crate) fn wrong_type(&self, expected: &str) -> ArraysError {
        let found = format!("{} ({:?})", self.value().type_name(), self.value());
        ArraysError::Type {
            path: self.path.to_path_buf(),
            key: self.key.clone(),
            found,
            expected: expected.to_owned(),
        }
    }
}

/// A dictionary's key as part of a key path.
fn key_text(key: &Value) -> String {
    match key.text() {
        Some(text) => text.to_string(),
        None => format!("{key:?}"),
    }
}
