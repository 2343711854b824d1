//! What cannot be converted.

use std::fs;

use cromosim_recording::rigid::write_tum;

use crate::common::{refuses, succeed};
use crate::files::{names, swing, walk};

#[test]
fn what_cannot_be_converted_is_said_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 0.2);
    fs::write(at("robot.tum"), write_tum(&swing(0.1))).unwrap();
    fs::write(at("taken.csv"), "mine").unwrap();
    fs::write(at("prose.txt"), "once upon a time").unwrap();
    let before = names(folder.path());
    let here = folder.path();
    refuses(
        here,
        &["convert", "robot.tum", "taken.csv"],
        &["taken.csv: exists already", "--force"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "robot.xyz"],
        &["robot.xyz: the ending", "--to"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "robot.bvh"],
        &["robot.tum: a trajectory cannot become a BVH file"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--joint", "head"],
        &["a trajectory has no joint or site head"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--topic", "/a"],
        &["--topic chooses from a bag"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--start", "1"],
        &["--start is for motions"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.mcap", "--name", "a b"],
        &["--name a b"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.mcap", "--imu", "robot.tum"],
        &["robot.tum: a trajectory; --imu takes an IMU series"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum"],
        &["walk.bvh: a motion has 24 joints", "--joint"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum", "--joint", "tail"],
        &["--joint tail", "left_wrist"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum", "--site", "tail"],
        &["--site tail"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.mcap", "--placement", "hand"],
        &["--placement is for recordings of data sets"],
    );
    fs::write(at("trial.hdf5"), b"\x89HDF\r\n\x1a\n\0\0\0\0").unwrap();
    refuses(
        here,
        &["convert", "trial.hdf5", "x.mcap"],
        &["trial.hdf5: HDF5", "save -v7"],
    );
    fs::remove_file(at("trial.hdf5")).unwrap();
    refuses(
        here,
        &["convert", "prose.txt", "x.bvh"],
        &["prose.txt: not a motion file"],
    );
    refuses(
        here,
        &["convert", "absent.bvh", "x.bvh"],
        &["absent.bvh: cannot be read"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "nowhere/x.csv"],
        &["nowhere/x.csv: cannot be written"],
    );
    refuses(
        here,
        &[
            "simulate", "--rigid", "walk.bvh", "--rate", "100", "--out", "x.mcap",
        ],
        &["walk.bvh: not a trajectory"],
    );
    refuses(
        here,
        &[
            "simulate",
            "--rigid",
            "robot.tum",
            "--rate",
            "100",
            "--out",
            "x.mcap",
            "--placement",
            "a b",
        ],
        &["--placement a b"],
    );
    refuses(
        here,
        &["inspect", "walk.bvh", "--motion-rate", "-1"],
        &["--motion-rate -1"],
    );
    assert_eq!(names(here), before);
    assert_eq!(fs::read_to_string(at("taken.csv")).unwrap(), "mine");
    succeed(here, &["convert", "robot.tum", "taken.csv", "--force"]);
    assert_eq!(names(here), before);
    assert!(
        fs::read_to_string(at("taken.csv"))
            .unwrap()
            .starts_with("stamp_ns")
    );
}
