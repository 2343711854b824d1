//! A diagnosis of the gap between simulated and real IMUs as a recording: curves, residuals,
//! spectra and words.

use std::path::Path;
use std::time::Duration;

use cromosim_spatial::Stamp;
use re_sdk::RecordingStream;
use re_sdk::log::TimeColumn;
use re_sdk_types::archetypes::{Scalars, SeriesLines, TextDocument};
use re_sdk_types::components::MediaType;

use crate::gap_data::{GAP_AXES, GapPlacement, gap_path};
use crate::gap_layout::{self, GapLayout};
use crate::gap_spectrum::log_spectrum;
use crate::layout::TIMELINE;
use crate::{Destination, ViewError, sinks, style};

/// Names and colours of the lines of both simulations.
const BEFORE_AND_AFTER: [(&str, [u8; 3]); 2] = [("before", style::BEFORE), ("after", style::AFTER)];
/// How long the last flush may take before it counts as lost.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(20);

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
        let placement = self.placement;
        self.stream.log_static(
            gap_path(&placement.name, &["words"]),
            &markdown(&placement.words),
        )?;
        let times: Vec<i64> = placement
            .stamps
            .iter()
            .map(|stamp| stamp.nanos.saturating_sub(self.start.nanos))
            .collect();
        for axis in 0..GAP_AXES.len() {
            self.write_axis(axis, &times)?;
        }
        self.write_course(times.first().copied().unwrap_or(0))?;
        for (index, spectrum) in placement.spectra.iter().enumerate() {
            let path = gap_path(&placement.name, &["spectrum", &index.to_string()]);
            log_spectrum(self.stream, &path, spectrum)?;
        }
        Ok(())
    }

    /// Curves and residuals of one axis.
    fn write_axis(&self, axis: usize, times: &[i64]) -> Result<(), ViewError> {
        let GapPlacement {
            measured,
            before,
            after,
            ..
        } = self.placement;
        let (axis_name, _) = GAP_AXES[axis];
        let curves: Vec<[f64; 3]> = (0..times.len())
            .map(|k| [measured[k][axis], before[k][axis], after[k][axis]])
            .collect();
        let [before_line, after_line] = BEFORE_AND_AFTER;
        let series = [("measured", style::MEASURED), before_line, after_line];
        self.lines(&["curves", axis_name], series, times, &curves)?;
        let residuals: Vec<[f64; 2]> = curves
            .iter()
            .map(|[measured, before, after]| [measured - before, measured - after])
            .collect();
        self.lines(
            &["residual", axis_name],
            BEFORE_AND_AFTER,
            times,
            &residuals,
        )
    }

    /// The whitened residual over time, dB over the noise; `first`: the first stamp on the
    /// timeline, ns.
    fn write_course(&self, first: i64) -> Result<(), ViewError> {
        let course = &self.placement.course;
        let times: Vec<i64> = course
            .iter()
            .map(|point| first + (point.seconds * 1e9).round() as i64)
            .collect();
        let decibels =
            |[before, after]: [f64; 2]| [before, after].map(|value| 10.0 * value.max(1e-3).log10());
        let accel: Vec<_> = course.iter().map(|point| decibels(point.accel)).collect();
        let gyro: Vec<_> = course.iter().map(|point| decibels(point.gyro)).collect();
        for (channel, values) in [("accel", accel), ("gyro", gyro)] {
            self.lines(&["course", channel], BEFORE_AND_AFTER, &times, &values)?;
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
