//! Endpoints are made one at a time, each when discovery is through with the one before.
//!
//! Else RustDDS 0.15.1 may lock up for good. For a new endpoint its discovery thread tells its
//! event loop of every counterpart it knows, through a queue of 32 places, and keeps the discovery
//! database locked for reading meanwhile. Should that queue be full while a third thread waits to
//! write the next endpoint into the database, then the event loop, which empties the queue, cannot
//! read the database: a waiting writer goes before new readers. Such a process hangs in
//! `Node::start` and its peers never learn its name. Many processes that start together on busy
//! cores are enough.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustdds::{DomainParticipant, GUID, QosPolicies, RTPSEntity, StatusEvented};

use crate::error::RosResult;
use crate::graph::Graph;
use crate::raw::Gid;
use crate::wake::lock;

/// Far more than discovery ever takes: a wait that is over is no error.
const AT_LAST: Duration = Duration::from_secs(1);
const LOOK_EVERY: Duration = Duration::from_millis(1);

pub(crate) struct Turns {
    participant: DomainParticipant,
    turn: Mutex<()>,
    /// The network brings back what this participant says. Loopback without multicast does not.
    echoes: AtomicBool,
}

/// An endpoint that is being made.
#[derive(Clone, Copy)]
pub(crate) struct Planned<'a> {
    pub(crate) topic: &'a str,
    pub(crate) qos: &'a QosPolicies,
    pub(crate) writes: bool,
    /// An endpoint of this participant on the same topic and the other side.
    pub(crate) counterpart: Option<Gid>,
}

impl<'a> Planned<'a> {
    pub(crate) fn on(topic: &'a str, qos: &'a QosPolicies, writes: bool) -> Self {
        Self {
            topic,
            qos,
            writes,
            counterpart: None,
        }
    }
}

/// An endpoint as discovery has it.
struct Seen {
    guid: GUID,
    topic: String,
    qos: QosPolicies,
    writes: bool,
}

impl Turns {
    pub(crate) fn new(participant: &DomainParticipant) -> Self {
        Self {
            participant: participant.clone(),
            turn: Mutex::default(),
            echoes: AtomicBool::new(false),
        }
    }

    /// Makes an endpoint, and returns when discovery is through with it. `gid` tells its identity,
    /// none where it is hidden.
    pub(crate) fn make<E>(
        &self,
        graph: &Graph,
        planned: Planned<'_>,
        make: impl FnOnce() -> RosResult<E>,
        gid: impl FnOnce(&E) -> Option<Gid>,
    ) -> RosResult<E> {
        let _turn = lock(&self.turn);
        let made = make()?;
        let gid = gid(&made);
        let started = Instant::now();
        while !self.is_through(graph, planned, gid) {
            if started.elapsed() > AT_LAST {
                log::debug!("{}: discovery is late", planned.topic);
                break;
            }
            std::thread::sleep(LOOK_EVERY);
        }
        Ok(made)
    }

    fn is_through(&self, graph: &Graph, planned: Planned<'_>, gid: Option<Gid>) -> bool {
        // Here too: before the node's thread runs, and on it, nobody else does.
        let listener = self.participant.status_listener();
        graph.handle_each(|| listener.try_recv_status());
        // Where the network brings back what discovery says, it does so only after the work.
        let is_back = || gid.is_none_or(|gid| graph.is_detected(gid));
        if self.echoes.load(Ordering::Relaxed) {
            return is_back();
        }
        let (seen, own) = (self.seen(), self.participant.guid().prefix);
        if seen.iter().any(|endpoint| endpoint.guid.prefix == own) {
            self.echoes.store(true, Ordering::Relaxed);
            return is_back();
        }
        // The work is to match the counterparts, this participant's last.
        let mut counterparts = seen
            .iter()
            .filter(|endpoint| endpoint.is_counterpart_of(planned))
            .map(|endpoint| Gid::from(endpoint.guid))
            .chain(planned.counterpart);
        counterparts.all(|peer| gid.is_some_and(|gid| graph.is_matched(gid, peer)))
    }

    fn seen(&self) -> Vec<Seen> {
        let writers = self.participant.discovered_writers();
        let writers = writers.into_iter().map(|writer| Seen {
            guid: writer.writer_proxy.remote_writer_guid,
            qos: writer.publication_topic_data.qos(),
            topic: writer.publication_topic_data.topic_name,
            writes: true,
        });
        let readers = self.participant.discovered_readers();
        let readers = readers.into_iter().map(|reader| Seen {
            guid: reader.reader_proxy.remote_reader_guid,
            qos: reader.subscription_topic_data.qos(),
            topic: reader.subscription_topic_data.topic_name().clone(),
            writes: false,
        });
        writers.chain(readers).collect()
    }
}

impl Seen {
    fn is_counterpart_of(&self, planned: Planned<'_>) -> bool {
        let (offered, requested) = if self.writes {
            (&self.qos, planned.qos)
        } else {
            (planned.qos, &self.qos)
        };
        self.topic == planned.topic
            && self.writes != planned.writes
            && offered.compliance_failure_wrt(requested).is_none()
    }
}
