//! How much of the reference's motion the readings hold, by frequency.

use std::ops::Range;

use cromosim_imu::{Channel, PerChannel, Reading};
use cromosim_spatial::{Complex64, FourierPair, MotionResponse, PoseEstimate};
use nalgebra::{Quaternion, Vector3};

use crate::axes::axes_of_channel;
use crate::findings::Findings;
use crate::fit::{Fit, FitModel};
use crate::policy::response::{
    FEWEST_BLOCKS, LARGEST_FACTOR, LEAST_PART, LEAST_USABLE, MOST_RISE, OPEN, SHUT, STANDARD_ERRORS,
};
use crate::prepared::{FOLDS, PreparedPlacement, bridge};
use crate::simulations::{Simulations, Turn};
use crate::trace::trace;

/// Edges of the bands, Hz: thirds of an octave from 1 Hz on, one a hertz at least. Slower motion is taken as it is.
pub(crate) const EDGES_HZ: Edges = [
    1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 25.0, 30.0, 40.0,
];
pub(crate) const BANDS: usize = 12;
/// Edges of bands, Hz.
pub(crate) type Edges = [f64; BANDS + 1];
/// Length of a window, and of the blocks of time whose windows count as one, s: neighbouring windows overlap by half.
pub(crate) const WINDOW_S: f64 = 2.0;

/// Factors of the bands.
type Factors = PerChannel<[f64; BANDS]>;

/// A response, and those that are learnt without one part of time.
pub(crate) struct LearntResponse {
    pub whole: MotionResponse,
    /// By part of time.
    pub excluding_fold: Vec<MotionResponse>,
}

/// Sums over the windows of a block of time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Block {
    /// The part of time that it belongs to.
    pub fold: usize,
    /// The simulation's power, by band.
    pub simulated: [f64; BANDS],
    /// The simulation times the residual, by band.
    pub both: [f64; BANDS],
    /// The residual's power, by band.
    pub rest: [f64; BANDS],
    /// How many entries of transforms these are sums of, by band.
    pub entries: [f64; BANDS],
    /// The residual's power over all frequencies.
    residual: f64,
}

/// The response that lowers the residual of a recording on time that it was not learnt from; none where it is
/// not by [`LEAST_PART`] of the residual's power in one channel.
///
/// In a band, with X the transforms of the simulation's windows and R those of the residual's, readings are `factor`
/// times the simulation: `factor = 1 + sum Re(X* R) / sum |X|^2`. That is below one where a part of what the
/// reference shows is no motion (errors in variables), and above where it shows less than there is. Factors closer
/// to one than their error, by what they scatter over blocks of time, are one.
fn learn(findings: &Findings, simulations: &Simulations) -> Option<LearntResponse> {
    let set = findings.applied();
    let compared = Compared {
        prepared: findings.model.prepared,
        measured: simulations.comparison.measured,
        simulated: simulations.simulate_unrounded(&set),
        turns: simulations.turns(&set),
    };
    let blocks = PerChannel::from_fn(|channel| blocks(&compared, channel));
    let largest = largest_factors(&findings.model.basis.estimate);
    let factors = |without: Option<usize>| -> Factors {
        PerChannel::from_fn(|channel| factors(&blocks[channel], &largest[channel], without))
    };
    let estimate = simulations.reference_estimate(&set);
    let learnt_from = estimate.densities_at(&centres());
    let excluding: Vec<Factors> = (0..FOLDS).map(|fold| factors(Some(fold))).collect();
    let helps = PerChannel::from_fn(|channel| {
        let own = &blocks[channel];
        let all: f64 = own.iter().map(|block| block.residual).sum();
        let gain = held_out_gain(own, |fold| &excluding[fold][channel]);
        let gain = gain / all.max(f64::MIN_POSITIVE);
        trace(|| eprintln!("response of {channel:?}: {gain:.4} of the residual"));
        gain > LEAST_PART
    });
    let response = |factors: Factors| {
        let of = |channel: Channel| held_at_ends(&factors[channel], helps[channel]);
        MotionResponse {
            hz: centres(),
            position: of(Channel::Accelerometer),
            rotation: of(Channel::Gyroscope),
            learnt_from: Some(learnt_from.clone()),
        }
    };
    Channel::ALL
        .into_iter()
        .any(|channel| helps[channel])
        .then(|| LearntResponse {
            whole: response(factors(None)),
            excluding_fold: excluding.into_iter().map(response).collect(),
        })
}

