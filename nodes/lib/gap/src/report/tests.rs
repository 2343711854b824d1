#![allow(clippy::unwrap_used)]
//! The page of a made-up diagnosis. `CROMOSIM_REPORT=FILE.html cargo test -p cromosim_gap report`
//! keeps it, to be looked at.

use cromosim_spatial::Stamp;
use serde_json::json;

use super::*;
use crate::diagnosis::{
    Cause, Gap, GapLocation, Interval, Metrics, SCHEMA, Unexplained, Unidentifiable,
};
use crate::evidence::{CoursePoint, Spectra};

fn shares(entries: &[(&str, f64)]) -> BTreeMap<String, f64> {
    entries
        .iter()
        .map(|(name, share)| ((*name).to_owned(), *share))
        .collect()
}

fn metrics(accel: f64, gyro: f64) -> Metrics {
    Metrics {
        accel_rmse: accel,
        gyro_rmse: gyro,
        accel_log_spectral_distance_db: 3.1 * accel,
        gyro_log_spectral_distance_db: 10.0 * gyro,
        accel_wasserstein: 0.4 * accel,
        gyro_wasserstein: 0.3 * gyro,
        nll_per_sample: -9.1 + accel,
    }
}

fn cause(
    effect: &str,
    share: f64,
    parameters: serde_json::Value,
    errors: serde_json::Value,
    after: Metrics,
) -> Cause {
    let map = |value: serde_json::Value| value.as_object().unwrap().clone().into_iter().collect();
    let (parameters, standard_errors) = (map(parameters), map(errors));
    Cause {
        effect: effect.to_owned(),
        probability: 0.97,
        probability_by_margin: 0.97,
        parameters,
        standard_errors,
        gap_share: share,
        after,
    }
}

fn placement(verdict: &str, causes: Vec<Cause>, unexplained: Unexplained) -> PlacementDiagnosis {
    let location = GapLocation {
        channels: shares(&[("accel", 0.97), ("gyro", 0.03)]),
        axes: shares(&[
            ("accel_x", 0.2),
            ("accel_y", 0.47),
            ("accel_z", 0.3),
            ("gyro_x", 0.01),
            ("gyro_y", 0.005),
            ("gyro_z", 0.015),
        ]),
        bands_hz: vec![
            Interval {
                from: 0.0,
                to: 0.5,
                share: 0.1,
            },
            Interval {
                from: 0.5,
                to: 2.0,
                share: 0.25,
            },
            Interval {
                from: 2.0,
                to: 8.0,
                share: 0.6,
            },
            Interval {
                from: 8.0,
                to: 50.0,
                share: 0.05,
            },
        ],
        intervals_s: vec![
            Interval {
                from: 12.0,
                to: 31.5,
                share: 0.35,
            },
            Interval {
                from: 31.5,
                to: 60.0,
                share: 0.65,
            },
        ],
    };
    let gap = Gap {
        before: metrics(1.2, 0.1),
        after: causes.last().map_or(metrics(1.2, 0.1), |cause| cause.after),
    };
    let unidentifiable = vec![Unidentifiable {
        effect: "accel_scale".into(),
        would_tell: "motion with 2 m/s2 or more on all axes".into(),
    }];
    PlacementDiagnosis {
        recordings: Vec::new(),
        magnetometer: None,
        clock_jumps: Vec::new(),
        calibration: Vec::new(),
        reference_response: None,
        verdict: verdict.into(),
        gap,
        location,
        causes,
        unidentifiable,
        unexplained,
    }
}

/// A hash of an index as noise between -1 and 1.
fn noise(index: u64) -> f64 {
    let mixed = index.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ (mixed >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1u64 << 52) as f64
        - 1.0
}

