//! What a message type is: its fields, its schema text and its type hash.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

/// A ROS 2 message: plain data whose serde order is the order on the wire (CDR).
pub trait RosMessage: Serialize + DeserializeOwned {
    /// `package/msg/Name`, as ROS 2 writes it.
    const TYPE_NAME: &'static str;
    /// The description that the struct was made with.
    const TYPE: &'static MessageType;

    /// The full `ros2msg` schema: see [`MessageType::schema_text`].
    fn schema_text() -> String {
        Self::TYPE.schema_text()
    }

    /// The RIHS01 hash: see [`MessageType::type_hash`].
    fn type_hash() -> String {
        Self::TYPE.type_hash()
    }
}

/// A ROS 2 service: two messages and a name.
pub trait RosService {
    /// `package/srv/Name`.
    const TYPE_NAME: &'static str;
    /// What the client sends.
    type Request: RosMessage;
    /// What the server answers.
    type Response: RosMessage;
}

/// Describes one message type.
#[derive(Debug)]
pub struct MessageType {
    /// `package/msg/Name`; `package/srv/Name_Request` and `package/srv/Name_Response` for the
    /// halves of a service.
    pub name: &'static str,
    /// The interface file, with comments.
    pub file_text: &'static str,
    /// Which part of the file defines this message.
    pub part: Part,
    /// The fields in wire order.
    pub fields: &'static [Field],
    /// The constants by name.
    pub constants: &'static [(&'static str, i64)],
}

/// Part of an interface file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of a `.msg` file.
    Message,
    /// What stands above `---` in a `.srv` file.
    Request,
    /// What stands below `---` in a `.srv` file.
    Response,
}

/// One field of a message.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name on the wire's description.
    pub name: &'static str,
    /// Its type.
    pub field_type: FieldType,
}

/// The type of a field: an element and how many of it.
#[derive(Clone, Copy, Debug)]
pub struct FieldType {
    /// What is repeated.
    pub element: Element,
    /// How often.
    pub arity: Arity,
}

impl FieldType {
    /// The same arity of another element.
    #[must_use]
    pub const fn with_element(self, element: Element) -> Self {
        Self {
            element,
            arity: self.arity,
        }
    }
}

/// How many elements a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arity {
    /// A single value.
    One,
    /// A fixed array.
    Array(usize),
    /// A sequence of any length.
    Sequence,
}

/// The element types that our messages use.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Element {
    Bool,
    Byte,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
    String,
    Message(&'static MessageType),
}

impl Element {
    /// The number in `type_description_interfaces/msg/FieldType` (REP-2016).
    const fn type_id(self) -> u8 {
        match self {
            Self::Message(_) => 1,
            Self::Int8 => 2,
            Self::UInt8 => 3,
            Self::Int16 => 4,
            Self::UInt16 => 5,
            Self::Int32 => 6,
            Self::UInt32 => 7,
            Self::Int64 => 8,
            Self::UInt64 => 9,
            Self::Float32 => 10,
            Self::Float64 => 11,
            Self::Bool => 15,
            Self::Byte => 16,
            Self::String => 17,
        }
    }
}

/// A Rust type that can be the element of a field.
pub trait RosElement {
    /// Its element type.
    const ELEMENT: Element;
}

/// A Rust type that can be a field.
pub trait RosField {
    /// Its field type.
    const FIELD_TYPE: FieldType;
}

macro_rules! primitives {
    ($($ty:ty => $element:ident),* $(,)?) => {$(
        impl RosElement for $ty {
            const ELEMENT: Element = Element::$element;
        }
        impl RosField for $ty {
            const FIELD_TYPE: FieldType = FieldType { element: Element::$element, arity: Arity::One };
        }
    )*};
}

primitives! {
    bool => Bool, i8 => Int8, u8 => UInt8, i16 => Int16, u16 => UInt16, i32 => Int32, u32 => UInt32, i64 => Int64, u64 => UInt64,
    f32 => Float32, f64 => Float64, String => String,
}

