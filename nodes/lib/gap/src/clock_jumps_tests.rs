use super::*;
use cromosim_imu::Reading;
use nalgebra::{UnitQuaternion, Vector3};

/// True time and stamp, s from the beginning.
type Stamped = (f64, f64);

/// Angle of a turn whose speed changes all the time, and that speed.
fn turned(t: f64) -> (f64, f64) {
    let angle = 0.4 * (0.9 * t).sin() + 0.3 * (0.13 * t * t / 6.0).sin();
    let speed = 0.36 * (0.9 * t).cos() + 0.3 * 0.26 / 6.0 * t * (0.13 * t * t / 6.0).cos();
    (angle, speed.abs())
}

fn record(reference: &[Stamped], imu: &[Stamped]) -> PlacementRecord {
    let stamp = |(_, seconds): &Stamped| {
        Stamp::from_nanos(1_700_000_000_000_000_000).plus_seconds(*seconds)
    };
    let mut poses = reference.to_vec();
    poses.sort_by(|a, b| a.1.total_cmp(&b.1));
    let rotation = |(t, _): &Stamped| UnitQuaternion::from_scaled_axis(Vector3::z() * turned(*t).0);
    let reading = |(t, _): &Stamped| Reading {
        angular_velocity: Vector3::x() * turned(*t).1,
        ..Reading::default()
    };
    PlacementRecord {
        name: "wrist".to_owned(),
        reference: PoseSeries {
            stamps: poses.iter().map(stamp).collect(),
            positions: vec![Vector3::zeros(); poses.len()],
            rotations: poses.iter().map(rotation).collect(),
        },
        imu: MeasuredImu {
            stamps: imu.iter().map(stamp).collect(),
            readings: imu.iter().map(reading).collect(),
            ..MeasuredImu::default()
        },
        set_back: Vec::new(),
        field: crate::record::MeasuredField::default(),
    }
}

/// A minute of messages at 100 Hz, with what is added to the stamp of each.
fn minute(step: impl Fn(usize) -> f64) -> Vec<Stamped> {
    let at = |k: usize| 0.01 * k as f64;
    (0..6000).map(|k| (at(k), at(k) + step(k))).collect()
}

#[test]
fn a_sound_record_is_one_part_as_it_is() {
    let even = minute(|_| 0.0);
    let dropouts: Vec<Stamped> = even
        .iter()
        .copied()
        .filter(|(t, _)| !(20.0..45.0).contains(t))
        .collect();
    for imu in [&even, &dropouts] {
        let parts = parts(&record(&even, imu));
        assert!(parts.parts.is_none() && parts.jumps.is_empty());
    }
}

#[test]
fn a_jump_is_undone_wherever_it_goes() {
    for by in [3600.0, 86400.0, -3600.0, -1.7e9, 5e7, 20.0, -20.0, -1.5] {
        let imu = minute(|k| if k < 2500 { 0.0 } else { by });
        let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
        let parts = parts.unwrap_or_default();
        assert_eq!((parts.len(), jumps.len()), (2, 1), "{by}: {jumps:?}");
        assert!(
            (jumps[0].by - by).abs() < 1e-3 && jumps[0].clock == "imu",
            "{jumps:?}"
        );
        assert!((jumps[0].at - 1_700_000_024.99).abs() < 1e-3, "{jumps:?}");
        let begins = parts[1].imu.stamps[0] - parts[0].imu.stamps[0];
        assert!((begins - 25.0).abs() < 1e-6, "{begins}");
        assert!(parts[1].reference.stamps.len() > 3400);
    }
}

#[test]
fn a_message_with_a_stray_stamp_has_its_place_between_its_neighbours() {
    let imu = minute(|k| if k == 3000 { -1.7e9 } else { 0.0 });
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
    let parts = parts.unwrap_or_default();
    assert_eq!((parts.len(), jumps.len()), (1, 1), "{jumps:?}");
    let mut stamps = parts[0].imu.stamps.clone();
    stamps.sort_unstable();
    let even = |pair: &[Stamp]| (pair[1] - pair[0] - 0.01).abs() < 1e-6;
    assert!(stamps.len() == 6000 && stamps.windows(2).all(even));
    assert_eq!((jumps[0].messages, jumps[0].diagnosed), (1, true));
    assert!((jumps[0].by + 1.7e9).abs() < 1e-3, "{jumps:?}");
}

#[test]
fn stray_stamps_where_messages_are_missing_are_left_out_and_said() {
    let mut imu = minute(|k| if k == 3000 { -1.7e9 } else { 0.0 });
    imu.drain(3001..3030);
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
    let parts = parts.unwrap_or_default();
    assert_eq!((parts.len(), jumps.len()), (1, 1), "{jumps:?}");
    assert_eq!((parts[0].imu.stamps.len(), jumps[0].messages), (5970, 1));
    assert!(!jumps[0].diagnosed && jumps[0].by < -1e9, "{jumps:?}");
}

