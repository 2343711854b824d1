//! Points with intervals, joined by lines.

use std::fmt::Write;

use crate::frame::{Frame, LABEL, Level, Parts, Sample, colour, line_class, mark, whisker};
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
/// A line of more points has no marks, and a band for its intervals.
const MARKS: usize = 30;

/// A measured point, with its interval where there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis; one that is not finite interrupts the line.
    pub y: f64,
    /// Both ends of its interval, in the unit of y (not distances from it). Those of a line of many
    /// points are drawn as a band.
    pub interval: Option<(f64, f64)>,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// In the legend.
    pub label: String,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
    /// Whether it is what the others are to be like: broad and grey, behind them, without marks.
    pub is_reference: bool,
}

impl Line {
    fn sample(&self) -> Sample {
        match self.points.len() {
            _ if self.is_reference => Sample::Reference,
            0..=MARKS => Sample::Line,
            _ => Sample::Curve,
        }
    }
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
    /// Whether the axis at the left is logarithmic; values at 0 and below are not drawn then.
    pub logarithmic_y: bool,
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
            &|number| self.lines[number].sample(),
        );
        let scale = Scale { frame: &frame, x };
        scale.write_axis(&mut svg, &xs, &self.x_label);
        frame.write_level(&mut svg, self.level.as_ref());
        let has_whiskers = |(_, line): (usize, Vec<Point>)| {
            line.len() <= MARKS && line.iter().any(|point| point.interval.is_some())
        };
        let spread = self.drawn().any(has_whiskers);
        for (number, line) in self.drawn() {
            scale.write_band(&mut svg, number, &line);
        }
        let (behind, before): (Vec<_>, Vec<_>) = self
            .drawn()
            .partition(|(number, _)| self.lines[*number].is_reference);
        for (number, line) in behind.into_iter().chain(before) {
            let beside = self.lines.iter().filter(|line| !line.is_reference).count();
            let half = (beside as f64 - 1.0) / 2.0;
            // What the others are to be like stands where it is.
            let is_moved = spread && !self.lines[number].is_reference;
            let aside = if is_moved && half > 0.0 {
                (APART * half).min(ASIDE) * (number as f64 / half - 1.0)
            } else {
                0.0
            };
            let sample = self.lines[number].sample();
            scale.write_line(&mut svg, (number, sample), &line, aside);
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
            y: if self.logarithmic_y {
                Axis::logarithmic(ends, DECADES)
            } else {
                Axis::linear(ends.chain(self.level.as_ref().map(|level| level.value)))
            },
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

    /// The intervals of a line of many points, from one to the next that has none.
    fn write_band(&self, svg: &mut String, number: usize, points: &[Point]) {
        if points.len() <= MARKS {
            return;
        }
        let ends = |point: &Point| {
            let (one, other) = point.interval?;
            let (one, other) = (self.frame.y_at(one)?, self.frame.y_at(other)?);
            Some((self.x_at(point.x)?, one, other))
        };
        let ends: Vec<_> = points.iter().map(ends).collect();
        let mut path = String::new();
        for run in ends.split(Option::is_none) {
            let there = run.iter().flatten().map(|(x, one, _)| (x, one));
            let back = run.iter().rev().flatten().map(|(x, _, other)| (x, other));
            for (index, (x, y)) in there.chain(back).enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { "M" } else { "L" });
            }
            path.push_str(if run.is_empty() { "" } else { "Z" });
        }
        if !path.is_empty() {
            let class = colour(number);
            let _ = write!(svg, "<path class=\"band {class}\" d=\"{path}\"/>");
        }
    }

    fn write_line(
        &self,
        svg: &mut String,
        (number, sample): (usize, Sample),
        points: &[Point],
        aside: f64,
    ) {
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
            if sample == Sample::Line {
                marks.push_str(&mark(number, x, y));
            }
            spreads.extend(
                point
                    .interval
                    .filter(|_| points.len() <= MARKS)
                    .and_then(|interval| whisker(self.frame, x, interval, 3.5))
                    .map(|(path, ..)| path),
            );
        }
        let _ = write!(svg, "<g class=\"{}\">", line_class(number, sample));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn line(label: &str, y: f64, is_reference: bool, interval: fn(usize) -> Option<f64>) -> Line {
        let point = |k| Point {
            x: k as f64,
            y,
            interval: interval(k).map(|half| (y - half, y + half)),
        };
        Line {
            label: label.to_owned(),
            points: (0..MARKS + 20).map(point).collect(),
            is_reference,
        }
    }

    #[test]
    fn many_intervals_are_a_band_and_a_reference_lies_behind() {
        let chart = LineChart {
            title: "Jump".to_owned(),
            x_label: "time, s".to_owned(),
            y_label: "m/s²".to_owned(),
            logarithmic_x: false,
            logarithmic_y: false,
            lines: vec![
                line("estimate", 3.0, false, |k| (k != 20).then_some(0.5)),
                line("truth", 2.0, true, |_| None),
            ],
            level: None,
        };
        let svg = chart.svg();
        assert!(!svg.contains("class=\"spread\"") && !svg.contains("class=\"mark\""));
        let band = svg.split("class=\"band c0\" d=\"").nth(1);
        let band = band.and_then(|rest| rest.split('"').next()).unwrap_or("");
        assert_eq!(
            (band.matches('M').count(), band.matches('Z').count()),
            (2, 2),
            "interrupted where there is no interval: {band}"
        );
        // The last of each is the line; the first stands in the legend.
        let place = |class: &str| svg.rfind(&format!("<g class=\"{class}\">"));
        assert!(place("reference").is_some() && place("reference") < place("c0"));
    }

    #[test]
    fn both_axes_may_be_logarithmic_and_a_reference_is_not_moved_aside() {
        let of = |label: &str, factor: f64, is_reference: bool| Line {
            label: label.to_owned(),
            points: [0.1, 1.0, 10.0, 100.0]
                .map(|x: f64| Point {
                    x,
                    y: factor / x.sqrt(),
                    interval: (!is_reference).then_some((0.9 * factor / x.sqrt(), 1.1)),
                })
                .to_vec(),
            is_reference,
        };
        let mut chart = LineChart {
            title: "Allan deviation".to_owned(),
            x_label: "s".to_owned(),
            y_label: "m/s²".to_owned(),
            logarithmic_x: true,
            logarithmic_y: true,
            lines: vec![
                of("x", 1.0, false),
                of("y", 1.0, false),
                of("fit", 1.0, true),
            ],
            level: None,
        };
        let svg = crate::standalone(&chart.svg());
        assert!(roxmltree::Document::parse(&svg).is_ok() && svg.contains("<style>"));
        let path = |svg: &str, class: &str| -> Vec<(f64, f64)> {
            let group = svg.rsplit(&format!("<g class=\"{class}\">")).next();
            let group = group.and_then(|it| it.split("</g>").next()).unwrap_or("");
            let path = group.split("class=\"stroke\" d=\"M").nth(1);
            let path = path.and_then(|it| it.split('"').next()).unwrap_or("");
            let point = |it: &str| {
                let (x, y) = it.split_once(' ')?;
                Some((x.parse().ok()?, y.parse().ok()?))
            };
            path.split('L').filter_map(point).collect()
        };
        // A power law is a straight line.
        let line = path(&svg, "reference");
        let rises: Vec<f64> = line.windows(2).map(|it| it[1].1 - it[0].1).collect();
        assert_eq!(rises.len(), 3, "{line:?}");
        assert!(
            rises.iter().all(|rise| (rise - rises[0]).abs() < 0.2),
            "{rises:?}"
        );
        let [x, y] = [path(&svg, "c0"), path(&svg, "c1")];
        assert!(
            (0.5 * (x[1].0 + y[1].0) - line[1].0).abs() < 0.2,
            "{x:?} {line:?}"
        );
        chart.logarithmic_y = false;
        let line = path(&chart.svg(), "reference");
        assert!(
            line[1].1 - line[0].1 > 2.0 * (line[2].1 - line[1].1),
            "{line:?}"
        );
    }
}
