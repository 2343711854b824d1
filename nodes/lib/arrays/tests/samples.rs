//! Files as tools write them, against what Python reads out of them (`scripts/make_samples.py`).
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use cromosim_arrays::{Container, Entry, Format, Kind, Limits, NpzReader, NpzWriter, Value};

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn open(name: &str) -> Entry {
    Container::open(&sample(name)).unwrap().root().unwrap()
}

/// `smpl[0].betas` below `entry`, where keys may hold dots.
fn find(entry: &Entry, key: &str) -> Option<Entry> {
    if entry.key() == key {
        return Some(entry.clone());
    }
    let children = match entry.value() {
        Value::Dict(_) => entry
            .pairs()
            .unwrap()
            .into_iter()
            .map(|(_, child)| child)
            .collect(),
        Value::List(_) => entry.items().unwrap(),
        _ => Vec::new(),
    };
    children
        .iter()
        .filter(|child| key.starts_with(child.key()))
        .find_map(|child| find(child, key))
}

#[test]
fn every_number_is_what_python_reads() {
    let mut files: BTreeMap<&str, Entry> = BTreeMap::new();
    let expected = include_str!("data/expected.txt");
    for line in expected.lines() {
        let [file, key, shape, sum] = line.split('\t').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let root = files.entry(file).or_insert_with(|| open(file));
        let found = find(root, key).unwrap_or_else(|| panic!("{file} has no {key}"));
        if let Value::BigInt(_) = found.value() {
            assert_eq!(key, "long");
            continue;
        }
        let shape: Vec<Option<usize>> = shape
            .split(',')
            .filter(|size| !size.is_empty())
            .map(|size| size.parse().ok())
            .collect();
        let array = found.floats(&shape, shape_text(&shape)).unwrap();
        let weighted: f64 = array
            .values
            .iter()
            .enumerate()
            .map(|(i, value)| (i + 1) as f64 * value)
            .sum();
        let sum: f64 = sum.parse().unwrap();
        assert!(
            (weighted - sum).abs() <= 1e-9 * sum.abs().max(1.0),
            "{file} {key}: {weighted}, in Python {sum}"
        );
    }
    assert!(
        expected.lines().count() > 250
            && files.len() == std::fs::read_dir(sample("")).unwrap().count() - 1
    );
}

fn shape_text(shape: &[Option<usize>]) -> &'static str {
    if shape.is_empty() {
        "a number"
    } else {
        "what Python reads"
    }
}

#[test]
fn types_other_than_numbers() {
    for protocol in 0..6 {
        let root = open(&format!("many_p{protocol}.pkl"));
        let at = |key: &str| root.at(key).unwrap();
        assert_eq!(at("text").text().unwrap(), "naïve 東京");
        assert_eq!(
            (at("word").text().unwrap(), at("texts").texts().unwrap()),
            ("w".to_owned(), vec!["a".to_owned(), "bcd".to_owned()])
        );
        assert_eq!(at("codes").texts().unwrap(), ["a", "bcd"]);
        assert!(matches!(at("bytes").value(), Value::Bytes(bytes) if **bytes == [0xff, 0]));
        assert!(matches!(at("array").value(), Value::Bytes(bytes) if **bytes == *b"ab"));
        assert!(matches!(at("complex").value(), Value::Complex(1.0, -2.0)));
        assert!(matches!(at("truth").value(), Value::Bool(true)));
        assert_eq!(
            (
                at("number").integer().unwrap(),
                at("wide").integer().unwrap()
            ),
            (-7, -(1 << 40))
        );
        assert_eq!(
            at("tuple").items().unwrap()[4]
                .integers(&[Some(4)], "(4)")
                .unwrap()
                .values,
            [1, 2, 3, 4]
        );
        assert_eq!(at("set").items().unwrap().len(), 1);
        let Value::Array(objects) = at("objects").value().clone() else {
            panic!("objects are an array")
        };
        assert_eq!(
            (objects.shape(), objects.dtype().kind),
            (&[2, 2][..], Kind::Object)
        );
        assert!(
            matches!(objects.object_elements(), [Value::Int(1), Value::Text(b), Value::List(_), Value::None] if **b == *"b")
        );
        assert!(
            matches!(at("long").value(), Value::BigInt(digits) if digits.contains("1180591620717411303424") || digits.contains("0x40"))
        );
        let shared = at("shared").items().unwrap();
        assert!(
            matches!((shared[0].value(), shared[1].value()), (Value::List(a), Value::List(b)) if std::sync::Arc::ptr_eq(a, b))
        );
    }
}

