//! Simulations of a placement under sets of effects, and how far each lies from the readings.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use cromosim_imu::{
    Channel, EffectKind, EffectSet, PerChannel, ReadOff, Reading, SensorModel, expected_rounding,
};
use cromosim_spatial::{KinematicTrack, MotionResponse, PoseEstimate, Stamp};
use nalgebra::{Matrix3, Quaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;

use crate::axes::{channel_of_axis, sum_over_channels, value_on_axis};
use crate::diagnosis::Metrics;
use crate::findings::Findings;
use crate::metrics::Comparison;
use crate::noise_model::NoiseModel;
use crate::noise_updates::ordinary_share;
use crate::prepared::{FOLDS, PreparedPlacement};
use crate::reference_tracks::ReferenceTracks;
use crate::whiten::Whitener;

/// Simulations of one placement, with all covered readings compared, clipped ones as well.
pub(crate) struct Simulations<'a> {
    findings: &'a Findings<'a>,
    pub comparison: Comparison<'a>,
    /// The placement with clipped readings compared as well.
    pub whole: PreparedPlacement,
    tracks: ReferenceTracks<'a>,
    /// Of the fit, at every covered reading.
    residual: Vec<Vec<f64>>,
    /// By the effects that change the predicted noise.
    whiteners: RefCell<BTreeMap<Vec<EffectKind>, Rc<Whitener>>>,
    /// Factors of the device's units.
    units: PerChannel<f64>,
    /// Seed of the simulated noise.
    seed: u64,
}

/// How a sensor is turned.
pub(crate) struct Turn {
    pub sensor_from_world: Matrix3<f64>,
    /// Of one sign throughout a recording.
    pub world_from_segment: Quaternion<f64>,
}

impl Turn {
    /// At each message of a recording.
    pub fn of_sensor(
        track: &KinematicTrack,
        set: &EffectSet,
        prepared: &PreparedPlacement,
    ) -> Vec<Self> {
        let model = SensorModel::new(set, prepared.epoch);
        let turned = model.sensor_from_world(track, &prepared.stamps, 0.0);
        let stamps = prepared.stamps.iter().zip(turned);
        let of = |(stamp, sensor_from_world): (&Stamp, Matrix3<f64>)| Self {
            sensor_from_world,
            world_from_segment: track.quaternion_at(model.true_time(*stamp)),
        };
        stamps.map(of).collect()
    }
}

impl<'a> Simulations<'a> {
    /// `raw` are the readings in the device's units, `covered` the axes of each to be compared.
    pub fn new(
        findings: &'a Findings<'a>,
        raw: &'a [Reading],
        covered: &'a [[bool; 6]],
        seed: u64,
    ) -> Self {
        let prepared = findings.model.prepared;
        let whole = PreparedPlacement {
            usable: covered.to_vec(),
            ..prepared.clone()
        };
        Self {
            findings,
            comparison: Comparison {
                prepared,
                measured: raw,
                covered,
            },
            tracks: ReferenceTracks::new(&findings.model),
            residual: whole.residual(&findings.scored.fit.prediction.readings),
            whiteners: RefCell::default(),
            units: PerChannel::from_fn(|channel| findings.reportable.unit_factor(channel)),
            seed,
            whole,
        }
    }

    /// All that a simulation takes over.
    pub fn applied(&self) -> EffectSet {
        self.findings.applied()
    }

    /// The readings in the device's units under a set of effects, without noise: where they are rounded, their mean.
    pub fn simulate(&self, set: &EffectSet) -> Vec<Reading> {
        self.run(set, &self.tracks.track(set))
    }

    fn run(&self, set: &EffectSet, track: &KinematicTrack) -> Vec<Reading> {
        let model = SensorModel::new(&set.unrounded(), self.whole.epoch);
        let mut readings = model.run(track, &self.whole.stamps);
        let steps = PerChannel::from_fn(|channel| set.lsb(channel) * set.unit_factor(channel));
        if Channel::ALL.into_iter().any(|channel| steps[channel] > 0.0) {
            let of_reference =
                set.reference_variances(&self.tracks.estimate(set), 1.0, &self.whole.stamps);
            let white = PerChannel::from_fn(|channel| self.white_variance(set, channel));
            for (reading, of_reference) in readings.iter_mut().zip(&of_reference) {
                let rounded = |channel: Channel, values: &Vector3<f64>, variance: f64| {
                    let variance = (white[channel] + variance) * set.unit_factor(channel).powi(2);
                    values.map(|value| expected_rounding(value, steps[channel], variance))
                };
                *reading = Reading {
                    specific_force: rounded(
                        Channel::Accelerometer,
                        &reading.specific_force,
                        of_reference.acceleration,
                    ),
                    angular_velocity: rounded(
                        Channel::Gyroscope,
                        &reading.angular_velocity,
                        of_reference.angular_velocity,
                    ),
                };
            }
        }
        readings
    }

    /// What the reference's motion under a set is estimated from.
    pub fn reference_estimate(&self, set: &EffectSet) -> Arc<PoseEstimate> {
        self.tracks.estimate(set)
    }

    /// The same of a motion with a response, where there is one.
    pub fn simulate_with(
        &self,
        set: &EffectSet,
        response: Option<&MotionResponse>,
    ) -> Vec<Reading> {
        let Some(response) = response else {
            return self.simulate(set);
        };
        self.run(set, &self.tracks.track_with(set, response))
    }

    /// How the sensor is turned at each message.
    pub fn turns(&self, set: &EffectSet) -> Vec<Turn> {
        Turn::of_sensor(&self.tracks.track(set), set, &self.whole)
    }

