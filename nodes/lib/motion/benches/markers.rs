//! Fitting a body to 39 markers at 120 Hz: `cargo bench -p cromosim_motion`.
//!
//! What a step of a frame costs: a marker hangs on 6 joints on average, so on 7 blocks (3, 3) with
//! the root; 39 markers make 1.1 thousand products of blocks, 60 kFLOP, beside 141 kFLOP of a
//! Cholesky factorisation (75, 75) and 23 for solving: 0.22 MFLOP. The matrix is 45 KB, which the
//! first-level cache does not hold beside its factor. So the work is bound by arithmetic in the
//! second-level cache, not by memory: nothing is streamed.
//!
//! Measured on two cores of an AMD EPYC (a virtual machine with other work on it): 0.33 s for these
//! 720 frames, 3.3 s per minute of markers; on one thread 0.43 s, 0.6 ms a frame with the fit of
//! the shape. A step takes about 0.09 ms: building the equations 0.04, factorising and solving
//! 0.04, the skin 0.01; that is 2.4 GFLOP/s in double precision, without wide vectors.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cromosim_body::BodyModel;
use cromosim_motion::{MarkerOptions, MarkerSet, embedded_walk, fit_markers, place_markers};

const SECONDS: f64 = 6.0;

fn fit(criterion: &mut Criterion) {
    let body = BodyModel::embedded();
    let set = MarkerSet::embedded().unwrap().remove(0);
    let walk = embedded_walk()
        .resampled(120.0)
        .unwrap()
        .slice(0.0, Some(SECONDS))
        .unwrap();
    let mut clip = place_markers(&walk, &body, &set).unwrap();
    // A tenth of the points lost, by a fixed rule; a few tenths of a millimetre of error.
    for (index, point) in clip.frames.iter_mut().flatten().enumerate() {
        let wave = (index as f64 * 12.9898).sin();
        *point = point
            .map(|point| point + nalgebra::Vector3::repeat(wave * 1e-3))
            .filter(|_| index % 97 >= 10);
    }
    let mut group = criterion.benchmark_group("markers");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(walk.frames.len() as u64));
    group.bench_function("39 markers, frames of 120 Hz", |bencher| {
        bencher.iter(|| {
            fit_markers(black_box(&clip), &body, &set, &MarkerOptions::default()).unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, fit);
criterion_main!(benches);
