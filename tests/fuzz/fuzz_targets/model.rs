//! Body model files.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use cromosim_body::BodyModel;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = BodyModel::from_reader(Cursor::new(bytes), Path::new("fuzz.npz"));
});