#[test]
fn a_clock_that_is_set_late_is_undone_backwards() {
    let imu = minute(|k| if k < 1000 { -1.7e9 } else { 0.0 });
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
    let parts = parts.unwrap_or_default();
    assert_eq!((parts.len(), jumps.len()), (2, 1), "{jumps:?}");
    let begins = parts[1].imu.stamps[0] - parts[0].imu.stamps[0];
    assert!((begins - 10.0).abs() < 1e-5, "{begins}");
    assert!((jumps[0].by - 1.7e9).abs() < 1e-3, "{jumps:?}");
}

#[test]
fn stray_stamps_everywhere_are_one_finding() {
    // Never stamped, and now and then a counter that overflows.
    let stray = |k: usize| match k {
        _ if k % 40 == 7 => -1.7e9 - 0.01 * k as f64,
        _ if k % 97 == 5 => 1e8 + 100.0 * k as f64,
        _ => 0.0,
    };
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &minute(stray)));
    let parts = parts.unwrap_or_default();
    let strays = (0..6000).filter(|k| stray(*k) != 0.0).count();
    assert_eq!(parts.len(), 1, "{jumps:?}");
    assert_eq!(parts[0].imu.stamps.len(), 6000);
    let said: usize = jumps.iter().map(|jump| jump.messages).sum();
    assert_eq!((jumps.len(), said), (1, strays), "{jumps:?}");
}

#[test]
fn a_clock_that_is_set_forth_and_back_is_undone_between() {
    let imu = minute(|k| if (2000..4000).contains(&k) { 15.0 } else { 0.0 });
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
    let parts = parts.unwrap_or_default();
    let begins: Vec<f64> = parts
        .iter()
        .map(|part| part.imu.stamps[0] - parts[0].imu.stamps[0])
        .collect();
    assert_eq!(begins.len(), 3, "{jumps:?}");
    assert!((begins[1] - 20.0).abs() < 1e-5 && (begins[2] - 40.0).abs() < 1e-5);
    let by: Vec<f64> = jumps.iter().map(|jump| jump.by.round()).collect();
    assert_eq!(by, [15.0, -15.0]);
}

#[test]
fn clocks_that_are_set_all_the_time_make_no_more_than_so_many_parts() {
    let imu = minute(|k| 3600.0 * (k / 100) as f64);
    let Parts { parts, jumps } = parts(&record(&minute(|_| 0.0), &imu));
    assert_eq!(parts.map(|parts| parts.len()), Some(MOST_PARTS));
    let said: usize = jumps.iter().map(|jump| jump.messages).sum();
    assert_eq!(said, 5900, "{jumps:?}");
}

#[test]
fn stamps_that_mean_nothing_take_no_time() {
    let nonsense = |k: usize| ((k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33) as f64;
    let imu = minute(nonsense);
    let found = parts(&record(&imu, &imu));
    assert!(found.parts.is_none() && found.jumps.is_empty());
}

#[test]
fn a_jump_of_the_reference_is_called_so_and_undone() {
    for by in [3600.0, -3600.0, 86400.0] {
        let reference = minute(|k| if k < 4000 { 0.0 } else { by });
        let Parts { parts, jumps } = parts(&record(&reference, &minute(|_| 0.0)));
        let parts = parts.unwrap_or_default();
        assert_eq!((parts.len(), jumps.len()), (2, 1), "{jumps:?}");
        assert!(
            jumps[0].clock == "reference" && jumps[0].diagnosed && jumps[0].messages == 2000,
            "{jumps:?}"
        );
        assert!((jumps[0].by - by).abs() < 1e-3, "{jumps:?}");
        assert!((jumps[0].at - 1_700_000_039.99).abs() < 1e-3, "{jumps:?}");
        assert_eq!(parts[1].reference.stamps.len(), 2000);
        assert!(parts[1].imu.stamps.len() >= 1990);
        let begins = parts[1].reference.stamps[0] - parts[0].imu.stamps[0];
        assert!((begins - 40.0).abs() < 1e-6, "{begins}");
    }
}

#[test]
fn a_reference_that_was_not_measured_meanwhile_is_no_jump() {
    let late = |k: usize| if k < 3000 { 0.0 } else { 7200.0 };
    let first = &minute(|_| 0.0)[..3000];
    let Parts { parts, jumps } = parts(&record(&minute(late), first));
    assert_eq!(
        (parts.map(|parts| parts.len()), jumps.len()),
        (Some(1), 0),
        "{jumps:?}"
    );
}

#[test]
fn a_long_pause_is_no_jump() {
    let late = |k: usize| if k < 3000 { 0.0 } else { 7200.0 };
    let Parts { parts, jumps } = parts(&record(&minute(late), &minute(late)));
    assert_eq!(
        (parts.map(|parts| parts.len()), jumps.len()),
        (Some(2), 0),
        "{jumps:?}"
    );
}
