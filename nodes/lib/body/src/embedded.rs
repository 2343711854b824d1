//! The body that is part of the program; made for it by `scripts/build.py`.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use cromosim_arrays::{Container, Limits};
use serde::Deserialize;

use crate::gender::Gender;
use crate::posedirs::{ClosedForm, Constants};
use crate::read::read_without_posedirs;
use crate::site::NamedSite;
use crate::{BodyError, BodyModel, JOINT_COUNT, ShapeSpace};

static ARRAYS: &[u8] = include_bytes!("../assets/body-without-posedirs.npz");
static POSEDIRS: &str = include_str!("../assets/posedirs.json");
/// Triangle, barycentrics, joint and point of each named site.
static SITES: &str = include_str!("../assets/sites.json");

impl BodyModel {
    /// The body of this project: an adult of 1.70 m and 70 kg in SMPL's structure with 6954
    /// vertices and 10 betas, each one standard deviation: stature, mass, leg to trunk ratio,
    /// shoulder breadth, hip breadth, arm length, belly, muscle, sex dimorphism, extremity size.
    /// They are not SMPL's betas: fit them to bone lengths instead of taking them from a motion
    /// file.
    ///
    /// The first call unpacks it; later calls share it.
    pub fn embedded() -> Arc<Self> {
        static BODY: OnceLock<Arc<BodyModel>> = OnceLock::new();
        // A broken asset is a fault of the build and not of any input: a test loads it.
        BODY.get_or_init(|| Arc::new(load().expect("the embedded body is sound")))
            .clone()
    }
}

fn load() -> Result<BodyModel, BodyError> {
    let path = Path::new("cromosim_neutral");
    let mut arrays =
        Container::new(Cursor::new(ARRAYS), path, Limits::default()).map_err(BodyError::Arrays)?;
    let mut raw = read_without_posedirs(&mut arrays)?.reduced()?;
    raw.space = ShapeSpace::Cromosim;
    raw.gender = Some(Gender::Neutral);
    // The exact joints that the constants were made with; J_regressor gives them back within 0.02
    // mm.
    let joints = arrays
        .at("J")
        .and_then(|entry| entry.floats(&[Some(JOINT_COUNT), Some(3)], "(24, 3)"))
        .map_err(BodyError::Arrays)?;
    let constants: Constants =
        serde_json::from_str(POSEDIRS).expect("the embedded constants are sound");
    raw.pose_blocks = ClosedForm::new(constants, &raw.template, &raw.faces, &joints.values).into();
    let mut body = BodyModel::from_raw(raw)?;
    body.sites = embedded_sites(&body)?;
    Ok(body)
}

/// One entry of `assets/sites.json`.
#[derive(Deserialize)]
struct SiteRecord {
    triangle: u32,
    bary: [f64; 3],
}

/// The sites of `assets/sites.json` on the body they were made for.
pub(crate) fn embedded_sites(body: &BodyModel) -> Result<Vec<NamedSite>, BodyError> {
    let records: BTreeMap<String, SiteRecord> =
        serde_json::from_str(SITES).expect("the embedded sites are sound");
    let site = |(name, record): (String, SiteRecord)| {
        Ok(NamedSite {
            name,
            site: body.site_at(record.triangle, record.bary)?,
        })
    };
    records.into_iter().map(site).collect()
}
