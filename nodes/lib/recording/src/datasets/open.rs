//! From a file to a data set's recording, by the file's content.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use cromosim_arrays::{Container, Format, Limits};
use cromosim_motion::{MotionFormat, UpAxis};

use super::{
    DatasetRecording, broad, columns, har_spsw, marked_imu, movella, optitrack, parse_broad,
    parse_columns, parse_har_spsw, parse_marked_imu, parse_movella, parse_mvnx_sensors,
    parse_optitrack, parse_pamap2, parse_realworld, parse_totalcapture_reference,
    parse_totalcapture_sensors, parse_vicon, realworld, totalcapture, vicon,
};
use crate::rigid::RigidError;

/// Larger tables are refused; the longest of these data sets have a tenth.
const MAX_BYTES: u64 = 2 << 30;
/// What is looked at to tell what a text is.
const LOOKED_AT: usize = 64 << 10;
/// TotalCapture's reference.
const SKELETON: [&str; 2] = ["gt_skel_gbl_pos.txt", "gt_skel_gbl_ori.txt"];

/// The data sets whose files are told by their content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DatasetFormat {
    /// [`parse_totalcapture_sensors`].
    TotalCapture,
    /// [`parse_pamap2`].
    Pamap2,
    /// [`parse_realworld`].
    RealWorld,
    /// [`parse_broad`].
    Broad,
    /// [`parse_marked_imu`].
    MarkedImu,
    /// [`parse_har_spsw`].
    HarSpsw,
    /// [`parse_columns`].
    Columns,
    /// [`parse_optitrack`].
    OptiTrack,
    /// [`parse_vicon`].
    Vicon,
    /// [`parse_movella`].
    Movella,
    /// [`parse_mvnx_sensors`].
    Mvnx,
}

impl DatasetFormat {
    /// Whether its files may have any axis up.
    pub const fn takes_up_axis(self) -> bool {
        matches!(self, Self::OptiTrack | Self::Vicon)
    }
}

impl std::fmt::Display for DatasetFormat {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::TotalCapture => "TotalCapture",
            Self::Pamap2 => "PAMAP2",
            Self::RealWorld => "RealWorld (HAR)",
            Self::Broad => "BROAD",
            Self::MarkedImu => "IMU on a segment with markers",
            Self::HarSpsw => "smartphone and smartwatch (HAR)",
            Self::Columns => "columns (Parquet)",
            Self::OptiTrack => "OptiTrack (CSV)",
            Self::Vicon => "Vicon (CSV)",
            Self::Movella => "Movella DOT or MT Manager (table)",
            Self::Mvnx => "Xsens MVN (MVNX)",
        })
    }
}

/// Files that belong to a recording where they do not lie beside it under the data set's own names,
/// and what its file does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DatasetFiles {
    /// TotalCapture: the folder of `gt_skel_gbl_pos.txt` and `gt_skel_gbl_ori.txt`.
    pub reference: Option<PathBuf>,
    /// RealWorld: the gyroscope's zip.
    pub gyroscope: Option<PathBuf>,
    /// The axis that points up; where it is to be found out, OptiTrack's y and Vicon's z.
    pub up_axis: UpAxis,
}

