//! `cromosim body`: bodies out of the program.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use clap::Subcommand;
use cromosim_body::{BodyModel, ShapedBody, write_obj};

use crate::output::say;

/// Commands on bodies.
#[derive(Subcommand)]
pub enum Command {
    /// Write the body model as an SMPL npz, or its mesh at rest as OBJ
    Export {
        /// Where to; the ending decides: .npz or .obj
        out: PathBuf,
        /// Body model as npz or pickle rather than the embedded one
        #[arg(long, value_name = "FILE")]
        body: Option<PathBuf>,
        /// Shape coefficients of the mesh, separated by commas
        #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
        betas: Vec<f64>,
    },
}

/// The mesh at rest, model frame: x left, y up, z forward.
fn export_obj(out: &Path, model: &Arc<BodyModel>, betas: &[f64]) -> anyhow::Result<()> {
    let shaped = ShapedBody::new(model.clone(), betas)?;
    let vertices: Vec<[f32; 3]> = shaped
        .rest_vertices()
        .iter()
        .map(|vertex| vertex.map(|metres| metres as f32).into())
        .collect();
    let cannot = || format!("{}: cannot be written", out.display());
    let mut file = BufWriter::new(File::create(out).with_context(cannot)?);
    write_obj(&mut file, &vertices, model.faces())
        .and_then(|()| file.flush())
        .with_context(cannot)
}

/// The model of the file that `--body` names, where it does.
pub fn given(path: Option<&Path>) -> anyhow::Result<Option<Arc<BodyModel>>> {
    Ok(path.map(BodyModel::read).transpose()?)
}

/// The model of a file, or the embedded one.
pub fn model(path: Option<&Path>) -> anyhow::Result<Arc<BodyModel>> {
    Ok(given(path)?.unwrap_or_else(BodyModel::embedded))
}

/// Runs the command.
pub fn run(command: &Command) -> anyhow::Result<()> {
    let Command::Export { out, body, betas } = command;
    let model = model(body.as_deref())?;
    match out.extension().and_then(|ending| ending.to_str()) {
        Some("npz") if betas.is_empty() => model.write_npz(out)?,
        Some("npz") => {
            bail!("--betas shapes a mesh; an npz holds the whole model, which has every shape")
        }
        Some("obj") => export_obj(out, &model, betas)?,
        _ => bail!(
            "{}: the ending says what to write: .npz (model) or .obj (mesh)",
            out.display()
        ),
    }
    say!("{}", out.display())?;
    Ok(())
}
