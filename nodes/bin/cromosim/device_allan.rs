//! `cromosim device from-allan`: devices of recordings at rest, with tables and pictures.

use cromosim_spatial::meant;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use cromosim_charts::{Line, LineChart, Point, standalone};
use cromosim_imu::allan::StaticNoise;
use cromosim_imu::{Channel, Device};
use cromosim_recording::{StaticReadings, read_static};

use crate::files::{refuse_existing, write_text};
use crate::output::{print, remark, say};

/// Runs `device from-allan`.
pub fn from_allan(
    recording: &Path,
    placement: Option<&str>,
    out: &Path,
    force: bool,
) -> anyhow::Result<()> {
    let all = chosen(recording, placement)?;
    for own in &all {
        for path in files(out, &own.name) {
            refuse_existing(&path, force)?;
        }
    }
    let made: Vec<(StaticNoise, Device)> = all
        .iter()
        .map(|own: &StaticReadings| {
            let noise = StaticNoise::of(&own.stamps, &own.readings);
            let made = noise.and_then(|noise| noise.device().map(|device| (noise, device)));
            made.with_context(|| format!("{}, {}", recording.display(), own.name))
        })
        .collect::<Result<_, _>>()?;
    std::fs::create_dir_all(out).with_context(|| format!("{}: cannot be made", out.display()))?;
    for (own, (noise, device)) in all.iter().zip(&made) {
        write(&own.name, noise, device, (out, force))?;
    }
    Ok(())
}

/// The IMUs of a recording, or the one that is named.
fn chosen(recording: &Path, placement: Option<&str>) -> anyhow::Result<Vec<StaticReadings>> {
    let all = read_static(recording)?;
    let Some(name) = placement else {
        return Ok(all);
    };
    let known: Vec<&str> = all.iter().map(|own| own.name.as_str()).collect();
    let known = known.join(", ");
    let chosen: Vec<_> = all.iter().filter(|own| own.name == name).cloned().collect();
    if chosen.is_empty() {
        bail!(
            "{}: no placement `{name}`; it has {known}{}",
            recording.display(),
            meant(name, known.split(", "))
        );
    }
    Ok(chosen)
}

/// Device file and pictures of a placement.
fn files(out: &Path, name: &str) -> [PathBuf; 3] {
    [
        format!("{name}.yaml"),
        format!("{name}_accelerometer.svg"),
        format!("{name}_gyroscope.svg"),
    ]
    .map(|file| out.join(file))
}

fn write(
    name: &str,
    noise: &StaticNoise,
    device: &Device,
    (out, force): (&Path, bool),
) -> anyhow::Result<()> {
    let [file, pictures @ ..] = files(out, name);
    let about = format!(
        "By the Allan deviation of {name} at rest: {:.0} s at {:.6} Hz.\n{}",
        noise.seconds,
        noise.rate_hz,
        table(noise)
    );
    write_text(&file, force, &device.to_yaml(&about))?;
    for (channel, path) in Channel::ALL.into_iter().zip(pictures) {
        let svg = standalone(&chart(noise, channel, name).svg());
        write_text(&path, force, &svg)?;
    }
    say!(
        "{}: {:.0} s at {:.3} Hz",
        file.display(),
        noise.seconds,
        noise.rate_hz
    )?;
    print(format_args!("{}", table(noise)))?;
    if noise.left_out > 0 {
        remark!(
            "  {name}: {} readings beyond a gap left out",
            noise.left_out
        );
    }
    Ok(())
}

/// Values with their intervals, a line each.
fn table(noise: &StaticNoise) -> String {
    let mut text = String::new();
    for channel in Channel::ALL {
        let (own, unit) = (&noise.channels[channel], channel.unit());
        let per = |what: &str| match channel {
            Channel::Accelerometer => format!("(m/s{what})/sqrt(Hz)"),
            Channel::Gyroscope => format!("(rad/s{})/sqrt(Hz)", if what == "3" { "2" } else { "" }),
        };
        let model = own.fit.model;
        let rows = [
            ("white noise", model.white, per("2")),
            (
                "instability, deviation",
                model.instability.0,
                unit.to_owned(),
            ),
            (
                "instability, time constant",
                model.instability.1,
                "s".to_owned(),
            ),
            ("bias walk", model.walk, per("3")),
        ];
        for ((what, value, unit), interval) in rows.into_iter().zip(own.fit.intervals) {
            let line = match interval {
                Some((low, high)) => {
                    format!("{value:.3e} [{low:.3e}, {high:.3e}] {unit}")
                }
                None => "not seen".to_owned(),
            };
            text += &format!("  {:13} {what:27} {line}\n", channel.name());
        }
        if let Some((floor, tau)) = own.fit.floor {
            let line = format!("{floor:.3e} {unit} at {tau:.1} s");
            text += &format!("  {:13} {:27} {line}\n", channel.name(), "floor / 0.664");
        }
        let whites = own.axes.iter().map(|(_, fit)| match fit {
            Some(fit) => format!("{:.3e}", fit.model.white),
            None => "none".to_owned(),
        });
        let whites: Vec<String> = whites.collect();
        let line = whites.join(", ");
        text += &format!(
            "  {:13} {:27} {line}\n",
            channel.name(),
            "white noise of x, y, z"
        );
    }
    text
}

fn chart(noise: &StaticNoise, channel: Channel, name: &str) -> LineChart {
    let own = &noise.channels[channel];
    let axis = |k: usize| Line {
        label: ["x", "y", "z"][k].to_owned(),
        points: own.axes[k]
            .0
            .iter()
            .map(|point| Point {
                x: point.tau_s,
                y: point.deviation,
                interval: Some(point.interval),
            })
            .collect(),
        is_reference: false,
    };
    let fitted = |point: &cromosim_imu::allan::AllanPoint| Point {
        x: point.tau_s,
        y: own.fit.model.variance(point.tau_s).sqrt(),
        interval: None,
    };
    LineChart {
        title: format!("{name}: {}", channel.name()),
        x_label: "averaging time, s".to_owned(),
        y_label: format!("Allan deviation, {}", channel.unit()),
        logarithmic_x: true,
        logarithmic_y: true,
        lines: vec![
            axis(0),
            axis(1),
            axis(2),
            Line {
                label: "the device's".to_owned(),
                points: own.curve.iter().map(fitted).collect(),
                is_reference: true,
            },
        ],
        level: None,
    }
}
