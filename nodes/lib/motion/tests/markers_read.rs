//! C3D and TRC: samples of other writers, files made here in every format, and wrong ones.
#![allow(clippy::unwrap_used)]

mod common;

use common::marker_files::{Kind, c3d, trc};
use common::own_file;
use cromosim_motion::{
    MarkerClip, MotionFormat, parse_c3d, parse_motive_markers, parse_trc, parse_vicon_markers,
};
use nalgebra::Point3;

/// Three markers, four frames; the second marker is not seen in the third frame.
fn clip() -> MarkerClip {
    let point = |frame: usize, marker: usize| {
        let place = Point3::new(
            0.5 + 0.01 * frame as f64,
            -0.25 * marker as f64,
            1.0 + 0.125 * marker as f64,
        );
        (frame != 2 || marker != 1).then_some(place)
    };
    MarkerClip {
        name: "made".to_owned(),
        rate_hz: 120.0,
        unit_scale_m: 0.001,
        labels: ["Bob:LFHD", "Bob:RFHD", "*3"].map(str::to_owned).to_vec(),
        frames: (0..4)
            .map(|frame| (0..3).map(|marker| point(frame, marker)).collect())
            .collect(),
    }
}

fn assert_same(read: &MarkerClip, made: &MarkerClip, tolerance_m: f64) {
    assert_eq!(
        (read.rate_hz, &read.labels, read.frames.len()),
        (made.rate_hz, &made.labels, made.frames.len())
    );
    for (ours, theirs) in read
        .frames
        .iter()
        .flatten()
        .zip(made.frames.iter().flatten())
    {
        match (ours, theirs) {
            (Some(ours), Some(theirs)) => {
                assert!((ours - theirs).norm() <= tolerance_m, "{ours} {theirs}")
            }
            (ours, theirs) => assert_eq!(ours, theirs),
        }
    }
}

#[test]
fn samples_of_other_writers() {
    for name in ["ez.c3d", "pyc3d.c3d"] {
        let clip = parse_c3d(&std::fs::read(own_file(name)).unwrap(), name).unwrap();
        assert_eq!(
            (
                clip.labels.join(" ").as_str(),
                clip.rate_hz,
                clip.unit_scale_m
            ),
            ("LASI RASI LPSI RPSI", 100.0, 0.001)
        );
        assert_eq!((clip.frames.len(), clip.frames[0].len()), (5, 4));
        assert!(
            clip.frames
                .iter()
                .flatten()
                .flatten()
                .all(|point| point.coords.amax() < 10.0)
        );
    }
    let [ez, py] = ["ez.c3d", "pyc3d.c3d"]
        .map(|name| parse_c3d(&std::fs::read(own_file(name)).unwrap(), name).unwrap());
    // One of twenty points is marked as not seen.
    for clip in [&ez, &py] {
        let points = || clip.frames.iter().flatten();
        let missing = points().filter(|point| point.is_none()).count();
        assert_eq!(20 * missing, points().count(), "{}", clip.name);
    }
    // Written by a rule: coordinates 30 mm on from marker to marker, a millimetre from frame to
    // frame.
    for (frame, points) in py.frames.iter().enumerate() {
        for (marker, point) in points.iter().enumerate() {
            let Some(point) = point else { continue };
            let x = (frame + 30 * marker) as f64;
            assert!(
                (point - Point3::new(x, x + 10.0, x + 20.0) * 0.001).norm() < 1e-9,
                "{frame} {marker} {point}"
            );
        }
    }
}

#[test]
fn every_kind_of_number_is_read() {
    let clip = clip();
    for kind in [
        Kind::IntelFloat,
        Kind::IntelInteger,
        Kind::DecFloat,
        Kind::DecInteger,
        Kind::MipsFloat,
        Kind::MipsInteger,
    ] {
        for analog in [0, 6] {
            let bytes = c3d(&clip, kind, analog);
            assert_same(
                &parse_c3d(&bytes, "made.c3d").unwrap(),
                &clip,
                if kind.is_integer() { 5e-5 } else { 1e-7 },
            );
        }
    }
    assert_same(&parse_trc(&trc(&clip), "made.trc").unwrap(), &clip, 1e-6);
    let spaces = trc(&MarkerClip {
        frames: clip.frames[..2].to_vec(),
        ..clip.clone()
    })
    .replace('\t', "  ");
    assert_eq!(parse_trc(&spaces, "made.trc").unwrap().frames.len(), 2);
    assert_same(
        &parse_trc(&trc(&clip).replace('\n', "\r\n"), "made.trc").unwrap(),
        &clip,
        1e-6,
    );
}

