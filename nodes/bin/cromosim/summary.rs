//! What a live run made: topics, counts, rates and latency, read back from the bag.

use std::path::Path;

use cromosim_bag::{BagReader, Selection};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::{RosMessage, cromosim_msgs::SmplState, printable};
use cromosim_spatial::Stamp;

use crate::output::say;

/// Latencies of the IMU messages of a live run, s, sorted.
struct Latency {
    /// From the stamp of a sample to its publication: the scheme's delay included.
    age: Vec<f64>,
    /// From the publication of the state that completed the sample to the publication of the
    /// sample.
    beyond_state: Vec<f64>,
}

impl Latency {
    /// Adds the samples of one placement: stamp and publication of each. The state that released a
    /// sample is the first whose stamp is the scheme's delay later; the delay is the median
    /// distance to the newest state at the publication.
    fn add(&mut self, states: &[(Stamp, Stamp)], samples: &[(Stamp, Stamp)]) {
        let newest = |published: Stamp| {
            states
                .partition_point(|&(_, time)| time <= published)
                .checked_sub(1)
        };
        let mut delays: Vec<f64> = samples
            .iter()
            .filter_map(|&(stamp, published)| {
                newest(published).map(|state| states[state].0 - stamp)
            })
            .collect();
        delays.sort_unstable_by(f64::total_cmp);
        let delay = quantile(&delays, 0.5);
        for &(stamp, published) in samples {
            self.age.push(published - stamp);
            // Half a millisecond of slack: states and samples need not stand on one grid.
            let releasing = states.partition_point(|&(time, _)| time - stamp < delay - 0.5e-3);
            // The first samples wait until the rate of the states is known.
            if let Some(&(_, sent)) = states
                .get(releasing)
                .filter(|&&(_, sent)| published >= sent)
            {
                self.beyond_state.push(published - sent);
            }
        }
    }
}

/// The value that a fraction of a sorted list stays below (nearest rank).
fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let rank = (fraction * sorted.len() as f64).ceil() as usize;
    sorted
        .get(rank.clamp(1, sorted.len().max(1)) - 1)
        .copied()
        .unwrap_or(f64::NAN)
}

fn latency(reader: &BagReader) -> anyhow::Result<Option<Latency>> {
    let of_type = |wanted: &str| -> Vec<String> {
        let topics = reader
            .summary()
            .topics
            .iter()
            .filter(|counted| counted.topic.type_name == wanted);
        topics.map(|counted| counted.topic.name.clone()).collect()
    };
    let (states, imus) = (of_type(SmplState::TYPE_NAME), of_type(Imu::TYPE_NAME));
    if states.is_empty() || imus.is_empty() {
        return Ok(None);
    }
    // Stamp of each state, and when it was published.
    let mut published: Vec<(Stamp, Stamp)> = Vec::new();
    for message in reader.messages(&Selection {
        topics: Some(states),
        ..Selection::default()
    })? {
        let message = message?;
        let state: SmplState = message.decode()?;
        published.push((
            Stamp::from_nanos(state.header.stamp.nanos()),
            message.publish_time,
        ));
    }
    published.sort_unstable();
    let mut latency = Latency {
        age: Vec::new(),
        beyond_state: Vec::new(),
    };
    for topic in imus {
        let mut samples: Vec<(Stamp, Stamp)> = Vec::new();
        for message in reader.messages(&Selection::topic(&topic))? {
            let message = message?;
            let imu: Imu = message.decode()?;
            samples.push((
                Stamp::from_nanos(imu.header.stamp.nanos()),
                message.publish_time,
            ));
        }
        latency.add(&published, &samples);
    }
    latency.age.sort_unstable_by(f64::total_cmp);
    latency.beyond_state.sort_unstable_by(f64::total_cmp);
    Ok(Some(latency))
}

/// Prints what the bag holds and where everything is.
pub fn print(bag: &Path, recording: Option<&Path>) -> anyhow::Result<()> {
    let reader = BagReader::open(bag)?;
    let summary = reader.summary();
    let mut topics: Vec<_> = summary.topics.iter().collect();
    topics.sort_by(|one, other| one.topic.name.cmp(&other.topic.name));
    let width = topics
        .iter()
        .map(|counted| printable(&counted.topic.name).chars().count())
        .max()
        .unwrap_or(5)
        .max(5);
    say!(
        "{:width$}  {:>8}  {:>9}  type",
        "topic",
        "messages",
        "rate, Hz"
    )?;
    for counted in topics {
        let rate = active_rate(&reader, &counted.topic.name)?
            .map_or_else(|| "-".to_owned(), |rate| format!("{rate:.2}"));
        say!(
            "{:width$}  {:8}  {rate:>9}  {}",
            printable(&counted.topic.name),
            counted.message_count,
            printable(&counted.topic.type_name)
        )?;
    }
    say!(
        "{} messages in {:.2} s",
        summary.message_count(),
        summary.duration()
    )?;
    if let Some(latency) = latency(&reader)? {
        let ms = |sorted: &[f64], fraction| 1e3 * quantile(sorted, fraction);
        say!(
            "latency from SmplState to Imu: p50 {:.2} ms, p99 {:.2} ms; age of an Imu message when published, the scheme's delay included: p50 {:.1} ms, p99 {:.1} ms",
            ms(&latency.beyond_state, 0.5),
            ms(&latency.beyond_state, 0.99),
            ms(&latency.age, 0.5),
            ms(&latency.age, 0.99)
        )?;
    }
    say!("bag        {}", bag.display())?;
    if let Some(recording) = recording {
        say!(
            "recording  {}   (open it: rerun {})",
            recording.display(),
            recording.display()
        )?;
    }
    Ok(())
}

/// Messages a second between the first and the last message of a topic.
fn active_rate(reader: &BagReader, topic: &str) -> anyhow::Result<Option<f64>> {
    let mut times = Vec::new();
    for message in reader.messages(&Selection::topic(topic))? {
        times.push(message?.publish_time);
    }
    let span = match (times.iter().min(), times.iter().max()) {
        (Some(&first), Some(&last)) => last - first,
        _ => 0.0,
    };
    Ok((times.len() > 1 && span > 0.0).then(|| (times.len() - 1) as f64 / span))
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_are_nearest_ranks() {
        let sorted: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(
            (
                quantile(&sorted, 0.5),
                quantile(&sorted, 0.99),
                quantile(&sorted, 1.0)
            ),
            (50.0, 99.0, 100.0)
        );
        assert!(quantile(&[], 0.5).is_nan());
    }
}
