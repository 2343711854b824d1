#![allow(clippy::unwrap_used)]
use cromosim_spatial::PoseDensities;

use super::*;
use crate::EffectKind;

const YAML: &str = "schema: cromosim/effects/1
placements:
  wrist:
    epoch: 1700000000.123456789
    declared_noise: {accel_density: 0.0014, gyro_density: 1.2e-7}
    effects:
      - {effect: lever_arm, offset: [0.05, 0.0, -0.06]}
      - {effect: mount_slip, at: 1700000030.250000000, rotvec: [0.1, 0.0, 0.2]}
      - {effect: gyro_g_sensitivity, matrix: [[0.001, 0.0, 0.0], [0.0, 0.0, 1.0e-9], [0.0, 0.0, 0.0]]}
      - {effect: gravity_convention, mode: removed}
    unexplained: {accel_variance: 0.0021, gyro_variance: 1.2e-5, accel_reference_excess: 0.25, gyro_reference_excess: 0.0, accel_late: 0.0, gyro_late: -0.001, accel_late_per_second: 2.4e-5, gyro_late_per_second: 0.0}
    other_sessions:
      - epoch: 1690000000.000000000
        effects:
          - {effect: lever_arm, offset: [0.05, 0.0, -0.06]}
          - {effect: time_offset, seconds: 0.021}
      - epoch: 1690009000.500000000
        effects: []
";

#[test]
fn a_recording_takes_the_effects_of_its_session() {
    let file = EffectsFile::parse(YAML, "effects.yaml").unwrap();
    let wrist = &file.placements["wrist"];
    let epoch_at = |seconds: i64| {
        let start = Stamp::from_nanos(seconds * 1_000_000_000);
        let own = wrist.in_session_of(start);
        assert!(own.other_sessions.is_empty());
        assert_eq!(own.unexplained, wrist.unexplained);
        (own.epoch.nanos / 1_000_000_000, own.effects.len())
    };
    assert_eq!(
        epoch_at(1_600_000_000),
        (1_690_000_000, 2),
        "before all of them: the first"
    );
    assert_eq!(
        epoch_at(1_690_000_000),
        (1_690_000_000, 2),
        "at its very start"
    );
    assert_eq!(epoch_at(1_690_009_001), (1_690_009_000, 0));
    assert_eq!(epoch_at(1_700_000_001), (1_700_000_000, 4));
    assert_eq!(epoch_at(1_800_000_000), (1_700_000_000, 4));
}

#[test]
fn an_optional_parameter_goes_without_saying_where_it_is_neutral() {
    let text = |smoothing: &str| {
        format!(
            "schema: cromosim/effects/1\nplacements:\n  wrist:\n    epoch: 1700000000.000000000\n    \
             declared_noise: {{accel_density: 0.0014, gyro_density: 1.2e-7}}\n    effects:\n      \
             - {{effect: reference_smoothing, {smoothing}}}\n"
        )
    };
    for (given, written) in [
        ("cutoff_hz: 4.5", "cutoff_hz: 4.5"),
        ("cutoff_hz: 4.5, kernel: butterworth", "cutoff_hz: 4.5"),
        (
            "cutoff_hz: 4.5, kernel: gaussian",
            "cutoff_hz: 4.5, kernel: gaussian",
        ),
    ] {
        let file = EffectsFile::parse(&text(given), "effects.yaml").unwrap();
        assert_eq!(file.to_yaml(), text(written));
    }
    let refused = refusal(&text("cutoff_hz: 4.5, kernel: boxcar"));
    assert!(refused.contains("butterworth, gaussian"), "{refused}");
    let refused = refusal(&text("kernel: gaussian"));
    assert!(refused.contains("cutoff_hz"), "{refused}");
}

fn refusal(text: &str) -> String {
    EffectsFile::parse(text, "effects.yaml")
        .unwrap_err()
        .to_string()
}

#[test]
fn files_come_back_to_the_last_digit() {
    let file = EffectsFile::parse(YAML, "effects.yaml").unwrap();
    assert_eq!(file.to_yaml(), YAML);
    let wrist = &file.placements["wrist"];
    assert_eq!(wrist.epoch.nanos, 1_700_000_000_123_456_789);
    assert_eq!(
        wrist
            .effects
            .get(EffectKind::GravityConvention)
            .unwrap()
            .values(),
        [1.0]
    );
    let mut all = file.clone();
    let response = MotionResponse {
        hz: vec![0.5, 7.0],
        position: vec![1.0, 0.9],
        rotation: vec![1.0, 1.05],
        learnt_from: None,
    };
    let sessions = &mut all.placements.get_mut("wrist").unwrap().other_sessions;
    sessions[1].reference_response = Some(response.clone());
    for kind in EffectKind::ALL {
        all.placements
            .get_mut("wrist")
            .unwrap()
            .effects
            .insert(Effect::neutral(kind));
    }
    all.placements.insert(
        "no".to_owned(),
        PlacementEffects {
            epoch: Stamp::from_nanos(-5),
            effects: EffectSet::new(),
            magnetometer: Some(Magnetometer {
                hard_iron: Vector3::new(5e-6, -2e-6, 1e-7),
                delay: -0.01,
                ..Magnetometer::default()
            }),
            field_in_world: Some(Vector3::new(0.0, 1.9e-5, -4.5e-5)),
            reference_response: Some(MotionResponse {
                learnt_from: Some(PoseDensities {
                    position: vec![2e-4, 3.5e-11],
                    rotation: vec![0.1, 0.0],
                }),
                ..response
            }),
            ..wrist.clone()
        },
    );
    assert_eq!(EffectsFile::parse(&all.to_yaml(), "again").unwrap(), all);
    assert_eq!(
        EffectsFile::parse(&EffectsFile::default().to_yaml(), "none").unwrap(),
        EffectsFile::default()
    );
}

