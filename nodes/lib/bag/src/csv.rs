//! IMU samples as comma-separated values.

use std::io::Write;
use std::path::Path;

use cromosim_msgs::sensor_msgs::Imu;

use crate::error::{BagError, io_error};
use crate::message::Selection;
use crate::reader::BagReader;

/// The first line of the file: time, world from sensor, rad/s, m/s2.
const COLUMNS: &str = "stamp_ns,orientation_x,orientation_y,orientation_z,orientation_w,angular_velocity_x,angular_velocity_y,\
                       angular_velocity_z,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z";

/// Writes the `sensor_msgs/msg/Imu` messages of `topic` to `output`, a line each in order of log
/// time, and returns how many.
///
/// Columns: header stamp (ns), orientation (world from sensor, scalar last), angular velocity
/// (rad/s) and specific force (m/s2) in sensor axes. Numbers are as short as they can be without
/// loss. Orientation is left empty where the message says that there is none.
///
/// # Errors
/// As [`BagReader::messages`] and [`crate::Message::decode`]; [`BagError::Io`] names `label`.
pub fn write_imu_csv(
    reader: &BagReader,
    topic: &str,
    output: impl Write,
    label: &Path,
) -> Result<u64, BagError> {
    let mut output = std::io::BufWriter::new(output);
    let mut count = 0;
    writeln!(output, "{COLUMNS}").map_err(io_error(label, "write"))?;
    for message in reader.messages(&Selection::topic(topic))? {
        let imu: Imu = message?.decode()?;
        let (q, w, f) = (
            imu.orientation,
            imu.angular_velocity,
            imu.linear_acceleration,
        );
        let orientation = if imu.orientation_covariance[0] == -1.0 {
            ",,,".to_owned()
        } else {
            format!("{},{},{},{}", q.x, q.y, q.z, q.w)
        };
        let stamp = imu.header.stamp.nanos();
        writeln!(
            output,
            "{stamp},{orientation},{},{},{},{},{},{}",
            w.x, w.y, w.z, f.x, f.y, f.z
        )
        .map_err(io_error(label, "write"))?;
        count += 1;
    }
    output.flush().map_err(io_error(label, "write"))?;
    Ok(count)
}
