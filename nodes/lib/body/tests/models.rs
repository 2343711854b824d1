//! Files of SMPL, SMPL-H and SMPL-X against SMPL's equations for all their joints.
#![allow(clippy::unwrap_used, missing_docs)]

use std::path::{Path, PathBuf};

use cromosim_arrays::Container;
use cromosim_body::{BodyModel, BodyPose, Gender, Joint, ShapeSpace, ShapedBody};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

/// The arrays of a file, and SMPL's forward function in its own words: all joints, dense, float64.
struct Reference {
    vertices: usize,
    joints: usize,
    template: Vec<f64>,
    shapedirs: Vec<f64>,
    shape_columns: usize,
    posedirs: Vec<f64>,
    regressor: Vec<f64>,
    weights: Vec<f64>,
    parents: Vec<i64>,
}

impl Reference {
    fn read(name: &str) -> Self {
        let mut file = Container::open(&data(name)).unwrap();
        let mut floats = |key: &str, rank: usize| {
            file.at(key)
                .unwrap()
                .floats(&vec![None; rank], "any")
                .unwrap()
        };
        let (template, shapedirs, posedirs) = (
            floats("v_template", 2),
            floats("shapedirs", 3),
            floats("posedirs", 3),
        );
        let (regressor, weights) = (floats("J_regressor", 2), floats("weights", 2));
        let kintree = file
            .at("kintree_table")
            .unwrap()
            .integers(&[Some(2), None], "(2, J)")
            .unwrap();
        Self {
            vertices: template.shape[0],
            joints: regressor.shape[0],
            template: template.values,
            shape_columns: shapedirs.shape[2],
            shapedirs: shapedirs.values,
            posedirs: posedirs.values,
            regressor: regressor.values,
            weights: weights.values,
            parents: kintree.values,
        }
    }

    /// Vertices and joints in the world for the root at `root`.
    fn posed(
        &self,
        betas: &[f64],
        rotations: &[Matrix3<f64>],
        root: Vector3<f64>,
    ) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let shaped = |vertex: usize, axis: usize| {
            let row = &self.shapedirs[(3 * vertex + axis) * self.shape_columns..];
            self.template[3 * vertex + axis]
                + betas.iter().zip(row).map(|(beta, s)| beta * s).sum::<f64>()
        };
        let rest: Vec<Vector3<f64>> = (0..self.vertices)
            .map(|vertex| Vector3::from_fn(|axis, _| shaped(vertex, axis)))
            .collect();
        let joint = |j: usize| {
            (0..self.vertices)
                .map(|v| rest[v] * self.regressor[j * self.vertices + v])
                .sum::<Vector3<f64>>()
        };
        let rest_joints: Vec<Vector3<f64>> = (0..self.joints).map(joint).collect();
        let features: Vec<f64> = rotations[1..]
            .iter()
            .flat_map(|r| (0..9).map(|i| r[(i / 3, i % 3)] - f64::from(i % 4 == 0)))
            .collect();
        let corrected = |vertex: usize| {
            let row = |axis: usize| {
                &self.posedirs[(3 * vertex + axis) * features.len()..][..features.len()]
            };
            rest[vertex]
                + Vector3::from_fn(|axis, _| {
                    row(axis).iter().zip(&features).map(|(p, f)| p * f).sum()
                })
        };
        let mut globals: Vec<(Matrix3<f64>, Vector3<f64>)> = vec![(rotations[0], root)];
        for j in 1..self.joints {
            let parent = usize::try_from(self.parents[j]).unwrap();
            let (rotation, position) = globals[parent];
            globals.push((
                rotation * rotations[j],
                position + rotation * (rest_joints[j] - rest_joints[parent]),
            ));
        }
        let skinned = |vertex: usize| {
            let point = corrected(vertex);
            let moved = |j: usize| {
                (globals[j].0 * (point - rest_joints[j]) + globals[j].1)
                    * self.weights[vertex * self.joints + j]
            };
            (0..self.joints).map(moved).sum()
        };
        (
            (0..self.vertices).map(skinned).collect(),
            globals.into_iter().map(|(_, position)| position).collect(),
        )
    }
}

fn some_rotations(count: usize) -> Vec<UnitQuaternion<f64>> {
    (0..count)
        .map(|i| {
            UnitQuaternion::from_euler_angles(
                (i as f64).sin(),
                (2.3 * i as f64).cos() * 0.8,
                (1.7 * i as f64).sin() * 0.6,
            )
        })
        .collect()
}

