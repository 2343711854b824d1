//! Groups of bars with intervals.

use std::fmt::Write;

use crate::Axis;
use crate::frame::{Frame, LABEL, Level, Parts, Sample, colour, whisker};
use crate::text::{decimals, escape, width, wrapped};

/// Height of the part where the bars stand.
const PLOT: f64 = 220.0;
/// A bar's wished width; less where the chart would become wider than a page.
const BAR: f64 = 30.0;
/// A group's least wished width, for its label.
const SLOT: f64 = 88.0;
/// Space between groups, in bars.
const GROUP_SPACE: f64 = 0.8;
/// Least width of a chart.
const NARROWEST: f64 = 420.0;
/// Largest width: that of a page's section.
const WIDEST: f64 = 1080.0;
/// Room that the vertical axis is taken to need.
const AXIS_ROOM: f64 = 64.0;
/// Size of the numbers on the bars.
const VALUE: f64 = 10.0;
/// Labels that do not fit below their group in so many lines lean over.
const LINES: usize = 4;

/// A bar, with its interval where there is one.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What it belongs to: bars of one series have one colour; the legend lists series in the order
    /// of their first bars.
    pub series: String,
    /// Its length; not finite for none.
    pub value: f64,
    /// Both ends of its interval, in the unit of the value (not distances from it).
    pub interval: Option<(f64, f64)>,
}

/// Bars that stand together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Below the bars.
    pub label: String,
    /// At most one of each series; a further one takes the place of the first.
    pub bars: Vec<Bar>,
}

/// Grouped bars from zero upwards or downwards, with their numbers where these fit. Each series
/// keeps its place in every group, empty where a group has no bar of it.
#[derive(Clone, Debug, PartialEq)]
pub struct BarChart {
    /// Above all.
    pub title: String,
    /// What the bars measure, with its unit.
    pub y_label: String,
    /// From left to right.
    pub groups: Vec<Group>,
    /// A dashed line across.
    pub level: Option<Level>,
}

struct Layout {
    frame: Frame,
    series: Vec<String>,
    /// Width of a group with the space around it.
    slot: f64,
    /// Width of a bar with the space after it.
    bar: f64,
    labels: Labels,
    /// Decimals of the numbers on the bars.
    decimals: usize,
}

impl BarChart {
    /// The picture as PNG, so many pixels wide, in light colours.
    ///
    /// # Errors
    /// A width that is not between 16 and 8192.
    #[cfg(feature = "png")]
    pub fn png(&self, width_px: u32) -> Result<Vec<u8>, crate::ChartsError> {
        crate::png(&self.svg(), width_px)
    }

    /// Its width in its own units, beyond which a page need not draw it.
    pub fn width(&self) -> f64 {
        size(self.groups.len(), self.series().len()).0
    }

    /// The picture as an `svg` element.
    pub fn svg(&self) -> String {
        let layout = self.layout();
        let frame = &layout.frame;
        let names: Vec<&str> = self
            .groups
            .iter()
            .map(|group| group.label.as_str())
            .collect();
        let described = format!(
            "{}: {} of {} for {}",
            self.title,
            self.y_label,
            layout.series.join(", "),
            names.join(", ")
        );
        let mut svg = frame.open(
            frame.bottom() + layout.labels.below,
            &described,
            &self.y_label,
            &|_| Sample::Box,
        );
        let mut over = String::new();
        for (index, group) in self.groups.iter().enumerate() {
            layout.write_bars(&mut svg, &mut over, index, group);
        }
        if let Some(zero) = frame.y_at(0.0) {
            let _ = write!(
                svg,
                "<path class=\"axis\" d=\"M{} {zero:.1}H{:.1}\"/>",
                frame.left,
                frame.right()
            );
        }
        frame.write_level(&mut svg, self.level.as_ref());
        svg.push_str(&over);
        layout.write_labels(&mut svg);
        if !self
            .groups
            .iter()
            .any(|group| group.bars.iter().any(|bar| bar.value.is_finite()))
        {
            frame.write_nothing(&mut svg);
        }
        svg.push_str("</svg>");
        svg
    }

    fn series(&self) -> Vec<String> {
        let mut series: Vec<String> = Vec::new();
        for bar in self.groups.iter().flat_map(|group| &group.bars) {
            if !series.contains(&bar.series) {
                series.push(bar.series.clone());
            }
        }
        series
    }

    fn layout(&self) -> Layout {
        let series = self.series();
        let (chart, slot) = size(self.groups.len(), series.len());
        let bar = (slot / (series.len() as f64 + GROUP_SPACE)).min(BAR);
        let labels = Labels::new(&self.groups, slot);
        let bars = || self.groups.iter().flat_map(|group| &group.bars);
        let ends = bars()
            .flat_map(|bar| {
                [
                    Some(bar.value),
                    bar.interval.map(|ends| ends.0),
                    bar.interval.map(|ends| ends.1),
                ]
            })
            .flatten();
        let parts = Parts {
            title: &self.title,
            width: chart,
            plot_height: PLOT,
            y: Axis::from_zero(ends.chain(self.level.as_ref().map(|level| level.value))),
            series: &series,
            level: self.level.as_ref(),
            least_left: labels.least_left,
        };
        let frame = Frame::new(&parts);
        // What the labels took at the left is missing between the bars.
        let shrunk =
            ((frame.right() - frame.left) / (slot * self.groups.len().max(1) as f64)).min(1.0);
        Layout {
            frame,
            series,
            slot: slot * shrunk,
            bar: bar * shrunk,
            labels,
            decimals: three_digits(bars().map(|bar| bar.value)),
        }
    }
}

