//! Names in files and of other nodes reach the terminal as text, never as commands to it.
#![allow(clippy::unwrap_used)]

mod common;

use cromosim_bag::{BagOptions, BagWriter, Topic};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;

use common::{cromosim_in, text};

/// Clears the screen, sets the title, hides a line behind another, writes from right to left.
const HOSTILE: &str =
    "/imu/a\u{1b}[2J\u{1b}]0;owned\u{7}\rb\u{9b}31m\u{202e}\nerror: fine/data_raw";

#[test]
fn topics_types_and_metadata_cannot_steer_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let mut bag =
        BagWriter::create(&folder.path().join("hostile.mcap"), BagOptions::default()).unwrap();
    let topic = Topic {
        name: HOSTILE.to_owned(),
        ..Topic::for_message::<Imu>("/x")
    };
    let id = bag.add_topic(&topic).unwrap();
    let payload = [0; 400];
    for nanos in 0..3 {
        let stamp = Stamp::from_nanos(nanos);
        bag.write_payload(id, &payload, stamp, stamp).unwrap();
    }
    bag.attach(HOSTILE, "text/plain", Stamp::default(), b"x")
        .unwrap();
    let values = [(format!("a.{HOSTILE}"), HOSTILE.to_owned())];
    bag.write_metadata(HOSTILE, values.into()).unwrap();
    bag.finish().unwrap();
    for arguments in [
        ["inspect", "hostile.mcap"].as_slice(),
        &["bag", "csv", "hostile.mcap", "/missing"],
        &["bag", "csv", "hostile.mcap", HOSTILE],
        &["compare", "hostile.mcap", "hostile.mcap"],
        &["diagnose", "hostile.mcap"],
        &[
            "simulate",
            "--reference",
            "hostile.mcap",
            "--out",
            "out.mcap",
        ],
    ] {
        let output = cromosim_in(folder.path(), arguments);
        let said = text(&output);
        let steering: Vec<char> = said
            .chars()
            .filter(|&character| {
                character.is_control() && !matches!(character, '\n' | '\t')
                    || character == '\u{202e}'
            })
            .collect();
        assert!(
            steering.is_empty(),
            "{arguments:?}: {steering:?} in {said:?}"
        );
        assert!(!said.contains("\nerror: fine"), "{arguments:?}: {said}");
        if arguments[0] == "inspect" {
            assert!(
                output.status.success() && said.contains(r"a\u{1b}[2J"),
                "{said}"
            );
            assert_eq!(said.lines().count(), 6, "{said}");
        }
    }
}
