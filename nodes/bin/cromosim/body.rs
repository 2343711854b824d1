//! `cromosim body`: bodies out of the program.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use clap::Subcommand;
use cromosim_body::{BodyModel, ShapedBody, write_obj};

use crate::files::{refuse_existing, write_whole};
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
        /// Replace OUT where it exists
        #[arg(long)]
        force: bool,
    },
    /// List the named sites of the skin, with their bones and places
    Sites {
        /// Body model as npz or pickle rather than the embedded one
        #[arg(long, value_name = "FILE")]
        body: Option<PathBuf>,
    },
}

/// The mesh at rest, model frame: x left, y up, z forward.
fn obj(model: &Arc<BodyModel>, betas: &[f64]) -> anyhow::Result<Vec<u8>> {
    let shaped = ShapedBody::new(model.clone(), betas)?;
    let vertices: Vec<[f32; 3]> = shaped
        .rest_vertices()
        .iter()
        .map(|vertex| vertex.map(|metres| metres as f32).into())
        .collect();
    let mut text = Vec::new();
    write_obj(&mut text, &vertices, model.faces()).context("the mesh cannot be written")?;
    Ok(text)
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
    match command {
        Command::Export {
            out,
            body,
            betas,
            force,
        } => export(out, body.as_deref(), betas, *force),
        Command::Sites { body } => sites(&model(body.as_deref())?),
    }
}

/// Names, their bones, and where they are on the body at rest.
pub fn sites(model: &Arc<BodyModel>) -> anyhow::Result<()> {
    let shaped = ShapedBody::new(model.clone(), &[])?;
    say!("point in the model frame at rest (x left, y up, z forward), m")?;
    for name in model.site_names() {
        let site = model.site(name)?;
        let at = shaped.site_in_model(&site)?;
        say!(
            "  {name:26} {:14} {:6.3} {:6.3} {:6.3}",
            site.joint.name(),
            at.x,
            at.y,
            at.z
        )?;
    }
    Ok(())
}

fn export(out: &Path, body: Option<&Path>, betas: &[f64], force: bool) -> anyhow::Result<()> {
    refuse_existing(out, force)?;
    let model = model(body)?;
    let bytes = match out.extension().and_then(|ending| ending.to_str()) {
        Some("npz") if betas.is_empty() => model.to_npz()?,
        Some("npz") => {
            bail!("--betas shapes a mesh; an npz holds the whole model, which has every shape")
        }
        Some("obj") => obj(&model, betas)?,
        _ => bail!(
            "{}: the ending says what to write: .npz (model) or .obj (mesh)",
            out.display()
        ),
    };
    write_whole(out, force, |file| {
        file.write_all(&bytes)
            .with_context(|| format!("{}: cannot be written", out.display()))
    })?;
    say!("{}", out.display())?;
    Ok(())
}
