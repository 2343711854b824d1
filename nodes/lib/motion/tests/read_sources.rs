//! Acclaim and marker files through `read_motion`: by content, with what lies beside them, with
//! what the options say.
#![allow(clippy::unwrap_used)]

mod common;

use common::acclaim::{Acclaim, cmu_bones};
use common::known::{joint_shift, rest, y_up};
use common::marker_files::{Kind, c3d, trc};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{
    MarkerClip, MarkerSet, MotionFormat, MotionOptions, SkeletonMap, SmplMotion, embedded_walk,
    parse_c3d, place_markers, read_motion,
};
use nalgebra::Vector3;

fn message(path: &std::path::Path, options: &MotionOptions) -> String {
    let message = read_motion(path, options).unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

fn walk() -> SmplMotion {
    embedded_walk().slice(1.0, Some(1.5)).unwrap()
}

/// Two people, millimetres, y up; the second one two metres beside the first.
fn two_people() -> MarkerClip {
    let set = MarkerSet::embedded().unwrap().remove(0);
    let mut clip = place_markers(&walk(), &BodyModel::embedded(), &set).unwrap();
    let own = clip.labels.clone();
    clip.labels = own
        .iter()
        .map(|label| format!("Ann:{label}"))
        .chain(own.iter().map(|label| format!("Bob:{label}")))
        .collect();
    clip.labels.push("*79".to_owned());
    for frame in &mut clip.frames {
        let beside: Vec<_> = frame
            .iter()
            .map(|point| point.map(|point| point + Vector3::new(0.0, 2.0, 0.0)))
            .collect();
        frame.extend(beside);
        frame.push(Some(nalgebra::Point3::new(1.0, 1.0, 1.0)));
        frame
            .iter_mut()
            .for_each(|point| *point = point.map(|point| y_up() * point));
    }
    clip
}

#[test]
fn amc_files_find_their_skeleton() {
    let folder = tempfile::tempdir().unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let acclaim = Acclaim {
        bones: cmu_bones(),
        body: &body,
        joint_shift: joint_shift(),
        rest: rest(0.0, 0.0, 20.0, 0.0),
        unit_m: 0.0254 / 0.45,
        degrees: true,
    };
    let amc = folder.path().join("02_01.txt");
    std::fs::write(&amc, acclaim.amc(&walk().frames, y_up())).unwrap();
    assert!(message(&amc, &MotionOptions::default()).ends_with(
        "its skeleton is not beside it (no ASF file there); set skeleton to the ASF file"
    ));
    let other = folder.path().join("0.asf");
    std::fs::write(&other, acclaim.asf()).unwrap();
    assert!(message(&amc, &MotionOptions::default()).contains("not beside it (only 0.asf)"));
    let named = read_motion(
        &amc,
        &MotionOptions {
            skeleton: Some(other.clone()),
            rate_hz: Some(100.0),
            ..Default::default()
        },
    )
    .unwrap();
    std::fs::copy(&other, folder.path().join("02.ASF")).unwrap();
    let found = read_motion(&amc, &MotionOptions::default()).unwrap();
    assert_eq!(
        (found.rate_hz, named.rate_hz, found.frames.len()),
        (120.0, 100.0, 151)
    );
    assert_eq!(
        found.frames[70].local_rotations,
        named.frames[70].local_rotations
    );
    assert_eq!(found.report.unwrap().map, "cmu_asf");
    assert!(
        message(&other, &MotionOptions::default())
            .contains("an Acclaim skeleton has no motion; give the AMC file")
    );
}

#[test]
fn markers_are_read_by_subject() {
    let folder = tempfile::tempdir().unwrap();
    let clip = two_people();
    let c3d_file = folder.path().join("people.bvh");
    std::fs::write(&c3d_file, c3d(&clip, Kind::IntelFloat, 4)).unwrap();
    let trc_file = folder.path().join("people.trc");
    std::fs::write(&trc_file, trc(&clip)).unwrap();
    assert!(
        message(&c3d_file, &MotionOptions::default())
            .contains("subject none asked for, the file has Ann, Bob; set subject")
    );
    let of = |path: &std::path::Path, subject: &str| {
        read_motion(
            path,
            &MotionOptions {
                subject: Some(subject.to_owned()),
                ..Default::default()
            },
        )
        .unwrap()
    };
    let (ann, bob) = (of(&c3d_file, "Ann"), of(&trc_file, "Bob"));
    for (motion, beside) in [(&ann, 0.0), (&bob, 2.0)] {
        let report = motion.markers.clone().unwrap();
        println!("{report}");
        assert_eq!(
            (
                report.up_axis.as_str(),
                report.unit_scale_m,
                report.subjects.len()
            ),
            ("+y", 0.001, 2)
        );
        assert_eq!(
            (
                report.markers.len(),
                report.absent.len(),
                report.unknown.as_slice()
            ),
            (39, 0, &["*79".to_owned()][..])
        );
        assert_eq!((motion.frames.len(), motion.rate_hz), (151, 100.0));
        for (found, known) in motion.frames.iter().zip(walk().frames) {
            let known = known.root_position + Vector3::new(0.0, beside, 0.0);
            assert!(
                (found.root_position - known).norm() < 0.008,
                "{} {known}",
                found.root_position
            );
        }
        assert!(
            report.rms_m < 0.002
                && motion
                    .confidence
                    .as_ref()
                    .unwrap()
                    .iter()
                    .all(|confidence| *confidence > 0.999)
        );
    }
    let part = read_motion(
        &trc_file,
        &MotionOptions {
            subject: Some("ann".to_owned()),
            start_s: 0.5,
            duration_s: Some(0.25),
            ..Default::default()
        },
    );
    assert_eq!(part.unwrap().frames.len(), 26);
}

#[test]
fn own_marker_sets_come_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.c3d");
    let set = MarkerSet::embedded().unwrap().remove(0);
    let mut clip = place_markers(&walk(), &BodyModel::embedded(), &set).unwrap();
    clip.labels
        .iter_mut()
        .for_each(|label| *label = format!("m_{label}"));
    std::fs::write(&path, c3d(&clip, Kind::MipsFloat, 0)).unwrap();
    let found = message(&path, &MotionOptions::default());
    assert!(
        found.contains(
            "0 of the 39 markers of set plug_in_gait found, 12 needed; labels there: m_C7, m_CLAV"
        ),
        "{found}"
    );
    let yaml = include_str!("../marker_sets/plug_in_gait.yaml")
        .replace("name: plug_in_gait", "name: mine")
        .replace("\n  L", "\n  m_L");
    let own = folder.path().join("mine.yaml");
    std::fs::write(&own, yaml.replace("\n  m_LANK", "\n  m_LANK2")).unwrap();
    let options = MotionOptions {
        marker_set: Some(own.display().to_string()),
        placements_as_given: true,
        ..Default::default()
    };
    let report = read_motion(&path, &options).unwrap().markers.unwrap();
    assert_eq!(
        (
            report.marker_set.as_str(),
            report.markers.len(),
            report.absent.len(),
            report.unknown.len()
        ),
        ("mine", 16, 23, 23)
    );
    assert!(report.markers.iter().all(|marker| marker.moved_m == 0.0));
    let unknown = message(
        &path,
        &MotionOptions {
            marker_set: Some("rizzoli".to_owned()),
            ..Default::default()
        },
    );
    assert_eq!(
        unknown,
        "marker set rizzoli is neither a file nor one of plug_in_gait"
    );
    let feet = message(
        &path,
        &MotionOptions {
            unit_scale_m: Some(0.003),
            ..options.clone()
        },
    );
    assert!(feet.contains("set unit_scale_m"), "{feet}");
}

