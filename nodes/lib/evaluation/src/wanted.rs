//! Third-party data that are not there: what to get, from whom, and where to put it.

use std::path::Path;

use crate::EvaluationError;

/// A folder of the data, as `config/training`, `config/evaluation` and `evaluate har` name it.
struct Wanted {
    folder: &'static str,
    what: &'static str,
    whom: &'static str,
    licence: &'static str,
    files: &'static str,
}

const CMU: &str =
    "mocap.cs.cmu.edu, as BVH from github.com/AtelierCircle/CMU-MoCap-01-09 and CMU-MoCap-10-14";
const CMU_LICENCE: &str = "free for any use, the conversion MIT";
const TOTALCAPTURE: Wanted = Wanted {
    folder: "S1",
    what: "TotalCapture (Trumble et al. 2017)",
    whom: "cvssp.org/data/totalcapture",
    licence: "research only",
    files: "S1/*_AuxFields.sensors and so on",
};

const ALL: [Wanted; 10] = [
    Wanted {
        folder: "mocap_cmu",
        what: "motions of CMU's database",
        whom: CMU,
        licence: CMU_LICENCE,
        files: "mocap_cmu/02_01.npz and so on (`cromosim convert 02_01.bvh 02_01.npz`)",
    },
    Wanted {
        folder: "mocap_cmu_har",
        what: "motions of CMU's database with a label for each frame",
        whom: CMU,
        licence: CMU_LICENCE,
        files: "mocap_cmu_har/02_01.npz and so on (trainings and fidelity need no labels: `cromosim convert 02_01.bvh 02_01.npz`)",
    },
    Wanted {
        folder: "paired_broad",
        what: "BROAD's trials (Laidig et al. 2021)",
        whom: "github.com/dlaidig/broad",
        licence: "CC BY 4.0",
        files: "paired_broad/01_NAME.npz and so on",
    },
    Wanted {
        folder: "paired_gaitmap_foot",
        what: "gaitmap's example of an IMU and markers on a shoe",
        whom: "github.com/mad-lab-fau/gaitmap",
        licence: "MIT",
        files: "paired_gaitmap_foot/left_sensor.npz",
    },
    Wanted {
        folder: "har_spsw",
        what: "activities recorded by phone and watch (Matey-Sanz et al. 2023)",
        whom: "github.com/GeoTecINIT/sp-sw-har-dataset",
        licence: "CC BY 4.0",
        files: "har_spsw/s01.npz and so on",
    },
    TOTALCAPTURE,
    Wanted {
        folder: "S2",
        ..TOTALCAPTURE
    },
    Wanted {
        folder: "S3",
        ..TOTALCAPTURE
    },
    Wanted {
        folder: "S4",
        ..TOTALCAPTURE
    },
    Wanted {
        folder: "S5",
        ..TOTALCAPTURE
    },
];

/// The error for a file or folder of the data that is not there: `problem` says what is missing.
pub(crate) fn not_there(path: &Path, problem: &str) -> EvaluationError {
    let is = |wanted: &&Wanted| path.iter().any(|part| part == wanted.folder);
    // The deepest of a path's folders: the folder of all data may have any name.
    let hint = ALL.iter().rev().find(is).map_or_else(
        || "--data names the folder that data are looked for in".to_owned(),
        |wanted| {
            format!(
                "get {} from {} ({}) and put them as {} into a folder that --data names; which keys the files have: nodes/lib/evaluation/README.md",
                wanted.what, wanted.whom, wanted.licence, wanted.files
            )
        },
    );
    EvaluationError::NoData {
        path: path.to_owned(),
        problem: problem.to_owned(),
        hint,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_data_say_whence_and_where_to() {
        let said = |path: &str| not_there(Path::new(path), "not there").to_string();
        for wanted in &ALL {
            let text = said(&format!("data/{}/x.npz", wanted.folder));
            let has = [wanted.whom, wanted.licence, wanted.files, "--data"];
            assert!(has.iter().all(|part| text.contains(part)), "{text}");
            assert!(!text.contains('\n'), "{text}");
        }
        assert!(
            said("own/walk.bvh").ends_with("--data names the folder that data are looked for in")
        );
    }
}
