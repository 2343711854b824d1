//! What is repeated of a measurement is what a whole one gives.
#![allow(clippy::unwrap_used)]

use cromosim_spatial::uniform_stamps;

use super::super::model_tests::{START, set, track};
use super::*;
use crate::{Effect, EffectSet, Search};

/// Each fitted value one step away from where it is, or as much to the other side of it at a bound.
fn steps_away(effect: &Effect) -> Effect {
    let mut values = effect.values().to_vec();
    let mut first = 0;
    for parameter in effect.kind().spec().parameters {
        let count = parameter.shape.count();
        if let Some(fit) = parameter.fit {
            for value in &mut values[first..first + count] {
                let is_within = (parameter.lower..=parameter.upper).contains(&(*value + fit.step));
                *value += if is_within { fit.step } else { -fit.step };
            }
        }
        first += count;
    }
    effect.with_values(values).unwrap()
}

#[test]
fn another_value_of_an_effect_repeats_what_it_changes() {
    use EffectKind as Kind;
    let motion = track(3.0);
    let first = START.plus_seconds(0.0123);
    let stamps = uniform_stamps(first, first.plus_seconds(2.8), 100.0).unwrap();
    let without_turns = set(&[
        (Kind::LeverArm, &[0.05, 0.0, -0.06]),
        (Kind::SoftTissue, &[9.0, 0.2]),
        (Kind::TimeOffset, &[0.021]),
        (Kind::ChannelDelay, &[0.004]),
        (Kind::AccelScale, &[1.01, 0.98, 1.03]),
        (
            Kind::Vibration,
            &[
                31.0, 0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 0.01, 0.0, 0.02, 0.3, 0.0, 1.0,
            ],
        ),
    ]);
    let coupled = without_turns
        .clone()
        .with(Effect::new(Kind::GyroGSensitivity, vec![1e-3; 9]).unwrap());
    let slip = Effect::new(
        Kind::MountSlip,
        vec![START.as_seconds() + 1.5, 0.1, 0.2, 0.0],
    )
    .unwrap();
    let slipped = without_turns.clone().with(slip.clone());
    let both = coupled.clone().with(slip);
    for base in [EffectSet::new(), without_turns, coupled, slipped, both] {
        let staged = StagedReadings::new(&SensorModel::new(&base, START), &motion, &stamps);
        for kind in Kind::ALL {
            if !matches!(kind.spec().search, Search::Fitted(_)) {
                continue;
            }
            let now = base
                .get(kind)
                .cloned()
                .unwrap_or_else(|| Effect::neutral(kind));
            let other = base.clone().with(steps_away(&now));
            let model = SensorModel::new(&other, START);
            let repeated = staged.with_other(kind, &model, &motion, &stamps);
            let whole = StagedReadings::new(&model, &motion, &stamps).readings;
            assert!(repeated == whole, "{kind} beside {base:?}");
        }
    }
}

#[test]
fn a_slip_at_another_time_repeats_what_lies_between() {
    use EffectKind as Kind;
    let motion = track(3.0);
    let first = START.plus_seconds(0.0123);
    let stamps = uniform_stamps(first, first.plus_seconds(2.8), 100.0).unwrap();
    let others = set(&[
        (Kind::TimeOffset, &[0.021]),
        (Kind::ChannelDelay, &[-0.037]),
        (Kind::GyroScale, &[1.01, 0.98, 1.03]),
    ]);
    let filtered = others
        .clone()
        .with(Effect::new(Kind::LowPass, vec![12.0]).unwrap());
    let coupled = filtered
        .clone()
        .with(Effect::new(Kind::GyroGSensitivity, vec![1e-3; 9]).unwrap());
    for base in [EffectSet::new(), others, filtered, coupled] {
        let slipping_at = |seconds: f64| {
            let values = vec![START.as_seconds() + seconds, 0.1, 0.2, 0.0];
            let slip = Effect::new(Kind::MountSlip, values).unwrap();
            SensorModel::new(&base.clone().with(slip), START)
        };
        let own = slipping_at(1.5);
        let staged = StagedReadings::new(&own, &motion, &stamps);
        for seconds in [-1.0, 0.5, 1.2, 1.5, 1.503, 1.9, 2.79, 9.0] {
            let other = slipping_at(seconds);
            let whole = StagedReadings::new(&other, &motion, &stamps).readings;
            let repeated = staged.with_other_slip(&own, &other, &stamps);
            assert!(repeated == whole, "at {seconds} beside {base:?}");
        }
    }
}
