//! Effects in files: `{effect: lever_arm, offset: [0.05, 0.0, -0.06]}`.

use std::fmt;

use cromosim_spatial::nearest_name;
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::spec::{ParameterSpec, Shape};
use super::{Effect, EffectKind, EffectSet};
use crate::EffectError;

impl Serialize for EffectKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for EffectKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        kind(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

fn kind(name: &str) -> Result<EffectKind, EffectError> {
    if name == "unknown" {
        return Err(EffectError::NotSimulated);
    }
    EffectKind::from_name(name).ok_or_else(|| EffectError::UnknownEffect {
        effect: name.to_owned(),
        nearest: nearest_name(name, EffectKind::ALL.map(EffectKind::name)).unwrap_or_default(),
    })
}

/// One parameter's values for writing.
struct Written<'a>(&'a ParameterSpec, &'a [f64]);

impl Serialize for Written<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(parameter, values) = self;
        match parameter.shape {
            Shape::Scalar | Shape::Time => values[0].serialize(serializer),
            Shape::Vector3 => values.serialize(serializer),
            Shape::Matrix3 => values.chunks(3).collect::<Vec<_>>().serialize(serializer),
            Shape::Choice(words) => words.get(values[0] as usize).serialize(serializer),
        }
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let parameters: Vec<_> = self.written_parameters().collect();
        let mut map = serializer.serialize_map(Some(1 + parameters.len()))?;
        map.serialize_entry("effect", self.kind().name())?;
        for (parameter, values) in parameters {
            map.serialize_entry(parameter.name, &Written(parameter, values))?;
        }
        map.end()
    }
}

impl Serialize for EffectSet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self)
    }
}

impl<'de> Deserialize<'de> for EffectSet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(Vec::<Effect>::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

/// A field's value as it stands in the file.
enum Raw {
    Number(f64),
    Text(String),
    List(Vec<Raw>),
}

struct RawVisitor;

impl<'de> Visitor<'de> for RawVisitor {
    type Value = Raw;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, a word or a list of numbers")
    }

    fn visit_i64<E>(self, value: i64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Raw, E> {
        Ok(Raw::Number(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Raw, E> {
        Ok(Raw::Text(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Raw, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = list.next_element()? {
            items.push(item);
        }
        Ok(Raw::List(items))
    }
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawVisitor)
    }
}

impl Raw {
    /// The numbers of a list of lists, row after row.
    fn flat(&self, numbers: &mut Vec<f64>) -> Option<()> {
        match self {
            Self::Number(number) => numbers.push(*number),
            Self::Text(_) => return None,
            Self::List(items) => items.iter().try_for_each(|item| item.flat(numbers))?,
        }
        Some(())
    }

    /// The values of a parameter, or what it expects.
    fn values(&self, shape: Shape) -> Result<Vec<f64>, &'static str> {
        let mut numbers = Vec::new();
        let all_numbers = self.flat(&mut numbers).is_some();
        let listed = |length| all_numbers && numbers.len() == length;
        match (shape, self) {
            (Shape::Scalar | Shape::Time, Self::Number(_)) => Ok(numbers),
            (Shape::Scalar | Shape::Time, _) => Err("a number"),
            (Shape::Vector3, Self::List(items)) if items.len() == 3 && listed(3) => Ok(numbers),
            (Shape::Vector3, _) => Err("a list of three numbers"),
            (Shape::Matrix3, Self::List(items))
                if listed(9) && (items.len() == 9 || items.iter().all(|row| row.is_row())) =>
            {
                Ok(numbers)
            }
            (Shape::Matrix3, _) => Err("three rows of three numbers"),
            (Shape::Choice(words), Self::Text(word)) => words
                .iter()
                .position(|known| known == word)
                .map(|index| vec![index as f64])
                .ok_or("another word"),
            (Shape::Choice(_), _) => Err("a word"),
        }
    }

    fn is_row(&self) -> bool {
        matches!(self, Self::List(items) if items.len() == 3)
    }
}

struct EffectVisitor;

impl<'de> Visitor<'de> for EffectVisitor {
    type Value = Effect;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an effect: {effect: NAME, PARAMETER: ...}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Effect, A::Error> {
        let mut fields: Vec<(String, Raw)> = Vec::new();
        let mut name = None;
        while let Some(key) = map.next_key::<String>()? {
            if key == "effect" && name.is_none() {
                name = Some(map.next_value::<String>()?);
            } else {
                fields.push((key, map.next_value()?));
            }
        }
        let name = name.ok_or_else(|| de::Error::missing_field("effect"))?;
        parse(&name, &fields).map_err(de::Error::custom)
    }
}

fn parse(name: &str, fields: &[(String, Raw)]) -> Result<Effect, EffectError> {
    let kind = kind(name)?;
    let (effect, spec) = (kind.name(), kind.spec());
    let known = |field: &str| {
        spec.parameters
            .iter()
            .any(|parameter| parameter.name == field)
    };
    if let Some((field, _)) = fields.iter().find(|(field, _)| !known(field)) {
        let expected = spec
            .parameters
            .iter()
            .map(|parameter| parameter.name)
            .collect::<Vec<_>>()
            .join(", ");
        return Err(EffectError::UnknownField {
            effect,
            field: field.clone(),
            expected,
        });
    }
    let mut values = Vec::with_capacity(spec.value_count());
    for parameter in spec.parameters {
        let mut given = fields.iter().filter(|(field, _)| field == parameter.name);
        let (field, raw) = match (given.next(), given.next()) {
            (Some((field, raw)), None) => (field, raw),
            (None, None) if parameter.is_optional => {
                values.extend(parameter.neutral);
                continue;
            }
            _ => {
                return Err(EffectError::NotOnce {
                    effect,
                    field: parameter.name,
                });
            }
        };
        let malformed = |expected| match parameter.shape {
            Shape::Choice(words) => EffectError::NoChoice {
                effect,
                field: parameter.name,
                words: words.join(", "),
            },
            _ => EffectError::Malformed {
                effect,
                field: field.clone(),
                expected,
            },
        };
        values.extend(raw.values(parameter.shape).map_err(malformed)?);
    }
    Effect::new(kind, values)
}

impl<'de> Deserialize<'de> for Effect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EffectVisitor)
    }
}
