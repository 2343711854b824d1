//! A continuous-time estimate of a motion from noisy poses, with its own uncertainty.

use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::filled::{Filled, all_filled, fill, lengthen};
use crate::motion_response::{MotionResponse, PoseDensities};
use crate::noise_floor::{LARGEST_GAIN, LARGEST_REPORTED_GAIN, LARGEST_RISE, NoiseFloor};
use crate::pose_spectra::local_spectra;
use crate::quaternion_length::with_lengths;
use crate::sample_grid::SampleGrid;
use crate::segments::{Sampling, Segments};
use crate::zero_phase_smoothing::undoing_gain;
use crate::{KinematicTrack, SpatialError, Spectrum, Stamp, ZeroPhaseSmoothing, so3};

/// How far the poses are continued beyond their ends, s; no source.
const LEAD_S: f64 = 1.5;
/// The same in entries at most, and at most a part of the series: the cost of a continuation grows
/// with the third power of its length. No source.
const LARGEST_LEAD: usize = 300;
const LEAST_SERIES_PER_LEAD: usize = 4;
/// Fewest poses that a spectrum is learnt from; no source.
const FEWEST_POSES: usize = 16;
/// Least rate of the kinematics that an IMU model starts from, Hz: it resolves all motion that poses
/// show. No source for the number.
const LEAST_TRACK_RATE_HZ: f64 = 200.0;
/// Gain up to which a smoothing is undone for the lengths of quaternions, with a soft end. With 2 to 16 eight recordings of the
/// withheld generators (seeds 1034 and 1037) came ever closer to the gyroscope, with 32 one of them went three times
/// farther away.
const GAIN_FOR_LENGTHS: f64 = 16.0;
/// Mean variance of a quaternion's four components, for a variance of 1 per axis of the rotation
/// vector: `q = (1, v / 2)` for a small v, so that their sum is 3 / 4.
pub(crate) const QUATERNION_PER_ROTVEC: f64 = 3.0 / 16.0;

/// Noise of poses: standard deviation per sample and axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    /// Of the position, m.
    pub position: f64,
    /// Of the rotation vector, rad.
    pub rotation: f64,
}

/// A motion as poses at a steady rate report it, with what is noise in them told from what is
/// motion.
///
/// Model: each coordinate (three of the position, four of the sign-continuous quaternion) is a
/// stationary signal with white noise of density N. N is the floor of the Welch spectrum S;
/// Wiener's filter `W(f) = max(0, 1 - N / S(f))`, zero where S is hardly above N, gives the
/// estimate with the least mean square error, whose own error has the density `W N`. S is taken
/// with short and long windows, whichever says more. Derivatives are taken in the Fourier domain,
/// where they are exact. Gaps between samples are filled by the likeliest series of the same
/// spectrum and are reported by [`PoseEstimate::gaps`].
#[derive(Clone, Debug)]
pub struct PoseEstimate {
    pub(crate) start: Stamp,
    rate_hz: f64,
    count: usize,
    /// Entries that the coordinates hold before the first pose and after the last.
    lead: usize,
    /// Position and sign-continuous quaternion on the grid, gaps filled.
    coordinates: Arc<Vec<Vec<f64>>>,
    /// Spectra around each window's centre: of position, of rotation.
    local: Arc<[Vec<Spectrum>; 2]>,
    pub(crate) position: NoiseFloor,
    pub(crate) rotation: NoiseFloor,
    gaps: Vec<(Stamp, Stamp)>,
    /// What is filled in between and beyond the poses.
    pub(crate) filled: Arc<Vec<Filled>>,
    /// A smoothing that is undone.
    undone: Option<ZeroPhaseSmoothing>,
    /// Factors on what the filters pass.
    response: Option<Arc<MotionResponse>>,
    /// Where a machine runs that is known of, Hz.
    machine_hz: Option<f64>,
}

impl PoseEstimate {
    /// Learns from poses in the order of time: `stamps`, positions (m), rotations
    /// (world_from_segment).
    ///
    /// # Errors
    /// [`SpatialError::TooFewSamples`] below 16, [`SpatialError::TimeNotIncreasing`],
    /// [`SpatialError::NotFinite`], [`SpatialError::LengthMismatch`].
    pub fn fit(
        stamps: &[Stamp],
        positions: &[Vector3<f64>],
        rotations: &[UnitQuaternion<f64>],
    ) -> Result<Self, SpatialError> {
        check(stamps, positions, rotations)?;
        let grid = SampleGrid::from_stamps(stamps)?;
        let quaternions = so3::sign_continuous(rotations);
        let coordinates: Vec<Vec<f64>> = (0..7)
            .map(|channel| {
                let value = |index: usize| {
                    if channel < 3 {
                        positions[index][channel]
                    } else {
                        quaternions[index].coords[channel - 3]
                    }
                };
                grid.resample(stamps, value)
            })
            .collect();
        Ok(Self::on_grid(&grid, coordinates))
    }

