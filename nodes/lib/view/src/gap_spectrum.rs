//! Densities over frequency, both logarithmic, as a 2D picture: time series views know no other
//! axis than time.

use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::Color;

use crate::gap_data::GapSpectrum;
use crate::{ViewError, style};

/// Size of the picture between its axes, in the view's own units.
pub(crate) const SIZE: [f32; 2] = [460.0, 250.0];
/// Room for labels: left, top, right, bottom.
pub(crate) const MARGIN: [f32; 4] = [62.0, 54.0, 30.0, 44.0];
/// Decades that are shown below the greatest density, and below the greatest frequency.
const MOST_DECADES: [f64; 2] = [3.2, 8.0];

/// The viewer writes a label below its point, its middle about so far.
const LABEL_DROP: f32 = 15.0;

/// Logarithms of frequency and density at the picture's corners.
struct Frame {
    low: [f64; 2],
    high: [f64; 2],
}

impl Frame {
    /// Covers all lines, within the decades that are shown.
    fn for_spectrum(spectrum: &GapSpectrum) -> Option<Self> {
        let logs = |values: &mut dyn Iterator<Item = f64>| {
            values
                .filter(|value| value.is_finite() && *value > 0.0)
                .map(f64::log10)
                .fold(None, |range: Option<(f64, f64)>, value| {
                    Some(range.map_or((value, value), |(low, high)| {
                        (low.min(value), high.max(value))
                    }))
                })
        };
        let (first, last) = logs(&mut spectrum.frequencies.iter().copied())?;
        let (least, greatest) = logs(
            &mut spectrum
                .lines
                .iter()
                .flat_map(|(_, densities)| densities.iter().copied()),
        )?;
        let low = [
            first.max(last - MOST_DECADES[0]),
            (least - 0.1).max(greatest - MOST_DECADES[1]),
        ];
        Some(Self {
            low,
            high: [last.max(low[0] + 0.1), greatest + 0.2],
        })
    }

    fn place(&self, logs: [f64; 2]) -> [f32; 2] {
        let share = |axis: usize| {
            ((logs[axis] - self.low[axis]) / (self.high[axis] - self.low[axis])).clamp(0.0, 1.0)
                as f32
        };
        [share(0) * SIZE[0], (1.0 - share(1)) * SIZE[1]]
    }

    /// Whole decades inside, at most eight of them.
    fn decades(&self, axis: usize) -> Vec<i32> {
        let (first, last) = (self.low[axis].ceil() as i32, self.high[axis].floor() as i32);
        let every = ((last - first) / 8 + 1).max(1);
        (first..=last)
            .filter(|decade| decade.rem_euclid(every) == 0)
            .collect()
    }
}

/// Logs the picture below `path`; nothing where there is nothing to draw.
pub(crate) fn log_spectrum(
    stream: &RecordingStream,
    path: &EntityPath,
    spectrum: &GapSpectrum,
) -> Result<(), ViewError> {
    let Some(frame) = Frame::for_spectrum(spectrum) else {
        return Ok(());
    };
    log_axes(stream, path, &frame)?;
    let (mut strips, mut colors) = (Vec::new(), Vec::new());
    let mut legend: Vec<([f32; 2], &str, Color)> = Vec::new();
    for (number, (name, densities)) in spectrum.lines.iter().enumerate() {
        let points = spectrum
            .frequencies
            .iter()
            .zip(densities)
            .filter(|(hz, density)| **hz > 0.0 && **density > 0.0);
        let strip: Vec<[f32; 2]> = points
            .filter(|(hz, _)| hz.log10() >= frame.low[0])
            .map(|(hz, density)| frame.place([hz.log10(), density.log10()]))
            .collect();
        if strip.len() > 1 {
            strips.push(strip);
            colors.push(color_of(name));
            legend.push((
                [(number as f32 + 0.5) * SIZE[0] / 4.0, -0.6 * MARGIN[1]],
                name,
                color_of(name),
            ));
        }
    }
    let lines = LineStrips2D::new(strips)
        .with_colors(colors)
        .with_radii([0.9])
        .with_draw_order(20.0);
    stream.log_static(path.join(&"lines".into()), &lines)?;
    log_labels(stream, path.join(&"legend".into()), &legend)
}

fn color_of(name: &str) -> Color {
    style::color(match name {
        "measured" => style::MEASURED,
        "before" => style::BEFORE,
        "after" => style::AFTER,
        _ => style::PREDICTED,
    })
}

fn log_axes(stream: &RecordingStream, path: &EntityPath, frame: &Frame) -> Result<(), ViewError> {
    let [width, height] = SIZE;
    let mut grid = vec![vec![
        [0.0, 0.0],
        [0.0, height],
        [width, height],
        [width, 0.0],
        [0.0, 0.0],
    ]];
    let ink = style::color(style::PLOT_INK);
    let mut labels: Vec<([f32; 2], String, Color)> = Vec::new();
    for decade in frame.decades(0) {
        let [x, _] = frame.place([f64::from(decade), frame.low[1]]);
        grid.push(vec![[x, 0.0], [x, height]]);
        labels.push((
            [x, height + 2.0],
            format!("{} Hz", 10_f64.powi(decade)),
            ink,
        ));
    }
    for decade in frame.decades(1) {
        let [_, y] = frame.place([frame.low[0], f64::from(decade)]);
        grid.push(vec![[0.0, y], [width, y]]);
        labels.push(([-28.0, y - LABEL_DROP], format!("1e{decade}"), ink));
    }
    let lines = LineStrips2D::new(grid)
        .with_colors([style::color(style::PLOT_GRID)])
        .with_radii([0.4])
        .with_draw_order(10.0);
    stream.log_static(path.join(&"grid".into()), &lines)?;
    log_labels(stream, path.join(&"labels".into()), &labels)
}

/// Texts at points that are too small to be seen.
fn log_labels<S: AsRef<str>>(
    stream: &RecordingStream,
    path: EntityPath,
    labels: &[([f32; 2], S, Color)],
) -> Result<(), ViewError> {
    let points = Points2D::new(labels.iter().map(|(point, ..)| *point))
        .with_labels(labels.iter().map(|(_, text, _)| text.as_ref()))
        .with_colors(labels.iter().map(|(.., color)| *color))
        .with_radii([0.01])
        .with_show_labels(true)
        .with_draw_order(30.0);
    Ok(stream.log_static(path, &points)?)
}
