//! Sites: where the embedded body's names lie, and how points become sites.
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_arrays::{NpzReader, NpzWriter};
use cromosim_body::{BodyModel, Joint, ShapedBody};
use nalgebra::Vector3;

#[derive(serde::Deserialize)]
struct Record {
    point_model: [f64; 3],
    normal: [f64; 3],
    joint: String,
}

fn records() -> BTreeMap<String, Record> {
    serde_json::from_str(include_str!("../assets/sites.json")).unwrap()
}

#[test]
fn named_sites_lie_where_their_file_says() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let records = records();
    assert_eq!(body.model().site_names().count(), 68);
    for (name, record) in records {
        let site = body.model().site(&name).unwrap();
        let difference =
            (body.site_in_model(&site).unwrap() - Vector3::from(record.point_model)).norm();
        assert!(difference < 2e-5, "{name}: {difference} m");
        let alignment = body
            .site_normal_in_model(&site)
            .unwrap()
            .dot(&Vector3::from(record.normal));
        assert!(
            alignment > 0.8,
            "{name}: the normal must look outward ({alignment})"
        );
        assert_eq!(site.joint.name(), record.joint, "{name}");
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_nearest() {
    let error = BodyModel::embedded()
        .site("left_whatch")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("left_whatch") && error.contains("left_watch"),
        "{error}"
    );
}

#[test]
fn the_nearest_site_is_the_foot_of_the_normal() {
    let body = ShapedBody::new(BodyModel::embedded(), &[0.5, 1.0]).unwrap();
    for name in [
        "left_watch",
        "sacrum",
        "forehead",
        "right_ankle_lateral",
        "sternum",
    ] {
        let named = body.model().site(name).unwrap();
        let surface = body.site_in_model(&named).unwrap();
        let above = surface + body.site_normal_in_model(&named).unwrap() * 0.004;
        let found = body.nearest_site(above).unwrap();
        let distance = (body.site_in_model(&found).unwrap() - above).norm();
        assert!(distance <= 0.004 + 1e-12, "{name}");
        // No vertex may be nearer than the nearest surface.
        let nearest_vertex = body
            .rest_vertices()
            .iter()
            .map(|vertex| (vertex - above).norm())
            .fold(f64::INFINITY, f64::min);
        assert!(distance <= nearest_vertex, "{name}");
        assert!(
            (body.site_in_model(&found).unwrap() - surface).norm() < 0.002,
            "{name}"
        );
    }
}

#[test]
fn a_point_far_to_the_left_is_the_left_hand() {
    let model = BodyModel::embedded();
    let site = model.nearest_site(Vector3::new(5.0, 0.2, 0.0)).unwrap();
    assert_eq!(site.joint, Joint::LeftHand);
    assert_eq!(
        model
            .nearest_site(Vector3::new(0.0, 5.0, 0.0))
            .unwrap()
            .joint,
        Joint::Head
    );
    assert!(
        model
            .nearest_site(Vector3::new(f64::NAN, 0.0, 0.0))
            .unwrap_err()
            .to_string()
            .contains("not finite")
    );
}

#[test]
fn nearest_points_over_vertices_edges_and_faces() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    for triangle in (0..13904).step_by(997) {
        for barycentrics in [[1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.2, 0.3, 0.5]] {
            let point = body
                .site_in_model(&body.model().site_at(triangle, barycentrics).unwrap())
                .unwrap();
            let found = body
                .site_in_model(&body.nearest_site(point).unwrap())
                .unwrap();
            assert!((found - point).norm() < 1e-12);
        }
    }
}

