#![allow(clippy::unwrap_used)]
use super::*;

fn examples(value: impl Fn(usize) -> f32, labels: &[u8]) -> Examples {
    let mut examples = Examples::new(10, 6);
    for (window, label) in labels.iter().enumerate() {
        examples.push(
            &(0..60)
                .map(|k| value(window * 60 + k) + f32::from(*label))
                .collect::<Vec<_>>(),
            *label,
        );
    }
    examples
}

fn noise(k: usize) -> f32 {
    ((k as f32 * 12.9898).sin() * 43_758.547).fract()
}

#[test]
fn training_subjects_are_the_others_and_grow_with_the_share() {
    for tested in 0..12 {
        let subjects = |share| training_subjects(12, tested, share, 3);
        assert_eq!(
            [0.1, 0.25, 0.5, 1.0].map(|share| subjects(share).len()),
            [1, 3, 6, 11]
        );
        assert!(
            !subjects(1.0).contains(&tested)
                && subjects(0.1)
                    .iter()
                    .all(|subject| subjects(0.25).contains(subject))
        );
    }
    let ones: Vec<usize> = (0..12)
        .map(|tested| training_subjects(12, tested, 0.1, 3)[0])
        .collect();
    assert!(
        ones.iter().collect::<std::collections::BTreeSet<_>>().len() > 3,
        "{ones:?}"
    );
}

#[test]
fn channels_are_brought_to_mean_0_and_deviation_1_each_pool_counting_alike() {
    let (one, two) = (
        examples(noise, &[0; 4]),
        examples(|k| 5.0 + 3.0 * noise(k), &[0; 40]),
    );
    let mut pools = [one, two];
    let scaling = ChannelScaling::fit(&pools);
    pools
        .iter_mut()
        .for_each(|pool| scaling.apply(&mut pool.values));
    let moment = |power: i32| {
        pools
            .iter()
            .map(|pool| {
                pool.values
                    .iter()
                    .map(|value| value.powi(power))
                    .sum::<f32>()
                    / pool.values.len() as f32
            })
            .sum::<f32>()
            / 2.0
    };
    assert!(
        moment(1).abs() < 1e-4 && (moment(2) - 1.0).abs() < 1e-3,
        "{} {}",
        moment(1),
        moment(2)
    );
}

#[test]
fn turned_copies_are_the_same_motion_otherwise_worn() {
    let real = examples(noise, &[0, 1]);
    let copies = turned(&real, &["wrist".to_owned()], 1);
    assert_eq!(
        (copies.len(), copies.counts(2)),
        (2 * COPIES, vec![COPIES; 2])
    );
    let rows = |examples: &Examples, window: usize| {
        examples
            .window(window)
            .chunks(6)
            .map(|row| reading(row, 0))
            .collect::<Vec<_>>()
    };
    for window in 0..copies.len() {
        let (own, copied) = (rows(&real, window % 2), rows(&copies, window));
        for (one, other) in own.iter().zip(&copied) {
            assert!(
                (one.specific_force.norm() - other.specific_force.norm()).abs() < 1e-5
                    && (one.specific_force - other.specific_force).norm() > 1e-3
            );
            // Both sensors turn together, and all of a window does.
            assert!(
                (one.specific_force.dot(&one.angular_velocity)
                    - other.specific_force.dot(&other.angular_velocity))
                .abs()
                    < 1e-5
            );
            assert!(
                (one.specific_force.dot(&own[0].specific_force)
                    - other.specific_force.dot(&copied[0].specific_force))
                .abs()
                    < 1e-5
            );
        }
    }
    assert_ne!(copies.window(0), copies.window(2));
    assert_eq!(copies, turned(&real, &["wrist".to_owned()], 1));
}

#[test]
fn mapped_windows_have_the_real_distribution_whatever_the_mixture_of_classes() {
    // The same two classes, in other units and in another mixture.
    let mut windows = examples(noise, &[0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
    let real = examples(|k| noise(k + 7), &[0, 1, 1, 1]);
    let mut scaled = real.clone();
    scaled
        .values
        .iter_mut()
        .for_each(|value| *value = 4.0 * *value + 1.0);
    let before = windows.clone();
    map(&mut windows, &scaled, &["pocket".to_owned()], 3).unwrap();
    let mean = |examples: &Examples, label: u8| {
        let own = (0..examples.len())
            .filter(|index| examples.labels[*index] == label)
            .flat_map(|index| examples.window(index).to_vec());
        let own: Vec<f32> = own.collect();
        own.iter().sum::<f32>() / own.len() as f32
    };
    for label in [0, 1] {
        let (mapped, expected) = (mean(&windows, label), 4.0 * mean(&before, label) + 1.0);
        assert!(
            (mapped - expected).abs() < 0.8,
            "class {label}: {mapped} {expected}"
        );
    }
}
