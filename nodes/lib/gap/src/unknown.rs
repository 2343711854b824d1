//! Whether what is left is noise.

use cromosim_imu::{EffectKind, Reading};

use crate::Place;
use crate::diagnose::{CALIBRATIONS, Findings};
use crate::fit::Fit;
use crate::gram::dot;
use crate::place::{bands, place, spectrum_of};
use crate::probes::{Probe, probes, with_probes};
use crate::problem::{Problem, axis_of};
use crate::search::debug;

/// Mean square of a whitened residual in a band from which on it is structure. Without any effect
/// none of a hundred placements reached 3.
const BAND: f64 = 12.0;
/// Held-out gain of a regression, nats, likewise; without any effect none reached 0.
const PROBE: f64 = 200.0;
/// Loudest two seconds against the median ones, where outliers are many.
const BURST: f64 = 5.0;
const OUTLIERS: f64 = 0.003;
/// Share of repeated readings.
const FROZEN: f64 = 0.002;
/// Scatter of the stamps' intervals.
const JITTER: f64 = 0.05;
/// Factor on these beside a smoothing of the reference that is undone.
const GUESSED: f64 = 20.0;
/// Part of all that is explained from which on an effect is more than an imitation.
const MAIN_PART: f64 = 0.3;
/// Steps of quantisation, in units of the white noise, beyond which a channel's residual says
/// nothing.
const COARSE_STEPS: f64 = 3.0;
/// Part of the strongest regression's gain from which on another counts.
const SPECIAL_CASE: f64 = 0.3;
/// Part of its gain that an effect keeps beside what the residual depends on, if it is more than an
/// imitation of that.
const OWN_GAIN: f64 = 0.1;

/// Part of what regressions in its place would gain that a calibration has to gain, if it is to
/// stand beside them.
const NEARLY_ALL: f64 = 0.7;

/// Structure that no named effect explains.
#[derive(Clone, Debug)]
pub(crate) struct Unknown {
    pub place: Place,
    pub channel: String,
    pub axes: Vec<String>,
    pub depends_on: String,
    pub probability: f64,
    /// Part of the rest that regressions predict on held-out time, or, without any, that stands out
    /// of the noise.
    pub predictable: f64,
    /// Fitted effects that only imitate it.
    pub imitations: Vec<EffectKind>,
}

/// What the residual of a fit looks like.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signs {
    /// Largest mean square of the whitened residual in a band, by channel.
    pub band: [f64; 2],
    /// Share of values beyond five standard deviations, by channel.
    pub outliers: [f64; 2],
    /// Largest mean square of two seconds over the median one, by channel.
    pub burst: [f64; 2],
    /// Share of readings that repeat the one before in all axes, by channel.
    pub frozen: [f64; 2],
    /// Standard deviation of the stamps' intervals over their median.
    pub jitter: f64,
}

