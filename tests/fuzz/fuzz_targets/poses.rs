//! Files of SMPL parameters: recognition, every person in a world and in the camera's axes.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Limits};
use cromosim_body::BodyModel;
use cromosim_motion::{MotionOptions, PoseFile, PoseView, ShapeChoice};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits { decoded_bytes: 64 << 20, opcodes: 1_000_000, ..Limits::default() };
    let parse = |view| {
        let mut container = Container::new(Cursor::new(bytes), Path::new("fuzz.pkl"), limits).ok()?;
        // TRAM's camera may as well stand in the same file.
        let camera = Container::new(Cursor::new(bytes), Path::new("fuzz.pkl"), limits).ok()?.root().ok();
        PoseFile::parse(&mut container, view, || Ok(camera)).ok()
    };
    let (body, options) = (BodyModel::embedded(), MotionOptions { shape: ShapeChoice::Mean, ..MotionOptions::default() });
    if let Some(file) = parse(PoseView::World)
        && file.people().iter().map(|(_, frames)| frames).sum::<usize>() < 10_000
    {
        for motion in file.into_motions(&body, None, &options).unwrap_or_default() {
            let _ = motion.slice(0.0, None);
            assert!(motion.frames.iter().all(|pose| pose.root_position.iter().all(|value| value.is_finite())));
            assert!(motion.frames.iter().flat_map(|pose| pose.local_rotations).all(|rotation| (rotation.norm() - 1.0).abs() < 1e-6));
        }
    }
    if let Some(file) = parse(PoseView::Camera) {
        let _ = file.into_camera_poses(&body, &options);
    }
});
