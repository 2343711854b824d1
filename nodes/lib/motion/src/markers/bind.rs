//! Which column of a recording is which marker of a set, and how the file's axes stand in the
//! world.

use cromosim_body::{BodyModel, Joint, Site};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::clip::MarkerClip;
use super::options::MarkerOptions;
use super::set::{MarkerSet, SetMarker};
use crate::MotionError;
use crate::axes::{minimal_rotation, nearest_axis};

/// Fewer markers do not tell a body's pose.
const FEWEST_MARKERS: usize = 12;
/// Frames that the up axis and the size are told from.
const SAMPLES: usize = 500;

/// A recording's markers in the set's order.
pub(super) struct Bound<'a> {
    /// The set's markers that the recording has.
    pub markers: Vec<&'a SetMarker>,
    /// Where they are on the body.
    pub sites: Vec<Site>,
    /// Labels of the set that the recording does not have.
    pub absent: Vec<String>,
    /// Labels of the recording that the set does not have.
    pub unknown: Vec<String>,
    /// A signed axis of the file.
    pub up_in_file: Vector3<f64>,
    /// (frames, markers), m, world (z up).
    pub frames: Vec<Vec<Option<Vector3<f64>>>>,
}

/// Looks the set's markers up in the recording and turns the recording's up axis to z.
pub(super) fn bind<'a>(
    clip: &MarkerClip,
    body: &BodyModel,
    set: &'a MarkerSet,
    options: &MarkerOptions,
) -> Result<Bound<'a>, MotionError> {
    let labels = clip.labels_of(options.subject.as_deref())?;
    let (found, absent) = matched(&labels, set);
    if found.len() < FEWEST_MARKERS {
        return Err(MotionError::MarkerLabels {
            name: clip.name.clone(),
            set: set.name().to_owned(),
            found: found.len(),
            total: set.markers().len(),
            needed: FEWEST_MARKERS,
            labels: labels
                .iter()
                .flatten()
                .take(20)
                .map(|label| (*label).to_owned())
                .collect(),
        });
    }
    let used = |index: usize| found.iter().any(|(_, column)| *column == index);
    let unknown = (0..labels.len())
        .filter(|&index| !used(index))
        .filter_map(|index| labels[index].map(str::to_owned))
        .collect();
    let sites = found
        .iter()
        .map(|(marker, _)| marker.site_on(body, set.name()))
        .collect::<Result<Vec<_>, _>>()?;
    let scale = scale(clip, options)?;
    let row = |frame: &Vec<Option<Point3<f64>>>| -> Vec<Option<Vector3<f64>>> {
        let point = |column: usize| frame.get(column).copied().flatten();
        found
            .iter()
            .map(|(_, column)| point(*column).map(|point| point.coords * scale))
            .collect()
    };
    let mut frames: Vec<_> = clip.frames.iter().map(row).collect();
    let up_in_file = up_axis(clip, body, &sites, &frames, options)?;
    let world_from_file = minimal_rotation(up_in_file, Vector3::z());
    turn(&mut frames, world_from_file);
    Ok(Bound {
        markers: found.into_iter().map(|(marker, _)| marker).collect(),
        sites,
        absent,
        unknown,
        up_in_file,
        frames,
    })
}

