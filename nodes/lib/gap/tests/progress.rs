//! How far a diagnosis has come is told in steps.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::{Arc, Mutex};

use cromosim_gap::{DiagnoseOptions, PlacementRecord, Progress, diagnose_together};
use cromosim_imu::EffectKind as K;
use support::Scene;

fn told(records: &[PlacementRecord]) -> Vec<f64> {
    let told = Arc::new(Mutex::new(Vec::new()));
    let listener = told.clone();
    let options = DiagnoseOptions {
        progress: Progress::new(move |share| listener.lock().unwrap().push(share)),
        ..DiagnoseOptions::default()
    };
    let names = ["first", "second"];
    let recordings: Vec<_> = names.into_iter().zip(records).collect();
    diagnose_together(&recordings, &options).unwrap();
    drop(options);
    Arc::into_inner(told).unwrap().into_inner().unwrap()
}

fn short(seed: u64, imu_hz: f64) -> PlacementRecord {
    let scene = Scene {
        seconds: 15.0,
        imu_hz,
        ..Scene::new(seed).with(K::LeverArm, &[0.05, 0.02, -0.06])
    };
    scene.record()
}

#[test]
fn the_share_grows_in_small_steps_until_all_is_done() {
    for records in [
        vec![short(91, 100.0)],
        vec![short(92, 286.0)],
        vec![short(93, 100.0), short(94, 100.0)],
    ] {
        let told = told(&records);
        let steps = || told.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(
            told[0] > 0.0 && steps().all(|step| step >= -1e-12),
            "{told:?}"
        );
        assert!((told[told.len() - 1] - 1.0).abs() < 1e-12, "{told:?}");
        assert!(
            told.len() >= 8 && steps().all(|step| step < 0.4),
            "{told:?}"
        );
    }
}