impl<E: RosElement> RosField for Vec<E> {
    const FIELD_TYPE: FieldType = FieldType {
        element: E::ELEMENT,
        arity: Arity::Sequence,
    };
}

impl<E: RosElement, const N: usize> RosField for [E; N] {
    const FIELD_TYPE: FieldType = FieldType {
        element: E::ELEMENT,
        arity: Arity::Array(N),
    };
}

/// A matrix, row by row: serde knows no arrays of more than 32 elements, and CDR writes both alike.
impl<E: RosElement, const ROWS: usize, const COLUMNS: usize> RosField for [[E; COLUMNS]; ROWS] {
    const FIELD_TYPE: FieldType = FieldType {
        element: E::ELEMENT,
        arity: Arity::Array(ROWS * COLUMNS),
    };
}

impl MessageType {
    /// The definition of this type alone, in the interface language.
    pub fn definition(&self) -> &'static str {
        let (request, response) = match self.file_text.strip_prefix("---\n") {
            Some(response) => ("", response),
            None => self
                .file_text
                .split_once("\n---\n")
                .unwrap_or((self.file_text, "")),
        };
        match self.part {
            Part::Message => self.file_text,
            Part::Request => request,
            Part::Response => response,
        }
    }

    /// All types that this one holds, directly or not, by name.
    pub fn dependencies(&self) -> Vec<&'static MessageType> {
        let mut found = BTreeMap::new();
        self.collect(&mut found);
        found.into_values().collect()
    }

    fn collect(&self, found: &mut BTreeMap<&'static str, &'static MessageType>) {
        for field in self.fields {
            if let Element::Message(inner) = field.field_type.element
                && found.insert(inner.name, inner).is_none()
            {
                inner.collect(found);
            }
        }
    }

    /// The schema as MCAP's encoding `ros2msg` wants it: the definition, then each dependency after
    /// a line of 80 `=` and a line `MSG: package/Name`, in the order of their names.
    pub fn schema_text(&self) -> String {
        let mut text = self.definition().to_owned();
        for dependency in self.dependencies() {
            let short = dependency.name.replacen("/msg/", "/", 1);
            let _ = write!(
                text,
                "{}\nMSG: {short}\n{}",
                "=".repeat(80),
                dependency.definition()
            );
        }
        text
    }

    /// `RIHS01_` and the SHA-256, in hexadecimal, of the type description as JSON (REP-2016),
    /// dependencies ordered by name.
    pub fn type_hash(&self) -> String {
        let referenced: Vec<String> = self
            .dependencies()
            .iter()
            .map(|inner| inner.description())
            .collect();
        let json = format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            self.description(),
            referenced.join(", ")
        );
        let digest = Sha256::digest(json.as_bytes());
        digest.iter().fold("RIHS01_".to_owned(), |mut hash, byte| {
            let _ = write!(hash, "{byte:02x}");
            hash
        })
    }

    /// This type alone as REP-2016's JSON. Names hold only ASCII letters, digits, `_` and `/`:
    /// nothing needs escaping.
    fn description(&self) -> String {
        let fields: Vec<String> = self.fields.iter().map(Field::description).collect();
        format!(
            r#"{{"type_name": "{}", "fields": [{}]}}"#,
            self.name,
            fields.join(", ")
        )
    }
}

impl Field {
    fn description(&self) -> String {
        // Arrays, bounded and unbounded sequences count on from the element's number in steps of
        // 48.
        let (step, capacity) = match self.field_type.arity {
            Arity::One => (0, 0),
            Arity::Array(length) => (48, length),
            Arity::Sequence => (144, 0),
        };
        let nested = match self.field_type.element {
            Element::Message(inner) => inner.name,
            _ => "",
        };
        format!(
            r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#,
            self.name,
            self.field_type.element.type_id() + step
        )
    }
}
