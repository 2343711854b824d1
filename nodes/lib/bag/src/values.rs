//! Messages of types that this suite does not know, read by the definition (`ros2msg`) that the bag
//! holds of them.
//!
//! By hand, because what is needed is a few fields of types whose layout changed between releases:
//! the definition in the bag is the only thing that says how a recorded message is laid out.

use std::collections::BTreeMap;

use crate::message::Message;

/// Types in types, at most.
const DEEPEST: usize = 32;
/// Values of one message, at most: a definition of a few lines may describe many.
const MOST_VALUES: usize = 1 << 20;

/// A field's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of any numeric type, or a truth value: whole numbers are exact up to 2^53.
    Number(f64),
    /// Text.
    Text(String),
    /// An array.
    List(Vec<Value>),
    /// A message: its fields in their order, by name.
    Fields(Vec<(String, Value)>),
}

impl Value {
    /// The value behind the names of fields, one within the other.
    pub fn get(&self, path: &[&str]) -> Option<&Self> {
        path.iter().try_fold(self, |value, name| match value {
            Self::Fields(fields) => {
                let found = fields.iter().find(|(own, _)| own == name);
                found.map(|(_, value)| value)
            }
            _ => None,
        })
    }

    /// The number behind the names of fields.
    pub fn number(&self, path: &[&str]) -> Option<f64> {
        match self.get(path) {
            Some(Self::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// The text behind the names of fields.
    pub fn text(&self, path: &[&str]) -> Option<&str> {
        match self.get(path) {
            Some(Self::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// The elements of the array behind the names of fields.
    pub fn list(&self, path: &[&str]) -> Option<&[Self]> {
        match self.get(path) {
            Some(Self::List(list)) => Some(list),
            _ => None,
        }
    }
}

impl Message {
    /// The message's fields by the definition that the bag holds of its type.
    ///
    /// # Errors
    /// What is wrong: no definition, one that cannot be read, an encoding that is not plain CDR, or
    /// too few bytes.
    pub fn values(&self) -> Result<Value, String> {
        let name = &self.topic.type_name;
        let text = self.topic.schema_text();
        if text.trim().is_empty() {
            return Err(format!(
                "the bag holds no definition of {name}; record it as MCAP, or as SQLite from ROS 2 Iron on"
            ));
        }
        let Some((header, body)) = self.payload.split_at_checked(4) else {
            return Err("it has less than four bytes".to_owned());
        };
        let is_little_endian = match header[..2] {
            [0, 1] => true,
            [0, 0] => false,
            _ => return Err("it is not plain CDR".to_owned()),
        };
        let mut reader = CdrReader {
            types: types(name, text),
            body,
            at: 0,
            is_little_endian,
            left: MOST_VALUES,
        };
        reader.message(&short(name), 0)
    }
}

/// Each type's declarations, as (type, name), by `package/Name`.
fn types<'a>(name: &str, text: &'a str) -> BTreeMap<String, Vec<(&'a str, &'a str)>> {
    let mut types = BTreeMap::new();
    let mut current: &mut Vec<(&str, &str)> = types.entry(short(name)).or_default();
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("MSG:") {
            current = types.entry(short(name.trim())).or_default();
            continue;
        }
        let code = line.split('#').next().unwrap_or_default().trim();
        if let Some((kind, rest)) = code.split_once(char::is_whitespace) {
            let rest = rest.trim();
            let field = rest.split_whitespace().next().unwrap_or_default();
            // A constant has `=` behind its name; a default value has none.
            if !field.contains('=') && !rest[field.len()..].trim_start().starts_with('=') {
                current.push((kind, field));
            }
        }
    }
    types
}

/// `package/Name` of `package/msg/Name`.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

struct CdrReader<'a> {
    types: BTreeMap<String, Vec<(&'a str, &'a str)>>,
    body: &'a [u8],
    at: usize,
    is_little_endian: bool,
    /// Values that may still be read.
    left: usize,
}

impl CdrReader<'_> {
    fn message(&mut self, name: &str, depth: usize) -> Result<Value, String> {
        if depth > DEEPEST {
            return Err(format!("{name} holds itself"));
        }
        let fields = self
            .types
            .get(name)
            .ok_or_else(|| format!("{name} is not defined"))?
            .clone();
        if fields.is_empty() {
            // CDR knows no empty structure: ROS 2 writes a byte.
            self.take(1, 1)?;
        }
        let package = name.split('/').next().unwrap_or_default();
        let read = |(kind, field): (&str, &str)| {
            let value = self.field(kind, package, depth)?;
            Ok((field.to_owned(), value))
        };
        let fields: Result<_, String> = fields.into_iter().map(read).collect();
        fields.map(Value::Fields)
    }

    fn field(&mut self, kind: &str, package: &str, depth: usize) -> Result<Value, String> {
        let Some((element, bounds)) = kind.split_once('[') else {
            return self.value(kind, package, depth);
        };
        let bounds = bounds.trim_end_matches(']');
        let count = match bounds.parse::<usize>() {
            Ok(count) => count,
            Err(_) if bounds.is_empty() || bounds.starts_with("<=") => self.count()?,
            Err(_) => return Err(format!("{kind:?} is no type")),
        };
        // Whatever an element is, it takes a byte.
        if count > self.body.len() - self.at {
            return Err("it ends within a field".to_owned());
        }
        let values = (0..count).map(|_| self.value(element, package, depth));
        values.collect::<Result<_, _>>().map(Value::List)
    }

    fn value(&mut self, kind: &str, package: &str, depth: usize) -> Result<Value, String> {
        self.left = self
            .left
            .checked_sub(1)
            .ok_or_else(|| format!("it has more than {MOST_VALUES} values"))?;
        // `string<=10` is a string.
        let kind = kind.split('<').next().unwrap_or_default();
        Ok(Value::Number(match kind {
            "bool" | "byte" | "char" | "uint8" => f64::from(self.number(u8::from_le_bytes)?),
            "int8" => f64::from(self.number(i8::from_le_bytes)?),
            "int16" => f64::from(self.number(i16::from_le_bytes)?),
            "uint16" => f64::from(self.number(u16::from_le_bytes)?),
            "int32" => f64::from(self.number(i32::from_le_bytes)?),
            "uint32" => f64::from(self.number(u32::from_le_bytes)?),
            "int64" => self.number(i64::from_le_bytes)? as f64,
            "uint64" => self.number(u64::from_le_bytes)? as f64,
            "float32" => f64::from(self.number(f32::from_le_bytes)?),
            "float64" => self.number(f64::from_le_bytes)?,
            "string" => return self.text(),
            _ => {
                let name = if kind.contains('/') {
                    short(kind)
                } else {
                    format!("{package}/{kind}")
                };
                return self.message(&name, depth + 1);
            }
        }))
    }

    fn text(&mut self) -> Result<Value, String> {
        let count = self.count()?;
        let bytes = self.take(count, 1)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|_| "a text is not UTF-8".to_owned())?;
        Ok(Value::Text(text.to_owned()))
    }

    fn count(&mut self) -> Result<usize, String> {
        Ok(self.number(u32::from_le_bytes)? as usize)
    }

    /// A number of N bytes, aligned to them.
    fn number<const N: usize, T>(&mut self, from_le: fn([u8; N]) -> T) -> Result<T, String> {
        let mut bytes = [0; N];
        let is_little_endian = self.is_little_endian;
        bytes.copy_from_slice(self.take(N, N)?);
        if !is_little_endian {
            bytes.reverse();
        }
        Ok(from_le(bytes))
    }

    fn take(&mut self, count: usize, aligned_to: usize) -> Result<&[u8], String> {
        let start = self.at.next_multiple_of(aligned_to);
        let end = start.checked_add(count);
        let taken = end.and_then(|end| self.body.get(start..end));
        let taken = taken.ok_or_else(|| "it ends within a field".to_owned())?;
        self.at = start + count;
        Ok(taken)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Arc;

    use cromosim_msgs::RosMessage;
    use cromosim_msgs::geometry_msgs::{Transform, TransformStamped};
    use cromosim_msgs::std_msgs::Header;
    use cromosim_msgs::tf2_msgs::TFMessage;
    use cromosim_spatial::Stamp;

    use super::*;
    use crate::{Topic, payload_of};

    fn tree() -> Message {
        let mut transform = TransformStamped {
            header: Header::new(-1_500_000_000, "map"),
            child_frame_id: "tool0".to_owned(),
            transform: Transform::default(),
        };
        transform.transform.translation.y = -0.25;
        let message = TFMessage {
            transforms: vec![transform; 2],
        };
        Message {
            topic: Arc::new(Topic::for_message::<TFMessage>("/tf")),
            sequence: 0,
            log_time: Stamp::default(),
            publish_time: Stamp::default(),
            payload: payload_of("/tf", &message).unwrap(),
        }
    }

    #[test]
    fn a_message_is_read_by_the_definition_in_the_bag() {
        let values = tree().values().unwrap();
        let second = &values.list(&["transforms"]).unwrap()[1];
        assert_eq!(second.text(&["child_frame_id"]), Some("tool0"));
        assert_eq!(second.text(&["header", "frame_id"]), Some("map"));
        assert_eq!(second.number(&["header", "stamp", "sec"]), Some(-2.0));
        assert_eq!(second.number(&["header", "stamp", "nanosec"]), Some(5e8));
        assert_eq!(
            second.number(&["transform", "translation", "y"]),
            Some(-0.25)
        );
        assert_eq!(second.number(&["transform", "rotation", "w"]), Some(1.0));
        assert_eq!(second.get(&["transform", "rotation", "v"]), None);
    }

    #[test]
    fn every_cut_and_a_missing_definition_are_refused() {
        let whole = tree();
        for length in 0..whole.payload.len() {
            let mut cut = whole.clone();
            cut.payload.truncate(length);
            assert!(cut.values().is_err(), "{length} bytes");
        }
        let mut bare = whole.clone();
        bare.topic = Arc::new(Topic::with_schema("/tf", TFMessage::TYPE_NAME, ""));
        assert!(bare.values().unwrap_err().contains("holds no definition"));
        for (definition, problem) in [
            ("Self within", "holds itself"),
            ("Other it", "p/Other is not defined"),
            ("uint8[4000000000] many", "ends within"),
            ("float64[x] many", "is no type"),
        ] {
            let text = format!("{definition}\n===\nMSG: p/Self\nSelf within\n");
            let mut other = whole.clone();
            other.topic = Arc::new(Topic::with_schema("/t", "p/msg/Self", &text));
            let said = other.values().unwrap_err();
            assert!(said.contains(problem), "{definition}: {said}");
        }
    }
}