/// More than 255 labels go on in LABELS2, more than 65 535 frames in TRIAL.
#[test]
fn large_counts_are_read() {
    let labels: Vec<String> = (0..300).map(|number| format!("M{number}")).collect();
    let frames = vec![vec![Some(Point3::new(1.0, 2.0, 3.0)); 300]];
    let many = MarkerClip {
        labels,
        frames,
        ..clip()
    };
    assert_same(
        &parse_c3d(&c3d(&many, Kind::IntelFloat, 0), "many.c3d").unwrap(),
        &many,
        1e-6,
    );
    let frames = vec![vec![Some(Point3::new(1.0, 2.0, 3.0))]; 70_000];
    let long = MarkerClip {
        labels: vec!["A".to_owned()],
        frames,
        ..clip()
    };
    assert_same(
        &parse_c3d(&c3d(&long, Kind::IntelInteger, 0), "long.c3d").unwrap(),
        &long,
        1e-4,
    );
}

#[test]
fn subjects_are_told_apart() {
    let mut clip = clip();
    assert_eq!(clip.subjects(), ["Bob"]);
    assert_eq!(
        clip.labels_of(None).unwrap(),
        [Some("LFHD"), Some("RFHD"), Some("*3")]
    );
    clip.labels[1] = "Ann:LFHD".to_owned();
    assert_eq!(
        clip.labels_of(Some("ann")).unwrap(),
        [None, Some("LFHD"), Some("*3")]
    );
    assert_eq!(
        clip.labels_of(None).unwrap_err().to_string(),
        "made: subject none asked for, the file has Ann, Bob; set subject to one of them"
    );
    assert!(
        clip.labels_of(Some("Eve"))
            .unwrap_err()
            .to_string()
            .contains("subject Eve asked for, the file has Ann, Bob")
    );
    let slip = clip.labels_of(Some("Anne")).unwrap_err().to_string();
    assert!(slip.ends_with("; the nearest is Ann"), "{slip}");
}

#[test]
fn errors_name_file_and_place() {
    let (clip, text) = (clip(), trc(&clip()));
    let bytes = c3d(&clip, Kind::IntelFloat, 0);
    let of_c3d = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes.clone();
        change(&mut bytes);
        parse_c3d(&bytes, "a.c3d").unwrap_err().to_string()
    };
    let of_trc = |text: &str| parse_trc(text, "a.trc").unwrap_err().to_string();
    let cases = [
        (
            of_c3d(&|bytes| bytes.truncate(100)),
            "a.c3d, byte 0: expected a C3D header of 512 bytes (second byte 0x50), found 100 bytes",
        ),
        (
            of_c3d(&|bytes| bytes[0] = 200),
            "a.c3d, byte 101888: expected the parameter section that byte 0 points at, found the end",
        ),
        (
            of_c3d(&|bytes| bytes[515] = 83),
            "a.c3d, byte 515: expected processor 84 (Intel), 85 (DEC) or 86 (MIPS), found 83",
        ),
        (
            of_c3d(&|bytes| bytes.truncate(bytes.len() - 400)),
            "a.c3d, byte 1024: expected 4 frames (at least 1) of 48 bytes, found 2 frames",
        ),
        (
            of_trc(""),
            "a.trc, line 1: expected PathFileType, found the end of the file",
        ),
        (
            of_trc(&text.replace("DataRate", "Rate")),
            "a.trc, line 2: expected DataRate",
        ),
        (
            of_trc(&text.replace("\tmm\t", "\tleague\t")),
            "a.trc, line 3: expected Units of mm, cm, m, in or ft, found \"league\"",
        ),
        (
            of_trc(&text.replace("120.000", "0")),
            "a.trc: rate_hz is 0, expected 0.1 to 100000 Hz",
        ),
        (
            of_trc(&text.replace("\t4\t3\t", "\t5\t3\t")),
            "a.trc, line 10: expected 5 frames (as line 3 says), found 4",
        ),
        (
            of_trc(&text.replace("\t4\t3\t", "\t4\t2\t")),
            "a.trc, line 4: expected 2 labels (as line 3 says), found \"3 labels\"",
        ),
        (
            of_trc(&text.replace("\t4\t3\t", "\t4\t30000\t")),
            "a.trc, line 3: more than 10000 markers",
        ),
        (
            of_trc(&text.replace("\t500.00", "\t5oo.00")),
            "a.trc, line 7: expected a coordinate, found \"5oo.",
        ),
        (
            of_trc(&format!("{} 7\t8\n", text.trim_end())),
            "a.trc, line 10: expected",
        ),
    ];
    for (found, expected) in cases {
        assert!(
            found.starts_with(expected),
            "expected {expected}\n   found {found}"
        );
    }
}

/// Cells of a frame in millimetres; empty where a marker was not seen.
fn millimetres(frame: &[Option<Point3<f64>>]) -> Vec<String> {
    let cells = |point: &Option<Point3<f64>>| match point {
        Some(point) => point
            .coords
            .iter()
            .map(|part| format!("{:.4}", 1000.0 * part))
            .collect(),
        None => vec![String::new(); 3],
    };
    frame.iter().flat_map(cells).collect()
}