/// The response of a recording that is kept, and what it shows with it on time that was not fitted to: none where it
/// raises a channel's distance there. The rotation's acts on the accelerometer too, by the orientation and a lever
/// arm.
pub(crate) fn kept(
    findings: &Findings,
    simulations: &Simulations,
) -> (Option<LearntResponse>, Vec<Reading>) {
    let plain = simulations.held_out(None);
    // Where nothing is wrong, nothing is to be made up for.
    let is_wrong = findings.is_loud || findings.unknown.is_some() || !findings.applied().is_empty();
    let Some(learnt) = is_wrong.then(|| learn(findings, simulations)).flatten() else {
        return (None, plain);
    };
    let with = simulations.held_out(Some(&learnt.excluding_fold));
    let [before, after] = [&plain, &with].map(|readings| simulations.comparison.squares(readings));
    trace(|| eprintln!("with the response {after:?} rather than {before:?}"));
    let rises = |channel: Channel| after[channel] > MOST_RISE.powi(2) * before[channel];
    if Channel::ALL.into_iter().any(rises) {
        (None, plain)
    } else {
        (Some(learnt), with)
    }
}

/// Root mean square of a fit's residual beside factors of at most one on its simulation, by frequency, over that without: what
/// is gained where a part of the reference's motion is none.
pub(crate) fn left_beside_attenuation(model: &FitModel, fit: &Fit) -> PerChannel<f64> {
    let prepared = model.prepared;
    let compared = Compared {
        prepared,
        measured: &prepared.measured,
        simulated: fit.prediction.readings.clone(),
        turns: Turn::of_sensor(&model.track, &fit.set, prepared),
    };
    PerChannel::from_fn(|channel| {
        let blocks = blocks(&compared, channel);
        let own = factors(&blocks, &[1.0; BANDS], None);
        let all: f64 = blocks.iter().map(|block| block.residual).sum();
        let gain = held_out_gain(&blocks, |_| &own);
        (1.0 - gain / all.max(f64::MIN_POSITIVE)).max(0.0).sqrt()
    })
}

/// The lowest frequency at which a factor stands, the bands' middles, and where the highest factor ends.
fn centres() -> Vec<f64> {
    let middles = EDGES_HZ.windows(2).map(|edges| 0.5 * (edges[0] + edges[1]));
    let mut hz = vec![0.5 * EDGES_HZ[0]];
    hz.extend(middles);
    hz.push(EDGES_HZ[BANDS]);
    hz
}

/// Factors at [`centres`]: one below the bands; what is faster than all of them is as in the last, but not more than
/// it is.
fn held_at_ends(factors: &[f64; BANDS], helps: bool) -> Vec<f64> {
    if !helps {
        return vec![1.0; BANDS + 2];
    }
    let mut all = vec![1.0];
    all.extend(factors);
    all.push(factors[BANDS - 1].min(1.0));
    all
}

/// The largest factor where a filter lets this part of the motion through: [`LARGEST_FACTOR`] where that is nearly
/// all, and in a straight line down to one where it is shut. There a larger one would undo what the filter keeps out
/// of this motion, and it keeps out something else of the next one (impacts).
fn largest_factor(passed: f64) -> f64 {
    let open = ((passed - SHUT) / (OPEN - SHUT)).clamp(0.0, 1.0);
    1.0 + open * (LARGEST_FACTOR - 1.0)
}

/// The largest factor in the middle of each band.
fn largest_factors(estimate: &PoseEstimate) -> PerChannel<[f64; BANDS]> {
    let passed = |band: usize| estimate.filter_at(0.5 * (EDGES_HZ[band] + EDGES_HZ[band + 1]));
    PerChannel {
        accelerometer: std::array::from_fn(|band| largest_factor(passed(band).0)),
        gyroscope: std::array::from_fn(|band| largest_factor(passed(band).1)),
    }
}

/// Factors from all blocks but those of one part of time, none above the band's largest.
pub(crate) fn factors(
    blocks: &[Block],
    largest: &[f64; BANDS],
    without: Option<usize>,
) -> [f64; BANDS] {
    let used: Vec<&Block> = blocks
        .iter()
        .filter(|block| Some(block.fold) != without)
        .collect();
    std::array::from_fn(|band| {
        let with: Vec<&&Block> = used
            .iter()
            .filter(|block| block.simulated[band] > 0.0)
            .collect();
        let simulated: f64 = with.iter().map(|block| block.simulated[band]).sum();
        if with.len() < FEWEST_BLOCKS || simulated <= 0.0 {
            return 1.0;
        }
        let more = with.iter().map(|block| block.both[band]).sum::<f64>() / simulated;
        let scatter: f64 = with
            .iter()
            .map(|block| (block.both[band] - more * block.simulated[band]).powi(2))
            .sum();
        let count = with.len() as f64;
        let error = (scatter * count / (count - 1.0)).sqrt() / simulated;
        if more.abs() < STANDARD_ERRORS * error {
            return 1.0;
        }
        (1.0 + more).clamp(0.0, largest[band])
    })
}

