//! Subscriptions: typed and raw, by waiting or by callback.

use std::marker::PhantomData;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cromosim_msgs::RosMessage;
use serde::de::DeserializeOwned;

use crate::core::{Core, EndpointGuard};
use crate::error::{RosError, RosResult, dds};
use crate::names::Kind;
use crate::qos::Qos;
use crate::raw::{Gid, RawMessage, Received};
use crate::reader::Reader;
use crate::shutdown::Shutdown;
use crate::wake::Bell;

/// Receives messages of one type as bytes: for recorders.
pub struct RawSubscription {
    reader: Reader,
    // Behind the reader, which must go first.
    _guard: EndpointGuard,
    core: Arc<Core>,
    topic: String,
    type_name: String,
    qos: Qos,
}

impl RawSubscription {
    pub(crate) fn new(
        core: &Arc<Core>,
        topic: String,
        type_name: &str,
        qos: Qos,
    ) -> RosResult<Self> {
        let bell = Bell::new();
        core.shutdown.ring_at_request(&bell);
        let (reader, guard) = core.reader(Kind::Topic, &topic, type_name, qos, bell)?;
        Ok(Self {
            reader,
            _guard: guard,
            core: Arc::clone(core),
            topic,
            type_name: type_name.to_owned(),
            qos,
        })
    }

    /// The next message, without waiting. Where there is none, the bell rings at the next one.
    ///
    /// # Errors
    /// Where DDS fails on one message; the next call goes on behind it.
    pub fn try_recv(&self) -> RosResult<Option<Received<RawMessage>>> {
        match self.reader.take() {
            Ok(sample) => Ok(sample.map(|sample| sample.received)),
            Err(problem) => Err(dds(format!("receive {}", self.topic), problem)),
        }
    }

    /// The next message, waiting for it as long as it takes; none once the process is ending.
    ///
    /// # Errors
    /// Where DDS fails on one message; the next call goes on behind it.
    pub fn recv(&self) -> RosResult<Option<Received<RawMessage>>> {
        wait_for(&self.reader.bell(), &self.core.shutdown, None, || {
            self.try_recv()
        })
    }

    /// The next message; none where `timeout` was over or the process is ending.
    ///
    /// # Errors
    /// Where DDS fails on one message; the next call goes on behind it.
    pub fn recv_timeout(&self, timeout: Duration) -> RosResult<Option<Received<RawMessage>>> {
        wait_for(
            &self.reader.bell(),
            &self.core.shutdown,
            Some(Instant::now() + timeout),
            || self.try_recv(),
        )
    }

    /// From now on arriving messages ring this bell, so that one thread can wait for several
    /// subscriptions: wait for the bell, then call `try_recv` of each until it has none. A shutdown
    /// rings it too.
    pub fn ring(&self, bell: Arc<Bell>) {
        self.core.shutdown.ring_at_request(&bell);
        self.reader.ring(bell);
    }

    /// The topic, absolute, after remapping.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// `package/msg/Name`.
    pub fn type_name(&self) -> &str {
        &self.type_name
    }

    /// What is asked for, after `qos_overrides`.
    pub fn qos(&self) -> Qos {
        self.qos
    }

    /// Its DDS identity.
    pub fn gid(&self) -> Gid {
        self.reader.gid()
    }

    /// How many publishers are matched now.
    pub fn publisher_count(&self) -> usize {
        self.core.graph.matched(self.gid())
    }

    /// Waits for `count` matched publishers. False where `timeout` was over or the process is
    /// ending.
    pub fn wait_for_publishers(&self, count: usize, timeout: Duration) -> bool {
        self.core
            .graph
            .wait_until(timeout, || self.publisher_count() >= count)
    }

    fn decode<M: DeserializeOwned>(&self, raw: Received<RawMessage>) -> RosResult<Received<M>> {
        let message = raw.message.decode().map_err(|problem| RosError::Encoding {
            place: self.topic.clone(),
            action: "decode",
            type_name: self.type_name.clone(),
            problem,
        })?;
        Ok(Received {
            message,
            source_stamp: raw.source_stamp,
            received_stamp: raw.received_stamp,
            sequence_number: raw.sequence_number,
            publisher: raw.publisher,
        })
    }
}

