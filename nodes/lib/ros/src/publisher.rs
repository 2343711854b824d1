//! Publishers: typed and raw.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

use cromosim_msgs::RosMessage;
use rustdds::Timestamp;
use rustdds::dds::WriteError;
use serde::Serialize;

use crate::core::{Core, EndpointGuard};
use crate::error::{RosError, RosResult, dds};
use crate::names::Kind;
use crate::qos::Qos;
use crate::raw::{Gid, RawMessage, RawWriter};

/// Publishes messages of one type whose bytes are given: for replaying bags.
///
/// Dropped, it stays in the background until its last messages have arrived (at most 2 s).
pub struct RawPublisher {
    /// None only while it is dropped.
    endpoint: Option<(RawWriter, EndpointGuard)>,
    gid: Gid,
    core: Arc<Core>,
    topic: String,
    type_name: String,
    qos: Qos,
}

impl RawPublisher {
    pub(crate) fn new(
        core: &Arc<Core>,
        topic: String,
        type_name: &str,
        qos: Qos,
    ) -> RosResult<Self> {
        let (writer, guard) = core.writer(Kind::Topic, &topic, type_name, qos)?;
        let (gid, core) = (guard.gid, Arc::clone(core));
        Ok(Self {
            endpoint: Some((writer, guard)),
            gid,
            core,
            topic,
            type_name: type_name.to_owned(),
            qos,
        })
    }

    /// Sends a message now. Its source stamp is the system clock's.
    ///
    /// # Errors
    /// [`RosError::WindowFull`] where reliable subscriptions are too far behind;
    /// [`RosError::Encoding`] where the bytes are not little-endian CDR, the only encoding that is
    /// sent.
    pub fn publish(&self, message: RawMessage) -> RosResult<()> {
        if !message.is_little_endian_cdr() {
            return Err(self.encoding_error("expected little-endian CDR (00 01)".into()));
        }
        let Some((writer, _)) = &self.endpoint else {
            return Ok(());
        };
        writer
            .write(message, Some(Timestamp::now()))
            .map_err(|error| match error {
                WriteError::WouldBlock { .. } => RosError::WindowFull {
                    topic: self.topic.clone(),
                },
                other => dds(format!("publish {}", self.topic), other),
            })
    }

    /// The topic, absolute, after remapping.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// `package/msg/Name`.
    pub fn type_name(&self) -> &str {
        &self.type_name
    }

    /// What is offered, after `qos_overrides`.
    pub fn qos(&self) -> Qos {
        self.qos
    }

    /// Its DDS identity.
    pub fn gid(&self) -> Gid {
        self.gid
    }

    /// How many subscriptions are matched now.
    pub fn subscription_count(&self) -> usize {
        self.core.graph.matched(self.gid)
    }

    /// Waits for `count` matched subscriptions, and until 300 ms after the last match, for peers
    /// match a little later than this side and would lose the first messages. False where `timeout`
    /// was over or the process is ending.
    pub fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> bool {
        let matched = self
            .core
            .graph
            .wait_until(timeout, || self.subscription_count() >= count);
        if matched {
            self.core.graph.settle(self.gid);
        }
        matched
    }

    /// Waits until the peers of every matched reliable subscription have confirmed every message;
    /// their programs may not have taken them yet. False where `timeout` was over.
    pub fn wait_for_acknowledgments(&self, timeout: Duration) -> bool {
        self.endpoint
            .as_ref()
            .is_none_or(|(writer, _)| writer.wait_for_acknowledgments(timeout).unwrap_or(false))
    }

    fn encoding_error(&self, problem: String) -> RosError {
        RosError::Encoding {
            place: self.topic.clone(),
            action: "encode",
            type_name: self.type_name.clone(),
            problem,
        }
    }
}

impl Drop for RawPublisher {
    fn drop(&mut self) {
        if let Some((writer, guard)) = self.endpoint.take() {
            self.core.leave(writer, guard);
        }
    }
}

/// Publishes messages of type `M`.
pub struct Publisher<M> {
    raw: RawPublisher,
    message: PhantomData<fn(&M)>,
}

impl<M: RosMessage> Publisher<M> {
    pub(crate) fn new(core: &Arc<Core>, topic: String, qos: Qos) -> RosResult<Self> {
        Ok(Self {
            raw: RawPublisher::new(core, topic, M::TYPE_NAME, qos)?,
            message: PhantomData,
        })
    }
}

impl<M: Serialize> Publisher<M> {
    /// Sends a message now. Its source stamp is the system clock's.
    ///
    /// # Errors
    /// [`RosError::WindowFull`] where reliable subscriptions are too far behind.
    pub fn publish(&self, message: &M) -> RosResult<()> {
        self.raw.publish(
            RawMessage::encode(message).map_err(|problem| self.raw.encoding_error(problem))?,
        )
    }
}

impl<M> std::ops::Deref for Publisher<M> {
    type Target = RawPublisher;

    fn deref(&self) -> &RawPublisher {
        &self.raw
    }
}
