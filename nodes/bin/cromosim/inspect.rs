//! `cromosim inspect`: what is in a motion, body or bag file, found out from its content.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_motion::{SmplMotion, read_motion};

/// Say what is in a file
#[derive(Args)]
pub struct Arguments {
    /// Motion (BVH), body (SMPL npz) or bag (.mcap, rosbag2 directory)
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    for path in &arguments.files {
        inspect(path)?;
    }
    Ok(())
}

fn inspect(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        return inspect_bag(path);
    }
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(16).read_to_end(&mut head))
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    match head.as_slice() {
        [0x89, b'M', b'C', b'A', b'P', ..] => inspect_bag(path),
        [b'P', b'K', ..] => inspect_body(path),
        [] => bail!("{}: the file is empty", path.display()),
        _ => inspect_motion(path),
    }
}

fn inspect_bag(path: &Path) -> anyhow::Result<()> {
    let reader = BagReader::open(path)?;
    let summary = reader.summary();
    println!("{}: bag, {} messages, {:.3} s", path.display(), summary.message_count(), summary.duration());
    let width = summary.topics.iter().map(|counted| counted.topic.name.len()).max().unwrap_or(0);
    for counted in &summary.topics {
        let (name, rate) = (&counted.topic.name, summary.rate(&counted.topic.name));
        let rate = rate.map_or_else(String::new, |rate| format!("{rate:9.2} Hz"));
        println!("  {name:width$}  {:8} {rate:12}  {}", counted.message_count, counted.topic.type_name);
    }
    for attachment in reader.attachments() {
        println!("  attachment {} ({} bytes)", attachment.name, attachment.content.len());
    }
    for (name, values) in reader.metadata_records() {
        println!("  metadata {name}: {}", values.keys().cloned().collect::<Vec<_>>().join(", "));
    }
    Ok(())
}

fn inspect_body(path: &Path) -> anyhow::Result<()> {
    let model = BodyModel::read(path)?;
    let body = ShapedBody::new(model.clone(), &[])?;
    let heights = body.rest_vertices().iter().map(|vertex| vertex.y);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    println!(
        "{}: body {}, {} vertices, {} triangles, {} joints, {} betas, gender {}, {:.3} m tall",
        path.display(),
        model.id(),
        model.vertex_count(),
        model.faces().len(),
        Joint::ALL.len(),
        model.beta_count(),
        model.gender().map_or("not stated", |gender| gender.name()),
        high - low
    );
    Ok(())
}

fn inspect_motion(path: &Path) -> anyhow::Result<()> {
    let motion = read_motion(path, &Default::default())?;
    println!("{}: motion, {} frames at {:.4} Hz, {:.3} s", path.display(), motion.frames.len(), motion.rate_hz, motion.duration_s());
    if let Some(report) = &motion.report {
        println!("  {report}");
        println!("  betas {:.2?}, bone lengths within {:.1} mm (RMS)", report.betas, 1e3 * report.bone_length_rms_m);
    }
    println!("  {}", extent(&motion));
    Ok(())
}

/// How far the pelvis goes.
fn extent(motion: &SmplMotion) -> String {
    let positions: Vec<_> = motion.frames.iter().map(|frame| frame.root_position).collect();
    let length: f64 = positions.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let heights = positions.iter().map(|position| position.z);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    format!("pelvis: path of {length:.2} m, {low:.2} to {high:.2} m above the floor")
}
