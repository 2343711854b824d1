//! The motions of one person or several, as poses with times.

use std::path::{Path, PathBuf};

use cromosim_body::BodyModel;
use cromosim_motion::{
    MotionOptions, Person, ShapeChoice, SmplMotion, UpAxis, embedded_walk, read_motion_for,
    read_people,
};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_recording::{FIRST_STAMP, MessageHeader, smpl_pose, stamp_of_frame};
use cromosim_spatial::{PoseSource, Stamp};

use crate::config::Config;

/// Motions with their times, on one clock.
pub struct MotionSource {
    tracks: Vec<Track>,
    frame_id: String,
}

/// One person.
struct Track {
    topic: String,
    body_id: String,
    /// Recorded time of the first frame, s after [`FIRST_STAMP`].
    begins_s: f64,
    motion: SmplMotion,
    next: usize,
}

impl MotionSource {
    /// The motions that the configuration names: one as `smpl/pose`, several as
    /// `person_NAME/smpl/pose`.
    ///
    /// # Errors
    /// What is wrong with the file or the settings.
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        let options = options(config)?;
        let one = |motion| Track {
            topic: "smpl/pose".to_owned(),
            body_id: config.body_id.clone(),
            begins_s: 0.0,
            motion,
            next: 0,
        };
        let several = |Person {
                           name,
                           label,
                           begins_s,
                           motion,
                       }| {
            let topic = format!("{label}/smpl/pose");
            Track {
                topic,
                body_id: name,
                begins_s,
                motion,
                next: 0,
            }
        };
        let tracks = if config.motion.is_empty() {
            anyhow::ensure!(
                !options.asks_for_several(),
                "parameter 'person': the embedded walk has one person; name a file by 'motion'"
            );
            vec![one(
                embedded_walk().slice(options.start_s, options.duration_s)?
            )]
        } else {
            let body = if config.body.is_empty() {
                BodyModel::embedded()
            } else {
                BodyModel::read(Path::new(&config.body))?
            };
            let path = Path::new(&config.motion);
            if options.asks_for_several() {
                read_people(path, &body, &options)?
                    .into_iter()
                    .map(several)
                    .collect()
            } else {
                vec![one(read_motion_for(path, &body, &options)?)]
            }
        };
        Ok(Self {
            tracks,
            frame_id: config.frame_id.clone(),
        })
    }

    /// A line about each person.
    pub fn describe(&self) -> String {
        self.tracks
            .iter()
            .map(Track::describe)
            .collect::<Vec<_>>()
            .join("\n")
    }

    /// The topic of each person's poses.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.tracks.iter().map(|track| track.topic.as_str())
    }

    /// Recorded time of the first frame of all, ns.
    pub fn begins(&self) -> i64 {
        self.tracks
            .iter()
            .map(|track| track.recorded(0))
            .min()
            .unwrap_or(FIRST_STAMP.nanos)
    }

    /// Recorded time of the last frame of all, ns.
    pub fn ends(&self) -> i64 {
        self.tracks
            .iter()
            .map(|track| track.recorded(track.motion.frames.len().saturating_sub(1)))
            .max()
            .unwrap_or(FIRST_STAMP.nanos)
    }

    /// The person whose frame comes next, and when; of several at one time the first. None at the
    /// end.
    fn next(&self) -> Option<(i64, usize)> {
        self.tracks
            .iter()
            .enumerate()
            .filter_map(|(person, track)| Some((track.due()?, person)))
            .min()
    }

    /// Recorded time of what comes next, ns.
    pub fn due(&self) -> Option<i64> {
        self.next().map(|(due, _)| due)
    }

    /// What comes next and whose it is, with `stamp`.
    pub fn take(&mut self, stamp: Stamp) -> Option<(usize, SmplPose)> {
        let (_, person) = self.next()?;
        let track = &mut self.tracks[person];
        let message = track.message(&self.frame_id, stamp);
        track.next += 1;
        Some((person, message))
    }

    /// Goes on at each person's first frame at or after `recorded` ns.
    pub fn seek(&mut self, recorded: i64) {
        for track in &mut self.tracks {
            let frames: Vec<usize> = (0..track.motion.frames.len()).collect();
            track.next = frames.partition_point(|&frame| track.recorded(frame) < recorded);
        }
    }
}

impl Track {
    fn recorded(&self, frame: usize) -> i64 {
        stamp_of_frame(&self.motion, frame, self.begins_s).nanos
    }

    fn due(&self) -> Option<i64> {
        (self.next < self.motion.frames.len()).then(|| self.recorded(self.next))
    }

    /// The next frame.
    fn message(&self, frame_id: &str, stamp: Stamp) -> SmplPose {
        let header = MessageHeader {
            stamp,
            frame_id,
            body_id: &self.body_id,
        };
        smpl_pose(&self.motion, self.next, header)
    }

    fn describe(&self) -> String {
        let motion = &self.motion;
        let report = motion
            .how_read()
            .map(|report| format!("; {report}"))
            .unwrap_or_default();
        let source = match motion.source() {
            PoseSource::Tracked => "",
            PoseSource::InertialSuit => "; of a suit: virtual_imu needs pose_source:=inertial_suit",
            PoseSource::Fitted => "; fitted to markers: virtual_imu needs pose_source:=fitted",
            PoseSource::Video => "; from a video: virtual_imu needs pose_source:=video",
        };
        let oddities = motion.oddities();
        let odd: String = oddities.iter().map(|odd| format!("; {odd}")).collect();
        format!(
            "{} on {}: {} frames at {:.2} Hz, {:.2} s{report}{source}{odd}",
            motion.name,
            self.topic,
            motion.frames.len(),
            motion.rate_hz,
            motion.duration_s()
        )
    }
}

/// How the configuration wants motion files to be read.
fn options(config: &Config) -> anyhow::Result<MotionOptions> {
    let up_axis = match config.up_axis.as_str() {
        "auto" => UpAxis::Detect,
        "x" => UpAxis::X,
        "y" => UpAxis::Y,
        "z" => UpAxis::Z,
        other => anyhow::bail!("parameter 'up_axis': expected auto, x, y or z, found '{other}'"),
    };
    let shape = match config.shape.as_str() {
        "detect" => ShapeChoice::Detect,
        "file" => ShapeChoice::File,
        "fit" => ShapeChoice::Fit,
        "mean" => ShapeChoice::Mean,
        other => {
            anyhow::bail!("parameter 'shape': expected detect, file, fit or mean, found '{other}'")
        }
    };
    let said = |text: &String| Some(text.clone()).filter(|text| !text.is_empty());
    Ok(MotionOptions {
        skeleton_map: said(&config.skeleton_map),
        up_axis,
        unit_scale_m: (config.unit_m > 0.0).then_some(config.unit_m),
        start_s: config.start_seconds,
        duration_s: (config.duration_seconds > 0.0).then_some(config.duration_seconds),
        skeleton: said(&config.skeleton).map(PathBuf::from),
        rate_hz: (config.motion_rate_hz > 0.0).then_some(config.motion_rate_hz),
        marker_set: said(&config.marker_set),
        subject: said(&config.subject),
        placements_as_given: config.placements_as_given,
        shape,
        person: said(&config.person),
        source_body: said(&config.source_body).map(PathBuf::from),
        ..MotionOptions::default()
    })
}
