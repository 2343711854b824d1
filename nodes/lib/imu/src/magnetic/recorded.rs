//! The magnetometer of a whole motion at given stamps.

use std::sync::Arc;

use cromosim_msgs::sensor_msgs::MagneticField;
use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Matrix3, Vector3};

use super::{AmbientField, MagneticSensor, Magnetometer};
use crate::{PlacementEffects, SensorModel};

/// What a magnetometer goes through.
#[derive(Clone, Copy, Debug)]
pub struct MagneticMotion<'a> {
    /// The motion of the reference frame.
    pub track: &'a KinematicTrack,
    /// Where it is at each stamp, m in the world, one for each.
    pub positions: &'a [Vector3<f64>],
    /// When the magnetometer reads, by the device's clock.
    pub stamps: &'a [Stamp],
    /// Readings per second, Hz.
    pub rate_hz: f64,
}

/// The messages (`mag`) of a magnetometer at given stamps: those of the live one, with mount, axes and clock
/// as the effects have them, and with the field as it was `delay` before (live it follows straight lines
/// between samples). Positions are taken without the delay and the lever arm: fields change little within
/// centimetres. `noise` has seed and name; none: without the random part.
pub fn measure_magnetic_recording(
    motion: MagneticMotion<'_>,
    effects: &PlacementEffects,
    magnetometer: &Magnetometer,
    field: &Arc<AmbientField>,
    (noise, frame_id): (Option<(u64, &str)>, &str),
) -> Vec<MagneticField> {
    let model = SensorModel::new(&effects.effects, effects.epoch);
    let turns = model.sensor_from_world(motion.track, motion.stamps, magnetometer.delay);
    let on_time = Magnetometer {
        delay: 0.0,
        ..magnetometer.clone()
    };
    let mut sensor = MagneticSensor::new(&on_time, Arc::clone(field), motion.rate_hz, noise);
    let read =
        |((sensor_from_world, position), stamp): ((&Matrix3<f64>, &Vector3<f64>), &Stamp)| {
            let field = sensor.field_at(position);
            let reading = sensor.read_field(sensor_from_world * field, *stamp);
            sensor.message(reading, *stamp, frame_id)
        };
    let places = turns.iter().zip(motion.positions);
    places.zip(motion.stamps).map(read).collect()
}
