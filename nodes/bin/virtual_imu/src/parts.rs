//! What a node is made of, from its configuration.

use std::path::Path;
use std::sync::Arc;

use cromosim_body::ShapedBody;
use cromosim_imu::{
    AmbientField, Device, ImuError, ImuOptions, OrientationSource, Placement, ReadingMapping,
    VirtualImu,
};
use cromosim_learned::{LearnedError, LearnedSimulator, LivePlacements, MappingFile};
use cromosim_spatial::PoseSource;

use crate::config::Config;
use crate::refusal::Refusal;

/// The placements' own, or that of the parameter, which is found from where the node runs.
pub(crate) fn resolved_devices(
    config: &Config,
    placements: &[Placement],
    folder: &Path,
) -> Result<Vec<Device>, ImuError> {
    let resolve = |placement: &Placement| match config.device.as_str() {
        "" => Device::resolve(placement.device(), folder),
        device => Device::resolve(Some(device), Path::new(".")),
    };
    placements.iter().map(resolve).collect()
}

pub(crate) fn fresh_imus(
    config: &Config,
    mapping: &MappingFile,
    (placements, devices): (&[Placement], &[Device]),
    field: Option<&Arc<AmbientField>>,
) -> Result<Vec<VirtualImu>, ImuError> {
    let orientation: OrientationSource = config.orientation.parse()?;
    let imu = |(placement, device): (&Placement, &Device)| {
        let mapping = mapping.placements.get(placement.name()).cloned();
        let options = ImuOptions {
            rate_hz: placement.rate_hz(),
            seed: config.seed as u64,
            // Several bodies' devices err each on its own.
            name: config.frame(placement.name()),
            noise: config.noise,
            frame_id: config.frame(&format!("{}_imu", placement.name())),
            mapping: mapping.map(|mapping| Box::new(mapping) as Box<dyn ReadingMapping>),
            field: field.cloned(),
            orientation,
        };
        VirtualImu::new(device, options)
    };
    placements.iter().zip(devices).map(imu).collect()
}

pub(crate) fn fresh_networks(
    learned: Option<&LearnedSimulator>,
    shaped: &ShapedBody,
    placements: &[Placement],
    config: &Config,
) -> Result<Option<LivePlacements>, LearnedError> {
    learned
        .map(|networks| LivePlacements::new(networks, shaped, placements, config.gap_seconds))
        .transpose()
}

/// None where no folder is named.
pub(crate) fn read_networks(folder: &str) -> Result<Option<LearnedSimulator>, LearnedError> {
    (!folder.is_empty())
        .then(|| LearnedSimulator::find(Path::new(folder)))
        .transpose()
}

/// A mapping of these placements at least in part; that of no file changes nothing.
pub(crate) fn read_mapping(file: &str, placements: &[Placement]) -> Result<MappingFile, Refusal> {
    if file.is_empty() {
        return Ok(MappingFile::default());
    }
    let mapping = MappingFile::read(Path::new(file))?;
    let maps = |placement: &Placement| mapping.placements.contains_key(placement.name());
    if placements.iter().any(maps) {
        return Ok(mapping);
    }
    let known: Vec<&str> = mapping.placements.keys().map(String::as_str).collect();
    Err(Refusal::Unmapped {
        file: file.to_owned(),
        known: known.join(", "),
    })
}

pub(crate) fn pose_source(name: &str) -> Result<PoseSource, Refusal> {
    if name.is_empty() {
        return Ok(PoseSource::default());
    }
    PoseSource::ALL
        .into_iter()
        .find(|source| source.name() == name)
        .ok_or_else(|| Refusal::Source(name.to_owned()))
}
