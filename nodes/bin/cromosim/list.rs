//! `cromosim list`: the names that commands and files take.

use std::path::PathBuf;

use clap::Subcommand;
use cromosim_body::{BodyModel, Joint};
use cromosim_imu::{
    Device, EMBEDDED_DEVICES, EffectKind, OrientationSource, Scheme, TextureSegment,
};
use cromosim_learned::LearnedSimulator;

use crate::body;
use crate::output::say;

/// The nodes, and what they do.
const NODES: [(&str, &str); 6] = [
    ("replay", "plays motion files, bags and IMU series"),
    (
        "smpl_state",
        "turns joint rotations into states of the body",
    ),
    ("virtual_imu", "sends what IMUs on the moving body measure"),
    ("recorder", "writes topics to a bag"),
    ("viewer", "shows body, IMUs and diagnostics in Rerun"),
    (
        "gap_monitor",
        "says live how far real IMUs are from simulated ones, and why",
    ),
];

/// What is listed.
#[derive(Subcommand)]
pub enum Command {
    /// Sites of the skin, for placements and `convert --site`
    Sites {
        /// Body model (npz or pickle) rather than the embedded one
        #[arg(long, value_name = "FILE")]
        body: Option<PathBuf>,
    },
    /// Effects that separate real IMUs from simulated ones, for devices and `diagnose --without`
    Effects,
    /// Derivative schemes, for placements and `simulate --scheme`
    Schemes,
    /// Devices that come with the suite
    Devices,
    /// Networks that come with the suite, for `--learned`
    Models,
    /// Nodes, for `cromosim node`
    Nodes,
}

/// Runs the command.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Sites { body } => body::sites(&body::model(body.as_deref())?),
        Command::Effects => effects(),
        Command::Schemes => schemes(),
        Command::Devices => devices(),
        Command::Models => models(),
        Command::Nodes => nodes(),
    }
}

/// Names, parameters with their units, and what they are.
pub fn effects() -> anyhow::Result<()> {
    for kind in EffectKind::ALL {
        let spec = kind.spec();
        let parameters: Vec<String> = spec
            .parameters
            .iter()
            .map(|parameter| match parameter.unit {
                "" => parameter.name.to_owned(),
                unit => format!("{} [{unit}]", parameter.name),
            })
            .collect();
        say!("{}: {}", spec.name, parameters.join(", "))?;
        say!("    {}", spec.summary)?;
    }
    Ok(())
}

fn schemes() -> anyhow::Result<()> {
    for scheme in Scheme::ALL {
        say!("{:18} {}", scheme.name(), scheme.summary())?;
    }
    Ok(())
}

fn devices() -> anyhow::Result<()> {
    for (name, _) in EMBEDDED_DEVICES {
        let device = Device::embedded(name)?;
        let effects: Vec<&str> = device
            .effects()
            .iter()
            .map(|one| one.kind().name())
            .collect();
        let effects = match effects.as_slice() {
            [] => String::new(),
            names => format!(", {}", names.join(", ")),
        };
        say!(
            "{name:18} {:.2e} (m/s2)/sqrt(Hz), {:.2e} (rad/s)/sqrt(Hz){effects}",
            device.accel_density(),
            device.gyro_density()
        )?;
    }
    Ok(())
}

fn models() -> anyhow::Result<()> {
    for name in LearnedSimulator::names() {
        say!(
            "{name:18} sees {}",
            LearnedSimulator::named(name)?.input().name()
        )?;
    }
    Ok(())
}

fn nodes() -> anyhow::Result<()> {
    for (name, does) in NODES {
        say!("{name:18} {does}")?;
    }
    Ok(())
}

fn owned<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    names.into_iter().map(str::to_owned).collect()
}

/// Names of the embedded body's sites.
pub fn site_names() -> Vec<String> {
    owned(BodyModel::embedded().site_names())
}

/// Names of joints.
pub fn joint_names() -> Vec<String> {
    owned(Joint::ALL.map(Joint::name))
}

/// Names of effects.
pub fn effect_names() -> Vec<String> {
    owned(EffectKind::ALL.map(EffectKind::name))
}

/// For shells.
pub fn orientation_names() -> Vec<String> {
    OrientationSource::ALL
        .map(|source| source.name().to_owned())
        .to_vec()
}

/// Names of derivative schemes.
pub fn scheme_names() -> Vec<String> {
    owned(Scheme::ALL.map(Scheme::name))
}

/// Names of devices.
pub fn device_names() -> Vec<String> {
    owned(EMBEDDED_DEVICES.map(|(name, _)| name))
}

/// Names of segments that have a texture.
pub fn texture_names() -> Vec<String> {
    owned(TextureSegment::ALL.map(TextureSegment::name))
}

/// Names of nodes.
pub fn node_names() -> Vec<String> {
    owned(NODES.map(|(name, _)| name))
}
