//! Several recordings beside each other; the calibrations and the response that are kept.

use std::fmt::Write;

use cromosim_charts::text::{escape, significant};

use super::markup::change;
use super::text::parameters;
use crate::diagnosis::PlacementDiagnosis;

/// One row a recording: how far its gap falls, also with the device as the others show it, and what
/// is its own; nothing for one recording.
pub(super) fn write_recordings(page: &mut String, placement: &PlacementDiagnosis) {
    if placement.recordings.is_empty() {
        return;
    }
    page.push_str(
        "<h3>Recordings</h3>\n<div class=\"scroll\"><table><thead><tr><th>Recording</th><th class=\"r\">Accelerometer<br>RMSE, m/s²</th>\
         <th class=\"r\">device from<br>the others</th><th class=\"r\">Gyroscope<br>RMSE, rad/s</th><th class=\"r\">device from<br>the others</th>\
         <th>Values in this recording</th></tr></thead><tbody>\n",
    );
    for one in &placement.recordings {
        let (gap, left_out) = (&one.gap, &one.left_out);
        let _ = write!(
            page,
            "<tr><td><b>{}</b></td><td class=\"r\">{}</td><td class=\"r\">{}</td><td class=\"r\">{}</td><td class=\"r\">{}</td><td class=\"values\">",
            escape(&one.recording),
            change(gap.before.accel_rmse, gap.after.accel_rmse),
            significant(left_out.accel_rmse, 3),
            change(gap.before.gyro_rmse, gap.after.gyro_rmse),
            significant(left_out.gyro_rmse, 3)
        );
        for cause in &one.causes {
            for text in parameters(&cause.effect, &cause.parameters, &cause.standard_errors) {
                let _ = write!(page, "<div>{}: {text}</div>", escape(&cause.effect));
            }
        }
        page.push_str("</td></tr>\n");
    }
    page.push_str("</tbody></table></div>\n<p class=\"note\"><b>Device from the others</b>: what is the device's or its mount's is fitted to the other recordings alone, what is the session's own to this one.</p>\n");
}

/// The calibrations that are no causes, but are taken over.
pub(super) fn write_calibration(page: &mut String, placement: &PlacementDiagnosis) {
    if placement.calibration.is_empty() {
        return;
    }
    page.push_str("<p class=\"note\">Kept, as they lower the gap without being its cause (too small, or not to be told from what is unknown):</p>\n<ul class=\"plain note\">");
    for kept in &placement.calibration {
        for text in parameters(&kept.effect, &kept.parameters, &kept.standard_errors) {
            let _ = write!(page, "<li>{}: {text}</li>", escape(&kept.effect));
        }
    }
    page.push_str("</ul>\n");
}

/// How much of the reference's motion the readings hold, by frequency.
pub(super) fn write_response(page: &mut String, placement: &PlacementDiagnosis) {
    let Some(response) = &placement.reference_response else {
        return;
    };
    let rows = [
        ("Frequency, Hz", &response.hz),
        ("Accelerometer", &response.accel),
        ("Gyroscope", &response.gyro),
    ];
    page.push_str("<h3>What the readings hold of the reference's motion</h3>\n<div class=\"scroll\"><table><tbody>\n");
    for (name, values) in rows {
        let _ = write!(page, "<tr><th>{name}</th>");
        for value in values {
            let _ = write!(page, "<td class=\"r\">{}</td>", significant(*value, 3));
        }
        page.push_str("</tr>\n");
    }
    page.push_str(
        "</tbody></table></div>\n<p class=\"note\">Below 1: so much of what the reference shows there is no motion of the sensor. Above 1: the reference shows \
         less than there is. No cause is named by it; simulations with effects.yaml count on it, and so does what is left of the gap.</p>\n",
    );
}
