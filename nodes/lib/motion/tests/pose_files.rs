//! Files of SMPL parameters: told apart, read no further than needed, and errors that say what to
//! do.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use common::containers::{Arrays, Py, npz, parsed};
use common::own_file;
use cromosim_arrays::{Container, Limits};
use cromosim_body::BodyModel;
use cromosim_motion::{
    MotionError, MotionOptions, PoseFile, PoseFormat, PoseView, SmplMotion, UpAxis, open_poses,
    read_motion,
};

/// The samples of the container crate, which hold no sane motion throughout, are at least told
/// apart.
#[test]
fn other_samples_are_recognised() {
    let format = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../arrays/tests/data")
            .join(name);
        open_poses(&path, PoseView::World)
            .map(|file| file.unwrap().format)
            .map_err(|error| error.to_string())
    };
    for name in [
        "plain_p2.pkl",
        "plain_p5.pkl",
        "joblib.pkl",
        "joblib_z3.pkl",
    ] {
        assert_eq!(format(name), Ok(PoseFormat::Vibe), "{name}");
    }
    assert_eq!(format("amass.npz"), Ok(PoseFormat::Amass));
    assert_eq!(format("gvhmr.pt"), Ok(PoseFormat::Gvhmr));
    assert_eq!(format("phalp.joblib"), Ok(PoseFormat::Phalp));
    assert!(
        format("tram.npy")
            .unwrap_err()
            .contains("tram.npy: key pred_rotmat: matrix 0 is no rotation")
    );
    assert!(
        format("smpl_chumpy_p2.pkl")
            .unwrap_err()
            .ends_with("an SMPL body model, not a motion; give it as the body (--body FILE)")
    );
    assert!(
        format("many.npz")
            .unwrap_err()
            .contains("no known motion in it (found the keys big, bool")
    );
}

/// Counts what is read.
struct Counting<R>(R, std::rc::Rc<std::cell::Cell<u64>>);

impl<R: std::io::Read> std::io::Read for Counting<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.0.read(buffer)?;
        self.1.set(self.1.get() + count as u64);
        Ok(count)
    }
}

impl<R: std::io::Seek> std::io::Seek for Counting<R> {
    fn seek(&mut self, position: std::io::SeekFrom) -> std::io::Result<u64> {
        self.0.seek(position)
    }
}

#[test]
fn of_200_megabytes_only_the_motion_is_read() {
    let stored =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let mut small =
        zip::ZipArchive::new(std::fs::File::open(own_file("poses/amass.npz")).unwrap()).unwrap();
    for index in 0..small.len() {
        archive
            .raw_copy_file(small.by_index(index).unwrap())
            .unwrap();
    }
    archive.start_file("markers.npy", stored).unwrap();
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (25000000,), }\n";
    std::io::Write::write_all(
        &mut archive,
        &[
            &b"\x93NUMPY\x01\x00"[..],
            &(header.len() as u16).to_le_bytes(),
            header.as_bytes(),
        ]
        .concat(),
    )
    .unwrap();
    std::io::copy(
        &mut std::io::Read::take(std::io::repeat(0), 200_000_000),
        &mut archive,
    )
    .unwrap();
    let count = std::rc::Rc::new(std::cell::Cell::new(0));
    let file = Counting(archive.finish().unwrap(), count.clone());
    let mut container = Container::new(file, Path::new("long.npz"), Limits::default()).unwrap();
    let poses = PoseFile::parse(&mut container, PoseView::World, || Ok(None)).unwrap();
    println!("read {} bytes of 200 MB", count.get());
    assert!(
        poses.tracks[0].rotations.len() == 6 && count.get() < 200_000,
        "{} bytes were read",
        count.get()
    );
}

fn amass(frames: usize) -> Arrays {
    let root = [1.5, 0.1, 0.0]
        .iter()
        .chain([0.0; 153].iter())
        .copied()
        .collect::<Vec<f64>>();
    Arrays::from([
        ("poses", (vec![frames, 156], root.repeat(frames))),
        ("trans", (vec![frames, 3], vec![0.5; 3 * frames])),
        ("betas", (vec![16], vec![0.1; 16])),
        ("mocap_framerate", (vec![], vec![60.0])),
    ])
}

