//! Files that are cut, flipped, or made to cost memory, time or safety: an error each, never a
//! panic.
#![allow(clippy::unwrap_used, missing_docs)]

use std::io::{Cursor, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use cromosim_arrays::{ArraysError, Container, Entry, Limits, Value};

fn read(bytes: impl Into<Vec<u8>>) -> Result<Entry, ArraysError> {
    read_within(bytes, Limits::default())
}

fn read_within(bytes: impl Into<Vec<u8>>, limits: Limits) -> Result<Entry, ArraysError> {
    Container::new(
        Cursor::new(bytes.into()),
        Path::new("people/bad.pkl"),
        limits,
    )?
    .root()
}

fn samples() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path())
        .filter(|path| !path.ends_with("expected.txt"));
    files
        .map(|path| {
            (
                path.file_name().unwrap().to_string_lossy().into_owned(),
                std::fs::read(&path).unwrap(),
            )
        })
        .collect()
}

/// All numbers below, as a reader of motion would ask for them.
fn walk(entry: &Entry, budget: &mut usize) {
    *budget = budget.saturating_sub(1);
    if *budget == 0 {
        return;
    }
    let _ = (entry.text(), entry.shape(), entry.float(), entry.integer());
    match entry.value() {
        Value::Dict(_) => entry
            .pairs()
            .unwrap()
            .iter()
            .for_each(|(_, child)| walk(child, budget)),
        Value::List(_) | Value::Tuple(_) => entry
            .items()
            .unwrap()
            .iter()
            .for_each(|child| walk(child, budget)),
        _ => drop(
            entry
                .shape()
                .map(|shape| entry.floats_with_nan(&vec![None; shape.len()], "any")),
        ),
    }
}

#[test]
fn files_cut_anywhere_are_errors() {
    for (name, bytes) in samples() {
        // MATLAB's files do not say how many arrays follow, nor is their padding of use: these may
        // be cut behind each of 16.
        let mut between = if name.ends_with(".mat") { 16 * 8 } else { 0 };
        for length in 0..bytes.len() {
            let cut = read(&bytes[..length]);
            if cut.is_ok() && between > 0 {
                between -= 1;
                continue;
            }
            let message = cut
                .err()
                .unwrap_or_else(|| panic!("{name} cut to {length} bytes was read"))
                .to_string();
            assert!(
                message.starts_with("people/bad.pkl: ") && !message.contains('\n'),
                "{name} cut to {length}: {message}"
            );
        }
    }
}

#[test]
fn flipped_bytes_are_errors_or_other_values() {
    for (name, bytes) in samples() {
        for index in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[index] ^= [0x01, 0x80, 0xff][index % 3];
            match read(flipped) {
                Ok(root) => walk(&root, &mut 1000),
                Err(error) => assert!(!error.to_string().contains('\n'), "{name}: {error}"),
            }
        }
    }
}

#[test]
fn what_could_execute_is_refused_by_name() {
    let cases: [(&[u8], &str, usize); 8] = [
        (b"cos\nsystem\n(S'ls'\ntR.", "os.system", 0),
        (b"\x80\x02cposix\nsystem\nq\x00.", "posix.system", 2),
        (
            b"\x80\x04\x8c\x08builtins\x8c\x04eval\x93.",
            "builtins.eval",
            18,
        ),
        (b"(S'ls'\nios\nsystem\n.", "os.system", 7),
        (b"c__builtin__\ngetattr\n.", "__builtin__.getattr", 0),
        (b"\x80\x02csubprocess\nPopen\n)\x81.", "subprocess.Popen", 2),
        (
            b"cnumpy.core.multiarray\nfromfile\n.",
            "numpy.core.multiarray.fromfile",
            0,
        ),
        (b"ctorch\nload\n.", "torch.load", 0),
    ];
    for (bytes, expected, at) in cases {
        let error = read(bytes).unwrap_err();
        assert!(
            matches!(&error, ArraysError::Refused { name, offset, .. } if name == expected && *offset == at),
            "{error}"
        );
        assert!(
            error.to_string().contains(&format!(
                "refers to `{expected}`, which this reader does not rebuild"
            )),
            "{error}"
        );
    }
}