fn wait_for<M>(
    bell: &Bell,
    shutdown: &Shutdown,
    deadline: Option<Instant>,
    mut take: impl FnMut() -> RosResult<Option<M>>,
) -> RosResult<Option<M>> {
    loop {
        if let Some(message) = take()? {
            return Ok(Some(message));
        }
        if shutdown.is_requested() || !bell.wait_until(deadline) {
            return Ok(None);
        }
    }
}

/// Receives messages of type `M`.
pub struct Subscription<M> {
    raw: RawSubscription,
    message: PhantomData<fn() -> M>,
}

impl<M: RosMessage> Subscription<M> {
    pub(crate) fn new(core: &Arc<Core>, topic: String, qos: Qos) -> RosResult<Self> {
        Ok(Self {
            raw: RawSubscription::new(core, topic, M::TYPE_NAME, qos)?,
            message: PhantomData,
        })
    }

    /// The next message, without waiting. Where there is none, the bell rings at the next one.
    ///
    /// # Errors
    /// Where DDS fails on one message or its bytes are not an `M`; the next call goes on behind it.
    pub fn try_recv(&self) -> RosResult<Option<Received<M>>> {
        self.raw
            .try_recv()?
            .map(|raw| self.raw.decode(raw))
            .transpose()
    }

    /// The next message, waiting for it as long as it takes; none once the process is ending.
    ///
    /// # Errors
    /// Where DDS fails on one message or its bytes are not an `M`; the next call goes on behind it.
    pub fn recv(&self) -> RosResult<Option<Received<M>>> {
        wait_for(
            &self.raw.reader.bell(),
            &self.raw.core.shutdown,
            None,
            || self.try_recv(),
        )
    }

    /// The next message; none where `timeout` was over or the process is ending.
    ///
    /// # Errors
    /// Where DDS fails on one message or its bytes are not an `M`; the next call goes on behind it.
    pub fn recv_timeout(&self, timeout: Duration) -> RosResult<Option<Received<M>>> {
        wait_for(
            &self.raw.reader.bell(),
            &self.raw.core.shutdown,
            Some(Instant::now() + timeout),
            || self.try_recv(),
        )
    }

    /// See [`RawSubscription::ring`].
    pub fn ring(&self, bell: Arc<Bell>) {
        self.raw.ring(bell);
    }

    /// Calls `callback` for every message, on a thread of its own, until the result is dropped.
    pub(crate) fn run(
        self,
        mut callback: impl FnMut(Received<M>) + Send + 'static,
    ) -> RosResult<Listening>
    where
        M: 'static,
    {
        let stop = Shutdown::new();
        let bell = Bell::new();
        stop.ring_at_request(&bell);
        let subscription = self;
        subscription.ring(Arc::clone(&bell));
        let topic = subscription.topic().to_owned();
        let ended = stop.clone();
        let thread = std::thread::Builder::new()
            .name(topic.clone())
            .spawn(move || {
                let over = || ended.is_requested() || subscription.raw.core.shutdown.is_requested();
                while !over() {
                    match subscription.try_recv() {
                        Ok(Some(received)) => callback(received),
                        Ok(None) => drop(bell.wait(None)),
                        Err(error) => log::warn!("{error}"),
                    }
                }
            })
            .map_err(|error| dds(format!("start a thread for {topic}"), error))?;
        Ok(Listening {
            stop,
            thread: Some(thread),
        })
    }
}

impl<M> std::ops::Deref for Subscription<M> {
    type Target = RawSubscription;

    fn deref(&self) -> &RawSubscription {
        &self.raw
    }
}

/// A callback that is called for every message on its own thread; dropping it ends the
/// subscription.
pub struct Listening {
    stop: Shutdown,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Listening {
    fn drop(&mut self) {
        self.stop.request();
        if let Some(thread) = self.thread.take()
            && thread.thread().id() != std::thread::current().id()
            && thread.join().is_err()
        {
            log::error!("the callback of a subscription panicked");
        }
    }
}
