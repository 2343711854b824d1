//! A node: its name, its thread, and all that it makes.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use cromosim_msgs::rosgraph_msgs::Clock as ClockMessage;
use cromosim_msgs::{RosMessage, RosService};
use cromosim_spatial::Stamp;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::args::RosArgs;
use crate::clock::Clock;
use crate::core::Core;
use crate::error::RosResult;
use crate::graph::{Endpoint, TopicInfo, count_topics};
use crate::logging::Rosout;
use crate::names::{NodeName, ros_type_name, topic_from_dds};
use crate::node_options::NodeOptions;
use crate::parameter::{Parameters, USE_SIM_TIME, serve_parameters};
use crate::publisher::{Publisher, RawPublisher};
use crate::qos::Qos;
use crate::raw::{Gid, Received};
use crate::service::{ServiceClient, ServiceServer, serve};
use crate::shutdown::Shutdown;
use crate::spin::spawn_thread;
use crate::subscription::{Listening, RawSubscription, Subscription};
use crate::wake::{Bell, lock};

/// A running ROS 2 node. Cloning shares it; with the last clone its thread ends and peers are told.
///
/// One node is one DDS participant.
#[derive(Clone)]
pub struct Node {
    running: Arc<Running>,
}

struct Running {
    core: Arc<Core>,
    parameters: Parameters,
    args: RosArgs,
    // Both keep endpoints alive.
    _services: Vec<ServiceServer>,
    _rosout: Option<Arc<Rosout>>,
    thread: Option<JoinHandle<()>>,
}

impl Node {
    /// Starts a node.
    ///
    /// # Errors
    /// Where DDS finds no network or no port.
    pub fn start(options: NodeOptions) -> RosResult<Self> {
        let NodeOptions {
            name,
            parameters,
            network,
            security,
            shutdown,
            args,
            parameter_services,
        } = options;
        let clock = Clock::new(
            parameters.get(USE_SIM_TIME).unwrap_or(false),
            shutdown.clone(),
        );
        let core = Arc::new(Core::new(
            name,
            network.participant(&security)?,
            clock,
            shutdown,
        )?);
        let thread = spawn_thread(&core, &parameters)?;
        let services = if parameter_services {
            serve_parameters(&core, &parameters)?
        } else {
            Vec::new()
        };
        let rosout = args.rosout.then(|| Rosout::start(&core)).transpose()?;
        core.started.store(true, Ordering::SeqCst);
        core.announce();
        Ok(Self {
            running: Arc::new(Running {
                core,
                parameters,
                args,
                _services: services,
                _rosout: rosout,
                thread: Some(thread),
            }),
        })
    }

    fn core(&self) -> &Arc<Core> {
        &self.running.core
    }

    /// Namespace and name, after remapping.
    pub fn name(&self) -> &NodeName {
        &self.core().name
    }

    /// As declared, with the values that files, command line and services gave them.
    pub fn parameters(&self) -> &Parameters {
        &self.running.parameters
    }

    /// The clock: the system's or, with `use_sim_time`, that of `/clock`.
    pub fn clock(&self) -> &Clock {
        &self.core().clock
    }

    /// Now, by [`Node::clock`].
    pub fn now(&self) -> Stamp {
        self.clock().now()
    }

    /// What ends the node.
    pub fn shutdown(&self) -> &Shutdown {
        &self.core().shutdown
    }

    /// The absolute name of a topic or service, after remapping.
    ///
    /// # Errors
    /// Where the name breaks ROS 2's rules.
    pub fn resolve(&self, name: &str) -> RosResult<String> {
        self.running.args.resolve(self.name(), name)
    }

    fn topic(&self, topic: &str, side: &str, qos: Qos) -> RosResult<(String, Qos)> {
        let topic = self.resolve(topic)?;
        let qos = self.running.parameters.overridden(&topic, side, qos)?;
        Ok((topic, qos))
    }

