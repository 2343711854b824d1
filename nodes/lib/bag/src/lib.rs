//! Bags: recordings of ROS 2 messages as rosbag2 lays them out in MCAP and SQLite files, and those of ROS 1.
//!
//! - [`BagWriter`] writes a file or a directory; [`StreamWriter`] writes into anything.
//! - [`BagReader`] lists and reads them, in order of log time.
//! - [`recover`] mends what a killed recorder left behind.
//! - [`write_imu_csv`] exports an IMU's samples.
//!
//! Message payloads are plain CDR after a four-byte header (OMG DDSI-RTPS 2.5, 10); schemas are
//! `ros2msg` text. The same calls give the same bytes: times come from the caller, and compression
//! uses one thread.

mod ahead;
mod cadence;
pub mod cdr;
mod chunk;
mod contents;
mod csv;
mod error;
mod mcap_messages;
mod message;
mod metadata;
mod packed;
mod qos;
mod reader;
mod recover;
mod resync;
mod ros1;
mod sqlite;
mod stored;
mod stream;
mod summary;
mod topic;
mod values;
mod walk;
mod writer;

pub use cadence::Cadence;
pub use csv::write_imu_csv;
pub use error::BagError;
pub use message::{Message, Selection};
pub use qos::{QosProfile, QosTime};
pub use reader::{BagReader, Messages};
pub use recover::{Damage, Recovery, recover, recover_over};
pub use stored::starts_like_bag;
pub use stream::{Compression, StreamWriter, TopicId, payload_of};
pub use summary::{BagSummary, CountedTopic};
pub use topic::Topic;
pub use values::Value;
pub use walk::Attachment;
pub use writer::{BagOptions, BagWriter};
