//! ASF and AMC: a known motion there and back, and what is wrong with wrong files.
#![allow(clippy::unwrap_used)]

mod common;

use common::acclaim::{Acclaim, cmu_bones};
use common::known::{about, joint_shift, known_motion, rest, y_up};
use common::quantile;
use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
use cromosim_motion::{AMC_RATE_HZ, MotionOptions, parse_amc, parse_asf, retarget};
use nalgebra::Vector3;

const UNIT_M: f64 = 0.0254 / 0.45;

fn body() -> ShapedBody {
    ShapedBody::new(BodyModel::embedded(), &[0.9, -0.4, 0.6, 0.5, -0.7, 0.8]).unwrap()
}

fn acclaim(body: &ShapedBody, degrees: bool) -> Acclaim<'_> {
    Acclaim {
        bones: cmu_bones(),
        body,
        joint_shift: joint_shift(),
        rest: rest(0.0, 0.0, 20.0, 0.0),
        unit_m: UNIT_M,
        degrees,
    }
}

/// The limits of the BVH round trips.
#[test]
fn a_known_motion_comes_back() {
    let (body, known) = (body(), known_motion(true));
    for degrees in [true, false] {
        let acclaim = acclaim(&body, degrees);
        let skeleton = parse_asf(&acclaim.asf(), "test.asf").unwrap();
        assert_eq!(
            (skeleton.bones.len(), skeleton.length_unit, skeleton.degrees),
            (30, 0.45, degrees)
        );
        let clip = parse_amc(
            &acclaim.amc(&known.frames, y_up()),
            "test.amc",
            &skeleton,
            100.0,
        )
        .unwrap();
        let read = retarget(&clip, body.model(), &MotionOptions::default()).unwrap();
        let report = read.report.clone().unwrap();
        assert_eq!(
            (
                report.map.as_str(),
                report.up_axis.as_str(),
                report.rest.as_str()
            ),
            ("cmu_asf", "+y", "zero pose")
        );
        assert!((report.unit_scale_m / UNIT_M - 1.0).abs() < 1e-9);
        assert_eq!(read.frames.len(), known.frames.len());
        let mut angles = Vec::new();
        let mut root: f64 = 0.0;
        for (a, b) in read.frames.iter().zip(&known.frames) {
            angles.extend(Joint::ALL.map(|joint| {
                a.local_rotations[joint.index()]
                    .angle_to(&b.local_rotations[joint.index()])
                    .to_degrees()
            }));
            let moved =
                |pose: &BodyPose, first: &BodyPose| pose.root_position - first.root_position;
            root = root.max((moved(a, &read.frames[0]) - moved(b, &known.frames[0])).norm());
        }
        let (median, high) = (quantile(&angles, 0.5), quantile(&angles, 0.95));
        println!(
            "ASF/AMC: median {median:.3} deg, 95 % {high:.3} deg, root {root:.4} m; {report}; {:.1?}",
            report.bones
        );
        assert!(median < 2.0 && high < 5.0 && root < 0.1 && report.bone_direction_median_deg < 1.0);
    }
}