/// Looks for structure in the whitened residual. `calibrations`: whether these may pass for
/// imitations as well; they stand in for each other and for filters, and are judged once the others
/// are gone.
pub(crate) fn look(findings: &Findings, calibrations: bool) -> Option<Unknown> {
    let signs = Signs::of(findings);
    let mut probes = probes(findings);
    probes.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    debug(|| {
        let list: Vec<String> = probes
            .iter()
            .take(4)
            .map(|p| format!("{}/{}:{:.0}", p.depends_on, p.channel, p.gain))
            .collect();
        eprintln!("SIGNS {signs:.3?} {}", list.join(" "));
    });
    // A smoothing whose shape is only guessed leaves much that is none of its own; rounding errors
    // of slow motion are no noise at all.
    let basis = &findings.context.basis;
    let vague = if basis.undone_hz.is_some() {
        GUESSED
    } else {
        1.0
    };
    let coarse = |c: usize| basis.steps[c] > COARSE_STEPS;
    let strong: Vec<&Probe> = probes
        .iter()
        .filter(|probe| probe.gain > PROBE * vague && !coarse(probe.channel))
        .collect();
    let noisy = |c: usize| {
        !coarse(c)
            && (signs.band[c] > BAND * vague
                || (signs.burst[c] > BURST * vague && signs.outliers[c] > OUTLIERS))
    };
    let stuck = |c: usize| signs.frozen[c] > FROZEN && findings.digital[c].lsb.is_none();
    let jittery = signs.jitter > JITTER
        || (findings.without.contains(&EffectKind::DroppedSamples)
            && findings.context.problem.dropped.0 > FROZEN);
    let of_channel =
        |c: usize| noisy(c) || stuck(c) || strong.iter().any(|probe| probe.channel == c);
    if !of_channel(0) && !of_channel(1) && !jittery {
        return None;
    }
    let depends_on = if jittery {
        "time stamps"
    } else if stuck(0) || stuck(1) {
        "repeated readings"
    } else if let Some(probe) = strong.first() {
        probe.depends_on
    } else {
        "time"
    };
    let place = place(
        &findings.state.fit.residual,
        findings.context.problem,
        &findings.context.whitener,
    );
    let channels: Vec<&str> = [(0, "accel"), (1, "gyro")]
        .into_iter()
        .filter(|(c, _)| of_channel(*c))
        .map(|(_, name)| name)
        .collect();
    let channel = if channels.len() == 1 {
        channels[0]
    } else {
        "both"
    };
    let axes = place
        .axes
        .iter()
        .filter(|(_, share)| **share > 0.1)
        .map(|(name, _)| name.clone())
        .collect();
    let (mut imitations, sound) = imitations(findings, &strong);
    let most = strong.first().map_or(0.0, |probe| probe.gain);
    for probe in strong
        .iter()
        .filter(|probe| probe.gain > SPECIAL_CASE * most && changes_over_time(probe, &probes))
    {
        imitations.extend(
            special_cases(probe)
                .into_iter()
                .filter(|kind| !sound.contains(kind)),
        );
    }
    for (c, kind) in [(0, EffectKind::AccelNoise), (1, EffectKind::GyroNoise)] {
        if of_channel(c) || jittery {
            imitations.push(kind);
        }
    }
    if jittery {
        imitations.push(EffectKind::DroppedSamples);
    }
    if !calibrations {
        imitations.retain(|kind| !CALIBRATIONS.contains(kind));
    }
    let gain = strong
        .first()
        .map_or(0.0, |probe| probe.gain)
        .max(signs.band[0].max(signs.band[1]) * 10.0);
    let probability = 0.97 * (1.0 - 1.0 / (2.0 + gain / 20.0));
    let excess = findings.context.excess(&findings.state.fit).max(1.0);
    let predictable = strong
        .first()
        .map_or(0.5, |probe| (probe.gain / excess).clamp(0.05, 1.0));
    Some(Unknown {
        predictable,
        place,
        channel: channel.to_owned(),
        axes,
        depends_on: depends_on.to_owned(),
        probability,
        imitations,
    })
}

/// Whether a family over time says more than the same without time.
fn changes_over_time(probe: &Probe, all: &[Probe]) -> bool {
    let steady = match probe.depends_on {
        "delay over time" => "rate of change",
        "mount over time" => "other axes",
        _ => return true,
    };
    let other = all
        .iter()
        .find(|other| other.channel == probe.channel && other.depends_on == steady);
    other.is_none_or(|other| probe.gain > 1.5 * other.gain)
}

/// Effects that are special cases of what the residual depends on: they say no more than it does.
fn special_cases(probe: &Probe) -> Vec<EffectKind> {
    use EffectKind as K;
    let [bias, drift, scale, misalignment] = if probe.channel == 0 {
        [
            K::AccelBias,
            K::AccelBiasDrift,
            K::AccelScale,
            K::AccelMisalignment,
        ]
    } else {
        [
            K::GyroBias,
            K::GyroBiasDrift,
            K::GyroScale,
            K::GyroMisalignment,
        ]
    };
    match (probe.depends_on, probe.channel) {
        ("delay over time", _) => vec![K::TimeOffset, K::ClockDrift, K::LowPass],
        ("time", _) => vec![bias, drift],
        ("gain over time", _) => vec![scale],
        ("mount over time", _) => vec![K::MountRotation, K::MountSlip, misalignment],
        ("orientation", 1) => vec![K::GyroGSensitivity, bias],
        ("orientation", _) => vec![bias],
        ("specific force", 0) | ("angular rate", 1) => vec![scale, bias],
        ("other axes", _) => vec![misalignment],
        _ => Vec::new(),
    }
}

