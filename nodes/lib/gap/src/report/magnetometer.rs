//! The magnetometer of a placement.

use std::fmt::Write;

use cromosim_charts::text::{escape, percent, significant};
use cromosim_charts::{Axis, Panel, Series};

use super::markup::change;
use super::text::parameters;
use crate::diagnosis::MagnetometerDiagnosis;
use crate::evidence::MagneticCurves;

/// Width and height of a panel in its own units.
const SIZE: [f64; 2] = [540.0, 160.0];
/// Microtesla, in which people think.
const MICROTESLA: f64 = 1e6;

/// What was found, in words and values; nothing without a magnetometer.
pub(super) fn write_magnetometer(page: &mut String, found: Option<&MagnetometerDiagnosis>) {
    let Some(found) = found else { return };
    // Writing into a string cannot fail.
    let _ = write!(
        page,
        "<h3>Magnetometer</h3>\n<p>{}</p>\n",
        escape(&found.verdict)
    );
    let Some(gap) = found.gap else { return };
    page.push_str("<table><thead><tr><th>Effect</th><th>Values</th><th class=\"r\">Share</th><th class=\"r\">Gain, nats</th></tr></thead><tbody>\n");
    for cause in &found.causes {
        let values = parameters(&cause.effect, &cause.parameters, &cause.standard_errors);
        let values: String = values.map(|text| format!("<div>{text}</div>")).collect();
        let (effect, share) = (escape(&cause.effect), percent(cause.gap_share));
        let gain = significant(cause.gain_nats, 3);
        let _ = writeln!(
            page,
            "<tr><td><span class=\"effect\">{effect}</span></td><td class=\"values\">{values}</td><td class=\"r\">{share}</td><td class=\"r\">{gain}</td></tr>"
        );
    }
    let _ = writeln!(
        page,
        "<tr><td>RMSE, µT</td><td></td><td></td><td class=\"r\">{}</td></tr></tbody></table>",
        change(MICROTESLA * gap.before, MICROTESLA * gap.after)
    );
    let field = found.field_in_world.unwrap_or_default();
    let field = field
        .map(|value| significant(MICROTESLA * value, 4))
        .join(", ");
    let [noise, rest] = [found.noise_density, found.beyond_noise].map(|it| MICROTESLA * it);
    let _ = writeln!(
        page,
        "<p class=\"note\">Field of the place in the reference's world, as this device measures it: {field} µT. White noise {} µT/√Hz; beyond it {} µT are left, which a field that is not the same everywhere leaves too.</p>",
        significant(noise, 3),
        significant(rest, 3)
    );
    for one in &found.unidentifiable {
        let (effect, would_tell) = (escape(&one.effect), escape(&one.would_tell));
        let _ = writeln!(
            page,
            "<p class=\"note\">This motion cannot tell <span class=\"effect\">{effect}</span>; {would_tell} would.</p>"
        );
    }
}

/// Residuals over time, an axis each; none without readings.
pub(super) fn residuals(curves: &MagneticCurves) -> Vec<Panel> {
    let Some((first, last)) = curves.stamps.first().zip(curves.stamps.last()) else {
        return Vec::new();
    };
    let line = |class, values: &[[f64; 3]], axis: usize| Series {
        class,
        points: curves
            .stamps
            .iter()
            .zip(values)
            .map(|(stamp, value)| (*stamp - *first, MICROTESLA * value[axis]))
            .collect(),
    };
    let panel = |(axis, name): (usize, &str)| {
        let series = vec![
            line("before", &curves.before, axis),
            line("after", &curves.after, axis),
        ];
        let values = series
            .iter()
            .flat_map(|one| one.points.iter().map(|point| point.1));
        Panel {
            title: format!("magnetometer {name}, residual"),
            width: SIZE[0],
            height: SIZE[1],
            x: Axis::exact(0.0, (*last - *first).max(0.01)),
            y: Axis::linear(values.collect::<Vec<_>>().into_iter()),
            x_label: "time since the first reading that is compared, s".to_owned(),
            y_label: "µT".to_owned(),
            shades: Vec::new(),
            level: Some(0.0),
            series,
        }
    };
    ["x", "y", "z"].into_iter().enumerate().map(panel).collect()
}