#[test]
fn triangles_and_barycentrics_are_checked() {
    let model = BodyModel::embedded();
    assert!(
        model
            .site_at(13904, [1.0, 0.0, 0.0])
            .unwrap_err()
            .to_string()
            .contains("triangle 13904")
    );
    for wrong in [
        [0.5, 0.5, 0.5],
        [-0.5, 1.0, 0.5],
        [f64::NAN, 0.5, 0.5],
        [0.0, 0.0, 0.0],
    ] {
        assert!(
            model
                .site_at(0, wrong)
                .unwrap_err()
                .to_string()
                .contains("barycentrics"),
            "{wrong:?}"
        );
    }
    let site = model.site_at(7, [0.2, 0.3, 0.4999]).unwrap();
    assert!((site.barycentrics.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    assert_eq!(model.triangle(&site).unwrap(), model.faces()[7]);
}

/// The embedded body with other proportions, coarser triangles in another order, and a skeleton
/// that divides spine, neck and feet differently: what a file of another origin looks like. Also
/// returns where each site ought to be.
fn other_body(
    betas: &[f64],
    folder: &std::path::Path,
) -> (Arc<BodyModel>, Vec<(String, Vector3<f64>)>) {
    let (export, other) = (folder.join("body.npz"), folder.join("other.npz"));
    let embedded = BodyModel::embedded();
    embedded.write_npz(&export).unwrap();
    let shaped = ShapedBody::new(embedded.clone(), betas).unwrap();
    let count = embedded.vertex_count();
    let (becomes, kept) = collapsed(embedded.faces(), count);

    let mut source = NpzReader::open(&export).unwrap();
    let mut target = NpzWriter::new(std::fs::File::create(&other).unwrap());
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); kept];
    becomes
        .iter()
        .enumerate()
        .for_each(|(vertex, &to)| members[to].push(vertex));
    let template: Vec<f64> = shaped
        .rest_vertices()
        .iter()
        .flat_map(|vertex| [vertex.x, vertex.y, vertex.z])
        .collect();
    let averaged = |values: &[f64], width: usize| -> Vec<f64> {
        let mean = |members: &Vec<usize>, i: usize| {
            members.iter().map(|&v| values[v * width + i]).sum::<f64>() / members.len() as f64
        };
        members
            .iter()
            .flat_map(|members| (0..width).map(move |i| mean(members, i)))
            .collect()
    };
    target
        .floats("v_template", &[kept, 3], &averaged(&template, 3))
        .unwrap();
    for key in ["shapedirs", "posedirs", "weights"] {
        let array = source
            .floats(key, &vec![None; if key == "weights" { 2 } else { 3 }], "")
            .unwrap()
            .unwrap();
        let shape = [&[kept], &array.shape[1..]].concat();
        target
            .floats(
                key,
                &shape,
                &averaged(&array.values, array.shape[1..].iter().product()),
            )
            .unwrap();
    }
    let regressor = source
        .floats("J_regressor", &[Some(24), None], "")
        .unwrap()
        .unwrap()
        .values;
    let mut rows: Vec<Vec<f64>> = regressor
        .chunks_exact(count)
        .map(|row| {
            members
                .iter()
                .map(|m| m.iter().map(|&v| row[v]).sum())
                .collect()
        })
        .collect();
    let divided = [
        (Joint::Spine1, Joint::Spine2, 0.3),
        (Joint::Spine3, Joint::Neck, 0.3),
        (Joint::Head, Joint::Neck, 0.4),
        (Joint::LeftFoot, Joint::LeftAnkle, 0.3),
    ];
    for (joint, towards, share) in divided {
        rows[joint.index()] = rows[joint.index()]
            .iter()
            .zip(&rows[towards.index()])
            .map(|(a, b)| a * (1.0 - share) + b * share)
            .collect();
    }
    target
        .floats("J_regressor", &[24, kept], &rows.concat())
        .unwrap();
    let kintree: Vec<u32> = Joint::ALL
        .iter()
        .map(|joint| {
            joint
                .parent()
                .map_or(u32::MAX, |parent| parent.index() as u32)
        })
        .collect();
    target
        .integers(
            "kintree_table",
            &[2, 24],
            &[kintree, (0..24).collect()].concat(),
        )
        .unwrap();
    let faces = embedded
        .faces()
        .iter()
        .rev()
        .map(|corners| corners.map(|vertex| becomes[vertex as usize] as u32));
    let faces: Vec<u32> = faces
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .flatten()
        .collect();
    target.integers("f", &[faces.len() / 3, 3], &faces).unwrap();
    target.finish().unwrap();
    let wanted = |name: &str| {
        (
            name.to_owned(),
            shaped.site_in_model(&embedded.site(name).unwrap()).unwrap(),
        )
    };
    (
        BodyModel::read(&other).unwrap(),
        embedded.site_names().map(wanted).collect(),
    )
}

/// Joins the ends of edges that share no neighbour: of each vertex its new number, and how many
/// remain.
fn collapsed(faces: &[[u32; 3]], count: usize) -> (Vec<usize>, usize) {
    let mut partner: Vec<Option<usize>> = vec![None; count];
    let mut taken = vec![false; count];
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); count];
    faces.iter().for_each(|&[a, b, c]| {
        [(a, b), (b, c), (c, a)]
            .iter()
            .for_each(|&(from, to)| neighbours[from as usize].push(to as usize))
    });
    for &[a, b, _] in faces {
        let (a, b) = (a as usize, b as usize);
        if !neighbours[a]
            .iter()
            .chain(&neighbours[b])
            .any(|&vertex| taken[vertex])
        {
            partner[b] = Some(a);
            (taken[a], taken[b]) = (true, true);
        }
    }
    let kept: Vec<usize> = (0..count)
        .rev()
        .filter(|&vertex| partner[vertex].is_none())
        .collect();
    let mut becomes = vec![0; count];
    kept.iter()
        .enumerate()
        .for_each(|(new, &old)| becomes[old] = new);
    (0..count).for_each(|vertex| {
        if let Some(a) = partner[vertex] {
            becomes[vertex] = becomes[a]
        }
    });
    (becomes, kept.len())
}

#[test]
fn named_sites_are_carried_over_to_other_bodies() {
    let folder = tempfile::tempdir().unwrap();
    for betas in [
        vec![],
        vec![1.0, 1.0, 0.5],
        vec![-1.5, 0.5, 0.0, 1.0, -1.0, 1.0],
    ] {
        let (other, wanted) = other_body(&betas, folder.path());
        assert!(
            other.vertex_count() < 6500 && other.faces().len() < 13_000,
            "{} vertices",
            other.vertex_count()
        );
        assert_eq!(other.site_names().count(), 68);
        let other = ShapedBody::new(other, &[]).unwrap();
        let mut distances: Vec<(f64, &str)> = wanted
            .iter()
            .map(|(name, wanted)| {
                (
                    (other
                        .site_in_model(&other.model().site(name).unwrap())
                        .unwrap()
                        - wanted)
                        .norm(),
                    name.as_str(),
                )
            })
            .collect();
        distances.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [.., third, second, farthest] = distances[..] else {
            panic!("68 sites")
        };
        let median = distances[distances.len() / 2].0;
        println!(
            "betas {betas:?}: median {:.1} mm, farthest {farthest:?}, {second:?}, {third:?}",
            median * 1e3
        );
        assert!(farthest.0 < 0.02, "{farthest:?}");
    }
}
