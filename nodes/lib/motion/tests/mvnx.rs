//! MVNX: a known motion written as MVN writes one, and read back; what is wrong is said with its
//! line.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;

use common::known::known_motion;
use common::quantile;
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_motion::{
    MotionFormat, MotionOptions, Mvnx, SmplMotion, embedded_walk, parse_mvnx, read_motion, retarget,
};
use cromosim_spatial::PoseSource;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// MVN's segments and the joints of SMPL that they begin at; T12, which SMPL has none of, stands
/// between the two around it.
const SEGMENTS: [(&str, Joint); 23] = [
    ("Pelvis", Joint::Pelvis),
    ("L5", Joint::Spine1),
    ("L3", Joint::Spine2),
    ("T12", Joint::Spine2),
    ("T8", Joint::Spine3),
    ("Neck", Joint::Neck),
    ("Head", Joint::Head),
    ("RightShoulder", Joint::RightCollar),
    ("RightUpperArm", Joint::RightShoulder),
    ("RightForeArm", Joint::RightElbow),
    ("RightHand", Joint::RightWrist),
    ("LeftShoulder", Joint::LeftCollar),
    ("LeftUpperArm", Joint::LeftShoulder),
    ("LeftForeArm", Joint::LeftElbow),
    ("LeftHand", Joint::LeftWrist),
    ("RightUpperLeg", Joint::RightHip),
    ("RightLowerLeg", Joint::RightKnee),
    ("RightFoot", Joint::RightAnkle),
    ("RightToe", Joint::RightFoot),
    ("LeftUpperLeg", Joint::LeftHip),
    ("LeftLowerLeg", Joint::LeftKnee),
    ("LeftFoot", Joint::LeftAnkle),
    ("LeftToe", Joint::LeftFoot),
];

/// SMPL's segments have x left, y up, z forward, MVN's x forward, y left, z up.
fn smpl_from_mvn() -> UnitQuaternion<f64> {
    let columns = Matrix3::from_columns(&[Vector3::z(), Vector3::x(), Vector3::y()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

fn written(motion: &SmplMotion, body: &ShapedBody) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<mvnx xmlns=\"http://www.xsens.com/mvn/mvnx\" version=\"4\">\n<mvn version=\"2021.0\"/>\n\
         <subject label=\"one\" frameRate=\"{}\" segmentCount=\"24\" recDateMSecsSinceEpoch=\"1700000000250\">\n<segments>\n",
        motion.rate_hz
    );
    for (number, (label, _)) in SEGMENTS.iter().enumerate() {
        writeln!(
            text,
            "<segment label=\"{label}\" id=\"{}\"><points><point label=\"p\"><pos_b>0 0 0</pos_b></point></points></segment>",
            number + 1
        )
        .unwrap();
    }
    text += "<segment label=\"Prop1\" id=\"24\"/>\n</segments>\n<fingerTrackingSegmentsLeft><segment label=\"LeftCarpus\"/></fingerTrackingSegmentsLeft>\n<sensors/>\n<frames>\n";
    text += "<frame time=\"0\" index=\"\" type=\"identity\"><orientation>1 0 0 0</orientation><position>0 0 0</position></frame>\n";
    for (index, pose) in motion.frames.iter().enumerate() {
        let world_from_segments = body.world_from_segments(pose);
        let (mut turns, mut places) = (String::new(), String::new());
        for (label, joint) in SEGMENTS {
            let world_from_segment = world_from_segments[joint.index()];
            let turn = world_from_segment.rotation * smpl_from_mvn();
            let mut place = world_from_segment.translation.vector;
            if label == "T12" {
                let next = world_from_segments[Joint::Spine3.index()];
                place = (place + next.translation.vector) / 2.0;
            }
            write!(
                turns,
                "{:.6} {:.6} {:.6} {:.6} ",
                turn.w, turn.i, turn.j, turn.k
            )
            .unwrap();
            write!(places, "{:.6} {:.6} {:.6} ", place.x, place.y, place.z).unwrap();
        }
        writeln!(
            text,
            "<frame time=\"{}\" index=\"{index}\" type=\"normal\" ms=\"0\">\n<orientation>{turns} 1 0 0 0</orientation>\n<position>{places} 0 0 0</position>\n</frame>",
            (1000.0 * index as f64 / motion.rate_hz).round()
        )
        .unwrap();
    }
    text + "</frames>\n</subject>\n</mvnx>\n"
}

#[test]
fn a_known_motion_comes_back() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let known = known_motion(true);
    let text = written(&known, &body);
    assert_eq!(MotionFormat::of(text.as_bytes()), Some(MotionFormat::Mvnx));
    let mvnx = parse_mvnx(&text, "suit.mvnx").unwrap();
    assert_eq!(
        (mvnx.segments.len(), mvnx.frames.len(), mvnx.start_ms),
        (24, known.frames.len(), Some(1_700_000_000_250))
    );
    let clip = mvnx.clip().unwrap();
    assert_eq!(clip.joints().len(), 23);
    let read = retarget(&clip, body.model(), &MotionOptions::default()).unwrap();
    let report = read.report.clone().unwrap();
    assert_eq!(read.frames.len(), known.frames.len(), "{report}");
    assert!(report.to_string().contains("mvn"), "{report}");
    assert_eq!(read.source(), PoseSource::InertialSuit);
    let mut all = Vec::new();
    for (a, b) in read.frames.iter().zip(&known.frames) {
        for (one, other) in a.local_rotations.iter().zip(&b.local_rotations) {
            all.push(one.angle_to(other).to_degrees());
        }
    }
    let (median, high) = (quantile(&all, 0.5), quantile(&all, 0.95));
    println!("median {median:.3} deg, 95 % {high:.3} deg; {report}");
    assert!(median < 0.6 && high < 2.5, "median {median}, 95 % {high}");
    let way = |motion: &SmplMotion| {
        let ends = [
            motion.frames.first().unwrap(),
            motion.frames.last().unwrap(),
        ];
        ends[1].root_position - ends[0].root_position
    };
    assert!((way(&read) - way(&known)).norm() < 0.02);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("suit.xml");
    std::fs::write(&path, text).unwrap();
    let whole = read_motion(&path, &MotionOptions::default()).unwrap();
    assert_eq!(whole.frames.len(), read.frames.len());
}

