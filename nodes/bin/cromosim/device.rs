//! `cromosim device`: devices by what they measure at rest, by Kalibr's files and by diagnoses.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Subcommand;
use cromosim_imu::allan::NoiseModel;
use cromosim_imu::{
    Channel, Device, EMBEDDED_DEVICES, EffectsFile, KalibrNoise, STANDARD_GRAVITY, Shape,
};

use crate::device_allan::from_allan;
use crate::files::{refuse_existing, write_text};
use crate::list;
use crate::named::Named;
use crate::output::say;

/// Commands on devices.
#[derive(Subcommand)]
pub enum Command {
    /// Make devices of the IMUs in a recording at rest, by their Allan deviation: NAME.yaml for each
    /// placement, and its curves as NAME_accelerometer.svg and NAME_gyroscope.svg
    FromAllan {
        /// A bag with /imu/NAME/data_raw, or an IMU series (EuRoC, CSV); hours at rest
        recording: PathBuf,
        /// Only this placement of a bag
        #[arg(long, value_name = "NAME")]
        placement: Option<String>,
        /// The folder to write into
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Replace files that exist
        #[arg(long)]
        force: bool,
    },
    /// Make a device of a Kalibr imu.yaml
    FromKalibr {
        /// Kalibr's file
        imu: PathBuf,
        /// The device file to write (YAML)
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Replace FILE where it exists
        #[arg(long)]
        force: bool,
    },
    /// Write a device's noise as a Kalibr imu.yaml
    ToKalibr {
        /// A built-in device, or a device file (.yaml)
        #[arg(value_parser = Named(list::device_names), hide_possible_values = true)]
        device: String,
        /// The IMU's topic, as it will stand in the file
        #[arg(long, value_name = "TOPIC")]
        topic: String,
        /// Readings per second, Hz
        #[arg(long, value_name = "HZ")]
        rate: f64,
        /// The file to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Replace FILE where it exists
        #[arg(long)]
        force: bool,
    },
    /// Make devices of what a diagnosis found: NAME.yaml for each placement
    FromDiagnosis {
        /// The folder that `cromosim diagnose` wrote
        diagnosis: PathBuf,
        /// The folder to write into
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Replace files that exist
        #[arg(long)]
        force: bool,
    },
    /// Print what a device adds to a reading; without a name the built-in devices
    Show {
        /// A built-in device, or a device file (.yaml)
        #[arg(value_parser = Named(list::device_names), hide_possible_values = true)]
        device: Option<String>,
    },
}

/// Runs the command.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::FromAllan {
            recording,
            placement,
            out,
            force,
        } => from_allan(recording, placement.as_deref(), out, *force),
        Command::FromKalibr { imu, out, force } => from_kalibr(imu, out, *force),
        Command::ToKalibr {
            device,
            topic,
            rate,
            out,
            force,
        } => {
            let (noise, left_out) = KalibrNoise::of(&resolve(device)?);
            let text = noise.to_yaml(topic, *rate).context("--rate, --topic")?;
            write_text(out, *force, &text)?;
            say!("{}: {device}, {topic} at {rate} Hz", out.display())?;
            left(&left_out, "Kalibr has no place for")
        }
        Command::FromDiagnosis {
            diagnosis,
            out,
            force,
        } => from_diagnosis(diagnosis, out, *force),
        Command::Show { device } => match device {
            Some(device) => show(device),
            None => list(),
        },
    }
}

fn resolve(device: &str) -> anyhow::Result<Device> {
    Ok(Device::resolve(Some(device), Path::new("."))?)
}

fn left(names: &[&str], why: &str) -> anyhow::Result<()> {
    if !names.is_empty() {
        say!("  left out: {} ({why})", names.join(", "))?;
    }
    Ok(())
}