#[test]
fn marker_sets_are_checked() {
    let yaml = "name: a\ndescription: b\nheight_mm: 9.5\nmarkers:\n  X: ";
    let error = |marker: &str| {
        MarkerSet::from_yaml(&format!("{yaml}{marker}\n"), "own.yaml")
            .unwrap_err()
            .to_string()
    };
    assert!(
        error("{site: c7, vertex: 3}").starts_with(
            "own.yaml: key markers.X: expected one of site, vertex, triangle and from"
        )
    );
    assert!(error("{triangle: 3}").contains("triangle and barycentrics belong together"));
    assert!(error("{from: head}").contains("from and direction belong together"));
    assert!(error("{from: nose, direction: [0, 0, 1]}").contains("SMPL has no joint nose"));
    assert!(error("{from: head, direction: [0, 0, 0]}").contains("a direction that is not 0"));
    assert!(error("{site: c7, height_mm: -1}").contains("height_mm is not from 0 to 200"));
    assert!(error("{sight: c7}").contains("unknown field"));
    let body = BodyModel::embedded();
    let set = MarkerSet::from_yaml(
        &format!("{yaml}{{site: nose}}\n  Y: {{vertex: 100}}\n  Z: {{vertex: 99999}}\n"),
        "own.yaml",
    )
    .unwrap();
    assert!(
        set.markers()[0]
            .site_on(&body, "a")
            .unwrap_err()
            .to_string()
            .contains("nose")
    );
    let site = set.markers()[1].site_on(&body, "a").unwrap();
    let corner = site
        .barycentrics
        .iter()
        .position(|weight| *weight == 1.0)
        .unwrap();
    assert_eq!(body.triangle(&site).unwrap()[corner], 100);
    assert!(set.markers()[2].site_on(&body, "a").is_err());
    // Every marker of the embedded set is on the skin where its name says: left ones left, on the
    // joint they are named after.
    let plug_in_gait = MarkerSet::embedded().unwrap().remove(0);
    assert_eq!(plug_in_gait.markers().len(), 39);
    let shaped = ShapedBody::new(body.clone(), &[]).unwrap();
    for marker in plug_in_gait.markers() {
        let site = marker.site_on(&body, "plug_in_gait").unwrap();
        let place = shaped.site_in_model(&site).unwrap();
        let side = if ["C7", "T10", "CLAV", "STRN"].contains(&marker.label.as_str()) {
            place.x.abs() < 0.02
        } else {
            place.x
                * if marker.label.starts_with('L') {
                    1.0
                } else {
                    -1.0
                }
                > 0.03
        };
        assert!(side, "{} {place}", marker.label);
    }
}