    /// Publishes messages of type `M`. The preset `qos` yields to
    /// `qos_overrides./TOPIC.publisher.*` parameters.
    ///
    /// # Errors
    /// Where the name is wrong or DDS refuses.
    pub fn publisher<M: RosMessage>(&self, topic: &str, qos: Qos) -> RosResult<Publisher<M>> {
        let (topic, qos) = self.topic(topic, "publisher", qos)?;
        Publisher::new(self.core(), topic, qos)
    }

    /// Publishes messages of any type (`package/msg/Name`) from their bytes.
    ///
    /// # Errors
    /// Where a name is wrong or DDS refuses.
    pub fn raw_publisher(&self, topic: &str, type_name: &str, qos: Qos) -> RosResult<RawPublisher> {
        let (topic, qos) = self.topic(topic, "publisher", qos)?;
        RawPublisher::new(self.core(), topic, type_name, qos)
    }

    /// Receives messages of type `M`. The preset `qos` yields to
    /// `qos_overrides./TOPIC.subscription.*` parameters.
    ///
    /// # Errors
    /// Where the name is wrong or DDS refuses.
    pub fn subscription<M: RosMessage>(&self, topic: &str, qos: Qos) -> RosResult<Subscription<M>> {
        let (topic, qos) = self.topic(topic, "subscription", qos)?;
        Subscription::new(self.core(), topic, qos)
    }

    /// Receives messages of any type (`package/msg/Name`) as bytes.
    ///
    /// # Errors
    /// Where a name is wrong or DDS refuses.
    pub fn raw_subscription(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
    ) -> RosResult<RawSubscription> {
        let (topic, qos) = self.topic(topic, "subscription", qos)?;
        RawSubscription::new(self.core(), topic, type_name, qos)
    }