    fn on_grid(grid: &SampleGrid, mut coordinates: Vec<Vec<f64>>) -> Self {
        let rate_hz = grid.rate_hz;
        let gaps = grid.gaps();
        let learn = |coordinates: &[Vec<f64>]| {
            [
                NoiseFloor::learn(&coordinates[..3], rate_hz, LARGEST_RISE[0]),
                NoiseFloor::learn(&coordinates[3..], rate_hz, LARGEST_RISE[1]),
            ]
        };
        let mut floors = learn(&coordinates);
        let mut of_gaps = [Vec::new(), Vec::new()];
        // Twice, because the first spectra saw straight lines across the gaps.
        for _ in 0..if gaps.is_empty() { 0 } else { 2 } {
            of_gaps = fill(&mut coordinates, &gaps, &floors, rate_hz);
            floors = learn(&coordinates);
        }
        let local = [
            local_spectra(&coordinates[..3], rate_hz),
            local_spectra(&coordinates[3..], rate_hz),
        ];
        // Beyond the ends as well: what is likely there keeps the last poses' derivatives sound.
        let lead = ((LEAD_S * rate_hz) as usize)
            .min(LARGEST_LEAD)
            .min(grid.count / LEAST_SERIES_PER_LEAD);
        lengthen(&mut coordinates, lead);
        let count = grid.count;
        let beyond = [0..lead, lead + count..count + 2 * lead];
        let of_ends = fill(&mut coordinates, &beyond, &floors, rate_hz);
        let [mut position, mut rotation] = floors;
        position.localise(&local[0], rate_hz, None, None, 0);
        rotation.localise(&local[1], rate_hz, None, None, 0);
        let (start, gaps) = (grid.start, grid.gap_stamps());
        let filled = Arc::new(all_filled(grid, &gaps, of_gaps, of_ends));
        Self {
            start,
            rate_hz,
            count,
            lead,
            coordinates: Arc::new(coordinates),
            local: Arc::new(local),
            position,
            rotation,
            gaps,
            filled,
            undone: None,
            response: None,
            machine_hz: None,
        }
    }

    /// Time of the first pose.
    pub fn start(&self) -> Stamp {
        self.start
    }

    /// Time of the last pose.
    pub fn end(&self) -> Stamp {
        self.start
            .plus_seconds((self.count - 1) as f64 / self.rate_hz)
    }

    /// Rate of the poses, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Poses on the sample grid, those that are filled in among them.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// One coordinate of them: three of the position, four of the sign-continuous quaternion.
    pub(crate) fn poses_of(&self, coordinate: usize) -> &[f64] {
        &self.coordinates[coordinate][self.lead..self.lead + self.count]
    }

    /// Where poses are missing: the stamps of the poses before and after.
    pub fn gaps(&self) -> &[(Stamp, Stamp)] {
        &self.gaps
    }

    /// Noise of the poses, over all frequencies. A rotation vector's variance per axis is 4/3 of the quaternion
    /// components' sum.
    pub fn noise(&self) -> PoseNoise {
        let nyquist_hz = self.rate_hz / 2.0;
        let variance = |floor: &NoiseFloor| floor.shape.variance(nyquist_hz);
        PoseNoise {
            position: variance(&self.position).sqrt(),
            rotation: (variance(&self.rotation) / QUATERNION_PER_ROTVEC).sqrt(),
        }
    }

    /// What looks like noise of the poses: that, and motion that is too fast for them, as if it were white.
    pub fn scatter(&self) -> PoseNoise {
        let sigma = |density: f64| (density * self.rate_hz / 2.0).sqrt();
        PoseNoise {
            position: sigma(self.position.shape.top),
            rotation: sigma(self.rotation.shape.top / QUATERNION_PER_ROTVEC),
        }
    }

    /// Mean spectra of position per axis [m2/Hz] and of the rotation vector per axis [rad2/Hz],
    /// noise included.
    pub fn spectra(&self) -> (Spectrum, Spectrum) {
        let mut rotation = self.rotation.spectrum().clone();
        rotation
            .density
            .iter_mut()
            .for_each(|value| *value *= 1.0 / QUATERNION_PER_ROTVEC);
        (self.position.spectrum().clone(), rotation)
    }