fn vibe(frames: usize) -> Vec<(&'static str, Py)> {
    vec![
        ("pose", Py::rows(&vec![0.1; 72 * frames], 72)),
        ("betas", Py::rows(&vec![0.1; 10 * frames], 10)),
    ]
}

fn one_line<T: std::fmt::Debug>(result: Result<T, MotionError>, parts: &[&str]) {
    let message = result.unwrap_err().to_string();
    assert!(
        message.starts_with("clip.bin: ") && !message.contains('\n'),
        "{message}"
    );
    assert!(
        parts.iter().all(|part| message.contains(part)),
        "{message} should name {parts:?}"
    );
}

fn motion(bytes: Vec<u8>, options: &MotionOptions) -> Result<SmplMotion, MotionError> {
    parsed(bytes)?.into_motion(&BodyModel::embedded(), None, options)
}

#[test]
fn faults_of_an_archive_are_named() {
    let changed = |key: &'static str, shape: &[usize], value: f64| {
        let mut arrays = amass(4);
        arrays.insert(key, (shape.to_vec(), vec![value; shape.iter().product()]));
        motion(npz(&arrays), &MotionOptions::default())
    };
    one_line(
        changed("poses", &[4, 100], 0.0),
        &[
            "key poses",
            "[4, 100]",
            "(N, 72) of SMPL, (N, 156) of SMPL-H or (N, 165) of SMPL-X",
        ],
    );
    one_line(changed("poses", &[624], 0.0), &["key poses", "[624]"]);
    one_line(
        changed("poses", &[4, 156], f64::NAN),
        &["key poses", "element 0 (C order) is NaN"],
    );
    one_line(
        changed("poses", &[4, 156], 1e9),
        &["key poses", "element 0 (C order) is 1e9"],
    );
    one_line(
        changed("poses", &[0, 156], 0.0),
        &["key poses: it has no frames, expected one or more"],
    );
    one_line(
        changed("trans", &[5, 3], 0.0),
        &["key trans", "[5, 3]", "(4, 3)"],
    );
    one_line(
        changed("trans", &[4, 3], f64::INFINITY),
        &["key trans", "inf"],
    );
    one_line(
        changed("betas", &[3, 16], 0.0),
        &["key betas", "[3, 16]", "(B), (1, B) or (4, B)"],
    );
    one_line(changed("betas", &[401], 0.0), &["key betas", "[401]"]);
    for rate in [-30.0, 0.0, 1e6] {
        one_line(
            changed("mocap_framerate", &[], rate),
            &[
                "key mocap_framerate: the rate is",
                "0.1 to 10000 Hz; set rate_hz",
            ],
        );
    }
    let without = |key: &str, options: &MotionOptions| {
        let mut arrays = amass(4);
        arrays.remove(key).unwrap();
        motion(npz(&arrays), options)
    };
    one_line(
        without("mocap_framerate", &MotionOptions::default()),
        &["key mocap_framerate: missing", "set rate_hz"],
    );
    assert_eq!(
        without(
            "mocap_framerate",
            &MotionOptions {
                rate_hz: Some(25.0),
                ..Default::default()
            }
        )
        .unwrap()
        .rate_hz,
        25.0
    );
    one_line(
        without("trans", &MotionOptions::default()),
        &["no known motion in it (found the keys betas, mocap_framerate, poses)"],
    );
    assert!(
        without("betas", &MotionOptions::default())
            .unwrap()
            .betas
            .iter()
            .all(|&beta| beta == 0.0)
    );
    let rate = |rate_hz: f64| {
        motion(
            npz(&amass(4)),
            &MotionOptions {
                rate_hz: Some(rate_hz),
                ..Default::default()
            },
        )
    };
    one_line(
        rate(f64::NAN),
        &["rate_hz is NaN, expected 0.1 to 10000 Hz"],
    );
    let nobody = MotionOptions {
        person: Some("1".to_owned()),
        ..Default::default()
    };
    one_line(
        motion(npz(&amass(4)), &nobody),
        &["person 1 is not in it; there are 0 (4 frames)"],
    );
}

