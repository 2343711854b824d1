//! The pictures of one placement: curves of the worst seconds, the residual over time, spectra.

use cromosim_charts::text::percent;
use cromosim_charts::{Axis, POINTS, Panel, Series};
use cromosim_imu::AXES;
use cromosim_spatial::Stamp;

use super::text::axis_name;
use crate::dependence_curves::DependenceCurve;
use crate::diagnosis::PlacementDiagnosis;
use crate::evidence::{CoursePoint, Evidence};
use crate::period::median_period;

/// Shown of the curves, s.
const WINDOW_S: f64 = 6.0;
/// Drawn of the curves beyond that at either end, s: lines run to the edges.
const EDGE_S: f64 = 0.05;
/// An interval of more periods than this breaks a line.
const LONGEST_PERIODS: f64 = 3.0;
/// Frequencies of a drawn spectrum: more fall together.
const BINS_PER_DECADE: f64 = 45.0;
/// Width of a panel in its own units; two stand side by side.
const WIDTH: f64 = 540.0;

/// The stretch of time whose curves are shown, s since the first message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub from: f64,
    pub to: f64,
}

/// Where the whitened residual of the nominal simulation is largest; the beginning where nothing is
/// known.
pub(super) fn worst_window(evidence: &Evidence) -> Window {
    let end = evidence
        .stamps
        .last()
        .zip(evidence.stamps.first())
        .map_or(0.0, |(last, first)| *last - *first);
    let total = |from: f64| -> f64 {
        let inside = evidence
            .course
            .iter()
            .filter(|point| (from..from + WINDOW_S).contains(&point.seconds));
        inside
            .map(|point| point.accel_before + point.gyro_before)
            .filter(|value| value.is_finite())
            .sum()
    };
    let mut best = (0.0, 0.0);
    for point in &evidence.course {
        // Windows that begin half a second before a point cover whole points of the course.
        let from = (point.seconds - 0.5).clamp(0.0, (end - WINDOW_S).max(0.0));
        let value = total(from);
        if value > best.1 {
            best = (from, value);
        }
    }
    Window {
        from: best.0,
        to: (best.0 + WINDOW_S).min(end.max(0.01)),
    }
}

/// Six panels: accelerometer at the left, gyroscope at the right.
pub(super) fn curves(evidence: &Evidence, window: Window) -> Vec<Panel> {
    let Some(&first) = evidence.stamps.first() else {
        return Vec::new();
    };
    let curves = Curves::inside(evidence, first, window);
    let panel = |axis: usize| {
        let series = [
            ("measured", &evidence.measured),
            ("before", &evidence.before),
            ("after", &evidence.after),
        ]
        .map(|(class, values)| Series {
            class,
            points: curves.line(values, axis),
        });
        let values: Vec<f64> = series
            .iter()
            .flat_map(|series| series.points.iter().map(|point| point.1))
            .collect();
        Panel {
            title: axis_name(AXES[axis]),
            width: WIDTH,
            height: if axis % 3 == 2 { 166.0 } else { 154.0 },
            x: Axis::exact(window.from, window.to),
            y: Axis::linear(values.into_iter()),
            x_label: "time since the first IMU message, s".to_owned(),
            y_label: unit(axis).to_owned(),
            shades: left_out(evidence, first, window),
            level: None,
            series: series.into(),
        }
    };
    (0..3)
        .flat_map(|axis| [panel(axis), panel(axis + 3)])
        .collect()
}

/// The readings that curves are drawn through.
struct Curves {
    /// Number of each reading, and its time since the first one, s.
    readings: Vec<(usize, f64)>,
    /// A longer interval breaks a line, s.
    longest_s: f64,
}

impl Curves {
    /// The readings of a window, and some beside it, so that lines run to its edges.
    fn inside(evidence: &Evidence, first: Stamp, window: Window) -> Self {
        let readings = evidence
            .stamps
            .iter()
            .map(|stamp| *stamp - first)
            .enumerate()
            .filter(|(_, time)| (window.from - EDGE_S..=window.to + EDGE_S).contains(time))
            .collect();
        let period = median_period(evidence.stamps.iter().copied());
        Self {
            readings,
            longest_s: period.map_or(f64::INFINITY, |period| LONGEST_PERIODS * period),
        }
    }

