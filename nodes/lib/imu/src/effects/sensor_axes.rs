//! How a sensor is turned at given stamps, as mount, axes and clock of a set of effects have it.

use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Matrix3, UnitQuaternion};

use super::SensorModel;

impl SensorModel {
    /// `M R_mount^T R^T` at the true times of the stamps less `delay_s`: from the reference's world into
    /// the sensor's axes. A tilt of the reference is left in. Beyond the track its ends are held.
    pub fn sensor_from_world(
        &self,
        track: &KinematicTrack,
        stamps: &[Stamp],
        delay_s: f64,
    ) -> Vec<Matrix3<f64>> {
        let start = track.start - self.epoch;
        let at = |stamp: &Stamp| {
            let seconds = self.clock.true_seconds(*stamp - self.epoch) - delay_s;
            let world_from_segment = turned(track, (seconds - start) * track.rate_hz);
            let segment_from_world = world_from_segment.inverse().to_rotation_matrix();
            let mounted = match &self.slip {
                Some((slipped_at, after)) if seconds >= *slipped_at => Some(after),
                _ => self.sensor_from_segment.as_ref(),
            };
            mounted.map_or(*segment_from_world.matrix(), |mounted| {
                mounted * segment_from_world.matrix()
            })
        };
        stamps.iter().map(at).collect()
    }

    /// True time of a stamp.
    pub fn true_time(&self, stamp: Stamp) -> Stamp {
        let seconds = self.clock.true_seconds(stamp - self.epoch);
        self.epoch.plus_seconds(seconds)
    }
}

/// The orientation at a position between entries, along the shorter arc.
fn turned(track: &KinematicTrack, position: f64) -> UnitQuaternion<f64> {
    let Some(last) = track.len().checked_sub(1) else {
        return UnitQuaternion::identity();
    };
    let position = position.clamp(0.0, last as f64);
    let before = (position as usize).min(last.saturating_sub(1));
    let after = (before + 1).min(last);
    let of = &track.world_from_segment;
    let between = of[before].try_slerp(&of[after], position - before as f64, 1e-9);
    between.unwrap_or(of[before])
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// A quaternion and its negative are one orientation.
    #[test]
    fn between_entries_the_shorter_arc_is_taken() {
        let half = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.2);
        let negative = UnitQuaternion::new_unchecked(-half.into_inner());
        for end in [half, negative] {
            let mut track = KinematicTrack {
                start: Stamp::default(),
                rate_hz: 100.0,
                ..KinematicTrack::default()
            };
            track.world_from_segment = vec![UnitQuaternion::identity(), end];
            let between = turned(&track, 0.5);
            let expected = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.1);
            assert!(between.angle_to(&expected) < 1e-12, "{between}");
        }
    }
}
