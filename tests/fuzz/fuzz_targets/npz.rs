//! Archives of arrays: every entry's header, numbers, integers and text.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Limits, NpzReader};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits { decoded_bytes: 64 << 20, opcodes: 1_000_000, ..Limits::default() };
    let Ok(mut npz) = NpzReader::with_limits(Cursor::new(bytes), Path::new("fuzz.npz"), limits) else { return };
    for key in npz.keys().iter().take(20) {
        let Ok(Some(header)) = npz.header(key) else { continue };
        let any = vec![None; header.shape.len()];
        if let Ok(Some(entry)) = npz.entry(key) {
            let _ = (entry.floats(&any, "any"), entry.integers(&any, "any"), entry.texts(), entry.float());
        }
    }
});