/// The body's vertices and joints, and the largest distance from the reference's, m.
fn difference(name: &str, beta_count: usize) -> f64 {
    let body = BodyModel::read(&data(name)).unwrap();
    let reference = Reference::read(name);
    assert_eq!(
        (body.vertex_count(), body.beta_count()),
        (reference.vertices, beta_count),
        "{name}"
    );
    let betas: Vec<f64> = (0..beta_count.min(12))
        .map(|i| (i as f64 + 0.5).sin())
        .collect();
    let moving = if reference.joints == 24 { 24 } else { 22 };
    let mut local_rotations = [UnitQuaternion::identity(); 24];
    local_rotations[..moving].copy_from_slice(&some_rotations(moving));
    let root_position = Vector3::new(0.3, -0.2, 1.1);
    let pose = BodyPose {
        root_position,
        local_rotations,
    };
    let mut rotations = vec![Matrix3::identity(); reference.joints];
    rotations
        .iter_mut()
        .zip(&local_rotations[..moving])
        .for_each(|(to, from)| *to = *from.to_rotation_matrix().matrix());
    let (vertices, joints) = reference.posed(&betas, &rotations, root_position);
    let shaped = ShapedBody::new(body, &betas).unwrap();
    let ids: Vec<u32> = (0..reference.vertices as u32).collect();
    let found = shaped.subset(&ids).unwrap().positions(&pose);
    let segments = shaped.world_from_segments(&pose);
    let of_joints = (0..22).map(|j| (segments[j].translation.vector - joints[j]).norm());
    found
        .iter()
        .zip(&vertices)
        .map(|(a, b)| (a - b).norm())
        .chain(of_joints)
        .fold(0.0, f64::max)
}

#[test]
fn bodies_of_24_joints_are_those_of_52_and_55_while_fingers_rest() {
    for (name, betas) in [
        ("model_smpl_m_lbs.pkl", 10),
        ("model_smplh_female.npz", 16),
        ("model_smplh_female.pkl", 16),
        ("model_smplx.npz", 300),
    ] {
        let difference = difference(name, betas);
        println!("{name}: {difference:.1e} m");
        // Pose corrections are kept as float32, as these files have them: nothing is rounded.
        assert!(difference < 1e-12, "{name}: {difference} m");
    }
}

#[test]
fn kinds_and_genders_are_told() {
    let told = |name: &str| {
        let body = BodyModel::read(&data(name)).unwrap();
        (body.shape_space(), body.gender(), body.site_names().count())
    };
    assert_eq!(
        told("model_smpl_m_lbs.pkl"),
        (ShapeSpace::Smpl, Some(Gender::Male), 68)
    );
    assert_eq!(
        told("model_smplh_female.npz"),
        (ShapeSpace::Smpl, Some(Gender::Female), 68)
    );
    assert_eq!(
        told("model_smplx.npz"),
        (ShapeSpace::SmplX, Some(Gender::Neutral), 68)
    );
    let folder = tempfile::tempdir().unwrap();
    let nested = folder.path().join("male/model.npz");
    std::fs::create_dir(folder.path().join("male")).unwrap();
    std::fs::copy(
        data("model_smplx.npz"),
        folder.path().join("male/model.any"),
    )
    .unwrap();
    std::fs::rename(folder.path().join("male/model.any"), &nested).unwrap();
    assert_eq!(BodyModel::read(&nested).unwrap().id(), "male/model");
}

/// A turned hand takes the fingers along and nothing else.
#[test]
fn the_hand_turns_the_fingers() {
    let name = "model_smplh_female.npz";
    let shaped = ShapedBody::new(BodyModel::read(&data(name)).unwrap(), &[]).unwrap();
    let reference = Reference::read(name);
    let mut pose = BodyPose::rest(Vector3::zeros());
    let ids: Vec<u32> = (0..reference.vertices as u32).collect();
    let subset = shaped.subset(&ids).unwrap();
    let before = subset.positions(&pose);
    let turn = UnitQuaternion::from_euler_angles(0.4, 0.2, -0.3);
    pose.local_rotations[Joint::LeftHand.index()] = turn;
    let after = subset.positions(&pose);
    let hand = shaped.joints_in_model()[Joint::LeftHand.index()] - shaped.joints_in_model()[0];
    for vertex in 0..reference.vertices {
        let share: f64 = reference.weights[vertex * 52 + 22..vertex * 52 + 37]
            .iter()
            .sum();
        let expected =
            before[vertex] + (hand + turn * (before[vertex] - hand) - before[vertex]) * share;
        assert!(
            share > 0.0 && (after[vertex] - expected).norm() < 1e-9,
            "vertex {vertex}"
        );
    }
}