    /// Calls `callback` for every message, on a thread of its own, until the result is dropped or
    /// the process ends.
    ///
    /// # Errors
    /// Where the name is wrong or DDS refuses.
    pub fn listen<M: RosMessage + 'static>(
        &self,
        topic: &str,
        qos: Qos,
        callback: impl FnMut(Received<M>) + Send + 'static,
    ) -> RosResult<Listening> {
        self.subscription(topic, qos)?.run(callback)
    }

    /// Offers a service. The handler runs on the node's thread, which answers the parameter
    /// services too: it should be short.
    ///
    /// # Errors
    /// Where the name is wrong or DDS refuses.
    pub fn serve<S: RosService>(
        &self,
        name: &str,
        handler: impl FnMut(S::Request) -> S::Response + Send + 'static,
    ) -> RosResult<ServiceServer> {
        self.serve_as(name, S::TYPE_NAME, handler)
    }

    /// Offers a service of any serde types (`package/srv/Name`).
    ///
    /// # Errors
    /// Where a name is wrong or DDS refuses.
    pub fn serve_as<Q, A>(
        &self,
        name: &str,
        type_name: &str,
        handler: impl FnMut(Q) -> A + Send + 'static,
    ) -> RosResult<ServiceServer>
    where
        Q: DeserializeOwned,
        A: Serialize,
    {
        serve(self.core(), self.resolve(name)?, type_name, handler)
    }

    /// A client of a service.
    ///
    /// # Errors
    /// Where the name is wrong or DDS refuses.
    pub fn client<S: RosService>(
        &self,
        name: &str,
    ) -> RosResult<ServiceClient<S::Request, S::Response>> {
        self.client_as(name, S::TYPE_NAME)
    }

    /// A client of a service of any serde types (`package/srv/Name`).
    ///
    /// # Errors
    /// Where a name is wrong or DDS refuses.
    pub fn client_as<Q: Serialize, A: DeserializeOwned>(
        &self,
        name: &str,
        type_name: &str,
    ) -> RosResult<ServiceClient<Q, A>> {
        ServiceClient::new(self.core(), self.resolve(name)?, type_name)
    }

    /// How many endpoints of other nodes an endpoint of this node is matched to.
    pub fn matched(&self, endpoint: Gid) -> usize {
        self.core().graph.matched(endpoint)
    }

    /// Every node that can be seen, this one included.
    pub fn nodes(&self) -> BTreeSet<NodeName> {
        let mut nodes = self.core().graph.nodes();
        nodes.insert(self.name().clone());
        nodes
    }

    /// Every topic that can be seen, with its type and the counts of its endpoints.
    pub fn topics(&self) -> Vec<TopicInfo> {
        count_topics(&self.endpoints())
    }

    /// Every publisher that can be seen, this node's own included.
    pub fn publishers(&self) -> Vec<Endpoint> {
        self.endpoints()
            .into_iter()
            .filter(|endpoint| endpoint.is_topic && endpoint.writes)
            .collect()
    }

    /// Every subscription that can be seen, this node's own included.
    pub fn subscriptions(&self) -> Vec<Endpoint> {
        self.endpoints()
            .into_iter()
            .filter(|endpoint| endpoint.is_topic && !endpoint.writes)
            .collect()
    }

    fn endpoints(&self) -> Vec<Endpoint> {
        let core = self.core();
        let mut endpoints = core.local_endpoints();
        let mut add = |gid: Gid,
                       dds_topic: &str,
                       dds_type: &str,
                       qos: &rustdds::QosPolicies,
                       writes: bool| {
            let (Some(topic), Some(type_name)) =
                (topic_from_dds(dds_topic), ros_type_name(dds_type))
            else {
                return;
            };
            if !endpoints.iter().any(|known| known.gid == gid) {
                let (node, qos) = (core.graph.node_of(gid), Qos::from_dds(qos));
                endpoints.push(Endpoint {
                    topic: topic.to_owned(),
                    type_name,
                    node,
                    gid,
                    qos,
                    is_topic: true,
                    writes,
                });
            }
        };
        for writer in core.participant.discovered_writers() {
            let data = &writer.publication_topic_data;
            add(
                data.key.into(),
                &data.topic_name,
                &data.type_name,
                &data.qos(),
                true,
            );
        }
        for reader in core.participant.discovered_readers() {
            let data = &reader.subscription_topic_data;
            add(
                data.key().into(),
                data.topic_name(),
                data.type_name(),
                &data.qos(),
                false,
            );
        }
        endpoints
    }

    /// Waits until `done`, looking again whenever a node or an endpoint comes or goes. False where
    /// `timeout` was over or the process is ending.
    pub fn wait_for_graph(&self, timeout: Duration, done: impl FnMut() -> bool) -> bool {
        self.core().graph.wait_until(timeout, done)
    }

    /// Rings the bell whenever a node or an endpoint comes or goes.
    pub fn ring_at_graph_change(&self, bell: &Arc<Bell>) {
        self.core().graph.ring_at_change(bell);
    }

    /// The publisher of `/clock` for a replay.
    ///
    /// # Errors
    /// Where DDS refuses.
    pub fn clock_publisher(&self) -> RosResult<ClockPublisher> {
        Ok(ClockPublisher {
            publisher: self.publisher("/clock", Qos::clock())?,
        })
    }
}

/// Publishes `/clock`.
pub struct ClockPublisher {
    publisher: Publisher<ClockMessage>,
}

impl ClockPublisher {
    /// Tells everybody with `use_sim_time` what time it is.
    ///
    /// # Errors
    /// Where DDS refuses.
    pub fn publish(&self, now: Stamp) -> RosResult<()> {
        self.publisher.publish(&ClockMessage {
            clock: cromosim_msgs::builtin_interfaces::Time::from_nanos(now.nanos),
        })
    }

    /// The publisher itself.
    pub fn publisher(&self) -> &RawPublisher {
        &self.publisher
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.core.stopping.store(true, Ordering::SeqCst);
        self.core.bell.ring();
        // The last clone may go in a callback on the node's own thread.
        if let Some(thread) = self.thread.take()
            && thread.thread().id() != std::thread::current().id()
            && thread.join().is_err()
        {
            log::error!("the thread of node {} panicked", self.core.name);
        }
        // Work that nobody takes up any more holds the core that holds it.
        let left = std::mem::take(&mut *lock(&self.core.new_workers));
        drop(left);
        self.core.announce();
    }
}
