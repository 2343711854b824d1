//! Publishes `sensor_msgs/msg/Imu` on given topics: `talker [--messages N] [--rate-hz R]
//! [--wait-for N] TOPIC... [--ros-args ...]`.
//!
//! Waits for `--wait-for` subscriptions on each topic, sends, and ends when all is confirmed.

use std::time::{Duration, Instant};

use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RosArgs, Shutdown, init_logging};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = RosArgs::from_env()?;
    init_logging(&args.log_levels);
    let (mut messages, mut rate_hz, mut wait_for, mut topics) =
        (100_u64, 100.0_f64, 1_usize, Vec::new());
    let mut rest = args.rest.iter();
    while let Some(argument) = rest.next() {
        let mut value = || {
            rest.next()
                .ok_or_else(|| format!("{argument}: expected a value after it"))
        };
        match argument.as_str() {
            "--messages" => messages = value()?.parse()?,
            "--rate-hz" => rate_hz = value()?.parse()?,
            "--wait-for" => wait_for = value()?.parse()?,
            topic => topics.push(topic.to_owned()),
        }
    }
    let shutdown = Shutdown::on_signals()?;
    let node =
        Node::start(NodeOptions::new("talker", &args, &Parameters::new())?.shutdown(&shutdown))?;
    let publishers = topics
        .iter()
        .map(|topic| node.publisher::<Imu>(topic, Qos::reliable()))
        .collect::<Result<Vec<_>, _>>()?;
    for publisher in &publishers {
        if !publisher.wait_for_subscriptions(wait_for, Duration::from_secs(30)) {
            return Err(format!(
                "{}: {} subscriptions after 30 s, expected {wait_for}",
                publisher.topic(),
                publisher.subscription_count()
            )
            .into());
        }
    }
    let start = Instant::now();
    for index in 0..messages {
        if shutdown.is_requested() {
            break;
        }
        let mut imu = Imu::default();
        imu.header.stamp = Time::from_nanos(node.now().nanos);
        imu.linear_acceleration.z = index as f64;
        for publisher in &publishers {
            imu.header.frame_id = publisher.topic().trim_start_matches('/').to_owned();
            publisher.publish(&imu)?;
        }
        let due = start + Duration::from_secs_f64((index + 1) as f64 / rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    for publisher in &publishers {
        publisher.wait_for_acknowledgments(Duration::from_secs(10));
    }
    println!("{messages} messages on each of {} topics", publishers.len());
    Ok(())
}
