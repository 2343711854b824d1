//! Poses of a body on a topic of a bag as a motion at a constant rate.

use cromosim_bag::BagReader;
use cromosim_body::{BodyPose, Gender};
use cromosim_motion::SmplMotion;
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_spatial::Stamp;
use cromosim_spatial::meant;

use super::ReadOptions;
use crate::placement::body_pose;
use crate::{RecordingError, body_for_bag};

/// Frames nearer to a constant rate than this stay as they are, s.
const JITTER_S: f64 = 1e-5;
/// Poses further apart than so many intervals have a gap between them, in which nobody saw the
/// body.
const GAP: f64 = 2.5;
/// A bag with a gap of days is no motion.
const MAX_FRAMES: f64 = 2e7;

/// The types of such topics, the one to be preferred first.
pub(super) fn types() -> [&'static str; 2] {
    [SmplState::TYPE_NAME, SmplPose::TYPE_NAME]
}

/// One message of the topic.
struct Moment {
    stamp: Stamp,
    pose: BodyPose,
    /// 0 to 1.
    confidence: f64,
}

/// The motion on a topic of SmplState or SmplPose at the median rate: of the body that
/// `options.motion.person` names, or of the only one. Betas are the last message's. With what was
/// changed, a line each.
pub(super) fn read(
    reader: &BagReader,
    topic: &str,
    options: &ReadOptions,
) -> Result<(SmplMotion, Vec<String>), RecordingError> {
    let place = format!("{}, {topic}", reader.path().display());
    let wrong = |problem: &str| RecordingError::Unsuitable {
        path: place.clone().into(),
        problem: problem.to_owned(),
    };
    let states = states(reader, topic, options.motion.person.as_deref())?;
    let Some(last) = states.last() else {
        return Err(wrong("no pose"));
    };
    let model = body_for_bag(reader, options.body.as_ref())?;
    model
        .check_named_betas(&last.shape_space, &last.gender, &last.betas)
        .map_err(|error| RecordingError::from(error).at(place.clone()))?;
    let moment = |state: &SmplState| {
        Ok(Moment {
            stamp: Stamp::from_nanos(state.header.stamp.nanos()),
            pose: body_pose(state)?,
            confidence: state.confidence.clamp(0.0, 1.0),
        })
    };
    let moments = states
        .iter()
        .map(moment)
        .collect::<Result<Vec<_>, RecordingError>>()?;
    if moments.len() < 2 {
        return Err(wrong("one pose is no motion"));
    }
    let motion = SmplMotion {
        name: place.clone(),
        rate_hz: 0.0,
        gender: Gender::from_name(&last.gender).unwrap_or_default(),
        betas: last.betas.clone(),
        shape_space: model.shape_space(),
        frames: Vec::new(),
        confidence: None,
        report: None,
        markers: None,
        poses: None,
    };
    at_constant_rate(motion, &moments)
}

/// One body's states in order of time, no stamp twice, at least one.
fn states(
    reader: &BagReader,
    topic: &str,
    person: Option<&str>,
) -> Result<Vec<SmplState>, RecordingError> {
    let mut states: Vec<SmplState> = if reader.topic(topic)?.type_name == SmplPose::TYPE_NAME {
        let poses = reader.read::<SmplPose>(topic)?.into_iter();
        poses.map(|(_, pose)| pose.into()).collect()
    } else {
        let states = reader.read::<SmplState>(topic)?.into_iter();
        states.map(|(_, state)| state).collect()
    };
    let mut people: Vec<String> = states.iter().map(|state| state.body_id.clone()).collect();
    people.sort();
    people.dedup();
    let wrong = |problem: String| RecordingError::Unsuitable {
        path: format!("{}, {topic}", reader.path().display()).into(),
        problem,
    };
    match person {
        Some(person) if people.iter().any(|one| one == person) => {
            states.retain(|state| state.body_id == person);
        }
        Some(person) => {
            return Err(wrong(format!(
                "--person {person}: nobody of that name; the bodies here: {}{}",
                people.join(", "),
                meant(person, people.iter().map(String::as_str))
            )));
        }
        None if people.len() > 1 => {
            return Err(wrong(format!(
                "several bodies; give --person, one of {}",
                people.join(", ")
            )));
        }
        None => {}
    }
    states.sort_by_key(|state| state.header.stamp.nanos());
    states.dedup_by_key(|state| state.header.stamp.nanos());
    if states.is_empty() {
        return Err(wrong("no pose".into()));
    }
    Ok(states)
}

/// As they are where they stand at a constant rate; interpolated at their median rate elsewhere, in
/// gaps without confidence.
fn at_constant_rate(
    motion: SmplMotion,
    moments: &[Moment],
) -> Result<(SmplMotion, Vec<String>), RecordingError> {
    let times: Vec<f64> = moments
        .iter()
        .map(|moment| moment.stamp - moments[0].stamp)
        .collect();
    let (count, last) = (times.len(), times[times.len() - 1]);
    // Stamps are whole nanoseconds: a rate is known to no more than that.
    let mean_hz = (1e6 * (count - 1) as f64 / last).round() / 1e6;
    let mut indexed = times.iter().enumerate();
    if indexed.all(|(index, time)| (time - index as f64 / mean_hz).abs() < JITTER_S) {
        let frames = moments.iter().map(|moment| moment.pose.clone()).collect();
        let confidence = Some(moments.iter().map(|moment| moment.confidence).collect());
        let motion = SmplMotion {
            rate_hz: mean_hz,
            frames,
            confidence,
            ..motion
        };
        return Ok((motion, Vec::new()));
    }
    let mut intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    let interval = intervals[intervals.len() / 2];
    if last / interval > MAX_FRAMES {
        return Err(RecordingError::Unsuitable {
            path: motion.name.into(),
            problem: format!(
                "{last:.0} s at {:.1} Hz; cut the bag into parts",
                1.0 / interval
            ),
        });
    }
    let note = format!(
        "{}: stamps are not evenly spaced; interpolated at {:.3} Hz",
        motion.name,
        1.0 / interval
    );
    Ok((interpolated(motion, moments, &times, interval), vec![note]))
}

/// Poses every `interval` seconds; where two are further apart than [`GAP`] intervals, those
/// between have no confidence.
fn interpolated(
    motion: SmplMotion,
    moments: &[Moment],
    times: &[f64],
    interval: f64,
) -> SmplMotion {
    let (count, last) = (times.len(), times[times.len() - 1]);
    let steps = (last / interval + 1e-6).floor() as usize;
    let (mut frames, mut confidence) =
        (Vec::with_capacity(steps + 1), Vec::with_capacity(steps + 1));
    for step in 0..=steps {
        let time = step as f64 * interval;
        let after = times
            .partition_point(|known| *known <= time)
            .clamp(1, count - 1);
        let pair = [&moments[after - 1], &moments[after]];
        let width = times[after] - times[after - 1];
        let fraction = ((time - times[after - 1]) / width).clamp(0.0, 1.0);
        let between = SmplMotion {
            rate_hz: 1.0,
            frames: pair.iter().map(|moment| moment.pose.clone()).collect(),
            ..motion.clone()
        };
        frames.extend(between.pose_at(fraction));
        let seen = width <= GAP * interval || fraction == 0.0 || fraction == 1.0;
        confidence.push(if seen {
            pair[0].confidence.min(pair[1].confidence)
        } else {
            0.0
        });
    }
    SmplMotion {
        rate_hz: 1.0 / interval,
        frames,
        confidence: Some(confidence),
        ..motion
    }
}
