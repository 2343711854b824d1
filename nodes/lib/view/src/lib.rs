//! Everything Rerun: the moving body, the sensors' frames and the IMU curves, to an `.rrd` file or
//! to a viewer.
//!
//! A [`Recording`] takes plain numbers and stamps and writes them to one or more [`Destination`]s,
//! together with a layout, so that the viewer opens with the body at the left, a camera that
//! follows it, and one row of curves per placement at the right. Nothing here starts a viewer, and
//! no usage data is collected: the SDK crate used has no analytics.
//!
//! Entities (Rerun's paths), all on the one timeline `time`:
//!
//! | path | what | when |
//! |---|---|---|
//! | `/world` | z up, metres | static |
//! | `/world/body` | faces and colour; vertices and normals | static; at the frame rate |
//! | `/world/anchor` | where the camera looks, on the ground under the body | at the frame rate |
//! | `/world/skeleton` | one line per bone | at the frame rate |
//! | `/world/sensors/NAME` | box, label, axes (x red, y green, z blue); world_from_sensor | static; at the frame rate |
//! | `/imu/NAME/specific_force`, `/imu/NAME/angular_velocity` | three series, m/s² and rad/s | every sample |
//!
//! [`write_gap`] writes a diagnosis of the gap between simulated and real IMUs, with a layout of
//! its own.
//!
//! ```
//! use cromosim_spatial::Stamp;
//! use cromosim_view::{Destination, Recording, RecordingOptions};
//! use nalgebra::{Isometry3, Vector3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("run.rrd");
//! let options = RecordingOptions { placements: vec!["left_wrist".into()], ..RecordingOptions::default() };
//! let mut recording = Recording::open(&[Destination::File { path }], options)?;
//! for k in 0..100 {
//!     let stamp = Stamp::from_nanos(k * 10_000_000);
//!     recording.log_sensor(stamp, "left_wrist", &Isometry3::translation(0.0, 0.3, 1.0))?;
//!     recording.log_imu(stamp, "left_wrist", &Vector3::new(0.0, 0.0, 9.80665), &Vector3::zeros())?;
//! }
//! assert_eq!(recording.finish()?.imu_samples, 100);
//! # Ok(())
//! # }
//! ```

mod blueprint_store;
mod error;
mod gap;
mod gap_data;
mod gap_layout;
mod gap_spectrum;
mod layout;
mod mesh;
mod options;
mod placement_look;
mod recording;
mod reduce;
mod sinks;
mod style;

pub use error::ViewError;
pub use gap::write_gap;
pub use gap_data::{GapCoursePoint, GapPlacement, GapSpectrum};
pub use mesh::DisplayMesh;
pub use options::{Destination, RecordingOptions, TimeAxis};
pub use recording::{Recording, Summary};
