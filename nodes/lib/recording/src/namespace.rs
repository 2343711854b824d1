//! Recordings of several robots or people, each in a namespace of its own.

use cromosim_spatial::meant;
use std::collections::BTreeSet;
use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;

use crate::RecordingError;
use crate::pose_source::check_pose_topic;
use crate::topics::TopicMap;

/// Opens a recording as it is seen from within a namespace (`/robot1`; `robot1` is the same): that
/// of `namespace`, or the only one that holds references, SMPL states or IMUs. Gives the namespace
/// too, empty where the topics have none.
///
/// # Errors
/// [`RecordingError::Namespace`] where there is no such namespace, or none was named and there are
/// several; what is wrong with the bag.
pub fn open_recording(
    path: &Path,
    namespace: Option<&str>,
) -> Result<(BagReader, String), RecordingError> {
    let reader = BagReader::open(path)?;
    let known = namespaces(&reader);
    let refuse = |reason: String| RecordingError::Namespace {
        path: path.to_owned(),
        reason,
    };
    let listed = || -> String {
        let names = known.iter().map(|name| match name.as_str() {
            "" => "/",
            name => name,
        });
        names.collect::<Vec<_>>().join(", ")
    };
    let chosen = match namespace.map(|name| name.trim_matches('/')) {
        Some("") => String::new(),
        Some(name) => {
            let name = format!("/{name}");
            if !known.contains(&name) {
                let reason = if known.is_empty() {
                    format!("no topic of a recording is in namespace {name}, nor in any")
                } else {
                    format!(
                        "no topic of a recording is in namespace {name}; there are some in {}{}",
                        listed(),
                        meant(&name, known.iter().map(String::as_str))
                    )
                };
                return Err(refuse(reason));
            }
            name
        }
        None if known.is_empty() || known.contains("") => String::new(),
        None if known.len() == 1 => known.iter().cloned().collect(),
        None => {
            let reason = format!(
                "a recording each is in the namespaces {}; choose one by --namespace",
                listed()
            );
            return Err(refuse(reason));
        }
    };
    Ok(if chosen.is_empty() {
        (reader, chosen)
    } else {
        (reader.within(&chosen), chosen)
    })
}

/// As [`open_recording`], of a recording whose topics have names of their own: where no namespace is
/// chosen, these are as in the bag, and are checked.
///
/// # Errors
/// As [`open_recording`]; a topic that is not there or of a wrong type, with those that would do.
pub fn open_mapped(
    path: &Path,
    namespace: Option<&str>,
    topics: &TopicMap,
) -> Result<(BagReader, String), RecordingError> {
    let namespace = match namespace {
        None if !topics.is_empty() => Some(""),
        other => other,
    };
    let (reader, namespace) = open_recording(path, namespace)?;
    for source in topics.references.values() {
        check_pose_topic(&reader, source)?;
    }
    Ok((reader, namespace))
}

/// The namespaces in which references, SMPL states or IMUs are.
fn namespaces(reader: &BagReader) -> BTreeSet<String> {
    let topics = reader.summary().topics.iter();
    let namespace = |name: &str, type_name: &str| {
        let at = match type_name {
            PoseStamped::TYPE_NAME => name.rfind("/reference/")?,
            SmplState::TYPE_NAME => name.rfind("/smpl/state")?,
            Imu::TYPE_NAME => name.rfind("/imu/")?,
            _ => return None,
        };
        Some(name[..at].to_owned())
    };
    topics
        .filter_map(|counted| namespace(&counted.topic.name, &counted.topic.type_name))
        .collect()
}