/// What a text file (its first 64 KiB are plenty) is: the header of an export, a row of 54 numbers,
/// or TotalCapture's three kinds of lines.
pub fn sniff_dataset(bytes: &[u8]) -> Option<DatasetFormat> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]);
    let start = start.trim_start_matches('\u{feff}');
    match MotionFormat::of(bytes) {
        // Without bodies they are motions alone.
        Some(MotionFormat::Motive) => {
            return optitrack::has_bodies(start).then_some(DatasetFormat::OptiTrack);
        }
        Some(MotionFormat::Vicon) => return Some(DatasetFormat::Vicon),
        Some(MotionFormat::Mvnx) => return Some(DatasetFormat::Mvnx),
        _ => {}
    }
    if movella::is_movella(start) {
        return Some(DatasetFormat::Movella);
    }
    let mut lines = start
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut cells = || {
        lines
            .next()
            .map(|line| line.split_ascii_whitespace().collect::<Vec<_>>())
    };
    let first = cells()?;
    let whole = |cells: &[&str]| cells.iter().all(|cell| cell.parse::<u64>().is_ok());
    if first.len() == 54 && first.iter().all(|cell| cell.parse::<f64>().is_ok()) {
        return Some(DatasetFormat::Pamap2);
    }
    let (number, sensor) = (cells()?, cells()?);
    let named = sensor
        .first()
        .is_some_and(|name| name.starts_with(char::is_alphabetic))
        && sensor.len() >= 8;
    let numbers = sensor
        .iter()
        .skip(1)
        .all(|cell| cell.parse::<f64>().is_ok());
    (first.len() == 2 && number.len() == 1 && whole(&first) && whole(&number) && named && numbers)
        .then_some(DatasetFormat::TotalCapture)
}

/// The recording in the file at `path`, and whose it is; `None` where it is of no data set.
/// TotalCapture's reference is looked for in the file's folder and in the one named like the file's
/// beginning (`acting1/` for `acting1_Xsens_AuxFields.sensors`), RealWorld's gyroscope beside the
/// accelerometer (`gyr_walking_csv.zip` for `acc_walking_csv.zip`). References have their IMU's
/// name.
///
/// # Errors
/// [`RigidError::Read`], and those of the parsers.
pub fn open_dataset(
    path: &Path,
    beside: &DatasetFiles,
) -> Result<Option<(DatasetFormat, DatasetRecording)>, RigidError> {
    let mut reader = BufReader::new(open(path)?);
    let unreadable = |source| RigidError::Read {
        path: path.to_owned(),
        source,
    };
    // Of a pipe the first bytes cannot be read twice.
    if !reader.get_ref().metadata().map_err(unreadable)?.is_file() {
        return Ok(None);
    }
    let name = path.display().to_string();
    let start = reader.fill_buf().map_err(unreadable)?;
    if start.starts_with(&columns::MAGIC) {
        let recording = parse_columns(bytes(path)?, &name)?;
        return Ok(Some((DatasetFormat::Columns, recording)));
    }
    let recording = match Format::detect(&mut reader).map_err(unreadable)? {
        None => return text(path, &name, beside),
        Some(Format::Zip) if realworld::is_realworld(open(path)?) => {
            (DatasetFormat::RealWorld, realworld(path, &name, beside)?)
        }
        Some(Format::Zip | Format::Mat) => match arrays(path)? {
            Some(DatasetFormat::Broad) => (DatasetFormat::Broad, parse_broad(reader, &name)?),
            Some(DatasetFormat::HarSpsw) => {
                (DatasetFormat::HarSpsw, parse_har_spsw(reader, &name)?)
            }
            Some(DatasetFormat::MarkedImu) => {
                (DatasetFormat::MarkedImu, parse_marked_imu(reader, &name)?)
            }
            _ => return Ok(None),
        },
        Some(_) => return Ok(None),
    };
    Ok(Some(recording))
}

fn text(
    path: &Path,
    name: &str,
    beside: &DatasetFiles,
) -> Result<Option<(DatasetFormat, DatasetRecording)>, RigidError> {
    let unreadable = |source| RigidError::Read {
        path: path.to_owned(),
        source,
    };
    let mut start = Vec::new();
    open(path)?
        .take(LOOKED_AT as u64)
        .read_to_end(&mut start)
        .map_err(unreadable)?;
    let Some(format) = sniff_dataset(&start) else {
        return Ok(None);
    };
    let recording = match format {
        DatasetFormat::Pamap2 => parse_pamap2(&bytes(path)?, name)?,
        DatasetFormat::OptiTrack => parse_optitrack(&bytes(path)?, name, beside.up_axis)?,
        DatasetFormat::Vicon => {
            let bytes = bytes(path)?;
            if !vicon::has_poses(&String::from_utf8_lossy(&bytes)) {
                return Ok(None);
            }
            parse_vicon(&bytes, name, beside.up_axis)?
        }
        DatasetFormat::Movella => parse_movella(&bytes(path)?, name)?,
        DatasetFormat::Mvnx => parse_mvnx_sensors(&bytes(path)?, name)?,
        _ => totalcapture(path, name, beside)?,
    };
    Ok(Some((format, recording)))
}

