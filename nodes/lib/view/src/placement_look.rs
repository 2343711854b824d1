//! How a placement looks in space and in its curves.

use re_sdk::RecordingStream;
use re_sdk_types::archetypes::{Arrows3D, Boxes3D, Points3D, SeriesLines};
use re_sdk_types::components::FillMode;

use crate::layout::{QUANTITIES, imu_path, sensor_path};
use crate::{ViewError, style};

/// Writes what does not change of a placement: its box, name and axes, and how its curves look.
/// `index`: how many placements came before, which chooses the colour.
pub(crate) fn log_placement_look(
    stream: &RecordingStream,
    name: &str,
    index: usize,
) -> Result<(), ViewError> {
    let color = style::sensor_color(index);
    let path = sensor_path(name);
    let [_, _, half_height] = style::HALF_BOX;
    let case = Boxes3D::from_centers_and_half_sizes([[0.0, 0.0, half_height]], [style::HALF_BOX]);
    stream.log_static(
        path.join(&"case".into()),
        &case.with_colors([color]).with_fill_mode(FillMode::Solid),
    )?;
    let vectors: [[f32; 3]; 3] = std::array::from_fn(|axis| {
        std::array::from_fn(|k| if k == axis { style::AXIS_LENGTH } else { 0.0 })
    });
    let axes = Arrows3D::from_vectors(vectors)
        .with_colors(style::AXES.map(style::color))
        .with_radii([style::AXIS_RADIUS]);
    stream.log_static(path.join(&"axes".into()), &axes)?;
    let label = Points3D::new([style::LABEL_POINT])
        .with_radii([0.001])
        .with_colors([color])
        .with_labels([name]);
    stream.log_static(path.join(&"name".into()), &label.with_show_labels(true))?;
    for (quantity, _) in QUANTITIES {
        let series = SeriesLines::new()
            .with_names(["x", "y", "z"])
            .with_colors(style::AXES.map(style::color));
        stream.log_static(
            imu_path(name, quantity),
            &series.with_widths([1.5, 1.5, 1.5]),
        )?;
    }
    Ok(())
}
