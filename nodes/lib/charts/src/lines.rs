//! Points with intervals, joined by lines.

use std::fmt::Write;

use crate::frame::{Frame, LABEL, Level, Parts, Sample, colour, mark, whisker};
use crate::text::{escape, trimmed, width};
use crate::{Axis, Tick};

/// Width of the picture; lengths are in its own units, in which letters are 11.5 high.
const WIDTH: f64 = 560.0;
/// Height of the part where the lines run.
const PLOT: f64 = 240.0;
/// Room below it for the numbers and the label of the axis.
const BELOW: f64 = 38.0;
/// Most decades of a logarithmic axis.
const DECADES: f64 = 9.0;
/// Where the points of all lines stand at so few places, the axis is marked there.
const FEW: usize = 8;
/// Distance of the intervals of several lines at one place, which stand side by side.
const APART: f64 = 3.0;
/// How far from their place they stand at most.
const ASIDE: f64 = 6.0;
/// A line of more points has no marks.
const MARKS: usize = 30;

/// A measured point, with its interval where there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis; one that is not finite interrupts the line.
    pub y: f64,
    /// Both ends of its interval, in the unit of y (not distances from it).
    pub interval: Option<(f64, f64)>,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// In the legend.
    pub label: String,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
}

/// Lines over one axis, as a learning curve. Where there are intervals, the lines are moved aside
/// by a few units, so that the intervals of one place do not cover each other.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// Above all.
    pub title: String,
    /// Below, with its unit.
    pub x_label: String,
    /// At the left, with its unit.
    pub y_label: String,
    /// Whether the lower axis is logarithmic; points at 0 and below are left out then.
    pub logarithmic_x: bool,
    /// In the order of the legend.
    pub lines: Vec<Line>,
    /// A dashed line across.
    pub level: Option<Level>,
}

impl LineChart {
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
        WIDTH
    }

    /// The picture as an `svg` element.
    pub fn svg(&self) -> String {
        let series: Vec<String> = self.lines.iter().map(|line| line.label.clone()).collect();
        let points: Vec<Point> = self.drawn().flat_map(|(_, line)| line).collect();
        let frame = self.frame(&series, &points);
        let xs: Vec<f64> = points.iter().map(|point| point.x).collect();
        let x = if self.logarithmic_x {
            Axis::logarithmic(xs.iter().copied(), DECADES)
        } else {
            Axis::linear(xs.iter().copied())
        };
        let described = format!(
            "{}: {} over {}; {}",
            self.title,
            self.y_label,
            self.x_label,
            series.join(", ")
        );
        let mut svg = frame.open(
            frame.bottom() + BELOW,
            &described,
            &self.y_label,
            Sample::Line,
        );
        let scale = Scale { frame: &frame, x };
        scale.write_axis(&mut svg, &xs, &self.x_label);
        frame.write_level(&mut svg, self.level.as_ref());
        let spread = points.iter().any(|point| point.interval.is_some());
        for (number, line) in self.drawn() {
            let half = (self.lines.len() as f64 - 1.0) / 2.0;
            let aside = if spread && half > 0.0 {
                (APART * half).min(ASIDE) * (number as f64 / half - 1.0)
            } else {
                0.0
            };
            scale.write_line(&mut svg, number, &line, aside);
        }
        if xs.is_empty() {
            frame.write_nothing(&mut svg);
        }
        svg.push_str("</svg>");
        svg
    }

    fn frame(&self, series: &[String], points: &[Point]) -> Frame {
        let ends = points
            .iter()
            .flat_map(|point| {
                [
                    Some(point.y),
                    point.interval.map(|ends| ends.0),
                    point.interval.map(|ends| ends.1),
                ]
            })
            .flatten();
        Frame::new(&Parts {
            title: &self.title,
            width: WIDTH,
            plot_height: PLOT,
            y: Axis::linear(ends.chain(self.level.as_ref().map(|level| level.value))),
            series,
            level: self.level.as_ref(),
            least_left: 0.0,
        })
    }

    /// Each line with those of its points that have a place; an interruption as a point that is not
    /// finite.
    fn drawn(&self) -> impl Iterator<Item = (usize, Vec<Point>)> + '_ {
        let has_place =
            |point: &Point| point.x.is_finite() && (point.x > 0.0 || !self.logarithmic_x);
        self.lines.iter().enumerate().map(move |(number, line)| {
            (
                number,
                line.points.iter().copied().filter(has_place).collect(),
            )
        })
    }
}