#[test]
fn formats_are_told_by_content() {
    let format = |name: &str| {
        Format::detect(&mut Cursor::new(std::fs::read(sample(name)).unwrap())).unwrap()
    };
    let cases = [
        ("amass.npz", Format::Zip),
        ("gvhmr.pt", Format::Zip),
        ("many_legacy.pt", Format::TorchLegacy),
        ("tram.npy", Format::Npy),
    ];
    let more = [
        ("joblib_z3.pkl", Format::Zlib),
        ("many_gzip.joblib", Format::Gzip),
        ("phalp.joblib", Format::Zlib),
        ("many_p0.pkl", Format::Pickle),
        ("many_v7.mat", Format::Mat),
    ];
    for (name, expected) in cases.into_iter().chain(more).chain([
        ("joblib.pkl", Format::Pickle),
        ("py2_style.pkl", Format::Pickle),
    ]) {
        assert_eq!(format(name), Some(expected), "{name}");
    }
    for other in [
        "",
        "HIERARCHY\nROOT hips.",
        "PathFileType\t4",
        "<xml>",
        "{\"a\": 1}",
        "x,y\n1,2\n",
    ] {
        assert_eq!(
            Format::detect(&mut Cursor::new(other)).unwrap(),
            None,
            "{other}"
        );
    }
}

#[test]
fn matlabs_files_give_numbers_and_text_and_pass_over_the_rest() {
    for name in ["many_v6.mat", "many_v7.mat"] {
        let mut file = Container::open(&sample(name)).unwrap();
        let keys = [
            "bool",
            "half",
            "big",
            "fortran",
            "uint",
            "int",
            "empty",
            "number",
            "real",
            "truth",
            "matrix_rows",
            "words",
        ];
        assert_eq!(file.keys(), keys, "{name}");
        assert_eq!(file.at("words").unwrap().text().unwrap(), "none é");
        assert_eq!(file.at("fortran").unwrap().shape().unwrap(), [3, 4, 2]);
        assert_eq!(file.at("real").unwrap().float().unwrap(), 0.1);
    }
    // As MATLAB writes it, most significant byte first: doubles that fit into bytes, in the tag
    // itself.
    let word = |value: u32| value.to_be_bytes();
    let element = [
        &word(6)[..],
        &word(8),
        &word(6),
        &word(0),
        &word(5),
        &word(8),
        &word(2),
        &word(1),
        &[0, 1, 0, 1],
        b"x\0\0\0",
        &[0, 2, 0, 2, 3, 250, 0, 0],
    ];
    let element = element.concat();
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([1, 0, b'M', b'I']);
    bytes.extend([&word(14)[..], &word(element.len() as u32), &element].concat());
    let mut file =
        Container::new(Cursor::new(bytes), Path::new("big.mat"), Limits::default()).unwrap();
    assert_eq!(
        file.at("x")
            .unwrap()
            .floats(&[Some(2), Some(1)], "(2, 1)")
            .unwrap()
            .values,
        [3.0, 250.0]
    );
    for start in [
        &b"\x89HDF\r\n\x1a\n\0\0"[..],
        b"MATLAB 7.3 MAT-file, Platform",
        b"MATLAB 7.0 MAT-file, Platform",
    ] {
        let error = Container::new(
            Cursor::new(start.to_vec()),
            Path::new("new.mat"),
            Limits::default(),
        )
        .unwrap_err()
        .to_string();
        assert!(
            error.starts_with("new.mat: HDF5") && error.contains("save -v7"),
            "{error}"
        );
    }
}