/// One bone with axes turned by 90 degrees about z: its x is the file's y.
#[test]
fn bones_turn_about_their_own_axes() {
    let asf = ":units\nangle deg\n:root\norder RX RY RZ TX TY TZ\n:bonedata\nbegin\nname a\ndirection 1 0 0\nlength 2\naxis 0 0 90 XYZ\ndof rx\nend\n\
               begin\nname b\ndirection 0 1 0\nlength 3\naxis 0 0 0 XYZ\ndof ry rz\nlimits (-1 1) (2 3)\nend\n:hierarchy\nbegin\na b\nroot a\nend\n";
    // Limits of all freedoms on one line are not what the format says.
    assert!(
        parse_asf(asf, "a.asf")
            .unwrap_err()
            .to_string()
            .starts_with("a.asf, line 19: expected limits (low high)")
    );
    let skeleton = parse_asf(&asf.replace("(-1 1) (2 3)", "(-1 1)\n(2 3)"), "a.asf").unwrap();
    assert_eq!(
        skeleton.bones[1].limits,
        [[-1.0, 1.0], [2.0, 3.0]].map(|pair| pair.map(f64::to_radians))
    );
    let clip = parse_amc(
        "1\nroot 0 0 30 1 2 3\na 90\nb 20 40\n",
        "a.amc",
        &skeleton,
        AMC_RATE_HZ,
    )
    .unwrap();
    let frames = clip.world_from_joints(0);
    let root = about(Vector3::z(), 30.0);
    assert!(
        frames[0].rotation.angle_to(&root) < 1e-9
            && (frames[0].translation.vector - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12
    );
    let a = root * about(Vector3::y(), 90.0);
    assert!(frames[1].rotation.angle_to(&a) < 1e-9);
    assert!(
        (frames[2].translation.vector - (Vector3::new(1.0, 2.0, 3.0) + a * Vector3::x() * 2.0))
            .norm()
            < 1e-9,
        "b begins where a ends"
    );
    let b = a * about(Vector3::z(), 40.0) * about(Vector3::y(), 20.0);
    assert!(frames[2].rotation.angle_to(&b) < 1e-7);
    assert_eq!(clip.joints()[2].tip, Some(Vector3::new(0.0, 3.0, 0.0)));
}

#[test]
fn errors_name_file_line_expected_and_found() {
    let body = body();
    let acclaim = acclaim(&body, true);
    let (asf, amc) = (
        acclaim.asf(),
        acclaim.amc(&known_motion(true).frames[..2], y_up()),
    );
    let skeleton = parse_asf(&asf, "cmu.asf").unwrap();
    let of_asf = |text: &str| parse_asf(text, "cmu.asf").unwrap_err().to_string();
    let of_amc = |text: &str| {
        parse_amc(text, "cmu.amc", &skeleton, AMC_RATE_HZ)
            .unwrap_err()
            .to_string()
    };
    let lines =
        |text: &str, from: &str| text.lines().position(|line| line.contains(from)).unwrap() + 1;
    let root = amc.lines().nth(4).unwrap();
    let humerus = amc
        .lines()
        .find(|line| line.starts_with("lhumerus"))
        .unwrap();
    let cases = [
        (
            of_asf(""),
            "cmu.asf, line 1: expected :version or another section, found the end of the file"
                .to_owned(),
        ),
        (
            of_asf("HIERARCHY\n"),
            "cmu.asf, line 1: expected :version or another section, found \"HIERARCHY\"".to_owned(),
        ),
        (
            of_asf(&asf.replace("angle deg", "angle grad")),
            "cmu.asf, line 7: expected angle deg or rad".to_owned(),
        ),
        (
            of_asf(&asf.replace("length 0.45", "length 0")),
            "cmu.asf, line 6: expected a length above 0".to_owned(),
        ),
        (
            of_asf(&asf.replace("axis XYZ", "axis XXZ")),
            "cmu.asf, line 13: expected an order of axes like XYZ".to_owned(),
        ),
        (
            of_asf(&asf.replacen("dof rx ry rz", "dof rx ry l", 1)),
            "cmu.asf, line 23: expected TX TY TZ RX RY RZ, each once, found \"l\"".to_owned(),
        ),
        (
            of_asf(&asf.replacen("direction", "direction nan", 1)),
            "cmu.asf, line 20: value 1 is nan".to_owned(),
        ),
        (
            of_asf(&asf.replace("upperneck head", "upperneck tail")),
            format!(
                "cmu.asf, line {}: expected a bone of :bonedata, found \"tail\"",
                lines(&asf, "upperneck head")
            ),
        ),
        (
            of_asf(&asf.replace("    upperneck head\n", "")),
            format!(
                "cmu.asf, line {}: expected a bone that hangs on the root, found \"head\"",
                lines(&asf, "name head") - 2
            ),
        ),
        (
            of_asf(&asf.replace("upperneck head", "upperneck head head")),
            format!(
                "cmu.asf, line {}: expected a bone with one parent",
                lines(&asf, "upperneck head")
            ),
        ),
        (
            of_asf(&asf.replace("    root lowerback", "    head lowerback")),
            format!(
                "cmu.asf, line {}: expected a bone that hangs on the root",
                lines(&asf, "name lowerback") - 2
            ),
        ),
        (
            of_amc(""),
            "cmu.amc, line 1: expected a frame, found the end of the file".to_owned(),
        ),
        (
            of_amc(&amc.replace(root, "root 1 2 3 4 5")),
            "cmu.amc, line 5: expected 6 channels, found 5".to_owned(),
        ),
        (
            of_amc(&amc.replace(root, "root 1 2 3 4 5 inf")),
            "cmu.amc, line 5: value 6 is inf".to_owned(),
        ),
        (
            of_amc(&amc.replace(&format!("{root}\n"), "")),
            "cmu.amc, line 4: expected a line of root in every frame, found \"1\"".to_owned(),
        ),
        (
            of_amc(&amc.replace(&format!("{humerus}\n"), "")),
            "cmu.amc, line 4: expected a line of lhumerus in every frame".to_owned(),
        ),
        (
            of_amc(&amc.replace(humerus, "tail 1")),
            format!(
                "cmu.amc, line {}: expected a bone of cmu.asf, found \"tail\"",
                lines(&amc, humerus)
            ),
        ),
        (
            of_amc(&amc.replace("\n2\n", "\n3\n")),
            format!(
                "cmu.amc, line {}: expected frame 2, found \"3\"",
                amc.lines().position(|line| line == "2").unwrap() + 1
            ),
        ),
    ];
    for (found, expected) in cases {
        assert!(
            found.starts_with(&expected),
            "expected {expected}\n   found {found}"
        );
        assert!(!found.contains('\n'));
    }
    let rate = parse_amc(&amc, "cmu.amc", &skeleton, f64::NAN)
        .unwrap_err()
        .to_string();
    assert!(rate.starts_with("cmu.amc: rate_hz is NaN"), "{rate}");
}