/// The sample is what is written here of the walk's first second.
#[test]
fn the_sample_is_the_walk() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let mut walk = embedded_walk();
    walk.frames.truncate(walk.rate_hz as usize);
    let path = common::own_file("suit.mvnx");
    if std::env::var_os("CROMOSIM_MAKE_SAMPLES").is_some() {
        std::fs::write(&path, written(&walk, &body)).unwrap();
    }
    let read = read_motion(&path, &MotionOptions::default()).unwrap();
    assert_eq!(read.frames.len(), walk.frames.len());
    for (a, b) in read.frames.iter().zip(&walk.frames) {
        for (one, other) in a.local_rotations.iter().zip(&b.local_rotations) {
            assert!(one.angle_to(other).to_degrees() < 0.5);
        }
    }
}

/// Two segments, one sensor, two frames.
const SMALL: &str = "<mvnx version=\"4\">
<subject frameRate=\"60\">
<segments><segment label=\"Pelvis\"/><segment label=\"L5\"/></segments>
<sensors><sensor label=\"Pelvis\"/></sensors>
<frames>
<frame type=\"tpose\"><orientation>9 9</orientation></frame>
<frame type=\"normal\" index=\"0\"><orientation>1 0 0 0 1 0 0 0</orientation><position>0 0 1 0 0 1.1</position>
<sensorFreeAcceleration>0.1 0.2 0.3</sensorFreeAcceleration><sensorOrientation>0 1 0 0</sensorOrientation></frame>
<frame type=\"normal\" index=\"1\"><orientation>1 0 0 0 1 0 0 0</orientation><position>0 0 1 0 0 1.1</position>
<sensorFreeAcceleration>0.1 0.2 0.3</sensorFreeAcceleration><sensorOrientation>0 1 0 0</sensorOrientation></frame>
</frames></subject></mvnx>
";