#[test]
fn one_frame_is_read() {
    let single = motion(npz(&amass(1)), &MotionOptions::default()).unwrap();
    assert_eq!((single.frames.len(), single.duration_s()), (1, 0.0));
    let single = motion(
        Py::Dict(vec![(Py::Int(1), Py::named(&vibe(1)))]).pickle(),
        &MotionOptions::default(),
    )
    .unwrap();
    assert_eq!(
        (single.frames.len(), single.confidence),
        (1, Some(vec![1.0]))
    );
}

#[test]
fn faults_of_a_dictionary_are_named() {
    let person = |key: &'static str, value: Py| {
        let mut pairs = vibe(3);
        pairs.retain(|(known, _)| *known != key);
        pairs.push((key, value));
        motion(
            Py::Dict(vec![(Py::Int(12), Py::named(&pairs))]).pickle(),
            &MotionOptions::default(),
        )
    };
    one_line(
        person("pose", Py::rows(&[0.0; 69], 69)),
        &["key 12.pose", "[1, 69]", "(N, 72)"],
    );
    one_line(person("pose", Py::Text("none")), &["key 12.pose", "text"]);
    one_line(
        person("pose", Py::List(vec![])),
        &["key 12.pose: it has no frames"],
    );
    one_line(
        person("frame_ids", Py::List([5, 5, 6].map(Py::Int).to_vec())),
        &["key 12.frame_ids: element 1 does not exceed the one before"],
    );
    one_line(
        person("frame_ids", Py::List([5, 6].map(Py::Int).to_vec())),
        &["key 12.frame_ids", "[2]", "(3)"],
    );
    one_line(
        person("betas", Py::rows(&[0.0; 20], 10)),
        &["key 12.betas", "[2, 10]"],
    );
    let apart = person(
        "frame_ids",
        Py::List([i64::MIN + 1, 4, 5].map(Py::Int).to_vec()),
    )
    .unwrap();
    assert_eq!(
        (apart.frames.len(), apart.poses.unwrap().left_out_frames),
        (2, 1)
    );
    one_line(
        motion(Py::Dict(vec![]).pickle(), &MotionOptions::default()),
        &["no known motion", "an empty dictionary"],
    );
    one_line(
        motion(Py::Int(3).pickle(), &MotionOptions::default()),
        &["no known motion", "found an int"],
    );
    let wham = [
        vibe(3),
        vec![
            ("pose_world", Py::rows(&[0.1; 72], 72)),
            ("trans_world", Py::rows(&[0.1; 6], 3)),
        ],
    ]
    .concat();
    one_line(
        parsed(Py::Dict(vec![(Py::Int(0), Py::named(&wham))]).pickle()),
        &["key 0.betas", "(1, B)"],
    );
    let frame = |ids: &[i64]| {
        let body = Py::named(&[(
            "global_orient",
            Py::rows(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], 3),
        )]);
        Py::named(&[
            ("tid", Py::List(ids.iter().map(|&id| Py::Int(id)).collect())),
            ("smpl", Py::List(vec![body])),
        ])
    };
    one_line(
        parsed(Py::named(&[("a.jpg", frame(&[1, 2]))]).pickle()),
        &["key a.jpg.smpl: 1 bodies for the 2 people of tid"],
    );
    one_line(
        parsed(Py::named(&[("a.jpg", frame(&[1]))]).pickle()),
        &["a.jpg.smpl[0].body_pose is missing"],
    );
    one_line(
        parsed(
            Py::named(&[(
                "a.jpg",
                Py::named(&[("tid", Py::List(vec![])), ("smpl", Py::List(vec![]))]),
            )])
            .pickle(),
        ),
        &["nobody is seen"],
    );
}

