//! Diagnoses of arrays and of recordings.

use cromosim_spatial::meant;
use std::collections::BTreeMap;
use std::path::PathBuf;

use cromosim_bag::BagReader;
use cromosim_gap::{
    DiagnoseOptions, Diagnosis, MeasuredField, MeasuredImu, PlacementRecord, PoseSeries, SCHEMA,
    diagnose_together,
};
use cromosim_imu::{EffectKind, EffectsFile, PerChannel, Reading};
use cromosim_recording::read_placements;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{stamps, vectors};
use crate::error::raise;
use crate::motion::model;
use crate::rigid::frames;
use crate::workers::on_all_cores;

/// One placement's poses and readings, ready to be diagnosed.
#[pyclass(frozen, module = "cromosim._native")]
pub struct Record {
    record: PlacementRecord,
}

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (name, pose_stamps_s, positions, orientations, stamps_s, specific_force, angular_velocity, noise))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        name: String,
        pose_stamps_s: PyReadonlyArray1<'_, f64>,
        positions: PyReadonlyArray2<'_, f64>,
        orientations: PyReadonlyArray2<'_, f64>,
        stamps_s: PyReadonlyArray1<'_, f64>,
        specific_force: PyReadonlyArray2<'_, f64>,
        angular_velocity: PyReadonlyArray2<'_, f64>,
        noise: (Option<f64>, Option<f64>),
    ) -> PyResult<Self> {
        let frames = frames(&pose_stamps_s, &positions, &orientations)?;
        let at = stamps(&stamps_s, "stamps_s")?;
        let force = vectors(&specific_force, "specific_force")?;
        let rates = vectors(&angular_velocity, "angular_velocity")?;
        if force.len() != at.len() || rates.len() != at.len() {
            return Err(raise(format!(
                "stamps_s, specific_force, angular_velocity: {}, {} and {} rows; expected equally many",
                at.len(),
                force.len(),
                rates.len()
            )));
        }
        let reading = |(specific_force, angular_velocity)| Reading {
            specific_force,
            angular_velocity,
        };
        Ok(Self {
            record: PlacementRecord {
                name,
                set_back: Vec::new(),
                field: MeasuredField::default(),
                reference: PoseSeries {
                    stamps: frames.iter().map(|frame| frame.stamp).collect(),
                    positions: frames
                        .iter()
                        .map(|frame| frame.world_from_sensor.translation.vector)
                        .collect(),
                    rotations: frames
                        .iter()
                        .map(|frame| frame.world_from_sensor.rotation)
                        .collect(),
                },
                imu: MeasuredImu {
                    stamps: at,
                    readings: force.into_iter().zip(rates).map(reading).collect(),
                    declared: PerChannel {
                        accelerometer: noise.0,
                        gyroscope: noise.1,
                    },
                },
            },
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.record.name
    }
}

/// The placements of a recording that have a reference and readings.
#[pyfunction]
#[pyo3(signature = (path, body))]
pub fn read_records(py: Python<'_>, path: PathBuf, body: Option<PathBuf>) -> PyResult<Vec<Record>> {
    py.detach(|| {
        let body = body.map(|body| model(Some(&body))).transpose()?;
        let reader = BagReader::open(&path).map_err(raise)?;
        let mut records = Vec::new();
        for (_, placement) in read_placements(&reader, body.as_ref()).map_err(raise)? {
            let placement = placement.map_err(raise)?;
            if !placement.measured.is_empty() {
                records.push(Record {
                    record: placement.record(),
                });
            }
        }
        Ok(records)
    })
}

/// A diagnosis as JSON, its effects as a file's text, and its page.
#[pyfunction]
#[pyo3(signature = (records, without, seed, title))]
pub fn diagnose(
    py: Python<'_>,
    records: Vec<PyRef<'_, Record>>,
    without: Vec<String>,
    seed: u64,
    title: &str,
) -> PyResult<(String, String, String)> {
    let excluded = without.iter().map(|name| {
        EffectKind::from_name(name).ok_or_else(|| {
            let meant = meant(name, EffectKind::ALL.map(EffectKind::name));
            raise(format!("without {name}: no such effect{meant}"))
        })
    });
    let options = DiagnoseOptions {
        excluded: excluded.collect::<PyResult<_>>()?,
        seed,
        ..DiagnoseOptions::default()
    };
    let records: Vec<PlacementRecord> = records.iter().map(|one| one.record.clone()).collect();
    on_all_cores(py, || {
        let mut diagnosis = Diagnosis {
            schema: SCHEMA.to_owned(),
            placements: BTreeMap::new(),
        };
        let (mut effects, mut evidence) = (EffectsFile::default(), BTreeMap::new());
        let answer = |record: &PlacementRecord| {
            diagnose_together(&[("", record)], &options)
                .map(|(answer, _)| answer)
                .map_err(|(_, error)| raise(format!("{}: {error}", record.name)))
        };
        let answers: Vec<PyResult<_>> = records.par_iter().map(answer).collect();
        for (record, answer) in records.iter().zip(answers) {
            let (name, answer) = (record.name.clone(), answer?);
            diagnosis.placements.insert(name.clone(), answer.diagnosis);
            effects.placements.insert(name.clone(), answer.effects);
            evidence.insert(name, answer.evidence);
        }
        let page = cromosim_gap::report::html(&diagnosis, &evidence, title);
        let json = serde_json::to_string_pretty(&diagnosis).map_err(raise)?;
        Ok((json + "\n", effects.to_yaml(), page))
    })
}
