//! What a diagnosis says, and whether its promise holds.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use cromosim_msgs::sensor_msgs::Imu;
use nalgebra::Vector3;
use serde_json::Value;

use crate::common::succeed;
use crate::session::imus;

/// What the diagnosis leaves out at the reference's ends, s.
pub const END_S: f64 = 1.0;

pub fn diagnosis(folder: &Path, out: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(out).join("diagnosis.json")).unwrap())
        .unwrap()
}

pub fn causes(diagnosis: &Value, placement: &str) -> BTreeSet<String> {
    let causes = diagnosis["placements"][placement]["causes"]
        .as_array()
        .unwrap();
    causes
        .iter()
        .map(|cause| cause["effect"].as_str().unwrap().to_owned())
        .collect()
}

pub fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// RMSE of measured minus simulated over what the diagnosis compares too: specific force, angular
/// velocity.
fn rmse(measured: &[Imu], simulated: &[Imu]) -> [f64; 2] {
    assert_eq!(measured.len(), simulated.len());
    let (first, last) = (
        measured[0].header.stamp.nanos(),
        measured[measured.len() - 1].header.stamp.nanos(),
    );
    let inside = |message: &Imu| {
        let nanos = message.header.stamp.nanos();
        ((nanos - first).min(last - nanos)) as f64 * 1e-9 >= END_S
    };
    let of = |vector: fn(&Imu) -> Vector3<f64>| {
        let squares = measured
            .iter()
            .zip(simulated)
            .filter(|(one, _)| inside(one))
            .map(|(one, other)| {
                assert_eq!(one.header.stamp, other.header.stamp);
                (vector(one) - vector(other)).norm_squared()
            });
        let squares: Vec<f64> = squares.collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    [
        of(|imu| imu.linear_acceleration.into()),
        of(|imu| imu.angular_velocity.into()),
    ]
}

/// Simulates another recording of the session under the effects that were found: the gap is what
/// was promised.
pub fn promise_holds(folder: &Path, out: &str, check: &str, placement: &str) {
    let effects = format!("{out}/effects.yaml");
    succeed(
        folder,
        &[
            "simulate",
            "--reference",
            check,
            "--effects",
            &effects,
            "--no-noise",
            "--out",
            "again.mcap",
            "--force",
        ],
    );
    let found = rmse(
        &imus(&folder.join(check), placement),
        &imus(&folder.join("again.mcap"), placement),
    );
    let promised = &diagnosis(folder, out)["placements"][placement]["gap"]["after"];
    for (found, key) in found.into_iter().zip(["accel_rmse", "gyro_rmse"]) {
        let promised = promised[key].as_f64().unwrap();
        assert!(
            (found / promised - 1.0).abs() < 0.15,
            "{placement}, {key}: promised {promised}, found {found}"
        );
    }
}

fn keys(value: &Value) -> BTreeSet<String> {
    value.as_object().unwrap().keys().cloned().collect()
}

/// The keys of diagnosis.json, all of them and no others; shares that add up.
pub fn contract(diagnosis: &Value) {
    const METRICS: [&str; 7] = [
        "accel_rmse",
        "gyro_rmse",
        "accel_log_spectral_distance_db",
        "gyro_log_spectral_distance_db",
        "accel_wasserstein",
        "gyro_wasserstein",
        "nll_per_sample",
    ];
    let metrics = |value: &Value| {
        assert_eq!(keys(value), set(&METRICS));
        assert!(METRICS.iter().all(|key| value[key].is_f64()), "{value}");
    };
    assert_eq!(keys(diagnosis), set(&["schema", "placements"]));
    assert_eq!(diagnosis["schema"], "cromosim/diagnosis/1");
    for placement in diagnosis["placements"].as_object().unwrap().values() {
        // `verdict` is one sentence for people.
        assert_eq!(
            keys(placement),
            set(&[
                "verdict",
                "gap",
                "where",
                "causes",
                "unidentifiable",
                "unexplained"
            ])
        );
        assert_eq!(keys(&placement["gap"]), set(&["before", "after"]));
        metrics(&placement["gap"]["before"]);
        metrics(&placement["gap"]["after"]);
        assert_eq!(
            keys(&placement["where"]),
            set(&["channels", "axes", "bands_hz", "intervals_s"])
        );
        for range in ["bands_hz", "intervals_s"] {
            placement["where"][range]
                .as_array()
                .unwrap()
                .iter()
                .for_each(|range| assert_eq!(keys(range), set(&["from", "to", "share"])));
        }
        assert_eq!(
            keys(&placement["unexplained"]),
            set(&["significant", "share", "where"])
        );
        placement["unidentifiable"]
            .as_array()
            .unwrap()
            .iter()
            .for_each(|one| assert_eq!(keys(one), set(&["effect", "would_tell"])));
        let mut shares = vec![f64::INFINITY];
        for cause in placement["causes"].as_array().unwrap() {
            assert_eq!(
                keys(cause),
                set(&[
                    "effect",
                    "probability",
                    "probability_by_margin",
                    "parameters",
                    "standard_errors",
                    "gap_share",
                    "after"
                ])
            );
            metrics(&cause["after"]);
            shares.push(cause["gap_share"].as_f64().unwrap());
        }
        assert!(
            shares.windows(2).all(|pair| pair[0] >= pair[1]),
            "by share, the largest first: {shares:?}"
        );
        let whole =
            shares[1..].iter().sum::<f64>() + placement["unexplained"]["share"].as_f64().unwrap();
        assert!((whole - 1.0).abs() < 1e-9, "shares add up to {whole}");
    }
}