/// By how much factors lower the residual's power on the part of time without which they were learnt.
pub(crate) fn held_out_gain<'f>(
    blocks: &[Block],
    factors: impl Fn(usize) -> &'f [f64; BANDS],
) -> f64 {
    let mut gain = 0.0;
    for block in blocks {
        for (band, factor) in factors(block.fold).iter().enumerate() {
            let more = factor - 1.0;
            gain += 2.0 * more * block.both[band] - more * more * block.simulated[band];
        }
    }
    gain
}

/// What both channels' coordinates are made of.
struct Compared<'a> {
    prepared: &'a PreparedPlacement,
    measured: &'a [Reading],
    simulated: Vec<Reading>,
    turns: Vec<Turn>,
}

/// The coordinates of a channel, each over the sample grid: the simulation, and the residual (0 where it is not
/// compared).
struct Coordinates {
    simulated: Vec<Vec<f64>>,
    residual: Vec<Vec<f64>>,
    /// How many entries are compared before each.
    known: Vec<usize>,
}

impl Coordinates {
    /// In the coordinates whose filters the response multiplies: of the accelerometer the specific force in the world
    /// (where gravity stands still), of the gyroscope the derivative of the quaternion, `q' = (0, w) q / 2`. In the
    /// sensor's axes a band of these would lie elsewhere as the sensor turns.
    fn of(compared: &Compared<'_>, channel: Channel) -> Self {
        let Compared {
            prepared,
            measured,
            simulated,
            turns,
        } = compared;
        let count = if channel == Channel::Gyroscope { 4 } else { 3 };
        let mut own = Self {
            simulated: vec![vec![0.0; prepared.length]; count],
            residual: vec![vec![0.0; prepared.length]; count],
            known: vec![0; prepared.length + 1],
        };
        let axes = axes_of_channel(channel);
        for (k, &entry) in prepared.grid_index.iter().enumerate() {
            let in_coordinates = |vector: Vector3<f64>| {
                let in_world = turns[k].sensor_from_world.transpose() * vector;
                if channel == Channel::Gyroscope {
                    let rate = Quaternion::from_imag(in_world) * turns[k].world_from_segment * 0.5;
                    rate.coords.as_slice().to_vec()
                } else {
                    in_world.as_slice().to_vec()
                }
            };
            let put = |into: &mut [Vec<f64>], vector| {
                let values = in_coordinates(vector);
                into.iter_mut()
                    .zip(values)
                    .for_each(|(series, value)| series[entry] = value);
            };
            put(&mut own.simulated, simulated[k][channel]);
            if axes.clone().all(|axis| prepared.usable[k][axis]) {
                let residual = measured[k][channel] - simulated[k][channel];
                put(&mut own.residual, residual);
                own.known[entry + 1] = 1;
            }
        }
        for series in &mut own.simulated {
            bridge(series, prepared.grid_index.iter().copied());
        }
        for entry in 0..prepared.length {
            own.known[entry + 1] += own.known[entry];
        }
        own
    }
}

/// One channel of a recording.
fn blocks(compared: &Compared<'_>, channel: Channel) -> Vec<Block> {
    let prepared = compared.prepared;
    let coordinates = Coordinates::of(compared, channel);
    let bands = Bands::new(prepared.rate_hz, WINDOW_S, &EDGES_HZ);
    bands.blocks(prepared, |range, block| {
        let known = coordinates.known[range.end] - coordinates.known[range.start];
        if (known as f64) < LEAST_USABLE * range.len() as f64 {
            return;
        }
        for (motion, rest) in coordinates.simulated.iter().zip(&coordinates.residual) {
            bands.add(&motion[range.clone()], &rest[range.clone()], block);
        }
    })
}

/// Transforms of Hann windows that overlap by half, by bands.
pub(crate) struct Bands {
    edges_hz: &'static Edges,
    window_s: f64,
    transform: FourierPair,
    hann: Vec<f64>,
    spacing_hz: f64,
}