    /// The estimate with a smoothing of the poses undone, up to a factor of 32: of position and of a quaternion's
    /// components, which were normalised afterwards.
    #[must_use]
    pub fn undoing(&self, smoothing: ZeroPhaseSmoothing) -> Self {
        let rate_hz = self.rate_hz;
        let gain = |hz: f64| smoothing.undoing_gain(hz, rate_hz);
        let passed = |hz: f64| gain(hz).recip();
        // By the filters of the poses as they are: what is normalised away covers the noise there was before the smoothing.
        let undone = |hz: f64| {
            // A Gaussian's has no bound.
            let gain = gain(hz).min(LARGEST_REPORTED_GAIN);
            gain / (1.0 + (gain / GAIN_FOR_LENGTHS).powi(4)) * self.rotation.filter_at(hz)
        };
        let mut coordinates = self.coordinates.to_vec();
        let quaternions = with_lengths(&coordinates[3..], rate_hz, &passed, &undone);
        let inside = quaternions
            .iter()
            .map(|values| values[self.lead..self.lead + self.count].to_vec())
            .collect::<Vec<_>>();
        coordinates.splice(3.., quaternions);
        let lengthened = Self {
            coordinates: Arc::new(coordinates),
            rotation: NoiseFloor::learn(&inside, rate_hz, LARGEST_RISE[1]),
            local: Arc::new([self.local[0].clone(), local_spectra(&inside, rate_hz)]),
            ..self.clone()
        };
        lengthened.filtered_anew(Some(smoothing), 0)
    }

    /// The estimate with filters that are so many hertz wider around each frequency that they pass: they let
    /// more of the noise through, and ring less where motion begins and ends.
    #[must_use]
    pub fn with_wider_filters(&self, wider_hz: f64) -> Self {
        let reach = (wider_hz / self.local[0][0].spacing_hz).ceil() as usize;
        self.filtered_anew(self.undone, reach)
    }

    /// The estimate with all of the rotation's noise: its filter passes every frequency that the poses have.
    #[must_use]
    pub fn with_unfiltered_rotation(&self) -> Self {
        let mut all = self.clone();
        all.rotation.open();
        all
    }

    /// How dense the poses are at some frequencies, noise included: means over the frequencies that lie nearest to each,
    /// as the acceleration and the angular velocity have them (weights f^4 and f^2).
    pub fn densities_at(&self, hz: &[f64]) -> PoseDensities {
        let (position, rotation) = self.spectra();
        let of = |spectrum: &Spectrum, power: i32| -> Vec<f64> {
            (0..hz.len())
                .map(|k| {
                    let from = k.checked_sub(1).map_or(hz[k], |before| hz[before]);
                    let to = hz.get(k + 1).unwrap_or(&hz[k]);
                    spectrum.weighted_mean(0.5 * (from + hz[k]), 0.5 * (hz[k] + to), power)
                })
                .collect()
        };
        PoseDensities {
            position: of(&position, 4),
            rotation: of(&rotation, 2),
        }
    }

    /// The estimate with factors on what its filters pass, in place of those that it has. Where the response says from
    /// what poses it was learnt, the factors are those of the errors that it found there, beside this motion.
    #[must_use]
    pub fn with_response(&self, response: &MotionResponse) -> Self {
        let own = self.densities_at(&response.hz);
        let gain = |hz: f64| undoing_gain(hz, self.undone, self.rate_hz).min(LARGEST_GAIN);
        let response = response.of_poses(&own, &gain);
        let plain = Self {
            response: Some(Arc::new(response)),
            ..self.clone()
        };
        plain.filtered_anew(self.undone, 0)
    }

    /// The estimate without what a machine that runs at a frequency does to the poses, where that is faster than people: a
    /// `vibration` says what it does to a sensor. Without being told, the estimate leaves out those that are steady
    /// throughout the poses, which fewer of them may not show.
    #[must_use]
    pub fn without_machine(&self, hz: f64) -> Self {
        let told = Self {
            machine_hz: Some(hz),
            ..self.clone()
        };
        told.filtered_anew(self.undone, 0)
    }

    fn filtered_anew(&self, undone: Option<ZeroPhaseSmoothing>, reach: usize) -> Self {
        let rate_hz = self.rate_hz;
        let anew = |floor: &NoiseFloor, local: &[Spectrum], factor: &dyn Fn(f64) -> f64| {
            let mut floor = floor.undoing(undone, rate_hz);
            floor.localise(local, rate_hz, undone, self.machine_hz, reach);
            floor.multiply_filters(factor);
            floor
        };
        let response = self.response.as_deref();
        let of_position = |hz: f64| response.map_or(1.0, |own| own.of_position(hz));
        let of_rotation = |hz: f64| response.map_or(1.0, |own| own.of_rotation(hz));
        Self {
            position: anew(&self.position, &self.local[0], &of_position),
            rotation: anew(&self.rotation, &self.local[1], &of_rotation),
            undone,
            ..self.clone()
        }
    }

