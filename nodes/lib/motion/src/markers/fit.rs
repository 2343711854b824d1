//! The fit as a whole: labels, person, poses, report.

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, Gender, Joint, Site};
use cromosim_spatial::confidence_of_std;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::bind::{Bound, bind};
use super::clip::MarkerClip;
use super::keyframes::choose;
use super::options::MarkerOptions;
use super::prior::PosePrior;
use super::report::{MarkerFit, MarkerReport};
use super::set::{MarkerSet, SetMarker};
use super::shape::{Keyframe, Person, fit_person, joint_sigmas};
use super::skin::{ShapedSkin, Skin};
use super::start::{cold_start, trunk_markers};
use super::track::Tracker;
use crate::axes::axis_name;
use crate::motion::{check_finite, continuous};
use crate::{MotionError, SmplMotion};

/// Frames that the shape is fitted to.
const KEYFRAMES: usize = 12;

/// Finds the body that moved under the markers, after MoSh (Loper et al. 2014): shape, and where
/// the markers are stuck, from twelve frames that are unlike each other; then, with these held, a
/// pose for every frame.
///
/// A frame's cost is `sum rho(|m_i - y_i|) / (3 mm)^2 + w |pose - mean|^2 / sigma^2 + |pose -
/// expected|^2 / sigma_t^2` with Huber's rho, linear beyond 3 mm, the marker `m_i` on the skin by
/// linear blend skinning with pose corrections, the prior's weight w falling from 4 to 0.25 where a
/// frame starts from nothing, and what the frames around it promise; elbows and knees that bend the
/// wrong way cost more. Markers that are not seen count nothing; frames with fewer than six are
/// interpolated. The world has z up, the recording's origin and floor. The motion's `confidence`
/// follows from the joints' median standard deviation and from how many markers were seen.
///
/// # Errors
/// [`MotionError`] where labels, subject, unit or up axis do not fit; the message says which option
/// helps.
pub fn fit_markers(
    clip: &MarkerClip,
    body: &Arc<BodyModel>,
    set: &MarkerSet,
    options: &MarkerOptions,
) -> Result<(SmplMotion, MarkerReport), MotionError> {
    let bound = bind(clip, body, set, options)?;
    let skin = Skin::new(body, &bound.sites, options.betas.min(body.beta_count()))?;
    let stuck_at = stuck_at(bound.markers.iter().copied());
    let prior = PosePrior::standing();
    let joints: Vec<Joint> = bound.sites.iter().map(|site| site.joint).collect();
    let trunk = trunk_markers(&joints);
    let chosen = choose(&bound.frames, KEYFRAMES);
    let mean = skin.shaped(&[], &stuck_at)?;
    let mut keyframes = keyframes(&bound, &chosen, &mean, &trunk, &prior);
    if keyframes.is_empty() {
        return Err(MotionError::NoMarkers {
            name: clip.name.clone(),
        });
    }
    let person = fit_person(
        &skin,
        &stuck_at,
        &prior,
        &mut keyframes,
        options.fit_placement,
    )?;
    let shaped = skin.shaped(&person.betas, &person.placements)?;
    let tracker = Tracker {
        skin: &shaped,
        prior: &prior,
        trunk: &trunk,
        rate_hz: clip.rate_hz,
        known: &poses(&keyframes),
    };
    let frames = continuous(tracker.track(&bound.frames));
    check_finite(&clip.name, &frames)?;
    let (markers, rms_m) = marker_fits(&bound, &shaped, &person, &stuck_at, &frames);
    let sigmas = joint_sigmas(&shaped, &prior, &keyframes, rms_m / f64::sqrt(3.0));
    let confidence_of = |frame: &Vec<_>| confidence(&sigmas, frame, set.markers().len());
    let confidence = bound.frames.iter().map(confidence_of).collect();
    let report = MarkerReport {
        subjects: clip.subjects(),
        unit_scale_m: options.unit_scale_m.unwrap_or(clip.unit_scale_m),
        markers,
        rms_m,
        keyframes: chosen,
        betas: person.betas.clone(),
        joint_sigma_m: Joint::ALL.into_iter().zip(sigmas).collect(),
        ..binding_report(bound, set)
    };
    let motion = SmplMotion {
        betas: person.betas,
        confidence: Some(confidence),
        frames,
        markers: Some(report.clone()),
        ..without_frames(clip, body)
    };
    Ok((motion, report))
}

/// A motion of the clip's name and rate on the body, its frames to be filled in.
fn without_frames(clip: &MarkerClip, body: &BodyModel) -> SmplMotion {
    SmplMotion {
        name: clip.name.clone(),
        rate_hz: clip.rate_hz,
        gender: body.gender().unwrap_or(Gender::Neutral),
        shape_space: body.shape_space(),
        betas: Vec::new(),
        frames: Vec::new(),
        confidence: None,
        report: None,
        poses: None,
        markers: None,
    }
}

/// Where a set has its markers in the frames of their triangles, m.
fn stuck_at<'a>(markers: impl Iterator<Item = &'a SetMarker>) -> Vec<Vector3<f64>> {
    markers
        .map(|marker| Vector3::new(0.0, 0.0, marker.height_m))
        .collect()
}

