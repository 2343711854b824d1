//! Units beside what makes a reference poor.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_imu::EffectKind as K;
use support::Scene;
use support::judge::{answer, names, names_exactly};
use support::motion::Motion;

#[test]
fn frames_in_other_units_are_told_from_a_device_in_other_units() {
    for (units, seed) in [(1000.0, 21), (39.370_078_740_157_48, 22)] {
        let scene = Scene::new(seed)
            .with(K::ReferenceUnits, &[units])
            .with(K::ReferenceInterpolation, &[11.9]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

#[test]
fn a_smoothed_reference_is_in_metres() {
    // What is left of the acceleration is 1 / 2.4 to 1 / 2.8: as of inches beside thousandths of g.
    for (cutoff_hz, seed) in [(0.86, 23), (0.89, 24), (0.92, 25)] {
        let scene = Scene {
            motion: Motion::swing(1.0),
            ..Scene::new(seed)
        };
        let scene = scene.with(K::ReferenceSmoothing, &[cutoff_hz, 0.0]);
        let diagnosis = answer(&scene.record()).diagnosis;
        let named = names(&diagnosis);
        for other in ["reference_units", "accel_units", "gravity_convention"] {
            assert!(!named.contains(&other), "{cutoff_hz} Hz: {named:?}");
        }
    }
}

#[test]
fn three_reversed_axes_are_no_negated_gravity() {
    // The force follows the reference by slopes below zero as well as the reversed reference by slopes above.
    for seed in 41..46 {
        let reversed = [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0];
        let scene = Scene::new(seed).with(K::AxisConvention, &reversed);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
        // A gyroscope that tells the axes wrongly.
        let scene = scene.with(K::GyroMisalignment, &[0.07, -0.07, 0.07]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

#[test]
fn axes_are_told_where_the_body_turns_about_one_of_them_alone() {
    // Two reflections, of which the first takes what is up to where down is, and a rotation.
    let conventions = [
        [-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0],
    ];
    for axes in conventions {
        let scene = Scene {
            motion: Motion::turning_about_one_axis(),
            ..Scene::new(63)
        };
        let scene = scene
            .with(K::AxisConvention, &axes)
            .with(K::AccelMisalignment, &[-0.03, 0.02, 0.03]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

#[test]
fn a_lever_arm_of_hardly_any_of_the_gap_is_named_where_it_is_significant() {
    // Beside other units next to nothing of the gap is its own: 14 and 36 standard errors, by slow motion.
    for (metres, others) in [(0.002, vec![]), (0.005, vec!["lever_arm"])] {
        let scene = Scene {
            motion: Motion::random(61).slowed(3.0),
            ..Scene::new(61)
        };
        let scene = scene
            .with(K::GyroUnits, &[1.0_f64.to_degrees()])
            .with(K::LeverArm, &[metres, metres, -metres]);
        let mut expected = others;
        expected.insert(0, "gyro_units");
        assert_eq!(names(&answer(&scene.record()).diagnosis), expected);
    }
}
