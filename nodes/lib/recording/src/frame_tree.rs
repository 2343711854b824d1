//! A bag's tree of frames (`/tf`, `/tf_static`): where one frame is in another over time.

use cromosim_spatial::meant;
use std::collections::BTreeMap;

use cromosim_bag::BagReader;
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::TransformStamped;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion};

use crate::RecordingError;
use crate::rigid::PoseTrajectory;

/// A frame's way through its parent.
struct Branch {
    parent: String,
    /// parent_from_child; stamps increase. Of a static frame there is one, which holds for ever.
    poses: Vec<(Stamp, Isometry3<f64>)>,
    is_static: bool,
}

/// Frames by their names.
pub(crate) struct FrameTree<'a> {
    reader: &'a BagReader,
    branches: BTreeMap<String, Branch>,
}

impl<'a> FrameTree<'a> {
    /// All transforms of the bag's TFMessage topics; those of topics that end in `tf_static` hold
    /// for ever.
    pub fn read(reader: &'a BagReader) -> Result<Self, RecordingError> {
        let mut tree = Self {
            reader,
            branches: BTreeMap::new(),
        };
        let topics = reader.summary().topics.iter();
        for counted in topics.filter(|counted| counted.topic.type_name == TFMessage::TYPE_NAME) {
            let topic = &counted.topic.name;
            for (_, message) in reader.read::<TFMessage>(topic)? {
                for transform in message.transforms {
                    tree.add(topic, transform)?;
                }
            }
        }
        for branch in tree.branches.values_mut() {
            branch.poses.sort_by_key(|(stamp, _)| *stamp);
            branch.poses.dedup_by_key(|(stamp, _)| *stamp);
        }
        if tree.branches.is_empty() {
            return Err(RecordingError::Unsuitable {
                path: reader.path().to_owned(),
                problem: format!("no topic of {} with transforms", TFMessage::TYPE_NAME),
            });
        }
        Ok(tree)
    }

    fn add(&mut self, topic: &str, transform: TransformStamped) -> Result<(), RecordingError> {
        let stamp = Stamp::from_nanos(transform.header.stamp.nanos());
        let (parent, child) = (transform.header.frame_id, transform.child_frame_id);
        let pose = transform
            .transform
            .try_into()
            .map_err(|source| RecordingError::Pose {
                path: self.reader.path().to_owned(),
                topic: format!("{topic}, frame {child}"),
                seconds: stamp.as_seconds(),
                source,
            })?;
        let branch = self
            .branches
            .entry(child.clone())
            .or_insert_with(|| Branch {
                parent: parent.clone(),
                poses: Vec::new(),
                is_static: topic.ends_with("tf_static"),
            });
        if branch.parent != parent {
            return Err(RecordingError::TwoParents {
                path: self.reader.path().to_owned(),
                topic: topic.to_owned(),
                frame: child,
                parents: [branch.parent.clone(), parent],
            });
        }
        branch.poses.push((stamp, pose));
        Ok(())
    }

    /// The frames' names.
    pub fn known(&self) -> String {
        self.branches.keys().cloned().collect::<Vec<_>>().join(", ")
    }

    /// The names of the frames that move against what they hang on.
    pub fn moving_frames(&self) -> Vec<String> {
        let moving = self.branches.iter().filter(|(_, branch)| !branch.is_static);
        moving.map(|(name, _)| name.clone()).collect()
    }

    fn meant(&self, frame: &str) -> String {
        meant(frame, self.branches.keys().map(String::as_str))
    }

    fn wrong(&self, problem: String) -> RecordingError {
        RecordingError::Unsuitable {
            path: self.reader.path().to_owned(),
            problem,
        }
    }

    /// Frame by frame from `frame` to `fixed`, or to the root.
    fn chain(
        &self,
        frame: &str,
        fixed: Option<&str>,
    ) -> Result<(Vec<&Branch>, String), RecordingError> {
        let mut chain: Vec<&Branch> = Vec::new();
        let mut at = frame;
        while fixed != Some(at) {
            let Some(branch) = self.branches.get(at) else {
                match fixed {
                    None if !chain.is_empty() => break,
                    Some(fixed) if !chain.is_empty() => {
                        return Err(self.wrong(format!(
                            "frame {frame} does not hang on {fixed}; the root above it is {at}"
                        )));
                    }
                    _ => {
                        let (known, meant) = (self.known(), self.meant(frame));
                        return Err(
                            self.wrong(format!("no frame {frame}; there are {known}{meant}"))
                        );
                    }
                }
            };
            chain.push(branch);
            if chain.len() > self.branches.len() {
                return Err(self.wrong(format!("frame {frame} hangs on itself")));
            }
            at = &branch.parent;
        }
        Ok((chain, at.to_owned()))
    }

    /// Where `frame` is in `fixed` (default: the root), at the stamps of the nearest of its frames
    /// that moves; frames above it are interpolated, linearly and the shortest way round. Stamps at
    /// which one of them is not known are left out.
    pub fn trajectory(
        &self,
        frame: &str,
        fixed: Option<&str>,
    ) -> Result<PoseTrajectory, RecordingError> {
        let (chain, fixed) = self.chain(frame, fixed)?;
        let Some(moving) = chain.iter().find(|branch| !branch.is_static) else {
            return Err(self.wrong(format!(
                "frame {frame} stands still in {fixed}: it has no stamps of its own"
            )));
        };
        let mut trajectory = PoseTrajectory {
            frame: fixed,
            ..PoseTrajectory::default()
        };
        for (stamp, _) in &moving.poses {
            let pose = chain
                .iter()
                .try_fold(Isometry3::identity(), |below, branch| {
                    Some(branch.at(*stamp)? * below)
                });
            if let Some(pose) = pose {
                trajectory.push(*stamp, pose.translation.vector, pose.rotation);
            }
        }
        if trajectory.stamps.is_empty() {
            return Err(self.wrong(format!(
                "frame {frame} is known at no time at which the frames above it are"
            )));
        }
        Ok(trajectory)
    }
}

impl Branch {
    /// parent_from_child at a time; none before the first and after the last of a moving frame.
    fn at(&self, stamp: Stamp) -> Option<Isometry3<f64>> {
        if self.is_static {
            return self.poses.last().map(|(_, pose)| *pose);
        }
        let after = self.poses.partition_point(|(known, _)| *known < stamp);
        let (next, pose) = self.poses.get(after)?;
        if *next == stamp {
            return Some(*pose);
        }
        let (before, from) = self.poses.get(after.checked_sub(1)?)?;
        let fraction = (stamp - *before) / (*next - *before);
        let position = from
            .translation
            .vector
            .lerp(&pose.translation.vector, fraction);
        let turn = (from.rotation.inverse() * pose.rotation).scaled_axis() * fraction;
        Some(Isometry3::from_parts(
            position.into(),
            from.rotation * UnitQuaternion::from_scaled_axis(turn),
        ))
    }
}
