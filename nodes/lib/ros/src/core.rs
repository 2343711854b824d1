//! What a node and all its endpoints share: ros2-client's context, the endpoints, and what peers
//! are told about them.
//!
//! The context owns the DDS participant, makes the topics, and takes the node back from
//! `ros_discovery_info` when it goes. Writers and readers, and what is announced of them, are
//! RustDDS's and our own, for ros2-client 0.12.1:
//! - hides `wait_for_acknowledgments` of its publishers, without which the last messages of a
//!   process that ends are lost;
//! - announces only endpoints that its `Node` has made, so not those writers, and a second
//!   announcer of the same participant would contradict the first: of two, peers keep whichever
//!   arrives last;
//! - never takes dropped endpoints out of its announcement.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Context, MessageTypeName, builtin_topics};
use rustdds::{DomainParticipant, QosPolicies, RTPSEntity, Topic, TopicDescription, TopicKind};

use crate::clock::Clock;
use crate::error::{RosResult, dds};
use crate::graph::{Endpoint, Graph};
use crate::names::{Kind, NodeName, dds_type_name};
use crate::qos::{Durability, Qos};
use crate::raw::{Gid, RawMessage, RawReader, RawWriter};
use crate::reader::{Reader, ReaderOptions};
use crate::shutdown::Shutdown;
use crate::turns::{Planned, Turns};
use crate::wake::{Bell, lock};

/// A piece of the node thread's work: called at every ring of the node's bell, ends by returning
/// false.
pub(crate) type Worker = Box<dyn FnMut() -> bool + Send>;

pub(crate) struct Core {
    pub(crate) name: NodeName,
    ros_name: ros2_client::NodeName,
    local: Mutex<BTreeMap<Gid, Endpoint>>,
    info_writer: RawWriter,
    pub(crate) graph: Graph,
    turns: Turns,
    pub(crate) clock: Clock,
    pub(crate) shutdown: Shutdown,
    /// Wakes the node's thread.
    pub(crate) bell: Arc<Bell>,
    pub(crate) new_workers: Mutex<Vec<Worker>>,
    /// Until all that a node starts with is made, nothing is announced: peers hear it at once.
    pub(crate) started: AtomicBool,
    pub(crate) stopping: AtomicBool,
    /// Writers of dropped publishers, which stay until their last messages have arrived.
    leaving: Mutex<Vec<Leaving>>,
    // Last, and in this order: endpoints must go before what they belong to.
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    context: Context,
    pub(crate) participant: DomainParticipant,
}

use builtin_topics::ros_discovery::{TOPIC_NAME as INFO_TOPIC, TYPE_NAME as INFO_TYPE};

impl Core {
    pub(crate) fn new(
        name: NodeName,
        participant: DomainParticipant,
        clock: Clock,
        shutdown: Shutdown,
    ) -> RosResult<Self> {
        let qos = Qos::reliable();
        let doing = |what: &str| format!("node {name}: create {what}");
        let turns = Turns::new(&participant);
        let graph = Graph::new(participant.guid(), shutdown.clone());
        let info_qos = Qos::tf_static().to_dds();
        let info = Planned::on(INFO_TOPIC, &info_qos, true);
        // It has a writer on `ros_discovery_info` too.
        let make_context = || {
            Context::from_domain_participant(participant.clone())
                .map_err(|error| dds(doing("ros2-client's context"), error))
        };
        let context = turns.make(&graph, info, make_context, |_| None)?;
        let publisher = participant
            .create_publisher(&qos.to_dds())
            .map_err(|error| dds(doing("DDS publisher"), error))?;
        let subscriber = participant
            .create_subscriber(&qos.to_dds())
            .map_err(|error| dds(doing("DDS subscriber"), error))?;
        let info_topic = make_topic(&participant, INFO_TOPIC.into(), INFO_TYPE.into(), &info_qos)?;
        let make_writer = || -> RosResult<RawWriter> {
            publisher
                .create_datawriter_no_key(&info_topic, Some(info_qos.clone()))
                .map_err(|error| dds(doing("ros_discovery_info"), error))
        };
        let info_writer = turns.make(&graph, info, make_writer, gid_of)?;
        let ros_name = ros2_client::NodeName::new(name.namespace(), name.name())
            .map_err(|error| dds(doing("ros2-client's name"), error))?;
        let bell = Bell::new();
        shutdown.ring_at_request(&bell);
        Ok(Self {
            ros_name,
            graph,
            turns,
            name,
            participant,
            context,
            publisher,
            subscriber,
            local: Mutex::default(),
            info_writer,
            clock,
            shutdown,
            bell,
            new_workers: Mutex::default(),
            started: AtomicBool::new(false),
            stopping: AtomicBool::new(false),
            leaving: Mutex::default(),
        })
    }

