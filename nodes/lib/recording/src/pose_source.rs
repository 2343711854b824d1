//! Poses of any topic that holds some: what robots, trackers and motion capture publish.
//!
//! | type | pose | body |
//! |---|---|---|
//! | `geometry_msgs/msg/PoseStamped` (also of vrpn) | in the header's frame | |
//! | `geometry_msgs/msg/PoseWithCovarianceStamped` | the same | |
//! | `nav_msgs/msg/Odometry` | of the child frame in the header's | the child frame, where there are several |
//! | `geometry_msgs/msg/TransformStamped` | the same | the same |
//! | `mocap4r2_msgs/msg/RigidBodies` | in the header's frame | the rigid body's name |
//! | `tf2_msgs/msg/TFMessage` | composed along the tree, with all of the bag's transforms | the frame |
//!
//! Quaternions are x, y, z, w. Poses are taken as they are: the frame that they are in is the world,
//! z up. Covariances of poses and the velocities of odometry are left alone: filters state them as
//! they were tuned, and a diagnosis learns the noise of a reference from its poses.

use std::collections::BTreeSet;

use cromosim_bag::{BagReader, Message, Selection, Value};
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::{
    Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion, TransformStamped,
};
use cromosim_msgs::nav_msgs::Odometry;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::meant;

use crate::RecordingError;
use crate::frame_tree::FrameTree;
use crate::rigid::PoseTrajectory;
use crate::topics::{PoseSource, other_topics};

/// Motion capture's bodies; its layout changed, so that the bag's own definition is read.
const RIGID_BODIES: &str = "mocap4r2_msgs/msg/RigidBodies";

/// The types that poses are read from.
pub const POSE_TYPES: [&str; 6] = [
    PoseStamped::TYPE_NAME,
    PoseWithCovarianceStamped::TYPE_NAME,
    Odometry::TYPE_NAME,
    TransformStamped::TYPE_NAME,
    RIGID_BODIES,
    TFMessage::TYPE_NAME,
];

/// A topic that can be a reference, and whose poses it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoseTopic {
    /// The topic.
    pub topic: String,
    /// Its bodies or frames; empty where it holds poses without a name.
    pub bodies: Vec<String>,
}

/// The topics of a bag that can be references, in its order. All static transforms belong to the
/// trees of the others.
///
/// # Errors
/// What is wrong with the bag.
pub fn pose_topics(reader: &BagReader) -> Result<Vec<PoseTopic>, RecordingError> {
    let topics = reader.summary().topics.iter().map(|counted| &counted.topic);
    let suiting = topics.filter(|topic| {
        POSE_TYPES.contains(&topic.type_name.as_str()) && !topic.name.ends_with("tf_static")
    });
    let found = suiting.map(|topic| {
        let bodies = match topic.type_name.as_str() {
            TFMessage::TYPE_NAME => {
                let tree = FrameTree::read(reader);
                tree.map_or_else(|_| Vec::new(), |tree| tree.moving_frames())
            }
            // Their poses have no names: nothing to be read.
            PoseStamped::TYPE_NAME | PoseWithCovarianceStamped::TYPE_NAME => Vec::new(),
            _ => {
                let named = named_poses(reader, &topic.name)?;
                let bodies = named.into_iter().filter_map(|(body, _)| body);
                bodies.collect::<BTreeSet<_>>().into_iter().collect()
            }
        };
        Ok(PoseTopic {
            topic: topic.name.clone(),
            bodies,
        })
    });
    found.collect()
}

/// The poses of a source in the order of the bag, NaN and all.
///
/// # Errors
/// A topic that is not there or is of another type, with those that would do; a body that is not
/// there, or that has to be chosen.
pub(crate) fn stamped_poses(
    reader: &BagReader,
    source: &PoseSource,
) -> Result<Vec<PoseStamped>, RecordingError> {
    let wrong = |problem: String| RecordingError::Unsuitable {
        path: format!("{}, {}", reader.path().display(), source.topic).into(),
        problem,
    };
    let topic = reader.topic(&source.topic)?;
    if topic.type_name == TFMessage::TYPE_NAME {
        return poses_of_frame(reader, source);
    }
    if let Some(fixed) = &source.fixed {
        return Err(wrong(format!(
            "@{fixed} is for TF, and this is a topic of {}; leave it out",
            topic.type_name
        )));
    }
    let named = named_poses(reader, &source.topic)?;
    let bodies: BTreeSet<&str> = named
        .iter()
        .filter_map(|(body, _)| body.as_deref())
        .collect();
    let listed = || bodies.iter().copied().collect::<Vec<_>>().join(", ");
    match &source.body {
        Some(body) if bodies.is_empty() => {
            return Err(wrong(format!("its poses have no names; leave :{body} out")));
        }
        Some(body) if !bodies.contains(body.as_str()) => {
            let meant = meant(body, bodies.iter().copied());
            return Err(wrong(format!(
                "no body {body}; there are {}{meant}",
                listed()
            )));
        }
        None if bodies.len() > 1 => {
            return Err(wrong(format!(
                "poses of several bodies; say which by {}:BODY, one of {}",
                source.topic,
                listed()
            )));
        }
        _ => {}
    }
    let wanted = source.body.as_deref();
    let chosen = named
        .iter()
        .filter(|(body, _)| wanted.is_none() || body.as_deref() == wanted);
    Ok(chosen.map(|(_, pose)| pose.clone()).collect())
}

