//! Messages as they are read, and which of them are wanted.

use std::sync::Arc;

use cromosim_msgs::RosMessage;
use cromosim_spatial::Stamp;

use crate::cdr;
use crate::error::BagError;
use crate::topic::Topic;

/// Which messages to read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Names of topics; all where absent.
    pub topics: Option<Vec<String>>,
    /// The first log time; from the start where absent.
    pub from: Option<Stamp>,
    /// The log time before which to end; to the end where absent.
    pub until: Option<Stamp>,
}

impl Selection {
    /// All messages of one topic.
    pub fn topic(name: &str) -> Self {
        Self {
            topics: Some(vec![name.to_owned()]),
            ..Self::default()
        }
    }

    pub(crate) fn has_time(&self, time: Stamp) -> bool {
        self.from.is_none_or(|from| time >= from) && self.until.is_none_or(|until| time < until)
    }

    pub(crate) fn has_topic(&self, name: &str) -> bool {
        self.topics
            .as_ref()
            .is_none_or(|topics| topics.iter().any(|topic| topic == name))
    }
}

/// One message of a bag, not yet decoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The topic that it was published on.
    pub topic: Arc<Topic>,
    /// The writer's running number.
    pub sequence: u32,
    /// When it was recorded.
    pub log_time: Stamp,
    /// When it was published.
    pub publish_time: Stamp,
    /// CDR with its four header bytes, for topics whose encoding is `cdr`.
    pub payload: Vec<u8>,
}

impl Message {
    /// The message as `M`.
    ///
    /// # Errors
    /// [`BagError::WrongType`], [`BagError::Decode`].
    pub fn decode<M: RosMessage>(&self) -> Result<M, BagError> {
        if self.topic.type_name != M::TYPE_NAME {
            return Err(wrong_type::<M>(&self.topic));
        }
        cdr::decode(&self.payload).map_err(|reason| BagError::Decode {
            topic: self.topic.name.clone(),
            log_time: self.log_time,
            reason,
        })
    }
}

pub(crate) fn wrong_type<M: RosMessage>(topic: &Topic) -> BagError {
    BagError::WrongType {
        topic: topic.name.clone(),
        expected: M::TYPE_NAME.to_owned(),
        found: topic.type_name.clone(),
    }
}
