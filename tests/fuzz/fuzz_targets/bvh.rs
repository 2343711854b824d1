//! Any bytes to the BVH parser.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = cromosim_motion::parse_bvh(&String::from_utf8_lossy(data), "fuzz.bvh");
});
