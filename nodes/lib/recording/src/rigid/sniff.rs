//! Which format a text file is, by its content.

use super::imu_csv::{FORCES, RATES};

/// The formats of rigid bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigidFormat {
    /// [`super::parse_tum`].
    Tum,
    /// [`super::parse_euroc_ground_truth`].
    EurocGroundTruth,
    /// [`super::parse_euroc_imu`].
    EurocImu,
    /// [`super::parse_pose_csv`].
    PoseCsv,
    /// [`super::parse_imu_csv`].
    ImuCsv,
}

/// How much of the content is looked at.
const LOOKED_AT: usize = 64 << 10;

/// The format by the header, or by number and kind of the first row's columns: 8 between blanks are
/// TUM's; 7, 8 or 17 between commas, the first of them a whole number, are EuRoC's. `None` for
/// anything else.
pub fn sniff_rigid(bytes: &[u8]) -> Option<RigidFormat> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]);
    let start = start.trim_start_matches('\u{feff}');
    let first = start.lines().map(str::trim).find(|line| !line.is_empty())?;
    let lower = first.to_lowercase();
    let names = |names: &[&str]| names.iter().all(|name| lower.contains(name));
    if first.starts_with('#') && names(&["w_rs_s_x", "a_rs_s_x"]) && !names(&["p_rs"]) {
        return Some(RigidFormat::EurocImu);
    }
    if first.starts_with('#') && names(&["p_rs", "q_rs"]) {
        return Some(RigidFormat::EurocGroundTruth);
    }
    if let Some(format) = by_header(first, &lower) {
        return Some(format);
    }
    let row = start
        .lines()
        .map(str::trim)
        .find(|line| !line.is_empty() && !line.starts_with('#'))?;
    by_numbers(row)
}

/// A table whose header names its columns.
fn by_header(first: &str, lower: &str) -> Option<RigidFormat> {
    if !first.contains([',', ';', '\t']) {
        return None;
    }
    let cells: Vec<String> = lower
        .split([',', ';', '\t'])
        .map(|cell| {
            cell.split(['[', '('])
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        })
        .collect();
    let has = |names: &[&str]| {
        let is = |cell: &str, name: &str| {
            cell.replace(['.', '/'], "_")
                .strip_suffix("_x")
                .is_some_and(|cell| cell.ends_with(name))
        };
        // Single letters name columns of many tables: they do not tell what a file is.
        let names = || names.iter().filter(|name| name.len() > 1);
        cells.iter().any(|cell| names().any(|name| is(cell, name)))
    };
    let positions = cells
        .iter()
        .any(|cell| matches!(cell.as_str(), "x" | "px" | "tx"))
        || has(&["position", "pos"]);
    if !positions && has(&RATES) && has(&FORCES) {
        return Some(RigidFormat::ImuCsv);
    }
    let endings = [
        "qw",
        "q_w",
        "orientation.w",
        "orientation_w",
        "quat_w",
        "quaternion_w",
    ];
    let quaternion = cells
        .iter()
        .any(|cell| endings.iter().any(|ending| cell.ends_with(ending)));
    (quaternion && first.chars().any(char::is_alphabetic)).then_some(RigidFormat::PoseCsv)
}

/// A table without a header, by the number and kind of a row's columns.
fn by_numbers(row: &str) -> Option<RigidFormat> {
    let numbers = |cells: &[&str]| cells.iter().all(|cell| cell.parse::<f64>().is_ok());
    let blanks: Vec<&str> = row.split_ascii_whitespace().collect();
    if blanks.len() == 8 && numbers(&blanks) {
        return Some(RigidFormat::Tum);
    }
    let commas: Vec<&str> = row.split(',').map(str::trim).collect();
    let whole = commas
        .first()
        .is_some_and(|cell| cell.parse::<i64>().is_ok());
    match commas.len() {
        7 if whole && numbers(&commas) => Some(RigidFormat::EurocImu),
        8 | 17 if whole && numbers(&commas) => Some(RigidFormat::EurocGroundTruth),
        _ => None,
    }
}