#[test]
fn what_is_skipped_may_hold_anything_and_nothing_else_may() {
    let skipping = |text: &str| {
        Container::without(
            Cursor::new(text.as_bytes().to_vec()),
            Path::new("bad.pkl"),
            Limits::default(),
            &[&["a", "b"]],
        )
    };
    // An object with state, items and itself within it; what is known below is passed over too.
    let object = "(cmy\nClass\nI1\nop9\n(dS'x'\ng9\nsb";
    let sound =
        format!("(dS'k'\nI7\nsS'a'\n(dS'b'\n{object}sS'b'\ncos\nsystem\n(S'ls'\ntRsS'c'\nI8\nss.");
    let root = skipping(&sound).unwrap().root().unwrap();
    assert_eq!(root.at("k").unwrap().integer().unwrap(), 7);
    let a = root.at("a").unwrap();
    assert_eq!(
        a.pairs()
            .unwrap()
            .iter()
            .map(|(_, entry)| entry.key().to_owned())
            .collect::<Vec<_>>(),
        ["a.c"]
    );
    let refused = |text: &str, expected: &str| {
        let error = skipping(text)
            .err()
            .unwrap_or_else(|| panic!("{text} was read"));
        assert!(
            matches!(&error, ArraysError::Refused { name, .. } if name == expected),
            "{text}: {error}"
        );
    };
    refused("cos\nsystem\n(S'ls'\ntR.", "os.system");
    // Thrown away, in another place, at the same place of another dictionary, twice, or in a pickle
    // within.
    refused("cos\nsystem\n(S'ls'\ntR0(d.", "os.system");
    refused("(dS'a'\n(dS'c'\ncos\nsystem\nss.", "os.system");
    refused("(dS'b'\ncos\nsystem\ns.", "os.system");
    refused(
        "(dS'a'\n(dS'b'\ncos\nsystem\np1\nssS'z'\ng1\ns.",
        "os.system",
    );
    refused(
        "ccopy_reg\n_reconstructor\n(cmy\nClass\nc__builtin__\nobject\nNtR.",
        "my.Class",
    );
    // Nothing of the file is skipped where nobody said so.
    assert!(matches!(
        read(sound.as_bytes()),
        Err(ArraysError::Refused { .. })
    ));
}

/// A numpy array of `shape` (a pickled tuple) with `bytes` of float64.
fn array_pickle(shape: &str, bytes: &[u8]) -> Vec<u8> {
    let start = format!(
        "cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n{shape}cnumpy\ndtype\n(S'f8'\nI0\nI1\ntR(I3\nS'<'\nNNNI-1\nI-1\nI0\ntbI00\nT"
    );
    [
        start.as_bytes(),
        &(bytes.len() as u32).to_le_bytes(),
        bytes,
        b"tb.",
    ]
    .concat()
}

#[test]
fn declared_sizes_take_no_memory() {
    assert_eq!(
        read(array_pickle("(I2\nt", &[0; 16]))
            .unwrap()
            .floats(&[Some(2)], "(2)")
            .unwrap()
            .values,
        [0.0; 2]
    );
    for shape in [
        "(I1152921504606846976\nt",
        "(I1152921504606846976\nI16\nt",
        "(I-1\nt",
        "(I1152921504606846976\nI0\nt",
        "(L99999999999999999999L\nt",
    ] {
        assert!(
            matches!(
                read(array_pickle(shape, &[0; 16])),
                Err(ArraysError::Pickle { .. })
            ),
            "{shape}"
        );
    }
    for cut in [
        &b"\x80\x04\x8d\xff\xff\xff\xff\xff\xff\xff\x7f"[..],
        b"\x80\x04\x8e\x00\x00\x00\x00\x00\x00\x00\x10a",
        b"\x80\x03B\xff\xff\xff\xffa",
        b"\x80\x02r\xff\xff\xff\xff",
    ] {
        assert!(matches!(read(cut), Err(ArraysError::Pickle { .. })));
    }
    assert!(
        read(b"\x80\x02]r\xff\xff\xff\x7f.")
            .unwrap_err()
            .to_string()
            .contains("out of turn")
    );
}

