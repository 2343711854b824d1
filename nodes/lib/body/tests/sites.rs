//! Sites: where the embedded body's names lie, and how points become sites.
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;

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
        let difference = (body.site_in_model(&site).unwrap() - Vector3::from(record.point_model)).norm();
        assert!(difference < 2e-5, "{name}: {difference} m");
        let alignment = body.site_normal_in_model(&site).unwrap().dot(&Vector3::from(record.normal));
        assert!(alignment > 0.8, "{name}: the normal must look outward ({alignment})");
        assert_eq!(site.joint.name(), record.joint, "{name}");
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_nearest() {
    let error = BodyModel::embedded().site("left_whatch").unwrap_err().to_string();
    assert!(error.contains("left_whatch") && error.contains("left_watch"), "{error}");
}

#[test]
fn the_nearest_site_is_the_foot_of_the_normal() {
    let body = ShapedBody::new(BodyModel::embedded(), &[0.5, 1.0]).unwrap();
    for name in ["left_watch", "sacrum", "forehead", "right_ankle_lateral", "sternum"] {
        let named = body.model().site(name).unwrap();
        let surface = body.site_in_model(&named).unwrap();
        let above = surface + body.site_normal_in_model(&named).unwrap() * 0.004;
        let found = body.nearest_site(above).unwrap();
        let distance = (body.site_in_model(&found).unwrap() - above).norm();
        assert!(distance <= 0.004 + 1e-12, "{name}");
        // No vertex may be nearer than the nearest surface.
        let nearest_vertex = body.rest_vertices().iter().map(|vertex| (vertex - above).norm()).fold(f64::INFINITY, f64::min);
        assert!(distance <= nearest_vertex, "{name}");
        assert!((body.site_in_model(&found).unwrap() - surface).norm() < 0.002, "{name}");
    }
}

#[test]
fn a_point_far_to_the_left_is_the_left_hand() {
    let model = BodyModel::embedded();
    let site = model.nearest_site(Vector3::new(5.0, 0.2, 0.0)).unwrap();
    assert_eq!(site.joint, Joint::LeftHand);
    assert_eq!(model.nearest_site(Vector3::new(0.0, 5.0, 0.0)).unwrap().joint, Joint::Head);
    assert!(model.nearest_site(Vector3::new(f64::NAN, 0.0, 0.0)).unwrap_err().to_string().contains("not finite"));
}

#[test]
fn nearest_points_over_vertices_edges_and_faces() {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    for triangle in (0..13904).step_by(997) {
        for barycentrics in [[1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.2, 0.3, 0.5]] {
            let point = body.site_in_model(&body.model().site_at(triangle, barycentrics).unwrap()).unwrap();
            let found = body.site_in_model(&body.nearest_site(point).unwrap()).unwrap();
            assert!((found - point).norm() < 1e-12);
        }
    }
}

#[test]
fn triangles_and_barycentrics_are_checked() {
    let model = BodyModel::embedded();
    assert!(model.site_at(13904, [1.0, 0.0, 0.0]).unwrap_err().to_string().contains("triangle 13904"));
    for wrong in [[0.5, 0.5, 0.5], [-0.5, 1.0, 0.5], [f64::NAN, 0.5, 0.5], [0.0, 0.0, 0.0]] {
        assert!(model.site_at(0, wrong).unwrap_err().to_string().contains("barycentrics"), "{wrong:?}");
    }
    let site = model.site_at(7, [0.2, 0.3, 0.4999]).unwrap();
    assert!((site.barycentrics.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    assert_eq!(model.triangle(&site).unwrap(), model.faces()[7]);
}

/// Another body: the embedded one with other proportions and its triangles in another order.
#[test]
fn named_sites_are_carried_over_to_other_bodies() {
    let folder = tempfile::tempdir().unwrap();
    let (export, other) = (folder.path().join("body.npz"), folder.path().join("other.npz"));
    let embedded = BodyModel::embedded();
    embedded.write_npz(&export).unwrap();
    let shaped = ShapedBody::new(embedded.clone(), &[1.0, 1.0, 0.5]).unwrap();

    let mut source = NpzReader::open(&export).unwrap();
    let mut target = NpzWriter::new(std::fs::File::create(&other).unwrap());
    for (key, dimensions) in [("shapedirs", 3), ("posedirs", 3), ("J_regressor", 2), ("weights", 2)] {
        let array = source.floats(key, &vec![None; dimensions], "").unwrap().unwrap();
        target.floats(key, &array.shape, &array.values).unwrap();
    }
    let template: Vec<f64> = shaped.rest_vertices().iter().flat_map(|vertex| [vertex.x, vertex.y, vertex.z]).collect();
    target.floats("v_template", &[embedded.vertex_count(), 3], &template).unwrap();
    let kintree: Vec<u32> = Joint::ALL.iter().map(|joint| joint.parent().map_or(u32::MAX, |parent| parent.index() as u32)).collect();
    target.integers("kintree_table", &[2, 24], &[kintree, (0..24).collect()].concat()).unwrap();
    let faces: Vec<u32> = embedded.faces().iter().rev().flatten().copied().collect();
    target.integers("f", &[embedded.faces().len(), 3], &faces).unwrap();
    target.finish().unwrap();

    let other = BodyModel::read(&other).unwrap();
    assert_eq!(other.site_names().count(), 68);
    let other = ShapedBody::new(other, &[]).unwrap();
    let distances = embedded.site_names().map(|name| {
        let found = other.site_in_model(&other.model().site(name).unwrap()).unwrap();
        ((found - shaped.site_in_model(&embedded.site(name).unwrap()).unwrap()).norm(), name)
    });
    let (farthest, name) = distances.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    println!("carried over: {name} is {:.1} mm off", farthest * 1e3);
    assert!(farthest < 0.03, "{name}: {farthest} m");
}