#[test]
fn faults_of_other_tools_files_are_named() {
    let slahmr = |change: &dyn Fn(&mut Arrays)| {
        let mut arrays = Arrays::from([
            ("root_orient", (vec![2, 3, 3], vec![0.1; 18])),
            ("pose_body", (vec![2, 3, 63], vec![0.1; 378])),
            ("trans", (vec![2, 3, 3], vec![0.1; 18])),
            ("cam_R", (vec![2], vec![0.0; 2])),
        ]);
        change(&mut arrays);
        parsed(npz(&arrays))
    };
    assert_eq!(
        slahmr(&|_| ()).unwrap().people(),
        [("0".to_owned(), 3), ("1".to_owned(), 3)]
    );
    one_line(
        slahmr(&|arrays| drop(arrays.insert("root_orient", (vec![18], vec![0.0; 18])))),
        &["key root_orient: shape is [18]"],
    );
    one_line(
        slahmr(&|arrays| drop(arrays.insert("trans", (vec![3, 3], vec![0.0; 9])))),
        &["key trans", "(2, 3, 3)"],
    );
    one_line(
        slahmr(&|arrays| drop(arrays.insert("floor_plane", (vec![3], vec![0.0; 3])))),
        &["key floor_plane: it has no direction"],
    );
    one_line(
        slahmr(&|arrays| drop(arrays.insert("track_mask", (vec![2, 3], vec![0.0; 6])))),
        &["key track_mask: nobody is seen"],
    );
    // Who turns over tells no upward axis.
    let upright = || {
        slahmr(&|arrays| {
            drop(arrays.insert("root_orient", (vec![2, 3, 3], [0.0, 0.0, 0.0].repeat(6))))
        })
    };
    assert_eq!(
        upright()
            .unwrap()
            .into_motion(&BodyModel::embedded(), None, &MotionOptions::default())
            .unwrap()
            .poses
            .unwrap()
            .up_axis,
        "+y"
    );
    let spinning = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 3.0, 0.0, 0.0].repeat(2);
    let spinning =
        slahmr(&|arrays| drop(arrays.insert("root_orient", (vec![2, 3, 3], spinning.clone()))))
            .unwrap();
    one_line(
        spinning
            .clone()
            .into_motion(&BodyModel::embedded(), None, &MotionOptions::default()),
        &["up axis unclear", "set up_axis"],
    );
    let told = MotionOptions {
        up_axis: UpAxis::Z,
        ..Default::default()
    };
    assert_eq!(
        spinning
            .into_motion(&BodyModel::embedded(), None, &told)
            .unwrap()
            .poses
            .unwrap()
            .up_axis,
        "+z"
    );
    let tram = Py::named(&[(
        "pred_rotmat",
        Py::List(vec![Py::List(vec![Py::rows(&[2.0; 9], 3); 24])]),
    )]);
    one_line(
        parsed(tram.pickle()),
        &["key pred_rotmat: matrix 0 is no rotation"],
    );
    let missing = Py::named(&[(
        "smpl_params_global",
        Py::named(&[("global_orient", Py::rows(&[0.0; 3], 3))]),
    )]);
    one_line(
        parsed(missing.pickle()),
        &["smpl_params_global.body_pose is missing"],
    );
}

/// A tensor may show the same bytes for many people: what it would fill is known before it is
/// filled.
#[test]
fn people_who_share_an_array_are_counted() {
    let mut pickle = vec![0x80, 2];
    pickle.extend(b"}(");
    for id in 0..200_000_u32 {
        pickle.push(b'J');
        pickle.extend(id.to_le_bytes());
        if id == 0 {
            pickle.extend(&Py::named(&vibe(20)).pickle()[2..]);
            pickle.pop();
            pickle.extend(b"q\x01");
        } else {
            pickle.extend(b"h\x01");
        }
    }
    pickle.extend(b"u.");
    one_line(
        parsed(pickle),
        &["pose: more than 1048576 frames of all people; cut the file into parts"],
    );
}

#[test]
fn files_are_told_by_their_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.bvh");
    std::fs::write(&path, npz(&amass(3))).unwrap();
    assert_eq!(
        read_motion(&path, &MotionOptions::default())
            .unwrap()
            .frames
            .len(),
        3
    );
    std::fs::write(&path, &npz(&amass(3))[..300]).unwrap();
    assert!(
        read_motion(&path, &MotionOptions::default())
            .unwrap_err()
            .to_string()
            .contains("motion.bvh: ")
    );
    assert!(
        open_poses(&own_file("a_ok.bvh"), PoseView::World)
            .unwrap()
            .is_none()
    );
}
