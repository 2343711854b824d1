#![allow(clippy::unwrap_used)]
use cromosim_recording::datasets::ActivitySpan;
use nalgebra::Vector3;

use super::*;

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_seconds(100.0 + seconds)
}

/// Both devices at 100 Hz over the seconds given, the watch without those in `gap`.
fn recording(seconds: f64, gap: std::ops::Range<f64>) -> DatasetRecording {
    let imu = |placement: &str, silent: std::ops::Range<f64>| {
        let mut imu = PlacedImu {
            placement: placement.to_owned(),
            ..PlacedImu::default()
        };
        for k in 0..(seconds * 100.0) as u32 {
            let t = f64::from(k) / 100.0;
            if !silent.contains(&t) {
                imu.series.stamps.push(stamp(t));
                imu.series.specific_force.push(Vector3::new(t, 0.0, 9.8));
                imu.series.angular_velocity.push(Vector3::zeros());
            }
        }
        imu
    };
    let span = |activity: &str, from: f64, to: f64| ActivitySpan {
        start: stamp(from),
        end: stamp(to),
        activity: activity.to_owned(),
    };
    DatasetRecording {
        imus: vec![
            imu("pocket", 0.0..0.0),
            imu("nose", 0.0..0.0),
            imu("wrist", gap),
        ],
        activities: vec![
            span("SEATED", 0.0, 2.99),
            span("WALKING", 3.0, 5.99),
            span("hopping", 6.0, 8.0),
        ],
        ..DatasetRecording::default()
    }
}

const GRID: WindowGrid = WindowGrid {
    rate_hz: 30,
    low_pass_hz: 10.0,
    window: 30,
    hop: 15,
};

#[test]
fn silence_of_one_device_cuts_both() {
    let recording = recording(8.0, 3.5..4.5);
    let placements = common_placements([&recording, &recording].into_iter());
    assert_eq!(placements, ["pocket", "wrist"]);
    let stretches = stretches_without_gaps(&recording, &placements);
    let ends: Vec<(f64, f64)> = stretches
        .iter()
        .map(|(start, devices)| (*start - stamp(0.0), *devices[1].seconds.last().unwrap()))
        .collect();
    assert_eq!(ends.len(), 2);
    assert!(
        (ends[0].0, ends[1].0) == (0.0, 4.5)
            && (ends[0].1 - 3.49).abs() < 1e-9
            && (ends[1].1 - 3.49).abs() < 1e-9,
        "{ends:?}"
    );
    // A short silence does not.
    assert_eq!(
        stretches_without_gaps(&self::recording(8.0, 3.5..3.7), &placements).len(),
        1
    );
}

#[test]
fn windows_know_when_they_were_and_what_is_unknown_is_left_out() {
    let activities = Activities::five();
    let subject = subject(
        "s".to_owned(),
        &[recording(8.0, 0.0..0.0)],
        &["pocket".to_owned(), "wrist".to_owned()],
        &activities,
        &GRID,
    );
    // Wgap windows from 0, 0.5, ... 7: those that begin before 2.5 are seated, from 2.5 to 5
    // walking (2.5 half of each: none), then hopping.
    let classes: Vec<&str> = subject
        .windows
        .labels
        .iter()
        .map(|label| activities.classes()[usize::from(*label)].as_str())
        .collect();
    assert_eq!(
        classes.iter().filter(|class| **class == "SEATED").count(),
        5
    );
    assert!(
        classes.iter().filter(|class| **class == "WALKING").count() >= 5 && classes.len() <= 12,
        "{classes:?}"
    );
    // The third window begins at 1 s; its first value is the force's x there.
    assert!(
        (subject.windows.window(2)[0] - 1.0).abs() < 0.02,
        "{}",
        subject.windows.window(2)[0]
    );
    assert_eq!(subject.stretches.len(), 1);
}

#[test]
fn people_are_told_by_files_or_folders() {
    let name = |path: &str, format| subject_name(Path::new(path), format);
    assert_eq!(
        name("a/subject101.dat", DatasetFormat::Pamap2),
        "subject101"
    );
    assert_eq!(
        name(
            "x/proband7/data/acc_walking_csv.zip",
            DatasetFormat::RealWorld
        ),
        "proband7"
    );
    assert_eq!(
        name("me/acc_walking_csv.zip", DatasetFormat::RealWorld),
        "me"
    );
}