    /// One axis of values by reading, interrupted where readings are missing.
    fn line(&self, values: &[[f64; 6]], axis: usize) -> Vec<(f64, f64)> {
        let mut points = Vec::with_capacity(self.readings.len());
        let mut last: Option<f64> = None;
        for &(index, time) in &self.readings {
            if last.is_some_and(|last| time - last > self.longest_s) {
                points.push((f64::NAN, f64::NAN));
            }
            last = Some(time);
            points.push((
                time,
                values.get(index).map_or(f64::NAN, |value| value[axis]),
            ));
        }
        points
    }
}

fn unit(axis: usize) -> &'static str {
    if axis < 3 { "m/s²" } else { "rad/s" }
}

/// Stretches that were not compared, from the first reading left out to the last.
fn left_out(evidence: &Evidence, first: Stamp, window: Window) -> Vec<(&'static str, f64, f64)> {
    let mut stretches: Vec<(&'static str, f64, f64)> = Vec::new();
    let mut open: Option<(f64, f64)> = None;
    for (stamp, used) in evidence.stamps.iter().zip(&evidence.used) {
        let time = *stamp - first;
        if time < window.from || time > window.to {
            continue;
        }
        open = match (open, used) {
            (Some((from, _)), false) => Some((from, time)),
            (None, false) => Some((time, time)),
            (Some((from, to)), true) => {
                stretches.push(("left-out", from, to));
                None
            }
            (None, true) => None,
        };
    }
    stretches.extend(open.map(|(from, to)| ("left-out", from, to)));
    stretches
}

/// What the rest that no effect explains depends on, a panel each.
pub(super) fn dependences(evidence: &Evidence) -> Vec<Panel> {
    let panel = |curve: &DependenceCurve| {
        let (x, y) = (
            middle_of(curve, 0.01, |point| point.0),
            // Readings scatter wider than their means bend.
            middle_of(curve, 0.15, |point| point.1),
        );
        let inside =
            |point: &&(f64, f64)| (x.0..=x.1).contains(&point.0) && (y.0..=y.1).contains(&point.1);
        Panel {
            title: format!(
                "{}, {} of what is left: {}",
                axis_name(&curve.axis),
                percent(curve.share),
                curve.depends_on
            ),
            width: WIDTH,
            height: 210.0,
            x: Axis::linear([x.0, x.1].into_iter()),
            y: Axis::linear([y.0, y.1].into_iter()),
            x_label: curve.x_label.clone(),
            y_label: curve.y_label.clone(),
            shades: Vec::new(),
            level: Some(0.0),
            series: vec![
                Series {
                    class: POINTS,
                    points: curve.points.iter().filter(inside).copied().collect(),
                },
                Series {
                    class: "after",
                    points: curve.means.clone(),
                },
            ],
        }
    };
    evidence.dependences.iter().map(panel).collect()
}

/// From the least to the greatest of the points, a share of them at either end left out, and of all
/// means.
fn middle_of(curve: &DependenceCurve, share: f64, of: fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let mut values: Vec<f64> = curve.points.iter().map(of).collect();
    values.sort_unstable_by(f64::total_cmp);
    let cut = (share * values.len() as f64) as usize;
    let kept = values.get(cut..values.len() - cut).unwrap_or_default();
    curve
        .means
        .iter()
        .map(of)
        .chain(kept.iter().copied())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
}

/// The whitened residual over time, one panel a channel; 1 is noise alone.
pub(super) fn course(evidence: &Evidence, window: Window) -> Vec<Panel> {
    let end = evidence
        .stamps
        .last()
        .zip(evidence.stamps.first())
        .map_or(1.0, |(last, first)| *last - *first);
    let panel = |title: &str, before: fn(&CoursePoint) -> f64, after: fn(&CoursePoint) -> f64| {
        let line = |of: fn(&CoursePoint) -> f64| {
            evidence
                .course
                .iter()
                .map(|point| (point.seconds, of(point)))
                .collect::<Vec<_>>()
        };
        let series = vec![
            Series {
                class: "before",
                points: line(before),
            },
            Series {
                class: "after",
                points: line(after),
            },
        ];
        // Room around the level of the noise even where nothing goes beyond it.
        let values = series
            .iter()
            .flat_map(|series| series.points.iter().map(|point| point.1))
            .chain([0.5, 3.0])
            .collect::<Vec<_>>();
        Panel {
            title: title.to_owned(),
            width: WIDTH,
            height: 180.0,
            x: Axis::exact(0.0, end),
            y: Axis::logarithmic(values.into_iter(), 7.0),
            x_label: "time since the first IMU message, s".to_owned(),
            y_label: "residual² / noise²".to_owned(),
            shades: vec![("window", window.from, window.to)],
            level: Some(1.0),
            series,
        }
    };
    if evidence.course.is_empty() {
        return Vec::new();
    }
    vec![
        panel(
            "accelerometer",
            |point| point.accel_before,
            |point| point.accel_after,
        ),
        panel(
            "gyroscope",
            |point| point.gyro_before,
            |point| point.gyro_after,
        ),
    ]
}

/// Densities of the worst axis of each channel.
pub(super) fn spectra(evidence: &Evidence, placement: &PlacementDiagnosis) -> Vec<Panel> {
    let spectra = &evidence.spectra;
    if spectra.frequencies.len() < 3 {
        return Vec::new();
    }
    [0, 3]
        .map(|first| {
            let axis = worst_axis(evidence, placement, first);
            let line = |values: &[[f64; 6]]| binned(&spectra.frequencies, values, axis);
            let series = vec![
                Series {
                    class: "measured",
                    points: line(&spectra.measured),
                },
                Series {
                    class: "predicted",
                    points: line(&spectra.predicted),
                },
                Series {
                    class: "before",
                    points: line(&spectra.residual_before),
                },
                Series {
                    class: "after",
                    points: line(&spectra.residual_after),
                },
            ];
            let of = |pick: fn(&(f64, f64)) -> f64| {
                series
                    .iter()
                    .flat_map(|series| series.points.iter().map(pick))
                    .collect::<Vec<_>>()
            };
            Panel {
                title: format!("{} (the axis with the largest gap)", axis_name(AXES[axis])),
                width: WIDTH,
                height: 240.0,
                x: Axis::logarithmic(of(|point| point.0).into_iter(), 4.0),
                y: Axis::logarithmic(of(|point| point.1).into_iter(), 9.0),
                x_label: "frequency, Hz".to_owned(),
                y_label: format!("density, ({})²/Hz", unit(axis)),
                shades: Vec::new(),
                level: None,
                series,
            }
        })
        .into()
}

/// The axis of a channel with the largest share, or else with the largest residual density.
fn worst_axis(evidence: &Evidence, placement: &PlacementDiagnosis, first: usize) -> usize {
    let share = |axis: usize| {
        placement
            .location
            .axes
            .get(AXES[axis])
            .copied()
            .unwrap_or(0.0)
    };
    let power = |axis: usize| {
        evidence
            .spectra
            .residual_before
            .iter()
            .map(|density| density[axis])
            .filter(|value| value.is_finite())
            .sum::<f64>()
    };
    let better = |one: usize, other: usize| {
        let order = share(other)
            .total_cmp(&share(one))
            .then(power(other).total_cmp(&power(one)));
        if order.is_gt() { other } else { one }
    };
    better(better(first, first + 1), first + 2)
}

/// Means over bins of equal width on the logarithmic axis; zero frequency left out.
fn binned(frequencies: &[f64], values: &[[f64; 6]], axis: usize) -> Vec<(f64, f64)> {
    let mut bins: Vec<(i64, f64, f64, f64)> = Vec::new();
    for (&frequency, value) in frequencies
        .iter()
        .zip(values)
        .filter(|(frequency, _)| **frequency > 0.0)
    {
        let bin = (frequency.log10() * BINS_PER_DECADE).floor() as i64;
        match bins.last_mut() {
            Some((last, count, hz, sum)) if *last == bin => {
                (*count, *hz, *sum) = (*count + 1.0, *hz + frequency, *sum + value[axis])
            }
            _ => bins.push((bin, 1.0, frequency, value[axis])),
        }
    }
    bins.into_iter()
        .map(|(_, count, hz, sum)| (hz / count, sum / count))
        .collect()
}
