//! Parameter values: from YAML, to text, to Rust types.

use ros2_client::ParameterValue;
use serde_norway::Value;

/// The Rust types that a parameter can have.
pub trait ParameterScalar: Sized {
    /// As a parameter value.
    fn into_value(self) -> ParameterValue;
    /// From a parameter value; none where it has another type.
    fn from_value(value: &ParameterValue) -> Option<Self>;
}

macro_rules! scalar {
    ($type:ty, $variant:ident) => {
        impl ParameterScalar for $type {
            fn into_value(self) -> ParameterValue {
                ParameterValue::$variant(self)
            }
            fn from_value(value: &ParameterValue) -> Option<Self> {
                match value {
                    ParameterValue::$variant(value) => Some(value.clone()),
                    _ => None,
                }
            }
        }
    };
}
scalar!(bool, Boolean);
scalar!(i64, Integer);
scalar!(f64, Double);
scalar!(String, String);
scalar!(Vec<bool>, BooleanArray);
scalar!(Vec<i64>, IntegerArray);
scalar!(Vec<f64>, DoubleArray);
scalar!(Vec<String>, StringArray);

/// What a value is called in messages.
pub(crate) fn type_name(value: &ParameterValue) -> &'static str {
    match value {
        ParameterValue::NotSet => "nothing",
        ParameterValue::Boolean(_) => "a boolean",
        ParameterValue::Integer(_) => "an integer",
        ParameterValue::Double(_) => "a number",
        ParameterValue::String(_) => "a string",
        ParameterValue::ByteArray(_) => "bytes",
        ParameterValue::BooleanArray(_) => "a list of booleans",
        ParameterValue::IntegerArray(_) => "a list of integers",
        ParameterValue::DoubleArray(_) => "a list of numbers",
        ParameterValue::StringArray(_) => "a list of strings",
    }
}

/// A value as it would stand in YAML.
pub(crate) fn to_text(value: &ParameterValue) -> String {
    fn list<T: std::fmt::Debug>(items: &[T]) -> String {
        format!("{items:?}")
    }
    match value {
        ParameterValue::NotSet => "null".into(),
        ParameterValue::Boolean(value) => value.to_string(),
        ParameterValue::Integer(value) => value.to_string(),
        ParameterValue::Double(value) => format!("{value:?}"),
        ParameterValue::String(value) => format!("'{value}'"),
        ParameterValue::ByteArray(items) => list(items),
        ParameterValue::BooleanArray(items) => list(items),
        ParameterValue::IntegerArray(items) => list(items),
        ParameterValue::DoubleArray(items) => list(items),
        ParameterValue::StringArray(items) => list(items),
    }
}

/// From a YAML scalar or a list of scalars of one type; integers among numbers are numbers.
pub(crate) fn from_yaml(value: &Value) -> Result<ParameterValue, String> {
    match value {
        Value::Null => Ok(ParameterValue::NotSet),
        Value::Bool(value) => Ok(ParameterValue::Boolean(*value)),
        Value::Number(number) => match number.as_i64() {
            Some(integer) => Ok(ParameterValue::Integer(integer)),
            None if number.is_f64() => {
                Ok(ParameterValue::Double(number.as_f64().unwrap_or(f64::NAN)))
            }
            None => Err(format!("{number} does not fit into 64 bits")),
        },
        Value::String(text) => Ok(ParameterValue::String(text.clone())),
        Value::Sequence(items) => list_from_yaml(items),
        Value::Mapping(_) | Value::Tagged(_) => {
            Err("expected a scalar or a list of scalars".into())
        }
    }
}

fn list_from_yaml(items: &[Value]) -> Result<ParameterValue, String> {
    fn all<T>(
        values: &[ParameterValue],
        pick: impl Fn(&ParameterValue) -> Option<T>,
    ) -> Option<Vec<T>> {
        values.iter().map(pick).collect()
    }
    let values = items.iter().map(from_yaml).collect::<Result<Vec<_>, _>>()?;
    if values.is_empty() {
        return Ok(ParameterValue::StringArray(Vec::new()));
    }
    all(&values, bool::from_value)
        .map(ParameterValue::BooleanArray)
        .or_else(|| all(&values, i64::from_value).map(ParameterValue::IntegerArray))
        .or_else(|| all(&values, as_number).map(ParameterValue::DoubleArray))
        .or_else(|| all(&values, String::from_value).map(ParameterValue::StringArray))
        .ok_or_else(|| "a list must have items of one type: booleans, numbers or strings".into())
}