/// A matrix of scipy with three stored numbers.
fn sparse_pickle(rows: &str, columns: &str, ends: &[u8]) -> Vec<u8> {
    let array = |bytes: &[u8]| {
        let shape = format!("(I{}\nt", bytes.len());
        let whole = array_pickle(&shape, bytes);
        let text = whole.windows(4).position(|part| part == b"S'f8").unwrap();
        [&whole[..text], b"S'u1", &whole[text + 4..whole.len() - 1]].concat()
    };
    let start = format!(
        "ccopy_reg\n_reconstructor\n(cscipy.sparse.csc\ncsc_matrix\nc__builtin__\nobject\nNtR(dS'_shape'\n(I{rows}\nI{columns}\ntsS'data'\n"
    );
    [
        start.as_bytes(),
        &array(&[1, 2, 3]),
        b"sS'indices'\n",
        &array(&[0, 1, 1]),
        b"sS'indptr'\n",
        &array(ends),
        b"sb.",
    ]
    .concat()
}

#[test]
fn sparse_matrices_are_checked() {
    let dense = read(sparse_pickle("2", "2", &[0, 1, 3]))
        .unwrap()
        .floats(&[Some(2), Some(2)], "(2, 2)")
        .unwrap();
    assert_eq!(dense.values, [1.0, 0.0, 0.0, 5.0]);
    for (rows, columns, ends) in [
        ("1", "2", &[0, 1, 3][..]),
        ("2", "2", &[0, 1]),
        ("2", "2", &[0, 3, 1]),
        ("2", "2", &[0, 1, 4]),
        ("-2", "2", &[0, 1, 3]),
    ] {
        assert!(
            read(sparse_pickle(rows, columns, ends)).is_err(),
            "{rows} {columns} {ends:?}"
        );
    }
    let wide = read(sparse_pickle("4000000000", "2", &[0, 1, 3])).unwrap();
    assert!(matches!(
        wide.floats(&[None, None], "(R, C)"),
        Err(ArraysError::TooLarge { .. })
    ));
    assert!(read(sparse_pickle("9000000000000000000", "2", &[0, 1, 3])).is_err());
}