/// Refuses a source whose topic is not there or holds no poses.
///
/// # Errors
/// With the topics that would do.
pub(crate) fn check_pose_topic(
    reader: &BagReader,
    source: &PoseSource,
) -> Result<(), RecordingError> {
    let found = &reader.topic(&source.topic)?.type_name;
    if POSE_TYPES.contains(&found.as_str()) {
        return Ok(());
    }
    Err(RecordingError::Unsuitable {
        path: format!("{}, {}", reader.path().display(), source.topic).into(),
        problem: format!(
            "a topic of {found}; references are {}{}",
            POSE_TYPES.join(", "),
            other_topics(reader, &POSE_TYPES)
        ),
    })
}

/// Where a frame of the bag's tree is.
fn poses_of_frame(
    reader: &BagReader,
    source: &PoseSource,
) -> Result<Vec<PoseStamped>, RecordingError> {
    let trajectory = frame_trajectory(reader, source)?;
    let poses = trajectory.positions.iter().zip(&trajectory.rotations);
    let stamped = trajectory.stamps.iter().zip(poses);
    let stamped = stamped.map(|(stamp, (position, rotation))| PoseStamped {
        header: Header::new(stamp.nanos, trajectory.frame.as_str()),
        pose: Pose {
            position: (*position).into(),
            orientation: (*rotation).into(),
        },
    });
    Ok(stamped.collect())
}

/// The trajectory of a source's frame; normalised once, as poses of other types are.
pub(crate) fn frame_trajectory(
    reader: &BagReader,
    source: &PoseSource,
) -> Result<PoseTrajectory, RecordingError> {
    let tree = FrameTree::read(reader)?;
    let Some(frame) = &source.body else {
        return Err(RecordingError::Unsuitable {
            path: format!("{}, {}", reader.path().display(), source.topic).into(),
            problem: format!(
                "a tree of frames; say which by {}:FRAME or {0}:FRAME@FIXED, of {}",
                source.topic,
                tree.known()
            ),
        });
    };
    tree.trajectory(frame, source.fixed.as_deref())
}

/// The poses of a topic other than TF, each with its body's name where the type has one.
fn named_poses(
    reader: &BagReader,
    topic: &str,
) -> Result<Vec<(Option<String>, PoseStamped)>, RecordingError> {
    let mut named = Vec::new();
    match reader.topic(topic)?.type_name.as_str() {
        PoseStamped::TYPE_NAME => {
            let messages = reader.read::<PoseStamped>(topic)?.into_iter();
            named.extend(messages.map(|(_, message)| (None, message)));
        }
        PoseWithCovarianceStamped::TYPE_NAME => {
            for (_, message) in reader.read::<PoseWithCovarianceStamped>(topic)? {
                let (header, pose) = (message.header, message.pose.pose);
                named.push((None, PoseStamped { header, pose }));
            }
        }
        Odometry::TYPE_NAME => {
            for (_, message) in reader.read::<Odometry>(topic)? {
                let (header, pose) = (message.header, message.pose.pose);
                named.push((Some(message.child_frame_id), PoseStamped { header, pose }));
            }
        }
        TransformStamped::TYPE_NAME => {
            for (_, message) in reader.read::<TransformStamped>(topic)? {
                let (header, moved) = (message.header, message.transform);
                let Quaternion { x, y, z, w } = moved.rotation;
                let pose = Pose {
                    position: Point {
                        x: moved.translation.x,
                        y: moved.translation.y,
                        z: moved.translation.z,
                    },
                    orientation: Quaternion { x, y, z, w },
                };
                named.push((Some(message.child_frame_id), PoseStamped { header, pose }));
            }
        }
        RIGID_BODIES => {
            for message in reader.messages(&Selection::topic(topic))? {
                add_rigid_bodies(reader, &message?, &mut named)?;
            }
        }
        _ => check_pose_topic(reader, &PoseSource::topic(topic))?,
    }
    Ok(named)
}

/// All bodies of a message of motion capture, under the message's stamp.
fn add_rigid_bodies(
    reader: &BagReader,
    message: &Message,
    named: &mut Vec<(Option<String>, PoseStamped)>,
) -> Result<(), RecordingError> {
    let wrong = |problem: String| RecordingError::Unsuitable {
        path: format!("{}, {}", reader.path().display(), message.topic.name).into(),
        problem: format!(
            "the message at {:.6} s: {problem}",
            message.log_time.as_seconds()
        ),
    };
    let values = message.values().map_err(wrong)?;
    let lacks = |field: &str| wrong(format!("its definition has no {field}"));
    let number = |of: &Value, path: &[&str]| of.number(path).ok_or_else(|| lacks(&path.join(".")));
    let nanos = 1_000_000_000 * number(&values, &["header", "stamp", "sec"])? as i64
        + number(&values, &["header", "stamp", "nanosec"])? as i64;
    let frame = values.text(&["header", "frame_id"]).unwrap_or_default();
    let bodies = values.list(&["rigidbodies"]);
    for body in bodies.ok_or_else(|| lacks("rigidbodies"))? {
        let name = body.text(&["rigid_body_name"]);
        let name = name.ok_or_else(|| lacks("rigidbodies.rigid_body_name"))?;
        let at = |axis| number(body, &["pose", "position", axis]);
        let turned = |axis| number(body, &["pose", "orientation", axis]);
        let pose = Pose {
            position: Point {
                x: at("x")?,
                y: at("y")?,
                z: at("z")?,
            },
            orientation: Quaternion {
                x: turned("x")?,
                y: turned("y")?,
                z: turned("z")?,
                w: turned("w")?,
            },
        };
        let header = Header::new(nanos, frame);
        named.push((Some(name.to_owned()), PoseStamped { header, pose }));
    }
    Ok(())
}
