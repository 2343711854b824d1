//! What the monitor costs: a round over 17 placements at 100 Hz with a window of 10 s. There is one
//! a second, so that a millisecond is 0.1 % of a core.
//!
//! `cargo bench -p cromosim_gap_monitor`

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_gap_monitor::{Config, GapMonitorNode, Source};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

const PLACEMENTS: usize = 17;
const RATE_HZ: usize = 100;

fn imu(seconds: f64, error: f64) -> Imu {
    let mut imu = Imu {
        header: Header::new(Stamp::from_seconds(1000.0 + seconds).nanos, "imu"),
        ..Imu::default()
    };
    imu.linear_acceleration.x = 2.0 * (3.0 * seconds).sin() + error;
    imu.linear_acceleration.y = 1.5 * (5.0 * seconds).cos();
    imu.linear_acceleration.z = 9.8 + (4.0 * seconds).sin();
    imu.angular_velocity.x = (2.0 * seconds).sin();
    imu.angular_velocity.y = 0.7 * (3.3 * seconds).cos();
    imu.angular_velocity.z = 0.5 * (5.1 * seconds).sin();
    imu
}

/// A second of messages of all placements.
fn take_second(node: &mut GapMonitorNode, second: usize) {
    for k in 0..RATE_HZ {
        let seconds = second as f64 + k as f64 / RATE_HZ as f64;
        let now = Stamp::from_seconds(1000.0 + seconds);
        for placement in 0..PLACEMENTS {
            // A gap everywhere, as a window without one is cheaper.
            node.take(placement, Source::Measured, &imu(seconds, 0.5), now);
            node.take(
                placement,
                Source::Simulated,
                &imu(seconds - 0.004, 0.0),
                now,
            );
        }
    }
}

fn load(criterion: &mut Criterion) {
    let placements = (0..PLACEMENTS)
        .map(|number| format!("imu_{number}"))
        .collect();
    let mut node = GapMonitorNode::new(Config {
        placements,
        ..Config::default()
    });
    let mut second = 0;
    while second < 10 {
        take_second(&mut node, second);
        second += 1;
    }
    criterion.bench_function(
        "a second of 17 placements at 100 Hz, window 10 s",
        |bencher| {
            bencher.iter(|| {
                take_second(&mut node, second);
                second += 1;
                node.diagnostics(Stamp::from_seconds(1000.0 + second as f64), "/gap_monitor")
            });
        },
    );
}

criterion_group!(benches, load);
criterion_main!(benches);
