//! What simulated readings are good for, as bags and summaries say it.

use std::path::Path;

use cromosim_imu::Bandwidth;
use cromosim_recording::Quality;

use crate::output::remark;

/// Entries of a bag's metadata about one placement: `bandwidth_hz.NAME` and `trimmed_s.NAME`.
pub fn quality_entries(name: &str, quality: &Quality) -> Vec<(String, String)> {
    let [start, end] = quality.trimmed_s;
    let bandwidth = quality.bandwidth.map(|bandwidth| {
        let Bandwidth {
            acceleration_hz,
            angular_velocity_hz,
        } = bandwidth;
        (
            format!("bandwidth_hz.{name}"),
            format!(
                "specific force {acceleration_hz:.1}, angular velocity {angular_velocity_hz:.1}"
            ),
        )
    });
    let trimmed = (
        format!("trimmed_s.{name}"),
        format!("start {start:.3}, end {end:.3}"),
    );
    let texture = quality.texture.map(|texture| {
        let from = texture.from;
        (
            format!("texture.{name}"),
            format!(
                "segment {}, drawn: specific force from {:.1} Hz, angular velocity from {:.1} Hz on",
                texture.segment.name(),
                from.acceleration_hz,
                from.angular_velocity_hz
            ),
        )
    });
    bandwidth
        .into_iter()
        .chain([trimmed])
        .chain(texture)
        .collect()
}

/// The end of a summary: the range of the placements' bandwidths, and the most that was left out.
pub fn quality_line(placements: impl Iterator<Item = Quality>) -> String {
    let (mut bandwidths, mut trimmed, mut is_drawn) = (Vec::new(), [0.0_f64; 2], false);
    for quality in placements {
        let [start, end] = quality.trimmed_s;
        bandwidths.extend(quality.bandwidth);
        is_drawn |= quality.texture.is_some();
        trimmed = [trimmed[0].max(start), trimmed[1].max(end)];
    }
    let mut line = String::new();
    if !bandwidths.is_empty() {
        let range = |value: fn(&Bandwidth) -> f64| {
            let values = || bandwidths.iter().map(value);
            let (least, most) = (
                values().fold(f64::INFINITY, f64::min),
                values().fold(0.0, f64::max),
            );
            if least.round() == most.round() {
                format!("{least:.0} Hz")
            } else {
                format!("{least:.0} to {most:.0} Hz")
            }
        };
        line += &format!(
            "; resolved up to {} (specific force) and {} (angular velocity)",
            range(|bandwidth| bandwidth.acceleration_hz),
            range(|bandwidth| bandwidth.angular_velocity_hz)
        );
    }
    if is_drawn {
        line += "; above, texture is drawn (--texture)";
    }
    if trimmed != [0.0; 2] {
        line += &format!(
            "; {:.2} s at the start and {:.2} s at the end left out as uncertain (--trim 0 keeps them)",
            trimmed[0], trimmed[1]
        );
    }
    line
}

/// An entry of a bag's metadata: how many things are unlikely of what it was made from, and which.
pub fn unlikely(oddities: impl Iterator<Item = String>) -> Option<(String, String)> {
    let oddities: Vec<String> = oddities.collect();
    let counted = format!("{}: {}", oddities.len(), oddities.join("; "));
    (!oddities.is_empty()).then(|| ("unlikely".to_owned(), counted))
}

/// The same for whoever waits at the terminal, in one line.
pub fn warn(source: &Path, oddities: &[String]) {
    if !oddities.is_empty() {
        remark!("warning: {}: {}", source.display(), oddities.join("; "));
    }
}
