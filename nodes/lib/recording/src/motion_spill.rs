//! Kinematic samples put aside: in memory while they are few, then in a file without a name, which
//! nothing outlives.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use cromosim_imu::{Bandwidth, KinematicSample, SampleVariance};
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use tempfile::tempfile_in;

use crate::RecordingError;

/// Numbers of a sample beside its stamp.
const VALUES: usize = 23;
/// Bytes of a sample: stamp, numbers, and which of its options are there.
const SAMPLE: usize = 8 * (VALUES + 1) + 1;
/// Bytes that are read or written at once.
const BUFFER: usize = 64 * 1024;

/// Samples in a file.
struct SpilledFile {
    file: BufReader<File>,
    left: usize,
    folder: PathBuf,
    /// The sample that was read last.
    sample: Option<KinematicSample>,
}

/// Samples of one placement, in the order of time.
pub struct MotionSpill {
    kept: Kept,
    count: usize,
}

enum Kept {
    /// All of them, and which is next.
    InMemory(Vec<KinematicSample>, usize),
    InFile(Box<SpilledFile>),
}

impl MotionSpill {
    /// Puts samples aside, those from `first` on: where they are more than `in_memory` bytes, in a file in
    /// `folder`.
    ///
    /// # Errors
    /// [`RecordingError::PutAside`].
    pub(crate) fn new(
        samples: Vec<KinematicSample>,
        first: usize,
        (in_memory, folder): (usize, &Path),
    ) -> Result<Self, RecordingError> {
        let part = &samples[first..];
        let count = part.len();
        let kept = if size_of_val(part) <= in_memory {
            Kept::InMemory(samples, first)
        } else {
            let folder = folder.to_owned();
            match written(part, &folder) {
                Ok(file) => Kept::InFile(Box::new(SpilledFile {
                    file,
                    left: count,
                    folder,
                    sample: None,
                })),
                Err(source) => return Err(RecordingError::PutAside { folder, source }),
            }
        };
        Ok(Self { kept, count })
    }

    /// How many there are in all.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether all were taken.
    pub fn is_empty(&self) -> bool {
        match &self.kept {
            Kept::InMemory(samples, next) => *next == samples.len(),
            Kept::InFile(spilled) => spilled.left == 0,
        }
    }

    /// The next sample, where it lies: copies of what has left the caches would cost more than all that is
    /// made of it. None after the last.
    ///
    /// # Errors
    /// [`RecordingError::PutAside`].
    pub fn next_sample(&mut self) -> Result<Option<&KinematicSample>, RecordingError> {
        match &mut self.kept {
            Kept::InMemory(samples, next) => {
                let sample = samples.get(*next);
                *next += usize::from(sample.is_some());
                Ok(sample)
            }
            Kept::InFile(spilled) => spilled.next_sample(),
        }
    }
}

impl SpilledFile {
    fn next_sample(&mut self) -> Result<Option<&KinematicSample>, RecordingError> {
        if self.left == 0 {
            return Ok(None);
        }
        let mut bytes = [0; SAMPLE];
        let read = self.file.read_exact(&mut bytes);
        read.map_err(|source| RecordingError::PutAside {
            folder: self.folder.clone(),
            source,
        })?;
        self.left -= 1;
        Ok(Some(self.sample.insert(sample_of(&bytes))))
    }
}

fn written(samples: &[KinematicSample], folder: &Path) -> io::Result<BufReader<File>> {
    let mut file = BufWriter::with_capacity(BUFFER, tempfile_in(folder)?);
    for sample in samples {
        file.write_all(&bytes_of(sample))?;
    }
    let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(BufReader::with_capacity(BUFFER, file))
}