fn evidence(gap: f64) -> Evidence {
    let mut evidence = Evidence::default();
    for k in 0..6000u64 {
        let t = k as f64 * 0.01;
        if (34.0..34.4).contains(&t) {
            continue;
        }
        let clean: [f64; 6] = std::array::from_fn(|axis| {
            let (size, centre) = if axis < 3 {
                (6.0, [0.0, 3.0, 9.0][axis])
            } else {
                (2.0, 0.0)
            };
            centre
                + size
                    * (0.4 + 0.6 * (0.11 * t).sin().powi(2))
                    * ((2.1 + axis as f64) * t + axis as f64).sin()
                    * (0.7 * t).cos()
        });
        let late = gap * (0.3 + (0.05 * t).sin().abs());
        evidence.stamps.push(Stamp::from_seconds(1.7e9 + t));
        evidence.used.push(!(36.0..36.5).contains(&t));
        let unit = |axis: usize| if axis < 3 { 0.15 } else { 0.03 };
        evidence.measured.push(std::array::from_fn(|axis| {
            clean[axis] + unit(axis) * noise(6 * k + axis as u64)
        }));
        evidence.before.push(std::array::from_fn(|axis| {
            clean[axis] - late * 10.0 * unit(axis) * (5.0 * t + axis as f64).sin()
        }));
        evidence.after.push(clean);
    }
    for second in 0..60 {
        let seconds = f64::from(second) + 0.5;
        let before = 1.0 + gap * 800.0 * (0.3 + (0.05 * seconds).sin().abs()).powi(2);
        let wobble = 1.0 + 0.2 * noise(second as u64);
        evidence.course.push(CoursePoint {
            seconds,
            accel_before: before * wobble,
            accel_after: wobble,
            gyro_before: before.sqrt() * wobble,
            gyro_after: 1.1 * wobble,
        });
    }
    let mut spectra = Spectra::default();
    for k in 0..=512u32 {
        let hz = f64::from(k) * 50.0 / 512.0;
        let of = |level: f64| {
            std::array::from_fn(|axis| {
                level
                    * if axis < 3 { 1.0 } else { 0.04 }
                    * (1.0 + 0.3 * noise(u64::from(k) + axis as u64))
            })
        };
        spectra.frequencies.push(hz);
        spectra
            .measured
            .push(of(20.0 / (1.0 + (hz / 2.0).powi(4)) + 1.5e-4));
        spectra
            .residual_before
            .push(of(gap * 2.0 / (1.0 + (hz / 4.0).powi(4)) + 1.6e-4));
        spectra.residual_after.push(of(1.6e-4));
        spectra
            .predicted
            .push([1.5e-4, 1.5e-4, 1.5e-4, 6e-6, 6e-6, 6e-6]);
    }
    evidence.spectra = spectra;
    evidence
}

/// Three placements: explained, partly unexplained, without a gap.
fn sample() -> (Diagnosis, BTreeMap<String, Evidence>) {
    let lever = || {
        let (parameters, errors) = (
            json!({"offset": [0.0503, 0.0004, -0.0612]}),
            json!({"offset": [0.0011, 0.0009, 0.0012]}),
        );
        cause("lever_arm", 0.71, parameters, errors, metrics(0.51, 0.1))
    };
    let offset = cause(
        "time_offset",
        0.22,
        json!({"seconds": 0.0211}),
        json!({"seconds": 0.0004}),
        metrics(0.26, 0.02),
    );
    let matrix =
        json!({"matrix": [[0.001, 0.0002, 0.0], [0.0, -0.004, 0.0001], [0.0, 0.0, 0.002]]});
    let coupling = cause(
        "gyro_g_sensitivity",
        0.05,
        matrix,
        json!({"matrix": [[3e-4, 2e-4, 2e-4], [2e-4, 2e-4, 2e-4], [2e-4, 3e-4, 2e-4]]}),
        metrics(0.26, 0.012),
    );
    let unknown = json!({"channel": "accel", "axes": ["accel_x", "accel_y"], "band_hz": [4.0, 9.0], "intervals_s": [[12.0, 31.5]], "depends_on": "<heel strikes>"});
    let rest = Unexplained {
        significant: true,
        share: 0.0,
        location: GapLocation {
            channels: shares(&[("accel", 1.0)]),
            ..GapLocation::default()
        },
    };
    let placements = BTreeMap::from([
        (
            "left_wrist".to_owned(),
            placement(
                "The sensor sits 7.9 cm from where the simulation has it and its stamps are 21 ms late; with both the gap falls from 1.20 to 0.26 m/s2.",
                vec![lever(), offset, coupling],
                Unexplained {
                    significant: false,
                    share: 0.02,
                    location: GapLocation::default(),
                },
            ),
        ),
        (
            "right_ankle".to_owned(),
            placement(
                "Half of the gap is the lever arm; the rest, between 4 and 9 Hz after each step, is none of the effects known here.",
                vec![
                    lever(),
                    cause("unknown", 0.29, unknown, json!({}), metrics(0.51, 0.1)),
                ],
                rest,
            ),
        ),
        (
            "head & <neck>".to_owned(),
            placement(
                "No gap beyond the declared noise.",
                Vec::new(),
                Unexplained::default(),
            ),
        ),
    ]);
    let diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        placements,
    };
    let evidence = BTreeMap::from([
        ("left_wrist".to_owned(), evidence(1.0)),
        ("right_ankle".to_owned(), evidence(0.5)),
        ("head & <neck>".to_owned(), evidence(0.0)),
    ]);
    (diagnosis, evidence)
}

