//! Small containers of arrays that tests write themselves.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Limits, NpzWriter};
use cromosim_motion::{MotionError, PoseFile, PoseView};

/// A Python object.
#[derive(Clone, Debug)]
pub enum Py {
    Int(i64),
    Float(f64),
    Text(&'static str),
    List(Vec<Py>),
    /// Keys and values.
    Dict(Vec<(Py, Py)>),
}

impl Py {
    /// Rows of `width` numbers each.
    pub fn rows(values: &[f64], width: usize) -> Self {
        Self::List(
            values
                .chunks(width)
                .map(|row| Self::List(row.iter().map(|&value| Self::Float(value)).collect()))
                .collect(),
        )
    }

    pub fn named(pairs: &[(&'static str, Py)]) -> Self {
        Self::Dict(
            pairs
                .iter()
                .map(|(key, value)| (Self::Text(key), value.clone()))
                .collect(),
        )
    }

    /// A pickle of protocol 2.
    pub fn pickle(&self) -> Vec<u8> {
        let mut bytes = vec![0x80, 2];
        self.write(&mut bytes);
        bytes.push(b'.');
        bytes
    }

    fn write(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Int(value) => bytes.extend(format!("L{value}L\n").bytes()),
            Self::Float(value) => {
                bytes.push(b'G');
                bytes.extend(value.to_be_bytes());
            }
            Self::Text(text) => {
                bytes.push(b'X');
                bytes.extend((text.len() as u32).to_le_bytes());
                bytes.extend(text.bytes());
            }
            Self::List(items) => {
                bytes.extend(b"](");
                items.iter().for_each(|item| item.write(bytes));
                bytes.push(b'e');
            }
            Self::Dict(pairs) => {
                bytes.extend(b"}(");
                for (key, value) in pairs {
                    key.write(bytes);
                    value.write(bytes);
                }
                bytes.push(b'u');
            }
        }
    }
}

/// Arrays by name: shape and values.
pub type Arrays = BTreeMap<&'static str, (Vec<usize>, Vec<f64>)>;

pub fn npz(arrays: &Arrays) -> Vec<u8> {
    let mut writer = NpzWriter::new(Cursor::new(Vec::new()));
    for (key, (shape, values)) in arrays {
        writer.floats(key, shape, values).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// What the reader makes of a file's bytes.
pub fn parsed(bytes: Vec<u8>) -> Result<PoseFile, MotionError> {
    let mut container =
        Container::new(Cursor::new(bytes), Path::new("clip.bin"), Limits::default())?;
    PoseFile::parse(&mut container, PoseView::World, || Ok(None))
}
