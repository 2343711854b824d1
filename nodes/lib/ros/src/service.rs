//! Services: requests and responses on two topics, told apart by the identity of the request.
//!
//! The identity travels in the DDS sample header ("enhanced" mapping of RPC over DDS), as Fast DDS
//! does it for ROS 2. On RustDDS: only ros2-client's `Node` makes servers and clients, and its
//! announcement would contradict ours (see the crate's table). With
//! `RMW_IMPLEMENTATION=rmw_cyclonedds_cpp` it travels in the first 16 bytes of the payload, as
//! Cyclone DDS does it for ROS 2.

use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rustdds::dds::WriteError;
use rustdds::rpc::SampleIdentity;
use rustdds::with_key::WriteOptionsBuilder;
use rustdds::{GUID, SequenceNumber, Timestamp};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::core::{Core, EndpointGuard};
use crate::error::{RosError, RosResult, dds};
use crate::names::Kind;
use crate::qos::Qos;
use crate::raw::{RawMessage, RawWriter};
use crate::reader::{Reader, Sample};
use crate::wake::{Bell, lock};

/// Where the identity of a request travels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mapping {
    Header,
    Payload,
}

impl Mapping {
    fn from_env() -> Self {
        match std::env::var("RMW_IMPLEMENTATION") {
            Ok(rmw) if rmw == "rmw_cyclonedds_cpp" => Self::Payload,
            _ => Self::Header,
        }
    }
}

/// Cyclone's 16 bytes before the fields: the second half of the client's identity, then the count
/// of its requests.
#[derive(Serialize, serde::Deserialize)]
struct PayloadHeader<B> {
    client_half: [u8; 8],
    count_high: i32,
    count_low: u32,
    body: B,
}

impl<B> PayloadHeader<B> {
    fn new(identity: SampleIdentity, body: B) -> Self {
        let mut client_half = [0; 8];
        client_half.copy_from_slice(&identity.writer_guid.to_bytes()[8..]);
        Self {
            client_half,
            count_high: identity.sequence_number.high(),
            count_low: identity.sequence_number.low(),
            body,
        }
    }

    fn identity(&self, first_half: GUID) -> SampleIdentity {
        let mut bytes = first_half.to_bytes();
        bytes[8..].copy_from_slice(&self.client_half);
        SampleIdentity {
            writer_guid: GUID::from_bytes(bytes),
            sequence_number: SequenceNumber::from_high_low(self.count_high, self.count_low),
        }
    }
}

/// A service offered by this node, answered on the node's own thread; dropping it ends the offer.
pub struct ServiceServer {
    alive: Arc<AtomicBool>,
    core: Arc<Core>,
    name: String,
}

impl ServiceServer {
    /// The service, absolute.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Drop for ServiceServer {
    fn drop(&mut self) {
        self.alive.store(false, Ordering::SeqCst);
        self.core.bell.ring();
    }
}

struct Serving {
    requests: Reader,
    responses: RawWriter,
    _guards: [EndpointGuard; 2],
    mapping: Mapping,
    name: String,
}

pub(crate) fn serve<Q, A>(
    core: &Arc<Core>,
    name: String,
    type_name: &str,
    mut handler: impl FnMut(Q) -> A + Send + 'static,
) -> RosResult<ServiceServer>
where
    Q: DeserializeOwned,
    A: Serialize,
{
    let (requests, requests_guard) = core.reader(
        Kind::Request,
        &name,
        &format!("{type_name}_Request"),
        Qos::services(),
        Arc::clone(&core.bell),
    )?;
    let (responses, responses_guard) = core.writer(
        Kind::Response,
        &name,
        &format!("{type_name}_Response"),
        Qos::services(),
    )?;
    let serving = Serving {
        requests,
        responses,
        _guards: [requests_guard, responses_guard],
        mapping: Mapping::from_env(),
        name: name.clone(),
    };
    let alive = Arc::new(AtomicBool::new(true));
    let goes_on = Arc::clone(&alive);
    core.add_worker(Box::new(move || {
        while goes_on.load(Ordering::SeqCst) {
            match serving.requests.take() {
                Ok(None) => return true,
                Ok(Some(sample)) => {
                    if let Err(problem) = serving.answer(&sample, &mut handler) {
                        log::warn!("service {}: {problem}", serving.name);
                    }
                }
                Err(problem) => log::warn!("service {}: {problem}", serving.name),
            }
        }
        false
    }));
    Ok(ServiceServer {
        alive,
        core: Arc::clone(core),
        name,
    })
}

impl Serving {
    fn answer<Q: DeserializeOwned, A: Serialize>(
        &self,
        sample: &Sample,
        handler: &mut impl FnMut(Q) -> A,
    ) -> Result<(), String> {
        let message = &sample.received.message;
        let (identity, response) = match self.mapping {
            Mapping::Header => {
                let response = RawMessage::encode(&handler(message.decode()?))?;
                (request_identity(sample), response)
            }
            Mapping::Payload => {
                let request: PayloadHeader<Q> = message.decode()?;
                let identity = request.identity(sample.identity.writer_guid);
                (
                    identity,
                    RawMessage::encode(&PayloadHeader::new(identity, handler(request.body)))?,
                )
            }
        };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(identity)
            .build();
        self.responses
            .write_with_options(response, options)
            .map(|_| ())
            .map_err(|error| error.to_string())
    }
}

