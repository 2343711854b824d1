//! What a node and all its endpoints share: the DDS participant, the endpoints, and what peers are told about them.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rustdds::{DomainParticipant, QosPolicies, Topic, TopicKind};
use serde::{Deserialize, Serialize};

use crate::clock::Clock;
use crate::error::{RosResult, dds};
use crate::graph::{Endpoint, Graph};
use crate::names::{Kind, NodeName, dds_type_name};
use crate::qos::{Durability, Qos};
use crate::raw::{Gid, RawMessage, RawReader, RawWriter};
use crate::reader::{Reader, ReaderOptions};
use crate::shutdown::Shutdown;
use crate::wake::{Bell, lock};

/// A piece of the node thread's work: called at every ring of the node's bell, ends by returning false.
pub(crate) type Worker = Box<dyn FnMut() -> bool + Send>;

pub(crate) struct Core {
    pub(crate) name: NodeName,
    local: Mutex<BTreeMap<Gid, Endpoint>>,
    info_writer: RawWriter,
    pub(crate) graph: Graph,
    pub(crate) clock: Clock,
    pub(crate) shutdown: Shutdown,
    /// Wakes the node's thread.
    pub(crate) bell: Arc<Bell>,
    pub(crate) new_workers: Mutex<Vec<Worker>>,
    pub(crate) stopping: AtomicBool,
    /// Writers of dropped publishers, which stay until their last messages have arrived.
    leaving: Mutex<Vec<Leaving>>,
    // Last, and in this order: endpoints must go before what they belong to.
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    pub(crate) participant: DomainParticipant,
}

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`: which nodes live in a participant, and which endpoints are theirs.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ParticipantInfo {
    pub(crate) participant: Gid,
    pub(crate) nodes: Vec<NodeInfo>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NodeInfo {
    pub(crate) namespace: String,
    pub(crate) name: String,
    pub(crate) readers: Vec<Gid>,
    pub(crate) writers: Vec<Gid>,
}

const INFO_TOPIC: &str = "ros_discovery_info";
const INFO_TYPE: &str = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

impl Core {
    pub(crate) fn new(name: NodeName, participant: DomainParticipant, clock: Clock, shutdown: Shutdown) -> RosResult<Self> {
        let qos = Qos::reliable();
        let doing = |what: &str| format!("node {name}: create {what}");
        let publisher = participant.create_publisher(&qos.to_dds()).map_err(|error| dds(doing("DDS publisher"), error))?;
        let subscriber = participant.create_subscriber(&qos.to_dds()).map_err(|error| dds(doing("DDS subscriber"), error))?;
        let info_qos = Qos::tf_static().to_dds();
        let info_topic = make_topic(&participant, INFO_TOPIC, INFO_TYPE, &info_qos)?;
        let info_writer =
            publisher.create_datawriter_no_key(&info_topic, Some(info_qos)).map_err(|error| dds(doing("ros_discovery_info"), error))?;
        let bell = Bell::new();
        shutdown.ring_at_request(&bell);
        Ok(Self {
            graph: Graph::new(shutdown.clone()),
            name,
            participant,
            publisher,
            subscriber,
            local: Mutex::default(),
            info_writer,
            clock,
            shutdown,
            bell,
            new_workers: Mutex::default(),
            stopping: AtomicBool::new(false),
            leaving: Mutex::default(),
        })
    }

    /// The reader of what other participants say about their nodes. Deep: every participant keeps its last word there.
    pub(crate) fn info_reader(self: &Arc<Self>) -> RosResult<Reader> {
        let qos = Qos::tf_static().depth(1000).to_dds();
        let topic = make_topic(&self.participant, INFO_TOPIC, INFO_TYPE, &qos)?;
        let reader: RawReader = self
            .subscriber
            .create_simple_datareader_no_key(&topic, Some(qos))
            .map_err(|error| dds(format!("node {}: read {INFO_TOPIC}", self.name), error))?;
        let options = ReaderOptions { bell: Arc::clone(&self.bell), helper: None, limit: usize::MAX, skip_past: false };
        Ok(Reader::new(reader, None, options))
    }

    /// Makes a reader on an absolute name and tells peers that it is this node's.
    pub(crate) fn reader(self: &Arc<Self>, kind: Kind, name: &str, type_name: &str, qos: Qos, bell: Arc<Bell>) -> RosResult<Reader> {
        let dds_qos = qos.to_dds();
        let topic = make_topic(&self.participant, &kind.dds_name(name), &dds_type_name(type_name)?, &dds_qos)?;
        let reader: RawReader = self
            .subscriber
            .create_simple_datareader_no_key(&topic, Some(dds_qos))
            .map_err(|error| dds(format!("subscribe to {name}"), error))?;
        let gid = Gid::from(reader.guid());
        let guard = self.register(gid, Side::Reads, kind, name, type_name, qos);
        let helped = !Arc::ptr_eq(&bell, &self.bell);
        let options = ReaderOptions {
            bell,
            helper: helped.then(|| Arc::clone(&self.bell)),
            limit: qos.queue_length(),
            skip_past: qos.durability == Durability::Volatile,
        };
        let reader = Reader::new(reader, Some(guard), options);
        if helped {
            let inbox = reader.inbox();
            self.add_worker(Box::new(move || inbox.upgrade().inspect(|inbox| inbox.pump()).is_some()));
        }
        Ok(reader)
    }

    /// Makes a writer on an absolute name and tells peers that it is this node's.
    pub(crate) fn writer(self: &Arc<Self>, kind: Kind, name: &str, type_name: &str, qos: Qos) -> RosResult<(RawWriter, EndpointGuard)> {
        use rustdds::RTPSEntity;
        let dds_qos = qos.to_dds();
        let topic = make_topic(&self.participant, &kind.dds_name(name), &dds_type_name(type_name)?, &dds_qos)?;
        let writer: RawWriter =
            self.publisher.create_datawriter_no_key(&topic, Some(dds_qos)).map_err(|error| dds(format!("publish {name}"), error))?;
        let guard = self.register(Gid::from(writer.guid()), Side::Writes, kind, name, type_name, qos);
        Ok((writer, guard))
    }

    fn register(self: &Arc<Self>, gid: Gid, side: Side, kind: Kind, name: &str, type_name: &str, qos: Qos) -> EndpointGuard {
        let endpoint = Endpoint {
            topic: name.to_owned(),
            type_name: type_name.to_owned(),
            node: Some(self.name.clone()),
            gid,
            qos,
            is_topic: kind == Kind::Topic,
            writes: side == Side::Writes,
        };
        lock(&self.local).insert(gid, endpoint);
        self.announce();
        EndpointGuard { core: Arc::clone(self), gid }
    }

    /// Tells peers which endpoints this node has now; once it is stopping, that it has gone.
    pub(crate) fn announce(&self) {
        let local = lock(&self.local);
        let gids = |writes| local.values().filter(|e| e.writes == writes).map(|e| e.gid).collect();
        let node = NodeInfo {
            namespace: self.name.namespace().to_owned(),
            name: self.name.name().to_owned(),
            readers: gids(false),
            writers: gids(true),
        };
        let nodes = if self.stopping.load(Ordering::SeqCst) { Vec::new() } else { vec![node] };
        let info = ParticipantInfo { participant: self.participant_gid(), nodes };
        // The lock is held: two threads must not announce in the wrong order.
        let sent = RawMessage::encode(&info).and_then(|raw| self.info_writer.write(raw, None).map_err(|error| error.to_string()));
        if let Err(problem) = sent {
            log::warn!("node {}: cannot tell peers about its endpoints: {problem}", self.name);
        }
    }

    pub(crate) fn participant_gid(&self) -> Gid {
        use rustdds::RTPSEntity;
        Gid::from(self.participant.guid())
    }

    pub(crate) fn local_endpoints(&self) -> Vec<Endpoint> {
        lock(&self.local).values().cloned().collect()
    }

    /// Hands work to the node's thread.
    pub(crate) fn add_worker(&self, worker: Worker) {
        lock(&self.new_workers).push(worker);
        self.bell.ring();
    }
}

/// A writer on its way out.
struct Leaving {
    since: Instant,
    writer: RawWriter,
    _guard: EndpointGuard,
}

impl Leaving {
    /// True while a matched subscription may still lose something: RustDDS forgets unread messages of a publisher that has gone.
    fn stays(&self) -> bool {
        let since = self.since.elapsed();
        since < Core::LEAVE_AFTER || (since < Core::LEAVE_AT_LAST && !self.writer.wait_for_acknowledgments(Duration::ZERO).unwrap_or(true))
    }
}

impl Core {
    /// Time for peers to read what they have confirmed.
    const LEAVE_AFTER: Duration = Duration::from_millis(100);
    /// Time for peers to confirm.
    const LEAVE_AT_LAST: Duration = Duration::from_secs(2);

    /// Lets a writer go once its messages have arrived, in the background while the node runs.
    pub(crate) fn leave(self: &Arc<Self>, writer: RawWriter, guard: EndpointGuard) {
        let leaving = Leaving { since: Instant::now(), writer, _guard: guard };
        if self.graph.matched(leaving._guard.gid) == 0 {
            return;
        }
        if !self.stopping.load(Ordering::SeqCst) {
            lock(&self.leaving).push(leaving);
            self.bell.ring();
            return;
        }
        while leaving.stays() {
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Drops the writers that may go. True where some stay.
    pub(crate) fn let_go(&self) -> bool {
        let mut leaving = lock(&self.leaving);
        let (stay, go): (Vec<_>, Vec<_>) = leaving.drain(..).partition(Leaving::stays);
        *leaving = stay;
        let some_stay = !leaving.is_empty();
        // Unlocked: a guard announces when it is dropped.
        drop(leaving);
        drop(go);
        some_stay
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Reads,
    Writes,
}

fn make_topic(participant: &DomainParticipant, name: &str, type_name: &str, qos: &QosPolicies) -> RosResult<Topic> {
    participant
        .create_topic(name.to_owned(), type_name.to_owned(), qos, TopicKind::NoKey)
        .map_err(|error| dds(format!("create DDS topic {name}"), error))
}

/// Takes the endpoint out of the node's announcement when it is dropped.
pub(crate) struct EndpointGuard {
    pub(crate) core: Arc<Core>,
    pub(crate) gid: Gid,
}

impl Drop for EndpointGuard {
    fn drop(&mut self) {
        lock(&self.core.local).remove(&self.gid);
        self.core.graph.forget_local(self.gid);
        self.core.announce();
    }
}
