//! Live use: `cargo bench -p cromosim_learned --bench streaming`.
//!
//! A step takes 17 placements through two networks, one for the accelerometers and one for the
//! gyroscopes; at 100 Hz, 100 microseconds a step are 1 % of a core.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_learned::{Direction, Network, NetworkShape, StreamingBatch};

const PLACEMENTS: usize = 17;
const INPUTS: usize = 27;

fn streaming(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("17 placements, both networks, one step");
    for (channels, hidden) in [(32, 64), (64, 128)] {
        let direction = Direction::Forward;
        let shape = NetworkShape {
            inputs: INPUTS,
            channels,
            kernel: 5,
            convolutions: 3,
            hidden,
            layers: 2,
            direction,
            outputs: 3,
        };
        let mut networks = [1, 2].map(|seed| {
            let network = Network::new(shape.clone(), seed).expect("a sound shape");
            StreamingBatch::new(&network, PLACEMENTS).expect("a causal network")
        });
        let input: Vec<f32> = (0..PLACEMENTS * INPUTS)
            .map(|index| (index as f32).sin())
            .collect();
        group.bench_function(format!("channels {channels}, hidden {hidden}"), |bencher| {
            bencher.iter(|| {
                for network in &mut networks {
                    black_box(network.step(black_box(&input)).expect("inputs that fit"));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, streaming);
criterion_main!(benches);