#[test]
fn betas_of_another_body_are_refused() {
    let (embedded, smpl) = (
        BodyModel::embedded(),
        BodyModel::read(&data("model_smpl_m_lbs.pkl")).unwrap(),
    );
    let message = embedded
        .check_betas(ShapeSpace::Smpl, Some(Gender::Neutral), &[0.4, 0.0])
        .unwrap_err()
        .to_string();
    assert!(
        [
            "belong to SMPL",
            "the embedded body",
            "--body",
            "bone lengths"
        ]
        .iter()
        .all(|part| message.contains(part)),
        "{message}"
    );
    assert!(
        smpl.check_betas(ShapeSpace::Cromosim, None, &[1.0])
            .is_err()
            && smpl.check_betas(ShapeSpace::SmplX, None, &[1.0]).is_err()
    );
    let gender = smpl
        .check_betas(ShapeSpace::Smpl, Some(Gender::Female), &[1.0])
        .unwrap_err()
        .to_string();
    assert!(
        gender.contains("SMPL female") && gender.contains("SMPL male"),
        "{gender}"
    );
    assert!(
        smpl.check_betas(ShapeSpace::Smpl, Some(Gender::Male), &[1.0])
            .is_ok()
            && smpl.check_betas(ShapeSpace::Smpl, None, &[1.0]).is_ok()
    );
    assert!(
        embedded
            .check_betas(ShapeSpace::Smpl, None, &[0.0; 10])
            .is_ok()
            && embedded.check_betas(ShapeSpace::SmplX, None, &[]).is_ok()
    );
    assert!(
        embedded
            .check_betas(ShapeSpace::Cromosim, Some(Gender::Female), &[1.0])
            .is_ok(),
        "the embedded body has one file for all"
    );
    let folder = tempfile::tempdir().unwrap();
    let export = folder.path().join("export.npz");
    embedded.write_npz(&export).unwrap();
    assert_eq!(
        BodyModel::read(&export).unwrap().shape_space(),
        ShapeSpace::Cromosim
    );
}

#[test]
fn bone_lengths_of_a_person_give_the_persons_shape() {
    let embedded = BodyModel::embedded();
    let person = ShapedBody::new(embedded.clone(), &[1.2, 0.0, -0.8, 0.6]).unwrap();
    let fit = embedded.fit_bone_lengths(
        |joint| Some(100.0 * person.joints_in_model()[joint.index()]),
        0.01,
    );
    let fitted = ShapedBody::new(embedded, &fit.betas).unwrap();
    let length = |body: &ShapedBody, joint: Joint| {
        let joints = body.joints_in_model();
        (joints[joint.index()] - joints[joint.parent().unwrap().index()]).norm()
    };
    let limbs = [
        Joint::LeftKnee,
        Joint::LeftAnkle,
        Joint::RightElbow,
        Joint::RightWrist,
    ];
    let worst = limbs
        .map(|joint| (length(&fitted, joint) - length(&person, joint)).abs())
        .into_iter()
        .fold(0.0, f64::max);
    println!(
        "lengths within {:.2} mm, RMS {:.2} mm",
        1e3 * worst,
        1e3 * fit.length_rms_m
    );
    assert!(
        worst < 0.003 && fit.length_rms_m < 0.003,
        "{worst} m, {} m",
        fit.length_rms_m
    );
}

#[test]
fn betas_are_told_by_the_words_of_a_message() {
    let embedded = BodyModel::embedded();
    assert!(
        embedded
            .check_named_betas("cromosim", "female", &[1.0])
            .is_ok()
    );
    assert!(
        embedded
            .check_named_betas("smpl", "", &[1.0])
            .unwrap_err()
            .to_string()
            .contains("belong to SMPL")
    );
    for unknown in ["", "SMPL", "star"] {
        let message = embedded
            .check_named_betas(unknown, "neutral", &[1.0])
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(&format!("'{unknown}'")) && message.contains("smplx"),
            "{message}"
        );
        assert!(
            embedded
                .check_named_betas(unknown, "neutral", &[0.0])
                .is_ok(),
            "the mean of any body is said by zeros"
        );
    }
}
