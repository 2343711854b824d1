//! A diagnosis as a Rerun recording.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use cromosim_gap::{Cause, Diagnosis, Evidence, PlacementDiagnosis};
use cromosim_imu::AXES;
use cromosim_view::{GapCoursePoint, GapPlacement, GapSpectrum, write_gap};

/// Writes the recording; placements without evidence have words alone.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_rrd(
    path: &Path,
    diagnosis: &Diagnosis,
    evidence: &BTreeMap<String, Evidence>,
) -> anyhow::Result<()> {
    let nothing = Evidence::default();
    let mut sorted: Vec<(&String, &PlacementDiagnosis)> = diagnosis.placements.iter().collect();
    // The viewer opens at the first one: what has a gap comes before what has none.
    sorted.sort_by_key(|(name, placement)| (placement.causes.is_empty(), *name));
    let evidence_of = |name: &String| evidence.get(name).unwrap_or(&nothing);
    let placements: Vec<GapPlacement> = sorted
        .into_iter()
        .map(|(name, placement)| gap_placement(name, placement, evidence_of(name)))
        .collect();
    Ok(write_gap(
        path,
        "diagnosis of the gap",
        &summary(diagnosis),
        &placements,
    )?)
}

fn gap_placement(name: &str, placement: &PlacementDiagnosis, evidence: &Evidence) -> GapPlacement {
    let point = |point: &cromosim_gap::CoursePoint| GapCoursePoint {
        seconds: point.seconds,
        accel: [point.accel_before, point.accel_after],
        gyro: [point.gyro_before, point.gyro_after],
    };
    GapPlacement {
        name: name.to_owned(),
        words: words(name, placement),
        stamps: evidence.stamps.clone(),
        measured: evidence.measured.clone(),
        before: evidence.before.clone(),
        after: evidence.after.clone(),
        course: evidence.course.iter().map(point).collect(),
        spectra: if evidence.spectra.frequencies.is_empty() {
            Vec::new()
        } else {
            [0, 3]
                .map(|first| spectrum(placement, evidence, first))
                .into()
        },
    }
}

/// The spectra of the axis of a channel that has the largest share of the gap.
fn spectrum(placement: &PlacementDiagnosis, evidence: &Evidence, first: usize) -> GapSpectrum {
    let share = |axis: usize| {
        placement
            .location
            .axes
            .get(AXES[axis])
            .copied()
            .unwrap_or(0.0)
    };
    let axis = (first + 1..first + 3).fold(first, |best, axis| {
        if share(axis) > share(best) {
            axis
        } else {
            best
        }
    });
    let unit = if first == 0 { "m/s²" } else { "rad/s" };
    let of = |name: &str, values: &[[f64; 6]]| {
        (
            name.to_owned(),
            values.iter().map(|value| value[axis]).collect(),
        )
    };
    let spectra = &evidence.spectra;
    GapSpectrum {
        title: format!(
            "spectra of {}: measured, residuals, predicted noise, ({unit})²/Hz",
            AXES[axis]
        ),
        frequencies: spectra.frequencies.clone(),
        lines: vec![
            of("measured", &spectra.measured),
            of("predicted", &spectra.predicted),
            of("before", &spectra.residual_before),
            of("after", &spectra.residual_after),
        ],
    }
}

fn summary(diagnosis: &Diagnosis) -> String {
    let mut text = "# Diagnosis of the gap\n\n".to_owned();
    text += "| placement | verdict | accel RMSE, m/s² | gyro RMSE, rad/s |\n|---|---|---|---|\n";
    for (name, placement) in &diagnosis.placements {
        let (before, after) = (&placement.gap.before, &placement.gap.after);
        let (accel, gyro) = (
            change(before.accel_rmse, after.accel_rmse),
            change(before.gyro_rmse, after.gyro_rmse),
        );
        let _ = writeln!(
            text,
            "| **{}** | {} | {accel} | {gyro} |",
            cell(name),
            cell(&placement.verdict)
        );
    }
    text + "\nEach placement has a tab. Curves: measured grey, simulated before orange, with all named causes blue.\n"
}

fn words(name: &str, placement: &PlacementDiagnosis) -> String {
    let mut text = format!("# {}\n\n{}\n\n", cell(name), placement.verdict);
    let (before, after) = (&placement.gap.before, &placement.gap.after);
    let _ = writeln!(
        text,
        "Accelerometer RMSE {} m/s², gyroscope RMSE {} rad/s.\n",
        change(before.accel_rmse, after.accel_rmse),
        change(before.gyro_rmse, after.gyro_rmse)
    );
    if placement.causes.is_empty() {
        text += "No causes: nothing is there beyond the noise.\n";
    } else {
        text += "| cause | share | probability | parameters |\n|---|---|---|---|\n";
        for cause in &placement.causes {
            let (share, probability) = (100.0 * cause.gap_share, 100.0 * cause.probability);
            let _ = writeln!(
                text,
                "| **{}** | {share:.0} % | {probability:.0} % | {} |",
                cell(&cause.effect),
                cell(&parameters(cause))
            );
        }
        let _ = writeln!(
            text,
            "| unexplained | {:.0} % | | |",
            100.0 * placement.unexplained.share
        );
    }
    if !placement.unidentifiable.is_empty() {
        text += "\n**What this motion cannot tell**\n\n";
        for entry in &placement.unidentifiable {
            let _ = writeln!(text, "- {}: {}", entry.effect, entry.would_tell);
        }
    }
    text
}

fn parameters(cause: &Cause) -> String {
    let one = |(name, value): (&String, &serde_json::Value)| format!("{name} {}", rounded(value));
    cause
        .parameters
        .iter()
        .map(one)
        .collect::<Vec<_>>()
        .join("; ")
}

fn rounded(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Array(items) => format!(
            "[{}]",
            items.iter().map(rounded).collect::<Vec<_>>().join(", ")
        ),
        serde_json::Value::Number(number) => {
            number.as_f64().map_or_else(|| number.to_string(), short)
        }
        serde_json::Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

/// Four significant digits; absolute times to the millisecond.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let places = (3 - value.abs().log10().floor() as i32).clamp(0, 9);
    let text = format!(
        "{value:.*}",
        if value.abs() > 1e7 {
            3
        } else {
            places as usize
        }
    );
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

fn change(before: f64, after: f64) -> String {
    format!("{} → {}", rmse(before), rmse(after))
}

fn rmse(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.*}", if value.abs() < 0.1 { 4 } else { 2 })
    } else {
        "–".to_owned()
    }
}

/// Text that cannot end a table's cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