struct Scale<'a> {
    frame: &'a Frame,
    x: Axis,
}

impl Scale<'_> {
    fn x_at(&self, value: f64) -> Option<f64> {
        let (left, right) = (self.frame.left + 12.0, self.frame.right() - 12.0);
        self.x
            .place(value)
            .map(|place| left + place.clamp(0.0, 1.0) * (right - left))
    }

    /// The points' own places where these are few and far enough apart, else round numbers.
    fn ticks(&self, xs: &[f64]) -> Vec<Tick> {
        let mut places = xs.to_vec();
        places.sort_unstable_by(f64::total_cmp);
        places.dedup();
        let own: Vec<Tick> = places
            .iter()
            .map(|&value| Tick {
                value,
                label: trimmed(value, 4),
            })
            .collect();
        let fits = |pair: &[Tick]| {
            let apart = self
                .x_at(pair[1].value)
                .zip(self.x_at(pair[0].value))
                .map_or(0.0, |(one, other)| one - other);
            apart > (width(&pair[0].label, LABEL) + width(&pair[1].label, LABEL)) / 2.0 + 6.0
        };
        let is_few = !own.is_empty() && own.len() <= FEW && own.windows(2).all(fits);
        if is_few {
            own
        } else {
            self.x
                .ticks(((self.frame.right() - self.frame.left) / 70.0) as usize)
        }
    }

    fn write_axis(&self, svg: &mut String, xs: &[f64], label: &str) {
        let (left, right, top, bottom) = (
            self.frame.left,
            self.frame.right(),
            self.frame.top,
            self.frame.bottom(),
        );
        let (mut marks, mut grid, mut labels) = (String::new(), String::new(), String::new());
        for tick in self.ticks(xs) {
            let Some(x) = self.x_at(tick.value) else {
                continue;
            };
            let _ = write!(
                marks,
                "M{x:.1} {bottom:.1}v{}",
                if tick.label.is_empty() { 2 } else { 4 }
            );
            if !tick.label.is_empty() {
                let _ = write!(grid, "M{x:.1} {top}V{bottom:.1}");
                let _ = write!(
                    labels,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                    bottom + 16.0,
                    tick.label
                );
            }
        }
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"{grid}\"/><path class=\"axis\" d=\"{marks}M{left} {bottom:.1}H{right:.1}\"/>"
        );
        let (middle, low) = ((left + right) / 2.0, bottom + 33.0);
        let _ = write!(svg, "<g class=\"ticks\">{labels}</g>");
        let _ = write!(
            svg,
            "<text class=\"label\" x=\"{middle:.1}\" y=\"{low:.1}\" text-anchor=\"middle\">{}</text>",
            escape(label)
        );
    }

    fn write_line(&self, svg: &mut String, number: usize, points: &[Point], aside: f64) {
        let (mut path, mut spreads, mut marks) = (String::new(), String::new(), String::new());
        let mut is_open = false;
        for point in points {
            let (Some(x), Some(y)) = (
                self.x_at(point.x).map(|x| x + aside),
                self.frame.y_at(point.y),
            ) else {
                is_open = false;
                continue;
            };
            let _ = write!(path, "{}{x:.1} {y:.1}", if is_open { "L" } else { "M" });
            is_open = true;
            if points.len() <= MARKS {
                marks.push_str(&mark(number, x, y));
            }
            spreads.extend(
                point
                    .interval
                    .and_then(|interval| whisker(self.frame, x, interval, 3.5))
                    .map(|(path, ..)| path),
            );
        }
        let _ = write!(svg, "<g class=\"{}\">", colour(number));
        if !spreads.is_empty() {
            let _ = write!(svg, "<path class=\"spread\" d=\"{spreads}\"/>");
        }
        if !path.is_empty() {
            let _ = write!(svg, "<path class=\"stroke\" d=\"{path}\"/>");
        }
        if !marks.is_empty() {
            let _ = write!(svg, "<path class=\"mark\" d=\"{marks}\"/>");
        }
        svg.push_str("</g>");
    }
}
