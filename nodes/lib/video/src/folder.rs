//! The files of a shot: which belongs to which frame, and opening them. What stands in them is read
//! by the parsers.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use nalgebra::Vector2;

use crate::clip::DepthProvider;
use crate::depth_map::{DepthEncoding, DepthMap, MAX_DEPTH_PIXELS, parse_depth, parse_plain_depth};
use crate::error::VideoError;
use crate::keypoints::{PersonKeypoints, track_person};
use crate::openpose::parse_openpose;
use crate::parameters::parse_camera;
use crate::pinhole::{Camera, CameraAxes};

/// Larger files are no frame.
const MAX_BYTES: u64 = 8 * MAX_DEPTH_PIXELS as u64 + 4096;
/// More frames than this are refused: nine hours at 30 Hz.
const MAX_FRAMES: usize = 1_000_000;

/// What the files do not say themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FolderLayout {
    /// What the depth maps hold.
    pub encoding: DepthEncoding,
    /// Which way the cameras' axes point.
    pub axes: CameraAxes,
    /// Width and height of the image of the keypoints (the video), px.
    pub keypoint_image_px: Vector2<f64>,
    /// Width and height of the image that the intrinsics are for, px.
    pub intrinsics_image_px: Vector2<f64>,
    /// Number of the first frame in the files' names: 0 as OpenPose and Robust CVD count, 1 where a
    /// tool counts from 1.
    pub first_number: usize,
    /// Width and height of depth maps without a header (plain float32); `None` for maps that say it
    /// themselves.
    pub plain_depth_px: Option<[usize; 2]>,
}

/// The folders of a shot; they may be the same one.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFolder {
    /// Of OpenPose's `*_keypoints.json`.
    pub keypoints: PathBuf,
    /// Of `frame_NNNNNN.raw`, `.npy` or `.png`.
    pub depth: PathBuf,
    /// Of `frame_NNNNNN.npz`.
    pub cameras: PathBuf,
    /// What they do not say.
    pub layout: FolderLayout,
}

/// What stood in the folders, but for the depth maps.
#[derive(Clone, Debug)]
pub struct FolderFrames {
    /// The followed person.
    pub keypoints: Vec<Option<PersonKeypoints>>,
    /// Cameras.
    pub cameras: Vec<Option<Camera>>,
    /// Depth maps, read when asked for.
    pub depth: FolderDepth,
}

/// Depth maps in files, each read when its frame is asked for.
#[derive(Clone, Debug)]
pub struct FolderDepth {
    files: BTreeMap<usize, PathBuf>,
    layout: FolderLayout,
}

impl CameraFolder {
    /// Reads keypoints and cameras and lists the depth maps. A file's frame is the last number of
    /// its name less [`FolderLayout::first_number`]. `frames` is the number of frames; files beyond
    /// it are left alone.
    ///
    /// # Errors
    /// [`VideoError::Read`], [`VideoError::NoFrames`], and those of the parsers.
    pub fn read(&self, frames: usize, least_confidence: f64) -> Result<FolderFrames, VideoError> {
        let frames = frames.min(MAX_FRAMES);
        let keypoint_files =
            self.numbered(&self.keypoints, &["_keypoints.json"], "*_keypoints.json")?;
        let camera_files = self.numbered(&self.cameras, &[".npz"], "frame_NNNNNN.npz")?;
        let depth_files = self.numbered(
            &self.depth,
            &[".raw", ".npy", ".png"],
            "frame_NNNNNN.raw, .npy or .png",
        )?;
        let mut people = Vec::with_capacity(frames);
        let mut cameras = Vec::with_capacity(frames);
        for frame in 0..frames {
            people.push(match keypoint_files.get(&frame) {
                Some(path) => parse_openpose(&read(path)?, &path.display().to_string())?,
                None => Vec::new(),
            });
            cameras.push(match camera_files.get(&frame) {
                Some(path) => {
                    let name = path.display().to_string();
                    Some(parse_camera(
                        &read(path)?,
                        self.layout.intrinsics_image_px,
                        self.layout.axes,
                        &name,
                    )?)
                }
                None => None,
            });
        }
        let chosen = track_person(&people, least_confidence);
        let keypoints = people
            .iter()
            .zip(chosen)
            .map(|(people, person)| people.get(person?).copied())
            .collect();
        Ok(FolderFrames {
            keypoints,
            cameras,
            depth: FolderDepth {
                files: depth_files,
                layout: self.layout,
            },
        })
    }

    /// Files with one of the endings by frame; where a frame has several, the one with the first
    /// ending.
    fn numbered(
        &self,
        folder: &Path,
        endings: &[&str],
        expected: &'static str,
    ) -> Result<BTreeMap<usize, PathBuf>, VideoError> {
        let unreadable = |source| VideoError::Read {
            path: folder.to_owned(),
            source,
        };
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let name = path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default();
            let stem = endings
                .iter()
                .enumerate()
                .find_map(|(rank, ending)| Some((rank, name.strip_suffix(ending)?)));
            let frame = stem.and_then(|(rank, stem)| {
                Some((
                    last_number(stem)?.checked_sub(self.layout.first_number)?,
                    rank,
                ))
            });
            if let Some((frame, rank)) = frame {
                found.push((frame, rank, path));
            }
        }
        if found.is_empty() {
            return Err(VideoError::NoFrames {
                path: folder.to_owned(),
                expected,
            });
        }
        // The first of a frame is inserted last.
        found.sort();
        Ok(found
            .into_iter()
            .rev()
            .map(|(frame, _, path)| (frame, path))
            .collect())
    }
}

impl DepthProvider for FolderDepth {
    fn depth(&mut self, frame: usize) -> Result<Option<DepthMap>, VideoError> {
        let Some(path) = self.files.get(&frame) else {
            return Ok(None);
        };
        let (bytes, name) = (read(path)?, path.display().to_string());
        match self.layout.plain_depth_px {
            Some([width, height]) => {
                parse_plain_depth(&bytes, width, height, self.layout.encoding, &name)
            }
            None => parse_depth(&bytes, self.layout.encoding, &name),
        }
        .map(Some)
    }
}

fn last_number(stem: &str) -> Option<usize> {
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |place| {
            place + stem[place..].chars().next().map_or(1, char::len_utf8)
        });
    stem[start..end].parse().ok()
}

fn read(path: &Path) -> Result<Vec<u8>, VideoError> {
    let unreadable = |source| VideoError::Read {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    cromosim_spatial::open_file(path)
        .map_err(unreadable)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(VideoError::TooLarge {
            name: path.display().to_string(),
            bytes: bytes.len() as u64,
            limit: MAX_BYTES,
        });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::last_number;

    #[test]
    fn frames_are_numbered_by_the_last_number_of_the_name() {
        assert_eq!(last_number("frame_000012"), Some(12));
        assert_eq!(last_number("GH01_000000000007"), Some(7));
        assert_eq!(last_number("clip2é05x"), Some(5));
        assert_eq!(
            (last_number("frame"), last_number("99999999999999999999999")),
            (None, None)
        );
    }
}
