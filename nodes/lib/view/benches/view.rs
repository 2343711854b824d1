//! What the viewer costs the process that logs: reducing the mesh once, a frame of the body, an IMU
//! sample.

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_spatial::Stamp;
use cromosim_view::{Destination, DisplayMesh, Recording, RecordingOptions};
use nalgebra::{Isometry3, Vector3};

#[allow(clippy::unwrap_used, reason = "a benchmark may panic")]
fn view(criterion: &mut Criterion) {
    let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
    let rest: Vec<[f32; 3]> = body
        .rest_vertices()
        .iter()
        .map(|point| point.cast::<f32>().into())
        .collect();
    let faces = body.model().faces();
    let mut vertices = Vec::new();
    body.skin(&BodyPose::rest(Vector3::new(0.0, 0.0, 1.0)), &mut vertices);

    let mut group = criterion.benchmark_group("view");
    group.sample_size(20);
    group.bench_function("reduce the body to 3000 vertices", |bencher| {
        bencher.iter(|| DisplayMesh::new(&rest, faces, 3000).unwrap())
    });

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench.rrd");
    let mut recording =
        Recording::open(&[Destination::File { path }], RecordingOptions::default()).unwrap();
    recording.set_body(&rest, faces).unwrap();
    let mut nanos = 0;
    group.bench_function("log a body frame", |bencher| {
        bencher.iter(|| {
            nanos += 40_000_000;
            recording
                .log_body(Stamp::from_nanos(nanos), &vertices)
                .unwrap()
        });
    });
    group.bench_function("log a sensor frame", |bencher| {
        bencher.iter(|| {
            nanos += 40_000_000;
            recording
                .log_sensor(
                    Stamp::from_nanos(nanos),
                    "left_wrist",
                    &Isometry3::identity(),
                )
                .unwrap()
        });
    });
    group.bench_function("log an IMU sample", |bencher| {
        bencher.iter(|| {
            nanos += 10_000_000;
            recording
                .log_imu(
                    Stamp::from_nanos(nanos),
                    "left_wrist",
                    &Vector3::z(),
                    &Vector3::z(),
                )
                .unwrap();
        });
    });
    group.finish();
    recording.finish().unwrap();
}

criterion_group!(benches, view);
criterion_main!(benches);
