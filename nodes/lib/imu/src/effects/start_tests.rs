//! Initial guesses: near enough to the truth for a fit to go on from.
#![allow(clippy::unwrap_used)]

use cromosim_spatial::{Stamp, so3, uniform_stamps};
use nalgebra::{Matrix3, Vector3};

use super::model_tests::{START, set, track};
use super::{
    DeclaredNoise, Effect, EffectKind as Kind, EffectSet, FirstGuess, MeasurementInput, Reading,
    ResidualView, Search, SensorModel, clipping_limit, lattice_spacing, nearest_signed_permutation,
    white_noise_density,
};
use crate::{Channel, NoiseSource};

const RATE_HZ: f64 = 100.0;
const NOISE: DeclaredNoise = DeclaredNoise {
    accel_density: 0.002,
    gyro_density: 0.0003,
};

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
    let mut noise =
        NoiseSource::white(&model.total_noise(&NOISE), 0.0, RATE_HZ, 7, "wrist").unwrap();
    let input = MeasurementInput::Motion(&track);
    let measured = model.measure(input, &stamps, |readings| noise.add_to(readings));
    Case {
        stamps,
        measured,
        simulated,
    }
}

impl Case {
    fn starts(&self, kind: Kind) -> Option<Vec<Vec<f64>>> {
        let view = ResidualView {
            stamps: &self.stamps,
            epoch: START,
            rate_hz: RATE_HZ,
            measured: &self.measured,
            simulated: &self.simulated,
        };
        match kind.spec().search {
            Search::Fitted(search) => match search.first_guess {
                FirstGuess::FromResidual(guess) => Some(guess(&view)),
                FirstGuess::Neutral | FirstGuess::ChangeOf(_) => None,
            },
            Search::Choice | Search::ReadOff(_) | Search::Given => None,
        }
    }

    /// Values of one channel, reading after reading.
    fn values(&self, channel: Channel) -> Vec<f64> {
        self.measured
            .iter()
            .flat_map(|reading| reading[channel].iter().copied())
            .collect()
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
            let Some(starts) = case.starts(kind) else {
                continue;
            };
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
    for channel in Channel::ALL {
        let values = nominal.values(channel);
        assert_eq!(clipping_limit(&values, None), None);
        assert_eq!(lattice_spacing(&mut values.clone()), None);
    }
}

#[test]
fn noise_is_estimated() {
    let still = |density: f64| -> Vec<Reading> {
        let declared = DeclaredNoise {
            accel_density: density,
            gyro_density: 0.1 * density,
        };
        let mut noise = NoiseSource::white(&declared, 0.0, RATE_HZ, 7, "wrist");
        let noise = noise.as_mut().unwrap();
        (0..4000).map(|_| noise.draw()).collect()
    };
    let readings = still(0.01);
    let found = Channel::ALL.map(|channel| white_noise_density(&readings, channel, RATE_HZ));
    assert!((found[0] - 0.01).abs() < 0.0005, "{found:?}");
    assert!((found[1] - 0.001).abs() < 0.00005, "{found:?}");
}

#[test]
fn what_digits_show_is_read_off() {
    for units in [1.0, 1.0 / 9.80665, 1000.0] {
        let digital = case(&[
            (Kind::AccelQuantization, &[0.0383]),
            (Kind::AccelSaturation, &[9.5]),
            (Kind::AccelUnits, &[units]),
        ]);
        let values = digital.values(Channel::Accelerometer);
        let lsb = lattice_spacing(&mut values.clone()).unwrap();
        assert!((lsb - 0.0383 * units).abs() < 1e-9 * units);
        // The limit itself is rounded to the lattice.
        let limit = clipping_limit(&values, Some(lsb)).unwrap();
        assert!(limit.is_certain);
        let limit = limit.value;
        assert!((limit / units - 9.5).abs() < 0.02, "{limit}");
    }
    let limit_of = |kind: Kind, limit: f64, channel: Channel| {
        let found = clipping_limit(&case(&[(kind, &[limit])]).values(channel), None);
        found.map(|limit| limit.value)
    };
    assert_eq!(
        limit_of(Kind::AccelSaturation, 9.5, Channel::Accelerometer),
        Some(9.5)
    );
    assert_eq!(
        limit_of(Kind::GyroSaturation, 0.9, Channel::Gyroscope),
        Some(0.9)
    );
    let rounded = case(&[(Kind::GyroQuantization, &[0.00106])]);
    let lsb = lattice_spacing(&mut rounded.values(Channel::Gyroscope)).unwrap();
    assert!((lsb - 0.00106).abs() < 1e-9);
}

/// Three times a few readings at 9 steps, and some one step below.
#[test]
fn a_pile_that_peaks_may_make_as_well_is_doubtful() {
    let found = |at: usize, below: usize| {
        let mut once = vec![9.0; at];
        once.extend(vec![8.0; below]);
        once.extend([1.0; 100]);
        let values = once.repeat(3);
        clipping_limit(&values, Some(1.0)).map(|limit| (limit.value, limit.is_certain))
    };
    assert_eq!(found(20, 6), Some((9.0, true)));
    assert_eq!(found(20, 7), Some((9.0, false)));
    assert_eq!(found(20, 20), None);
    assert_eq!(found(3, 1), None);
}

#[test]
fn signed_permutations_are_found_near_rotations() {
    let axes = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let turned = axes * so3::exp(&Vector3::new(0.2, -0.1, 0.15)).to_rotation_matrix();
    assert_eq!(nearest_signed_permutation(&turned), axes);
    let effect = Effect::axis_convention(&axes).unwrap();
    assert_eq!(effect.matrix(), axes);
}

/// A rotating force, and a line that shows in the gyroscope alone.
#[test]
fn a_vibration_is_found_with_its_phases() {
    let rotating = [
        31.417, 0.05, 0.1, 0.08, 1.2, 2.7, 5.9, 0.002, 0.004, 0.003, 0.4, 3.3, 6.1,
    ];
    let mut turning = rotating;
    turning[1..4].fill(0.0);
    for line in [rotating, turning] {
        let start = case(&[(Kind::Vibration, &line)])
            .starts(Kind::Vibration)
            .unwrap()
            .remove(0);
        assert!((start[0] - line[0]).abs() < 1e-3, "{start:?}");
        for (first, tolerance) in [(1, 0.005), (7, 0.0005)] {
            for axis in first..first + 3 {
                let wave = |values: &[f64]| {
                    let (sin, cos) = values[axis + 3].sin_cos();
                    [values[axis] * sin, values[axis] * cos]
                };
                let (found, expected) = (wave(&start), wave(&line));
                assert!(
                    (0..2).all(|part| (found[part] - expected[part]).abs() < tolerance),
                    "{start:?}"
                );
            }
        }
    }
}