fn from_kalibr(imu: &Path, out: &Path, force: bool) -> anyhow::Result<()> {
    refuse_existing(out, force)?;
    let text = cromosim_spatial::read_text(imu)
        .with_context(|| format!("{}: cannot be read", imu.display()))?;
    let noise = KalibrNoise::parse(&text, &imu.display().to_string())?;
    let about = format!(
        "From Kalibr's {}.",
        imu.file_name().unwrap_or_default().to_string_lossy()
    );
    write_text(out, force, &noise.device()?.to_yaml(&about))?;
    say!(
        "{}: white noise and bias walk of both channels",
        out.display()
    )
}

fn from_diagnosis(diagnosis: &Path, out: &Path, force: bool) -> anyhow::Result<()> {
    let file = diagnosis.join("effects.yaml");
    let effects = EffectsFile::read(&file)?;
    if effects.placements.is_empty() {
        bail!("{}: no placement in it", file.display());
    }
    for name in effects.placements.keys() {
        refuse_existing(&out.join(format!("{name}.yaml")), force)?;
    }
    std::fs::create_dir_all(out).with_context(|| format!("{}: cannot be made", out.display()))?;
    for (name, placement) in &effects.placements {
        let path = out.join(format!("{name}.yaml"));
        let (device, left_out) = Device::of_placement(placement);
        let about = format!("What a diagnosis found of {name}.");
        write_text(&path, force, &device.to_yaml(&about))?;
        let names: Vec<&str> = device.effects().iter().map(|it| it.kind().name()).collect();
        say!(
            "{}: {}",
            path.display(),
            if names.is_empty() {
                "noise alone".to_owned()
            } else {
                names.join(", ")
            }
        )?;
        left(&left_out, "the recording's own")?;
    }
    Ok(())
}

fn list() -> anyhow::Result<()> {
    for (name, text) in EMBEDDED_DEVICES {
        let about = text.lines().next().unwrap_or_default();
        let about = about.trim_start_matches(['#', ' ']);
        let about = about.split_once(". ").map_or(about, |(first, _)| first);
        say!("{name:16} {}", about.trim_end_matches('.'))?;
    }
    Ok(())
}

fn show(name: &str) -> anyhow::Result<()> {
    let device = resolve(name)?;
    if let Some((_, text)) = EMBEDDED_DEVICES.iter().find(|(known, _)| *known == name) {
        for line in text.lines().take_while(|line| line.starts_with('#')) {
            say!("{}", line.trim_start_matches(['#', ' ']))?;
        }
    }
    let noise = device.declared_noise();
    say!(
        "{:24} {:16} {:.4e} (m/s2)/sqrt(Hz) = {:.1} ug/sqrt(Hz)",
        "white noise",
        "accelerometer",
        noise.accel_density,
        1e6 * noise.accel_density / STANDARD_GRAVITY
    )?;
    say!(
        "{:24} {:16} {:.4e} (rad/s)/sqrt(Hz) = {:.2} (mdeg/s)/sqrt(Hz)",
        "white noise",
        "gyroscope",
        noise.gyro_density,
        1e3 * noise.gyro_density.to_degrees()
    )?;
    for effect in device.effects() {
        for (parameter, values) in effect.written_parameters() {
            let values = match parameter.shape {
                Shape::Choice(words) => words[values[0] as usize].to_owned(),
                _ => {
                    let digits: Vec<String> = values.iter().map(|it| format!("{it:.4e}")).collect();
                    digits.join(" ")
                }
            };
            let name = effect.kind().name();
            say!(
                "{name:24} {:16} {values} {}",
                parameter.name,
                parameter.unit
            )?;
        }
    }
    for channel in Channel::ALL {
        let model = NoiseModel::of_device(&device, channel);
        let taus = [0.1, 1.0, 10.0, 100.0, 1000.0];
        let values = taus.map(|tau| format!("{:.2e}", model.variance(tau).sqrt()));
        say!(
            "{:24} {:16} {} {} after 0.1, 1, 10, 100, 1000 s",
            "Allan deviation",
            channel.name(),
            values.join(" "),
            channel.unit()
        )?;
    }
    Ok(())
}
