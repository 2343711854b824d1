//! The node's own thread.

use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::{Context, Poll};
use std::thread::JoinHandle;
use std::time::Duration;

use cromosim_msgs::RosMessage;
use cromosim_msgs::rosgraph_msgs::Clock as ClockMessage;
use futures_core::Stream;
use rustdds::StatusEvented;

use crate::core::{Core, Worker};
use crate::error::{RosError, RosResult, dds};
use crate::names::Kind;
use crate::parameter::{Parameters, USE_SIM_TIME};
use crate::participant_info::ParticipantInfo;
use crate::qos::Qos;
use crate::wake::lock;

/// Starts the node's thread: it keeps the graph, pumps subscriptions, answers services and follows
/// `/clock`.
pub(crate) fn spawn_thread(core: &Arc<Core>, parameters: &Parameters) -> RosResult<JoinHandle<()>> {
    let name = core.name.name().to_owned();
    let mut workers: Vec<Worker> = vec![discovery_worker(core)?, clock_worker(core, parameters)];
    let core = Arc::clone(core);
    std::thread::Builder::new()
        .name(name.clone())
        .spawn(move || {
            // RustDDS's own: ros2-client's Spinner reads `/clock` as a bare Time, whatever
            // `use_sim_time` says, and needs its Node.
            let listener = core.participant.status_listener();
            let mut events = pin!(listener.as_async_status_stream());
            let waker = core.bell.waker();
            loop {
                core.graph.handle_each(|| {
                    match events.as_mut().poll_next(&mut Context::from_waker(&waker)) {
                        Poll::Ready(event) => event,
                        Poll::Pending => None,
                    }
                });
                workers.append(&mut lock(&core.new_workers));
                workers.retain_mut(|worker| worker());
                if core.shutdown.is_requested() {
                    core.graph.wake();
                }
                let some_stay = core.let_go();
                if core.stopping.load(Ordering::SeqCst) && !some_stay {
                    return;
                }
                core.bell
                    .wait(some_stay.then_some(Duration::from_millis(10)));
            }
        })
        .map_err(|error| dds(format!("start the thread of node {name}"), error))
}

/// Keeps account of which node owns which endpoint.
fn discovery_worker(core: &Arc<Core>) -> RosResult<Worker> {
    let reader = core.info_reader()?;
    let core = Arc::downgrade(core);
    Ok(Box::new(move || {
        let Some(core) = core.upgrade() else {
            return false;
        };
        loop {
            match reader.take().map(|sample| {
                sample.map(|sample| sample.received.message.decode::<ParticipantInfo>())
            }) {
                Ok(None) => return true,
                Ok(Some(Ok(info))) => core.graph.handle_info(info),
                Ok(Some(Err(problem))) | Err(problem) => {
                    log::debug!("ros_discovery_info: {problem}")
                }
            }
        }
    }))
}

/// Follows `/clock` while `use_sim_time` is set.
fn clock_worker(core: &Arc<Core>, parameters: &Parameters) -> Worker {
    parameters.ring_at_change(&core.bell);
    let parameters = parameters.clone();
    let core = Arc::downgrade(core);
    let mut reader = None;
    Box::new(move || {
        let Some(core) = core.upgrade() else {
            return false;
        };
        let simulated = parameters.get(USE_SIM_TIME).unwrap_or(false);
        if simulated != core.clock.is_simulated() {
            core.clock.set_simulated(simulated);
        }
        if !simulated {
            reader = None;
            return true;
        }
        if reader.is_none() {
            let made = core.reader(
                Kind::Topic,
                "/clock",
                ClockMessage::TYPE_NAME,
                Qos::clock(),
                Arc::clone(&core.bell),
            );
            reader = made
                .inspect_err(|error: &RosError| log::error!("use_sim_time: {error}"))
                .ok();
        }
        while let Some(taken) = reader
            .as_ref()
            .and_then(|(reader, _)| reader.take().transpose())
        {
            match taken.and_then(|sample| sample.received.message.decode::<ClockMessage>()) {
                Ok(message) => core.clock.tick(message.clock.nanos()),
                Err(problem) => log::warn!("/clock: {problem}"),
            }
        }
        true
    })
}
