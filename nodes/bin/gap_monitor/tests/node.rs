//! The node as a function of messages, without DDS.
#![allow(clippy::unwrap_used)]

use cromosim_gap_monitor::{Config, GapMonitorNode, Source};
use cromosim_msgs::diagnostic_msgs::DiagnosticStatus;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

const START: i64 = 1_700_000_000_000_000_000;

fn config(placements: &[&str]) -> Config {
    Config {
        placements: placements.iter().map(|&name| name.to_owned()).collect(),
        ..Config::default()
    }
}

/// A message of made-up motion at a time, s, with this error of the accelerometer's x axis, m/s2.
fn imu(seconds: f64, error: f64) -> Imu {
    let mut imu = Imu {
        header: Header::new(stamp(seconds).nanos, "imu"),
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

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_nanos(START).plus_seconds(seconds)
}

/// Hands over both streams from one time to another; the simulated one at 120 Hz.
fn run(node: &mut GapMonitorNode, placement: usize, from: f64, to: f64, error: f64) {
    for k in (from * 100.0) as i64..(to * 100.0) as i64 {
        let seconds = k as f64 / 100.0;
        node.take(
            placement,
            Source::Measured,
            &imu(seconds, error),
            stamp(seconds),
        );
    }
    for k in (from * 120.0) as i64..(to * 120.0) as i64 {
        let seconds = k as f64 / 120.0;
        node.take(
            placement,
            Source::Simulated,
            &imu(seconds, 0.0),
            stamp(seconds),
        );
    }
}

fn value<'a>(status: &'a DiagnosticStatus, key: &str) -> &'a str {
    &status
        .values
        .iter()
        .find(|found| found.key == key)
        .unwrap()
        .value
}

#[test]
fn a_bias_is_named_with_its_size_and_the_other_placement_is_well() {
    let mut node = GapMonitorNode::new(config(&["wrist", "head"]));
    run(&mut node, 0, 0.0, 12.0, 0.8);
    run(&mut node, 1, 0.0, 12.0, 0.0);
    let said = node.diagnostics(stamp(12.0), "/gap_monitor");
    let [wrist, head] = said.status.as_slice() else {
        panic!("{said:?}")
    };
    assert_eq!(
        (wrist.level, wrist.name.as_str()),
        (DiagnosticStatus::WARN, "/gap_monitor: wrist")
    );
    assert_eq!(
        wrist.message,
        "gap 0.80 m/s2, first cause accel_bias (100 %)"
    );
    assert_eq!(
        (value(wrist, "first_cause"), value(wrist, "window_s")),
        ("accel_bias", "10")
    );
    assert!(
        (value(wrist, "accel_rmse").parse::<f64>().unwrap() - 0.8).abs() < 0.01,
        "{wrist:?}"
    );
    assert!((value(wrist, "measured_rate_hz").parse::<f64>().unwrap() - 100.0).abs() < 0.1);
    assert!((value(wrist, "simulated_rate_hz").parse::<f64>().unwrap() - 120.0).abs() < 0.1);
    assert_eq!(head.level, DiagnosticStatus::OK, "{head:?}");
    assert!(
        head.message.starts_with("no gap beyond the noise"),
        "{head:?}"
    );
}

#[test]
fn the_window_slides() {
    let mut node = GapMonitorNode::new(config(&["wrist"]));
    run(&mut node, 0, 0.0, 12.0, 0.8);
    assert_eq!(
        node.diagnostics(stamp(12.0), "n").status[0].level,
        DiagnosticStatus::WARN
    );
    run(&mut node, 0, 12.0, 23.0, 0.0);
    let said = node.diagnostics(stamp(23.0), "n").status.remove(0);
    assert_eq!(said.level, DiagnosticStatus::OK, "{said:?}");
    assert!(
        (990..=1001).contains(&value(&said, "compared").parse::<i64>().unwrap()),
        "{said:?}"
    );
}