/// Fitted effects which beside the strongest probes gain less than a tenth of what they gain
/// without them; and calibrations that explain nearly all that the probes in their place would.
fn imitations(findings: &Findings, strong: &[&Probe]) -> (Vec<EffectKind>, Vec<EffectKind>) {
    let fit = &findings.state.fit;
    let context = &findings.context;
    // The strongest two of each channel say what the residual depends on; more only cost time.
    let chosen: Vec<&Vec<Vec<f64>>> = (0..2)
        .flat_map(|c| {
            strong
                .iter()
                .filter(move |probe| probe.channel == c && probe.depends_on != "rate of change")
                .take(2)
        })
        .map(|probe| &probe.columns)
        .collect();
    let (mut imitations, mut sound) = (Vec::new(), Vec::new());
    if chosen.is_empty() {
        return (imitations, sound);
    }
    let together = with_probes(findings, fit, &chosen).held_out;
    let nominal = context.state(cromosim_imu::EffectSet::new());
    let explained = together - nominal.fit.linear.held_out;
    for kind in fit.set.iter().map(|effect| effect.kind()) {
        let smaller = context.state(fit.set.without(kind));
        let instead = with_probes(findings, &smaller.fit, &chosen).held_out;
        let alone = fit.linear.held_out - smaller.fit.linear.held_out;
        let of_probes = instead - smaller.fit.linear.held_out;
        debug(|| {
            eprintln!(
                "   member {} alone {alone:.0}, probes instead {of_probes:.0}, beside {:.0} of {explained:.0}",
                kind.name(),
                together - instead
            )
        });
        if findings.mostly_explained
            && CALIBRATIONS.contains(&kind)
            && alone > NEARLY_ALL * of_probes
        {
            sound.push(kind);
        } else if alone < MAIN_PART * explained && together - instead < OWN_GAIN * alone {
            // What explains much of the gap by itself is no imitation of what little is left.
            imitations.push(kind);
        }
    }
    (imitations, sound)
}

impl Signs {
    fn of(findings: &Findings) -> Self {
        let context = &findings.context;
        let problem = context.problem;
        let fit = &findings.state.fit;
        let mut signs = Self {
            jitter: jitter(problem),
            ..Self::default()
        };
        for channel in 0..2 {
            let spectrum = spectrum_of(&fit.residual, problem, 3 * channel..3 * channel + 3);
            let kept = context.whitener.count[channel] / (3.0 * problem.length as f64);
            let level = |from: f64, to: f64| {
                let band = spectrum.band(from, to);
                band.iter().sum::<f64>() / band.len().max(1) as f64 * problem.rate_hz
                    / 6.0
                    / kept.max(1e-9)
            };
            signs.band[channel] = bands(problem.rate_hz / 2.0)
                .into_iter()
                .skip(1)
                .map(|(a, b)| level(a, b))
                .fold(0.0, f64::max);
            signs.outliers[channel] =
                outliers(fit, problem, channel, context.whitener.count[channel]);
            signs.burst[channel] = burst(findings, channel);
            signs.frozen[channel] = frozen(problem, channel);
        }
        signs
    }
}

fn jitter(problem: &Problem) -> f64 {
    let period = 1.0 / problem.rate_hz;
    let mut intervals: Vec<f64> = (1..problem.stamps.len())
        .filter(|&k| problem.places[k] == problem.places[k - 1] + 1)
        .map(|k| ((problem.stamps[k] - problem.stamps[k - 1]) / period - 1.0).abs())
        .collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals
        .get(intervals.len() / 2)
        .map_or(0.0, |median| median / 0.6745)
}

fn outliers(fit: &Fit, problem: &Problem, channel: usize, count: f64) -> f64 {
    let half = 3 * problem.length;
    let part = &fit.residual[channel * half..(channel + 1) * half];
    let sigma = (dot(part, part) / count.max(1.0)).sqrt().clamp(1.0, 1.5);
    part.iter().filter(|e| e.abs() > 5.0 * sigma).count() as f64 / count.max(1.0)
}

fn burst(findings: &Findings, channel: usize) -> f64 {
    let problem = findings.context.problem;
    let step = ((2.0 * problem.rate_hz) as usize).max(1);
    let mut blocks: Vec<f64> = (0..problem.length / step)
        .filter_map(|block| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for axis in 3 * channel..3 * channel + 3 {
                let range = axis * problem.length + block * step
                    ..axis * problem.length + (block + 1) * step;
                sum += findings.state.fit.residual[range]
                    .iter()
                    .map(|e| e * e)
                    .sum::<f64>();
                weight += findings.context.whitener.weight[axis][block * step..(block + 1) * step]
                    .iter()
                    .map(|w| w * w)
                    .sum::<f64>();
            }
            (weight > step as f64).then(|| sum / weight)
        })
        .collect();
    blocks.sort_unstable_by(f64::total_cmp);
    let median = blocks
        .get(blocks.len() / 2)
        .copied()
        .unwrap_or(1.0)
        .max(1.0);
    blocks.last().copied().unwrap_or(1.0) / median
}

/// Readings equal to the one before in all three axes: a live sensor's noise forbids it, unless it
/// rounds coarsely.
fn frozen(problem: &Problem, channel: usize) -> f64 {
    let same = |a: &Reading, b: &Reading| {
        (3 * channel..3 * channel + 3).all(|axis| axis_of(a, axis) == axis_of(b, axis))
    };
    problem
        .measured
        .windows(2)
        .filter(|pair| same(&pair[0], &pair[1]))
        .count() as f64
        / problem.measured.len() as f64
}
