//! A diagnosis of the gap between simulated and real IMUs as a recording: curves, residuals,
//! spectra and words.

use std::path::Path;
use std::time::Duration;

use cromosim_spatial::Stamp;
use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::archetypes::{Scalars, SeriesLines, TextDocument};
use re_sdk_types::components::MediaType;

use crate::gap_layout::{self, GapLayout};
use crate::gap_spectrum::log_spectrum;
use crate::layout::TIMELINE;
use crate::{Destination, ViewError, sinks, style};

/// Paths of the six axes below a placement, and the unit of each.
pub(crate) const GAP_AXES: [(&str, &str); 6] = [
    ("accel_x", "m/s²"),
    ("accel_y", "m/s²"),
    ("accel_z", "m/s²"),
    ("gyro_x", "rad/s"),
    ("gyro_y", "rad/s"),
    ("gyro_z", "rad/s"),
];
/// How long the last flush may take before it counts as lost.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(20);

/// One placement's curves. All lists by stamp have the same length.
#[derive(Clone, Debug, Default)]
pub struct GapPlacement {
    /// Its name.
    pub name: String,
    /// Verdict and causes, as Markdown.
    pub words: String,
    /// Of each reading.
    pub stamps: Vec<Stamp>,
    /// Accelerometer [m/s²], gyroscope [rad/s], as recorded.
    pub measured: Vec<[f64; 6]>,
    /// The nominal simulation.
    pub before: Vec<[f64; 6]>,
    /// With all named causes.
    pub after: Vec<[f64; 6]>,
    /// Whitened residual over time.
    pub course: Vec<GapCoursePoint>,
    /// Spectra of one axis of each channel.
    pub spectra: Vec<GapSpectrum>,
}

/// Mean square of the whitened residual around a time; 1 is noise alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct GapCoursePoint {
    /// Since the placement's first stamp, s.
    pub seconds: f64,
    /// Accelerometer before and after.
    pub accel: [f64; 2],
    /// Gyroscope before and after.
    pub gyro: [f64; 2],
}

/// One-sided densities on common frequencies.
#[derive(Clone, Debug, Default)]
pub struct GapSpectrum {
    /// What is shown, with its unit.
    pub title: String,
    /// Hz.
    pub frequencies: Vec<f64>,
    /// Lines on these frequencies: name and density. `measured`, `before`, `after` and `predicted`
    /// have the colours of the curves.
    pub lines: Vec<(String, Vec<f64>)>,
}

/// The path of something of a placement; the name is one part of it, whatever characters it has.
pub(crate) fn gap_path(placement: &str, parts: &[&str]) -> EntityPath {
    let parts = ["gap", placement].into_iter().chain(parts.iter().copied());
    EntityPath::new(parts.map(Into::into).collect())
}

/// Writes a diagnosis to an `.rrd` file, with a layout: a page of words, and a tab for each
/// placement; the first placement is open.
///
/// | path | what |
/// |---|---|
/// | `/gap/summary` | verdicts, Markdown |
/// | `/gap/NAME/words` | verdict and causes, Markdown |
/// | `/gap/NAME/curves/AXIS` | measured, before, after |
/// | `/gap/NAME/residual/AXIS` | measured less before, measured less after |
/// | `/gap/NAME/course/accel`, `/gap/NAME/course/gyro` | whitened residual before and after, dB over the noise |
/// | `/gap/NAME/spectrum/N` | a picture of densities with logarithmic axes |
///
/// # Errors
/// Where the file cannot be created or written; [`ViewError::Count`] where lists differ in length.
pub fn write_gap(
    path: &Path,
    title: &str,
    summary: &str,
    placements: &[GapPlacement],
) -> Result<(), ViewError> {
    for placement in placements {
        let expected = placement.stamps.len();
        for (what, found) in [
            ("measured", placement.measured.len()),
            ("before", placement.before.len()),
            ("after", placement.after.len()),
        ] {
            if found != expected {
                return Err(ViewError::Count {
                    what,
                    expected,
                    found,
                });
            }
        }
    }
    let destination = Destination::File {
        path: path.to_owned(),
    };
    let stream = sinks::open(std::slice::from_ref(&destination), title)?;
    stream.log_static(gap_layout::SUMMARY, &markdown(summary))?;
    // One zero for all, so that what happened together stands together.
    let start = placements
        .iter()
        .filter_map(|placement| placement.stamps.first())
        .min()
        .copied()
        .unwrap_or_default();
    for placement in placements {
        Writer {
            stream: &stream,
            start,
            placement,
        }
        .write()?;
    }
    GapLayout { placements }.send(&stream)?;
    stream
        .flush_with_timeout(FLUSH_TIMEOUT)
        .map_err(|error| ViewError::Lost {
            destination: destination.to_string(),
            reason: error.to_string(),
        })?;
    stream.finalize_deferred_sinks();
    Ok(())
}

