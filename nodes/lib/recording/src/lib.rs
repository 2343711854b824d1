//! Recordings as users have them: bags with references and IMUs, recordings of public data sets,
//! trajectories of rigid bodies, tables of IMU readings.
//!
//! - [`read_placements`] gives each placement of a bag: its reference poses and the messages of its
//!   real IMU.
//! - [`TopicMap`] says which topics are whose where they have names of their own, [`pose_topics`]
//!   which can be references.
//! - [`datasets`] imports what other people recorded; [`rigid`] reads and writes trajectories (TUM,
//!   EuRoC, tables) and IMU series.
//! - [`PlacementTrace`] is what either of them says of one placement; [`write_traces`] writes it
//!   under the topics that every command and node knows: `/reference/NAME`, `/imu/NAME/data_raw`,
//!   `/imu/NAME/data`. [`write_as_bag`] does so for a file of any of these kinds.
//! - [`batch`](mod@batch) says which of many inputs are to be done, and what became of them.
//! - [`columns`] writes readings as Parquet, for those who train on them.
//! - [`convert`](mod@convert) reads any file and writes any format; [`inspect`](mod@inspect) says
//!   what is in a file; [`compare`](mod@compare) says how two recordings or diagnoses differ.
//! - [`Resimulation`] gives the messages of its IMUs again, from the reference motion.
//! - [`Simulation`] gives the IMUs of a moving person, a [`PlayedPerson`]; these and
//!   [`SimulatedPlacement`] are what a simulation of a motion file writes.
//! - [`smpl_pose`] and [`smpl_state`] fill a message from a motion's frame.
//!
//! Nothing here needs a ROS node: offline commands, training and evaluation read recordings by
//! these functions alone.

mod bag_file;
pub mod batch;
mod body;
mod caught;
pub mod columns;
pub mod compare;
pub mod convert;
pub mod datasets;
mod error;
mod file;
mod frame_tree;
pub mod inspect;
mod messages;
mod motion_spill;
mod namespace;
mod people_bag;
mod placement;
mod played;
mod pose_source;
mod quality;
mod reference_parts;
mod resimulation;
pub mod rigid;
mod rigid_bodies;
mod simulation;
mod static_readings;
mod topics;
mod trace;

pub use bag_file::{is_bag, write_as_bag};
pub use body::body_for_bag;
pub use error::RecordingError;
pub use file::{is_in_the_way, read_head, read_whole, write_file, write_file_with};
pub use messages::{FIRST_STAMP, MessageHeader, smpl_pose, smpl_state, stamp_of_frame};
pub use motion_spill::MotionSpill;
pub use namespace::{open_mapped, open_recording};
pub use people_bag::write_people;
pub use placement::{RecordedPlacement, read_mapped_placements, read_placements, read_poses};
pub use played::{PlayedPerson, SimulatedPerson, SimulatedPlacement, csv_file, write_people_csv};
pub use pose_source::{POSE_TYPES, PoseTopic, pose_topics};
pub use quality::Quality;
pub use resimulation::{
    Resimulated, Resimulation, outside_reference, read_effects, reading_mapping, with_stamps,
    write_resimulated,
};
pub use rigid_bodies::{RigidBodies, read_rigid_bodies};
pub use simulation::{Aside, Simulation, SimulationOptions, TextureOn};
pub use static_readings::{StaticReadings, read_static};
pub use topics::{PoseSource, TopicMap};
pub use trace::{
    PlacementTrace, activities_csv, first_stamp, seconds_to_first_stamp, write_traces,
};