/// The set's markers that have a label in the recording, each with its column, and the labels of
/// those that have none. Case does not matter.
fn matched<'a>(
    labels: &[Option<&str>],
    set: &'a MarkerSet,
) -> (Vec<(&'a SetMarker, usize)>, Vec<String>) {
    let column = |marker: &SetMarker| {
        let same = |label: &&str| {
            label.eq_ignore_ascii_case(&marker.label)
                || marker
                    .aliases
                    .iter()
                    .any(|alias| label.eq_ignore_ascii_case(alias))
        };
        labels
            .iter()
            .position(|label| label.as_ref().is_some_and(same))
    };
    let (mut found, mut absent) = (Vec::new(), Vec::new());
    for marker in set.markers() {
        match column(marker) {
            Some(column) => found.push((marker, column)),
            None => absent.push(marker.label.clone()),
        }
    }
    (found, absent)
}

/// Factor on the clip's metres where the options name another unit.
fn scale(clip: &MarkerClip, options: &MarkerOptions) -> Result<f64, MotionError> {
    match options.unit_scale_m {
        Some(scale) if scale > 0.0 && scale.is_finite() => Ok(scale / clip.unit_scale_m),
        Some(value) => {
            let expected = "metres per unit, more than 0".to_owned();
            Err(MotionError::Setting {
                name: clip.name.clone(),
                setting: "unit_scale_m",
                value,
                expected,
            })
        }
        None => Ok(1.0),
    }
}

fn turn(frames: &mut [Vec<Option<Vector3<f64>>>], world_from_file: UnitQuaternion<f64>) {
    for point in frames.iter_mut().flatten().flatten() {
        *point = world_from_file * *point;
    }
}

/// Segments whose markers are near the floor, and near the head, of who stands.
const LOW: [Joint; 6] = [
    Joint::LeftFoot,
    Joint::RightFoot,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::LeftKnee,
    Joint::RightKnee,
];
const HIGH: [Joint; 5] = [
    Joint::Neck,
    Joint::Head,
    Joint::LeftCollar,
    Joint::RightCollar,
    Joint::Spine3,
];

/// The up axis, as chosen or from feet to head; and a check that the person is of a person's size.
fn up_axis(
    clip: &MarkerClip,
    body: &BodyModel,
    sites: &[Site],
    frames: &[Vec<Option<Vector3<f64>>>],
    options: &MarkerOptions,
) -> Result<Vector3<f64>, MotionError> {
    let heights: Vec<f64> = sites.iter().map(|site| height(body, site)).collect();
    let markers_on = |joints: &[Joint]| {
        (0..sites.len())
            .filter(|&index| joints.contains(&sites[index].joint))
            .collect::<Vec<_>>()
    };
    let (low, high) = (markers_on(&LOW), markers_on(&HIGH));
    let (mut sum, mut ratios) = (Vector3::zeros(), Vec::new());
    for frame in frames.iter().step_by(frames.len().div_ceil(SAMPLES).max(1)) {
        let (Some(low), Some(high)) = (
            middle(frame, &low, &heights),
            middle(frame, &high, &heights),
        ) else {
            continue;
        };
        sum += (high.0 - low.0).try_normalize(0.0).unwrap_or_default();
        ratios.push((high.0 - low.0).norm() / (high.1 - low.1));
    }
    ratios.sort_by(f64::total_cmp);
    // Bent people are short: the tallest frames count.
    if let Some(&ratio) = ratios
        .get(ratios.len().saturating_sub(1) * 9 / 10)
        .filter(|ratio| !(0.6..1.5).contains(*ratio))
    {
        return Err(MotionError::Unit {
            name: clip.name.clone(),
            height_units: ratio * 1.7 / clip.unit_scale_m,
        });
    }
    let mean = sum / ratios.len().max(1) as f64;
    let found = Some(nearest_axis(mean)).filter(|axis| axis.dot(&mean) > 0.6);
    options
        .up_axis
        .direction()
        .or(found)
        .ok_or_else(|| MotionError::UpAxis {
            name: clip.name.clone(),
            mean: mean.into(),
        })
}

/// Mean position of the markers of a group that are seen, and their mean height on the mean shape,
/// m.
fn middle(
    frame: &[Option<Vector3<f64>>],
    group: &[usize],
    heights: &[f64],
) -> Option<(Vector3<f64>, f64)> {
    let seen: Vec<(Vector3<f64>, f64)> = group
        .iter()
        .filter_map(|&index| Some((frame[index]?, heights[index])))
        .collect();
    let count = seen.len() as f64;
    (!seen.is_empty()).then(|| {
        (
            seen.iter()
                .map(|(position, _)| position)
                .sum::<Vector3<f64>>()
                / count,
            seen.iter().map(|(_, height)| height).sum::<f64>() / count,
        )
    })
}

/// Height of a site on the mean shape in T-pose, m, model axes.
fn height(body: &BodyModel, site: &Site) -> f64 {
    let corners = body.triangle(site).unwrap_or_default();
    corners
        .iter()
        .zip(site.barycentrics)
        .map(|(&corner, weight)| body.template()[corner as usize].y * weight)
        .sum()
}
