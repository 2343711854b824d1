//! What all charts have: title, legend, vertical axis, room for labels.

use std::fmt::Write;

use crate::Axis;
use crate::text::{escape, width, wrapped};

/// Sizes of letters in the picture's own units, as in the style sheet.
pub(crate) const TITLE: f64 = 12.5;
pub(crate) const LABEL: f64 = 11.5;
/// Colours before they come again, paler.
const COLOURS: usize = 8;
/// Between the axis and what is written beside it.
const GAP: f64 = 7.0;
const RIGHT: f64 = 12.0;
/// Width of an entry's sample in the legend, with the space after it.
const SAMPLE: f64 = 22.0;

/// A dashed line across a chart with a name in its legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Where it stands, in the unit of the vertical axis.
    pub value: f64,
    /// What it means.
    pub label: String,
}

/// The classes of a series' colour.
pub(crate) fn colour(series: usize) -> String {
    format!(
        "c{}{}",
        series % COLOURS,
        if series < COLOURS { "" } else { " pale" }
    )
}

/// The classes of a line's colour and width.
pub(crate) fn line_class(series: usize, sample: Sample) -> String {
    match sample {
        Sample::Reference => "reference".to_owned(),
        _ => colour(series),
    }
}

/// How a series is shown in the legend.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Sample {
    Box,
    /// With its mark.
    Line,
    /// Of so many points that it has no marks.
    Curve,
    /// What the others are to be like.
    Reference,
}

/// The four corners of a chart and how values become places in it.
pub(crate) struct Frame {
    pub width: f64,
    pub left: f64,
    pub top: f64,
    pub plot_height: f64,
    title: Vec<String>,
    legend: Vec<Vec<(f64, Entry)>>,
    y: Axis,
    /// Of the numbers at the vertical axis.
    widest: f64,
}

#[derive(Clone)]
struct Entry {
    /// None for the level.
    series: Option<usize>,
    label: String,
}

/// What a frame is made of.
pub(crate) struct Parts<'a> {
    pub title: &'a str,
    pub width: f64,
    pub plot_height: f64,
    pub y: Axis,
    pub series: &'a [String],
    pub level: Option<&'a Level>,
    /// At least this much at the left, for labels below the axis.
    pub least_left: f64,
}

impl Frame {
    pub fn new(parts: &Parts) -> Self {
        let ticks = parts.y.ticks((parts.plot_height / 28.0) as usize);
        let widest = ticks
            .iter()
            .map(|tick| width(&tick.label, LABEL))
            .fold(0.0, f64::max);
        let left = (18.0 + widest + GAP).max(parts.least_left).ceil();
        let title = wrapped(parts.title, parts.width - left - RIGHT, TITLE * 1.1);
        let legend = rows(parts, parts.width - left - RIGHT);
        let top = 8.0 + 16.0 * title.len() as f64 + 17.0 * legend.len() as f64 + 6.0;
        Self {
            width: parts.width,
            left,
            top,
            plot_height: parts.plot_height,
            title,
            legend,
            y: parts.y,
            widest,
        }
    }

    pub fn right(&self) -> f64 {
        self.width - RIGHT
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.plot_height
    }

    /// Where a value stands; none for what is not finite.
    pub fn y_at(&self, value: f64) -> Option<f64> {
        self.y
            .place(value)
            .map(|place| self.top + (1.0 - place.clamp(0.0, 1.0)) * self.plot_height)
    }

