//! Recordings of known motions with known effects.
// Each test binary uses a part.
#![allow(dead_code, clippy::unwrap_used)]

pub mod judge;
pub mod motion;

use std::f64::consts::{LN_2, PI};
use std::ops::Range;

use cromosim_gap::{MeasuredField, MeasuredImu, PlacementRecord, PoseSeries};
use cromosim_imu::{
    DeclaredNoise, Dropouts, Effect, EffectKind, EffectSet, MeasurementInput, PerChannel, Reading,
    SensorModel, Stage, normal_pair,
};
use cromosim_spatial::{SmoothingKernel, Stamp, ZeroPhaseSmoothing, so3};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;

use motion::Motion;

/// Rates of reference and IMU, Hz, and of the grid on which the true motion is sampled.
pub const REFERENCE_HZ: f64 = 120.0;
pub const IMU_HZ: f64 = 100.0;
const GRID_HZ: f64 = 500.0;
/// White noise per sample that the device has and declares: m/s2, rad/s.
pub const SIGMA: [f64; 2] = [0.014, 0.0012];
/// Ordinary scatter of the reference: m, rad.
const SCATTER: [f64; 2] = [1e-4, 0.05 * PI / 180.0];
/// How far the true motion goes on beyond the recording, s: filters have settled when it begins.
const MARGIN_S: f64 = 4.0;
/// An instant of today, so that nothing may lean on small times.
const TODAY: Stamp = Stamp::from_nanos(1_700_000_000_123_456_789);

/// Effects that came later than the others' tests.
const LATER: [EffectKind; 12] = [
    EffectKind::ReferenceInterpolation,
    EffectKind::ReferenceUnits,
    EffectKind::ChannelDelay,
    EffectKind::AccelTurnOnBias,
    EffectKind::GyroTurnOnBias,
    EffectKind::AccelBiasInstability,
    EffectKind::GyroBiasInstability,
    EffectKind::AccelBiasWalk,
    EffectKind::GyroBiasWalk,
    EffectKind::AccelLowPass,
    EffectKind::GyroLowPass,
    EffectKind::WarmUp,
];

/// Seed of the scene in which an effect is tested: a new effect gives the others no other motions.
pub fn seed_of(kind: EffectKind) -> u64 {
    let place = |list: &[EffectKind]| list.iter().position(|other| *other == kind);
    let first: Vec<EffectKind> = EffectKind::ALL
        .into_iter()
        .filter(|other| !LATER.contains(other))
        .collect();
    place(&first)
        .or_else(|| place(&LATER).map(|place| 90 + place))
        .unwrap() as u64
}

/// What is to be recorded.
#[derive(Clone, Debug)]
pub struct Scene {
    pub motion: Motion,
    pub effects: EffectSet,
    /// Of all noise.
    pub seed: u64,
    pub seconds: f64,
    pub imu_hz: f64,
    /// Stamp of the first IMU message.
    pub start: Stamp,
    /// What depends on time is anchored here: the start of the device's first recording.
    pub epoch: Stamp,
    pub declared: PerChannel<Option<f64>>,
    /// Seconds of the recording in which the reference is lost.
    pub lost: Vec<Range<f64>>,
}

impl Scene {
    /// A minute of random motion without any effect.
    pub fn new(seed: u64) -> Self {
        let start = TODAY;
        Self {
            motion: Motion::random(seed),
            effects: EffectSet::new(),
            seed,
            seconds: 60.0,
            imu_hz: IMU_HZ,
            start,
            epoch: start,
            declared: PerChannel {
                accelerometer: Some(SIGMA[0]),
                gyroscope: Some(SIGMA[1]),
            },
            lost: Vec::new(),
        }
    }

    /// The same with an effect.
    #[must_use]
    pub fn with(mut self, kind: EffectKind, values: &[f64]) -> Self {
        self.effects
            .insert(Effect::new(kind, values.to_vec()).unwrap());
        self
    }

    /// Another recording of the same device, `later` seconds on. The motion is of the same
    /// spectrum: where little but the reference's own error is left, that error goes by the motion
    /// (some 15 % between two random ones, under the true effects too).
    #[must_use]
    pub fn again(&self, later: f64) -> Self {
        let (motion, start) = (self.motion.later(later), self.start.plus_seconds(later));
        Self {
            motion,
            seed: self.seed + 1000,
            start,
            ..self.clone()
        }
    }