    /// Without rounding: rounding the simulation adds error of its own.
    pub fn simulate_unrounded(&self, set: &EffectSet) -> Vec<Reading> {
        self.simulate(&set.unrounded())
    }

    /// For the noise that is predicted under those effects of `set` that change it.
    pub fn whitener(&self, set: &EffectSet) -> Rc<Whitener> {
        let kinds: Vec<EffectKind> = set
            .iter()
            .map(|effect| effect.kind())
            .filter(|kind| kind.changes_predicted_noise())
            .collect();
        Rc::clone(
            self.whiteners
                .borrow_mut()
                .entry(kinds)
                .or_insert_with(|| Rc::new(self.new_whitener(set))),
        )
    }

    fn new_whitener(&self, set: &EffectSet) -> Whitener {
        let mut basis = self.findings.model.basis.clone();
        for channel in Channel::ALL {
            // Rounding adds step^2 / 12 of noise of its own.
            let variance = self.white_variance(set, channel) + set.lsb(channel).powi(2) / 12.0;
            basis.sigma[channel] = variance.sqrt();
        }
        let scatter = ReadOff::ReferenceScatter;
        let reportable = &self.findings.reportable;
        if reportable.get_read_off(scatter).is_some() && set.get_read_off(scatter).is_none() {
            basis.reference_share = ordinary_share(self.whole.estimate.noise());
        }
        basis.undone_smoothing = self.tracks.undone_smoothing(set);
        basis.estimate = self.tracks.estimate(set);
        Whitener::new(
            &self.whole,
            &NoiseModel::new(&self.whole, &basis, &self.residual),
        )
    }

    /// Variance per sample of the declared white noise and that of a set, in SI units.
    pub fn white_variance(&self, set: &EffectSet, channel: Channel) -> f64 {
        self.findings.declared_sigma(channel).powi(2)
            + set.noise_density(channel).powi(2) * self.whole.rate_hz
    }

    /// Whitened measured less simulated, in SI units.
    pub fn whitened(&self, whitener: &Whitener, simulated: &[Reading]) -> Vec<f64> {
        let measured = self.comparison.measured;
        whitener.apply(&self.whole.scattered([true; 6], |k, axis| {
            (value_on_axis(&measured[k], axis) - value_on_axis(&simulated[k], axis))
                / self.units[channel_of_axis(axis)]
        }))
    }

    /// Sum of the squares of [`Simulations::whitened`].
    pub fn squares(&self, whitener: &Whitener, simulated: &[Reading]) -> f64 {
        self.whitened(whitener, simulated)
            .iter()
            .map(|e| e * e)
            .sum()
    }

    /// Log-likelihood of the readings under a set, nats, less the constant of the normal density.
    pub fn likelihood(&self, whitener: &Whitener, simulated: &[Reading]) -> f64 {
        let volume =
            sum_over_channels(|channel| whitener.count[channel] * whitener.log_scale[channel]);
        -0.5 * self.squares(whitener, simulated) - volume
    }

    fn nll_per_sample(&self, set: &EffectSet, simulated: &[Reading]) -> f64 {
        let whitener = self.whitener(set);
        let samples = (whitener.count.accelerometer + whitener.count.gyroscope) / 6.0;
        let units: f64 = 3.0 * sum_over_channels(|channel| self.units[channel].ln());
        -self.likelihood(&whitener, simulated) / samples.max(1.0)
            + 3.0 * std::f64::consts::TAU.ln()
            + units
    }

    /// Distances of the readings from a simulation without noise under a set of effects.
    pub fn metrics(&self, set: &EffectSet, simulated: &[Reading]) -> Metrics {
        let noisy = self.noisy(set, simulated);
        self.comparison
            .metrics(simulated, &noisy, self.nll_per_sample(set, simulated))
    }

    /// With white noise, in the device's units.
    fn noisy(&self, set: &EffectSet, simulated: &[Reading]) -> Vec<Reading> {
        let mut random = ChaCha12Rng::seed_from_u64(self.seed);
        let sigma = PerChannel::from_fn(|channel| {
            self.units[channel] * self.white_variance(set, channel).sqrt()
        });
        simulated
            .iter()
            .map(|reading| {
                let mut noisy = *reading;
                for axis in 0..3 {
                    let [a, b] = cromosim_imu::normal_pair(&mut random);
                    noisy.specific_force[axis] += sigma.accelerometer * a;
                    noisy.angular_velocity[axis] += sigma.gyroscope * b;
                }
                noisy
            })
            .collect()
    }

    /// What another recording of the device should show: every part of time is simulated with values fitted to the
    /// others, and with the response that was learnt without it, where there are any.
    pub fn held_out(&self, responses: Option<&[MotionResponse]>) -> Vec<Reading> {
        let of_fold = |fold| self.findings.applied_excluding_fold(fold);
        self.fold_by_fold(responses, of_fold)
    }

    /// Every part of time simulated with a set of its own, and with the response that was learnt without it.
    pub fn fold_by_fold(
        &self,
        responses: Option<&[MotionResponse]>,
        set_of_fold: impl Fn(usize) -> EffectSet,
    ) -> Vec<Reading> {
        let mut readings = vec![Reading::default(); self.whole.stamps.len()];
        for fold in 0..FOLDS {
            let response = responses.map(|learnt| &learnt[fold]);
            let own = self.simulate_with(&set_of_fold(fold), response);
            for (k, &entry) in self.whole.grid_index.iter().enumerate() {
                if self.whole.fold(entry) == fold {
                    readings[k] = own[k];
                }
            }
        }
        readings
    }
}