impl Bands {
    pub fn new(rate_hz: f64, window_s: f64, edges_hz: &'static Edges) -> Self {
        let window = ((window_s * rate_hz).round() as usize).max(2);
        let turn = std::f64::consts::TAU / window as f64;
        Self {
            edges_hz,
            window_s,
            transform: FourierPair::new(window),
            hann: (0..window)
                .map(|k| 0.5 - 0.5 * (turn * (k as f64 + 0.5)).cos())
                .collect(),
            spacing_hz: rate_hz / window as f64,
        }
    }

    /// The blocks of a recording: each window is added to that of its middle.
    pub fn blocks(
        &self,
        prepared: &PreparedPlacement,
        mut add: impl FnMut(Range<usize>, &mut Block),
    ) -> Vec<Block> {
        let window = self.hann.len();
        let place = |entry: usize| (entry as f64 / (self.window_s * prepared.rate_hz)) as usize;
        let mut blocks = vec![Block::default(); place(prepared.length) + 1];
        let starts = (0..).map(|index| index * (window / 2));
        for start in starts.take_while(|start| start + window <= prepared.length) {
            let middle = start + window / 2;
            let block = &mut blocks[place(middle)];
            block.fold = prepared.fold(middle);
            add(start..start + window, block);
        }
        blocks.retain(|block| block.residual > 0.0);
        blocks
    }

    /// Lowest and highest frequency of a band, Hz.
    pub fn range_hz(&self, band: usize) -> [f64; 2] {
        [self.edges_hz[band], self.edges_hz[band + 1]]
    }

    /// Expected power of an entry of white noise of unit variance.
    pub fn power_of_one(&self) -> f64 {
        self.hann.iter().map(|weight| weight * weight).sum()
    }

    /// Sum of the squares of a series, by the sum of the entries' power: each entry stands for two (its conjugate is left
    /// out), and each value is in two windows.
    pub fn squares_per_power(&self) -> f64 {
        1.0 / self.power_of_one()
    }

    /// Both series in one complex transform, as its real and imaginary part.
    pub fn add(&self, motion: &[f64], rest: &[f64], block: &mut Block) {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (level, offset) = (mean(motion), mean(rest));
        let mut values: Vec<Complex64> = self
            .hann
            .iter()
            .zip(motion.iter().zip(rest))
            .map(|(weight, (own, other))| {
                Complex64::new(weight * (own - level), weight * (other - offset))
            })
            .collect();
        self.transform.forward(&mut values);
        let length = values.len();
        for k in 1..length.div_ceil(2) {
            let (here, there) = (values[k], values[length - k].conj());
            let motion = (here + there) * 0.5;
            let rest = (here - there) * Complex64::new(0.0, -0.5);
            block.residual += rest.norm_sqr();
            let hz = k as f64 * self.spacing_hz;
            let next = self.edges_hz.partition_point(|edge| *edge <= hz);
            if (1..=BANDS).contains(&next) {
                block.simulated[next - 1] += motion.norm_sqr();
                block.both[next - 1] += (motion.conj() * rest).re;
                block.rest[next - 1] += rest.norm_sqr();
                block.entries[next - 1] += 1.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows of a recording that share one motion, of which the readings hold so many times what is shown.
    fn windows_with(factor: f64) -> Vec<Block> {
        let window = |k: usize| {
            let power = 1.0 + 0.2 * (k as f64).sin();
            Block {
                fold: k % FOLDS,
                simulated: [power; BANDS],
                both: [(factor - 1.0) * power + 1e-4 * (1.7 * k as f64).cos(); BANDS],
                residual: 1.0,
                ..Block::default()
            }
        };
        (0..40).map(window).collect()
    }

    /// BROAD 08: on average over its rests 0.86 to 0.90 pass, and the readings hold 1.02 to 1.06 times the motion.
    #[test]
    fn a_filter_that_rests_have_lowered_lets_small_factors_stand() {
        for (passed, held, expected) in [
            (0.95, 1.5, 1.5),
            (0.89, 1.06, 1.06),
            (0.8, 1.06, 1.06),
            (0.8, 1.9, 1.0 + 1.0 / 3.0),
            (0.7, 1.06, 1.0),
            (0.7, 0.5, 0.5),
        ] {
            let largest = [largest_factor(passed); BANDS];
            let [found, ..] = factors(&windows_with(held), &largest, None);
            assert!((found - expected).abs() < 1e-3, "{passed}: {found}");
        }
    }
}