    pub fn record(&self) -> PlacementRecord {
        PlacementRecord {
            name: "wrist".to_owned(),
            reference: self.reference(),
            imu: self.imu(),
            set_back: Vec::new(),
            field: MeasuredField::default(),
        }
    }

    fn value(&self, kind: EffectKind, index: usize) -> Option<f64> {
        self.effects.get(kind).map(|effect| effect.values()[index])
    }

    /// `p = u (T s p + noise)`, `R = T R exp(noise)`, smoothed before the noise comes; u the units of
    /// length.
    fn reference(&self) -> PoseSeries {
        // 0.41 s before the IMU and after it, at no whole number of its intervals.
        let (before, count) = (0.4137, ((self.seconds + 0.83) * REFERENCE_HZ) as usize);
        let margin = (MARGIN_S * REFERENCE_HZ) as usize;
        let seconds = |k: usize| (k as f64 - margin as f64) / REFERENCE_HZ - before;
        let instants: Vec<_> = (0..count + 2 * margin)
            .map(|k| self.reported_instant(seconds(k)))
            .collect();
        let channel = |of: &dyn Fn(&motion::Instant) -> f64| {
            let series: Vec<f64> = instants.iter().map(of).collect();
            match self.effects.reference_smoothing() {
                Some(smoothing) => smoothed(&series, &smoothing),
                None => series,
            }
        };
        let position = [0, 1, 2].map(|axis| channel(&|now| now.position[axis]));
        let rotation = [0, 1, 2, 3].map(|part| channel(&|now| now.world_from_segment.coords[part]));
        let scatter = [0, 1].map(|c| {
            self.value(EffectKind::ReferenceNoise, c)
                .unwrap_or(SCATTER[c])
        });
        let tilt = self
            .effects
            .get(EffectKind::ReferenceTilt)
            .map_or(Vector3::zeros(), |tilt| {
                Vector3::from_row_slice(tilt.values())
            });
        let tilt = so3::exp(&tilt);
        let scale = self.value(EffectKind::ReferenceScale, 0).unwrap_or(1.0);
        let units = self.effects.length_factor();
        let mut random = ChaCha12Rng::seed_from_u64(self.seed ^ 0x5eed);
        let mut series = PoseSeries::default();
        for k in margin..margin + count {
            let noise = [normal_vector(&mut random), normal_vector(&mut random)];
            if self.lost.iter().any(|lost| lost.contains(&seconds(k))) {
                continue;
            }
            let world_from_segment = UnitQuaternion::from_quaternion(Quaternion::new(
                rotation[3][k],
                rotation[0][k],
                rotation[1][k],
                rotation[2][k],
            ));
            series.stamps.push(self.start.plus_seconds(seconds(k)));
            let position = Vector3::new(position[0][k], position[1][k], position[2][k]);
            series
                .positions
                .push((tilt * position * scale + noise[0] * scatter[0]) * units);
            series
                .rotations
                .push(tilt * world_from_segment * so3::exp(&(noise[1] * scatter[1])));
        }
        series
    }

    /// The motion, or what lies on the chord between two frames of it.
    fn reported_instant(&self, t: f64) -> motion::Instant {
        let Some(rate_hz) = self.effects.frame_rate_hz() else {
            return self.motion.at(t);
        };
        let frame = (t * rate_hz).floor();
        let share = t * rate_hz - frame;
        let [from, to] = [frame, frame + 1.0].map(|frame| self.motion.at(frame / rate_hz));
        motion::Instant {
            position: from.position.lerp(&to.position, share),
            world_from_segment: from.world_from_segment.slerp(&to.world_from_segment, share),
            ..from
        }
    }

