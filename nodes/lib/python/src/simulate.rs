//! Virtual IMUs of a person, and of a rigid body.

use cromosim_spatial::in_plain_words;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use cromosim_imu::{
    AmbientField, Device, Differentiation, OrientationSource, PlacementSet, Scheme, SensorFrame,
    TextureSegment, Trim,
};
use cromosim_learned::{LearnedSimulator, MappingFile};
use cromosim_recording::{
    Aside, PlayedPerson, Quality, RecordingError, SimulatedPlacement, Simulation,
    SimulationOptions, TextureOn,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use crate::arrays::{Columns, poses, set_quality};
use crate::error::raise;
use crate::motion::Motion;
use crate::workers::on_all_cores;

/// The options of a simulation as `python/cromosim` writes them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// A scheme's name.
    scheme: Option<String>,
    bandwidth_hz: Option<f64>,
    /// Seconds; none: as long as the ends are far more uncertain.
    trim_s: Option<f64>,
    /// `own`, or a segment.
    texture: Option<String>,
    seed: u64,
    noise: bool,
    #[serde(default)]
    pose_error_correlation_s: f64,
    learned: Option<String>,
    mapping: Option<String>,
    /// As `simulate --magnetic-field` takes it.
    magnetic_field: Option<String>,
    orientation: Option<String>,
}

impl Options {
    /// Parses JSON.
    pub fn parse(text: &str) -> PyResult<SimulationOptions> {
        let options: Self = serde_json::from_str(text)
            .map_err(|error| raise(format!("simulate: {}", in_plain_words(error))))?;
        let scheme = options.scheme.as_deref().map(Scheme::from_str).transpose();
        let scheme = scheme.map_err(|error| raise(format!("scheme: {error}")))?;
        let differentiation = match (scheme, options.bandwidth_hz) {
            (Some(_), Some(_)) => {
                return Err(raise(
                    "bandwidth_hz takes the place of scheme; give one of them",
                ));
            }
            (scheme, bandwidth_hz) => scheme
                .map(Differentiation::Scheme)
                .or(bandwidth_hz.map(Differentiation::Bandwidth)),
        };
        if options.learned.is_some() {
            if options.bandwidth_hz.is_some() {
                return Err(raise(
                    "learned corrects what a scheme estimates, not a bandwidth_hz; leave one out",
                ));
            }
            if options.texture.is_some() {
                return Err(raise(
                    "learned corrects what texture draws anew; leave one out",
                ));
            }
        }
        Ok(SimulationOptions {
            rate_hz: None,
            differentiation,
            trim: options.trim_s.map_or(Trim::Uncertain, Trim::Seconds),
            texture: options.texture.as_deref().map(texture).transpose()?,
            seed: options.seed,
            noise: options.noise,
            pose_error_correlation_s: options.pose_error_correlation_s,
            learned: options
                .learned
                .map(|model| LearnedSimulator::find(Path::new(&model)))
                .transpose()
                .map_err(raise)?,
            mapping: match options.mapping {
                Some(path) => MappingFile::read(Path::new(&path)).map_err(raise)?,
                None => MappingFile::default(),
            },
            field: options
                .magnetic_field
                .map(|text| AmbientField::resolve(&text).map(Arc::new))
                .transpose()
                .map_err(raise)?,
            orientation: match options.orientation {
                Some(name) => name
                    .parse()
                    .map_err(|error| raise(format!("orientation: {error}")))?,
                None => OrientationSource::Truth,
            },
        })
    }
}

fn texture(name: &str) -> PyResult<TextureOn> {
    let known = TextureSegment::ALL;
    let found = known.into_iter().find(|segment| segment.name() == name);
    match found {
        Some(segment) => Ok(TextureOn::Segment(segment)),
        None if name == "own" => Ok(TextureOn::ItsSegment),
        None => Err(raise(format!(
            "texture {name}: expected own, {}",
            known.map(TextureSegment::name).join(", ")
        ))),
    }
}

/// What stays of a placement when its samples are measured.
struct MeasuredPlacement {
    name: String,
    columns: Columns,
    frames: Vec<SensorFrame>,
    quality: Quality,
}

fn measured(mut placement: SimulatedPlacement) -> Result<MeasuredPlacement, RecordingError> {
    let mut columns = Columns::with_capacity(placement.motion.count());
    placement.each_measured(|measured| columns.push(measured))?;
    Ok(MeasuredPlacement {
        name: placement.name,
        columns,
        frames: placement.frames,
        quality: placement.quality,
    })
}

/// The IMUs at `placements` (the text of a placements file) of a moving person: a dictionary of
/// arrays for each. `device` is a device's text, with the placements that have it.
#[pyfunction]
#[pyo3(signature = (motion, placements, folder, device, options))]
pub fn simulate<'py>(
    py: Python<'py>,
    motion: &Motion,
    placements: &str,
    folder: &str,
    device: Option<(Vec<String>, String)>,
    options: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let simulated = on_all_cores(py, || {
        let placements = PlacementSet::parse(placements, "placements").map_err(raise)?;
        let options = Options::parse(options)?;
        let model = motion.model.clone();
        let mut simulation =
            Simulation::new(model, placements, Path::new(folder), options).map_err(raise)?;
        if let Some((names, text)) = device {
            let device = Device::parse(&text, "device").map_err(raise)?;
            let with =
                |simulation: Simulation, name: &String| simulation.with_device(name, &device);
            simulation = names.iter().fold(simulation, with);
        }
        let (start_s, duration_s) = (motion.start_s, motion.duration_s);
        let person = PlayedPerson::part(&motion.motion, start_s, duration_s).map_err(raise)?;
        let aside = Aside::in_memory();
        let simulated = simulation.simulate_each(&person, &aside, || Ok(()), || (), measured);
        simulated.map_err(raise)
    })?;
    let imus = PyDict::new(py);
    let (simulated, _) = simulated;
    for measured in simulated {
        let oriented = measured.columns.are_oriented();
        let arrays = measured.columns.into_arrays(py, oriented)?;
        arrays.set_item("reference", poses(py, &measured.frames)?)?;
        set_quality(&arrays, &measured.quality)?;
        imus.set_item(&measured.name, arrays)?;
    }
    Ok(imus)
}
