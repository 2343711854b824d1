//! The page: its frame, the summary at the top, one section a placement.

use std::collections::BTreeMap;
use std::fmt::Write;

use cromosim_charts::text::{escape, percent, significant, trimmed};
use cromosim_charts::{document, write_panels};

use super::figures::{self, Window};
use super::markup::change;
use super::state::State;
use super::{causes, location, magnetometer, recordings};
use crate::diagnosis::{Metrics, PlacementDiagnosis, UNKNOWN};
use crate::evidence::Evidence;

/// The whole document.
pub(super) fn page(
    placements: &[(&String, &PlacementDiagnosis)],
    evidence: &BTreeMap<String, Evidence>,
    title: &str,
) -> String {
    let mut page = String::new();
    page.push_str("<p class=\"soft\">Where simulated and real IMUs differ, which effect causes it, and how far the gap shrinks once that effect is added.</p>\n");
    write_summary(&mut page, placements);
    for (number, (name, placement)) in placements.iter().enumerate() {
        write_placement(
            &mut page,
            number,
            name,
            placement,
            evidence.get(name.as_str()),
        );
    }
    page.push_str(NOTES);
    document(title, "", &page)
}

const NOTES: &str = "<section><h3 style=\"margin-top:0\">How to read this</h3><ul class=\"plain note\">\
<li><b>RMSE</b>: root mean square of the vector residual, measured minus simulated without noise, on readings that the fit did not see.</li>\
<li><b>Before</b>: the nominal simulation, a rigid mount at the reference frame, one clock, an ideal sensor with its declared noise. <b>After</b>: with all named causes added.</li>\
<li><b>Share</b>: of the squared residual beyond the predicted noise. Causes and the unexplained rest add up to 100 %.</li>\
<li><b>Probability</b>: that the cause is there. Of causes named with 90 %, nine in ten should be right.</li>\
<li><b>±</b>: one standard error. Values within two of them from zero are dimmed.</li></ul></section>\n";

fn write_summary(page: &mut String, placements: &[(&String, &PlacementDiagnosis)]) {
    page.push_str(
        "<section><div class=\"scroll\"><table><thead><tr><th>Placement</th><th>State</th><th style=\"width:44%\">Verdict</th><th class=\"r\">Accelerometer<br>RMSE, m/s²</th>\
         <th class=\"r\">Gyroscope<br>RMSE, rad/s</th></tr></thead><tbody>\n",
    );
    for (number, (name, placement)) in placements.iter().enumerate() {
        let (state, gap) = (State::new(placement), &placement.gap);
        let _ = writeln!(
            page,
            "<tr><td><a href=\"#placement-{number}\"><b>{}</b></a></td><td><span class=\"state {}\">{}</span></td><td>{}</td><td class=\"r\">{}</td><td class=\"r\">{}</td></tr>",
            escape(name),
            state.class(),
            state.words(),
            escape(&placement.verdict),
            change(gap.before.accel_rmse, gap.after.accel_rmse),
            change(gap.before.gyro_rmse, gap.after.gyro_rmse),
        );
    }
    if placements.is_empty() {
        page.push_str("<tr><td colspan=\"5\">The recording holds no placement that can be diagnosed.</td></tr>");
    }
    page.push_str("</tbody></table></div></section>\n");
}

fn write_placement(
    page: &mut String,
    number: usize,
    name: &str,
    placement: &PlacementDiagnosis,
    evidence: Option<&Evidence>,
) {
    let state = State::new(placement);
    let _ = write!(
        page,
        "<section id=\"placement-{number}\"><h2>{} <span class=\"state {}\">{}</span></h2>\n<p>{}</p>\n",
        escape(name),
        state.class(),
        state.words(),
        escape(&placement.verdict)
    );
    page.push_str("<h3>Causes</h3>\n");
    causes::write_causes(page, placement);
    recordings::write_calibration(page, placement);
    recordings::write_response(page, placement);
    recordings::write_recordings(page, placement);
    if let Some(evidence) = evidence.filter(|evidence| !evidence.stamps.is_empty()) {
        let window = figures::worst_window(evidence);
        write_curves(page, evidence, window);
        write_course(page, evidence, window);
        write_spectra(page, evidence, placement);
        write_dependences(page, evidence);
    } else {
        page.push_str("<p class=\"note\">No curves are at hand for this placement.</p>\n");
    }
    write_magnetic(page, placement, evidence);
    page.push_str("<h3>Where the gap of the nominal simulation lies</h3>\n");
    location::write_location(page, &placement.location);
    write_rest(page, placement);
    write_unidentifiable(page, placement);
    write_metrics(page, &placement.gap.before, &placement.gap.after);
    page.push_str("</section>\n");
}

fn legend(page: &mut String, entries: &[(&str, &str)]) {
    page.push_str("<ul class=\"legend\">");
    for (class, words) in entries {
        let style = match *class {
            "predicted" => "<i class=\"dashed\" style=\"color:var(--predicted)\"></i>".to_owned(),
            "level" => "<i class=\"dashed\" style=\"color:var(--soft)\"></i>".to_owned(),
            "window" => "<i class=\"box\" style=\"background:var(--shade)\"></i>".to_owned(),
            "left-out" => "<i class=\"box\" style=\"background:var(--left-out)\"></i>".to_owned(),
            class => format!("<i style=\"color:var(--{class})\"></i>"),
        };
        let _ = write!(page, "<li>{style}{words}</li>");
    }
    page.push_str("</ul>\n");
}

