//! What a bag holds, in numbers.

use std::sync::Arc;

use cromosim_spatial::Stamp;

use crate::topic::Topic;

/// What a bag, or one file of it, holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagSummary {
    /// The topics with their message counts, in order of first appearance.
    pub topics: Vec<CountedTopic>,
    /// Log times of the first and the last message.
    pub time_range: Option<(Stamp, Stamp)>,
}

/// A topic and how many messages it has.
#[derive(Clone, Debug, PartialEq)]
pub struct CountedTopic {
    /// Its name, type and encoding.
    pub topic: Arc<Topic>,
    /// How many messages it has.
    pub message_count: u64,
}

impl BagSummary {
    /// Messages on all topics.
    pub fn message_count(&self) -> u64 {
        self.topics
            .iter()
            .map(|counted| counted.message_count)
            .sum()
    }

    /// Last log time minus first, s; 0 for an empty bag.
    pub fn duration(&self) -> f64 {
        self.time_range.map_or(0.0, |(start, end)| end - start)
    }

    /// Counts `count` messages of a topic; topics of one name and type are one.
    pub(crate) fn count(&mut self, topic: &Arc<Topic>, count: u64) {
        let same = |counted: &&mut CountedTopic| {
            counted.topic.name == topic.name && counted.topic.type_name == topic.type_name
        };
        match self.topics.iter_mut().find(same) {
            Some(counted) => counted.message_count += count,
            None => self.topics.push(CountedTopic {
                topic: Arc::clone(topic),
                message_count: count,
            }),
        }
    }

    /// Widens the time range.
    pub(crate) fn cover(&mut self, time: Stamp) {
        self.time_range = Some(self.time_range.map_or((time, time), |(start, end)| {
            (start.min(time), end.max(time))
        }));
    }

    /// Adds what another file holds.
    pub(crate) fn add(&mut self, other: &Self) {
        for counted in &other.topics {
            self.count(&counted.topic, counted.message_count);
        }
        if let Some((start, end)) = other.time_range {
            self.cover(start);
            self.cover(end);
        }
    }
}