/// Whose an archive of arrays is, by its keys.
fn arrays(path: &Path) -> Result<Option<DatasetFormat>, RigidError> {
    let limits = Limits {
        decoded_bytes: broad::MAX_BYTES.max(marked_imu::MAX_BYTES),
        ..Limits::default()
    };
    // What is no archive of arrays is of no data set, whatever else it is.
    let Ok(file) = Container::new(BufReader::new(open(path)?), path, limits) else {
        return Ok(None);
    };
    let keys = file.keys();
    let known = [
        (broad::is_broad(&keys), DatasetFormat::Broad),
        (har_spsw::is_har_spsw(&keys), DatasetFormat::HarSpsw),
        (marked_imu::is_marked_imu(&keys), DatasetFormat::MarkedImu),
    ];
    Ok(known
        .into_iter()
        .find_map(|(told, format)| told.then_some(format)))
}

fn totalcapture(
    path: &Path,
    name: &str,
    beside: &DatasetFiles,
) -> Result<DatasetRecording, RigidError> {
    let mut recording = parse_totalcapture_sensors(&bytes(path)?, name)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let trial = path.file_name().unwrap_or_default().to_string_lossy();
    let trial = trial.split("_Xsens").next().unwrap_or_default();
    let near = [folder.to_owned(), folder.join(trial)]
        .into_iter()
        .find(|folder| folder.join(SKELETON[0]).is_file());
    let Some(reference) = beside.reference.clone().or(near) else {
        return Ok(recording);
    };
    let [positions, orientations] = SKELETON.map(|file| reference.join(file));
    let names = [
        positions.display().to_string(),
        orientations.display().to_string(),
    ];
    let joints = parse_totalcapture_reference(
        &bytes(&positions)?,
        &bytes(&orientations)?,
        [&names[0], &names[1]],
    )?;
    for imu in &recording.imus {
        let joint = totalcapture::joint(&imu.placement);
        let found = joints.iter().find(|(name, _)| Some(name.as_str()) == joint);
        recording
            .references
            .extend(found.map(|(_, trajectory)| (imu.placement.clone(), trajectory.clone())));
    }
    Ok(recording)
}

fn realworld(
    path: &Path,
    name: &str,
    beside: &DatasetFiles,
) -> Result<DatasetRecording, RigidError> {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let near = || {
        file.strip_prefix("acc")
            .map(|rest| path.with_file_name(format!("gyr{rest}")))
            .filter(|path| path.is_file())
    };
    let Some(gyroscope) = beside.gyroscope.clone().or_else(near) else {
        let problem = "the zip of one sensor, and the gyroscope's is not beside the accelerometer's; give both".to_owned();
        return Err(RigidError::Content {
            name: name.to_owned(),
            place: "zip".to_owned(),
            problem,
        });
    };
    parse_realworld(
        BufReader::new(open(path)?),
        BufReader::new(open(&gyroscope)?),
        [name, &gyroscope.display().to_string()],
    )
}

fn open(path: &Path) -> Result<File, RigidError> {
    cromosim_spatial::open_file(path).map_err(|source| RigidError::Read {
        path: path.to_owned(),
        source,
    })
}

fn bytes(path: &Path) -> Result<Vec<u8>, RigidError> {
    let mut bytes = Vec::new();
    let read = open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|source| RigidError::Read {
        path: path.to_owned(),
        source,
    })?;
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("more than {MAX_BYTES} bytes; cut it into parts");
        return Err(RigidError::Content {
            name: path.display().to_string(),
            place: "file".to_owned(),
            problem,
        });
    }
    Ok(bytes)
}