#[test]
fn messages_name_file_key_and_what_is_there() {
    let root = open("plain_p4.pkl");
    let person = root.pairs().unwrap().remove(0).1;
    let messages = [
        person.at("posed").unwrap_err().to_string(),
        person
            .at("pose")
            .unwrap()
            .floats(&[None, Some(69)], "(N, 69)")
            .unwrap_err()
            .to_string(),
        person
            .at("gender")
            .unwrap()
            .floats(&[], "a number")
            .unwrap_err()
            .to_string(),
        person
            .at("pose")
            .unwrap()
            .integers(&[None, None], "(N, 72)")
            .unwrap_err()
            .to_string(),
    ];
    let parts = [
        vec!["plain_p4.pkl: ", "1.posed", "pred_cam, pose, betas"],
        vec!["plain_p4.pkl: key 1.pose", "[4, 72]", "(N, 69)"],
        vec!["1.gender", "neutral", "array of numbers"],
        vec!["1.pose", "<f4", "integers"],
    ];
    for (message, parts) in messages.iter().zip(parts) {
        assert!(
            parts.iter().all(|part| message.contains(part)) && !message.contains('\n'),
            "{message} should name {parts:?}"
        );
    }
    assert!(person.get("joints2d").is_none(), "None is nothing");
}

/// Counts what is read.
struct Counting<R>(R, std::rc::Rc<std::cell::Cell<u64>>);

impl<R: Read> Read for Counting<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(buffer)?;
        self.1.set(self.1.get() + count as u64);
        Ok(count)
    }
}

impl<R: Seek> Seek for Counting<R> {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.0.seek(position)
    }
}

#[test]
fn an_archive_of_200_megabytes_is_read_as_far_as_asked() {
    // Stored, as numpy.savez does: 24 million floats beside three.
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (key, count) in [("poses", 25_000_000_usize), ("trans", 3)] {
        let options = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored);
        zip.start_file(format!("{key}.npy"), options).unwrap();
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({count},), }}\n");
        let start = [
            &b"\x93NUMPY\x01\x00"[..],
            &(header.len() as u16).to_le_bytes(),
            header.as_bytes(),
        ]
        .concat();
        io::Write::write_all(&mut zip, &start).unwrap();
        io::copy(&mut io::repeat(0).take(8 * count as u64), &mut zip).unwrap();
    }
    let file = zip.finish().unwrap();
    assert!(file.get_ref().len() > 200_000_000);
    let count = std::rc::Rc::new(std::cell::Cell::new(0));
    let mut container = Container::new(
        Counting(file, count.clone()),
        Path::new("long.npz"),
        Limits::default(),
    )
    .unwrap();
    assert_eq!(container.keys(), ["poses", "trans"]);
    assert_eq!(
        container.header("poses").unwrap().unwrap().shape,
        [25_000_000]
    );
    assert_eq!(
        container
            .at("trans")
            .unwrap()
            .floats(&[Some(3)], "(3)")
            .unwrap()
            .values,
        [0.0; 3]
    );
    println!("read {} bytes of {}", count.get(), 200_000_000);
    assert!(count.get() < 200_000, "{} bytes were read", count.get());
}

#[test]
fn what_is_written_is_read_and_always_the_same_bytes() {
    let write = || {
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.floats("single", &[2, 2], &[0.5, 1.0, 2.0, 4.0])
            .unwrap();
        npz.floats("double", &[3], &[0.1, 0.2, 0.3]).unwrap();
        npz.integers("whole", &[2], &[7, u32::MAX]).unwrap();
        npz.text("gender", "naïve").unwrap();
        npz.finish().unwrap().into_inner()
    };
    assert!(write() == write());
    let mut npz = NpzReader::new(Cursor::new(write()), Path::new("a.npz")).unwrap();
    assert_eq!(npz.keys(), ["double", "gender", "single", "whole"]);
    let elements = |npz: &mut NpzReader<_>, key: &str| npz.header(key).unwrap().unwrap().element;
    assert_eq!(
        (elements(&mut npz, "single"), elements(&mut npz, "double")),
        ("<f4".to_owned(), "<f8".to_owned())
    );
    assert_eq!(
        npz.floats("double", &[Some(3)], "(3)")
            .unwrap()
            .unwrap()
            .values,
        [0.1, 0.2, 0.3]
    );
    assert_eq!(
        npz.integers("whole", &[None], "(N)")
            .unwrap()
            .unwrap()
            .values,
        [7, i64::from(u32::MAX)]
    );
    assert_eq!(
        (
            npz.text("gender").unwrap().as_deref(),
            npz.text("whole").unwrap()
        ),
        (Some("naïve"), None)
    );
    assert!(npz.floats("other", &[None], "(N)").unwrap().is_none());
    assert!(
        npz.at("other")
            .unwrap_err()
            .to_string()
            .contains("there are: double, gender")
    );
}
