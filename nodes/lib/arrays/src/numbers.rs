//! Numbers out of a value, whatever Python made them of.

use crate::ArraysError;
use crate::array::Array;
use crate::entry::Entry;
use crate::limits::ELEMENTS_LIMIT;
use crate::value::{Sparse, Value};

impl Entry {
    /// The shape of an array or sparse matrix; of lists of equal length, theirs; of a number, none.
    ///
    /// # Errors
    /// [`ArraysError::Type`] for what is no array of numbers.
    pub fn shape(&self) -> Result<Vec<usize>, ArraysError> {
        match self.value() {
            Value::Array(array) => Ok(array.shape().to_vec()),
            Value::Sparse(sparse) => Ok(sparse.shape.to_vec()),
            _ => Ok(self.numbers()?.shape),
        }
    }

    /// Numbers in C order as float64, from an array or tensor of any number type, byte order and
    /// strides, a sparse matrix, a chumpy array, a number, or lists of such. `expected` holds the
    /// dimensions that are given and is named by `expectation` in the error.
    ///
    /// # Errors
    /// [`ArraysError::Type`], [`ArraysError::ElementType`], [`ArraysError::Shape`],
    /// [`ArraysError::TooLarge`], [`ArraysError::NotFinite`].
    pub fn floats(
        &self,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Array<f64>, ArraysError> {
        let array = self.floats_with_nan(expected, expectation)?;
        if let Some(element) = array.values.iter().position(|value| !value.is_finite()) {
            let value = array.values[element];
            return Err(ArraysError::NotFinite {
                path: self.path.to_path_buf(),
                key: self.key.clone(),
                element,
                value,
            });
        }
        Ok(array)
    }

    /// Like [`Self::floats`], NaN and infinities included: for files in which NaN marks what is
    /// missing.
    ///
    /// # Errors
    /// As [`Self::floats`], without [`ArraysError::NotFinite`].
    pub fn floats_with_nan(
        &self,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Array<f64>, ArraysError> {
        // What tells its shape is not decoded before the shape is known to suit.
        match self.value() {
            Value::Array(array) => self.check_shape(array.shape(), expected, expectation)?,
            Value::Sparse(sparse) => self.check_shape(&sparse.shape, expected, expectation)?,
            _ => {}
        }
        let array = self.numbers()?;
        self.check_shape(&array.shape, expected, expectation)?;
        Ok(array)
    }

    /// Whole numbers in C order; floats are not rounded but refused. Unsigned ones above i64's
    /// range become its largest value.
    ///
    /// # Errors
    /// As [`Self::floats`].
    pub fn integers(
        &self,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Array<i64>, ArraysError> {
        let array = match self.value() {
            Value::Array(array) => {
                self.check_shape(array.shape(), expected, expectation)?;
                self.check_size(array.element_count())?;
                let values = array
                    .as_integers()
                    .ok_or_else(|| self.wrong_elements(array, "integers"))?;
                Array {
                    shape: array.shape().to_vec(),
                    values,
                }
            }
            Value::Int(value) => Array {
                shape: Vec::new(),
                values: vec![*value],
            },
            Value::Bool(value) => Array {
                shape: Vec::new(),
                values: vec![i64::from(*value)],
            },
            Value::List(_) | Value::Tuple(_) => {
                let items = self.items()?;
                let values = items
                    .iter()
                    .map(Self::integer)
                    .collect::<Result<Vec<_>, _>>()?;
                Array {
                    shape: vec![values.len()],
                    values,
                }
            }
            _ => return Err(self.wrong_type("an array of integers")),
        };
        self.check_shape(&array.shape, expected, expectation)?;
        Ok(array)
    }

    /// A single number: of a Python number or an array of one element.
    ///
    /// # Errors
    /// [`ArraysError::Type`], [`ArraysError::ElementType`], [`ArraysError::Shape`],
    /// [`ArraysError::NotFinite`].
    pub fn float(&self) -> Result<f64, ArraysError> {
        self.check_single()?;
        let array = self.floats(&vec![None; self.shape()?.len()], "a number")?;
        array
            .values
            .first()
            .copied()
            .ok_or_else(|| self.wrong_type("a number"))
    }

    /// A single whole number: of a Python number or an array of one element.
    ///
    /// # Errors
    /// [`ArraysError::Type`], [`ArraysError::ElementType`], [`ArraysError::Shape`].
    pub fn integer(&self) -> Result<i64, ArraysError> {
        self.check_single()?;
        match self.value() {
            Value::Int(value) => Ok(*value),
            Value::Bool(value) => Ok(i64::from(*value)),
            Value::Array(array) => {
                let values = array
                    .as_integers()
                    .ok_or_else(|| self.wrong_elements(array, "integers"))?;
                values
                    .first()
                    .copied()
                    .ok_or_else(|| self.wrong_type("a whole number"))
            }
            _ => Err(self.wrong_type("a whole number")),
        }
    }

    /// Whatever is made of numbers, as an array.
    fn numbers(&self) -> Result<Array<f64>, ArraysError> {
        match self.value() {
            Value::Array(array) if array.object_elements().is_empty() => {
                self.check_size(array.element_count())?;
                let values = array
                    .as_floats()
                    .ok_or_else(|| self.wrong_elements(array, "numbers"))?;
                Ok(Array {
                    shape: array.shape().to_vec(),
                    values,
                })
            }
            Value::Sparse(sparse) => self.dense(sparse),
            value => {
                let mut stack = Stack {
                    entry: self,
                    values: Vec::new(),
                    visits: 0,
                };
                let shape = stack.add(value, 0)?;
                Ok(Array {
                    shape,
                    values: stack.values,
                })
            }
        }
    }

    fn dense(&self, sparse: &Sparse) -> Result<Array<f64>, ArraysError> {
        let [rows, columns] = sparse.shape;
        self.check_size(rows.saturating_mul(columns))?;
        let mut values = vec![0.0; rows * columns];
        for &(row, column, value) in &sparse.entries {
            values[row as usize * columns + column as usize] += value; // scipy sums what is stored twice
        }
        Ok(Array {
            shape: vec![rows, columns],
            values,
        })
    }

    fn check_single(&self) -> Result<(), ArraysError> {
        match self.value() {
            Value::Array(array) if array.element_count() != 1 => Err(self.wrong_shape(
                array.shape().iter().map(|&size| size as u64).collect(),
                "one element".to_owned(),
            )),
            Value::Array(_) | Value::Int(_) | Value::Float(_) | Value::Bool(_) => Ok(()),
            _ => Err(self.wrong_type("a number")),
        }
    }

    fn check_size(&self, elements: usize) -> Result<(), ArraysError> {
        if elements > ELEMENTS_LIMIT {
            let (bytes, limit) = (
                (elements as u64).saturating_mul(8),
                8 * ELEMENTS_LIMIT as u64,
            );
            return Err(ArraysError::TooLarge {
                path: self.path.to_path_buf(),
                key: self.key.clone(),
                bytes,
                limit,
            });
        }
        Ok(())
    }

    fn check_shape(
        &self,
        shape: &[usize],
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<(), ArraysError> {
        let suits = shape.len() == expected.len()
            && shape
                .iter()
                .zip(expected)
                .all(|(&found, expected)| expected.is_none_or(|e| found == e));
        if suits {
            Ok(())
        } else {
            Err(self.wrong_shape(
                shape.iter().map(|&size| size as u64).collect(),
                expectation.to_owned(),
            ))
        }
    }
}

/// Numbers out of nested lists, tuples and arrays of objects.
struct Stack<'a> {
    entry: &'a Entry,
    values: Vec<f64>,
    /// Lists share their items, so that a small file can hold endless walks through them.
    visits: usize,
}

/// As many as numpy has dimensions.
const STACK_DEPTH_LIMIT: usize = 32;
/// Items of lists in one array of numbers.
const STACK_VISITS_LIMIT: usize = 1 << 24;

impl Stack<'_> {
    /// Adds the numbers of `value` and returns their shape.
    fn add(&mut self, value: &Value, depth: usize) -> Result<Vec<usize>, ArraysError> {
        self.visits += 1;
        if depth > STACK_DEPTH_LIMIT || self.visits > STACK_VISITS_LIMIT {
            return Err(self
                .entry
                .wrong_type("an array of numbers, or lists of few levels"));
        }
        let number = match value.unwrapped() {
            Value::Float(number) => *number,
            Value::Int(number) => *number as f64,
            Value::Bool(number) => f64::from(u8::from(*number)),
            Value::List(items) | Value::Tuple(items) => {
                return self.add_items(items, &[items.len()], depth);
            }
            Value::Array(array) if array.object_elements().is_empty() => {
                self.entry
                    .check_size(self.values.len().saturating_add(array.element_count()))?;
                self.values.extend(
                    array
                        .as_floats()
                        .ok_or_else(|| self.entry.wrong_elements(array, "numbers"))?,
                );
                return Ok(array.shape().to_vec());
            }
            Value::Array(array) => {
                return self.add_items(array.object_elements(), array.shape(), depth);
            }
            _ => return Err(self.entry.wrong_type("an array of numbers")),
        };
        self.values.push(number);
        Ok(Vec::new())
    }

    fn add_items(
        &mut self,
        items: &[Value],
        outer: &[usize],
        depth: usize,
    ) -> Result<Vec<usize>, ArraysError> {
        let mut inner: Option<Vec<usize>> = None;
        for item in items {
            let shape = self.add(item, depth + 1)?;
            let first = inner.get_or_insert_with(|| shape.clone());
            // Most items are numbers, without a shape: comparing empty vectors, whose pointers
            // dangle, would take most of the time.
            let both_empty = first.is_empty() && shape.is_empty();
            if !both_empty && *first != shape {
                let found = shape.iter().map(|&size| size as u64).collect();
                return Err(self.entry.wrong_shape(
                    found,
                    format!("{first:?} for every item of a list, as its first has"),
                ));
            }
        }
        Ok([outer, &inner.unwrap_or_default()].concat())
    }
}