#[test]
fn npy_headers_are_checked() {
    let npy = |header: &str, data: &[u8]| {
        [
            b"\x93NUMPY\x01\x00",
            &(header.len() as u16).to_le_bytes()[..],
            header.as_bytes(),
            data,
        ]
        .concat()
    };
    let header =
        |shape: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    assert_eq!(
        read(npy(&header("(2L,)"), &[0; 16]))
            .unwrap()
            .shape()
            .unwrap(),
        [2]
    );
    for shape in [
        "(1152921504606846976,)",
        "(1152921504606846976, 1152921504606846976)",
        "(3,)",
        "(-2,)",
        "(2",
        "()",
        "(18446744073709551615, 0)",
    ] {
        assert!(read(npy(&header(shape), &[0; 16])).is_err(), "{shape}");
    }
    assert!(
        read(npy(
            "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (2,), }",
            &[0; 16]
        ))
        .unwrap_err()
        .to_string()
        .contains("record")
    );
    assert!(
        read(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{".as_slice())
            .unwrap_err()
            .to_string()
            .contains("too long")
    );
}

#[test]
fn shared_lists_do_not_multiply() {
    // Each list holds the one before it ten times: 10^60 items to walk, 60 to store.
    let mut bytes = b"\x80\x02]q\x00".to_vec();
    for level in 0..60_u8 {
        bytes.extend(b"](");
        bytes.extend([b'h', level].repeat(10));
        bytes.extend([b'e', b'q', level + 1]);
    }
    bytes.push(b'.');
    let start = Instant::now();
    let root = read(bytes).unwrap();
    println!("{root:?}");
    assert!(
        root.floats(&[None], "(N)").is_err()
            && root.shape().is_err()
            && root.integers(&[None], "(N)").is_err()
    );
    drop(root);
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn nesting_is_bounded() {
    let nested =
        |levels: usize| [b"]".repeat(levels), b"a".repeat(levels - 1), b".".to_vec()].concat();
    assert!(read(nested(90)).is_ok());
    for levels in [102, 1_000_000] {
        assert!(
            read(nested(levels))
                .unwrap_err()
                .to_string()
                .contains("levels deep"),
            "{levels}"
        );
    }
    // Shared parts count with their own depth.
    let mut chained = b"\x80\x02".to_vec();
    for part in 0..4_u8 {
        let inner: &[u8] = if part == 0 {
            b""
        } else {
            &[b'h', part - 1, b'a']
        };
        chained.extend(
            [
                b"]".repeat(50).as_slice(),
                inner,
                &b"a".repeat(49),
                &[b'q', part],
            ]
            .concat(),
        );
    }
    chained.push(b'.');
    assert!(
        read(chained)
            .unwrap_err()
            .to_string()
            .contains("levels deep")
    );
    assert!(
        read(b"\x80\x02]q\x00h\x00a.")
            .unwrap_err()
            .to_string()
            .contains("contains itself")
    );
}

#[test]
fn limits_hold() {
    let many = [b"(".to_vec(), b"N".repeat(10_000), b"l.".to_vec()].concat();
    assert!(
        read_within(
            many.clone(),
            Limits {
                opcodes: 5000,
                ..Limits::default()
            }
        )
        .unwrap_err()
        .to_string()
        .contains("5000 opcodes")
    );
    assert!(
        read_within(
            many,
            Limits {
                decoded_bytes: 100_000,
                ..Limits::default()
            }
        )
        .unwrap_err()
        .to_string()
        .contains("100000 bytes")
    );
    // Ten million zeros, packed a thousandfold.
    let packed = |level: &[u8]| {
        let mut writer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        writer.write_all(level).unwrap();
        writer.finish().unwrap()
    };
    let bomb = packed(
        &[
            &b"\x80\x03B\x80\x96\x98\x00"[..],
            &vec![0; 10_000_000],
            b".",
        ]
        .concat(),
    );
    assert!(bomb.len() < 20_000 && read(bomb.clone()).is_ok());
    assert!(
        read_within(
            bomb,
            Limits {
                decoded_bytes: 1 << 20,
                ..Limits::default()
            }
        )
        .unwrap_err()
        .to_string()
        .contains("1048576 bytes")
    );
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file("poses.npy", zip::write::SimpleFileOptions::default())
        .unwrap();
    zip.write_all(&vec![0; 10_000_000]).unwrap();
    let bomb = zip.finish().unwrap().into_inner();
    assert!(matches!(
        read_within(
            bomb,
            Limits {
                decoded_bytes: 1 << 20,
                ..Limits::default()
            }
        ),
        Err(ArraysError::TooLarge { .. })
    ));
}

/// A tensor of `count` elements over one float of a legacy storage.
fn expanded_tensor(count: u32) -> Vec<u8> {
    let storage = b"((S'storage'\nctorch\nFloatStorage\nS'0'\nS'cpu'\nI1\ntQ";
    let mut object = b"ctorch._utils\n_rebuild_tensor_v2\n".to_vec();
    object.extend(storage);
    object.extend(format!("I0\n(I{count}\nt(I0\ntI00\nNtR.").into_bytes());
    [
        &b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.I1001\n.(d."[..],
        &object,
        b"(S'0'\nl.",
        &1_u64.to_le_bytes(),
        &1.5_f32.to_le_bytes(),
    ]
    .concat()
}

#[test]
fn tensors_repeat_their_storage_within_bounds() {
    let few = read(expanded_tensor(1000))
        .unwrap()
        .floats(&[Some(1000)], "(1000)")
        .unwrap();
    assert!(few.values.iter().all(|&value| value == 1.5));
    assert!(
        read(expanded_tensor(1_000_000_000))
            .unwrap_err()
            .to_string()
            .contains("contiguous copy")
    );
}

#[test]
fn a_small_file_takes_no_gigabytes() {
    // Two million objects of one byte each: hundreds of bytes each once they are objects.
    let objects = [b"(".to_vec(), b"N".repeat(2_000_000), b"l.".to_vec()].concat();
    let error = read(objects).unwrap_err().to_string();
    assert!(error.contains("a file of this size"), "{error}");
    // 200 MB of zeros, packed a thousandfold.
    let mut writer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    writer.write_all(b"\x80\x03B\x00\xc2\xeb\x0b").unwrap();
    writer.write_all(&vec![0; 200_000_000]).unwrap();
    writer.write_all(b".").unwrap();
    let error = read(writer.finish().unwrap()).unwrap_err().to_string();
    assert!(error.contains("a file of this size"), "{error}");
    // What real tools write of honest content: a long list of small integers, and of numbers.
    let small = [b"(".to_vec(), b"K\x07".repeat(400_000), b"l.".to_vec()].concat();
    assert!(read(small).is_ok());
    let numbers = [
        b"(".to_vec(),
        b"G\x40\x09\x21\xfb\x54\x44\x2d\x18".repeat(2_000_000),
        b"l.".to_vec(),
    ]
    .concat();
    assert!(read(numbers).is_ok());
}