#[test]
fn silence_is_stale_and_no_motion_in_common_is_said() {
    let mut node = GapMonitorNode::new(config(&["wrist"]));
    let said = node.diagnostics(stamp(0.0), "n").status.remove(0);
    assert_eq!(
        (said.level, said.message.as_str()),
        (
            DiagnosticStatus::STALE,
            "nothing has come on /imu/wrist/data_raw yet"
        )
    );
    run(&mut node, 0, 0.0, 5.0, 0.0);
    let said = node.diagnostics(stamp(9.0), "n").status.remove(0);
    assert_eq!(said.level, DiagnosticStatus::STALE);
    assert_eq!(
        said.message,
        "nothing has come on /imu/wrist/data_raw for 4.0 s"
    );

    let mut node = GapMonitorNode::new(config(&["wrist"]));
    for k in 0..100 {
        let seconds = 0.01 * f64::from(k);
        node.take(
            0,
            Source::Measured,
            &imu(seconds + 100.0, 0.0),
            stamp(seconds),
        );
        node.take(0, Source::Simulated, &imu(seconds, 0.0), stamp(seconds));
    }
    let said = node.diagnostics(stamp(1.0), "n").status.remove(0);
    assert_eq!(said.level, DiagnosticStatus::WARN);
    assert_eq!(
        said.message,
        "no common stamps: those of the real IMU are 100.0 s ahead of those of the virtual one"
    );
}

#[test]
fn a_gap_beyond_the_limit_is_an_error() {
    let mut node = GapMonitorNode::new(config(&["wrist"]));
    run(&mut node, 0, 0.0, 10.0, 7.0);
    assert_eq!(
        node.diagnostics(stamp(10.0), "n").status[0].level,
        DiagnosticStatus::ERROR
    );
}

#[test]
fn a_source_that_starts_over_starts_the_window_over() {
    let mut node = GapMonitorNode::new(config(&["wrist"]));
    run(&mut node, 0, 50.0, 60.0, 0.8);
    run(&mut node, 0, 0.0, 10.0, 0.0);
    let said = node.diagnostics(stamp(10.0), "n").status.remove(0);
    assert_eq!(said.level, DiagnosticStatus::OK, "{said:?}");
}

#[test]
fn nonsense_is_counted_and_the_node_goes_on() {
    let mut node = GapMonitorNode::new(config(&["wrist"]));
    run(&mut node, 0, 0.0, 10.0, 0.0);
    let mut broken = imu(9.999, 0.0);
    broken.angular_velocity.y = f64::NAN;
    node.take(0, Source::Measured, &broken, stamp(10.0));
    node.take(0, Source::Measured, &imu(9.99, 0.0), stamp(10.0));
    node.take(7, Source::Measured, &imu(9.99, 0.0), stamp(10.0));
    let said = node.diagnostics(stamp(10.0), "n").status.remove(0);
    assert_eq!(
        (said.level, value(&said, "refused")),
        (DiagnosticStatus::OK, "2"),
        "{said:?}"
    );
}

#[test]
fn wrong_configurations_name_the_parameter() {
    assert!(config(&["wrist"]).check().is_ok());
    let refused = |change: &dyn Fn(&mut Config)| {
        let mut wrong = config(&["wrist", "head"]);
        change(&mut wrong);
        wrong.check().unwrap_err().to_string()
    };
    assert!(refused(&|config| config.placements.clear()).starts_with("parameter 'placements'"));
    assert!(
        refused(&|config| config.placements.push("head".into())).contains("'head' is there twice")
    );
    assert!(
        refused(&|config| config.measured_topic = "/imu".into())
            .starts_with("parameter 'measured_topic'")
    );
    assert!(
        refused(&|config| config.simulated_topic.clone_from(&config.measured_topic))
            .contains("another topic")
    );
    assert!(refused(&|config| config.window_s = 0.0).starts_with("parameter 'window_s'"));
    assert!(refused(&|config| config.rate_hz = f64::NAN).starts_with("parameter 'rate_hz'"));
}
