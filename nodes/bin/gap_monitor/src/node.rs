//! From the messages of real and virtual IMUs to a line about the gap of each.

use std::collections::VecDeque;

use cromosim_gap::monitor::{
    Assessment, FirstCause, ImuReading, MonitorOptions, Pace, assess, pace,
};
use cromosim_imu::PerChannel;
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

use crate::config::Config;

/// Messages that a stream keeps at most: 10 kHz for the longest of windows that is common.
const MOST_READINGS: usize = 100_000;

/// Which of a placement's two streams a message belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The real IMU.
    Measured,
    /// The virtual one.
    Simulated,
}

/// The last seconds of one stream, in order of its stamps.
#[derive(Default)]
struct Stream {
    readings: VecDeque<ImuReading>,
    /// When the last message arrived, by the node's clock.
    heard: Option<Stamp>,
    /// Messages that held no finite numbers, or came a second time.
    refused: u64,
}

impl Stream {
    fn push(&mut self, reading: ImuReading, now: Stamp, window_s: f64) {
        self.heard = Some(now);
        if !reading.values.iter().all(|value| value.is_finite()) {
            self.refused += 1;
            return;
        }
        // A source that starts over (a loop, a seek) starts the window over.
        if self
            .readings
            .back()
            .is_some_and(|last| last.stamp - reading.stamp > window_s.min(1.0))
        {
            self.readings.clear();
        }
        let place = self
            .readings
            .partition_point(|known| known.stamp < reading.stamp);
        if self
            .readings
            .get(place)
            .is_some_and(|known| known.stamp == reading.stamp)
        {
            self.refused += 1;
            return;
        }
        self.readings.insert(place, reading);
    }

    /// Leaves out what is older than `from`.
    fn prune(&mut self, from: Stamp) {
        while self.readings.len() > MOST_READINGS
            || self
                .readings
                .front()
                .is_some_and(|first| first.stamp < from)
        {
            self.readings.pop_front();
        }
    }

    fn last(&self) -> Option<Stamp> {
        self.readings.back().map(|reading| reading.stamp)
    }
}

/// One placement.
struct Placement {
    name: String,
    measured: Stream,
    simulated: Stream,
    declared_sigmas: PerChannel<Option<f64>>,
}

/// The node: a function of the messages so far.
pub struct GapMonitorNode {
    config: Config,
    placements: Vec<Placement>,
}

impl GapMonitorNode {
    /// A node for a checked configuration.
    pub fn new(config: Config) -> Self {
        let placement = |name: &String| Placement {
            name: name.clone(),
            measured: Stream::default(),
            simulated: Stream::default(),
            declared_sigmas: PerChannel::default(),
        };
        Self {
            placements: config.placements.iter().map(placement).collect(),
            config,
        }
    }

    /// Takes a message of a placement, by its number in the configuration; `now` is when it
    /// arrived.
    pub fn take(&mut self, placement: usize, source: Source, imu: &Imu, now: Stamp) {
        let Some(placement) = self.placements.get_mut(placement) else {
            return;
        };
        let (f, w) = (imu.linear_acceleration, imu.angular_velocity);
        let reading = ImuReading {
            stamp: Stamp::from_nanos(imu.header.stamp.nanos()),
            values: [f.x, f.y, f.z, w.x, w.y, w.z],
        };
        let stream = match source {
            Source::Measured => {
                placement.declared_sigmas = PerChannel {
                    accelerometer: sigma(&imu.linear_acceleration_covariance),
                    gyroscope: sigma(&imu.angular_velocity_covariance),
                };
                &mut placement.measured
            }
            Source::Simulated => &mut placement.simulated,
        };
        stream.push(reading, now, self.config.window_s);
    }

    /// For `/diagnostics`: one status for each placement.
    pub fn diagnostics(&mut self, now: Stamp, node_name: &str) -> DiagnosticArray {
        let config = &self.config;
        let status = self
            .placements
            .iter_mut()
            .map(|placement| placement.status(config, now, node_name))
            .collect();
        DiagnosticArray {
            header: Header {
                stamp: Time::from_nanos(now.nanos),
                frame_id: String::new(),
            },
            status,
        }
    }
}

/// Standard deviation that a covariance declares; none where it is unknown (zeros) or not reported
/// (-1).
fn sigma(covariance: &[f64; 9]) -> Option<f64> {
    let variance = (covariance[0] + covariance[4] + covariance[8]) / 3.0;
    (covariance[0] >= 0.0 && variance > 0.0 && variance.is_finite()).then(|| variance.sqrt())
}