    /// The opening tag, title, legend, grid and vertical axis.
    pub fn open(
        &self,
        height: f64,
        described: &str,
        y_label: &str,
        sample: &dyn Fn(usize) -> Sample,
    ) -> String {
        let mut svg = String::new();
        let (width, described) = (self.width, escape(described));
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{described}\">"
        );
        for (index, line) in self.title.iter().enumerate() {
            let y = 15 + 16 * index;
            let _ = write!(
                svg,
                "<text class=\"title\" x=\"{}\" y=\"{y}\">{}</text>",
                self.left,
                escape(line)
            );
        }
        self.write_legend(&mut svg, sample);
        self.write_vertical(&mut svg, y_label);
        svg
    }

    fn write_legend(&self, svg: &mut String, sample: &dyn Fn(usize) -> Sample) {
        let first = 8.0 + 16.0 * self.title.len() as f64;
        for (row, entries) in self.legend.iter().enumerate() {
            let y = first + 17.0 * row as f64 + 8.5;
            for (x, entry) in entries {
                match entry.series.map(|series| (series, sample(series))) {
                    None => {
                        let _ = write!(svg, "<path class=\"threshold\" d=\"M{x:.1} {y:.1}h16\"/>");
                    }
                    Some((series, Sample::Box)) => {
                        let (colour, y) = (colour(series), y - 5.0);
                        let _ = write!(
                            svg,
                            "<rect class=\"fill {colour}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"14\" height=\"10\" rx=\"1\"/>"
                        );
                    }
                    Some((series, sample)) => {
                        let class = line_class(series, sample);
                        let _ = write!(
                            svg,
                            "<g class=\"{class}\"><path class=\"stroke\" d=\"M{x:.1} {y:.1}h16\"/>"
                        );
                        if sample == Sample::Line {
                            let mark = mark(series, x + 8.0, y);
                            let _ = write!(svg, "<path class=\"mark\" d=\"{mark}\"/>");
                        }
                        svg.push_str("</g>");
                    }
                }
                let label = escape(&entry.label);
                let _ = write!(
                    svg,
                    "<text class=\"key\" x=\"{:.1}\" y=\"{:.1}\">{label}</text>",
                    x + SAMPLE,
                    y + 4.0
                );
            }
        }
    }

    fn write_vertical(&self, svg: &mut String, y_label: &str) {
        let (left, top, right, bottom) = (self.left, self.top, self.right(), self.bottom());
        let (mut grid, mut marks, mut labels) = (String::new(), String::new(), String::new());
        for tick in self.y.ticks((self.plot_height / 28.0) as usize) {
            let Some(y) = self.y_at(tick.value) else {
                continue;
            };
            let length = if tick.label.is_empty() { 2 } else { 4 };
            let _ = write!(marks, "M{left} {y:.1}h-{length}");
            if !tick.label.is_empty() {
                let _ = write!(grid, "M{left} {y:.1}H{right:.1}");
                let _ = write!(
                    labels,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    left - GAP,
                    y + 4.0,
                    tick.label
                );
            }
        }
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"{grid}\"/><path class=\"axis\" d=\"{marks}M{left} {top}V{bottom:.1}\"/>"
        );
        let _ = write!(svg, "<g class=\"ticks\">{labels}</g>");
        let (beside, centre, label) = (
            left - GAP - self.widest - 6.0,
            top + self.plot_height / 2.0,
            escape(y_label),
        );
        let _ = write!(
            svg,
            "<text class=\"label\" transform=\"translate({beside:.1} {centre:.1})rotate(-90)\" text-anchor=\"middle\">{label}</text>"
        );
    }

    /// The dashed line, where there is one within the axis.
    pub fn write_level(&self, svg: &mut String, level: Option<&Level>) {
        let Some(y) = level
            .filter(|level| self.y.contains(level.value))
            .and_then(|level| self.y_at(level.value))
        else {
            return;
        };
        let _ = write!(
            svg,
            "<path class=\"threshold\" d=\"M{} {y:.1}H{:.1}\"/>",
            self.left,
            self.right()
        );
    }

    /// Says that there is nothing to see.
    pub fn write_nothing(&self, svg: &mut String) {
        let (x, y) = (
            (self.left + self.right()) / 2.0,
            self.top + self.plot_height / 2.0,
        );
        let _ = write!(
            svg,
            "<text class=\"none\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">no values</text>"
        );
    }
}

/// The legend in rows, each entry with its place from the left.
fn rows(parts: &Parts, room: f64) -> Vec<Vec<(f64, Entry)>> {
    let left = parts.width - RIGHT - room;
    // One series alone is named by the title.
    let named = if parts.series.len() > 1 || parts.level.is_some() {
        parts.series
    } else {
        &[]
    };
    let series = named.iter().enumerate().map(|(index, label)| Entry {
        series: Some(index),
        label: label.clone(),
    });
    let level = parts.level.map(|level| Entry {
        series: None,
        label: level.label.clone(),
    });
    let mut rows: Vec<Vec<(f64, Entry)>> = Vec::new();
    let mut x = left;
    for entry in series.chain(level) {
        let wide = SAMPLE + width(&entry.label, LABEL) + 16.0;
        if rows.is_empty() || (x + wide > left + room && x > left) {
            rows.push(Vec::new());
            x = left;
        }
        if let Some(row) = rows.last_mut() {
            row.push((x, entry));
        }
        x += wide;
    }
    rows
}

/// The mark of a series around a point, as a path: circle, square, triangle, diamond.
pub(crate) fn mark(series: usize, x: f64, y: f64) -> String {
    match series % 4 {
        0 => format!("M{:.1} {y:.1}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x - 4.0),
        1 => format!("M{:.1} {:.1}h7v7h-7z", x - 3.5, y - 3.5),
        2 => format!("M{x:.1} {:.1}l4.6 8h-9.2z", y - 5.2),
        _ => format!("M{x:.1} {:.1}l4.8 4.8l-4.8 4.8l-4.8 -4.8z", y - 4.8),
    }
}

/// An interval as an upright line with caps, and its upper and lower end; none where one is not
/// finite.
pub(crate) fn whisker(
    frame: &Frame,
    x: f64,
    interval: (f64, f64),
    cap: f64,
) -> Option<(String, f64, f64)> {
    let (one, other) = (frame.y_at(interval.0)?, frame.y_at(interval.1)?);
    let (top, bottom) = (one.min(other), one.max(other));
    let (from, wide) = (x - cap, 2.0 * cap);
    Some((
        format!(
            "M{x:.1} {top:.1}V{bottom:.1}M{from:.1} {top:.1}h{wide:.1}M{from:.1} {bottom:.1}h{wide:.1}"
        ),
        top,
        bottom,
    ))
}