#[test]
fn formats_are_told_by_their_content() {
    let cases: [(&[u8], Option<MotionFormat>); 9] = [
        (b" \n hierarchy\nROOT", Some(MotionFormat::Bvh)),
        (b"# AST/ASF file\n:version 1.10\n", Some(MotionFormat::Asf)),
        (
            b"#!OML:ASF H.ASF\n:FULLY-SPECIFIED\n:DEGREES\n1\n",
            Some(MotionFormat::Amc),
        ),
        (b"1\nroot 0 0 0 0 0 0\n", Some(MotionFormat::Amc)),
        (
            b"PathFileType\t4\t(X/Y/Z)\ta.trc\n",
            Some(MotionFormat::Trc),
        ),
        (b"1\n2\n3\n", None),
        (b"\x02P", None),
        (b"\xff\xfe", None),
        (b"", None),
    ];
    for (bytes, format) in cases {
        assert_eq!(MotionFormat::of(bytes), format, "{bytes:?}");
    }
    let text = format!("{:600}", "OPENPOSE");
    assert_eq!(
        MotionFormat::of(text.as_bytes()),
        None,
        "its second letter is C3D's key"
    );
    let sample = std::fs::read(common::own_file("ez.c3d")).unwrap();
    assert_eq!(MotionFormat::of(&sample), Some(MotionFormat::C3d));
    assert!(parse_c3d(&sample, "ez.c3d").is_ok());
    assert!(
        SkeletonMap::embedded()
            .unwrap()
            .iter()
            .any(|map| map.name() == "cmu_asf")
    );
}
