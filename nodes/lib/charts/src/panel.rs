//! One panel of curves as inline SVG. Colours come from the page's style sheet, so that the same
//! picture serves light and dark.

use std::fmt::Write;

use crate::Axis;
use crate::text::escape;

/// Room for labels around the curves, in the picture's own units.
const LEFT: f64 = 58.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 36.0;
/// How far a drawn line may stray from its points, in the picture's own units: less than a third of a
/// line's width.
const TOLERANCE: f64 = 0.3;

/// Class of a series whose points are drawn each by itself.
pub const POINTS: &str = "points";

/// A line of a panel, or points.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// CSS class, which gives its colour: `measured`, `before`, `after` or `predicted`; or [`POINTS`].
    pub class: &'static str,
    /// x and y; what is not finite interrupts the line.
    pub points: Vec<(f64, f64)>,
}

/// A panel of curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above the curves.
    pub title: String,
    /// In the picture's own units; letters are 11.5 high.
    pub width: f64,
    /// In the same units.
    pub height: f64,
    /// How x becomes a place.
    pub x: Axis,
    /// How y becomes a place.
    pub y: Axis,
    /// Below, with its unit.
    pub x_label: String,
    /// At the left, with its unit.
    pub y_label: String,
    /// Ranges of x that are shaded: class (`window` or `left-out`), from, to.
    pub shades: Vec<(&'static str, f64, f64)>,
    /// A dashed line across, at this y.
    pub level: Option<f64>,
    /// In the order in which they are drawn.
    pub series: Vec<Series>,
}

impl Panel {
    fn inner(&self) -> (f64, f64) {
        (self.width - LEFT - RIGHT, self.height - TOP - BOTTOM)
    }

    fn x_at(&self, value: f64) -> Option<f64> {
        self.x
            .place(value)
            .map(|place| LEFT + place.clamp(0.0, 1.0) * self.inner().0)
    }

    fn y_at(&self, value: f64) -> Option<f64> {
        self.y
            .place(value)
            .map(|place| TOP + (1.0 - place) * self.inner().1)
    }

    /// The panel as an `svg` element.
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        let (width, height, (inner_width, inner_height)) = (self.width, self.height, self.inner());
        let described = format!("{}: {} over {}", self.title, self.y_label, self.x_label);
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            escape(&described)
        );
        let _ = write!(
            svg,
            "<text class=\"title\" x=\"{LEFT}\" y=\"14\">{}</text>",
            escape(&self.title)
        );
        for (class, from, to) in &self.shades {
            let (Some(from), Some(to)) = (self.x_at(*from), self.x_at(*to)) else {
                continue;
            };
            let wide = (to - from).max(0.6);
            let _ = write!(
                svg,
                "<rect class=\"{class}\" x=\"{from:.1}\" y=\"{TOP}\" width=\"{wide:.1}\" height=\"{inner_height:.1}\"/>"
            );
        }
        self.write_axes(&mut svg);
        if let Some(y) = self
            .level
            .filter(|level| self.y.contains(*level))
            .and_then(|level| self.y_at(level))
        {
            let _ = write!(
                svg,
                "<path class=\"level\" d=\"M{LEFT} {y:.1}H{:.1}\"/>",
                LEFT + inner_width
            );
        }
        for series in &self.series {
            let path = if series.class == POINTS {
                self.dots(&series.points)
            } else {
                self.path(&series.points)
            };
            if !path.is_empty() {
                let _ = write!(svg, "<path class=\"line {}\" d=\"{path}\"/>", series.class);
            }
        }
        svg.push_str("</svg>");
        svg
    }

    fn write_axes(&self, svg: &mut String) {
        let (inner_width, inner_height) = self.inner();
        let (right, bottom) = (LEFT + inner_width, TOP + inner_height);
        let (mut grid, mut marks, mut labels) = (String::new(), String::new(), String::new());
        for tick in self.x.ticks((inner_width / 70.0) as usize) {
            let Some(x) = self.x_at(tick.value) else {
                continue;
            };
            let length = if tick.label.is_empty() { 2.0 } else { 4.0 };
            let _ = write!(marks, "M{x:.1} {bottom:.1}v{length}");
            if !tick.label.is_empty() {
                let _ = write!(grid, "M{x:.1} {TOP}V{bottom:.1}");
                let _ = write!(
                    labels,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                    bottom + 15.0,
                    tick.label
                );
            }
        }
        for tick in self.y.ticks((inner_height / 24.0) as usize) {
            let Some(y) = self.y_at(tick.value) else {
                continue;
            };
            let length = if tick.label.is_empty() { 2.0 } else { 4.0 };
            let _ = write!(marks, "M{LEFT} {y:.1}h-{length}");
            if !tick.label.is_empty() {
                let _ = write!(grid, "M{LEFT} {y:.1}H{right:.1}");
                let _ = write!(
                    labels,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    LEFT - 7.0,
                    y + 3.5,
                    tick.label
                );
            }
        }
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"{grid}\"/><path class=\"axis\" d=\"{marks}M{LEFT} {TOP}V{bottom:.1}H{right:.1}\"/>"
        );
        let _ = write!(svg, "<g class=\"ticks\">{labels}</g>");
        let (middle, low) = (LEFT + inner_width / 2.0, self.height - 5.0);
        let _ = write!(
            svg,
            "<text class=\"label\" x=\"{middle:.1}\" y=\"{low:.1}\" text-anchor=\"middle\">{}</text>",
            escape(&self.x_label)
        );
        let centre = TOP + inner_height / 2.0;
        let label = escape(&self.y_label);
        let _ = write!(
            svg,
            "<text class=\"label\" transform=\"translate(12 {centre:.1})rotate(-90)\" text-anchor=\"middle\">{label}</text>"
        );
    }

    /// Lines without length, whose round ends are dots.
    fn dots(&self, points: &[(f64, f64)]) -> String {
        let mut path = String::new();
        for &(x, y) in points {
            if let (Some(x), Some(y)) = (self.x_at(x), self.y_at(y)) {
                let _ = write!(path, "M{} {}h0", short(x), short(y));
            }
        }
        path
    }

    /// The line's path, with no more points than the eye needs.
    fn path(&self, points: &[(f64, f64)]) -> String {
        let mut path = String::new();
        let mut run: Vec<(f64, f64)> = Vec::new();
        let mut flush = |run: &mut Vec<(f64, f64)>| {
            for (index, (x, y)) in simplified(&thinned(run)).into_iter().enumerate() {
                let _ = write!(
                    path,
                    "{}{} {}",
                    if index == 0 { "M" } else { "L" },
                    short(x),
                    short(y)
                );
            }
            run.clear();
        };
        for &(x, y) in points {
            match (
                self.x_at(x)
                    .filter(|_| self.x.contains(x) || self.x.is_logarithmic()),
                self.y_at(y),
            ) {
                (Some(x), Some(y)) => run.push((x, y)),
                _ => flush(&mut run),
            }
        }
        flush(&mut run);
        path
    }
}

