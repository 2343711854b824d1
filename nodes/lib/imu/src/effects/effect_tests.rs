//! Names, bounds, sets and the form in files.
#![allow(clippy::unwrap_used)]

use super::{Effect, EffectKind, EffectSet, FirstGuess, Search, Shape, Stage};
use crate::EffectError;

/// The contract's table, in its order.
const NAMES: [&str; 44] = [
    "reference_noise",
    "reference_smoothing",
    "reference_interpolation",
    "reference_tilt",
    "reference_scale",
    "reference_units",
    "mount_rotation",
    "lever_arm",
    "mount_slip",
    "soft_tissue",
    "time_offset",
    "clock_drift",
    "channel_delay",
    "dropped_samples",
    "accel_bias",
    "gyro_bias",
    "accel_scale",
    "gyro_scale",
    "accel_misalignment",
    "gyro_misalignment",
    "accel_noise",
    "gyro_noise",
    "accel_bias_drift",
    "gyro_bias_drift",
    "accel_turn_on_bias",
    "gyro_turn_on_bias",
    "accel_bias_instability",
    "gyro_bias_instability",
    "accel_bias_walk",
    "gyro_bias_walk",
    "warm_up",
    "accel_saturation",
    "gyro_saturation",
    "accel_quantization",
    "gyro_quantization",
    "low_pass",
    "accel_low_pass",
    "gyro_low_pass",
    "gyro_g_sensitivity",
    "vibration",
    "axis_convention",
    "accel_units",
    "gyro_units",
    "gravity_convention",
];

/// Values of some size that are allowed.
fn example(kind: EffectKind) -> Effect {
    let values = kind
        .spec()
        .parameters
        .iter()
        .flat_map(|parameter| match parameter.shape {
            Shape::Choice(_) => vec![1.0],
            Shape::Matrix3 if kind == EffectKind::AxisConvention => {
                vec![0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0]
            }
            Shape::Time => vec![1_700_000_000.25],
            shape => (0..shape.count())
                .map(|k| (0.11 + 0.07 * k as f64).max(parameter.lower))
                .collect(),
        });
    Effect::new(kind, values.collect()).unwrap()
}

#[test]
fn the_library_is_the_contracts_table() {
    assert_eq!(EffectKind::ALL.map(EffectKind::name), NAMES);
    assert!(EffectKind::ALL.is_sorted());
    for kind in EffectKind::ALL {
        let spec = kind.spec();
        assert_eq!(
            (spec.kind, EffectKind::from_name(spec.name)),
            (kind, Some(kind))
        );
        assert!(
            spec.summary.ends_with('.') && spec.remedy.ends_with('.') && spec.value_count() > 0,
            "{kind}"
        );
        for parameter in spec.parameters {
            assert_eq!(parameter.neutral.len(), parameter.shape.count(), "{kind}");
            assert!(
                parameter.lower < parameter.upper
                    && parameter
                        .fit
                        .is_none_or(|fit| fit.step > 0.0 && fit.prior_deviation > 0.0),
                "{kind}"
            );
        }
        assert_eq!(
            Effect::new(kind, spec.neutral()).unwrap(),
            Effect::neutral(kind)
        );
        assert_eq!(
            spec.stage == Stage::Reference,
            kind.name().starts_with("reference_")
        );
    }
}

#[test]
fn what_the_search_reads_of_an_effect_fits_its_values() {
    for kind in EffectKind::ALL {
        let spec = kind.spec();
        let free: usize = spec
            .parameters
            .iter()
            .filter(|parameter| parameter.fit.is_some())
            .map(|parameter| parameter.shape.count())
            .sum();
        assert!(!spec.channels.is_empty(), "{kind}");
        match spec.search {
            Search::Fitted(search) => {
                assert!(free > 0, "{kind}");
                if let Some(test) = search.identifiability {
                    assert!((1..=spec.value_count()).contains(&test.values), "{kind}");
                }
                if let FirstGuess::ChangeOf(base) = search.first_guess {
                    assert_eq!(spec.parameters[0].shape, Shape::Time, "{kind}");
                    assert_eq!((spec.value_count(), base.spec().value_count()), (4, 3));
                }
            }
            Search::Choice | Search::Given => assert_eq!(free, 0, "{kind}"),
            Search::ReadOff(search) => {
                assert_eq!(free, 0, "{kind}");
                assert_eq!(EffectKind::read_off(search.from), Some(kind));
                assert!((0.5..1.0).contains(&search.probability), "{kind}");
            }
        }
    }
}

#[test]
fn effects_come_back_from_yaml() {
    for kind in EffectKind::ALL {
        for effect in [example(kind), Effect::neutral(kind)] {
            let text = serde_norway::to_string(&effect).unwrap();
            assert!(text.starts_with(&format!("effect: {kind}\n")), "{text}");
            assert_eq!(
                serde_norway::from_str::<Effect>(&text).unwrap(),
                effect,
                "{text}"
            );
        }
    }
    let all = EffectSet::try_from(EffectKind::ALL.map(example).to_vec()).unwrap();
    assert_eq!(
        serde_norway::from_str::<EffectSet>(&serde_norway::to_string(&all).unwrap()).unwrap(),
        all
    );
    let kinds: Vec<EffectKind> =
        serde_norway::from_str(&serde_norway::to_string(&EffectKind::ALL.to_vec()).unwrap())
            .unwrap();
    assert_eq!(kinds, EffectKind::ALL);
}

