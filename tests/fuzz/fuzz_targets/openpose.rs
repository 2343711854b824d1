//! OpenPose's keypoints: no panic, and a pelvis is only found where the torso is.
#![no_main]

use cromosim_video::{parse_openpose, pelvis_pixel, track_person};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(people) = parse_openpose(data, "fuzz") {
        for person in &people {
            if let Some(pelvis) = pelvis_pixel(person, 0.3) {
                assert!(pelvis.pixel.iter().all(|value| value.is_finite()) && pelvis.torso_px > 0.0);
            }
        }
        let _ = track_person(&[people], 0.3);
    }
});
