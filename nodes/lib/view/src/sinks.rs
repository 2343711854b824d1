//! Destinations become sinks of the Rerun SDK, checked before anything is logged.

use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use re_sdk::log::ChunkBatcherConfig;
use re_sdk::sink::{FileSink, GrpcSink, LogSink};
use re_sdk::{RecordingStream, RecordingStreamBuilder};

use crate::{Destination, ViewError};

/// The recording's application, under which the viewer keeps its layout.
pub(crate) const APPLICATION: &str = "cromosim";
/// How long a viewer may take to accept a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// How often a file gets what was logged: the most that a killed process loses.
const FILE_FLUSH_TICK: Duration = Duration::from_millis(500);

/// Opens a stream to all destinations.
pub(crate) fn open(destinations: &[Destination], name: &str) -> Result<RecordingStream, ViewError> {
    if destinations.is_empty() {
        return Err(ViewError::Option {
            option: "destinations",
            expected: "at least one file or address",
            found: "none".into(),
        });
    }
    let sinks = destinations
        .iter()
        .map(sink)
        .collect::<Result<Vec<_>, _>>()?;
    let batching = if destinations.iter().any(Destination::is_live) {
        ChunkBatcherConfig::LOW_LATENCY
    } else {
        // Fewer and longer chunks: each costs its schema.
        ChunkBatcherConfig {
            flush_tick: FILE_FLUSH_TICK,
            ..ChunkBatcherConfig::DEFAULT
        }
    };
    let builder = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_name(name)
        .batcher_config(batching);
    let stream = builder.set_sinks(sinks)?;
    // The wall clock of the writer says nothing here; the timeline `time` alone is kept.
    stream.set_log_time_enabled(false);
    Ok(stream)
}

fn sink(destination: &Destination) -> Result<Box<dyn LogSink>, ViewError> {
    match destination {
        Destination::File { path } => match FileSink::new(path) {
            Ok(sink) => Ok(Box::new(sink)),
            Err(source) => Err(ViewError::Create {
                path: path.clone(),
                source: Box::new(source),
            }),
        },
        Destination::Connect { address } => connect(*address),
    }
}

/// The SDK's own client retries for ever and quietly, so we look first.
fn connect(address: SocketAddr) -> Result<Box<dyn LogSink>, ViewError> {
    TcpStream::connect_timeout(&address, CONNECT_TIMEOUT)
        .map_err(|source| ViewError::NoViewer { address, source })?;
    let url = Destination::Connect { address }.to_string();
    let uri = url
        .parse()
        .map_err(|error| ViewError::Sdk(Box::new(error)))?;
    Ok(Box::new(GrpcSink::new(uri)))
}