#[test]
fn sensors_are_read_beside_segments() {
    let mvnx = parse_mvnx(SMALL, "small.mvnx").unwrap();
    assert_eq!(mvnx.frames, [0, 1]);
    assert_eq!(
        mvnx.sensor_free_accelerations,
        [Vector3::new(0.1, 0.2, 0.3); 2]
    );
    assert_eq!(mvnx.sensor_orientations.len(), 2);
    assert!(
        (mvnx.sensor_orientations[0].i - 1.0).abs() < 1e-15,
        "w x y z"
    );
    assert!(mvnx.angular_velocities.is_empty());
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    for (from, to, expected) in [
        (
            "frameRate=\"60\"",
            "",
            "line 2: expected a frameRate of 1 to 10000 Hz, found \"\"",
        ),
        (
            "frameRate=\"60\"",
            "frameRate=\"nan\"",
            "line 2: expected a frameRate",
        ),
        (
            "index=\"1\"",
            "index=\"2\"",
            "line 9: expected frame 1, so that none is missing; export all frames, found frame 2",
        ),
        (
            "index=\"1\"",
            "index=\"x\"",
            "line 9: expected a frame's whole number as index, found \"x\"",
        ),
        (
            "<position>0 0 1 0 0 1.1<",
            "<position>0 0 1 0 0<",
            "line 7: expected 6 numbers of position (3 for each of 2), found 5",
        ),
        (
            "<position>0 0 1 0 0 1.1<",
            "<position>0 0 1 0 0 one<",
            "line 7: expected a number of position, found \"one\"",
        ),
        (
            "<position>0 0 1 0 0 1.1</position>",
            "",
            "line 8: expected position in every frame, found a frame without",
        ),
        (
            "1 0 0 0 1 0 0 0",
            "1 0 0 0 1 0 1 0",
            "line 7: expected quaternions (w x y z) of length 1 within 0.01",
        ),
        ("</frames>", "</frame>", "line 11: expected well-formed XML"),
        (
            "type=\"normal\" index=\"0\"",
            "type=\"npose\"",
            "line 9: expected",
        ),
        ("<segments>", "<segment>", "expected"),
    ] {
        assert!(SMALL.contains(from));
        let damaged = SMALL.replacen(from, to, 1);
        match parse_mvnx(&damaged, "small.mvnx") {
            Ok(read) => assert_eq!(
                (from, read.frames.len()),
                ("type=\"normal\" index=\"0\"", 1)
            ),
            Err(error) => {
                let said = error.to_string();
                assert!(
                    said.starts_with("small.mvnx, line ") && said.contains(expected),
                    "{said}"
                );
                assert!(!said.contains('\n'), "{said}");
            }
        }
    }
    let none = SMALL.replace("type=\"normal\"", "type=\"tpose\"");
    let said = parse_mvnx(&none, "small.mvnx").unwrap_err().to_string();
    assert!(
        said.contains("expected frames of type normal, found none"),
        "{said}"
    );
    let props = SMALL.replace("Pelvis", "Prop1");
    let said = parse_mvnx(&props, "small.mvnx")
        .unwrap()
        .clip()
        .unwrap_err();
    assert!(
        said.to_string()
            .contains("small.mvnx: no segment Pelvis; there are Prop1, L5"),
        "{said}"
    );
}

/// All lists fit the labels and the frames.
fn assert_sound(mvnx: &Mvnx) {
    let (frames, segments, sensors) = (mvnx.frames.len(), mvnx.segments.len(), mvnx.sensors.len());
    assert!(frames > 0 && segments > 0);
    assert_eq!(
        [mvnx.orientations.len(), mvnx.positions.len()],
        [frames * segments; 2]
    );
    for (found, expected) in [
        (mvnx.angular_velocities.len(), frames * segments),
        (mvnx.sensor_orientations.len(), frames * sensors),
        (mvnx.sensor_free_accelerations.len(), frames * sensors),
    ] {
        assert!(found == 0 || found == expected);
    }
}

#[test]
fn damaged_files_are_refused_by_name_or_hold_sound_values() {
    let mut counts = [0; 2];
    common::damaged(SMALL.as_bytes(), 1000, |bytes| {
        match parse_mvnx(&String::from_utf8_lossy(bytes), "x") {
            Ok(mvnx) => {
                assert_sound(&mvnx);
                let _ = mvnx.clip();
                counts[1] += 1;
            }
            Err(error) => {
                assert!(error.to_string().starts_with('x'), "{error}");
                counts[0] += 1;
            }
        }
    });
    println!("{counts:?}");
    assert!(counts[0] > 100 && counts[1] > 10, "{counts:?}");
}