fn bytes_of(sample: &KinematicSample) -> [u8; SAMPLE] {
    let pose = &sample.world_from_sensor;
    let quaternion = pose.rotation.quaternion();
    let turning = sample.angular_acceleration_in_world;
    let bandwidth = sample.bandwidth;
    let none = Bandwidth {
        acceleration_hz: 0.0,
        angular_velocity_hz: 0.0,
    };
    let values: [f64; VALUES] = {
        let (p, q) = (&pose.translation.vector, quaternion.coords);
        let (a, w) = (
            sample.acceleration_in_world,
            sample.angular_velocity_in_world,
        );
        let t = turning.unwrap_or_default();
        let (v, b) = (sample.variance, bandwidth.unwrap_or(none));
        [
            p.x,
            p.y,
            p.z,
            q.x,
            q.y,
            q.z,
            q.w,
            a.x,
            a.y,
            a.z,
            w.x,
            w.y,
            w.z,
            t.x,
            t.y,
            t.z,
            v.acceleration,
            v.angular_velocity,
            v.orientation,
            b.acceleration_hz,
            b.angular_velocity_hz,
            v.unseen[0],
            v.unseen[1],
        ]
    };
    let mut bytes = [0; SAMPLE];
    bytes[..8].copy_from_slice(&sample.stamp.nanos.to_le_bytes());
    for (place, value) in bytes[8..].chunks_exact_mut(8).zip(values) {
        place.copy_from_slice(&value.to_le_bytes());
    }
    bytes[SAMPLE - 1] = u8::from(turning.is_some()) | u8::from(bandwidth.is_some()) << 1;
    bytes
}

fn sample_of(bytes: &[u8; SAMPLE]) -> KinematicSample {
    let word = |index: usize| {
        let mut word = [0; 8];
        word.copy_from_slice(&bytes[8 * index..8 * (index + 1)]);
        word
    };
    let value = |index: usize| f64::from_le_bytes(word(index + 1));
    let vector = |index: usize| Vector3::new(value(index), value(index + 1), value(index + 2));
    let quaternion = Quaternion::new(value(6), value(3), value(4), value(5));
    let options = bytes[SAMPLE - 1];
    KinematicSample {
        stamp: Stamp::from_nanos(i64::from_le_bytes(word(0))),
        world_from_sensor: Isometry3::from_parts(
            vector(0).into(),
            // It was one, to the last bit.
            UnitQuaternion::new_unchecked(quaternion),
        ),
        acceleration_in_world: vector(7),
        angular_velocity_in_world: vector(10),
        angular_acceleration_in_world: (options & 1 != 0).then(|| vector(13)),
        variance: SampleVariance {
            acceleration: value(16),
            angular_velocity: value(17),
            orientation: value(18),
            unseen: [value(21), value(22)],
        },
        bandwidth: (options & 2 != 0).then(|| Bandwidth {
            acceleration_hz: value(19),
            angular_velocity_hz: value(20),
        }),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn samples_come_back_to_the_last_bit_from_memory_and_file() {
        let sample = |k: i64| {
            let x = (k as f64).sin();
            KinematicSample {
                stamp: Stamp::from_nanos(1_700_000_000_000_000_000 + k),
                world_from_sensor: Isometry3::new(
                    Vector3::new(x, -x, 0.1 * x),
                    Vector3::new(3.0 * x, x, -2.0 * x),
                ),
                acceleration_in_world: Vector3::new(x, 2.0, 3.0),
                angular_velocity_in_world: Vector3::new(4.0, x, 6.0),
                angular_acceleration_in_world: (k % 2 == 0).then(|| Vector3::new(7.0, 8.0, x)),
                variance: SampleVariance {
                    acceleration: x,
                    angular_velocity: f64::INFINITY,
                    orientation: -x,
                    unseen: [x, 2.0 * x],
                },
                bandwidth: (k % 3 == 0).then_some(Bandwidth {
                    acceleration_hz: 5.0 + x,
                    angular_velocity_hz: 6.0,
                }),
            }
        };
        let samples: Vec<KinematicSample> = (0..1000).map(sample).collect();
        let folder = tempfile::tempdir().unwrap();
        for in_memory in [0, 1000, 1 << 20] {
            let mut spill =
                MotionSpill::new(samples.clone(), 0, (in_memory, folder.path())).unwrap();
            assert_eq!(spill.count(), samples.len());
            for sample in &samples {
                assert_eq!(spill.next_sample().unwrap(), Some(sample));
            }
            assert_eq!(spill.next_sample().unwrap(), None);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
