//! `cromosim simulate --json`: what was written, as data. Units are in the keys.

use std::path::Path;

use cromosim_recording::Quality;
use serde_json::{Value, json};

/// A file that was written.
pub struct WrittenFile<'a> {
    pub out: &'a Path,
    /// `messages` or `rows`.
    pub counted: &'static str,
    pub count: u64,
    /// The motion, recording or trajectory.
    pub source: &'a str,
    /// Placements by name, those of each person.
    pub placements: Vec<(String, Quality)>,
    /// What is unlikely of them.
    pub warnings: Vec<String>,
}

impl WrittenFile<'_> {
    /// One object.
    pub fn json(&self) -> Value {
        let placements: Vec<Value> = self.placements.iter().map(of_placement).collect();
        json!({
            "out": self.out.display().to_string(),
            self.counted: self.count,
            "source": self.source,
            "placements": placements,
            "warnings": self.warnings,
        })
    }
}

fn of_placement((name, quality): &(String, Quality)) -> Value {
    let bandwidth = quality.bandwidth;
    json!({
        "name": name,
        "specific_force_bandwidth_hz": bandwidth.map(|own| own.acceleration_hz),
        "angular_velocity_bandwidth_hz": bandwidth.map(|own| own.angular_velocity_hz),
        "trimmed_start_s": quality.trimmed_s[0],
        "trimmed_end_s": quality.trimmed_s[1],
        "has_texture": quality.texture.is_some(),
    })
}