    /// The device's part of the effects on the exact kinematics, then noise, then what is digital,
    /// then losses.
    fn imu(&self) -> MeasuredImu {
        use EffectKind as K;
        let is_device = |effect: &&Effect| effect.kind().spec().stage != Stage::Reference;
        let device: Vec<Effect> = self.effects.iter().filter(is_device).cloned().collect();
        let device = EffectSet::try_from(device).unwrap();
        let model = SensorModel::new(&device, self.epoch);
        let stamps: Vec<Stamp> = (0..(self.seconds * self.imu_hz) as usize)
            .map(|k| self.start.plus_seconds(k as f64 / self.imu_hz))
            .collect();
        let track = self
            .motion
            .track(self.start, -MARGIN_S, self.seconds + MARGIN_S, GRID_HZ);
        let beyond = model.total_noise(&DeclaredNoise::default());
        let sigma = [
            SIGMA[0].hypot(beyond.accel_density * self.imu_hz.sqrt()),
            SIGMA[1].hypot(beyond.gyro_density * self.imu_hz.sqrt()),
        ];
        let mut random = ChaCha12Rng::seed_from_u64(self.seed ^ 0xdece);
        let readings = model.measure(MeasurementInput::Motion(&track), &stamps, |readings| {
            for reading in readings {
                reading.specific_force += normal_vector(&mut random) * sigma[0];
                reading.angular_velocity += normal_vector(&mut random) * sigma[1];
            }
        });
        let mut dropouts = Dropouts::new(self.effects.get(K::DroppedSamples), self.seed, "wrist");
        let there = |_: &(Stamp, Reading)| !dropouts.as_mut().is_some_and(Dropouts::next_is_lost);
        let (stamps, readings) = stamps.into_iter().zip(readings).filter(there).unzip();
        MeasuredImu {
            stamps,
            readings,
            declared: self.declared,
        }
    }
}

fn normal_vector(random: &mut ChaCha12Rng) -> Vector3<f64> {
    let ([x, y], [z, _]) = (normal_pair(random), normal_pair(random));
    Vector3::new(x, y, z)
}

/// Without phase, settled on the first value or continued by it.
fn smoothed(series: &[f64], smoothing: &ZeroPhaseSmoothing) -> Vec<f64> {
    match smoothing.kernel {
        SmoothingKernel::Butterworth { order } => {
            let mut once = butterworth(series, smoothing.cutoff_hz, order);
            once.reverse();
            let mut twice = butterworth(&once, smoothing.cutoff_hz, order);
            twice.reverse();
            twice
        }
        SmoothingKernel::Gaussian => gaussian(series, smoothing.cutoff_hz),
    }
}

/// The mean of the samples around each, weighted by a bell whose transform has half of the power at the
/// cutoff.
fn gaussian(series: &[f64], cutoff_hz: f64) -> Vec<f64> {
    let deviation = LN_2.sqrt() / (2.0 * PI * cutoff_hz) * REFERENCE_HZ;
    let reach = (6.0 * deviation).ceil() as i64;
    let weight = |k: i64| (-0.5 * (k as f64 / deviation).powi(2)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    let last = series.len() as i64 - 1;
    let value = |k: i64| series[k.clamp(0, last) as usize];
    let mean = |at: i64| {
        (-reach..=reach)
            .map(|k| weight(k) * value(at + k))
            .sum::<f64>()
            / total
    };
    (0..=last).map(mean).collect()
}

/// Of an even order.
fn butterworth(series: &[f64], cutoff_hz: f64, order: u8) -> Vec<f64> {
    let damping = |k: u8| 2.0 * (f64::from(2 * k + 1) * PI / (2.0 * f64::from(order))).sin();
    (0..order / 2).fold(series.to_vec(), |series, k| {
        of_second_order(&series, cutoff_hz, damping(k))
    })
}

/// By the bilinear transform, settled on the first value.
fn of_second_order(series: &[f64], cutoff_hz: f64, damping: f64) -> Vec<f64> {
    let k = (PI * cutoff_hz / REFERENCE_HZ).tan();
    let norm = 1.0 + damping * k + k * k;
    let (b, a1, a2) = (
        k * k / norm,
        2.0 * (k * k - 1.0) / norm,
        (1.0 - damping * k + k * k) / norm,
    );
    let (mut x, mut y) = ([series[0]; 2], [series[0]; 2]);
    let step = |&now: &f64| {
        let next = b * (now + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
        (x, y) = ([now, x[0]], [next, y[0]]);
        next
    };
    series.iter().map(step).collect()
}
