//! Encoding, decoding, and one message from a publisher to a subscription on 127.0.0.1 (domain
//! 199).

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::{
    DiscoveryRange, Network, Node, NodeOptions, Parameters, Qos, RawMessage, RosArgs, RosError,
};

fn node(name: &str) -> Result<Node, RosError> {
    let network = Network {
        domain_id: 199,
        range: DiscoveryRange::Localhost,
        peers: Vec::new(),
    };
    Node::start(NodeOptions::new(name, &RosArgs::default(), &Parameters::new())?.network(network))
}

fn encoding(c: &mut Criterion) {
    let imu = Imu::default();
    let Ok(raw) = RawMessage::encode(&imu) else {
        return;
    };
    c.bench_function("encode Imu", |b| b.iter(|| RawMessage::encode(&imu)));
    c.bench_function("decode Imu", |b| b.iter(|| raw.decode::<Imu>()));
}

fn hand_over(c: &mut Criterion) -> Result<(), RosError> {
    let (talker, listener) = (node("bench_talker")?, node("bench_listener")?);
    let publisher = talker.publisher::<Imu>("bench/imu", Qos::reliable())?;
    let subscription = listener.subscription::<Imu>("bench/imu", Qos::reliable())?;
    let long = Duration::from_secs(20);
    assert!(
        publisher.wait_for_subscriptions(1, long) && subscription.wait_for_publishers(1, long),
        "no match on 127.0.0.1"
    );
    let imu = Imu::default();
    c.bench_function("publish one Imu and receive it", |b| {
        b.iter(|| {
            publisher
                .publish(&imu)
                .and_then(|()| subscription.recv_timeout(long))
        });
    });
    Ok(())
}

fn topics(c: &mut Criterion) {
    if let Err(error) = hand_over(c) {
        panic!("{error}");
    }
}

criterion_group!(benches, encoding, topics);
criterion_main!(benches);