/// The chosen frames, each with a pose that is found from its markers alone; without those in which
/// none is found.
fn keyframes(
    bound: &Bound<'_>,
    chosen: &[usize],
    mean: &ShapedSkin<'_>,
    trunk: &[bool],
    prior: &PosePrior,
) -> Vec<Keyframe> {
    let keyframe = |&index: &usize| {
        let observed = bound.frames[index].clone();
        let pose = cold_start(mean, &observed, trunk, prior, &[])?;
        Some(Keyframe { observed, pose })
    };
    let found: Vec<Option<Keyframe>> = chosen.par_iter().map(keyframe).collect();
    found.into_iter().flatten().collect()
}

fn poses(keyframes: &[Keyframe]) -> Vec<BodyPose> {
    keyframes.iter().map(|frame| frame.pose.clone()).collect()
}

/// What the labels and the frames say; the fit's own results are to be filled in.
fn binding_report(bound: Bound<'_>, set: &MarkerSet) -> MarkerReport {
    let missing = bound
        .frames
        .iter()
        .flatten()
        .filter(|point| point.is_none())
        .count();
    MarkerReport {
        marker_set: set.name().to_owned(),
        subjects: Vec::new(),
        up_axis: axis_name(bound.up_in_file),
        unit_scale_m: 0.0,
        markers: Vec::new(),
        absent: bound.absent,
        unknown: bound.unknown,
        rms_m: 0.0,
        missing_share: missing as f64 / (bound.frames.len() * bound.sites.len()) as f64,
        keyframes: Vec::new(),
        betas: Vec::new(),
        joint_sigma_m: Vec::new(),
    }
}

/// A frame's confidence by the joints' median standard deviation along an axis, which grows as the
/// root of the set's markers over those seen.
fn confidence(joint_sigmas_m: &[f64], frame: &[Option<Vector3<f64>>], markers: usize) -> f64 {
    let mut sigmas = joint_sigmas_m.to_vec();
    sigmas.sort_unstable_by(f64::total_cmp);
    let median_m = sigmas
        .get(sigmas.len() / 2)
        .copied()
        .unwrap_or(f64::INFINITY)
        / f64::sqrt(3.0);
    confidence_of_std(median_m * (markers as f64 / frame.iter().flatten().count() as f64).sqrt())
}

/// Each marker's error, worst first, and that of all together, m.
fn marker_fits(
    bound: &Bound<'_>,
    shaped: &ShapedSkin<'_>,
    person: &Person,
    stuck_at: &[Vector3<f64>],
    poses: &[BodyPose],
) -> (Vec<MarkerFit>, f64) {
    let mut sums = vec![(0.0, 0_usize); bound.sites.len()];
    for (frame, pose) in bound.frames.iter().zip(poses) {
        let markers = shaped.posed(pose).markers;
        for ((sum, seen), marker) in sums.iter_mut().zip(frame).zip(markers) {
            if let Some(seen) = seen {
                *sum = (sum.0 + (marker - seen).norm_squared(), sum.1 + 1);
            }
        }
    }
    let rms = |(squares, count): (f64, usize)| (squares / count.max(1) as f64).sqrt();
    let fit = |(index, &sum): (usize, &(f64, usize))| MarkerFit {
        label: bound.markers[index].label.clone(),
        rms_m: rms(sum),
        missing_share: 1.0 - sum.1 as f64 / poses.len().max(1) as f64,
        moved_m: (person.placements[index] - stuck_at[index]).norm(),
    };
    let mut fits: Vec<MarkerFit> = sums.iter().enumerate().map(fit).collect();
    fits.sort_by(|left, right| right.rms_m.total_cmp(&left.rms_m));
    (
        fits,
        rms(sums
            .iter()
            .fold((0.0, 0), |all, sum| (all.0 + sum.0, all.1 + sum.1))),
    )
}

/// Where a set's markers are on a body in a pose of its own shape: what [`fit_markers`] would see.
///
/// # Errors
/// [`MotionError`] where a marker of the set is not on the body.
pub fn place_markers(
    motion: &SmplMotion,
    body: &Arc<BodyModel>,
    set: &MarkerSet,
) -> Result<MarkerClip, MotionError> {
    let sites: Vec<Site> = set
        .markers()
        .iter()
        .map(|marker| marker.site_on(body, set.name()))
        .collect::<Result<_, _>>()?;
    let skin = Skin::new(body, &sites, 0)?;
    let shaped = skin.shaped(&motion.betas, &stuck_at(set.markers().iter()))?;
    let frame = |pose| {
        shaped
            .posed(pose)
            .markers
            .into_iter()
            .map(|marker| Some(marker.into()))
            .collect()
    };
    Ok(MarkerClip {
        name: motion.name.clone(),
        rate_hz: motion.rate_hz,
        unit_scale_m: 1.0,
        labels: set
            .markers()
            .iter()
            .map(|marker| marker.label.clone())
            .collect(),
        frames: motion.frames.iter().map(frame).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confidence_is_that_of_the_joints_and_falls_with_markers_lost() {
        let seen = |count: usize| -> Vec<Option<Vector3<f64>>> {
            (0..40)
                .map(|marker| (marker < count).then(Vector3::zeros))
                .collect()
        };
        let std_m = |count: usize| {
            cromosim_spatial::std_of_confidence(confidence(
                &[0.001, 0.003, 0.002, 0.009, 0.001],
                &seen(count),
                40,
            ))
        };
        let median_m = 0.002 / f64::sqrt(3.0);
        assert!((std_m(40) - median_m).abs() < 1e-9 && (std_m(10) - 2.0 * median_m).abs() < 1e-9);
        assert_eq!(confidence(&[0.002], &seen(0), 40), 0.0);
    }
}
