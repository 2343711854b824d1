//! Poses of a body on a topic of a bag as a motion at a constant rate.

use std::sync::Arc;

use anyhow::{Context, bail};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose, Gender};
use cromosim_motion::SmplMotion;
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_recording::body_for_bag;
use cromosim_spatial::Stamp;

/// Frames nearer to a constant rate than this stay as they are, s.
const JITTER_S: f64 = 1e-5;
/// Poses further apart than so many intervals have a gap between them, in which nobody saw the
/// body.
const GAP: f64 = 2.5;
/// A bag with a gap of days is no motion.
const MAX_FRAMES: f64 = 2e7;

/// The types of such topics, the one to be preferred first.
pub fn types() -> [&'static str; 2] {
    [SmplState::TYPE_NAME, SmplPose::TYPE_NAME]
}

/// One moment of the topic.
struct Moment {
    stamp: Stamp,
    pose: BodyPose,
    confidence: f64,
}

/// The motion on a topic of SmplState or SmplPose: of the body that `person` names, at the median
/// rate. Betas are the last message's.
pub fn motion(
    reader: &BagReader,
    topic: &str,
    person: Option<&str>,
    given: Option<&Arc<BodyModel>>,
) -> anyhow::Result<SmplMotion> {
    let place = format!("{}, {topic}", reader.path().display());
    let mut states: Vec<SmplState> = if reader.topic(topic)?.type_name == SmplPose::TYPE_NAME {
        reader
            .read::<SmplPose>(topic)?
            .into_iter()
            .map(|(_, pose)| pose.into())
            .collect()
    } else {
        reader
            .read::<SmplState>(topic)?
            .into_iter()
            .map(|(_, state)| state)
            .collect()
    };
    let mut people: Vec<String> = states.iter().map(|state| state.body_id.clone()).collect();
    people.sort();
    people.dedup();
    match person {
        Some(person) => states.retain(|state| state.body_id == person),
        None if people.len() > 1 => bail!(
            "{place}: several bodies; give --person, one of {}",
            people.join(", ")
        ),
        None => {}
    }
    states.sort_by_key(|state| state.header.stamp.nanos());
    states.dedup_by_key(|state| state.header.stamp.nanos());
    let Some(last) = states.last() else {
        bail!(
            "{place}: no pose{}; there are bodies {}",
            person
                .map(|person| format!(" of {person}"))
                .unwrap_or_default(),
            people.join(", ")
        )
    };
    let model = body_for_bag(reader, given)?;
    model
        .check_named_betas(&last.shape_space, &last.gender, &last.betas)
        .with_context(|| place.clone())?;
    let (gender, betas) = (
        Gender::from_name(&last.gender).unwrap_or_default(),
        last.betas.clone(),
    );
    let moment = |state: &SmplState| {
        let (root_position, local_rotations) = state.root_and_rotations()?;
        let stamp = Stamp::from_nanos(state.header.stamp.nanos());
        anyhow::Ok(Moment {
            stamp,
            pose: BodyPose {
                root_position,
                local_rotations,
            },
            confidence: state.confidence.clamp(0.0, 1.0),
        })
    };
    let moments = states
        .iter()
        .map(moment)
        .collect::<anyhow::Result<Vec<_>>>()?;
    if moments.len() < 2 {
        bail!("{place}: one pose is no motion");
    }
    let motion = SmplMotion {
        name: place.clone(),
        rate_hz: 0.0,
        gender,
        betas,
        shape_space: model.shape_space(),
        frames: Vec::new(),
        confidence: None,
        report: None,
        markers: None,
        poses: None,
    };
    at_constant_rate(motion, &moments)
}

/// As they are where they stand at a constant rate; interpolated at their median rate elsewhere, in
/// gaps without confidence.
fn at_constant_rate(motion: SmplMotion, moments: &[Moment]) -> anyhow::Result<SmplMotion> {
    let times: Vec<f64> = moments
        .iter()
        .map(|moment| moment.stamp - moments[0].stamp)
        .collect();
    let (count, last) = (times.len(), times[times.len() - 1]);
    // Stamps are whole nanoseconds: a rate is known to no more than that.
    let mean = |count: usize| (1e6 * (count - 1) as f64 / last).round() / 1e6;
    let even = mean(count);
    if times
        .iter()
        .enumerate()
        .all(|(index, time)| (time - index as f64 / even).abs() < JITTER_S)
    {
        let frames = moments.iter().map(|moment| moment.pose.clone()).collect();
        let confidence = Some(moments.iter().map(|moment| moment.confidence).collect());
        return Ok(SmplMotion {
            rate_hz: even,
            frames,
            confidence,
            ..motion
        });
    }
    let mut intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    let interval = intervals[intervals.len() / 2];
    if last / interval > MAX_FRAMES {
        bail!(
            "{}: {last:.0} s at {:.1} Hz; cut the bag into parts",
            motion.name,
            1.0 / interval
        );
    }
    let steps = (last / interval + 1e-6).floor() as usize;
    eprintln!(
        "{}: stamps are not evenly spaced; interpolated at {:.3} Hz",
        motion.name,
        1.0 / interval
    );
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
    Ok(SmplMotion {
        rate_hz: 1.0 / interval,
        frames,
        confidence: Some(confidence),
        ..motion
    })
}
