//! Evaluations and trainings whose data are not there say what to get, from whom, and where to put
//! it.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{refuses, root};

const PROTOCOL: &str = "\
schema: cromosim/fidelity/1
seed: 5
studies:
  - name: walk, 60 Hz
    measured: drawn
    model: motion_capture
    test:
      - {subject: a, licence: own, motions: [\"mocap_cmu/02_*.npz\"], sites: [left_watch]}
    mapping:
      - {subject: b, licence: own, motions: [\"mocap_cmu/02_*.npz\"], sites: [left_watch]}
";

#[test]
fn who_has_no_data_is_told_what_to_get() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let config = root().join("config");
    let of = |file: &str| config.join(file).display().to_string();
    let motion_capture = of("training/motion_capture.yaml");
    let totalcapture = of("training/totalcapture.yaml");
    fs::write(here.join("protocol.yaml"), PROTOCOL).unwrap();
    fs::create_dir(here.join("empty")).unwrap();
    fs::create_dir_all(here.join("half/har_spsw")).unwrap();
    let cmu = [
        "mocap_cmu: not there; get ",
        "mocap.cs.cmu.edu",
        "cromosim convert 02_01.bvh 02_01.npz",
        "a folder that --data names",
    ];
    for (arguments, words) in [
        (vec!["train", &motion_capture, "--out", "t"], &cmu[..]),
        (
            vec!["train", &totalcapture, "--data", "empty", "--out", "t"],
            &[
                "empty/S1: not there; get TotalCapture",
                "cvssp.org",
                "research only",
            ],
        ),
        (
            vec![
                "evaluate",
                "fidelity",
                "--protocol",
                "protocol.yaml",
                "--data",
                "empty",
                "--out",
                "f",
            ],
            &[
                "empty/mocap_cmu: not there; get ",
                "mocap.cs.cmu.edu",
                "--data",
            ],
        ),
        (
            vec!["evaluate", "har", "--data", "empty", "--out", "h"],
            &[
                "empty/har_spsw: not there; get ",
                "GeoTecINIT/sp-sw-har-dataset",
                "CC BY 4.0",
            ],
        ),
        (
            vec!["evaluate", "har", "--data", "half", "--out", "h"],
            &[
                "half/har_spsw: no .npz files; get ",
                "GeoTecINIT/sp-sw-har-dataset",
            ],
        ),
    ] {
        refuses(here, &arguments, words);
        for out in ["t", "f", "h"] {
            assert!(!here.join(out).exists(), "{arguments:?}");
        }
    }
}
