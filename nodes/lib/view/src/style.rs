//! Colours and sizes: a dark, calm ground, one light body, bright sensors.

use re_sdk_types::components::Color;

/// Behind the scene.
pub(crate) const BACKGROUND: [u8; 3] = [22, 25, 31];
/// The floor's lines, with transparency.
pub(crate) const GRID: [u8; 4] = [130, 145, 165, 60];
/// Metres between the floor's lines.
pub(crate) const GRID_SPACING: f32 = 0.5;
/// The body's skin.
pub(crate) const BODY: [u8; 3] = [176, 187, 200];
/// The skeleton's lines.
pub(crate) const SKELETON: [u8; 3] = [240, 200, 120];
/// x, y and z, of axes and of curves alike.
pub(crate) const AXES: [[u8; 3]; 3] = [[240, 98, 92], [106, 200, 120], [92, 150, 250]];
/// What was measured, the simulation before and after its causes are added, and what noise alone
/// would be.
pub(crate) const MEASURED: [u8; 3] = [190, 196, 205];
pub(crate) const BEFORE: [u8; 3] = [245, 139, 69];
pub(crate) const AFTER: [u8; 3] = [88, 176, 242];
pub(crate) const PREDICTED: [u8; 3] = [183, 149, 228];
/// Lines and words around a plot of our own.
pub(crate) const PLOT_GRID: [u8; 3] = [52, 58, 68];
pub(crate) const PLOT_INK: [u8; 3] = [160, 168, 180];
/// Length of a sensor's axes, m.
pub(crate) const AXIS_LENGTH: f32 = 0.1;
/// Radius of a sensor's axes, m.
pub(crate) const AXIS_RADIUS: f32 = 0.0075;
/// Half of a sensor's box, m, sensor axes; it stands on the skin with z outwards.
pub(crate) const HALF_BOX: [f32; 3] = [0.022, 0.016, 0.008];
/// Where a sensor's name stands, m, sensor axes.
pub(crate) const LABEL_POINT: [f32; 3] = [0.0, 0.0, 0.18];

/// The colours of the sensors, in the order of their placements.
const SENSORS: [[u8; 3]; 8] = [
    [255, 184, 77],
    [94, 214, 214],
    [214, 140, 255],
    [170, 220, 90],
    [255, 130, 160],
    [120, 180, 255],
    [255, 225, 120],
    [150, 235, 180],
];

/// The colour of the placement with this index.
pub(crate) fn sensor_color(index: usize) -> Color {
    color(SENSORS[index % SENSORS.len()])
}

/// An opaque colour.
pub(crate) fn color([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgb(red, green, blue)
}
