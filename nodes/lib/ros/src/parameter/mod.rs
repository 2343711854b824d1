//! ROS 2 parameters: declared with a type, bounds and a description; given by file or command line;
//! open to the standard services.

mod config;
mod declaration;
mod file;
mod live;
mod services;
mod store;
mod value;

pub use declaration::Parameter;
pub use ros2_client::ParameterValue;
pub use store::Parameters;
pub use value::ParameterScalar;

pub(crate) use file::{Override, read_params_file};
pub(crate) use services::serve_parameters;
pub(crate) use store::USE_SIM_TIME;
