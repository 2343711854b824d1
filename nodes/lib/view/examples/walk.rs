//! The embedded walk with the five demo placements, or with 17 where a second argument is `full17`,
//! as the viewer shows it.
//!
//! `cargo run -p cromosim_view --example walk -- OUT.rrd` writes a file; with `live` instead of a
//! file it goes, in real time, to the viewer that listens on 127.0.0.1:9876.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{MountedSensors, PlacementSet, Scheme, simulate};
use cromosim_motion::embedded_walk;
use cromosim_spatial::{Stamp, uniform_stamps};
use cromosim_view::{Destination, Recording, RecordingOptions};

/// Of the IMUs and of the poses that the viewer is offered, Hz.
const RATE_HZ: f64 = 100.0;

fn main() -> anyhow::Result<()> {
    let target = std::env::args()
        .nth(1)
        .context("usage: walk (OUT.rrd | live) [full17]")?;
    let address = Destination::LOCAL_VIEWER;
    let destination = match target.as_str() {
        "live" => Destination::Connect { address },
        path => Destination::File {
            path: PathBuf::from(path),
        },
    };
    let live = destination.is_live();

    let walk = embedded_walk();
    let body = ShapedBody::new(BodyModel::embedded(), &walk.betas)?;
    let placements = match std::env::args().nth(2).as_deref() {
        Some("full17") => PlacementSet::full17(),
        _ => PlacementSet::demo(),
    };
    let sites = MountedSensors::new(&body, placements.placements())?;
    let stamps = uniform_stamps(
        Stamp::default(),
        Stamp::from_seconds(walk.duration_s()),
        RATE_HZ,
    )?;
    let pose_at = |stamp: &Stamp| {
        walk.smooth_pose_at(stamp.as_seconds())
            .context("a pose within the walk")
    };
    let poses = stamps
        .iter()
        .map(pose_at)
        .collect::<anyhow::Result<Vec<_>>>()?;
    let trajectories = sites.trajectories(&stamps, &poses)?;
    let imus = trajectories
        .iter()
        .map(|trajectory| simulate(trajectory, Scheme::Spline, &stamps))
        .collect::<Result<Vec<_>, _>>()?;

    let names: Vec<String> = placements
        .placements()
        .iter()
        .map(|placement| placement.name().to_owned())
        .collect();
    let options = RecordingOptions {
        name: "embedded walk".into(),
        placements: names.clone(),
        curve_window_s: live.then_some(10.0),
        ..RecordingOptions::default()
    };
    let mut recording = Recording::open(&[destination], options)?;
    let rest: Vec<[f32; 3]> = body
        .rest_vertices()
        .iter()
        .map(|point| point.cast::<f32>().into())
        .collect();
    recording.set_body(&rest, body.model().faces())?;

    let (started, mut vertices) = (Instant::now(), Vec::new());
    for (index, (&stamp, pose)) in stamps.iter().zip(&poses).enumerate() {
        if live {
            std::thread::sleep(
                Duration::from_secs_f64(stamp.as_seconds()).saturating_sub(started.elapsed()),
            );
        }
        if recording.wants_body(stamp) {
            body.skin(pose, &mut vertices);
            recording.log_body(stamp, &vertices)?;
        }
        for ((name, trajectory), samples) in names.iter().zip(&trajectories).zip(&imus) {
            recording.log_sensor(stamp, name, &trajectory.frames()[index].world_from_sensor)?;
            let sample = &samples[index];
            recording.log_imu(
                stamp,
                name,
                &sample.specific_force,
                &sample.angular_velocity,
            )?;
        }
    }
    let summary = recording.finish()?;
    println!(
        "{target}: {summary:?} in {:.2} s",
        started.elapsed().as_secs_f64()
    );
    Ok(())
}
