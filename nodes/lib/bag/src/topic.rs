//! What a bag says about a topic.

use std::collections::BTreeMap;

use cromosim_msgs::{MessageType, RosMessage, known_type};

use crate::qos::QosProfile;

pub(crate) const QOS_KEY: &str = "offered_qos_profiles";
pub(crate) const HASH_KEY: &str = "topic_type_hash";

/// A topic: its name, its type and how its messages are encoded. One channel of an MCAP file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Topic {
    /// Its name, with the leading slash.
    pub name: String,
    /// `sensor_msgs/msg/Imu` and the like; empty where the file does not say.
    pub type_name: String,
    /// Language of the schema: `ros2msg`, or empty where there is none.
    pub schema_encoding: String,
    /// Text of the message type and of all types in it.
    pub schema: Vec<u8>,
    /// Encoding of the messages: `cdr`.
    pub message_encoding: String,
    /// What else the writer said, by its name in the file.
    pub metadata: BTreeMap<String, String>,
}

impl Topic {
    /// The topic `name` with messages of type `M`, offered as [`QosProfile::usual`].
    pub fn for_message<M: RosMessage>(name: &str) -> Self {
        Self::known(name, M::TYPE)
    }

    /// The topic `name` with messages of a type known by name only. Where cromosim_msgs has the
    /// type, the schema and the type hash come from there; else the schema stays empty, which
    /// readers with an own copy of the type accept.
    pub fn named(name: &str, type_name: &str) -> Self {
        match known_type(type_name) {
            Some(message) => Self::known(name, message),
            None => Self::with_schema(name, type_name, ""),
        }
    }

    /// The topic `name` with messages of any type, described by its `ros2msg` text.
    pub fn with_schema(name: &str, type_name: &str, schema_text: &str) -> Self {
        let topic = Self {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            schema_encoding: if schema_text.is_empty() {
                String::new()
            } else {
                "ros2msg".to_owned()
            },
            schema: schema_text.as_bytes().to_vec(),
            message_encoding: "cdr".to_owned(),
            metadata: BTreeMap::from([(HASH_KEY.to_owned(), String::new())]),
        };
        topic.with_qos(&[QosProfile::usual(name)])
    }

    fn known(name: &str, message: &MessageType) -> Self {
        Self::with_schema(name, message.name, &message.schema_text())
            .with_type_hash(&message.type_hash())
    }

    /// The topic with these offered profiles, one for each publisher.
    #[must_use]
    pub fn with_qos(mut self, profiles: &[QosProfile]) -> Self {
        // Plain maps of strings and numbers: this cannot fail.
        let text = serde_norway::to_string(profiles).unwrap_or_default();
        self.metadata.insert(QOS_KEY.to_owned(), text);
        self
    }

    /// The topic with this type hash (`RIHS01_…`).
    #[must_use]
    pub fn with_type_hash(mut self, hash: &str) -> Self {
        self.metadata.insert(HASH_KEY.to_owned(), hash.to_owned());
        self
    }

    /// The offered profiles; empty where the file does not say, or says it in the numbers of ROS 2
    /// before Jazzy.
    pub fn qos(&self) -> Vec<QosProfile> {
        self.metadata
            .get(QOS_KEY)
            .and_then(|text| serde_norway::from_str(text).ok())
            .unwrap_or_default()
    }

    /// The type hash (`RIHS01_…`); empty where the file does not say.
    pub fn type_hash(&self) -> &str {
        self.metadata.get(HASH_KEY).map_or("", String::as_str)
    }

    /// The schema as text; empty where it is not text.
    pub fn schema_text(&self) -> &str {
        std::str::from_utf8(&self.schema).unwrap_or_default()
    }
}
