//! From a file to a motion, by the file's content.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_body::BodyModel;

use crate::poses::read_poses;
use crate::text::shortened;
use crate::{
    AMC_RATE_HZ, BvhClip, MarkerClip, MotionError, MotionFormat, MotionOptions, SmplMotion,
    fit_markers, parse_amc, parse_asf, parse_bvh, parse_c3d, parse_motive_markers, parse_mvnx,
    parse_trc, parse_vicon_markers, retarget,
};

/// Larger files are refused: a thousand hours of BVH at 120 Hz are smaller.
const MAX_BYTES: u64 = 4 << 30;

/// Reads a motion file and retargets or fits it to the embedded body. What the file is, is told by
/// its content ([`MotionFormat::of`]), not by its name's ending. BVH, ASF/AMC and MVNX are retargeted; an
/// AMC file takes its skeleton from [`MotionOptions::skeleton`] or from the ASF file beside it. To
/// C3D, TRC and the markers of Motive's and Vicon's tables a body is fitted ([`fit_markers`]). SMPL
/// parameters are packed as npz, pickle, joblib, torch or npy and told by their keys. What nobody can
/// do is refused
/// ([`cromosim_spatial::plausible`]); [`SmplMotion::oddities`] says what is only unlikely.
///
/// # Errors
/// One line that names the file and the place: unreadable, no motion file, wrong content
/// ([`MotionError`]).
pub fn read_motion(path: &Path, options: &MotionOptions) -> Result<SmplMotion, MotionError> {
    read_motion_for(path, &BodyModel::embedded(), options)
}

/// As [`read_motion`], for another body.
///
/// # Errors
/// As [`read_motion`].
pub fn read_motion_for(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<SmplMotion, MotionError> {
    if let Some(motion) = read_poses(path, body, options)? {
        return motion
            .slice(options.start_s, options.duration_s)?
            .possible();
    }
    let bytes = read_bytes(path)?;
    let name = path.display().to_string();
    let text = || String::from_utf8_lossy(&bytes);
    let skeletal = |clip: BvhClip| retarget(&clip, body, options);
    let motion = match MotionFormat::of(&bytes) {
        Some(MotionFormat::Bvh) => skeletal(parse_bvh(&text(), &name)?),
        Some(MotionFormat::Amc) => skeletal(acclaim(path, &text(), options)?),
        Some(MotionFormat::Mvnx) => skeletal(parse_mvnx(&text(), &name)?.clip()?),
        Some(MotionFormat::C3d) => of_markers(&parse_c3d(&bytes, &name)?, body, options),
        Some(MotionFormat::Trc) => of_markers(&parse_trc(&text(), &name)?, body, options),
        Some(MotionFormat::Motive) => {
            of_markers(&parse_motive_markers(&text(), &name)?, body, options)
        }
        Some(MotionFormat::Vicon) => {
            of_markers(&parse_vicon_markers(&text(), &name)?, body, options)
        }
        Some(MotionFormat::Asf) => Err(MotionError::SkeletonOnly {
            path: path.to_owned(),
        }),
        None => {
            let content = text();
            let start = content.trim_start_matches('\u{feff}').trim_start();
            let short: String = start.chars().take(60).collect();
            let found = if bytes.is_empty() {
                "an empty file".to_owned()
            } else {
                format!("\"{}\"", shortened(&short))
            };
            Err(MotionError::UnknownFormat {
                path: path.to_owned(),
                found,
            })
        }
    }?;
    motion
        .slice(options.start_s, options.duration_s)?
        .possible()
}

/// Reads the skeleton of a BVH, AMC or MVNX file as it is, without a map: to draft one
/// ([`crate::SkeletonDraft`]).
///
/// # Errors
/// As [`read_motion`], and [`MotionError::NoJoints`] for other files.
pub fn read_skeleton(path: &Path, options: &MotionOptions) -> Result<BvhClip, MotionError> {
    let bytes = read_bytes(path)?;
    let text = String::from_utf8_lossy(&bytes);
    match MotionFormat::of(&bytes) {
        Some(MotionFormat::Bvh) => parse_bvh(&text, &path.display().to_string()),
        Some(MotionFormat::Amc) => acclaim(path, &text, options),
        Some(MotionFormat::Mvnx) => parse_mvnx(&text, &path.display().to_string())?.clip(),
        _ => Err(MotionError::NoJoints {
            path: path.to_owned(),
        }),
    }
}

fn of_markers(
    clip: &MarkerClip,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<SmplMotion, MotionError> {
    Ok(fit_markers(
        clip,
        body,
        &options.markers_set()?,
        &options.markers_options(),
    )?
    .0)
}

fn acclaim(path: &Path, text: &str, options: &MotionOptions) -> Result<BvhClip, MotionError> {
    let asf = options
        .skeleton
        .clone()
        .map_or_else(|| skeleton_beside(path), Ok)?;
    let bytes = read_bytes(&asf)?;
    let skeleton = parse_asf(&String::from_utf8_lossy(&bytes), &asf.display().to_string())?;
    parse_amc(
        text,
        &path.display().to_string(),
        &skeleton,
        options.rate_hz.unwrap_or(AMC_RATE_HZ),
    )
}

/// The ASF file beside an AMC file whose stem is the longest beginning of the AMC's own: `02.asf`
/// for `02_01.amc`.
fn skeleton_beside(path: &Path) -> Result<PathBuf, MotionError> {
    let stem = |path: &Path| {
        path.file_stem()
            .map(|stem| stem.to_string_lossy().to_ascii_lowercase())
            .unwrap_or_default()
    };
    let own = stem(path);
    let folder = path
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).map_err(|source| MotionError::Read {
        path: folder.to_owned(),
        source,
    })?;
    let mut skeletons: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    skeletons.retain(|path| {
        path.extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("asf"))
    });
    skeletons.sort();
    let begins = |path: &&PathBuf| {
        let rest = own.strip_prefix(&stem(path));
        rest.is_some_and(|rest| {
            rest.is_empty() || !rest.starts_with(|next: char| next.is_alphanumeric())
        })
    };
    let longest = skeletons
        .iter()
        .filter(begins)
        .max_by_key(|path| stem(path).len())
        .cloned();
    longest.ok_or_else(|| MotionError::NoSkeleton {
        path: path.to_owned(),
        found: skeletons
            .iter()
            .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
            .collect(),
    })
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, MotionError> {
    let unreadable = |source| MotionError::Read {
        path: path.to_owned(),
        source,
    };
    let file = cromosim_spatial::open_file(path).map_err(unreadable)?;
    let bytes = file.metadata().map_err(unreadable)?.len();
    if bytes > MAX_BYTES {
        return Err(MotionError::TooLarge {
            path: path.to_owned(),
            bytes,
            limit: MAX_BYTES,
        });
    }
    // A file may grow while it is read.
    let mut content = Vec::new();
    file.take(MAX_BYTES + 1)
        .read_to_end(&mut content)
        .map_err(unreadable)?;
    if content.len() as u64 > MAX_BYTES {
        return Err(MotionError::TooLarge {
            path: path.to_owned(),
            bytes: content.len() as u64,
            limit: MAX_BYTES,
        });
    }
    Ok(content)
}