impl Placement {
    fn status(&mut self, config: &Config, now: Stamp, node_name: &str) -> DiagnosticStatus {
        // Both streams end at the same stamp, so that a late one does not lose what it is to be
        // compared with.
        if let (Some(measured), Some(simulated)) = (self.measured.last(), self.simulated.last()) {
            // Clocks that have nothing in common must not empty a window.
            let apart = (measured - simulated).abs() > config.window_s;
            let end = measured.min(simulated);
            for (stream, last) in [
                (&mut self.measured, measured),
                (&mut self.simulated, simulated),
            ] {
                stream.prune(if apart { last } else { end }.plus_seconds(-config.window_s));
            }
        }
        for stream in [&mut self.measured, &mut self.simulated] {
            if let Some(last) = stream.last() {
                stream.prune(last.plus_seconds(-3.0 * config.window_s));
            }
        }
        let (measured, simulated) = (
            self.measured.readings.make_contiguous(),
            self.simulated.readings.make_contiguous(),
        );
        let options = MonitorOptions {
            declared_sigmas: self.declared_sigmas,
            least_sigmas: PerChannel {
                accelerometer: config.accel_floor,
                gyroscope: config.gyro_floor,
            },
            ..MonitorOptions::default()
        };
        let assessment = assess(measured, simulated, &options);
        let paces = [pace(measured), pace(simulated)];
        let (level, message) = self.verdict(config, now, assessment.as_ref());
        DiagnosticStatus {
            level,
            name: format!("{node_name}: {}", self.name),
            message,
            hardware_id: self.name.clone(),
            values: self.values(config, assessment.as_ref(), paces),
        }
    }

    fn verdict(
        &self,
        config: &Config,
        now: Stamp,
        assessment: Option<&Assessment>,
    ) -> (u8, String) {
        let [measured_topic, simulated_topic] = config.topics(&self.name);
        for (stream, topic) in [
            (&self.measured, measured_topic),
            (&self.simulated, simulated_topic),
        ] {
            match stream.heard.map(|heard| now - heard) {
                None => {
                    return (
                        DiagnosticStatus::STALE,
                        format!("nothing has come on {topic} yet"),
                    );
                }
                Some(silent) if silent > config.stale_after_s => {
                    return (
                        DiagnosticStatus::STALE,
                        format!("nothing has come on {topic} for {silent:.1} s"),
                    );
                }
                Some(_) => {}
            }
        }
        let Some(found) = assessment else {
            return (DiagnosticStatus::WARN, self.nothing_in_common(config));
        };
        let (accel, gyro) = (found.accel_rmse, found.gyro_rmse);
        if found.first_cause == FirstCause::None {
            return (
                DiagnosticStatus::OK,
                format!("no gap beyond the noise ({accel:.2} m/s2, {gyro:.3} rad/s)"),
            );
        }
        // The channel that stands out more over its noise says how large the gap is.
        let size = if found.whitened.accelerometer >= found.whitened.gyroscope {
            format!("{accel:.2} m/s2")
        } else {
            format!("{gyro:.3} rad/s")
        };
        let level = if accel >= config.accel_error || gyro >= config.gyro_error {
            DiagnosticStatus::ERROR
        } else {
            DiagnosticStatus::WARN
        };
        (
            level,
            format!(
                "gap {size}, first cause {} ({:.0} %)",
                found.first_cause,
                100.0 * found.first_cause_share
            ),
        )
    }

    fn nothing_in_common(&self, config: &Config) -> String {
        match (self.measured.last(), self.simulated.last()) {
            (Some(measured), Some(simulated)) if (measured - simulated).abs() > config.window_s => {
                let (lead, later) = (
                    (measured - simulated).abs(),
                    if measured > simulated {
                        "ahead of"
                    } else {
                        "behind"
                    },
                );
                format!(
                    "no common stamps: those of the real IMU are {lead:.1} s {later} those of the virtual one"
                )
            }
            _ => "too few messages with common stamps so far".to_owned(),
        }
    }

    fn values(
        &self,
        config: &Config,
        assessment: Option<&Assessment>,
        [measured, simulated]: [Pace; 2],
    ) -> Vec<KeyValue> {
        let of = |value: &dyn Fn(&Assessment) -> String| {
            assessment.map_or_else(|| "unknown".to_owned(), value)
        };
        let lag = |found: &Assessment| {
            found
                .lag_s
                .map_or_else(|| "unknown".to_owned(), |seconds| format!("{seconds:.4}"))
        };
        let all = [
            (
                "accel_rmse",
                of(&|found| format!("{:.5}", found.accel_rmse)),
            ),
            ("gyro_rmse", of(&|found| format!("{:.6}", found.gyro_rmse))),
            ("first_cause", of(&|found| found.first_cause.to_string())),
            (
                "first_cause_share",
                of(&|found| format!("{:.3}", found.first_cause_share)),
            ),
            ("lag_s", of(&lag)),
            ("measured_rate_hz", format!("{:.2}", measured.rate_hz)),
            ("simulated_rate_hz", format!("{:.2}", simulated.rate_hz)),
            ("dropped", measured.dropped.to_string()),
            ("window_s", format!("{}", config.window_s)),
            ("compared", of(&|found| found.compared.to_string())),
            (
                "refused",
                (self.measured.refused + self.simulated.refused).to_string(),
            ),
        ];
        all.map(|(key, value)| KeyValue {
            key: key.to_owned(),
            value,
        })
        .to_vec()
    }
}