fn markdown(text: &str) -> TextDocument {
    TextDocument::new(text).with_media_type(MediaType::markdown())
}

struct Writer<'a> {
    stream: &'a RecordingStream,
    start: Stamp,
    placement: &'a GapPlacement,
}

impl Writer<'_> {
    fn write(&self) -> Result<(), ViewError> {
        let GapPlacement {
            name,
            words,
            stamps,
            measured,
            before,
            after,
            course,
            spectra,
        } = self.placement;
        self.stream
            .log_static(gap_path(name, &["words"]), &markdown(words))?;
        let times: Vec<i64> = stamps
            .iter()
            .map(|stamp| stamp.nanos.saturating_sub(self.start.nanos))
            .collect();
        for (axis, (axis_name, _)) in GAP_AXES.into_iter().enumerate() {
            let curves: Vec<[f64; 3]> = (0..stamps.len())
                .map(|k| [measured[k][axis], before[k][axis], after[k][axis]])
                .collect();
            let series = [
                ("measured", style::MEASURED),
                ("before", style::BEFORE),
                ("after", style::AFTER),
            ];
            self.lines(&["curves", axis_name], series, &times, &curves)?;
            let residuals: Vec<[f64; 2]> = (0..stamps.len())
                .map(|k| {
                    [
                        measured[k][axis] - before[k][axis],
                        measured[k][axis] - after[k][axis],
                    ]
                })
                .collect();
            self.lines(
                &["residual", axis_name],
                [("before", style::BEFORE), ("after", style::AFTER)],
                &times,
                &residuals,
            )?;
        }
        let first = times.first().copied().unwrap_or(0);
        let times: Vec<i64> = course
            .iter()
            .map(|point| first + (point.seconds * 1e9).round() as i64)
            .collect();
        let decibels =
            |[before, after]: [f64; 2]| [before, after].map(|value| 10.0 * value.max(1e-3).log10());
        for (channel, values) in [
            (
                "accel",
                course
                    .iter()
                    .map(|point| decibels(point.accel))
                    .collect::<Vec<_>>(),
            ),
            (
                "gyro",
                course.iter().map(|point| decibels(point.gyro)).collect(),
            ),
        ] {
            self.lines(
                &["course", channel],
                [("before", style::BEFORE), ("after", style::AFTER)],
                &times,
                &values,
            )?;
        }
        for (index, spectrum) in spectra.iter().enumerate() {
            log_spectrum(
                self.stream,
                &gap_path(name, &["spectrum", &index.to_string()]),
                spectrum,
            )?;
        }
        Ok(())
    }

    /// Several lines of one plot, as one entity.
    fn lines<const N: usize>(
        &self,
        path: &[&str],
        series: [(&str, [u8; 3]); N],
        nanos: &[i64],
        values: &[[f64; N]],
    ) -> Result<(), ViewError> {
        let path = gap_path(&self.placement.name, path);
        let look = SeriesLines::new()
            .with_names(series.map(|(name, _)| name))
            .with_colors(series.map(|(_, color)| style::color(color)));
        self.stream.log_static(
            path.clone(),
            &look.with_widths([1.5; N].map(|width: f32| width)),
        )?;
        if nanos.is_empty() {
            return Ok(());
        }
        let times = TimeColumn::new_duration_nanos(TIMELINE, nanos.iter().copied());
        let scalars = Scalars::new(values.iter().flatten().copied());
        let columns = scalars
            .columns(values.iter().map(|_| N))
            .map_err(|error| ViewError::Sdk(Box::new(error)))?;
        Ok(self.stream.send_columns(path, [times], columns)?)
    }
}
