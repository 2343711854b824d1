//! Motions, trajectories and poses in bags, there and back.

use std::fs;

use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_motion::{MotionOptions, read_motion};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::std_msgs::Header;
use cromosim_recording::rigid::parse_tum;
use cromosim_spatial::Stamp;

use crate::common::{refuses, succeed};
use crate::files::{rows, walk};

#[test]
fn a_motion_becomes_bvh_npz_and_markers() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 1.0);
    let said = succeed(folder.path(), &["convert", "walk.bvh", "again.bvh"]);
    assert!(said.contains("a BVH file of 101 frames"), "{said}");
    let [first, again] = ["walk.bvh", "again.bvh"]
        .map(|name| read_motion(&at(name), &MotionOptions::default()).unwrap());
    for (a, b) in first.frames.iter().zip(&again.frames) {
        assert!((a.root_position - b.root_position).norm() < 1e-4);
        assert!(
            a.world_rotations()
                .iter()
                .zip(&b.world_rotations())
                .all(|(a, b)| a.angle_to(b) < 1e-4)
        );
    }
    succeed(folder.path(), &["convert", "walk.bvh", "walk.npz"]);
    let mut npz = cromosim_arrays::NpzReader::open(&at("walk.npz")).unwrap();
    assert_eq!(
        npz.keys(),
        [
            "betas",
            "body",
            "gender",
            "mocap_framerate",
            "poses",
            "surface_model_type",
            "trans"
        ]
    );
    assert_eq!(npz.header("poses").unwrap().unwrap().shape, [101, 72]);
    // Markers are placed on the walk, and the fit to them finds the walk again.
    succeed(folder.path(), &["convert", "walk.bvh", "markers.trc"]);
    let said = succeed(
        folder.path(),
        &["inspect", "markers.trc", "--placements-as-given"],
    );
    assert!(
        said.contains("marker set plug_in_gait") && said.contains("mm (root mean square)"),
        "{said}"
    );
    succeed(
        folder.path(),
        &[
            "convert",
            "markers.trc",
            "fitted.tum",
            "--joint",
            "left_wrist",
            "--placements-as-given",
        ],
    );
    succeed(
        folder.path(),
        &["convert", "walk.bvh", "known.tum", "--joint", "left_wrist"],
    );
    let [fitted, known] = ["fitted.tum", "known.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert_eq!(fitted.stamps, known.stamps);
    let mut errors: Vec<f64> = fitted
        .positions
        .iter()
        .zip(&known.positions)
        .map(|(a, b)| (a - b).norm())
        .collect();
    errors.sort_by(f64::total_cmp);
    println!(
        "left wrist by exact markers: median {:.2} mm, largest {:.2} mm",
        1e3 * errors[50],
        1e3 * errors[100]
    );
    assert!(errors[100] < 8e-3, "{errors:?}");
}

#[test]
fn trajectories_go_round_through_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 0.5);
    succeed(
        folder.path(),
        &["convert", "walk.bvh", "watch.tum", "--site", "left_watch"],
    );
    succeed(folder.path(), &["convert", "watch.tum", "watch.csv"]);
    succeed(
        folder.path(),
        &["convert", "watch.csv", "data.csv", "--to", "euroc"],
    );
    succeed(
        folder.path(),
        &["convert", "data.csv", "watch.mcap", "--name", "wrist"],
    );
    succeed(folder.path(), &["convert", "watch.mcap", "again.tum"]);
    succeed(folder.path(), &["convert", "data.csv", "exact.tum"]);
    assert!(rows(&at("watch.tum")) == rows(&at("exact.tum")));
    // Quaternions of messages are brought to length 1 once more.
    let [first, again] = ["watch.tum", "again.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert!(first.stamps == again.stamps && first.positions == again.positions);
    assert!(
        first
            .rotations
            .iter()
            .zip(&again.rotations)
            .all(|(a, b)| (a.coords - b.coords).norm() < 1e-15)
    );
    for (name, kind) in [
        ("watch.tum", "TUM"),
        ("watch.csv", "table"),
        ("data.csv", "EuRoC"),
    ] {
        let said = succeed(folder.path(), &["inspect", name]);
        assert!(
            said.contains("trajectory (") && said.contains(kind) && said.contains("51 rows"),
            "{said}"
        );
    }
    // EuRoC's velocities and biases survive what can hold them.
    let full = "#timestamp, p_RS_R_x [m]\n5,1,2,3,1,0,0,0,4,5,6,7,8,9,10,11,12\n7,1,2,3,1,0,0,0,4,5,6,7,8,9,10,11,12\n";
    fs::write(at("full.csv"), full).unwrap();
    succeed(
        folder.path(),
        &["convert", "full.csv", "same.csv", "--to", "euroc"],
    );
    assert_eq!(rows(&at("full.csv")), rows(&at("same.csv")));
}

