//! A DDS reader that rings a bell.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, Weak};
use std::task::{Wake, Waker};

use cromosim_spatial::Stamp;
use rustdds::no_key::DeserializedCacheChange;
use rustdds::rpc::SampleIdentity;

use crate::clock::system_now;
use crate::raw::{Gid, RawMessage, RawReader, Received, stamp_from_dds};
use crate::wake::{Bell, lock};

/// The receiving end of an endpoint. RustDDS's, since only ros2-client's `Node` makes subscriptions
/// (see the crate's table).
///
/// RustDDS forgets what it has received and confirmed but not yet handed out as soon as the
/// publisher goes. So messages are taken out of it at once: by the thread that waits for them or,
/// while that one is busy, by the node's thread.
pub(crate) struct Reader {
    inbox: Arc<Inbox>,
}

/// How a reader is made.
pub(crate) struct ReaderOptions {
    /// Rings at a message.
    pub(crate) bell: Arc<Bell>,
    /// Rings at a message while nobody waits for `bell`; whoever hears it pumps.
    pub(crate) helper: Option<Arc<Bell>>,
    /// At most this many messages wait to be taken, the oldest go first.
    pub(crate) limit: usize,
    /// Messages that arrived before are not for this reader: RustDDS keeps one cache for each topic
    /// of a participant, where a second subscription would find what came in long before it.
    pub(crate) skip_past: bool,
}

pub(crate) struct Inbox {
    reader: RawReader,
    ringer: Arc<Ringer>,
    waker: Waker,
    queue: Mutex<VecDeque<Result<Sample, String>>>,
    limit: usize,
    not_before: Option<Stamp>,
}

struct Ringer {
    bell: Mutex<Arc<Bell>>,
    helper: Option<Arc<Bell>>,
}

impl Wake for Ringer {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        if !lock(&self.bell).ring_and_ask()
            && let Some(helper) = &self.helper
        {
            helper.ring();
        }
    }
}

/// A message with what services need.
pub(crate) struct Sample {
    pub(crate) received: Received<RawMessage>,
    pub(crate) identity: SampleIdentity,
    pub(crate) related: Option<SampleIdentity>,
}

impl Reader {
    pub(crate) fn new(reader: RawReader, options: ReaderOptions) -> Self {
        let ReaderOptions {
            bell,
            helper,
            limit,
            skip_past,
        } = options;
        let ringer = Arc::new(Ringer {
            bell: Mutex::new(bell),
            helper,
        });
        let waker = Waker::from(Arc::clone(&ringer));
        let not_before = skip_past.then(system_now);
        let inbox = Inbox {
            reader,
            ringer,
            waker,
            queue: Mutex::default(),
            limit,
            not_before,
        };
        Self {
            inbox: Arc::new(inbox),
        }
    }

    pub(crate) fn gid(&self) -> Gid {
        Gid::from(self.inbox.reader.guid())
    }

    pub(crate) fn bell(&self) -> Arc<Bell> {
        Arc::clone(&lock(&self.inbox.ringer.bell))
    }

    /// From now on arriving messages ring this bell.
    pub(crate) fn ring(&self, bell: Arc<Bell>) {
        bell.ring();
        *lock(&self.inbox.ringer.bell) = bell;
    }

    /// The next message. Where there is none, the bell rings at the next one.
    pub(crate) fn take(&self) -> Result<Option<Sample>, String> {
        let mut queue = lock(&self.inbox.queue);
        if queue.is_empty() {
            self.inbox.pump_into(&mut queue);
        }
        queue.pop_front().transpose()
    }

    pub(crate) fn inbox(&self) -> Weak<Inbox> {
        Arc::downgrade(&self.inbox)
    }
}

impl Inbox {
    /// Takes everything out of RustDDS.
    pub(crate) fn pump(&self) {
        self.pump_into(&mut lock(&self.queue));
    }

    fn pump_into(&self, queue: &mut VecDeque<Result<Sample, String>>) {
        self.reader.drain_read_notifications();
        self.take_all(queue);
        self.reader.set_waker(Some(self.waker.clone()));
        // Again: a message may have come between the look and the waker.
        self.take_all(queue);
    }

    fn take_all(&self, queue: &mut VecDeque<Result<Sample, String>>) {
        while let Some(taken) = self
            .reader
            .try_take_one()
            .map_err(|error| error.to_string())
            .transpose()
        {
            let sample = taken.map(Sample::from);
            if let (Ok(sample), Some(start)) = (&sample, self.not_before)
                && sample.received.received_stamp < start
            {
                continue;
            }
            if queue.len() >= self.limit {
                queue.pop_front();
            }
            queue.push_back(sample);
        }
    }
}

impl From<DeserializedCacheChange<RawMessage>> for Sample {
    fn from(change: DeserializedCacheChange<RawMessage>) -> Self {
        let identity = SampleIdentity {
            writer_guid: change.writer_guid,
            sequence_number: change.sequence_number,
        };
        let related = change.related_sample_identity();
        let received = Received {
            source_stamp: change.source_timestamp().and_then(stamp_from_dds),
            received_stamp: stamp_from_dds(change.receive_instant).unwrap_or_default(),
            sequence_number: i64::from(change.sequence_number),
            publisher: Gid::from(change.writer_guid),
            message: change.into_value(),
        };
        Sample {
            received,
            identity,
            related,
        }
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.reader.set_waker(None);
    }
}