    /// The reader of what other participants say about their nodes. Deep: every participant keeps
    /// its last word there.
    pub(crate) fn info_reader(self: &Arc<Self>) -> RosResult<Reader> {
        let qos = Qos::tf_static().depth(1000).to_dds();
        let topic = make_topic(&self.participant, INFO_TOPIC.into(), INFO_TYPE.into(), &qos)?;
        let make = || -> RosResult<RawReader> {
            self.subscriber
                .create_simple_datareader_no_key(&topic, Some(qos.clone()))
                .map_err(|error| dds(format!("node {}: read {INFO_TOPIC}", self.name), error))
        };
        let planned = Planned {
            counterpart: gid_of(&self.info_writer),
            ..Planned::on(INFO_TOPIC, &qos, false)
        };
        let gid = |reader: &RawReader| Some(reader.guid().into());
        let reader = self.turns.make(&self.graph, planned, make, gid)?;
        let options = ReaderOptions {
            bell: Arc::clone(&self.bell),
            helper: None,
            limit: usize::MAX,
            skip_past: false,
        };
        Ok(Reader::new(reader, options))
    }

    /// Makes a reader on an absolute name and tells peers that it is this node's, until the guard
    /// is dropped.
    pub(crate) fn reader(
        self: &Arc<Self>,
        kind: Kind,
        name: &str,
        type_name: &str,
        qos: Qos,
        bell: Arc<Bell>,
    ) -> RosResult<(Reader, EndpointGuard)> {
        let topic = self.topic(kind, name, type_name, qos)?;
        let dds_qos = qos.to_dds();
        let make = || -> RosResult<RawReader> {
            self.subscriber
                .create_simple_datareader_no_key(&topic, Some(dds_qos.clone()))
                .map_err(|error| dds(format!("subscribe to {name}"), error))
        };
        let dds_name = topic.name();
        let planned = Planned::on(&dds_name, &dds_qos, false);
        let gid = |reader: &RawReader| Some(reader.guid().into());
        let reader = self.turns.make(&self.graph, planned, make, gid)?;
        let gid = Gid::from(reader.guid());
        let guard = self.register(gid, Side::Reads, kind, name, type_name, qos);
        let helped = !Arc::ptr_eq(&bell, &self.bell);
        let options = ReaderOptions {
            bell,
            helper: helped.then(|| Arc::clone(&self.bell)),
            limit: qos.queue_length(),
            skip_past: qos.durability == Durability::Volatile,
        };
        let reader = Reader::new(reader, options);
        if helped {
            let inbox = reader.inbox();
            self.add_worker(Box::new(move || {
                inbox.upgrade().inspect(|inbox| inbox.pump()).is_some()
            }));
        }
        Ok((reader, guard))
    }

    /// Makes a writer on an absolute name and tells peers that it is this node's, until the guard
    /// is dropped.
    pub(crate) fn writer(
        self: &Arc<Self>,
        kind: Kind,
        name: &str,
        type_name: &str,
        qos: Qos,
    ) -> RosResult<(RawWriter, EndpointGuard)> {
        let topic = self.topic(kind, name, type_name, qos)?;
        let dds_qos = qos.to_dds();
        let make = || -> RosResult<RawWriter> {
            self.publisher
                .create_datawriter_no_key(&topic, Some(dds_qos.clone()))
                .map_err(|error| dds(format!("publish {name}"), error))
        };
        let dds_name = topic.name();
        let planned = Planned::on(&dds_name, &dds_qos, true);
        let writer = self.turns.make(&self.graph, planned, make, gid_of)?;
        let guard = self.register(
            Gid::from(writer.guid()),
            Side::Writes,
            kind,
            name,
            type_name,
            qos,
        );
        Ok((writer, guard))
    }