/// The labels of the groups, and the room that they take.
struct Labels {
    /// Each whole, and in lines.
    texts: Vec<(String, Vec<String>)>,
    /// Whether they lean over, because lines do not fit below their groups.
    leaning: bool,
    /// Room below the axis.
    below: f64,
    /// Room at the left that the first one takes where it leans over.
    least_left: f64,
}

impl Labels {
    fn new(groups: &[Group], slot: f64) -> Self {
        let in_lines = |group: &Group| {
            (
                group.label.clone(),
                wrapped(&group.label, slot - 6.0, LABEL),
            )
        };
        let texts: Vec<(String, Vec<String>)> = groups.iter().map(in_lines).collect();
        let lines = || texts.iter().map(|(_, lines)| lines);
        let widest = lines()
            .flatten()
            .map(|line| width(line, LABEL))
            .fold(0.0, f64::max);
        let leaning = widest > slot || lines().any(|lines| lines.len() > LINES);
        let longest = groups
            .iter()
            .map(|group| width(&group.label, LABEL))
            .fold(0.0, f64::max);
        // At 40 degrees: 0.65 and 0.77 are its sine and cosine, rounded up.
        let (below, least_left) = match leaning {
            true => (24.0 + 0.65 * longest, 0.77 * longest - slot / 2.0 + 8.0),
            false => (
                12.0 + 14.0 * lines().map(Vec::len).max().unwrap_or(0) as f64,
                0.0,
            ),
        };
        Self {
            texts,
            leaning,
            below,
            least_left,
        }
    }
}

/// Decimals with which the greatest of the values has three digits.
fn three_digits(values: impl Iterator<Item = f64>) -> usize {
    let greatest = values
        .map(f64::abs)
        .filter(|value| value.is_finite())
        .fold(0.0, f64::max);
    if greatest > 0.0 {
        (2.0 - greatest.log10().floor()).clamp(0.0, 7.0) as usize
    } else {
        0
    }
}

/// Width of the chart and of a group with the space around it.
fn size(groups: usize, series: usize) -> (f64, f64) {
    let groups = groups.max(1) as f64;
    let slot = (BAR * (series as f64 + GROUP_SPACE)).max(SLOT);
    let wished = (AXIS_ROOM + groups * slot).clamp(NARROWEST, WIDEST);
    (wished.round(), (wished - AXIS_ROOM) / groups)
}

impl Layout {
    fn middle(&self, group: usize) -> f64 {
        let all = self.slot * self.labels.texts.len() as f64;
        (self.frame.left + self.frame.right() - all) / 2.0 + self.slot * (group as f64 + 0.5)
    }

    /// Bars into `svg`; what stands over the dashed line, intervals and numbers, into `over`.
    fn write_bars(&self, svg: &mut String, over: &mut String, index: usize, group: &Group) {
        let first = self.middle(index) - self.bar * self.series.len() as f64 / 2.0;
        for (number, series) in self.series.iter().enumerate() {
            let Some(bar) = group.bars.iter().rfind(|bar| bar.series == *series) else {
                continue;
            };
            let (Some(zero), Some(end)) = (self.frame.y_at(0.0), self.frame.y_at(bar.value)) else {
                continue;
            };
            let (x, wide) = (
                first + self.bar * number as f64,
                self.bar - 2.0_f64.min(0.2 * self.bar),
            );
            let (top, tall) = (zero.min(end), (zero - end).abs().max(0.5));
            let colour = colour(number);
            let _ = write!(
                svg,
                "<rect class=\"fill {colour}\" x=\"{x:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{tall:.1}\"><title>{}, {}: {}</title></rect>",
                escape(&group.label),
                escape(series),
                decimals(bar.value, self.decimals)
            );
            let middle = x + wide / 2.0;
            let whisker = bar.interval.and_then(|interval| {
                whisker(&self.frame, middle, interval, (0.18 * wide).min(5.0))
            });
            if let Some((path, ..)) = &whisker {
                let _ = write!(
                    over,
                    "<path class=\"halo\" d=\"{path}\"/><path class=\"whisker\" d=\"{path}\"/>"
                );
            }
            let text = decimals(bar.value, self.decimals);
            if width(&text, VALUE) <= self.bar + 1.0 {
                // Beyond the end, which is below for what is less than zero.
                let (upper, lower) = whisker.map_or((top, top + tall), |(_, upper, lower)| {
                    (upper.min(top), lower.max(top + tall))
                });
                let y = if bar.value < 0.0 {
                    lower + 11.0
                } else {
                    upper - 4.0
                };
                let _ = write!(
                    over,
                    "<text class=\"value\" x=\"{middle:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{text}</text>"
                );
            }
        }
    }

    fn write_labels(&self, svg: &mut String) {
        let bottom = self.frame.bottom();
        svg.push_str("<g class=\"groups\">");
        for (index, (label, lines)) in self.labels.texts.iter().enumerate() {
            let x = self.middle(index);
            if self.labels.leaning {
                let (y, label) = (bottom + 14.0, escape(label));
                let _ = write!(
                    svg,
                    "<text class=\"key\" transform=\"translate({x:.1} {y:.1})rotate(-40)\" text-anchor=\"end\">{label}</text>"
                );
                continue;
            }
            for (line, text) in lines.iter().enumerate() {
                let y = bottom + 16.0 + 14.0 * line as f64;
                let _ = write!(
                    svg,
                    "<text class=\"key\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{}</text>",
                    escape(text)
                );
            }
        }
        svg.push_str("</g>");
    }
}