/// One decimal, without a zero.
fn short(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0")
        .map_or_else(|| text.clone(), str::to_owned)
}

/// At most the first, least, greatest and last point of each 1.5 units of width.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    const COLUMN: f64 = 1.5;
    let mut kept = Vec::with_capacity(points.len());
    for column in
        points.chunk_by(|one, other| (one.0 / COLUMN).floor() == (other.0 / COLUMN).floor())
    {
        if column.len() <= 4 {
            kept.extend_from_slice(column);
            continue;
        }
        let index_of = |better: fn(f64, f64) -> bool| {
            (0..column.len())
                .reduce(|best, index| {
                    if better(column[index].1, column[best].1) {
                        index
                    } else {
                        best
                    }
                })
                .unwrap_or(0)
        };
        let mut indices = [
            0,
            index_of(|one, other| one < other),
            index_of(|one, other| one > other),
            column.len() - 1,
        ];
        indices.sort_unstable();
        let mut last = usize::MAX;
        for index in indices {
            if index != last {
                kept.push(column[index]);
            }
            last = index;
        }
    }
    kept
}

/// Ramer, Douglas and Peucker (1972), without recursion.
fn simplified(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    (keep[0], keep[points.len() - 1]) = (true, true);
    let mut stack = vec![(0, points.len() - 1)];
    while let Some((from, to)) = stack.pop() {
        let ((x0, y0), (x1, y1)) = (points[from], points[to]);
        let length = (x1 - x0).hypot(y1 - y0);
        let distance = |index: usize| {
            let (x, y) = points[index];
            if length > 0.0 {
                ((x1 - x0) * (y0 - y) - (x0 - x) * (y1 - y0)).abs() / length
            } else {
                (x - x0).hypot(y - y0)
            }
        };
        let farthest =
            (from + 1..to).max_by(|&one, &other| distance(one).total_cmp(&distance(other)));
        if let Some(index) = farthest.filter(|&index| distance(index) > TOLERANCE) {
            keep[index] = true;
            stack.extend([(from, index), (index, to)]);
        }
    }
    points
        .iter()
        .zip(keep)
        .filter(|(_, keep)| *keep)
        .map(|(point, _)| *point)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_say_the_same() {
        let line: Vec<(f64, f64)> = (0..1000)
            .map(|k| (0.4 * f64::from(k), 50.0 + 0.1 * f64::from(k)))
            .collect();
        assert_eq!(simplified(&line).len(), 2);
        let wave: Vec<(f64, f64)> = (0..5000)
            .map(|k| {
                (
                    0.08 * f64::from(k),
                    50.0 + 40.0 * (0.01 * f64::from(k)).sin(),
                )
            })
            .collect();
        let drawn = simplified(&thinned(&wave));
        assert!(drawn.len() < 250, "{}", drawn.len());
        for (x, y) in &drawn {
            assert!((y - 50.0 - 40.0 * (x / 8.0).sin()).abs() < 1e-9);
        }
        let spike: Vec<(f64, f64)> = (0..1000)
            .map(|k| (0.1 * f64::from(k), if k == 517 { 90.0 } else { 10.0 }))
            .collect();
        assert!(
            thinned(&spike).iter().any(|(_, y)| *y == 90.0),
            "a spike is not thinned out"
        );
    }
}
