#![allow(clippy::unwrap_used)]
//! The closed forms of the monitor against the measurement model of `cromosim_imu`.

use cromosim_imu::{Channel, Effect, EffectKind, EffectSet, PerChannel, Reading, SensorModel};
use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::UnitQuaternion;

use super::columns::{self, Columns};
use super::tests::{moment, rotation};

/// The motion of [`moment`] as the measurement model takes it, in axes that nothing mounts.
fn track(rate_hz: f64, count: usize) -> KinematicTrack {
    let mut track = KinematicTrack {
        start: Stamp::from_seconds(1000.0),
        rate_hz,
        ..KinematicTrack::default()
    };
    for k in 0..count {
        let t = k as f64 / rate_hz;
        let m = moment(t);
        let world_from_segment = UnitQuaternion::from_rotation_matrix(&rotation(t));
        track.world_from_segment.push(world_from_segment);
        track.acceleration_in_segment.push(m.specific_force - m.up);
        track.angular_velocity_in_segment.push(m.angular_velocity);
        let angular_acceleration = m.angular_acceleration;
        track
            .angular_acceleration_in_segment
            .push(angular_acceleration);
    }
    track
}

/// Largest distance of the columns of an effect's closed form from what the measurement model makes
/// of small values, over the largest change.
fn distance_from_model<const P: usize>(
    kind: EffectKind,
    columns: impl Fn(&[Reading], &KinematicTrack, usize) -> Columns<P>,
) -> f64 {
    const SMALL: f64 = 1e-6;
    let track = track(200.0, 200);
    let stamps: Vec<Stamp> = (0..200)
        .map(|k| track.start.plus_seconds(k as f64 / 200.0))
        .collect();
    let neutral = SensorModel::new(&EffectSet::new(), track.start).run(&track, &stamps);
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    for value in 0..P {
        let mut values = kind.spec().neutral();
        values[value] += SMALL;
        let mut set = EffectSet::new();
        set.insert(Effect::new(kind, values).unwrap());
        let changed = SensorModel::new(&set, track.start).run(&track, &stamps);
        for index in 10..190 {
            let columns = columns(&neutral, &track, index);
            for channel in Channel::ALL {
                let change = (changed[index][channel] - neutral[index][channel]) / SMALL;
                apart = apart.max((change - columns[channel].column(value)).norm());
                largest = largest.max(change.norm());
            }
        }
    }
    apart / largest
}

#[test]
fn closed_forms_are_what_small_effects_of_the_library_do() {
    use EffectKind as K;
    let own = [
        [K::AccelBias, K::AccelScale, K::AccelMisalignment],
        [K::GyroBias, K::GyroScale, K::GyroMisalignment],
    ];
    let mut distances = Vec::new();
    for (channel, [bias, scale, misalignment]) in Channel::ALL.into_iter().zip(own) {
        distances.push((
            bias,
            distance_from_model(bias, |_, _, _| columns::bias(channel)),
        ));
        distances.push((
            scale,
            distance_from_model(scale, |readings, _, k| {
                columns::scale(&readings[k], channel)
            }),
        ));
        distances.push((
            misalignment,
            distance_from_model(misalignment, |readings, _, k| {
                columns::misalignment(&readings[k], channel)
            }),
        ));
    }
    distances.push((
        K::LeverArm,
        distance_from_model(K::LeverArm, |_, track, k| {
            columns::lever_arm(
                &track.angular_velocity_in_segment[k],
                &track.angular_acceleration_in_segment[k],
            )
        }),
    ));
    distances.push((
        K::GyroGSensitivity,
        distance_from_model(K::GyroGSensitivity, |readings, _, k| {
            columns::g_sensitivity(&readings[k].specific_force)
        }),
    ));
    // The slope that the model interpolates by is not that of the neighbours' difference.
    let delay = distance_from_model(K::TimeOffset, |readings, _, k| {
        columns::delay(&PerChannel::from_fn(|channel| {
            (readings[k + 1][channel] - readings[k - 1][channel]) * 100.0
        }))
    });
    assert!(delay < 1e-2, "{delay}");
    for (kind, distance) in distances {
        assert!(distance < 1e-6, "{kind}: {distance}");
    }
}
