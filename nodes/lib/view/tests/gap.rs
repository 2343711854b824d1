//! What stands in the recording of a diagnosis, read back with the SDK's own decoder.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;

use cromosim_spatial::Stamp;
use cromosim_view::{GapCoursePoint, GapPlacement, GapSpectrum, ViewError, write_gap};
use re_sdk::StoreKind;
use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};

fn placement(name: &str) -> GapPlacement {
    let course = |k: i32| GapCoursePoint {
        seconds: f64::from(k) + 0.5,
        accel: [400.0, 1.1],
        gyro: [20.0, 0.9],
    };
    let line = |name: &str, level: f64| {
        (
            name.to_owned(),
            (0..=50).map(|k| level / (1.0 + f64::from(k))).collect(),
        )
    };
    GapPlacement {
        name: name.to_owned(),
        words: format!("# {name}\n\nThe sensor sits elsewhere."),
        stamps: (0..200)
            .map(|k| Stamp::from_nanos(1_700_000_000_000_000_000 + k * 10_000_000))
            .collect(),
        measured: vec![[1.0; 6]; 200],
        before: vec![[0.5; 6]; 200],
        after: vec![[0.9; 6]; 200],
        course: (0..2).map(course).collect(),
        spectra: vec![GapSpectrum {
            title: "accel_x".to_owned(),
            frequencies: (0..=50).map(f64::from).collect(),
            lines: vec![
                line("measured", 1.0),
                line("before", 0.1),
                line("after", 0.01),
                line("predicted", 0.0),
            ],
        }],
    }
}

#[test]
fn a_diagnosis_is_curves_words_pictures_and_a_layout() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diagnosis.rrd");
    write_gap(
        &path,
        "diagnosis",
        "# Summary",
        &[placement("left/wrist"), placement("head")],
    )
    .unwrap();
    let (mut rows, mut layout, mut activations) = (
        BTreeMap::<String, usize>::new(),
        BTreeMap::<String, usize>::new(),
        0,
    );
    for message in DecoderApp::decode_eager(BufReader::new(File::open(&path).unwrap())).unwrap() {
        match message.unwrap() {
            LogMsg::ArrowMsg(store, message) => {
                let chunk = Chunk::from_arrow_msg(&message).unwrap();
                let counts = if store.kind() == StoreKind::Blueprint {
                    &mut layout
                } else {
                    &mut rows
                };
                *counts.entry(chunk.entity_path().to_string()).or_default() += chunk.num_rows();
            }
            LogMsg::BlueprintActivationCommand(_) => activations += 1,
            LogMsg::SetStoreInfo(_) => {}
        }
    }
    assert_eq!(activations, 1);
    // One static row says how the lines look.
    assert_eq!(rows["/gap/head/curves/accel_x"], 201);
    assert_eq!(rows[r"/gap/left\/wrist/residual/gyro_z"], 201);
    assert_eq!(rows["/gap/head/course/gyro"], 3);
    for path in [
        "/gap/summary",
        "/gap/head/words",
        "/gap/head/spectrum/0/lines",
        "/gap/head/spectrum/0/grid",
        "/gap/head/spectrum/0/legend",
    ] {
        assert!(rows.contains_key(path), "{path}: {rows:?}");
    }
    // Of each placement: words, a picture, six curves, six residuals, two courses.
    let views = layout
        .keys()
        .filter(|path| path.ends_with("/ViewContents"))
        .count();
    assert_eq!(views, 1 + 2 * (1 + 1 + 6 + 6 + 2));
}

#[test]
fn little_and_wrong_evidence() {
    let folder = tempfile::tempdir().unwrap();
    let empty = GapPlacement {
        name: "head".to_owned(),
        ..GapPlacement::default()
    };
    write_gap(&folder.path().join("empty.rrd"), "diagnosis", "", &[empty]).unwrap();
    let mut wrong = placement("head");
    wrong.after.pop();
    let error = write_gap(&folder.path().join("wrong.rrd"), "diagnosis", "", &[wrong]).unwrap_err();
    assert_eq!(error.to_string(), "after: expected 200, found 199");
    let error = write_gap(&folder.path().join("none/x.rrd"), "diagnosis", "", &[]).unwrap_err();
    assert!(matches!(error, ViewError::Create { .. }), "{error}");
}
