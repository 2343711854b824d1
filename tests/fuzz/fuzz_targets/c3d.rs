//! Any bytes to the C3D parser.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = cromosim_motion::parse_c3d(data, "fuzz.c3d");
});
