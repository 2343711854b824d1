//! Initial guesses: near enough to the truth for a fit to go on from.
#![allow(clippy::unwrap_used)]

use cromosim_spatial::{Stamp, so3, uniform_stamps};
use nalgebra::Vector3;

use super::model_tests::{START, set, track};
use super::{Dropouts, Effect, EffectKind as Kind, EffectSet, Reading, ResidualView, SensorModel};
use crate::NoiseSource;

const RATE_HZ: f64 = 100.0;
const NOISE: (f64, f64) = (0.002, 0.0003);

struct Case {
    stamps: Vec<Stamp>,
    measured: Vec<Reading>,
    simulated: Vec<Reading>,
}

/// Readings under effects and declared noise, against the nominal ones.
fn case(effects: &[(Kind, &[f64])]) -> Case {
    let track = track(40.0);
    let stamps = uniform_stamps(START, START.plus_seconds(39.0), RATE_HZ).unwrap();
    let simulated = SensorModel::new(&EffectSet::new(), START).run(&track, &stamps);
    let model = SensorModel::new(&set(effects), START);
    let mut measured = model.read(&model.sensor(model.tissue(model.segment(&track))), &stamps);
    model.linear(&mut measured, &stamps);
    let beyond = model.noise_density();
    let mut noise = NoiseSource::white(
        (NOISE.0.hypot(beyond.0), NOISE.1.hypot(beyond.1)),
        0.0,
        RATE_HZ,
        7,
        "wrist",
    )
    .unwrap();
    for reading in &mut measured {
        let drawn = noise.draw();
        reading.specific_force += drawn.specific_force;
        reading.angular_velocity += drawn.angular_velocity;
    }
    model.digital(&mut measured);
    Case {
        stamps,
        measured,
        simulated,
    }
}

impl Case {
    fn starts(&self, kind: Kind) -> Vec<Vec<f64>> {
        let view = ResidualView {
            stamps: &self.stamps,
            epoch: START,
            rate_hz: RATE_HZ,
            measured: &self.measured,
            simulated: &self.simulated,
            accel_sigma: NOISE.0 * RATE_HZ.sqrt(),
            gyro_sigma: NOISE.1 * RATE_HZ.sqrt(),
        };
        (kind.spec().starts)(&view)
    }

    /// Whether some start is as near to the truth as said, value by value.
    fn finds(&self, kind: Kind, truth: &[f64], tolerance: f64) {
        let near = |start: &Vec<f64>| {
            start
                .iter()
                .zip(truth)
                .all(|(a, b)| (a - b).abs() <= tolerance)
        };
        let starts = self.starts(kind);
        assert!(
            starts.iter().any(near),
            "{kind}: {starts:?} against {truth:?}"
        );
    }
}

#[test]
fn all_starts_are_valid() {
    let nominal = case(&[]);
    let nothing = Case {
        stamps: Vec::new(),
        measured: Vec::new(),
        simulated: Vec::new(),
    };
    for kind in Kind::ALL {
        for case in [&nominal, &nothing] {
            let starts = case.starts(kind);
            assert!(!starts.is_empty());
            for start in starts {
                Effect::new(kind, start).unwrap();
            }
        }
    }
}

#[test]
fn what_is_read_off_is_not_found_where_it_is_not() {
    let nominal = case(&[]);
    let neutral = [
        Kind::AccelSaturation,
        Kind::GyroSaturation,
        Kind::AccelQuantization,
        Kind::GyroQuantization,
        Kind::AccelUnits,
        Kind::GyroUnits,
    ];
    for kind in neutral
        .into_iter()
        .chain([Kind::AxisConvention, Kind::DroppedSamples])
    {
        assert_eq!(
            nominal.starts(kind)[0],
            Effect::neutral(kind).values(),
            "{kind}"
        );
    }
    nominal.finds(Kind::AccelNoise, &[0.0], 0.0006);
    nominal.finds(Kind::TimeOffset, &[0.0], 0.0);
}

#[test]
fn constants_and_noise_are_estimated() {
    case(&[(Kind::AccelBias, &[0.3, -0.2, 0.1])]).finds(Kind::AccelBias, &[0.3, -0.2, 0.1], 0.002);
    case(&[(Kind::GyroBias, &[0.03, -0.02, 0.01])]).finds(
        Kind::GyroBias,
        &[0.03, -0.02, 0.01],
        0.0005,
    );
    case(&[(Kind::AccelNoise, &[0.01])]).finds(Kind::AccelNoise, &[0.01], 0.0005);
    case(&[(Kind::GyroNoise, &[0.001])]).finds(Kind::GyroNoise, &[0.001], 0.00005);
}

