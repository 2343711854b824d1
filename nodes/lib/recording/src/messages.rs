//! A motion's frames as messages, and the time at which they begin.

use cromosim_motion::SmplMotion;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

/// Stamp of a motion's first frame in every bag and on every topic: 1 s, since TF takes 0 for "the
/// latest". Data sets whose stamps begin earlier are moved to it.
pub const FIRST_STAMP: Stamp = Stamp::from_nanos(1_000_000_000);

/// Stamp of a motion's frame that stands at a constant rate from [`FIRST_STAMP`] on; `begins_s` is
/// how much later than others of the same file a person appears, s.
pub fn stamp_of_frame(motion: &SmplMotion, frame: usize, begins_s: f64) -> Stamp {
    FIRST_STAMP.plus_seconds(begins_s + frame as f64 / motion.rate_hz)
}

/// What a message says beside the pose itself.
#[derive(Clone, Copy, Debug)]
pub struct MessageHeader<'a> {
    /// When the pose was taken.
    pub stamp: Stamp,
    /// The frame that the root's pose is in: `world`, unless a node is told otherwise.
    pub frame_id: &'a str,
    /// Tells several people apart.
    pub body_id: &'a str,
}

/// A frame of a motion as `/smpl/pose` carries it. Without confidences every frame is sure: 1.
///
/// # Panics
/// Where the motion has no such frame.
pub fn smpl_pose(motion: &SmplMotion, frame: usize, header: MessageHeader<'_>) -> SmplPose {
    let body = &motion.frames[frame];
    let mut message = SmplPose {
        header: Header::new(header.stamp.nanos, header.frame_id),
        body_id: header.body_id.to_owned(),
        gender: motion.gender.name().to_owned(),
        betas: motion.betas.clone(),
        shape_space: motion.shape_space.name().to_owned(),
        confidence: motion
            .confidence
            .as_ref()
            .map_or(1.0, |values| values[frame]),
        ..SmplPose::default()
    };
    message.set_root_and_rotations(body.root_position, &body.local_rotations);
    message
}

/// A frame of a motion as `/smpl/state` carries it: [`smpl_pose`] with nothing changed.
///
/// # Panics
/// As [`smpl_pose`].
pub fn smpl_state(motion: &SmplMotion, frame: usize, header: MessageHeader<'_>) -> SmplState {
    smpl_pose(motion, frame, header).into()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn messages_say_what_the_motion_says() {
        let motion = SmplMotion {
            confidence: Some(vec![0.25; 5]),
            ..cromosim_motion::embedded_walk()
                .slice(0.0, Some(1.0))
                .unwrap()
        };
        let header = MessageHeader {
            stamp: stamp_of_frame(&motion, 3, 0.5),
            frame_id: "world",
            body_id: "7",
        };
        let (pose, state) = (
            smpl_pose(&motion, 3, header),
            smpl_state(&motion, 3, header),
        );
        assert_eq!(pose.confidence, 0.25);
        assert_eq!(
            (pose.body_id.as_str(), pose.betas.len()),
            ("7", motion.betas.len())
        );
        assert_eq!(
            pose.header.stamp.nanos(),
            FIRST_STAMP.plus_seconds(0.5 + 3.0 / motion.rate_hz).nanos
        );
        assert_eq!(state, SmplState::from(pose));
        let (position, _) = state.root_and_rotations().unwrap();
        assert_eq!(position, motion.frames[3].root_position);
    }
}
