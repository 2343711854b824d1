//! Writes a motion with AMASS' keys.

use std::io::{self, Seek, Write};

use cromosim_arrays::NpzWriter;
use cromosim_body::ShapedBody;

use crate::SmplMotion;

/// The motion as npz with the keys of AMASS: `poses` (N, 72), axis times angle of SMPL's 24 joints,
/// rad; `trans` (N, 3), m, the pelvis less its place at rest J_0(betas); `betas`; `gender`;
/// `mocap_framerate`, Hz; world z up. `surface_model_type` says whose betas they are (`smpl`,
/// `smplx`, or `cromosim` for the embedded body's, which mean nothing on another), `body` which
/// body. `shaped` is the body of the motion's betas. The same motion gives the same bytes.
///
/// # Errors
/// What `writer` says.
pub fn write_amass<W: Write + Seek>(
    motion: &SmplMotion,
    shaped: &ShapedBody,
    writer: W,
) -> io::Result<W> {
    let count = motion.frames.len();
    let poses: Vec<f64> = motion
        .frames
        .iter()
        .flat_map(|pose| pose.axis_angles())
        .flat_map(|angles| [angles.x, angles.y, angles.z])
        .collect();
    let trans = motion
        .frames
        .iter()
        .map(|pose| shaped.trans(pose.root_position));
    let trans: Vec<f64> = trans
        .flat_map(|trans| [trans.x, trans.y, trans.z])
        .collect();
    let body = shaped.model();
    let mut npz = NpzWriter::new(writer);
    npz.floats("poses", &[count, 72], &poses)?;
    npz.floats("trans", &[count, 3], &trans)?;
    npz.floats("betas", &[motion.betas.len()], &motion.betas)?;
    npz.text("gender", motion.gender.name())?;
    npz.floats("mocap_framerate", &[], &[motion.rate_hz])?;
    npz.text("surface_model_type", motion.shape_space.name())?;
    npz.text("body", body.id())?;
    npz.finish()
}
