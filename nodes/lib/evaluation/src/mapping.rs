//! Distribution mappings from whole recordings.

use std::collections::BTreeMap;
use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_imu::Reading;
use cromosim_learned::{MappingFile, PlacementMapping};
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;

use crate::EvaluationError;

/// Fits, for every placement that both recordings have, the mapping from the simulated to the
/// measured IMU. The recordings need be neither of the same motion nor of the same length.
///
/// # Errors
/// Recordings that cannot be read or have no IMU, [`EvaluationError::NoSharedPlacement`], and too
/// few readings.
pub fn fit_mapping(simulated: &Path, measured: &Path) -> Result<MappingFile, EvaluationError> {
    let (own, others) = (readings(simulated)?, readings(measured)?);
    let mut file = MappingFile::default();
    for (name, readings) in &own {
        if let Some(measured) = others.get(name) {
            let mapping = PlacementMapping::fit(readings, measured, name)?;
            file.placements.insert(name.clone(), mapping);
        }
    }
    if file.placements.is_empty() {
        let list = |readings: &BTreeMap<String, Vec<Reading>>| {
            readings.keys().cloned().collect::<Vec<_>>().join(", ")
        };
        return Err(EvaluationError::NoSharedPlacement {
            simulated: simulated.to_owned(),
            simulated_names: list(&own),
            measured: measured.to_owned(),
            measured_names: list(&others),
        });
    }
    Ok(file)
}

/// Readings of every /imu/NAME/data_raw by NAME.
fn readings(path: &Path) -> Result<BTreeMap<String, Vec<Reading>>, EvaluationError> {
    let bag = BagReader::open(path)?;
    let topics = bag
        .summary()
        .topics
        .iter()
        .filter(|counted| counted.topic.type_name == Imu::TYPE_NAME);
    let mut all = BTreeMap::new();
    for counted in topics {
        let topic = &counted.topic.name;
        let Some(name) = topic
            .strip_prefix("/imu/")
            .and_then(|rest| rest.strip_suffix("/data_raw"))
        else {
            continue;
        };
        let messages = bag.read::<Imu>(topic)?.into_iter();
        let readings = messages.map(|(_, imu)| Reading {
            specific_force: imu.linear_acceleration.into(),
            angular_velocity: imu.angular_velocity.into(),
        });
        all.insert(name.to_owned(), readings.collect());
    }
    if all.is_empty() {
        return Err(EvaluationError::NoImuTopic {
            path: path.to_owned(),
        });
    }
    Ok(all)
}
