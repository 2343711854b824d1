//! Who is there: nodes, topics, endpoints, and which of them are matched.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use rustdds::dds::statusevents::DomainParticipantStatusEvent as Event;

use crate::names::NodeName;
use crate::participant_info::{NodeInfo, ParticipantInfo};
use crate::qos::Qos;
use crate::raw::Gid;
use crate::shutdown::Shutdown;
use crate::wake::{Bell, lock};

/// A publisher or a subscription, of this node or of a peer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// The topic, absolute.
    pub topic: String,
    /// `package/msg/Name`.
    pub type_name: String,
    /// The node, as soon as it is known: peers tell it some milliseconds after the endpoint.
    pub node: Option<NodeName>,
    /// Its DDS identity.
    pub gid: Gid,
    /// What it offers or asks for. DDS does not tell the history of peers: it reads as keep last 0.
    pub qos: Qos,
    pub(crate) is_topic: bool,
    pub(crate) writes: bool,
}

/// A topic with its endpoints counted, this node's own included.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicInfo {
    /// The topic, absolute.
    pub name: String,
    /// `package/msg/Name`; a topic with two types (somebody's mistake) stands twice.
    pub type_name: String,
    /// How many publishers it has.
    pub publishers: usize,
    /// How many subscriptions it has.
    pub subscriptions: usize,
}

pub(crate) struct Graph {
    state: Mutex<State>,
    changed: Condvar,
    shutdown: Shutdown,
    participant: rustdds::GUID,
    /// Several threads take events from RustDDS; they must not handle them in another order.
    taking: Mutex<()>,
}

#[derive(Default)]
struct State {
    generation: u64,
    /// Peers matched to each local endpoint, and when the last one came.
    matched: BTreeMap<Gid, (BTreeSet<Gid>, Instant)>,
    /// Local endpoints that discovery has told RustDDS's event loop of.
    detected: BTreeSet<Gid>,
    /// What each participant says about its nodes.
    participants: BTreeMap<Gid, Vec<NodeInfo>>,
    bells: Vec<Weak<Bell>>,
}