#[test]
fn poses_of_a_body_in_a_bag_become_a_motion_again() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    walk(here, 1.0);
    let read = |name: &str| read_motion(&at(name), &MotionOptions::default()).unwrap();
    let same = |a: &str, b: &str, within: f64| {
        let (a, b) = (read(a), read(b));
        assert_eq!(
            (a.frames.len(), (a.rate_hz * 1e3).round()),
            (b.frames.len(), (b.rate_hz * 1e3).round())
        );
        for (a, b) in a.frames.iter().zip(&b.frames) {
            assert!((a.root_position - b.root_position).norm() < within);
            assert!(
                a.world_rotations()
                    .iter()
                    .zip(&b.world_rotations())
                    .all(|(a, b)| a.angle_to(b) < within)
            );
        }
    };
    // From the states that simulate writes beside the IMUs, and from poses alone.
    succeed(here, &["convert", "walk.bvh", "walk.npz"]);
    succeed(here, &["simulate", "walk.bvh", "--out", "whole.mcap"]);
    succeed(here, &["convert", "whole.mcap", "states.npz"]);
    same("walk.npz", "states.npz", 1e-6);
    let said = succeed(here, &["convert", "walk.bvh", "poses.mcap"]);
    assert!(said.contains("a bag of 101 frames"), "{said}");
    succeed(
        here,
        &["convert", "poses.mcap", "again.npz", "--start", "0.2"],
    );
    assert_eq!(read("again.npz").frames.len(), 81);
    succeed(
        here,
        &[
            "convert",
            "poses.mcap",
            "wrist.tum",
            "--joint",
            "left_wrist",
        ],
    );
    succeed(
        here,
        &["convert", "walk.bvh", "known.tum", "--joint", "left_wrist"],
    );
    let [wrist, known] = ["wrist.tum", "known.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert!(
        wrist
            .positions
            .iter()
            .zip(&known.positions)
            .all(|(a, b)| (a - b).norm() < 1e-9)
    );

    // Uneven stamps, with a gap of 0.3 s: the rate is the median's, and the gap is not to be
    // trusted.
    let reader = BagReader::open(&at("poses.mcap")).unwrap();
    let mut bag = BagWriter::create(&at("uneven.mcap"), BagOptions::default()).unwrap();
    for (index, (stamp, pose)) in reader
        .read::<SmplPose>("/smpl/pose")
        .unwrap()
        .into_iter()
        .enumerate()
    {
        let jitter = [0, 300_000, -200_000][index % 3];
        let stamp = Stamp::from_nanos(stamp.nanos + jitter);
        if !(40..70).contains(&index) {
            bag.write(
                "/smpl/pose",
                stamp,
                &SmplPose {
                    header: Header::new(stamp.nanos, "world"),
                    ..pose
                },
            )
            .unwrap();
        }
    }
    bag.finish().unwrap();
    succeed(
        here,
        &["convert", "uneven.mcap", "even.mcap", "--to", "amass"],
    );
    let even = read("even.mcap");
    assert!(
        (even.rate_hz - 100.0).abs() < 6.0 && (even.duration_s() - 1.0).abs() < 0.02,
        "{} Hz, {} s",
        even.rate_hz,
        even.duration_s()
    );
    refuses(
        here,
        &["convert", "uneven.mcap", "x.npz", "--person", "7"],
        &["/smpl/pose: --person 7: nobody of that name; the bodies here: 0"],
    );
    refuses(
        here,
        &["convert", "uneven.mcap", "x.npz", "--up-axis", "y"],
        &["--up-axis is for motion files"],
    );
}
