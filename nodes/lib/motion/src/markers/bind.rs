//! Which column of a recording is which marker of a set, and how the file's axes stand in the
//! world.

use cromosim_body::{BodyModel, Joint, Site};
use nalgebra::{UnitQuaternion, Vector3};

use super::clip::MarkerClip;
use super::fit::MarkerOptions;
use super::set::{MarkerSet, SetMarker};
use crate::MotionError;
use crate::axes::{minimal_rotation, nearest_axis};

/// Fewer markers do not tell a body's pose.
const FEWEST_MARKERS: usize = 12;
/// Frames that the up axis and the size are told from.
const SAMPLES: usize = 500;

/// A recording's markers in the set's order.
pub(super) struct Bound<'a> {
    pub markers: Vec<&'a SetMarker>,
    pub sites: Vec<Site>,
    pub absent: Vec<String>,
    pub unknown: Vec<String>,
    pub up_in_file: Vector3<f64>,
    /// (frames, markers), m, world (z up).
    pub frames: Vec<Vec<Option<Vector3<f64>>>>,
}

pub(super) fn bind<'a>(
    clip: &MarkerClip,
    body: &BodyModel,
    set: &'a MarkerSet,
    options: &MarkerOptions,
) -> Result<Bound<'a>, MotionError> {
    let labels = clip.labels_of(options.subject.as_deref())?;
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
    let found: Vec<(&SetMarker, usize)> = set
        .markers()
        .iter()
        .filter_map(|marker| Some((marker, column(marker)?)))
        .collect();
    let absent: Vec<String> = set
        .markers()
        .iter()
        .filter(|marker| column(marker).is_none())
        .map(|marker| marker.label.clone())
        .collect();
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
    let scale = match options.unit_scale_m {
        Some(scale) if scale > 0.0 && scale.is_finite() => scale / clip.unit_scale_m,
        Some(value) => {
            let expected = "metres per unit, more than 0".to_owned();
            return Err(MotionError::Setting {
                name: clip.name.clone(),
                setting: "unit_scale_m",
                value,
                expected,
            });
        }
        None => 1.0,
    };
    let row = |frame: &Vec<Option<nalgebra::Point3<f64>>>| -> Vec<Option<Vector3<f64>>> {
        found
            .iter()
            .map(|(_, column)| {
                frame
                    .get(*column)
                    .copied()
                    .flatten()
                    .map(|point| point.coords * scale)
            })
            .collect()
    };
    let mut frames: Vec<_> = clip.frames.iter().map(row).collect();
    let up_in_file = orientation(clip, body, &sites, &frames, options)?;
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

fn turn(frames: &mut [Vec<Option<Vector3<f64>>>], world_from_file: UnitQuaternion<f64>) {
    for point in frames.iter_mut().flatten().flatten() {
        *point = world_from_file * *point;
    }
}

/// The up axis, as chosen or from feet to head; and a check that the person is of a person's size.
fn orientation(
    clip: &MarkerClip,
    body: &BodyModel,
    sites: &[Site],
    frames: &[Vec<Option<Vector3<f64>>>],
    options: &MarkerOptions,
) -> Result<Vector3<f64>, MotionError> {
    let heights: Vec<f64> = sites.iter().map(|site| height(body, site)).collect();
    let of = |joints: &[Joint]| {
        (0..sites.len())
            .filter(|&index| joints.contains(&sites[index].joint))
            .collect::<Vec<_>>()
    };
    let low = of(&[
        Joint::LeftFoot,
        Joint::RightFoot,
        Joint::LeftAnkle,
        Joint::RightAnkle,
        Joint::LeftKnee,
        Joint::RightKnee,
    ]);
    let high = of(&[
        Joint::Neck,
        Joint::Head,
        Joint::LeftCollar,
        Joint::RightCollar,
        Joint::Spine3,
    ]);
    let (mut sum, mut ratios) = (Vector3::zeros(), Vec::new());
    for frame in frames.iter().step_by(frames.len().div_ceil(SAMPLES).max(1)) {
        let middle = |group: &[usize]| {
            let seen: Vec<(Vector3<f64>, f64)> = group
                .iter()
                .filter_map(|&index| Some((frame[index]?, heights[index])))
                .collect();
            let count = seen.len() as f64;
            (!seen.is_empty()).then(|| {
                (
                    seen.iter().map(|(place, _)| place).sum::<Vector3<f64>>() / count,
                    seen.iter().map(|(_, height)| height).sum::<f64>() / count,
                )
            })
        };
        let (Some(low), Some(high)) = (middle(&low), middle(&high)) else {
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

/// Height of a site on the mean shape in T-pose, m, model axes.
fn height(body: &BodyModel, site: &Site) -> f64 {
    let corners = body.triangle(site).unwrap_or_default();
    corners
        .iter()
        .zip(site.barycentrics)
        .map(|(&corner, weight)| body.template()[corner as usize].y * weight)
        .sum()
}