#[test]
fn the_page_names_everything_and_loads_nothing() {
    let (diagnosis, evidence) = sample();
    let page = html(&diagnosis, &evidence, "walk_03.mcap <b>");
    if let Some(path) = std::env::var_os("CROMOSIM_REPORT") {
        std::fs::write(path, &page).unwrap();
    }
    for placement in diagnosis.placements.values() {
        assert!(page.contains(&cromosim_charts::text::escape(&placement.verdict)));
        for cause in &placement.causes {
            assert!(
                page.contains(&format!(">{}<", cause.effect)),
                "{}",
                cause.effect
            );
        }
    }
    assert!(
        page.contains("left_wrist")
            && page.contains("head &amp; &lt;neck&gt;")
            && page.contains("walk_03.mcap &lt;b&gt;")
    );
    assert!(
        page.contains("&lt;heel strikes&gt;")
            && page.contains("motion with 2 m/s2 or more on all axes")
    );
    let elsewhere = page.replace("http://www.w3.org/2000/svg", "");
    assert!(
        !elsewhere.contains("http://")
            && !elsewhere.contains("https://")
            && !elsewhere.contains("<script")
            && !elsewhere.contains("src=")
    );
    assert!(
        !page.contains("NaN") && !page.contains("inf"),
        "a number that is none came in"
    );
    assert!(page.len() < 600_000, "{} bytes", page.len());
    // The most urgent first.
    assert!(page.find("right_ankle").unwrap() < page.find("left_wrist").unwrap());
}

#[test]
fn pictures_are_well_formed_and_labelled() {
    let (diagnosis, evidence) = sample();
    let page = html(&diagnosis, &evidence, "x");
    let pictures: Vec<&str> = page
        .split("<svg")
        .skip(1)
        .map(|part| part.split_once("</svg>").unwrap().0)
        .collect();
    assert_eq!(pictures.len(), 3 * (6 + 2 + 2));
    for picture in pictures {
        let picture = format!("<svg{picture}</svg>");
        let document = roxmltree::Document::parse(&picture).unwrap();
        let of_class = |class: &str| {
            document
                .descendants()
                .filter(|node| node.attribute("class") == Some(class))
                .count()
        };
        assert_eq!(
            (of_class("label"), of_class("title")),
            (2, 1),
            "both axes have a label"
        );
        let ticks = document
            .descendants()
            .find(|node| node.attribute("class") == Some("ticks"))
            .unwrap();
        assert!(ticks.children().count() >= 5, "{picture}");
        let lines = document
            .descendants()
            .filter(|node| {
                node.attribute("class")
                    .is_some_and(|class| class.starts_with("line "))
            })
            .count();
        assert!((2..=4).contains(&lines), "{picture}");
    }
}

#[test]
fn the_page_is_well_formed_but_for_what_html_allows() {
    let (diagnosis, evidence) = sample();
    let page = html(&diagnosis, &evidence, "x").replace("<br>", "<br/>");
    let (_, body) = page.split_once("<body>").unwrap();
    let body = format!("<body>{}", body.split_once("</html>").unwrap().0);
    assert!(
        roxmltree::Document::parse(&body).is_ok(),
        "{:?}",
        roxmltree::Document::parse(&body).err()
    );
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let (diagnosis, evidence) = sample();
    assert!(html(&diagnosis, &evidence, "x") == html(&diagnosis, &evidence, "x"));
}

#[test]
fn little_and_broken_evidence_is_no_harm() {
    let (diagnosis, mut evidence) = sample();
    evidence.remove("right_ankle");
    evidence.insert("left_wrist".into(), Evidence::default());
    let head = evidence.get_mut("head & <neck>").unwrap();
    head.before
        .iter_mut()
        .for_each(|values| values[1] = f64::NAN);
    head.after.truncate(10);
    head.course
        .iter_mut()
        .for_each(|point| point.gyro_after = f64::INFINITY);
    head.spectra.predicted.clear();
    let page = html(&diagnosis, &evidence, "x");
    assert!(page.contains("No curves are at hand") && !page.contains("NaN"));
    let none = Diagnosis {
        schema: SCHEMA.to_owned(),
        placements: BTreeMap::new(),
    };
    assert!(html(&none, &BTreeMap::new(), "x").contains("no placement that can be diagnosed"));
}

#[test]
fn the_worst_seconds_are_those_with_the_largest_residual() {
    let evidence = evidence(1.0);
    let window = figures::worst_window(&evidence);
    assert!(
        (25.0..=35.0).contains(&window.from) && (window.to - window.from - 6.0).abs() < 1e-9,
        "{window:?}"
    );
}
