//! Depth maps in every form, and cameras: no panic, no memory beyond what the bytes can hold.
#![no_main]

use cromosim_video::{CameraAxes, DepthEncoding, parse_camera, parse_depth, parse_plain_depth};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    for encoding in [DepthEncoding::Depth, DepthEncoding::Disparity] {
        if let Ok(map) = parse_depth(data, encoding, "fuzz") {
            assert!(map.depths().iter().all(|depth| depth.is_finite() && *depth >= 0.0));
        }
        let _ = parse_plain_depth(data, 16, data.len() / 64, encoding, "fuzz");
    }
    let _ = parse_camera(data, nalgebra::Vector2::new(384.0, 216.0), CameraAxes::OpenGl, "fuzz");
});
