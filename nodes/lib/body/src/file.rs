//! Bodies from files.

use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use cromosim_arrays::{ArraysError, Container, Limits};

use crate::read::read_model;
use crate::transfer::transferred_sites;
use crate::{BodyError, BodyModel, ShapeSpace};

impl BodyModel {
    /// Reads a model file of SMPL, SMPL-H or SMPL-X, npz or pickle (with chumpy and scipy objects
    /// too), told by its content: v_template (V, 3), m, shapedirs (V, 3, B), posedirs (V, 3, 9 (J -
    /// 1)), J_regressor (J, V), weights (V, J), kintree_table (2, J) and f (F, 3) with J = 24, 52
    /// or 55; numbers of any type. Other keys are passed over, `gender` aside. Without it the
    /// gender is read off the name of the file or of its folder, such as `SMPL_FEMALE.npz` and
    /// `female/model.npz`.
    ///
    /// SMPL-H and SMPL-X keep their mesh, shapes and body joints and become bodies of 24 joints.
    /// While fingers, jaw and eyes keep their rest rotation (a flat hand) this is exact. Fingers
    /// follow SMPL's hand joint, placed at the root of the middle finger; jaw and eyes follow the
    /// head; expressions of SMPL-X are left out (its columns from 300 on, or from 10 on of 20).
    ///
    /// # Errors
    /// Every [`BodyError`] that names a path: a file that is cut short, lacks a key, holds wrong
    /// shapes, NaN, or indices out of range.
    pub fn read(path: &Path) -> Result<Arc<Self>, BodyError> {
        let file = cromosim_spatial::open_file(path).map_err(|source| {
            BodyError::Arrays(ArraysError::Open {
                path: path.to_owned(),
                source,
            })
        })?;
        Self::from_reader(BufReader::new(file), path)
    }

    /// Like [`Self::read`] from any reader; `path` names it, in errors too.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_reader(reader: impl Read + Seek, path: &Path) -> Result<Arc<Self>, BodyError> {
        let mut arrays =
            Container::new(reader, path, Limits::default()).map_err(BodyError::Arrays)?;
        let mut body = Self::from_raw(read_model(&mut arrays)?)?;
        let embedded = Self::embedded();
        if body.faces == embedded.faces {
            // The embedded body, exported and read again, keeps its own shapes and its sites.
            body.space = ShapeSpace::Cromosim;
            body.sites = embedded.sites.clone();
        } else {
            body.sites = transferred_sites(&embedded, &body)?;
        }
        Ok(Arc::new(body))
    }
}