#[test]
fn parameters_are_found_by_name() {
    let mut values: Vec<f64> = (0..13).map(|k| 0.1 * f64::from(k)).collect();
    values[0] = 20.0;
    values[1..4].copy_from_slice(&[1.0, 2.0, 3.0]);
    let vibration = Effect::new(EffectKind::Vibration, values.clone()).unwrap();
    assert_eq!(
        vibration.parameter("amplitude"),
        Some([1.0, 2.0, 3.0].as_slice())
    );
    assert_eq!(vibration.parameter("gyro_phase"), Some(&values[10..]));
    assert_eq!(vibration.parameter("speed"), None);
    values[0] = 21.0;
    assert_eq!(vibration.with_values(values).unwrap().values()[0], 21.0);
}

#[test]
fn values_that_make_no_sense_are_refused() {
    let new = |kind, values: &[f64]| Effect::new(kind, values.to_vec()).unwrap_err();
    assert!(matches!(
        new(EffectKind::AccelBias, &[0.0]),
        EffectError::Length {
            expected: 3,
            found: 1,
            ..
        }
    ));
    let nan = new(EffectKind::LowPass, &[f64::NAN]).to_string();
    assert_eq!(
        nan,
        "low_pass: cutoff_hz: NaN is out of range; expected 0.1 to 10000"
    );
    assert!(matches!(
        new(EffectKind::DroppedSamples, &[1.5, 1.0]),
        EffectError::OutOfRange {
            field: "fraction",
            ..
        }
    ));
    assert!(matches!(
        new(EffectKind::GravityConvention, &[0.5]),
        EffectError::Malformed { .. }
    ));
    for matrix in [
        [1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [0.0; 9],
        [0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    ] {
        assert!(
            new(EffectKind::AxisConvention, &matrix)
                .to_string()
                .contains("signed permutation")
        );
    }
    let twice = vec![
        example(EffectKind::LowPass),
        Effect::neutral(EffectKind::LowPass),
    ];
    assert_eq!(
        EffectSet::try_from(twice).unwrap_err().to_string(),
        "a second `low_pass`; give each effect once"
    );
}

#[test]
fn sets_hold_one_of_each_kind_in_order() {
    let mut set = EffectSet::new();
    assert_eq!(set.insert(example(EffectKind::LowPass)), None);
    assert_eq!(set.insert(example(EffectKind::LeverArm)), None);
    assert_eq!(
        set.insert(Effect::neutral(EffectKind::LowPass)),
        Some(example(EffectKind::LowPass))
    );
    assert_eq!(
        set.iter().map(Effect::kind).collect::<Vec<_>>(),
        [EffectKind::LeverArm, EffectKind::LowPass]
    );
    assert_eq!(set.without(EffectKind::LowPass).len(), 1);
    assert!(set.contains(EffectKind::LowPass) && !set.contains(EffectKind::Vibration));
    assert_eq!(
        set.remove(EffectKind::LeverArm),
        Some(example(EffectKind::LeverArm))
    );
    assert_eq!(set.remove(EffectKind::LeverArm), None);
    assert!(!set.is_empty() && set.get(EffectKind::LeverArm).is_none());
}

/// A vibration beside a drift that the other set alone has is the same one at the same stamps.
#[test]
fn vibration_goes_by_the_stamps_where_a_drift_is_left_out() {
    let mut wave = vec![28.0, 1.0, 0.5, 2.0, 0.3, 1.0, 2.0];
    wave.extend([0.1, 0.2, 0.3, 2.0, 1.0, 0.5]);
    let vibration = |values| Effect::new(EffectKind::Vibration, values).unwrap();
    let offset = Effect::time_offset(0.002).unwrap();
    let mut fitted = EffectSet::new().with(vibration(wave));
    fitted.insert(offset.clone());
    fitted.insert(Effect::new(EffectKind::ClockDrift, vec![25.0]).unwrap());
    for kept in [EffectSet::new(), EffectSet::new().with(offset)] {
        let mut own = kept.with(Effect::neutral(EffectKind::Vibration));
        own.take_values_of(&fitted);
        let line = |set: &EffectSet, stamp: f64| {
            let clock = super::clock_drift::Clock::of(set);
            let effect = set.get(EffectKind::Vibration).unwrap();
            effect
                .spectral_line()
                .unwrap()
                .at(clock.true_seconds(stamp))
        };
        for stamp in [0.0, 31.7, 118.3] {
            let (one, other) = (line(&own, stamp), line(&fitted, stamp));
            assert!((one.specific_force - other.specific_force).norm() < 1e-9);
            assert!((one.angular_velocity - other.angular_velocity).norm() < 1e-9);
        }
    }
}