fn write_curves(page: &mut String, evidence: &Evidence, window: Window) {
    let _ = writeln!(
        page,
        "<h3>Curves of the worst {} seconds{}</h3>",
        trimmed(window.to - window.from, 2),
        match evidence.recording.as_str() {
            "" => String::new(),
            recording => format!(", {}", escape(recording)),
        }
    );
    let mut entries = vec![
        ("measured", "measured"),
        ("before", "simulated before"),
        ("after", "simulated after"),
    ];
    let panels = figures::curves(evidence, window);
    if panels.iter().any(|panel| !panel.shades.is_empty()) {
        entries.push((
            "left-out",
            "not compared: no reference, or repeated or clipped values",
        ));
    }
    legend(page, &entries);
    write_panels(page, &panels);
}

fn write_course(page: &mut String, evidence: &Evidence, window: Window) {
    let panels = figures::course(evidence, window);
    if panels.is_empty() {
        return;
    }
    page.push_str("<h3>Residual over time</h3>\n");
    legend(
        page,
        &[
            ("before", "before"),
            ("after", "after"),
            ("level", "1: noise alone"),
            ("window", "the seconds shown above"),
        ],
    );
    write_panels(page, &panels);
}

fn write_spectra(page: &mut String, evidence: &Evidence, placement: &PlacementDiagnosis) {
    let panels = figures::spectra(evidence, placement);
    if panels.is_empty() {
        return;
    }
    page.push_str("<h3>Spectra</h3>\n");
    let entries = [
        ("measured", "measured"),
        ("before", "residual before"),
        ("after", "residual after"),
        ("predicted", "predicted: noise, reference's error"),
    ];
    legend(page, &entries);
    write_panels(page, &panels);
}

fn write_dependences(page: &mut String, evidence: &Evidence) {
    let panels = figures::dependences(evidence);
    if panels.is_empty() {
        return;
    }
    page.push_str("<h3>What the unknown part depends on</h3>\n");
    let entries = [
        ("measured", "readings"),
        ("after", "mean, or slope, of each sixteenth of them"),
    ];
    legend(page, &entries);
    write_panels(page, &panels);
    page.push_str("<p class=\"note\">Residual after all named causes. Shares: what a regression predicts on held-out time; they overlap and do not add up.</p>\n");
}

fn write_magnetic(page: &mut String, placement: &PlacementDiagnosis, evidence: Option<&Evidence>) {
    magnetometer::write_magnetometer(page, placement.magnetometer.as_ref());
    let panels = evidence.map(|evidence| magnetometer::residuals(&evidence.magnetic));
    let Some(panels) = panels.filter(|panels| !panels.is_empty()) else {
        return;
    };
    legend(page, &[("before", "before"), ("after", "after")]);
    write_panels(page, &panels);
}

fn write_rest(page: &mut String, placement: &PlacementDiagnosis) {
    let rest = &placement.unexplained;
    let unknown: f64 = placement
        .causes
        .iter()
        .filter(|cause| cause.effect == UNKNOWN)
        .map(|cause| cause.gap_share)
        .sum();
    let verdict = if rest.significant {
        "and holds structure that no named effect explains"
    } else {
        "and looks like noise"
    };
    let _ = writeln!(
        page,
        "<h3>What is left</h3>\n<p>{} of the gap stays unexplained, {verdict}.</p>",
        percent(rest.share + unknown)
    );
    if rest.significant {
        location::write_location(page, &rest.location);
    }
}

fn write_unidentifiable(page: &mut String, placement: &PlacementDiagnosis) {
    if placement.unidentifiable.is_empty() {
        return;
    }
    page.push_str("<h3>What this motion cannot tell</h3>\n<table><thead><tr><th>Effect</th><th>What would tell</th></tr></thead><tbody>\n");
    for entry in &placement.unidentifiable {
        let (effect, would_tell) = (escape(&entry.effect), escape(&entry.would_tell));
        let _ = writeln!(
            page,
            "<tr><td><span class=\"effect\">{effect}</span></td><td>{would_tell}</td></tr>"
        );
    }
    page.push_str("</tbody></table>\n");
}

fn write_metrics(page: &mut String, before: &Metrics, after: &Metrics) {
    let rows: [(&str, &str, f64, f64); 7] = [
        (
            "Accelerometer RMSE",
            "m/s²",
            before.accel_rmse,
            after.accel_rmse,
        ),
        ("Gyroscope RMSE", "rad/s", before.gyro_rmse, after.gyro_rmse),
        (
            "Accelerometer log-spectral distance",
            "dB",
            before.accel_log_spectral_distance_db,
            after.accel_log_spectral_distance_db,
        ),
        (
            "Gyroscope log-spectral distance",
            "dB",
            before.gyro_log_spectral_distance_db,
            after.gyro_log_spectral_distance_db,
        ),
        (
            "Accelerometer Wasserstein-1 distance",
            "m/s²",
            before.accel_wasserstein,
            after.accel_wasserstein,
        ),
        (
            "Gyroscope Wasserstein-1 distance",
            "rad/s",
            before.gyro_wasserstein,
            after.gyro_wasserstein,
        ),
        (
            "Negative log-likelihood",
            "nats per sample",
            before.nll_per_sample,
            after.nll_per_sample,
        ),
    ];
    page.push_str(
        "<details><summary>All measures of the gap</summary><table><thead><tr><th>Measure</th><th>Unit</th><th class=\"r\">Before</th>\
         <th class=\"r\">After</th></tr></thead><tbody>\n",
    );
    for (name, unit, before, after) in rows {
        let (before, after) = (significant(before, 4), significant(after, 4));
        let _ = writeln!(
            page,
            "<tr><td>{name}</td><td>{unit}</td><td class=\"r\">{before}</td><td class=\"r\">{after}</td></tr>"
        );
    }
    page.push_str("</tbody></table></details>\n");
}