impl Graph {
    pub(crate) fn new(participant: rustdds::GUID, shutdown: Shutdown) -> Self {
        Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            shutdown,
            participant,
            taking: Mutex::default(),
        }
    }

    /// Handles events until there is no next one.
    pub(crate) fn handle_each(&self, mut next: impl FnMut() -> Option<Event>) {
        let _taking = lock(&self.taking);
        while let Some(event) = next() {
            self.handle(&event);
        }
    }

    fn handle(&self, event: &Event) {
        let mut state = lock(&self.state);
        match event {
            Event::RemoteReaderMatched {
                local_writer,
                remote_reader,
            } => state.add_match(*local_writer, *remote_reader),
            Event::RemoteWriterMatched {
                local_reader,
                remote_writer,
            } => state.add_match(*local_reader, *remote_writer),
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                let gid = Gid::from(*guid);
                for (peers, _) in state.matched.values_mut() {
                    peers.remove(&gid);
                }
            }
            Event::ParticipantLost { id, .. } => state.lose_participant(id.as_ref()),
            Event::RemoteReaderQosIncompatible {
                local_writer,
                remote_reader,
                ..
            } => {
                log::warn!(
                    "publisher {:?}: subscription {:?} asks for more than it offers",
                    Gid::from(*local_writer),
                    Gid::from(*remote_reader)
                );
            }
            Event::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                ..
            } => {
                log::warn!(
                    "subscription {:?}: publisher {:?} offers less than it asks for",
                    Gid::from(*local_reader),
                    Gid::from(*remote_writer)
                );
            }
            Event::ReaderDetected { reader: endpoint }
            | Event::WriterDetected { writer: endpoint } => {
                if endpoint.guid.prefix == self.participant.prefix {
                    state.detected.insert(endpoint.guid.into());
                }
            }
            Event::ParticipantDiscovered { .. } => {}
            _ => return,
        }
        self.bump(state);
    }

    pub(crate) fn handle_info(&self, info: ParticipantInfo) {
        let mut state = lock(&self.state);
        state.participants.insert(info.participant, info.nodes);
        self.bump(state);
    }

    pub(crate) fn forget_local(&self, gid: Gid) {
        let mut state = lock(&self.state);
        state.matched.remove(&gid);
        state.detected.remove(&gid);
    }

    /// Wakes waiting threads although nothing changed, so that they see a shutdown.
    pub(crate) fn wake(&self) {
        self.bump(lock(&self.state));
    }

    fn bump(&self, mut state: std::sync::MutexGuard<'_, State>) {
        state.generation += 1;
        state
            .bells
            .retain(|bell| bell.upgrade().inspect(|bell| bell.ring()).is_some());
        drop(state);
        self.changed.notify_all();
    }

    pub(crate) fn ring_at_change(&self, bell: &Arc<Bell>) {
        lock(&self.state).bells.push(Arc::downgrade(bell));
    }

    pub(crate) fn generation(&self) -> u64 {
        lock(&self.state).generation
    }

    pub(crate) fn matched(&self, local: Gid) -> usize {
        lock(&self.state)
            .matched
            .get(&local)
            .map_or(0, |(peers, _)| peers.len())
    }

    pub(crate) fn is_detected(&self, local: Gid) -> bool {
        lock(&self.state).detected.contains(&local)
    }

    pub(crate) fn is_matched(&self, local: Gid, peer: Gid) -> bool {
        let state = lock(&self.state);
        let matched = state.matched.get(&local);
        matched.is_some_and(|(peers, _)| peers.contains(&peer))
    }

    /// Sleeps until the peers of a local endpoint have matched it too. They do so some milliseconds
    /// after it has matched them; where an announcement was lost on its way, once it has been sent
    /// again, which took 100 to 200 ms as a rule and 350 at most (CycloneDDS with a receive buffer
    /// of 3 kB, busy cores). What is sent in between is not for them.
    pub(crate) fn settle(&self, local: Gid) {
        const SETTLED: Duration = Duration::from_millis(300);
        let since = lock(&self.state)
            .matched
            .get(&local)
            .map(|(_, since)| *since);
        if let Some(since) = since {
            std::thread::sleep(SETTLED.saturating_sub(since.elapsed()));
        }
    }

    /// Waits until `done`, for at most `timeout`. False where the time was over or the process is
    /// ending.
    pub(crate) fn wait_until(&self, timeout: Duration, mut done: impl FnMut() -> bool) -> bool {
        let deadline = Instant::now() + timeout;
        loop {
            let seen = self.generation();
            if done() {
                return true;
            }
            // Only after the generation was read: a request from here on changes it, and one before
            // would change nothing any more.
            if self.shutdown.is_requested() {
                return false;
            }
            let mut state = lock(&self.state);
            while state.generation == seen {
                let left = deadline.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return false;
                }
                state = self
                    .changed
                    .wait_timeout(state, left)
                    .unwrap_or_else(PoisonError::into_inner)
                    .0;
            }
        }
    }

    pub(crate) fn node_of(&self, endpoint: Gid) -> Option<NodeName> {
        let state = lock(&self.state);
        let mut nodes = state.participants.values().flatten();
        let node = nodes
            .find(|node| node.readers.contains(&endpoint) || node.writers.contains(&endpoint))?;
        NodeName::new(&node.namespace, &node.name).ok()
    }

    pub(crate) fn nodes(&self) -> BTreeSet<NodeName> {
        let state = lock(&self.state);
        state
            .participants
            .values()
            .flatten()
            .filter_map(|node| NodeName::new(&node.namespace, &node.name).ok())
            .collect()
    }
}

impl State {
    fn add_match(&mut self, local: rustdds::GUID, remote: rustdds::GUID) {
        let (peers, since) = self
            .matched
            .entry(local.into())
            .or_insert_with(|| (BTreeSet::new(), Instant::now()));
        peers.insert(remote.into());
        *since = Instant::now();
    }

    fn lose_participant(&mut self, prefix: &[u8]) {
        let lost = |gid: &Gid| gid.bytes().starts_with(prefix);
        self.participants.retain(|gid, _| !lost(gid));
        self.matched
            .values_mut()
            .for_each(|(peers, _)| peers.retain(|gid| !lost(gid)));
    }
}

/// Counts endpoints by topic and type.
pub(crate) fn count_topics(endpoints: &[Endpoint]) -> Vec<TopicInfo> {
    let mut counts: BTreeMap<(&str, &str), (usize, usize)> = BTreeMap::new();
    for endpoint in endpoints.iter().filter(|endpoint| endpoint.is_topic) {
        let (publishers, subscriptions) = counts
            .entry((&endpoint.topic, &endpoint.type_name))
            .or_default();
        *(if endpoint.writes {
            publishers
        } else {
            subscriptions
        }) += 1;
    }
    counts
        .into_iter()
        .map(
            |((name, type_name), (publishers, subscriptions))| TopicInfo {
                name: name.to_owned(),
                type_name: type_name.to_owned(),
                publishers,
                subscriptions,
            },
        )
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_wait_that_begins_after_the_shutdown_ends_too() {
        let shutdown = Shutdown::new();
        let graph = Graph::new(rustdds::GUID::GUID_UNKNOWN, shutdown.clone());
        shutdown.request();
        // The node's thread has seen the request, and will not wake anybody again.
        graph.wake();
        let (ended, end) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            ended.send(graph.wait_until(Duration::from_secs(3600), || false))
        });
        assert!(!end.recv_timeout(Duration::from_secs(20)).unwrap());
    }
}
