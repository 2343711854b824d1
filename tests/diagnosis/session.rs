//! Recordings with known motion, noise and hidden effects.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::common::succeed;

/// When the session begins, s.
pub const BEGIN: i64 = 1_700_000_000;

pub const REFERENCE_HZ: f64 = 200.0;

/// Random numbers that are the same everywhere (splitmix64, Box and Muller).
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().max(1e-300).ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    pub fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * self.normal())
    }
}

/// Six sums of sines between 0.2 and 2.5 Hz: position [m] and rotation vector [rad].
pub struct Motion(pub Vec<Vec<(f64, f64, f64)>>);

impl Motion {
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut sines = |size: f64| {
            (0..8)
                .map(|_| {
                    let hz = 0.2 + 2.3 * random.uniform();
                    (
                        hz,
                        size * random.normal() / (0.5 + hz),
                        TAU * random.uniform(),
                    )
                })
                .collect::<Vec<_>>()
        };
        Self(
            (0..6)
                .map(|channel| sines(if channel < 3 { 0.08 } else { 0.35 }))
                .collect(),
        )
    }

    pub fn at(&self, t: f64) -> Isometry3<f64> {
        let value = |channel: usize| {
            self.0[channel]
                .iter()
                .map(|(hz, size, phase)| size * (TAU * hz * t + phase).sin())
                .sum::<f64>()
        };
        let position = Vector3::new(value(0), value(1), 1.0 + value(2));
        Isometry3::from_parts(
            Translation3::from(position),
            UnitQuaternion::new(Vector3::new(value(3), value(4), value(5))),
        )
    }
}

pub fn stamp(t: f64) -> Stamp {
    Stamp::from_nanos(BEGIN * 1_000_000_000 + (t * 1e9).round() as i64)
}

/// The reference's messages from `from` on; `noise`: standard deviation per sample, m and rad.
pub fn reference(
    motion: &Motion,
    from: f64,
    seconds: f64,
    noise: (f64, f64),
    random: &mut Random,
) -> Vec<PoseStamped> {
    let message = |k: usize| {
        let t = from + k as f64 / REFERENCE_HZ;
        let mut pose = motion.at(t);
        pose.translation.vector += random.vector(noise.0);
        pose.rotation *= UnitQuaternion::new(random.vector(noise.1));
        PoseStamped {
            header: Header::new(stamp(t).nanos, "world"),
            pose: Pose::from(pose),
        }
    };
    (0..=(seconds * REFERENCE_HZ) as usize)
        .map(message)
        .collect()
}

/// A bag of references and IMU messages by placement.
pub fn write(path: &Path, placements: &[(&str, Vec<PoseStamped>, Vec<Imu>)]) {
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    for (name, poses, imus) in placements {
        for message in poses {
            bag.write(
                &format!("/reference/{name}"),
                Stamp::from_nanos(message.header.stamp.nanos()),
                message,
            )
            .unwrap();
        }
        for message in imus {
            bag.write(
                &format!("/imu/{name}/data_raw"),
                Stamp::from_nanos(message.header.stamp.nanos()),
                message,
            )
            .unwrap();
        }
    }
    bag.finish().unwrap();
}

pub fn imus(path: &Path, name: &str) -> Vec<Imu> {
    let messages = BagReader::open(path)
        .unwrap()
        .read::<Imu>(&format!("/imu/{name}/data_raw"))
        .unwrap();
    messages.into_iter().map(|(_, message)| message).collect()
}

/// Records `seconds` of the session from `from` on: IMUs at 100 Hz from the exact motion under
/// `effects`, references with ordinary noise.
pub fn record(
    folder: &Path,
    file: &str,
    seed: u64,
    (from, seconds): (f64, f64),
    placements: &[(&str, &str)],
) {
    let motions: Vec<Motion> = (0..placements.len() as u64)
        .map(|k| Motion::new(seed + 100 * k))
        .collect();
    let mut random = Random(seed ^ from.to_bits());
    let exact =
        |motion: &Motion, random: &mut Random| reference(motion, from, seconds, (0.0, 0.0), random);
    let names = placements.iter().map(|(name, _)| *name);
    let bare: Vec<_> = names
        .clone()
        .zip(&motions)
        .map(|(name, motion)| (name, exact(motion, &mut random), Vec::new()))
        .collect();
    write(&folder.join("exact.mcap"), &bare);
    let mut hidden = "schema: cromosim/effects/1\nplacements:\n".to_owned();
    for (name, effects) in placements {
        hidden += &format!(
            "  {name}:\n    epoch: {BEGIN}.0\n    declared_noise: {{accel_density: 0.0014, gyro_density: 0.00012}}\n    effects: [{effects}]\n"
        );
    }
    fs::write(folder.join("hidden.yaml"), hidden).unwrap();
    let seed = format!("{}", seed + from as u64);
    succeed(
        folder,
        &[
            "simulate",
            "--reference",
            "exact.mcap",
            "--effects",
            "hidden.yaml",
            "--rate",
            "100",
            "--seed",
            &seed,
            "--out",
            "imu.mcap",
        ],
    );
    let noise = (1e-4, 0.05_f64.to_radians());
    let whole: Vec<_> = names
        .zip(&motions)
        .map(|(name, motion)| {
            (
                name,
                reference(motion, from, seconds, noise, &mut random),
                imus(&folder.join("imu.mcap"), name),
            )
        })
        .collect();
    write(&folder.join(file), &whole);
    for name in ["exact.mcap", "imu.mcap", "hidden.yaml"] {
        fs::remove_file(folder.join(name)).unwrap();
    }
}
