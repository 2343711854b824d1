//! Body files: what is written is read again, and every broken file gives one line that names file,
//! key and fault.
#![allow(clippy::unwrap_used, missing_docs)]

use std::io::{Cursor, Write};
use std::path::Path;

use cromosim_arrays::NpzReader;
use cromosim_body::{BodyError, BodyModel, BodyPose, Gender, ShapedBody, write_obj};
use nalgebra::Vector3;
use zip::write::SimpleFileOptions;

/// Vertices of the small body below.
const COUNT: usize = 6;

#[derive(Clone)]
struct Entry {
    key: &'static str,
    element: &'static str,
    fortran_order: bool,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

fn floats(key: &'static str, shape: &[usize], value: impl Fn(usize) -> f32) -> Entry {
    let bytes = (0..shape.iter().product())
        .flat_map(|i| value(i).to_le_bytes())
        .collect();
    Entry {
        key,
        element: "<f4",
        fortran_order: false,
        shape: shape.to_vec(),
        bytes,
    }
}

fn integers(key: &'static str, shape: &[usize], values: &[i64]) -> Entry {
    let bytes = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    Entry {
        key,
        element: "<i8",
        fortran_order: false,
        shape: shape.to_vec(),
        bytes,
    }
}

/// A sound SMPL file with few vertices.
fn small_body() -> Vec<Entry> {
    let mut kintree = vec![
        -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
    ];
    kintree.extend(0..24);
    vec![
        floats("v_template", &[COUNT, 3], |i| ((i * 7) % 11) as f32 * 0.1),
        floats("shapedirs", &[COUNT, 3, 2], |i| i as f32 * 0.01),
        floats("posedirs", &[COUNT, 3, 207], |i| {
            if i % 50 == 0 { 0.001 } else { 0.0 }
        }),
        floats("J_regressor", &[24, COUNT], |_| 1.0 / COUNT as f32),
        floats("weights", &[COUNT, 24], |i| {
            if i % 24 == (i / 24) % 5 { 1.0 } else { 0.0 }
        }),
        integers("kintree_table", &[2, 24], &kintree),
        integers("f", &[3, 3], &[0, 1, 2, 1, 2, 3, 3, 4, 5]),
    ]
}

fn archive(entries: &[Entry]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for entry in entries {
        zip.start_file(format!("{}.npy", entry.key), SimpleFileOptions::default())
            .unwrap();
        let sizes: String = entry.shape.iter().map(|size| format!("{size}, ")).collect();
        let order = if entry.fortran_order { "True" } else { "False" };
        let header = format!(
            "{{'descr': '{}', 'fortran_order': {order}, 'shape': ({sizes}), }}\n",
            entry.element
        );
        zip.write_all(b"\x93NUMPY\x01\x00").unwrap();
        zip.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        zip.write_all(header.as_bytes()).unwrap();
        zip.write_all(&entry.bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn read(bytes: Vec<u8>) -> Result<std::sync::Arc<BodyModel>, BodyError> {
    BodyModel::from_reader(Cursor::new(bytes), Path::new("people/bad.npz"))
}

/// The message about the small body with one entry changed.
fn message(key: &str, change: impl FnOnce(&mut Entry)) -> String {
    let mut entries = small_body();
    change(entries.iter_mut().find(|entry| entry.key == key).unwrap());
    one_line(read(archive(&entries)))
}

fn one_line(read: Result<std::sync::Arc<BodyModel>, BodyError>) -> String {
    let message = read.unwrap_err().to_string();
    assert!(
        !message.contains('\n') && message.starts_with("people/bad.npz: "),
        "{message}"
    );
    message
}

fn assert_names(message: &str, parts: &[&str]) {
    assert!(
        parts.iter().all(|part| message.contains(part)),
        "{message} should name {parts:?}"
    );
}

#[test]
fn the_small_body_is_sound() {
    let body = read(archive(&small_body())).unwrap();
    assert_eq!(
        (
            body.vertex_count(),
            body.faces().len(),
            body.beta_count(),
            body.id()
        ),
        (6, 3, 2, "bad")
    );
    assert_eq!(body.gender(), None);
    let shaped = ShapedBody::new(body, &[1.0, 1.0]).unwrap();
    assert!(
        (shaped.rest_vertices()[1] - Vector3::new(1.0 + 0.13, 0.6 + 0.17, 0.2 + 0.21)).norm()
            < 1e-6
    );
}

#[test]
fn missing_keys() {
    for key in [
        "v_template",
        "shapedirs",
        "posedirs",
        "J_regressor",
        "weights",
        "kintree_table",
        "f",
    ] {
        let rest: Vec<_> = small_body()
            .into_iter()
            .filter(|entry| entry.key != key)
            .collect();
        assert_names(&one_line(read(archive(&rest))), &[key, "missing"]);
    }
}

#[test]
fn truncated_files() {
    let bytes = archive(&small_body());
    for length in [100, bytes.len() / 2, bytes.len() - 1] {
        assert_names(
            &one_line(read(bytes[..length].to_vec())),
            &["not a zip archive", "cut short"],
        );
    }
    assert_names(&one_line(read(Vec::new())), &["begins with nothing"]);
    assert_names(
        &message("weights", |entry| entry.bytes.truncate(100)),
        &["weights", "100 data bytes", "takes 576"],
    );
    assert!(
        BodyModel::read(Path::new("nowhere/body.npz"))
            .unwrap_err()
            .to_string()
            .contains("nowhere/body.npz: cannot open")
    );
}

#[test]
fn every_flipped_byte_is_an_error_or_a_body() {
    let bytes = archive(&small_body());
    for index in (0..bytes.len()).step_by(3) {
        let mut flipped = bytes.clone();
        flipped[index] ^= 0x5a;
        if let Err(error) = read(flipped) {
            assert!(!error.to_string().is_empty());
        }
    }
}

#[test]
fn wrong_shapes() {
    assert_names(
        &message("v_template", |entry| entry.shape = vec![9, 2]),
        &["v_template", "[9, 2]", "(V, 3)"],
    );
    assert_names(
        &message("weights", |entry| entry.shape = vec![12, 12]),
        &["weights", "[12, 12]", "(6, 24)"],
    );
    assert_names(
        &message("kintree_table", |entry| entry.shape = vec![24, 2]),
        &["kintree_table", "[24, 2]", "(2, 24)"],
    );
    assert_names(
        &message("v_template", |entry| {
            (entry.shape, entry.bytes) = (vec![0, 3], Vec::new())
        }),
        &["v_template", "V from 3"],
    );
    assert_names(
        &message("posedirs", |entry| {
            *entry = floats("posedirs", &[5, 3, 207], |_| 0.0)
        }),
        &["posedirs", "(6, 3, 207)"],
    );
    let smplh = message("posedirs", |entry| {
        *entry = floats("posedirs", &[COUNT, 3, 459], |_| 0.0)
    });
    assert_names(&smplh, &["posedirs", "459", "(6, 3, 207) for 24 joints"]);
    let other = message("kintree_table", |entry| {
        *entry = integers("kintree_table", &[2, 25], &[0; 50])
    });
    assert_names(
        &other,
        &["kintree_table", "25 joints", "52 (SMPL-H) or 55 (SMPL-X)"],
    );
}

#[test]
fn hostile_shapes_allocate_nothing() {
    for shape in [
        vec![1 << 40, 3],
        vec![1 << 62, 1 << 62],
        vec![usize::MAX, 3],
    ] {
        assert_names(
            &message("v_template", |entry| entry.shape = shape),
            &["v_template"],
        );
    }
    assert_names(
        &message("f", |entry| {
            (entry.shape, entry.element) = (vec![1 << 60, 3], "|O")
        }),
        &["key f", "pickle"],
    );
}

#[test]
fn bad_values() {
    let nan = |entry: &mut Entry| entry.bytes[28..32].copy_from_slice(&f32::NAN.to_le_bytes());
    for key in [
        "v_template",
        "shapedirs",
        "posedirs",
        "J_regressor",
        "weights",
    ] {
        assert_names(&message(key, nan), &[key, "element 7", "NaN"]);
    }
    for vertex in [6_i64, -1, i64::MAX] {
        let out_of_range = message("f", |entry| {
            entry.bytes[32..40].copy_from_slice(&vertex.to_le_bytes())
        });
        assert_names(
            &out_of_range,
            &["key f", "triangle 1", &vertex.to_string(), "there are 6"],
        );
    }
    let skeleton = message("kintree_table", |entry| {
        entry.bytes[32..40].copy_from_slice(&3_i64.to_le_bytes())
    });
    assert_names(
        &skeleton,
        &["kintree_table", "joint 4 hangs on 3", "SMPL on 1"],
    );
    let weights = message("weights", |entry| {
        entry.bytes[..4].copy_from_slice(&0.5_f32.to_le_bytes())
    });
    assert_names(&weights, &["weights", "row 0", "0.5"]);
    assert_names(
        &message("weights", |entry| entry.element = "<c8"),
        &["weights", "<c8"],
    );
}

#[test]
fn float64_and_fortran_order_are_the_same_body() {
    let sound = read(archive(&small_body())).unwrap();
    let mut entries = small_body();
    for entry in entries.iter_mut().filter(|entry| entry.element == "<f4") {
        let values = entry
            .bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|&bytes| f64::from(f32::from_le_bytes(bytes)));
        (entry.bytes, entry.element) = (values.flat_map(f64::to_le_bytes).collect(), "<f8");
    }
    let weights = &mut entries[4];
    let element = |i: usize| &weights.bytes[8 * ((i % COUNT) * 24 + i / COUNT)..][..8];
    let transposed: Vec<u8> = (0..24 * COUNT).flat_map(|i| element(i).to_vec()).collect();
    (weights.bytes, weights.fortran_order) = (transposed, true);
    let read = read(archive(&entries)).unwrap();
    let pose = BodyPose::from_axis_angles(Vector3::zeros(), &[Vector3::new(0.3, -0.2, 0.5); 24]);
    let positions = |body| {
        ShapedBody::new(body, &[0.4, -1.0])
            .unwrap()
            .subset(&[0, 1, 2, 3, 4, 5])
            .unwrap()
            .positions(&pose)
    };
    assert_eq!(positions(read), positions(sound));
}

#[test]
fn the_embedded_body_survives_export() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (
        folder.path().join("body.npz"),
        folder.path().join("again.npz"),
    );
    let embedded = BodyModel::embedded();
    embedded.write_npz(&first).unwrap();
    let read = BodyModel::read(&first).unwrap();
    assert_eq!((read.id(), read.gender()), ("body", Some(Gender::Neutral)));
    assert_eq!(
        read.site("left_watch").unwrap(),
        embedded.site("left_watch").unwrap()
    );
    read.write_npz(&second).unwrap();
    assert!(
        std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(),
        "the same body gives the same bytes"
    );
    let pose = BodyPose::from_axis_angles(Vector3::zeros(), &[Vector3::new(0.3, -0.2, 0.5); 24]);
    let skinned = |body| {
        let mut vertices = Vec::new();
        ShapedBody::new(body, &[1.0, -1.0])
            .unwrap()
            .skin(&pose, &mut vertices);
        vertices
    };
    assert!(skinned(read) == skinned(embedded));
    let mut npz = NpzReader::open(&first).unwrap();
    assert_eq!(npz.text("bs_type").unwrap().as_deref(), Some("lrotmin"));
    assert_eq!(npz.keys().len(), 11);
    assert!(folder.path().join("body.npz").metadata().unwrap().len() < 4 << 20);
}

#[test]
fn obj_counts_from_one() {
    let mut text = Vec::new();
    write_obj(
        &mut text,
        &[[0.0, 0.5, -1.25], [1.0, 2.0, 3.0], [0.1, 0.2, 0.3]],
        &[[0, 1, 2]],
    )
    .unwrap();
    let expected = "v 0.000000 0.500000 -1.250000\nv 1.000000 2.000000 3.000000\nv 0.100000 0.200000 0.300000\nf 1 2 3\n";
    assert_eq!(String::from_utf8(text).unwrap(), expected);
}