    /// One-sided density per axis of the estimate's error at a frequency: position [m2/Hz],
    /// rotation vector [rad2/Hz].
    pub fn error_density(&self, frequency_hz: f64) -> (f64, f64) {
        let density =
            |floor: &NoiseFloor| floor.noise_at(frequency_hz) * floor.filter_at(frequency_hz);
        (
            density(&self.position),
            density(&self.rotation) / QUATERNION_PER_ROTVEC,
        )
    }

    /// Share of the motion at a frequency that the estimate keeps, of position and of rotation, and
    /// the gain that undoes a smoothing.
    pub fn filter_at(&self, frequency_hz: f64) -> (f64, f64, f64) {
        let gain = undoing_gain(frequency_hz, self.undone, self.rate_hz);
        (
            self.position.filter_at(frequency_hz),
            self.rotation.filter_at(frequency_hz),
            gain.min(LARGEST_REPORTED_GAIN),
        )
    }

    /// The kinematics on a grid that serves an IMU of some rate: at least that and 200 Hz, which
    /// resolves all motion that poses show.
    pub fn track_for(&self, imu_rate_hz: f64) -> KinematicTrack {
        self.track(imu_rate_hz.max(LEAST_TRACK_RATE_HZ))
    }

    /// The kinematics on a grid of at least `least_rate_hz`, a whole multiple of the poses' rate,
    /// from the first pose to the last.
    pub fn track(&self, least_rate_hz: f64) -> KinematicTrack {
        let factor = (least_rate_hz / self.rate_hz).ceil().max(1.0) as usize;
        let rate_hz = self.rate_hz * factor as f64;
        let count = (self.count - 1) * factor + 1;
        let sampling = Sampling {
            rate_hz: self.rate_hz,
            factor,
            samples: self.count,
            lead: self.lead,
            count,
        };
        let segments = Segments::new(sampling, |hz| {
            undoing_gain(hz, self.undone, self.rate_hz).min(LARGEST_GAIN)
        });
        let derivatives = |channel: usize, orders: &[i32]| {
            let windows = if channel < 3 {
                &self.position.windows
            } else {
                &self.rotation.windows
            };
            segments.derivatives(&self.coordinates[channel], windows, orders)
        };
        let accelerations = [0, 1, 2].map(|channel| derivatives(channel, &[2]).swap_remove(0));
        let [i, j, k, w] = [3, 4, 5, 6].map(|channel| derivatives(channel, &[0, 1, 2]));
        let quaternion = |order: usize, at: usize| {
            Quaternion::new(w[order][at], i[order][at], j[order][at], k[order][at])
        };
        let acceleration = |at: usize| Vector3::from(accelerations.each_ref().map(|axis| axis[at]));
        let mut track = KinematicTrack {
            start: self.start,
            rate_hz,
            ..KinematicTrack::default()
        };
        for k in 0..count {
            let [q, q_dot, q_ddot] = [0, 1, 2].map(|order| quaternion(order, k));
            let world_from_segment = UnitQuaternion::from_quaternion(q);
            let segment_from_world = world_from_segment.inverse();
            track.world_from_segment.push(world_from_segment);
            track
                .acceleration_in_segment
                .push(segment_from_world * acceleration(k));
            track
                .angular_velocity_in_segment
                .push(so3::angular_velocity_in_body(&q, &q_dot));
            track
                .angular_acceleration_in_segment
                .push(segment_from_world * so3::angular_acceleration_in_world(&q, &q_dot, &q_ddot));
        }
        track
    }
}

/// Refuses poses that do not go together, are too few or are not finite.
fn check(
    stamps: &[Stamp],
    positions: &[Vector3<f64>],
    rotations: &[UnitQuaternion<f64>],
) -> Result<(), SpatialError> {
    for (what, found) in [
        ("positions", positions.len()),
        ("rotations", rotations.len()),
    ] {
        if found != stamps.len() {
            return Err(SpatialError::LengthMismatch {
                what,
                expected: stamps.len(),
                found,
            });
        }
    }
    if stamps.len() < FEWEST_POSES {
        return Err(SpatialError::TooFewSamples {
            got: stamps.len(),
            needed: FEWEST_POSES,
        });
    }
    if let Some(index) = (1..stamps.len()).find(|&k| stamps[k] <= stamps[k - 1]) {
        let (previous, next) = (stamps[index - 1].as_seconds(), stamps[index].as_seconds());
        return Err(SpatialError::TimeNotIncreasing {
            index,
            previous,
            next,
        });
    }
    let finite = |k: &usize| {
        positions[*k]
            .iter()
            .chain(rotations[*k].coords.iter())
            .all(|value| value.is_finite())
    };
    match (0..stamps.len()).find(|k| !finite(k)) {
        Some(index) => Err(SpatialError::NotFinite {
            index,
            what: "pose",
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
#[path = "estimate_tests.rs"]
mod tests;
