//! What a motion file is, told by its content.

use crate::{c3d, marker_tables, mvnx, trc};

/// The motion files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MotionFormat {
    /// Biovision hierarchy: begins with HIERARCHY.
    Bvh,
    /// Acclaim skeleton: begins with a section such as `:version`. No motion by itself.
    Asf,
    /// Acclaim motion: begins with `:FULLY-SPECIFIED`, `:DEGREES` or the first frame's number and
    /// `root`.
    Amc,
    /// A suit's recording as XML: its first element is `mvnx`.
    Mvnx,
    /// Markers in binary: second byte 0x50.
    C3d,
    /// Markers as a table: begins with PathFileType.
    Trc,
    /// OptiTrack Motive's table, which may hold markers: begins with Format Version.
    Motive,
    /// Vicon's table, which may hold markers: begins with a section's name and its rate.
    Vicon,
}

impl MotionFormat {
    /// What `bytes` (a file's beginning, 4 KiB are plenty) belong to; `None` for anything else.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if c3d::is_c3d(bytes) {
            return Some(Self::C3d);
        }
        let text = String::from_utf8_lossy(&bytes[..bytes.len().min(1 << 16)]);
        let start = text.trim_start_matches('\u{feff}').trim_start();
        if start
            .get(..9)
            .is_some_and(|word| word.eq_ignore_ascii_case("HIERARCHY"))
        {
            return Some(Self::Bvh);
        }
        if trc::is_trc(start) {
            return Some(Self::Trc);
        }
        if mvnx::is_mvnx(start) {
            return Some(Self::Mvnx);
        }
        if marker_tables::is_motive(start) {
            return Some(Self::Motive);
        }
        if marker_tables::is_vicon(start) {
            return Some(Self::Vicon);
        }
        let mut lines = start
            .lines()
            .map(str::trim)
            .filter(|line| !line.is_empty() && !line.starts_with('#'));
        let first = lines.next()?.to_ascii_lowercase();
        let section = first.split_whitespace().next().unwrap_or_default();
        match section {
            ":fully-specified" | ":degrees" | ":radians" => Some(Self::Amc),
            ":version" | ":name" | ":units" | ":documentation" | ":root" | ":bonedata"
            | ":hierarchy" => Some(Self::Asf),
            number
                if number.parse::<u64>().is_ok()
                    && lines.next().is_some_and(|line| line.starts_with("root ")) =>
            {
                Some(Self::Amc)
            }
            _ => None,
        }
    }

    /// The format's name: `ASF/AMC` for both files of Acclaim.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bvh => "BVH",
            Self::Asf | Self::Amc => "ASF/AMC",
            Self::Mvnx => "MVNX",
            Self::C3d => "C3D",
            Self::Trc => "TRC",
            Self::Motive => "Motive's CSV",
            Self::Vicon => "Vicon's CSV",
        }
    }
}
