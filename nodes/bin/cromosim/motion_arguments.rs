//! How motion files are read: the same options for every command that takes motions.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use cromosim_motion::{MotionOptions, ShapeChoice, UpAxis};

/// Options of reading motion files. `-h` shows those that any file may need, `--help` all.
#[derive(Args)]
#[command(next_help_heading = "Motion files")]
pub struct MotionArguments {
    /// Up axis of the motion files: auto, x, y or z
    #[arg(
        long,
        value_name = "AXIS",
        default_value = "auto",
        hide_short_help = true
    )]
    up_axis: String,
    /// Metres of one unit of the motion files; default: found out from the skeleton's size, or as
    /// the file says
    #[arg(
        long,
        value_name = "METRES",
        allow_negative_numbers = true,
        hide_short_help = true
    )]
    unit: Option<f64>,
    /// Begin so many seconds after the motion's beginning
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    start: f64,
    /// Take so many seconds of the motion; default: to its end
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Which joint is which, where a BVH or AMC file has names of its own
    ///
    /// cmu, cmu_asf, daz, lafan1, mixamo, mvn, smpl, xsens, or a YAML file, which `cromosim inspect
    /// --skeleton-map-draft` drafts; default: the one that fits the names
    #[arg(long, value_name = "MAP", hide_short_help = true)]
    skeleton_map: Option<String>,
    /// An AMC file's skeleton (ASF) rather than the one beside it
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    skeleton: Option<PathBuf>,
    /// Frames per second of a motion file that does not say it (AMC: 120 where absent; video
    /// estimates: 30), Hz
    #[arg(
        long,
        value_name = "HZ",
        allow_negative_numbers = true,
        hide_short_help = true
    )]
    motion_rate: Option<f64>,
    /// Which marker is where: plug_in_gait, or a YAML file
    #[arg(long, value_name = "SET", hide_short_help = true)]
    marker_set: Option<String>,
    /// Whose markers are taken, where the labels name several people
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    subject: Option<String>,
    /// Take markers to be stuck exactly where the marker set says, instead of about a centimetre
    /// around it
    #[arg(long, hide_short_help = true)]
    placements_as_given: bool,
    /// Which person of a file of several; default: who is in it longest
    ///
    /// `simulate` also takes all, or names with commas between: topics and frames then begin with
    /// person_NAME
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
    /// Where the body's shape comes from: detect, file, fit (to bone lengths) or mean
    #[arg(
        long,
        default_value = "detect",
        value_parser = ["detect", "file", "fit", "mean"],
        hide_short_help = true
    )]
    shape: String,
    /// The body file that the motion's betas are for, to fit another body to that person's bones
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    source_body: Option<PathBuf>,
}

impl MotionArguments {
    /// The options, checked.
    pub fn options(&self) -> anyhow::Result<MotionOptions> {
        let up_axis = match self.up_axis.as_str() {
            "auto" => UpAxis::Detect,
            "x" => UpAxis::X,
            "y" => UpAxis::Y,
            "z" => UpAxis::Z,
            other => bail!("--up-axis {other}: expected auto, x, y or z"),
        };
        if let Some(rate) = self
            .motion_rate
            .filter(|rate| !(*rate > 0.0 && rate.is_finite()))
        {
            bail!("--motion-rate {rate}: expected a positive number of frames a second");
        }
        Ok(MotionOptions {
            up_axis,
            skeleton_map: self.skeleton_map.clone(),
            unit_scale_m: self.unit,
            start_s: self.start,
            duration_s: self.duration,
            skeleton: self.skeleton.clone(),
            rate_hz: self.motion_rate,
            marker_set: self.marker_set.clone(),
            subject: self.subject.clone(),
            placements_as_given: self.placements_as_given,
            person: self.person.clone(),
            shape: match self.shape.as_str() {
                "file" => ShapeChoice::File,
                "fit" => ShapeChoice::Fit,
                "mean" => ShapeChoice::Mean,
                _ => ShapeChoice::Detect,
            },
            source_body: self.source_body.clone(),
            ..MotionOptions::default()
        })
    }
}