    fn topic(&self, kind: Kind, name: &str, type_name: &str, qos: Qos) -> RosResult<Topic> {
        let (dds_name, dds_type) = (kind.dds_name(name), dds_type_name(type_name)?);
        let parts: Vec<&str> = type_name.split('/').collect();
        let [package, "msg", base_name] = parts[..] else {
            // ros2-client names only the types of messages in public, not those of requests and
            // responses.
            return make_topic(&self.participant, dds_name, dds_type, &qos.to_dds());
        };
        let type_name = MessageTypeName::new(package, base_name);
        self.context
            .create_topic(dds_name, type_name, &qos.to_profile())
            .map_err(|error| dds(format!("create topic {name}"), error))
    }

    fn register(
        self: &Arc<Self>,
        gid: Gid,
        side: Side,
        kind: Kind,
        name: &str,
        type_name: &str,
        qos: Qos,
    ) -> EndpointGuard {
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
        EndpointGuard {
            core: Arc::clone(self),
            gid,
        }
    }

    /// Tells peers which endpoints this node has now; once it is stopping, that it has gone.
    pub(crate) fn announce(&self) {
        let local = lock(&self.local);
        if !self.started.load(Ordering::SeqCst) {
            return;
        }
        let mut node = NodeEntitiesInfo::new(self.ros_name.clone());
        for endpoint in local.values() {
            if endpoint.writes {
                node.add_writer(endpoint.gid.into())
            } else {
                node.add_reader(endpoint.gid.into())
            }
        }
        let nodes = if self.stopping.load(Ordering::SeqCst) {
            Vec::new()
        } else {
            vec![node]
        };
        let info = ParticipantEntitiesInfo::new(self.participant_gid().into(), nodes);
        // The lock is held: two threads must not announce in the wrong order.
        let sent = RawMessage::encode(&info).and_then(|raw| {
            self.info_writer
                .write(raw, None)
                .map_err(|error| error.to_string())
        });
        if let Err(problem) = sent {
            log::warn!(
                "node {}: cannot tell peers about its endpoints: {problem}",
                self.name
            );
        }
    }

    pub(crate) fn participant_gid(&self) -> Gid {
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
    /// True while a matched subscription may still lose something: RustDDS forgets unread messages
    /// of a publisher that has gone.
    fn stays(&self) -> bool {
        let since = self.since.elapsed();
        since < Core::LEAVE_AFTER
            || (since < Core::LEAVE_AT_LAST
                && !self
                    .writer
                    .wait_for_acknowledgments(Duration::ZERO)
                    .unwrap_or(true))
    }
}

impl Core {
    /// Time for peers to read what they have confirmed.
    const LEAVE_AFTER: Duration = Duration::from_millis(100);
    /// Time for peers to confirm.
    const LEAVE_AT_LAST: Duration = Duration::from_secs(2);

    /// Lets a writer go once its messages have arrived, in the background while the node runs.
    pub(crate) fn leave(self: &Arc<Self>, writer: RawWriter, guard: EndpointGuard) {
        let leaving = Leaving {
            since: Instant::now(),
            writer,
            _guard: guard,
        };
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

fn gid_of(writer: &RawWriter) -> Option<Gid> {
    Some(writer.guid().into())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Reads,
    Writes,
}

fn make_topic(
    participant: &DomainParticipant,
    name: String,
    type_name: String,
    qos: &QosPolicies,
) -> RosResult<Topic> {
    let doing = format!("create DDS topic {name}");
    participant
        .create_topic(name, type_name, qos, TopicKind::NoKey)
        .map_err(|error| dds(doing, error))
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