/// Who asked. Fast DDS names the reader of its answers as related identity and leaves the count
/// open.
fn request_identity(sample: &Sample) -> SampleIdentity {
    let Some(related) = sample.related else {
        return sample.identity;
    };
    let count = related.sequence_number;
    let known = count != SequenceNumber::UNKNOWN && i64::from(count) > 0;
    SampleIdentity {
        writer_guid: related.writer_guid,
        sequence_number: if known {
            count
        } else {
            sample.identity.sequence_number
        },
    }
}

/// Calls a service of another node.
pub struct ServiceClient<Q, A> {
    requests: RawWriter,
    request_guard: EndpointGuard,
    responses: Reader,
    _response_guard: EndpointGuard,
    core: Arc<Core>,
    mapping: Mapping,
    count: AtomicI64,
    /// One call at a time: an answer that another call took would be lost.
    calling: Mutex<()>,
    name: String,
    type_name: String,
    types: PhantomData<fn(&Q) -> A>,
}

impl<Q: Serialize, A: DeserializeOwned> ServiceClient<Q, A> {
    pub(crate) fn new(core: &Arc<Core>, name: String, type_name: &str) -> RosResult<Self> {
        let (requests, request_guard) = core.writer(
            Kind::Request,
            &name,
            &format!("{type_name}_Request"),
            Qos::services(),
        )?;
        let bell = Bell::new();
        core.shutdown.ring_at_request(&bell);
        core.graph.ring_at_change(&bell);
        let (responses, response_guard) = core.reader(
            Kind::Response,
            &name,
            &format!("{type_name}_Response"),
            Qos::services(),
            bell,
        )?;
        Ok(Self {
            requests,
            request_guard,
            responses,
            _response_guard: response_guard,
            core: Arc::clone(core),
            mapping: Mapping::from_env(),
            count: AtomicI64::new(0),
            calling: Mutex::default(),
            name,
            type_name: type_name.to_owned(),
            types: PhantomData,
        })
    }

    /// True where a server reads requests and sends answers.
    pub fn is_available(&self) -> bool {
        self.core.graph.matched(self.request_guard.gid) > 0
            && self.core.graph.matched(self.responses.gid()) > 0
    }

    /// Waits for a server. False where `timeout` was over or the process is ending.
    pub fn wait_for_service(&self, timeout: Duration) -> bool {
        self.core.graph.wait_until(timeout, || self.is_available())
    }

    /// Waits for a server, asks, and waits for its answer, `timeout` for both together.
    ///
    /// # Errors
    /// [`RosError::ServiceTimeout`] where no server is there or it does not answer.
    pub fn call(&self, request: &Q, timeout: Duration) -> RosResult<A> {
        let _one_at_a_time = lock(&self.calling);
        let start = Instant::now();
        let late = || RosError::ServiceTimeout {
            service: self.name.clone(),
            waited: timeout,
        };
        if !self.wait_for_service(timeout) {
            return Err(late());
        }
        // The server's answers must find this client.
        self.core.graph.settle(self.responses.gid());
        self.core.graph.settle(self.request_guard.gid);
        let asked = self.send(request)?;
        loop {
            let sample = self
                .responses
                .take()
                .map_err(|problem| dds(format!("receive from service {}", self.name), problem))?;
            if let Some(sample) = sample {
                match self.answer_to(asked, &sample) {
                    Some(answer) => return answer,
                    None => continue,
                }
            }
            if self.core.shutdown.is_requested() {
                return Err(RosError::Interrupted {
                    doing: format!("service {}", self.name),
                });
            }
            if !self.responses.bell().wait_until(Some(start + timeout)) {
                return Err(late());
            }
        }
    }

    fn send(&self, request: &Q) -> RosResult<SampleIdentity> {
        let builder = WriteOptionsBuilder::new().source_timestamp(Timestamp::now());
        let written = match self.mapping {
            Mapping::Header => {
                let raw = RawMessage::encode(request)
                    .map_err(|problem| self.encoding("encode", problem))?;
                self.requests.write_with_options(raw, builder.build())
            }
            Mapping::Payload => {
                let count = SequenceNumber::new(self.count.fetch_add(1, Ordering::SeqCst) + 1);
                use rustdds::RTPSEntity;
                let identity = SampleIdentity {
                    writer_guid: self.requests.guid(),
                    sequence_number: count,
                };
                let raw = RawMessage::encode(&PayloadHeader::new(identity, request))
                    .map_err(|problem| self.encoding("encode", problem))?;
                self.requests
                    .write_with_options(raw, builder.related_sample_identity(identity).build())
                    .map(|_| identity)
            }
        };
        written.map_err(|error| match error {
            WriteError::WouldBlock { .. } => RosError::WindowFull {
                topic: self.name.clone(),
            },
            other => dds(format!("call service {}", self.name), other),
        })
    }

    /// The answer, where the sample is one to this very request.
    fn answer_to(&self, asked: SampleIdentity, sample: &Sample) -> Option<RosResult<A>> {
        let message = &sample.received.message;
        match self.mapping {
            Mapping::Header if sample.related != Some(asked) => None,
            Mapping::Header => Some(
                message
                    .decode()
                    .map_err(|problem| self.encoding("decode", problem)),
            ),
            Mapping::Payload => match message.decode::<PayloadHeader<A>>() {
                Ok(answer) if answer.identity(asked.writer_guid) == asked => Some(Ok(answer.body)),
                Ok(_) => None,
                Err(problem) => Some(Err(self.encoding("decode", problem))),
            },
        }
    }

    fn encoding(&self, action: &'static str, problem: String) -> RosError {
        RosError::Encoding {
            place: self.name.clone(),
            action,
            type_name: self.type_name.clone(),
            problem,
        }
    }

    /// The service, absolute.
    pub fn name(&self) -> &str {
        &self.name
    }
}
