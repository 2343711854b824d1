//! Measures publisher to subscription: `latency [--topics N] [--rate-hz R] [--seconds S]`, two
//! nodes on 127.0.0.1, an Imu message each.
//!
//! Prints messages sent and received, latency from the publisher's stamp to the program's hand
//! (p50, p90, p99, maximum), the processor time of the whole process and its resident memory.
//! `--idle N` starts N nodes that do nothing instead.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::{Clock, Node, NodeOptions, Parameters, Qos, RosArgs};

struct Settings {
    topics: usize,
    rate_hz: f64,
    seconds: f64,
    idle: usize,
}

fn settings(rest: &[String]) -> Result<Settings, Box<dyn std::error::Error>> {
    let mut settings = Settings {
        topics: 17,
        rate_hz: 100.0,
        seconds: 10.0,
        idle: 0,
    };
    for pair in rest.chunks(2) {
        let [flag, value] = pair else {
            return Err(format!("{}: expected a value after it", pair[0]).into());
        };
        match flag.as_str() {
            "--topics" => settings.topics = value.parse()?,
            "--rate-hz" => settings.rate_hz = value.parse()?,
            "--seconds" => settings.seconds = value.parse()?,
            "--idle" => settings.idle = value.parse()?,
            other => return Err(format!("{other}: not an argument of this program").into()),
        }
    }
    Ok(settings)
}

fn start(name: &str, args: &RosArgs) -> Result<Node, cromosim_ros::RosError> {
    Node::start(NodeOptions::new(name, args, &Parameters::new())?)
}

/// Processor seconds (user and system) and resident MiB of this process, from /proc.
fn usage() -> (f64, f64) {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .collect();
    let ticks = |index: usize| {
        fields
            .get(index)
            .and_then(|field| field.parse::<f64>().ok())
            .unwrap_or(f64::NAN)
    };
    (
        ((ticks(11) + ticks(12)) / 100.0),
        ticks(21) * 4096.0 / 1_048_576.0,
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = RosArgs::from_env()?;
    let settings = settings(&args.rest)?;
    if settings.idle > 0 {
        idle(&settings, &args)
    } else {
        exchange(&settings, &args)
    }
}

/// Nodes that do nothing.
fn idle(settings: &Settings, args: &RosArgs) -> Result<(), Box<dyn std::error::Error>> {
    let nodes = (0..settings.idle)
        .map(|index| start(&format!("idle_{index}"), args))
        .collect::<Result<Vec<_>, _>>()?;
    std::thread::sleep(Duration::from_secs(3));
    let (before, _) = usage();
    std::thread::sleep(Duration::from_secs_f64(settings.seconds));
    let (after, resident) = usage();
    let share = 100.0 * (after - before) / settings.seconds;
    println!(
        "{} idle nodes in one process: {share:.2} % of a core, {resident:.1} MiB",
        nodes.len()
    );
    Ok(())
}

/// Two nodes, messages from one to the other.
fn exchange(settings: &Settings, args: &RosArgs) -> Result<(), Box<dyn std::error::Error>> {
    let (talker, listener) = (start("talker", args)?, start("listener", args)?);
    let latencies = Arc::new(Mutex::new(Vec::new()));
    let mut publishers = Vec::new();
    let mut listening = Vec::new();
    for index in 0..settings.topics {
        let topic = format!("/imu/sensor_{index}/data_raw");
        publishers.push(talker.publisher::<Imu>(&topic, Qos::reliable())?);
        let latencies = Arc::clone(&latencies);
        listening.push(
            listener.listen::<Imu>(&topic, Qos::recorder(), move |received| {
                let latency = Clock::system_now().nanos - received.message.header.stamp.nanos();
                if let Ok(mut latencies) = latencies.lock() {
                    latencies.push(latency as f64 * 1e-6);
                }
            })?,
        );
    }
    if !publishers
        .iter()
        .all(|publisher| publisher.wait_for_subscriptions(1, Duration::from_secs(20)))
    {
        return Err("not every topic is matched after 20 s".into());
    }
    std::thread::sleep(Duration::from_secs(1));
    let (before, _) = usage();
    let (start, count) = (Instant::now(), (settings.rate_hz * settings.seconds) as u64);
    for index in 0..count {
        for publisher in &publishers {
            let mut imu = Imu::default();
            imu.header.stamp = Time::from_nanos(Clock::system_now().nanos);
            publisher.publish(&imu)?;
        }
        let due = start + Duration::from_secs_f64((index + 1) as f64 / settings.rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    let (after, resident) = usage();
    let seconds = start.elapsed().as_secs_f64();
    for publisher in &publishers {
        publisher.wait_for_acknowledgments(Duration::from_secs(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    let mut latencies = latencies.lock().map_err(|_| "a callback panicked")?.clone();
    latencies.sort_by(f64::total_cmp);
    let at = |share: f64| {
        latencies
            .get(((latencies.len() as f64 - 1.0) * share) as usize)
            .copied()
            .unwrap_or(f64::NAN)
    };
    println!(
        "{} topics at {} Hz: sent {}, received {}; latency p50 {:.3}, p90 {:.3}, p99 {:.3}, max {:.3} ms; {:.1} % of a core for both \
         nodes, {resident:.1} MiB",
        settings.topics,
        settings.rate_hz,
        count * settings.topics as u64,
        latencies.len(),
        at(0.5),
        at(0.9),
        at(0.99),
        at(1.0),
        100.0 * (after - before) / seconds,
    );
    Ok(())
}
