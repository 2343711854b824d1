//! The ranked causes as a table.

use std::fmt::Write;

use cromosim_charts::text::{escape, percent};

use super::markup::{bar, change};
use super::text::{parameters, spec, summary};
use crate::diagnosis::{Cause, Metrics, PlacementDiagnosis};

/// One row a cause, the largest share first.
pub(super) fn write_causes(page: &mut String, placement: &PlacementDiagnosis) {
    if placement.causes.is_empty() {
        page.push_str("<p>None: nothing is there beyond the declared noise and the reference's own error.</p>\n");
        return;
    }
    page.push_str(
        "<div class=\"scroll\"><table><thead><tr><th style=\"width:31%\">Effect</th><th style=\"width:27%\">Parameters</th><th class=\"r\">Probability</th><th>Share of the gap</th>\
         <th class=\"r\">Accelerometer<br>RMSE, m/s²</th><th class=\"r\">Gyroscope<br>RMSE, rad/s</th></tr></thead><tbody>\n",
    );
    let mut before = placement.gap.before;
    for cause in &placement.causes {
        write_cause(page, cause, &before);
        before = cause.after;
    }
    let rest = placement.unexplained.share;
    let _ = writeln!(
        page,
        "<tr><td class=\"soft\">unexplained</td><td></td><td></td><td>{}{}</td><td></td><td></td></tr></tbody></table></div>",
        percent(rest),
        bar(rest)
    );
}

fn write_cause(page: &mut String, cause: &Cause, before: &Metrics) {
    let _ = write!(
        page,
        "<tr><td><span class=\"effect\">{}</span>",
        escape(&cause.effect)
    );
    let what = summary(&cause.effect);
    if !what.is_empty() {
        let _ = write!(page, "<div class=\"what\">{}</div>", escape(what));
    }
    if let Some(spec) = spec(&cause.effect).filter(|spec| !spec.remedy.is_empty()) {
        let _ = write!(
            page,
            "<div class=\"what\"><b>Remedy:</b> {}</div>",
            escape(spec.remedy)
        );
    }
    page.push_str("</td><td class=\"values\">");
    for text in parameters(&cause.effect, &cause.parameters, &cause.standard_errors) {
        let _ = write!(page, "<div>{text}</div>");
    }
    let _ = writeln!(
        page,
        "</td><td class=\"r\">{}</td><td>{}{}</td><td class=\"r\">{}</td><td class=\"r\">{}</td></tr>",
        percent(cause.probability),
        percent(cause.gap_share),
        bar(cause.gap_share),
        change(before.accel_rmse, cause.after.accel_rmse),
        change(before.gyro_rmse, cause.after.gyro_rmse)
    );
}