/// As Vicon's Nexus writes trajectories, behind segments.
fn vicon(clip: &MarkerClip) -> String {
    let names: Vec<String> = clip
        .labels
        .iter()
        .map(|label| format!("{label},,"))
        .collect();
    let count = clip.labels.len();
    let mut text = format!(
        "Segments\r\n100\r\n,,a:a,,,,,\r\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\r\n,,deg,deg,deg,mm,mm,mm\r\n1,0,0,0,0,0,0,0\r\n\r\n\
         Trajectories\r\n{}\r\n,,{}\r\nFrame,Sub Frame{}\r\n,{}\r\n",
        clip.rate_hz,
        names.join(","),
        ",X,Y,Z".repeat(count),
        ",mm,mm,mm".repeat(count)
    );
    for (index, frame) in clip.frames.iter().enumerate() {
        text += &format!("{},0,{}\r\n", index + 1, millimetres(frame).join(","));
    }
    text
}

/// As OptiTrack's Motive writes markers, beside a rigid body's.
fn motive(clip: &MarkerClip) -> String {
    let thrice = |words: Vec<String>| -> String {
        let words = words.iter().map(|word| format!(",{word}").repeat(3));
        words.collect()
    };
    let kinds = clip.labels.iter().map(|_| "Marker".to_owned()).collect();
    let mut text = format!(
        "Format Version,1.23,Capture Frame Rate,{0},Export Frame Rate,{0},Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n\
         ,Type,Rigid Body Marker,Rigid Body Marker,Rigid Body Marker{1}\n,Name,b,b,b{2}\n,ID,1,1,1{2}\n,,Position,Position,Position{3}\nFrame,Time (Seconds),X,Y,Z{4}\n",
        clip.rate_hz,
        thrice(kinds),
        thrice(clip.labels.clone()),
        ",Position".repeat(3 * clip.labels.len()),
        ",X,Y,Z".repeat(clip.labels.len())
    );
    for (index, frame) in clip.frames.iter().enumerate() {
        let time = index as f64 / clip.rate_hz;
        text += &format!("{index},{time:.6},9,9,9,{}\n", millimetres(frame).join(","));
    }
    text
}

#[test]
fn tables_of_capture_systems_come_back() {
    let made = clip();
    let text = vicon(&made);
    assert_eq!(MotionFormat::of(text.as_bytes()), Some(MotionFormat::Vicon));
    assert_same(&parse_vicon_markers(&text, "v.csv").unwrap(), &made, 1e-6);
    let semicolons = text.replace(',', ";");
    assert_same(
        &parse_vicon_markers(&semicolons, "v.csv").unwrap(),
        &made,
        1e-6,
    );
    let text = motive(&made);
    assert_eq!(
        MotionFormat::of(text.as_bytes()),
        Some(MotionFormat::Motive)
    );
    assert_same(&parse_motive_markers(&text, "m.csv").unwrap(), &made, 1e-6);
}

#[test]
fn what_is_wrong_with_a_table_is_said() {
    let (vicon, motive) = (vicon(&clip()), motive(&clip()));
    for (from, to, expected) in [
        (
            "Trajectories",
            "Markers",
            "v.csv, line 1: expected a section called Trajectories; export markers, found none",
        ),
        (
            "Trajectories\r\n120",
            "Trajectories\r\nfast",
            "v.csv, line 9: expected a rate in Hz, found fast",
        ),
        ("Trajectories\r\n120", "Trajectories\r\n0", "v.csv: rate_hz"),
        (
            ",X,Y,Z,X,Y,Z,X,Y,Z",
            ",A,B,C",
            "v.csv, line 11: expected columns X, Y, Z below a marker's name, found none",
        ),
        (
            "\r\n,,mm",
            "\r\n,,miles",
            "v.csv, line 12: expected mm, cm or m, found miles",
        ),
        (
            "1,0,500.0000",
            "1,0,five",
            "v.csv, line 13: expected a coordinate, found five",
        ),
    ] {
        assert!(vicon.contains(from), "{from}");
        let damaged = vicon.replacen(from, to, 1);
        let said = parse_vicon_markers(&damaged, "v.csv").unwrap_err();
        assert!(said.to_string().starts_with(expected), "{said}");
    }
    for (from, to, expected) in [
        (
            "Millimeters",
            "Miles",
            "m.csv, line 1: expected length units such as Meters, found Miles",
        ),
        (
            "\nFrame,",
            "\nFrames,",
            "m.csv, line 1: expected a row of columns that begins with Frame, found none",
        ),
        (
            "9,9,9,500.0000",
            "9,9,9,five",
            "m.csv, line 8: expected a coordinate",
        ),
    ] {
        assert!(motive.contains(from), "{from}");
        let damaged = motive.replacen(from, to, 1);
        let said = parse_motive_markers(&damaged, "m.csv").unwrap_err();
        assert!(said.to_string().starts_with(expected), "{said}");
    }
    for sample in [&vicon, &motive] {
        common::damaged(sample.as_bytes(), 500, |bytes| {
            let text = String::from_utf8_lossy(bytes);
            for read in [
                parse_vicon_markers(&text, "x"),
                parse_motive_markers(&text, "x"),
            ] {
                match read {
                    Ok(clip) => assert!(
                        clip.frames
                            .iter()
                            .all(|frame| frame.len() == clip.labels.len())
                    ),
                    Err(said) => assert!(said.to_string().starts_with('x'), "{said}"),
                }
            }
        });
    }
}