#[test]
fn turns_are_estimated() {
    let mount = [0.4, -1.1, 0.7];
    case(&[(Kind::MountRotation, &mount)]).finds(Kind::MountRotation, &mount, 0.01);
    let axes = [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0];
    case(&[(Kind::AxisConvention, &axes)]).finds(Kind::AxisConvention, &axes, 0.0);
    let at = START.nanos as f64 * 1e-9 + 17.3;
    let slip = case(&[(Kind::MountSlip, &[at, 0.2, 0.0, -0.3])]);
    let start = &slip.starts(Kind::MountSlip)[0];
    assert!((start[0] - at).abs() < 0.3, "{}", start[0] - at);
    assert!(
        (Vector3::new(start[1], start[2], start[3]) - Vector3::new(0.2, 0.0, -0.3)).norm() < 0.02,
        "{start:?}"
    );
    assert!((so3::exp(&Vector3::new(0.2, 0.0, -0.3)).angle() - 0.36).abs() < 0.01);
}

#[test]
fn clocks_and_losses_are_estimated() {
    case(&[(Kind::TimeOffset, &[0.25])]).finds(Kind::TimeOffset, &[0.25], 0.006);
    let mut lossy = case(&[]);
    let effect = Effect::new(Kind::DroppedSamples, vec![0.1, 3.0]).unwrap();
    let mut dropouts = Dropouts::new(Some(&effect), 1, "wrist").unwrap();
    let kept: Vec<bool> = lossy
        .stamps
        .iter()
        .map(|_| !dropouts.next_is_lost())
        .collect();
    let mut each = kept.iter();
    lossy.stamps.retain(|_| *each.next().unwrap());
    let [fraction, mean_burst] = lossy.starts(Kind::DroppedSamples)[0][..] else {
        panic!("two values")
    };
    let truth = kept.iter().filter(|kept| !**kept).count() as f64 / kept.len() as f64;
    assert!(
        (fraction - truth).abs() < 0.002 && (fraction - 0.1).abs() < 0.03,
        "{fraction} against {truth}"
    );
    assert!((mean_burst - 3.0).abs() < 0.6, "{mean_burst}");
}

#[test]
fn what_digits_show_is_read_off() {
    for units in [1.0, 1.0 / 9.80665, 1000.0] {
        let digital = case(&[
            (Kind::AccelQuantization, &[0.0383]),
            (Kind::AccelSaturation, &[9.5]),
            (Kind::AccelUnits, &[units]),
        ]);
        digital.finds(Kind::AccelQuantization, &[0.0383 * units], 1e-9 * units);
        digital.finds(Kind::AccelUnits, &[units], 1e-12);
    }
    // The limit itself is rounded to the lattice.
    case(&[(Kind::AccelSaturation, &[9.5])]).finds(Kind::AccelSaturation, &[9.5], 1e-9);
    case(&[(Kind::GyroSaturation, &[0.9])]).finds(Kind::GyroSaturation, &[0.9], 1e-9);
    case(&[(Kind::GyroQuantization, &[0.00106])]).finds(Kind::GyroQuantization, &[0.00106], 1e-9);
    let degrees = 180.0 / std::f64::consts::PI;
    for factor in [degrees, 1000.0 * degrees, degrees / 6.0, 1e-3] {
        case(&[(Kind::GyroUnits, &[factor]), (Kind::GyroScale, &[1.02; 3])]).finds(
            Kind::GyroUnits,
            &[factor],
            1e-9,
        );
    }
}

#[test]
fn a_vibration_is_found_with_its_phase() {
    let line = [31.417, 0.05, -0.1, 0.08, 1.2];
    let start = case(&[(Kind::Vibration, &line)])
        .starts(Kind::Vibration)
        .remove(0);
    assert!((start[0] - line[0]).abs() < 1e-3, "{start:?}");
    // Amplitude and phase are as good as their common sign.
    let sign = (start[1] * line[1]).signum();
    for axis in 1..4 {
        assert!((start[axis] * sign - line[axis]).abs() < 0.003, "{start:?}");
    }
    let phase = start[4]
        + if sign < 0.0 {
            std::f64::consts::PI
        } else {
            0.0
        };
    assert!((phase - line[4]).sin().abs() < 0.1, "{start:?}");
}
