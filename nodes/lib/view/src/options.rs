//! Where a recording goes and what it looks like.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use cromosim_spatial::Stamp;

use crate::ViewError;

/// Where a recording goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// An `.rrd` file. What has been written stays readable when the process is killed.
    File {
        /// The file; an existing one is replaced.
        path: PathBuf,
    },
    /// A viewer that runs already, by gRPC.
    Connect {
        /// Where it listens.
        address: SocketAddr,
    },
}

impl Destination {
    /// Where a viewer started by `rerun` listens on this machine: 127.0.0.1:9876.
    pub const LOCAL_VIEWER: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 9876);

    /// Whether a viewer shows the data as it comes.
    pub fn is_live(&self) -> bool {
        !matches!(self, Self::File { .. })
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path } => write!(formatter, "{}", path.display()),
            Self::Connect { address } => write!(formatter, "rerun+http://{address}/proxy"),
        }
    }
}

/// How the timeline `time` counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeAxis {
    /// As a duration since [`RecordingOptions::start`], or since the first stamp logged.
    #[default]
    SinceStart,
    /// As a date, for stamps that are nanoseconds since the UNIX epoch.
    Date,
}

/// What a recording looks like.
#[derive(Clone, Debug)]
pub struct RecordingOptions {
    /// Shown as the recording's name.
    pub name: String,
    /// Placements in the order of their curves. Others are added, after these, when they are first
    /// logged.
    pub placements: Vec<String>,
    /// How the timeline counts.
    pub time_axis: TimeAxis,
    /// Zero of [`TimeAxis::SinceStart`]; the first stamp logged where none is given.
    pub start: Option<Stamp>,
    /// Frames per second, Hz, of the body, the skeleton and the sensor frames; frames in between
    /// are dropped.
    pub frame_rate_hz: f64,
    /// The shown body has at most about this many vertices (24 bytes each and frame); 0 leaves the
    /// mesh as it is.
    pub display_vertices: usize,
    /// Seconds of curves shown up to the time cursor; all of them where none is given.
    pub curve_window_s: Option<f64>,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self {
            name: "cromosim".into(),
            placements: Vec::new(),
            time_axis: TimeAxis::default(),
            start: None,
            frame_rate_hz: 25.0,
            display_vertices: 3000,
            curve_window_s: None,
        }
    }
}

impl RecordingOptions {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`ViewError::Option`] where a rate or a window is not positive and finite.
    pub(crate) fn check(&self) -> Result<(), ViewError> {
        let positive = |option, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(ViewError::Option {
                option,
                expected: "a positive number",
                found: value.to_string(),
            })
        };
        positive("frame_rate_hz", self.frame_rate_hz)?;
        self.curve_window_s
            .map_or(Ok(()), |window| positive("curve_window_s", window))
    }
}