#[test]
fn a_matrix_may_be_flat_and_the_order_of_effects_is_free() {
    let flat = YAML.replace(
        "[[0.001, 0.0, 0.0], [0.0, 0.0, 1.0e-9], [0.0, 0.0, 0.0]]",
        "[0.001, 0, 0, 0, 0, 1e-9, 0, 0, 0]",
    );
    assert_eq!(EffectsFile::parse(&flat, "f").unwrap().to_yaml(), YAML);
    let mut lines: Vec<&str> = YAML.lines().collect();
    lines.swap(6, 9);
    assert_eq!(
        EffectsFile::parse(&lines.join("\n"), "f")
            .unwrap()
            .to_yaml(),
        YAML
    );
}

#[test]
fn epochs_are_read_to_the_nanosecond() {
    for (text, nanos) in [
        ("0.5", 500_000_000),
        ("-0.5", -500_000_000),
        ("7", 7_000_000_000),
        ("1.0000000015", 1_000_000_002),
        ("1.5e0", 1_500_000_000),
    ] {
        assert_eq!(nanoseconds(text), Some(nanos), "{text}");
    }
    for text in ["", "x", "1.x", ".nan", "1e300"] {
        assert_eq!(nanoseconds(text), None, "{text}");
    }
}

#[test]
fn refusals_name_file_placement_effect_and_field() {
    for (from, to, expected) in [
        (
            "offset: [0.05, 0.0, -0.06]",
            "offset: [0.05, 0.0]",
            "lever_arm: offset: expected a list of three numbers",
        ),
        (
            "offset: [0.05, 0.0, -0.06]",
            "offset: [0.05, 0.0, .nan]",
            "lever_arm: offset: NaN is out of range",
        ),
        (
            "offset: [0.05, 0.0, -0.06]",
            "ofset: [0.05, 0.0, -0.06]",
            "lever_arm: unknown field `ofset`",
        ),
        (
            ", offset: [0.05, 0.0, -0.06]",
            "",
            "lever_arm: offset: expected once",
        ),
        (
            "effect: lever_arm",
            "effect: lever",
            "unknown effect `lever`; the nearest is lever_arm",
        ),
        (
            "effect: lever_arm, offset: [0.05, 0.0, -0.06]",
            "effect: unknown",
            "`unknown`",
        ),
        (
            "mode: removed",
            "mode: gone",
            "gravity_convention: mode: expected one of kept, removed, negated",
        ),
        (
            "effect: mount_slip, at: 1700000030.250000000, rotvec: [0.1, 0.0, 0.2]",
            "effect: lever_arm, offset: [0, 0, 0]",
            "second `lever_arm`",
        ),
    ] {
        let message = refusal(&YAML.replacen(from, to, 1));
        println!("{message}");
        assert!(
            message.starts_with("effects.yaml: placements.wrist") && message.contains(expected),
            "{message}"
        );
        assert_eq!(message.lines().count(), 1);
    }
    assert!(
        refusal(&YAML.replace("0.0014", "-1")).contains("placement `wrist`: accel_density: -1")
    );
    assert!(refusal(&YAML.replace("1700000000.123456789", "soon")).contains("epoch: `soon`"));
    assert!(refusal(&YAML.replace("effects/1", "effects/2")).contains("cromosim/effects/2"));
    assert!(refusal(&YAML.replace("epoch", "epok")).contains("epok"));
}

#[test]
fn a_response_that_makes_no_sense_is_refused() {
    for (response, words) in [
        (
            "{hz: [], accel: [], gyro: []}",
            "hz: expected increasing frequencies from 0 on",
        ),
        (
            "{hz: [2, 1], accel: [1, 1], gyro: [1, 1]}",
            "hz: expected increasing frequencies",
        ),
        (
            "{hz: [1, 2], accel: [1], gyro: [1, 1]}",
            "accel: expected 2 factors, one for each of hz, found 1",
        ),
        (
            "{hz: [1, 2], accel: [1, 1], gyro: [1, -0.5]}",
            "gyro: expected factors from 0 to 10, found -0.5",
        ),
        (
            "{hz: [1], accel: [1], gyro: [1], position_density: [1e-9]}",
            "rotation_density: expected beside position_density",
        ),
        (
            "{hz: [1], accel: [1], gyro: [1], rotation_density: [1e-9]}",
            "position_density: expected beside rotation_density",
        ),
        (
            "{hz: [1], accel: [1], gyro: [1], position_density: [], rotation_density: [1]}",
            "position_density: expected 1 densities, one for each of hz, found 0",
        ),
        (
            "{hz: [1], accel: [1], gyro: [1], position_density: [1], rotation_density: [-1]}",
            "rotation_density: expected densities from 0 on, found -1",
        ),
    ] {
        let text = YAML.replacen(
            "    unexplained:",
            &format!("    reference_response: {response}\n    unexplained:"),
            1,
        );
        let refused = EffectsFile::parse(&text, "e.yaml").unwrap_err().to_string();
        let place = "e.yaml: placement `wrist`: reference_response: ";
        assert!(
            refused.starts_with(place) && refused.contains(words),
            "{refused}"
        );
    }
}