fn as_number(value: &ParameterValue) -> Option<f64> {
    match value {
        ParameterValue::Double(value) => Some(*value),
        ParameterValue::Integer(value) => Some(*value as f64),
        _ => None,
    }
}

/// As YAML again, for serde.
pub(crate) fn to_yaml(value: &ParameterValue) -> Value {
    fn list<T: Clone + Into<Value>>(items: &[T]) -> Value {
        Value::Sequence(items.iter().cloned().map(Into::into).collect())
    }
    match value {
        ParameterValue::NotSet => Value::Null,
        ParameterValue::Boolean(value) => (*value).into(),
        ParameterValue::Integer(value) => (*value).into(),
        ParameterValue::Double(value) => (*value).into(),
        ParameterValue::String(value) => value.as_str().into(),
        ParameterValue::ByteArray(items) => list(items),
        ParameterValue::BooleanArray(items) => list(items),
        ParameterValue::IntegerArray(items) => list(items),
        ParameterValue::DoubleArray(items) => list(items),
        ParameterValue::StringArray(items) => list(items),
    }
}

/// `given` as a value of the type that `wanted` has: integers become numbers, an empty list fits
/// every list. None where it does not fit.
pub(crate) fn coerce(given: ParameterValue, wanted: &ParameterValue) -> Option<ParameterValue> {
    use ParameterValue as V;
    match (given, wanted) {
        (V::Integer(value), V::Double(_)) => Some(V::Double(value as f64)),
        (V::IntegerArray(items), V::DoubleArray(_)) => Some(V::DoubleArray(
            items.into_iter().map(|item| item as f64).collect(),
        )),
        (V::IntegerArray(items), V::ByteArray(_)) => items
            .into_iter()
            .map(|item| u8::try_from(item).ok())
            .collect::<Option<_>>()
            .map(V::ByteArray),
        (V::StringArray(items), V::BooleanArray(_)) if items.is_empty() => {
            Some(V::BooleanArray(Vec::new()))
        }
        (V::StringArray(items), V::IntegerArray(_)) if items.is_empty() => {
            Some(V::IntegerArray(Vec::new()))
        }
        (V::StringArray(items), V::DoubleArray(_)) if items.is_empty() => {
            Some(V::DoubleArray(Vec::new()))
        }
        (V::StringArray(items), V::ByteArray(_)) if items.is_empty() => {
            Some(V::ByteArray(Vec::new()))
        }
        (given, wanted) => {
            (std::mem::discriminant(&given) == std::mem::discriminant(wanted)).then_some(given)
        }
    }
}

/// All numbers in a value, for bounds.
pub(crate) fn numbers(value: &ParameterValue) -> Vec<f64> {
    match value {
        ParameterValue::Integer(value) => vec![*value as f64],
        ParameterValue::Double(value) => vec![*value],
        ParameterValue::IntegerArray(items) => items.iter().map(|item| *item as f64).collect(),
        ParameterValue::DoubleArray(items) => items.clone(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn parsed(yaml: &str) -> Result<ParameterValue, String> {
        from_yaml(&serde_norway::from_str(yaml).unwrap())
    }

    #[test]
    fn yaml_has_the_types_of_ros() {
        assert_eq!(parsed("true").unwrap(), ParameterValue::Boolean(true));
        assert_eq!(parsed("100").unwrap(), ParameterValue::Integer(100));
        assert_eq!(parsed("1e-3").unwrap(), ParameterValue::Double(0.001));
        assert_eq!(
            parsed("'100'").unwrap(),
            ParameterValue::String("100".into())
        );
        assert_eq!(
            parsed("[1, 2.5]").unwrap(),
            ParameterValue::DoubleArray(vec![1.0, 2.5])
        );
        assert_eq!(
            parsed("[a, b]").unwrap(),
            ParameterValue::StringArray(vec!["a".into(), "b".into()])
        );
        for wrong in ["[1, a]", "[[1]]", "{a: 1}"] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn integers_pass_for_numbers_and_not_the_other_way() {
        assert_eq!(
            coerce(ParameterValue::Integer(2), &ParameterValue::Double(0.0)),
            Some(ParameterValue::Double(2.0))
        );
        assert_eq!(
            coerce(ParameterValue::Double(2.0), &ParameterValue::Integer(0)),
            None
        );
        let empty = ParameterValue::StringArray(Vec::new());
        assert_eq!(
            coerce(empty, &ParameterValue::DoubleArray(vec![1.0])),
            Some(ParameterValue::DoubleArray(Vec::new()))
        );
    }
}
