//! Skinning on one core: `cargo bench -p cromosim_body`.
//!
//! What a frame of the embedded body (V = 6954) costs: of the 4.3 million entries of posedirs 8.4 %
//! are not zero; in tiles of eight vertices they are 49 818 rows, 0.40 million multiply-adds;
//! blending the joints' matrices takes 0.29, applying them 0.06. Together 1.5 MFLOP, 1.84 MB of
//! tables read (17.3 MB were posedirs dense) and 83 KB written.
//!
//! Fastest passes of the kernel on one core of an AMD EPYC (Zen 5, a virtual machine with other
//! work on it): one pose at a time 42 microseconds a frame with AVX2 and 59 with SSE2, eight at
//! once 28 and 51. One at a time reads 44 GB/s from the caches beyond the first; a batch, in which
//! four poses share each load, does 54 GFLOP/s.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use nalgebra::Vector3;

const FRAMES: usize = 64;

/// Every joint turns, so that nothing is skipped.
fn motion() -> Vec<BodyPose> {
    let turn = |frame: usize, joint: usize| {
        let phase = 0.1 * frame as f64 + joint as f64;
        Vector3::new(
            0.6 * phase.sin(),
            0.4 * (1.3 * phase).cos(),
            0.3 * (0.7 * phase).sin(),
        )
    };
    let frame = |frame| {
        BodyPose::from_axis_angles(
            Vector3::new(0.0, 0.0, 1.0),
            &std::array::from_fn(|joint| turn(frame, joint)),
        )
    };
    (0..FRAMES).map(frame).collect()
}

fn skinning(criterion: &mut Criterion) {
    let body = ShapedBody::new(BodyModel::embedded(), &[1.0, -0.5]).expect("two betas suit");
    let motion = motion();
    let mut group = criterion.benchmark_group("skinning");
    group.throughput(Throughput::Elements(FRAMES as u64));
    let mut vertices = Vec::new();
    group.bench_function("full mesh, one pose at a time", |bencher| {
        bencher.iter(|| {
            motion
                .iter()
                .for_each(|pose| body.skin(black_box(pose), &mut vertices))
        });
    });
    group.bench_function("full mesh, 64 poses at once", |bencher| {
        bencher.iter(|| body.skin_batch(black_box(&motion), &mut vertices));
    });
    let five_triangles: Vec<u32> = [
        "left_watch",
        "right_ankle_lateral",
        "sacrum",
        "sternum",
        "forehead",
    ]
    .iter()
    .flat_map(|name| {
        body.model()
            .triangle(&body.model().site(name).expect("a known site"))
            .expect("a triangle of this body")
    })
    .collect();
    let (subset, mut positions) = (
        body.subset(&five_triangles).expect("known vertices"),
        Vec::new(),
    );
    group.bench_function("15 vertices in f64", |bencher| {
        bencher.iter(|| {
            motion
                .iter()
                .for_each(|pose| subset.positions_into(black_box(pose), &mut positions))
        });
    });
    group.bench_function("skeleton", |bencher| {
        bencher.iter(|| {
            motion
                .iter()
                .map(|pose| body.world_from_segments(black_box(pose))[23].translation.x)
                .sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, skinning);
criterion_main!(benches);
